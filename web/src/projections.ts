// Projections of the control space of a robot in space, which also select the plane of the slice.

import { text, Viewport, type Context } from "./geometry.ts";
import type { Panel } from "./control.ts";
import type { Control } from "./protocol.ts";
import { viridis, type Theme } from "./theme.ts";

const OUTSIDE = 254;
const NONE = 255;
const STEPS = 250;
const GAP = 20;
const TOP = 20;

/** [pixel] Width that the projections need beside the slice; 0 for a robot in the plane. */
export function projectionsWidth(control: Control, { width, height }: Panel): number {
  if (control.planes.length < 2) return 0;
  return Math.round(Math.min(0.27 * width, (height - TOP - 3 * GAP) / 3));
}

/** The viewports of the projections, one below the other at the right border. */
export function projectionViews(control: Control, panel: Panel): Viewport[] {
  const side = projectionsWidth(control, panel);
  return control.planes.map(
    (plane, k) => new Viewport(0, 0, side / (2 * plane.half), side, side, panel.width - side - 4, TOP + k * (side + GAP)),
  );
}

export function drawProjections(g: Context, control: Control, panel: Panel): void {
  if (control.planes.length < 2) return;
  projectionViews(control, panel).forEach((view, k) => drawProjection(g, control, panel, view, k));
}

function drawProjection(g: Context, control: Control, panel: Panel, view: Viewport, k: number): void {
  const { theme } = panel;
  const plane = control.planes[k]!;
  const shadow = control.arrays[`shadow${k}`];
  const border = control.arrays[`silhouette${k}`];
  g.save();
  g.beginPath();
  g.rect(view.left, view.top, view.width, view.height);
  g.clip();
  if (shadow && border) {
    const outline = path(border.values, view);
    g.save();
    g.clip(outline);
    const n = shadow.shape[0]!;
    const cell = view.width / (n - 1);
    g.imageSmoothingEnabled = true;
    g.drawImage(picture(control, k, theme), view.left - cell / 2, view.top - cell / 2, n * cell, n * cell);
    g.restore();
    g.strokeStyle = theme.ink;
    g.lineWidth = 1.6;
    g.stroke(outline);
  }
  drawCut(g, control, panel, view, k);
  for (const [point, hollow] of [
    [control.preferred, true],
    [control.chosen, false],
  ] as const) {
    if (!point) continue;
    const inside = (x: number): number => Math.max(-0.94 * plane.half, Math.min(0.94 * plane.half, x));
    g.beginPath();
    g.arc(view.px(inside(point[plane.axes[0]]!)), view.py(inside(point[plane.axes[1]]!)), hollow ? 4.5 : 3.5, 0, 2 * Math.PI);
    g.strokeStyle = theme.halo;
    g.lineWidth = 4;
    g.stroke();
    g.fillStyle = hollow ? theme.paper : theme.robot;
    g.fill();
    g.strokeStyle = hollow ? theme.robot : theme.paper;
    g.lineWidth = hollow ? 2 : 1;
    g.stroke();
  }
  g.restore();
  const here = k === panel.plane;
  g.strokeStyle = here ? theme.goal : theme.faint;
  g.lineWidth = here ? 2.5 : 1;
  g.strokeRect(view.left + 0.5, view.top + 0.5, view.width, view.height);
  const letters = ["x", "y", "z"];
  const axes = plane.axes.map((axis) => `${control.quantity.letter}${letters[axis]}`).join(", ");
  const words = view.width > 84 ? `${k + 1}: ${axes}${here ? " (slice)" : ""}` : `${k + 1}: ${axes}`;
  text(g, theme, words, view.left, view.top - 5, { size: 11, plain: true, bold: here, colour: here ? theme.goal : theme.faint });
}

/** The line in which the slice cuts the plane of another projection. */
function drawCut(g: Context, control: Control, panel: Panel, view: Viewport, k: number): void {
  if (k === panel.plane) return;
  const [slice, plane] = [control.planes[panel.plane]!, control.planes[k]!];
  const hidden = [0, 1, 2].find((axis) => !slice.axes.includes(axis))!;
  const at = slice.through[hidden]!;
  g.strokeStyle = panel.theme.goal;
  g.lineWidth = 1.5;
  g.setLineDash([4, 3]);
  g.beginPath();
  if (plane.axes[0] === hidden) {
    g.moveTo(view.px(at), view.top);
    g.lineTo(view.px(at), view.top + view.height);
  } else {
    g.moveTo(view.left, view.py(at));
    g.lineTo(view.left + view.width, view.py(at));
  }
  g.stroke();
  g.setLineDash([]);
}

function path(values: ArrayLike<number>, view: Viewport): Path2D {
  const found = new Path2D();
  for (let k = 0; 2 * k < values.length; k++) {
    const [x, y] = [view.px(values[2 * k]!), view.py(values[2 * k + 1]!)];
    if (k) found.lineTo(x, y);
    else found.moveTo(x, y);
  }
  found.closePath();
  return found;
}

const pictures = new WeakMap<Control, Map<string, HTMLCanvasElement>>();

/** Colours of a projection; those of cells without an admissible control are those of a neighbour, under the border. */
function picture(control: Control, k: number, theme: Theme): HTMLCanvasElement {
  let known = pictures.get(control);
  if (!known) pictures.set(control, (known = new Map()));
  const key = `${k} ${theme.paper}`;
  const found = known.get(key);
  if (found) return found;
  const grid = control.arrays[`shadow${k}`]!;
  const n = grid.shape[0]!;
  const values = Uint8Array.from(grid.values);
  grid.values.forEach((value, j) => {
    if (value !== OUTSIDE) return;
    const near = [j - 1, j + 1, j - n, j + n].map((i) => grid.values[i]).filter((v) => v !== undefined && v < OUTSIDE);
    values[j] = near.length ? Math.min(...(near as number[])) : NONE;
  });
  const canvas = document.createElement("canvas");
  canvas.width = canvas.height = n;
  const g = canvas.getContext("2d")!;
  const image = g.createImageData(n, n);
  for (let row = 0; row < n; row++) {
    for (let column = 0; column < n; column++) {
      const value = values[(n - 1 - row) * n + column]!;
      if (value === NONE) continue;
      image.data.set([...viridis(value / STEPS, theme), 255], 4 * (row * n + column));
    }
  }
  g.putImageData(image, 0, 0);
  known.set(key, canvas);
  return canvas;
}
