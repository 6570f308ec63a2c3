// The control space: control obstacles by time to collision, admissible set, preferred and chosen control.

import { drawDeciding, drawElements } from "./elements.ts";
import { labels, number, text, type, Viewport, type Context } from "./geometry.ts";
import { emphasised } from "./highlights.ts";
import type { Model } from "./model.ts";
import type { Control, PlaneInfo } from "./protocol.ts";
import { drawProjections, projectionsWidth } from "./projections.ts";
import { css, viridis, type Theme } from "./theme.ts";

const NONE = 255;
const STEPS = 250;
const FOOT = 40;
/** [pixel] Left and right of the square: axis and colour bar, in a panel narrower than NARROW without their names. */
const SIDES: [number, number] = [48, 62];
const NARROW_SIDES: [number, number] = [30, 46];
export const NARROW = 420;
/** [1] An admissible set smaller than this share of the panel is also shown enlarged, in a corner. */
const SMALL = 0.2;
/** [1] Side of that picture, as a share of the panel. */
const ENLARGED = 0.36;

export interface Panel {
  width: number;
  height: number;
  theme: Theme;
  plane: number;
  zoom: number;
}

/** The viewport of a control space in a canvas of this size. */
export function controlView(control: Control, panel: Panel): Viewport {
  const { height, zoom } = panel;
  const plane = control.planes[panel.plane]!;
  const beside = projectionsWidth(control, panel);
  const view = square(panel.width - (beside ? beside + 10 : 0), height, plane.half, panel.width >= NARROW);
  view.scale *= zoom;
  return view;
}

/** The viewport of a square of controls about 0, with room for axes and bar, and for their names if `named`. */
export function square(width: number, height: number, half: number, named: boolean): Viewport {
  const [before, after] = (named ? SIDES : NARROW_SIDES).map((side) => side * type.scale) as [number, number];
  const side = Math.max(40, Math.min(width - before - after, height - FOOT * type.scale - 12));
  const left = before + (width - before - after - side) / 2;
  return new Viewport(0, 0, side / (2 * half), side, side, left, 8);
}

export function drawControl(g: Context, model: Model, control: Control, panel: Panel): void {
  const { theme, width, height } = panel;
  g.fillStyle = theme.paper;
  g.fillRect(0, 0, width, height);
  const plane = control.planes[panel.plane]!;
  const view = controlView(control, panel);
  g.save();
  g.beginPath();
  g.rect(view.left, view.top, view.width, view.height);
  g.clip();
  drawTimes(g, control, plane, panel, view);
  drawOutlines(g, model, control, panel, view);
  if (model.scene!.dimension === 2) {
    if (model.element > 0) drawElements(g, model, control, view, theme);
    if (model.deciding && !model.hidden) drawDeciding(g, model, control, view, theme);
  }
  drawAdmissible(g, control, panel, view);
  const inset = enlargedView(control, panel, view);
  const marks = controlMarks(model, control, plane);
  drawMarks(g, marks.filter(({ point }) => !inset || !within(inset, point)), view, theme);
  g.restore();
  if (inset) drawEnlarged(g, model, control, panel, plane, view, inset);
  const named = panel.width >= NARROW;
  const { letter, unit } = control.quantity;
  drawAxes(g, plane.axes.map((axis) => letter + "xyz"[axis]), unit, view, theme, named);
  drawBar(g, control.horizon, view, theme, named);
  drawProjections(g, control, panel);
}

const images = new WeakMap<Control, Map<string, HTMLCanvasElement>>();

/** Colours of a grid of times as a picture; beyond the outlines the nearest colours go on. */
function picture(control: Control, plane: number, theme: Theme, spread: boolean): HTMLCanvasElement {
  const key = `${plane} ${theme.paper}`;
  let known = images.get(control);
  if (!known) images.set(control, (known = new Map()));
  const found = known.get(key);
  if (found) return found;
  const grid = control.arrays[`grid${plane}`]!;
  const n = grid.shape[0]!;
  let values = Uint8Array.from(grid.values);
  for (let round = 0; spread && round < 3; round++) {
    const next = Uint8Array.from(values);
    for (let k = 0; k < values.length; k++) {
      if (values[k] !== NONE) continue;
      for (const j of [k - 1, k + 1, k - n, k + n, k - n - 1, k + n + 1, k - n + 1, k + n - 1]) {
        const there = values[j];
        if (there !== undefined && there !== NONE) next[k] = Math.min(next[k]!, there);
      }
    }
    values = next;
  }
  const canvas = document.createElement("canvas");
  canvas.width = canvas.height = n;
  const g = canvas.getContext("2d")!;
  const image = g.createImageData(n, n);
  for (let row = 0; row < n; row++) {
    for (let column = 0; column < n; column++) {
      const value = values[(n - 1 - row) * n + column]!;
      if (value === NONE) continue;
      const [r, green, b] = viridis(value / STEPS, theme);
      image.data.set([r, green, b, 255], 4 * (row * n + column));
    }
  }
  g.putImageData(image, 0, 0);
  known.set(key, canvas);
  return canvas;
}

/** The outlines of all rows, or of those that are chosen. */
function rings(control: Control, plane: number, view: Viewport, chosen: (row: number) => boolean = () => true): Path2D | null {
  const points = control.arrays[`rings${plane}`];
  if (!points) return null;
  const ends = control.arrays[`ends${plane}`]!.values;
  const owners = control.arrays[`owners${plane}`]!.values;
  const path = new Path2D();
  let begin = 0;
  ends.forEach((end, ring) => {
    for (let k = begin; k < end && chosen(owners[ring]!); k++) {
      const [x, y] = [view.px(points.values[2 * k]!), view.py(points.values[2 * k + 1]!)];
      if (k === begin) path.moveTo(x, y);
      else path.lineTo(x, y);
      if (k === end - 1) path.closePath();
    }
    begin = end;
  });
  return path;
}

function drawTimes(g: Context, control: Control, plane: PlaneInfo, panel: Panel, view: Viewport): void {
  const outline = rings(control, panel.plane, view);
  const exact = plane.through.length === 2;
  if (exact && !outline) return;
  const image = picture(control, panel.plane, panel.theme, exact);
  const cell = (2 * plane.half * view.scale) / (image.width - 1);
  const size = image.width * cell;
  g.save();
  // Outer curves run one way and holes the other, so that the rule "nonzero" fills the union.
  if (outline) g.clip(outline, "nonzero");
  g.imageSmoothingEnabled = true;
  g.imageSmoothingQuality = "high";
  g.drawImage(image, view.px(-plane.half) - cell / 2, view.py(plane.half) - cell / 2, size, size);
  g.restore();
}

function drawOutlines(g: Context, model: Model, control: Control, panel: Panel, view: Viewport): void {
  const outline = rings(control, panel.plane, view);
  if (!outline) return;
  g.strokeStyle = panel.theme.blocked;
  g.globalAlpha = 0.75;
  g.lineWidth = 0.8;
  g.stroke(outline);
  g.globalAlpha = 1;
  if (!model.focus.length) return;
  g.strokeStyle = panel.theme.mark;
  g.lineWidth = 3;
  g.stroke(rings(control, panel.plane, view, (row) => emphasised(model, control, row))!);
}

function drawAdmissible(g: Context, control: Control, panel: Panel, view: Viewport): void {
  const points = control.arrays[`admissible${panel.plane}`];
  if (!points) return;
  const path = new Path2D();
  for (let k = 0; 2 * k < points.values.length; k++) {
    const [x, y] = [view.px(points.values[2 * k]!), view.py(points.values[2 * k + 1]!)];
    if (k) path.lineTo(x, y);
    else path.moveTo(x, y);
  }
  path.closePath();
  for (const [colour, width] of [
    [panel.theme.halo, 5],
    [panel.theme.ink, 2.2],
  ] as const) {
    g.strokeStyle = colour;
    g.lineWidth = width;
    g.stroke(path);
  }
}

/** The picture of a small admissible set, in the corner farthest from it; null for a larger set, and in space. */
export function enlargedView(control: Control, panel: Panel, view: Viewport): Viewport | null {
  const border = control.arrays[`admissible${panel.plane}`]?.values;
  if (!border || control.planes.length > 1) return null;
  const [low, high] = [[Infinity, Infinity], [-Infinity, -Infinity]];
  border.forEach((x, k) => {
    low[k % 2] = Math.min(low[k % 2]!, x);
    high[k % 2] = Math.max(high[k % 2]!, x);
  });
  const half = 0.75 * Math.max(high[0]! - low[0]!, high[1]! - low[1]!);
  if (2 * half * view.scale > SMALL * view.width) return null;
  const [x, y] = [(low[0]! + high[0]!) / 2, (low[1]! + high[1]!) / 2];
  const side = ENLARGED * view.width;
  const left = view.left + (view.px(x) > view.left + view.width / 2 ? 5 : view.width - side - 5);
  const top = view.top + (view.py(y) > view.top + view.height / 2 ? 5 : view.height - side - 5);
  return new Viewport(x, y, side / (2 * half), side, side, left, top);
}

function drawEnlarged(
  g: Context,
  model: Model,
  control: Control,
  panel: Panel,
  plane: PlaneInfo,
  view: Viewport,
  inset: Viewport,
): void {
  const { theme } = panel;
  const frame = (left: number, top: number, side: number): void => g.strokeRect(left, top, side, side);
  g.save();
  g.beginPath();
  g.rect(inset.left, inset.top, inset.width, inset.height);
  g.fillStyle = theme.paper;
  g.fill();
  g.clip();
  drawTimes(g, control, plane, panel, inset);
  drawOutlines(g, model, control, panel, inset);
  if (model.deciding && !model.hidden) drawDeciding(g, model, control, inset, theme);
  drawAdmissible(g, control, panel, inset);
  drawMarks(g, controlMarks(model, control, plane).filter(({ point }) => within(inset, point)), inset, theme);
  g.restore();
  g.strokeStyle = theme.ink;
  g.lineWidth = 1;
  frame(inset.left, inset.top, inset.width);
  const size = (inset.width / inset.scale) * view.scale;
  frame(view.px(inset.x) - size / 2, view.py(inset.y) - size / 2, size);
}

/** Whether a point of the plane is in a picture. */
function within(view: Viewport, [x, y]: [number, number]): boolean {
  return Math.max(Math.abs(x - view.x), Math.abs(y - view.y)) * view.scale <= view.width / 2;
}

interface Mark {
  point: [number, number];
  hollow: boolean;
}

/** The preferred and the chosen control on the plane. */
function controlMarks(model: Model, control: Control, plane: PlaneInfo): Mark[] {
  const tried = model.probe && model.probe.slot === control.slot;
  const chosen = tried ? model.probe!.control : model.hidden ? null : control.chosen;
  return [control.preferred, chosen].flatMap((u, k) =>
    u ? [{ point: [u[plane.axes[0]]!, u[plane.axes[1]]!] as [number, number], hollow: k === 0 }] : [],
  );
}

function drawMarks(g: Context, marks: Mark[], view: Viewport, theme: Theme): void {
  for (const { point, hollow } of marks) drawMark(g, point, hollow, view, theme);
}

/** A control as a disc or ring; a diamond at the border where it is outside the picture. */
export function drawMark(g: Context, point: [number, number], hollow: boolean, view: Viewport, theme: Theme): void {
  const inset = 9;
  const [px, py] = [view.px(point[0]), view.py(point[1])];
  const x = Math.min(view.left + view.width - inset, Math.max(view.left + inset, px));
  const y = Math.min(view.top + view.height - inset, Math.max(view.top + inset, py));
  const outside = Math.abs(x - px) + Math.abs(y - py) > 0.5;
  g.beginPath();
  if (outside) {
    g.moveTo(x, y - 7);
    g.lineTo(x + 7, y);
    g.lineTo(x, y + 7);
    g.lineTo(x - 7, y);
    g.closePath();
  } else g.arc(x, y, hollow ? 6.5 : 5.5, 0, 2 * Math.PI);
  g.strokeStyle = theme.halo;
  g.lineWidth = 6;
  g.stroke();
  g.fillStyle = hollow ? theme.paper : theme.robot;
  g.fill();
  g.strokeStyle = hollow ? theme.robot : theme.paper;
  g.lineWidth = hollow ? 2.6 : 1.2;
  g.stroke();
}

/** Frame and axes of a control space, and the names of its axes: both below a narrow one. */
export function drawAxes(g: Context, names: string[], unit: string, view: Viewport, theme: Theme, named: boolean): void {
  const half = view.width / 2 / view.scale;
  g.strokeStyle = theme.ink;
  g.lineWidth = 1;
  g.strokeRect(view.left + 0.5, view.top + 0.5, view.width, view.height);
  const base = view.top + view.height;
  for (const value of labels(-half, half, view.width / (70 * type.scale))) {
    const [x, y] = [view.px(value), view.py(value)];
    g.beginPath();
    g.moveTo(x, base);
    g.lineTo(x, base + 4);
    g.moveTo(view.left, y);
    g.lineTo(view.left - 4, y);
    g.stroke();
    text(g, theme, number(value), x, base + 6, { align: "center", baseline: "top", size: 11, plain: true });
    text(g, theme, number(value), view.left - 7, y, { align: "right", baseline: "middle", size: 11, plain: true });
  }
  const name = (...of: number[]): string => `${of.map((k) => names[k]).join(", ")} [${unit}]`;
  const across = named ? name(0) : name(0, 1);
  text(g, theme, across, view.left + view.width / 2, base + 22 * type.scale, { align: "center", baseline: "top" });
  if (!named) return;
  g.save();
  g.translate(view.left - 34 * type.scale, view.top + view.height / 2);
  g.rotate(-Math.PI / 2);
  text(g, theme, name(1), 0, 0, { align: "center", baseline: "middle" });
  g.restore();
}

/** The colours of times to collision. */
export function drawBar(g: Context, horizon: number, view: Viewport, theme: Theme, named: boolean): void {
  const [x, width] = [view.left + view.width + 10, 12];
  for (let row = 0; row < view.height; row++) {
    g.fillStyle = css(viridis(1 - row / view.height, theme));
    g.fillRect(x, view.top + row, width, 1.5);
  }
  g.strokeStyle = theme.ink;
  g.lineWidth = 1;
  g.strokeRect(x + 0.5, view.top + 0.5, width, view.height);
  for (const value of labels(0, horizon, Math.min(6, view.height / (18 * type.scale)))) {
    const y = view.top + view.height * (1 - value / horizon);
    text(g, theme, number(value), x + width + 4, y, { baseline: "middle", size: 11, plain: true });
  }
  if (!named) return;
  g.save();
  g.translate(x + width + 30 * type.scale, view.top + view.height / 2);
  g.rotate(-Math.PI / 2);
  text(g, theme, "time to collision [s]", 0, 0, { align: "center", baseline: "middle", size: 11 });
  g.restore();
}
