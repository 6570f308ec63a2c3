// The workspace in space: perspective, with a ground grid; dragging turns the view.

import { text, ticks, type Context } from "./geometry.ts";
import type { Model } from "./model.ts";
import { css, viridis, type Theme } from "./theme.ts";
import { forPredicted, interpolated, robotColour } from "./workspace.ts";

export interface Camera {
  yaw: number;
  pitch: number;
  distance: number;
}

interface Projected {
  x: number;
  y: number;
  depth: number;
  scale: number;
}

export class Eye {
  private readonly middle: number[];
  private readonly size: number;
  readonly floor: number;
  constructor(
    model: Model,
    private readonly camera: Camera,
    private readonly width: number,
    private readonly height: number,
  ) {
    const scene = model.scene!;
    this.middle = scene.low.map((x, c) => (x + scene.high[c]!) / 2);
    this.floor = scene.low[2]!;
    this.size = Math.max(...scene.low.map((x, c) => scene.high[c]! - x));
  }

  project(point: number[]): Projected {
    const [x, y, z] = point.map((p, c) => (p - this.middle[c]!) / this.size) as [number, number, number];
    const { yaw, pitch, distance } = this.camera;
    const side = Math.cos(yaw) * x + Math.sin(yaw) * y;
    const ahead = -Math.sin(yaw) * x + Math.cos(yaw) * y;
    const up = Math.cos(pitch) * z - Math.sin(pitch) * ahead;
    const depth = distance + Math.cos(pitch) * ahead + Math.sin(pitch) * z;
    const scale = (1.35 * Math.min(this.width, 1.4 * this.height)) / Math.max(0.1, depth);
    return { x: this.width / 2 + scale * side, y: this.height / 2 - scale * up, depth, scale: scale / this.size };
  }
}

interface Ball {
  at: number[];
  radius: number;
  colour: string;
  label?: string;
}

export function drawSpace(
  g: Context,
  model: Model,
  theme: Theme,
  camera: Camera,
  width: number,
  height: number,
): void {
  const scene = model.scene!;
  const eye = new Eye(model, camera, width, height);
  g.fillStyle = theme.paper;
  g.fillRect(0, 0, width, height);
  drawGround(g, model, theme, eye);
  const control = model.control();
  const balls: Ball[] = [];
  const contact = new Map<string, number>();
  if (control) {
    const times = control.arrays["contact"]!.values;
    control.others.forEach(([kind, k], row) => {
      if (times[row]! >= 0) contact.set(`${kind} ${k}`, times[row]! / control.horizon);
    });
    drawPaths(g, model, theme, eye);
    const clock = control.arrays["times"]!.values;
    if (model.element > 0) {
      forPredicted(model, control, model.element, clock, (shape, at, _heading, more) => {
        ring(g, eye, at, shape[0]!.radius + more, theme.faint);
      });
      const path = control.arrays["manoeuvre"];
      const own = path && interpolated(path.values, 3, clock, model.element);
      if (own) ring(g, eye, own, scene.robots[model.selected]!.radius, theme.robot);
    }
  }
  scene.obstacles.forEach((info, k) => {
    const at = model.obstacle(k);
    const share = contact.get(`obstacle ${k}`);
    const colour = share === undefined ? theme.neutral : css(viridis(share, theme));
    if (!at) return;
    for (const part of scene.shapes[info.shape]!) {
      part.corners.forEach((corner) =>
        balls.push({ at: at.map((x, c) => x + corner[c]!), radius: part.radius, colour }),
      );
    }
  });
  scene.robots.forEach((robot, k) => {
    if (!model.present(k)) return;
    const own = k === model.selected;
    balls.push({ at: model.robot(k), radius: robot.radius, colour: own ? theme.robot : robotColour(model, k, theme) });
  });
  balls.sort((a, b) => eye.project(b.at).depth - eye.project(a.at).depth);
  for (const ball of balls) drawBall(g, theme, eye, ball);
  const goal = eye.project(scene.robots[model.selected]!.goal);
  g.strokeStyle = theme.goal;
  g.lineWidth = 2;
  g.beginPath();
  g.arc(goal.x, goal.y, Math.max(5, scene.robots[model.selected]!.tolerance * goal.scale), 0, 2 * Math.PI);
  g.stroke();
}

function ring(g: Context, eye: Eye, at: number[], radius: number, colour: string): void {
  const p = eye.project(at);
  g.strokeStyle = colour;
  g.lineWidth = 1.5;
  g.setLineDash([4, 3]);
  g.beginPath();
  g.arc(p.x, p.y, Math.max(2, radius * p.scale), 0, 2 * Math.PI);
  g.stroke();
  g.setLineDash([]);
}

function drawBall(g: Context, theme: Theme, eye: Eye, { at, radius, colour }: Ball): void {
  const p = eye.project(at);
  const ground = eye.project([at[0]!, at[1]!, eye.floor]);
  g.strokeStyle = theme.faint;
  g.globalAlpha = 0.5;
  g.lineWidth = 1;
  g.beginPath();
  g.moveTo(p.x, p.y);
  g.lineTo(ground.x, ground.y);
  g.stroke();
  g.globalAlpha = 1;
  const size = Math.max(2, radius * p.scale);
  g.fillStyle = colour;
  g.strokeStyle = theme.ink;
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

function drawGround(g: Context, model: Model, theme: Theme, eye: Eye): void {
  const { low, high } = model.scene!;
  const floor = eye.floor;
  g.strokeStyle = theme.grid;
  g.lineWidth = 1;
  g.beginPath();
  const line = (a: number[], b: number[]): void => {
    const [p, q] = [eye.project(a), eye.project(b)];
    g.moveTo(p.x, p.y);
    g.lineTo(q.x, q.y);
  };
  const [xs, ys] = [ticks(low[0]!, high[0]!, 8), ticks(low[1]!, high[1]!, 8)];
  for (const x of xs) line([x, low[1]!, floor], [x, high[1]!, floor]);
  for (const y of ys) line([low[0]!, y, floor], [high[0]!, y, floor]);
  g.stroke();
  const corner = [low[0]!, low[1]!, floor];
  for (const [axis, name] of [
    [0, "x"],
    [1, "y"],
    [2, "z"],
  ] as const) {
    const tip = [...corner];
    tip[axis] = tip[axis]! + 0.18 * (high[0]! - low[0]!);
    const [p, q] = [eye.project(corner), eye.project(tip)];
    g.strokeStyle = theme.ink;
    g.beginPath();
    g.moveTo(p.x, p.y);
    g.lineTo(q.x, q.y);
    g.stroke();
    text(g, theme, name, q.x + 4, q.y - 4, { size: 12, bold: true });
  }
}

function drawPaths(g: Context, model: Model, theme: Theme, eye: Eye): void {
  const control = model.control()!;
  const positions = control.arrays["positions"];
  const curve = (values: ArrayLike<number>, at: (k: number) => number, count: number, colour: (s: number) => string) => {
    for (let k = 0; k + 1 < count; k++) {
      const point = (j: number): number[] => [0, 1, 2].map((c) => values[at(j) + c]!);
      const [a, b] = [point(k), point(k + 1)];
      if (!Number.isFinite(a[0]!) || !Number.isFinite(b[0]!)) continue;
      const [p, q] = [eye.project(a), eye.project(b)];
      g.strokeStyle = colour((k + 0.5) / (count - 1));
      g.beginPath();
      g.moveTo(p.x, p.y);
      g.lineTo(q.x, q.y);
      g.stroke();
    }
  };
  g.lineWidth = 1.4;
  if (positions) {
    const m = positions.shape[1]!;
    control.predicted.forEach((_, column) =>
      curve(
        positions.values,
        (k) => (k * m + column) * 3,
        positions.shape[0]!,
        (s) => css(viridis(s, theme), 0.8 - 0.5 * s),
      ),
    );
  }
  const track = model.positions;
  g.lineWidth = 2;
  g.globalAlpha = 0.5;
  curve(track.values, (k) => k * track.width + 3 * model.selected, model.step + 1, () => theme.robot);
  g.globalAlpha = 1;
  const path = control.arrays["manoeuvre"];
  g.lineWidth = 3;
  if (path) curve(path.values, (k) => 3 * k, path.shape[0]!, () => theme.robot);
}
