// The workspace in the plane: robots, obstacles, paths, goal, and the committed manoeuvre.

import { robotColour } from "./colouring.ts";
import { arrow, drawShape, number, polyline, round, text, ticks, type Context, type Viewport } from "./geometry.ts";
import { drawBorders, drawNames } from "./highlights.ts";
import { drawManoeuvre } from "./manoeuvres.ts";
import type { Model } from "./model.ts";
import type { Control } from "./protocol.ts";
import { css, viridis, type Theme } from "./theme.ts";

const CROWD = 60;
/** [pixel] Least distance of the handle of a velocity from its body. */
const SHORT = 18;

export interface Look {
  theme: Theme;
  view: Viewport;
  width: number;
  height: number;
  handles: boolean;
}

export function drawWorkspace(g: Context, model: Model, look: Look): void {
  g.fillStyle = look.theme.paper;
  g.fillRect(0, 0, look.width, look.height);
  drawGrid(g, look);
  const current = model.overlay();
  const times = contactTimes(current);
  if (current) drawPredictions(g, model, current, look);
  drawTrack(g, model, look);
  drawBorders(g, model, look);
  drawObstacles(g, model, times, current, look);
  drawGoal(g, model, look);
  if (current) drawTarget(g, model, current, look);
  drawRobots(g, model, times, current, look);
  if (current) drawManoeuvre(g, model, current, look);
  drawSelected(g, model, look);
  drawNames(g, model, look);
  drawScale(g, look);
}

export function drawGrid(g: Context, { theme, view, width, height }: Look): void {
  const [x0, y1] = view.inverse(0, 0);
  const [x1, y0] = view.inverse(width, height);
  g.strokeStyle = theme.grid;
  g.lineWidth = 1;
  g.beginPath();
  for (const x of ticks(x0, x1, width / 90)) {
    g.moveTo(Math.round(view.px(x)) + 0.5, 0);
    g.lineTo(Math.round(view.px(x)) + 0.5, height);
  }
  for (const y of ticks(y0, y1, width / 90)) {
    g.moveTo(0, Math.round(view.py(y)) + 0.5);
    g.lineTo(width, Math.round(view.py(y)) + 0.5);
  }
  g.stroke();
}

export function drawScale(g: Context, { theme, view, height }: Look): void {
  const step = round(60 / view.scale);
  const size = step * view.scale;
  const [left, base] = [14, height - 14];
  g.strokeStyle = theme.ink;
  g.lineWidth = 2;
  g.beginPath();
  g.moveTo(left, base - 4);
  g.lineTo(left, base);
  g.lineTo(left + size, base);
  g.lineTo(left + size, base - 4);
  g.stroke();
  text(g, theme, `${number(step)} m`, left + size / 2, base - 6, { align: "center", size: 11 });
}

/** Contact times with the preferred control, by "robot 3" or "obstacle 5". */
function contactTimes(control: Control | null): Map<string, number> {
  const found = new Map<string, number>();
  if (!control) return found;
  const contact = control.arrays["contact"]!.values;
  control.others.forEach(([kind, k], row) => {
    if (contact[row]! >= 0) found.set(`${kind} ${k}`, contact[row]! / control.horizon);
  });
  return found;
}

function drawPredictions(g: Context, model: Model, control: Control, { theme, view }: Look): void {
  const positions = control.arrays["positions"];
  if (!positions) return;
  const d = model.scene!.dimension;
  const count = positions.shape[0]!;
  const m = positions.shape[1]!;
  const contact = control.arrays["contact"]!.values;
  g.lineCap = "butt";
  control.predicted.forEach((row, column) => {
    const hit = contact[row]! >= 0;
    g.lineWidth = hit ? 2.2 : 1.2;
    for (let k = 0; k + 1 < count; k++) {
      const a = (k * m + column) * d;
      const b = ((k + 1) * m + column) * d;
      const values = positions.values;
      if (!Number.isFinite(values[a]!) || !Number.isFinite(values[b]!)) continue;
      const share = (k + 0.5) / (count - 1);
      g.strokeStyle = css(viridis(share, theme), hit ? 0.95 : 0.55 * (1 - 0.6 * share));
      g.beginPath();
      g.moveTo(view.px(values[a]!), view.py(values[a + 1]!));
      g.lineTo(view.px(values[b]!), view.py(values[b + 1]!));
      g.stroke();
    }
  });
}

function drawTrack(g: Context, model: Model, { theme, view }: Look): void {
  const scene = model.scene!;
  const d = scene.dimension;
  const points: number[][] = [];
  for (let i = 0; i <= model.step; i++) {
    const at = i * model.positions.width + model.selected * d;
    points.push([model.positions.values[at]!, model.positions.values[at + 1]!]);
  }
  points.push(model.robot(model.selected));
  g.strokeStyle = theme.robot;
  g.globalAlpha = 0.45;
  g.lineWidth = 2;
  polyline(g, view, points);
  g.stroke();
  g.globalAlpha = 1;
}

function drawObstacles(g: Context, model: Model, times: Map<string, number>, control: Control | null, look: Look): void {
  const { theme, view } = look;
  const scene = model.scene!;
  const role = model.colouring === "role" || scene.robots.length === 1;
  scene.obstacles.forEach((info, k) => {
    const at = model.obstacle(k);
    if (!at) return;
    const share = role ? times.get(`obstacle ${k}`) : undefined;
    const fill = share === undefined ? theme.neutral : css(viridis(share, theme));
    drawShape(g, view, scene.shapes[info.shape]!, at, model.heading(k), fill, theme.ink, share === undefined ? 0.8 : 1.4);
    const grown = control?.arrays["growth"];
    const row = control?.predicted.findIndex((r) => control.others[r]![0] === "obstacle" && control.others[r]![1] === k);
    if (grown && row !== undefined && row >= 0) {
      const last = grown.values[(grown.shape[0]! - 1) * grown.shape[1]! + row]!;
      if (last > 0) {
        g.setLineDash([3, 3]);
        drawShape(g, view, scene.shapes[info.shape]!, at, model.heading(k), null, theme.faint, 1, grown.values[row]!);
        g.setLineDash([]);
      }
    }
  });
}

function drawGoal(g: Context, model: Model, { theme, view }: Look): void {
  const scene = model.scene!;
  const robot = scene.robots[model.selected]!;
  if (robot.path) {
    g.strokeStyle = theme.goal;
    g.setLineDash([6, 4]);
    g.lineWidth = 1.2;
    polyline(g, view, robot.path);
    g.stroke();
    g.setLineDash([]);
  }
  const goal = model.goal(model.selected);
  const [x, y] = [view.px(goal[0]!), view.py(goal[1]!)];
  g.strokeStyle = theme.goal;
  g.lineWidth = 2;
  g.beginPath();
  g.arc(x, y, Math.max(8, robot.tolerance * view.scale), 0, 2 * Math.PI);
  g.moveTo(x - 5, y);
  g.lineTo(x + 5, y);
  g.moveTo(x, y - 5);
  g.lineTo(x, y + 5);
  g.stroke();
}

/** The target that guidance or its path gives the selected robot, where it is not the goal. */
function drawTarget(g: Context, model: Model, control: Control, { theme, view }: Look): void {
  if (!control.target) return;
  const at = model.robot(model.selected);
  const [x, y] = [view.px(control.target[0]!), view.py(control.target[1]!)];
  g.strokeStyle = theme.goal;
  g.lineWidth = 1.2;
  g.setLineDash([2, 3]);
  g.beginPath();
  g.moveTo(view.px(at[0]!), view.py(at[1]!));
  g.lineTo(x, y);
  g.stroke();
  g.setLineDash([]);
  g.lineWidth = 2;
  g.strokeRect(x - 5, y - 5, 10, 10);
}

/** Pixel of the handle of a velocity: where the body would be after a second, but not on the body itself. */
export function tip(view: Viewport, at: number[], velocity: number[]): [number, number] {
  const [vx, vy] = [velocity[0]! * view.scale, -velocity[1]! * view.scale];
  const size = Math.hypot(vx, vy);
  const [x, y] = [view.px(at[0]!), view.py(at[1]!)];
  if (size >= SHORT) return [x + vx, y + vy];
  const [ux, uy] = size > 1e-6 ? [vx / size, vy / size] : [1, 0];
  return [x + SHORT * ux, y + SHORT * uy];
}

function drawRobots(g: Context, model: Model, times: Map<string, number>, control: Control | null, look: Look): void {
  const { theme, view } = look;
  const scene = model.scene!;
  const n = scene.robots.length;
  if (n === 1) return;
  const batches = new Map<string, Path2D>();
  for (let k = 0; k < n; k++) {
    if (k === model.selected || !model.present(k)) continue;
    const at = model.robot(k);
    const share = model.colouring === "role" ? times.get(`robot ${k}`) : undefined;
    const colour = share === undefined ? robotColour(model, k, theme) : css(viridis(Math.round(share * 12) / 12, theme));
    const info = scene.robots[k]!;
    const parts = scene.shapes[info.shape]!;
    if (parts.length === 1 && parts[0]!.corners.length === 1) {
      let path = batches.get(colour);
      if (!path) batches.set(colour, (path = new Path2D()));
      const [x, y] = [view.px(at[0]!), view.py(at[1]!)];
      const radius = Math.max(1.5, info.radius * view.scale);
      path.moveTo(x + radius, y);
      path.arc(x, y, radius, 0, 2 * Math.PI);
    } else drawShape(g, view, parts, at, 0, colour, theme.ink, 1);
  }
  g.strokeStyle = theme.ink;
  g.lineWidth = n > CROWD ? 0.6 : 1;
  for (const [colour, path] of batches) {
    g.fillStyle = colour;
    g.fill(path);
    g.stroke(path);
  }
  if (n <= CROWD && !control) {
    for (let k = 0; k < n; k++) if (model.present(k)) arrow(g, view, model.robot(k), model.velocity(k), theme.ink, 1.2);
  }
}

function drawSelected(g: Context, model: Model, { theme, view, handles }: Look): void {
  const scene = model.scene!;
  const k = model.selected;
  const at = model.robot(k);
  const several = scene.robots.length > 1;
  const fill = several && model.colouring !== "role" ? robotColour(model, k, theme) : theme.robot;
  drawShape(g, view, scene.shapes[scene.robots[k]!.shape]!, at, 0, fill, theme.ink, 1.5);
  if (several) {
    g.strokeStyle = theme.robot;
    g.lineWidth = 2.5;
    g.beginPath();
    g.arc(view.px(at[0]!), view.py(at[1]!), Math.max(10, scene.robots[k]!.radius * view.scale + 4), 0, 2 * Math.PI);
    g.stroke();
  }
  const v = model.velocity(k);
  arrow(g, view, at, v, theme.ink, 2);
  if (handles) {
    const goal = model.goal(k);
    for (const [x, y] of [tip(view, at, v), [view.px(goal[0]!), view.py(goal[1]!)]] as const) {
      g.beginPath();
      g.arc(x, y, 4.5, 0, 2 * Math.PI);
      g.fillStyle = theme.paper;
      g.fill();
      g.strokeStyle = theme.ink;
      g.lineWidth = 1.5;
      g.stroke();
    }
  }
}
