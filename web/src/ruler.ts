// The ruler: distance and direction between two points or bodies of the workspace, and between the surfaces of discs.

import { signed, text, type Context, type Viewport } from "./geometry.ts";
import type { Body, Model } from "./model.ts";
import type { Theme } from "./theme.ts";

/** A point, or the middle of a body, which the ruler follows. */
export type End = number[] | Body;

export interface Measured {
  distance: number;
  /** [rad] From the first end to the second. */
  angle: number;
  /** [m] Between the surfaces; null unless both ends are discs. */
  clearance: number | null;
}

function place(model: Model, end: End): number[] | null {
  return Array.isArray(end) ? end : model.at(end);
}

/** [m] Radius of a body that is a disc; null of other bodies and points. */
function radius(model: Model, end: End): number | null {
  if (Array.isArray(end)) return null;
  const info = model.info(end);
  const [part, more] = model.scene!.shapes[info.shape]!;
  return more || part!.corners.length > 1 ? null : part!.radius;
}

/** What lies between two ends; null while a body does not exist. */
export function measured(model: Model, from: End, to: End): Measured | null {
  const [a, b] = [place(model, from), place(model, to)];
  if (!a || !b) return null;
  const distance = Math.hypot(b[0]! - a[0]!, b[1]! - a[1]!);
  const [r, s] = [radius(model, from), radius(model, to)];
  return { distance, angle: Math.atan2(b[1]! - a[1]!, b[0]! - a[0]!), clearance: r === null || s === null ? null : distance - r - s };
}

export function drawRuler(g: Context, model: Model, [from, to]: [End, End], view: Viewport, theme: Theme): void {
  const [a, b, found] = [place(model, from), place(model, to), measured(model, from, to)];
  if (!a || !b || !found) return;
  const [x0, y0, x1, y1] = [view.px(a[0]!), view.py(a[1]!), view.px(b[0]!), view.py(b[1]!)];
  const size = Math.hypot(x1 - x0, y1 - y0) || 1;
  const [nx, ny] = [(6 * (y0 - y1)) / size, (6 * (x1 - x0)) / size];
  for (const [colour, width] of [
    [theme.halo, 5],
    [theme.ink, 2],
  ] as const) {
    g.strokeStyle = colour;
    g.lineWidth = width;
    g.beginPath();
    g.moveTo(x0, y0);
    g.lineTo(x1, y1);
    for (const [x, y] of [[x0, y0], [x1, y1]] as const) {
      g.moveTo(x - nx, y - ny);
      g.lineTo(x + nx, y + ny);
    }
    g.stroke();
  }
  const between = found.clearance === null ? "" : `, between surfaces ${signed(found.clearance, 2)} m`;
  const words = `${found.distance.toFixed(2)} m, ${signed((found.angle * 180) / Math.PI, 0)}°${between}`;
  text(g, theme, words, (x0 + x1) / 2, (y0 + y1) / 2 - 10, { align: "center", bold: true, size: 13 });
}
