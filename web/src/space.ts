// The workspace in space: perspective, with a ground grid; dragging turns the view.

import { Eye } from "./camera.ts";
import { robotColour } from "./colouring.ts";
import { labels, number, text, type Context } from "./geometry.ts";
import { drawNamesInSpace } from "./highlights.ts";
import type { Model } from "./model.ts";
import { forPredicted, interpolated } from "./predicted.ts";
import type { Control } from "./protocol.ts";
import { css, viridis, type Theme } from "./theme.ts";

interface Ball {
  at: number[];
  radius: number;
  colour: string;
}

export function drawSpace(g: Context, model: Model, theme: Theme, eye: Eye, width: number, height: number): void {
  const scene = model.scene!;
  g.fillStyle = theme.paper;
  g.fillRect(0, 0, width, height);
  drawGround(g, model, theme, eye);
  const control = model.overlay();
  drawTrack(g, model, theme, eye);
  if (control) {
    drawPredictions(g, control, theme, eye);
    drawManoeuvres(g, model, control, theme, eye);
  }
  const all = balls(model, control, theme);
  all.sort((a, b) => eye.project(b.at).depth - eye.project(a.at).depth);
  for (const ball of all) drawStem(g, theme, eye, ball.at, ball.radius);
  drawGoal(g, model, theme, eye);
  for (const ball of all) drawBall(g, theme, eye, ball);
  if (control && model.element > 0) drawGhosts(g, model, control, theme, eye);
  drawNamesInSpace(g, model, theme, eye);
  if (scene.robots.length > 1) ring(g, eye, model.robot(model.selected), 1.6 * scene.robots[model.selected]!.radius, theme.robot, []);
}

function balls(model: Model, control: Control | null, theme: Theme): Ball[] {
  const scene = model.scene!;
  const contact = new Map<string, number>();
  const times = control?.arrays["contact"]!.values;
  control?.others.forEach(([kind, k], row) => {
    if (times![row]! >= 0) contact.set(`${kind} ${k}`, times![row]! / control.horizon);
  });
  const colour = (key: string, otherwise: string): string => {
    const share = contact.get(key);
    return share === undefined ? otherwise : css(viridis(share, theme));
  };
  const found: Ball[] = [];
  const roles = model.colouring === "role" || scene.robots.length === 1;
  scene.obstacles.forEach((info, k) => {
    const at = model.obstacle(k);
    if (!at) return;
    const shown = roles ? colour(`obstacle ${k}`, theme.neutral) : theme.neutral;
    for (const part of scene.shapes[info.shape]!) {
      for (const corner of part.corners) {
        found.push({ at: at.map((x, c) => x + corner[c]!), radius: part.radius, colour: shown });
      }
    }
  });
  scene.robots.forEach((robot, k) => {
    if (!model.present(k)) return;
    const own = roles ? theme.neutral : robotColour(model, k, theme);
    const shown = k === model.selected && roles ? theme.robot : roles ? colour(`robot ${k}`, own) : own;
    const alone = scene.robots.length === 1;
    found.push({ at: model.robot(k), radius: robot.radius, colour: alone ? theme.robot : shown });
  });
  return found;
}

function ring(g: Context, eye: Eye, at: number[], radius: number, colour: string, dash: number[], line = 1.5): void {
  const p = eye.project(at);
  g.strokeStyle = colour;
  g.lineWidth = line;
  g.setLineDash(dash);
  g.beginPath();
  g.arc(p.x, p.y, Math.max(2, radius * p.scale), 0, 2 * Math.PI);
  g.stroke();
  g.setLineDash([]);
}

/** A line to the ground and the shadow there, which show the height. */
function drawStem(g: Context, theme: Theme, eye: Eye, at: number[], radius: number, colour = theme.faint): void {
  const p = eye.project(at);
  const ground = eye.project([at[0]!, at[1]!, eye.floor]);
  g.strokeStyle = g.fillStyle = colour;
  g.globalAlpha = 0.55;
  g.lineWidth = 1;
  g.beginPath();
  g.moveTo(p.x, p.y);
  g.lineTo(ground.x, ground.y);
  g.stroke();
  g.globalAlpha = 0.25;
  g.beginPath();
  for (let k = 0; k < 24; k++) {
    const [c, s] = [Math.cos((k * Math.PI) / 12), Math.sin((k * Math.PI) / 12)];
    const q = eye.project([at[0]! + radius * c, at[1]! + radius * s, eye.floor]);
    if (k) g.lineTo(q.x, q.y);
    else g.moveTo(q.x, q.y);
  }
  g.fill();
  g.globalAlpha = 1;
}

function drawBall(g: Context, theme: Theme, eye: Eye, { at, radius, colour }: Ball): void {
  const p = eye.project(at);
  const size = Math.max(2, radius * p.scale);
  g.fillStyle = colour;
  g.strokeStyle = theme.ink;
  g.lineWidth = 1;
  g.beginPath();
  g.arc(p.x, p.y, size, 0, 2 * Math.PI);
  g.fill();
  g.stroke();
  const shine = g.createRadialGradient(p.x - 0.35 * size, p.y - 0.35 * size, 0.1 * size, p.x, p.y, size);
  shine.addColorStop(0, "rgba(255,255,255,0.55)");
  shine.addColorStop(0.5, "rgba(255,255,255,0)");
  shine.addColorStop(1, "rgba(0,0,0,0.25)");
  g.fillStyle = shine;
  g.fill();
}

function drawGoal(g: Context, model: Model, theme: Theme, eye: Eye): void {
  const { tolerance } = model.scene!.robots[model.selected]!;
  const goal = model.goal(model.selected);
  const p = eye.project(goal);
  drawStem(g, theme, eye, goal, tolerance, theme.goal);
  ring(g, eye, goal, Math.max(tolerance, 6 / p.scale), theme.goal, [], 2.5);
}

function drawGhosts(g: Context, model: Model, control: Control, theme: Theme, eye: Eye): void {
  const clock = control.arrays["times"]!.values;
  forPredicted(model, control, model.element, clock, (shape, at, _heading, more) => {
    ring(g, eye, at, shape[0]!.radius + more, theme.faint, [4, 3]);
  });
  const path = model.path(control);
  if (!path) return;
  const own = interpolated(path.values, 3, clock, model.element);
  ring(g, eye, own, model.scene!.robots[model.selected]!.radius, theme.robot, [4, 3], 2);
}

function drawGround(g: Context, model: Model, theme: Theme, eye: Eye): void {
  const { low, high } = model.scene!;
  const floor = eye.floor;
  const line = (a: number[], b: number[]): void => {
    const [p, q] = [eye.project(a), eye.project(b)];
    g.moveTo(p.x, p.y);
    g.lineTo(q.x, q.y);
  };
  const [xs, ys, zs] = [0, 1, 2].map((c) => labels(low[c]!, high[c]!, c === 2 ? 3 : 5)) as [number[], number[], number[]];
  g.strokeStyle = theme.grid;
  g.lineWidth = 1;
  g.beginPath();
  for (const x of xs) line([x, low[1]!, floor], [x, high[1]!, floor]);
  for (const y of ys) line([low[0]!, y, floor], [high[0]!, y, floor]);
  g.stroke();
  // The axes are at the borders that nothing hides: x and y at the nearest corner, z at the leftmost.
  const corners = [0, 1, 2, 3].map((k) => [k & 1 ? high[0]! : low[0]!, k & 2 ? high[1]! : low[1]!, floor]);
  const depth = (point: number[]): number => eye.project(point).depth;
  const nearest = corners.reduce((a, b) => (depth(b) < depth(a) ? b : a));
  const leftmost = corners.reduce((a, b) => (eye.project(b).x < eye.project(a).x ? b : a));
  drawAxis(g, theme, eye, 0, xs, [low[0]!, high[0]!], nearest, "x [m]");
  drawAxis(g, theme, eye, 1, ys, [low[1]!, high[1]!], nearest, "y [m]");
  drawAxis(g, theme, eye, 2, zs, [low[2]!, high[2]!], leftmost, "z [m]");
}

/** An axis through a corner of the ground, with its numbers outside. */
function drawAxis(
  g: Context,
  theme: Theme,
  eye: Eye,
  axis: number,
  values: number[],
  [low, high]: [number, number],
  corner: number[],
  name: string,
): void {
  const at = (value: number): { x: number; y: number } => eye.project(corner.map((x, c) => (c === axis ? value : x)));
  const [p, q] = [at(low), at(high)];
  g.strokeStyle = theme.ink;
  g.lineWidth = 1.2;
  g.beginPath();
  g.moveTo(p.x, p.y);
  g.lineTo(q.x, q.y);
  g.stroke();
  const upright = axis === 2;
  const words = { size: 11, colour: theme.faint, align: upright ? ("right" as const) : ("center" as const) };
  for (const value of values) {
    const mark = at(value);
    text(g, theme, number(value), mark.x - (upright ? 6 : 0), mark.y + (upright ? 4 : 15), words);
  }
  const middle = at((low + high) / 2);
  const place = upright ? { x: q.x, y: q.y - 8 } : { x: middle.x, y: middle.y + 30 };
  text(g, theme, name, place.x, place.y, { size: 12, bold: true, align: "center" });
}

type Colour = (share: number) => string;

/** A curve through `count` points, coloured along its length. */
function curve(g: Context, eye: Eye, count: number, point: (k: number) => number[], colour: Colour): void {
  for (let k = 0; k + 1 < count; k++) {
    const [a, b] = [point(k), point(k + 1)];
    if (!Number.isFinite(a[0]!) || !Number.isFinite(b[0]!)) continue;
    const [p, q] = [eye.project(a), eye.project(b)];
    g.strokeStyle = colour((k + 0.5) / (count - 1));
    g.beginPath();
    g.moveTo(p.x, p.y);
    g.lineTo(q.x, q.y);
    g.stroke();
  }
}

function triple(values: ArrayLike<number>, at: number): number[] {
  return [values[at]!, values[at + 1]!, values[at + 2]!];
}

function drawTrack(g: Context, model: Model, theme: Theme, eye: Eye): void {
  const track = model.positions;
  g.lineWidth = 2;
  g.globalAlpha = 0.45;
  curve(g, eye, model.step + 1, (k) => triple(track.values, k * track.width + 3 * model.selected), () => theme.robot);
  g.globalAlpha = 1;
}

function drawPredictions(g: Context, control: Control, theme: Theme, eye: Eye): void {
  const positions = control.arrays["positions"];
  if (!positions) return;
  const [count, m] = [positions.shape[0]!, positions.shape[1]!];
  const contact = control.arrays["contact"]!.values;
  control.predicted.forEach((row, column) => {
    const hit = contact[row]! >= 0;
    g.lineWidth = hit ? 2.6 : 1.6;
    const colour: Colour = (s) => css(viridis(s, theme), hit ? 0.95 : 0.75 - 0.35 * s);
    curve(g, eye, count, (k) => triple(positions.values, (k * m + column) * 3), colour);
  });
}

/** The manoeuvre of the preferred control up to its first contact, and the committed or tried one. */
function drawManoeuvres(g: Context, model: Model, control: Control, theme: Theme, eye: Eye): void {
  const [times, gain] = [control.arrays["times"]!.values, control.arrays["gain"]!.values];
  const drift = control.arrays["drift"]!.values;
  const contact = control.first >= 0 ? control.arrays["contact"]!.values[control.first]! : Infinity;
  const along = (k: number): number[] => control.preferred.map((u, c) => drift[3 * k + c]! + gain[k]! * u);
  const count = Array.from(times).filter((t) => t <= contact + 1e-6).length;
  g.lineWidth = 1.4;
  g.strokeStyle = theme.ink;
  g.setLineDash([6, 4]);
  g.beginPath();
  for (let k = 0; k < count; k++) {
    const p = eye.project(along(k));
    if (k) g.lineTo(p.x, p.y);
    else g.moveTo(p.x, p.y);
  }
  g.stroke();
  g.setLineDash([]);
  const path = model.path(control);
  if (!path) return;
  g.lineCap = "round";
  for (const [colour, width] of [
    [theme.halo, 6],
    [theme.robot, 3],
  ] as const) {
    g.lineWidth = width;
    curve(g, eye, path.shape[0]!, (k) => triple(path.values, 3 * k), () => colour);
  }
  g.lineCap = "butt";
  g.fillStyle = theme.robot;
  for (let second = 1; second <= control.horizon; second++) {
    const p = eye.project(interpolated(path.values, 3, times, second));
    g.beginPath();
    g.arc(p.x, p.y, 3.4, 0, 2 * Math.PI);
    g.fill();
  }
}
