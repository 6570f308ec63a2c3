// The control space: control obstacles by time to collision, admissible set, preferred and chosen control.

import { drawDeciding, drawElements } from "./elements.ts";
import { number, text, ticks, Viewport, type Context } from "./geometry.ts";
import type { Model } from "./model.ts";
import type { Control, PlaneInfo } from "./protocol.ts";
import { drawProjections, projectionsWidth } from "./projections.ts";
import { css, viridis, type Theme } from "./theme.ts";

const NONE = 255;
const STEPS = 250;
const BAR = 62;
const FOOT = 40;
const SIDE = 48;

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
  const width = panel.width - (beside ? beside + 10 : 0);
  const side = Math.max(40, Math.min(width - SIDE - BAR, height - FOOT - 12));
  const left = SIDE + (width - SIDE - BAR - side) / 2;
  return new Viewport(0, 0, (side / (2 * plane.half)) * zoom, side, side, left, 8);
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
  drawOutlines(g, control, panel, view);
  if (model.scene!.dimension === 2) {
    if (model.element > 0) drawElements(g, model, control, view, theme);
    if (model.deciding) drawDeciding(g, model, control, view, theme);
  }
  drawAdmissible(g, control, panel, view);
  drawMarks(g, model, control, plane, view, theme);
  g.restore();
  drawAxes(g, control, plane, view, theme);
  drawBar(g, control, view, theme);
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

function rings(control: Control, plane: number, view: Viewport): Path2D | null {
  const points = control.arrays[`rings${plane}`];
  if (!points) return null;
  const ends = control.arrays[`ends${plane}`]!.values;
  const path = new Path2D();
  let begin = 0;
  for (const end of ends) {
    for (let k = begin; k < end; k++) {
      const [x, y] = [view.px(points.values[2 * k]!), view.py(points.values[2 * k + 1]!)];
      if (k === begin) path.moveTo(x, y);
      else path.lineTo(x, y);
    }
    path.closePath();
    begin = end;
  }
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

function drawOutlines(g: Context, control: Control, panel: Panel, view: Viewport): void {
  const outline = rings(control, panel.plane, view);
  if (!outline) return;
  g.strokeStyle = panel.theme.blocked;
  g.globalAlpha = 0.75;
  g.lineWidth = 0.8;
  g.stroke(outline);
  g.globalAlpha = 1;
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

function drawMarks(
  g: Context,
  model: Model,
  control: Control,
  plane: PlaneInfo,
  view: Viewport,
  theme: Theme,
): void {
  const chosen = model.probe && model.probe.slot === control.slot ? model.probe.control : control.chosen;
  const inset = 9;
  for (const [point, hollow] of [
    [control.preferred, true],
    [chosen, false],
  ] as const) {
    if (!point) continue;
    const [px, py] = [view.px(point[plane.axes[0]]!), view.py(point[plane.axes[1]]!)];
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
}

function drawAxes(g: Context, control: Control, plane: PlaneInfo, view: Viewport, theme: Theme): void {
  const half = view.width / 2 / view.scale;
  g.strokeStyle = theme.ink;
  g.lineWidth = 1;
  g.strokeRect(view.left + 0.5, view.top + 0.5, view.width, view.height);
  const base = view.top + view.height;
  const letters = ["x", "y", "z"];
  const { letter, unit } = control.quantity;
  for (const value of ticks(-half, half, view.width / 70)) {
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
  const name = (axis: number): string => `${letter}${letters[plane.axes[axis]!]} [${unit}]`;
  text(g, theme, name(0), view.left + view.width / 2, base + 22, { align: "center", baseline: "top" });
  g.save();
  g.translate(view.left - 34, view.top + view.height / 2);
  g.rotate(-Math.PI / 2);
  text(g, theme, name(1), 0, 0, { align: "center", baseline: "middle" });
  g.restore();
}

function drawBar(g: Context, control: Control, view: Viewport, theme: Theme): void {
  const [x, width] = [view.left + view.width + 10, 12];
  for (let row = 0; row < view.height; row++) {
    g.fillStyle = css(viridis(1 - row / view.height, theme));
    g.fillRect(x, view.top + row, width, 1.5);
  }
  g.strokeStyle = theme.ink;
  g.lineWidth = 1;
  g.strokeRect(x + 0.5, view.top + 0.5, width, view.height);
  for (const value of ticks(0, control.horizon, 6)) {
    const y = view.top + view.height * (1 - value / control.horizon);
    text(g, theme, number(value), x + width + 4, y, { baseline: "middle", size: 11, plain: true });
  }
  g.save();
  g.translate(x + width + 30, view.top + view.height / 2);
  g.rotate(-Math.PI / 2);
  text(g, theme, "time to collision [s]", 0, 0, { align: "center", baseline: "middle", size: 11 });
  g.restore();
}
