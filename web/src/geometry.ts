// Viewports, shapes and text on a canvas.

import type { Part } from "./protocol.ts";
import type { Theme } from "./theme.ts";

export type Context = CanvasRenderingContext2D;

/** Factor of all type in pictures, for a lecture. */
export const type = { scale: 1 };

/** Map from a part of the plane to pixels, y upwards. */
export class Viewport {
  constructor(
    public x: number,
    public y: number,
    public scale: number,
    public width: number,
    public height: number,
    public left = 0,
    public top = 0,
  ) {}

  /** The viewport that shows a box within a rectangle of pixels. */
  static fit(low: number[], high: number[], left: number, top: number, width: number, height: number): Viewport {
    const scale = Math.min(width / (high[0]! - low[0]!), height / (high[1]! - low[1]!));
    return new Viewport((low[0]! + high[0]!) / 2, (low[1]! + high[1]!) / 2, scale, width, height, left, top);
  }

  /** Whether a pixel is in the picture. */
  holds(x: number, y: number): boolean {
    return x >= this.left && x <= this.left + this.width && y >= this.top && y <= this.top + this.height;
  }

  px(x: number): number {
    return this.left + this.width / 2 + (x - this.x) * this.scale;
  }

  py(y: number): number {
    return this.top + this.height / 2 - (y - this.y) * this.scale;
  }

  inverse(px: number, py: number): [number, number] {
    return [
      this.x + (px - this.left - this.width / 2) / this.scale,
      this.y - (py - this.top - this.height / 2) / this.scale,
    ];
  }
}

/** Adds the outline of a rounded hull's core; a disc is an arc. Returns the radius that is to be stroked around it. */
function core(path: Path2D, view: Viewport, part: Part, at: number[], heading: number): number {
  const c = Math.cos(heading);
  const s = Math.sin(heading);
  part.corners.forEach(([x, y], k) => {
    const px = view.px(at[0]! + c * x! - s * y!);
    const py = view.py(at[1]! + s * x! + c * y!);
    if (k) path.lineTo(px, py);
    else path.moveTo(px, py);
  });
  if (part.corners.length > 2) path.closePath();
  return part.radius * view.scale;
}

/** Draws a union of rounded hulls with a border. */
export function drawShape(
  g: Context,
  view: Viewport,
  parts: Part[],
  at: number[],
  heading: number,
  fill: string | null,
  stroke: string | null,
  line = 1,
  grown = 0,
): void {
  const only = parts[0]!;
  if (parts.length === 1 && only.corners.length === 1) {
    g.beginPath();
    const [x, y] = only.corners[0]!;
    const c = Math.cos(heading);
    const s = Math.sin(heading);
    const radius = Math.max(1, (only.radius + grown) * view.scale);
    g.arc(view.px(at[0]! + c * x! - s * y!), view.py(at[1]! + s * x! + c * y!), radius, 0, 2 * Math.PI);
    if (fill) {
      g.fillStyle = fill;
      g.fill();
    }
    if (stroke) {
      g.strokeStyle = stroke;
      g.lineWidth = line;
      g.stroke();
    }
    return;
  }
  g.save();
  g.lineJoin = g.lineCap = "round";
  const cores = parts.map((part) => {
    const path = new Path2D();
    return { path, radius: core(path, view, part, at, heading) + grown * view.scale, flat: part.corners.length < 3 };
  });
  for (const border of [true, false]) {
    const colour = border ? stroke : fill;
    if (!colour) continue;
    g.fillStyle = g.strokeStyle = colour;
    for (const { path, radius, flat } of cores) {
      if (!flat) g.fill(path);
      // A wall without thickness is a line.
      const width = 2 * radius + (border ? 2 * line : flat ? Math.max(0, 1.5 - 2 * radius) : 0);
      g.lineWidth = width;
      if (width > 0) g.stroke(path);
    }
  }
  g.restore();
}

export function polyline(g: Context, view: Viewport, points: Iterable<number[]>): void {
  g.beginPath();
  let first = true;
  for (const [x, y] of points) {
    if (!Number.isFinite(x!)) {
      first = true;
      continue;
    }
    if (first) g.moveTo(view.px(x!), view.py(y!));
    else g.lineTo(view.px(x!), view.py(y!));
    first = false;
  }
}

export function arrow(g: Context, view: Viewport, from: number[], vector: number[], colour: string, width: number): void {
  const [x0, y0] = [view.px(from[0]!), view.py(from[1]!)];
  const [x1, y1] = [view.px(from[0]! + vector[0]!), view.py(from[1]! + vector[1]!)];
  const size = Math.hypot(x1 - x0, y1 - y0);
  if (size < 3) return;
  const [ux, uy] = [(x1 - x0) / size, (y1 - y0) / size];
  const head = Math.min(8, size);
  g.strokeStyle = g.fillStyle = colour;
  g.lineWidth = width;
  g.beginPath();
  g.moveTo(x0, y0);
  g.lineTo(x1 - 0.8 * head * ux, y1 - 0.8 * head * uy);
  g.stroke();
  g.beginPath();
  g.moveTo(x1, y1);
  g.lineTo(x1 - head * ux - 0.45 * head * uy, y1 - head * uy + 0.45 * head * ux);
  g.lineTo(x1 - head * ux + 0.45 * head * uy, y1 - head * uy - 0.45 * head * ux);
  g.fill();
}

export function text(
  g: Context,
  theme: Theme,
  words: string,
  x: number,
  y: number,
  options: { align?: CanvasTextAlign; baseline?: CanvasTextBaseline; colour?: string; size?: number; bold?: boolean; plain?: boolean } = {},
): void {
  const [stroke, width, fill] = [g.strokeStyle, g.lineWidth, g.fillStyle];
  g.font = `${options.bold ? "600 " : ""}${(options.size ?? 12) * type.scale}px system-ui, sans-serif`;
  g.textAlign = options.align ?? "left";
  g.textBaseline = options.baseline ?? "alphabetic";
  g.lineJoin = "round";
  g.strokeStyle = theme.halo;
  g.lineWidth = 3;
  if (!options.plain) g.strokeText(words, x, y);
  g.fillStyle = options.colour ?? theme.ink;
  g.fillText(words, x, y);
  [g.strokeStyle, g.lineWidth, g.fillStyle] = [stroke, width, fill];
}

/** The least round number from `least` on: 1, 2 or 5 times a power of 10. */
export function round(least: number): number {
  const power = 10 ** Math.floor(Math.log10(least));
  return [1, 2, 5, 10].map((m) => m * power).find((s) => s >= least)!;
}

/** Round numbers between two limits, about `count` of them. */
export function ticks(low: number, high: number, count: number): number[] {
  const step = round((high - low) / Math.max(1, count));
  const found: number[] = [];
  for (let k = Math.ceil(low / step - 1e-9); k * step <= high + 1e-9 * step; k++) found.push(k * step);
  return found;
}

/** Numbers for an axis: about `count`, and at least two besides 0. */
export function labels(low: number, high: number, count: number): number[] {
  for (let most = Math.max(1, count); ; most *= 1.25) {
    const found = ticks(low, high, most);
    if (found.filter((value) => value !== 0).length > 1) return found;
  }
}

export function number(x: number): string {
  const rounded = Number(x.toPrecision(6));
  return String(Object.is(rounded, -0) ? 0 : rounded).replace("-", "−");
}

/** A number with some decimals, and a minus sign as long as a digit. */
export function signed(x: number, decimals: number): string {
  return (Number(x.toFixed(decimals)) + 0).toFixed(decimals).replace("-", "−");
}

/** Corners of the convex hull, counter-clockwise. */
export function hull(points: number[][]): number[][] {
  const sorted = [...points].sort((a, b) => a[0]! - b[0]! || a[1]! - b[1]!);
  if (sorted.length < 3) return sorted;
  const half = (ordered: number[][]): number[][] => {
    const chain: number[][] = [];
    for (const p of ordered) {
      while (chain.length > 1) {
        const a = chain[chain.length - 2]!;
        const b = chain[chain.length - 1]!;
        if ((b[0]! - a[0]!) * (p[1]! - a[1]!) - (b[1]! - a[1]!) * (p[0]! - a[0]!) > 0) break;
        chain.pop();
      }
      chain.push(p);
    }
    return chain.slice(0, -1);
  };
  return [...half(sorted), ...half(sorted.reverse())];
}

/** Points around a convex polygon, a segment or a point (corners counter-clockwise) at a distance. */
export function rounded(corners: number[][], radius: number): number[][] {
  const n = corners.length;
  const found: number[][] = [];
  corners.forEach(([x, y], k) => {
    const [before, after] = [corners[(k + n - 1) % n]!, corners[(k + 1) % n]!];
    // Angles of the normals of the edges before and after the corner.
    const from = n > 1 ? Math.atan2(y! - before[1]!, x! - before[0]!) - Math.PI / 2 : 0;
    const to = n > 1 ? Math.atan2(after[1]! - y!, after[0]! - x!) - Math.PI / 2 : 2 * Math.PI;
    const turn = n > 1 ? (((to - from) % (2 * Math.PI)) + 2 * Math.PI) % (2 * Math.PI) : 2 * Math.PI;
    const count = Math.max(1, Math.ceil(turn / 0.1));
    for (let j = 0; j <= count; j++) {
      const angle = from + (turn * j) / count;
      found.push([x! + radius * Math.cos(angle), y! + radius * Math.sin(angle)]);
    }
  });
  return found;
}
