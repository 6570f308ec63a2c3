// Charts of the selected robot over time, with a cursor at the time that is shown.

import { labels, number, text, type, type Context } from "./geometry.ts";
import { METRICS, type Metric } from "./metrics.ts";
import type { Model } from "./model.ts";
import type { Theme } from "./theme.ts";

/** [pixel] Around the axes; above is the list of metrics. */
const LEFT = 38;
const RIGHT = 14;
const TOP = 26;
const FOOT = 20;

const known = new WeakMap<Model, Map<Metric, { version: string; values: (number | undefined)[] }>>();

/** Values of a metric at all steps; they are computed again when messages have come. */
function valuesOf(model: Model, metric: Metric): (number | undefined)[] {
  let held = known.get(model);
  if (!held) known.set(model, (held = new Map()));
  const version = `${model.version} ${model.selected}`;
  const found = held.get(metric);
  if (found?.version === version) return found.values;
  const values: (number | undefined)[] = [];
  for (let k = 0; k < model.count; k++) {
    const value = metric.value(model, k, values[k - 1]);
    values.push(Number.isNaN(value) ? undefined : value);
  }
  held.set(metric, { version, values });
  return values;
}

/** Values of the metrics of two runs are lines of two colours. */
export function drawChart(g: Context, models: Model[], metric: Metric, theme: Theme, width: number, height: number): void {
  const [model] = models as [Model];
  g.fillStyle = theme.paper;
  g.fillRect(0, 0, width, height);
  const all = models.map((one) => valuesOf(one, metric));
  const found = all.flat().filter((v): v is number => v !== undefined);
  const limit = metric.limit?.[1](model);
  const highest = Math.min(found.reduce((a, b) => Math.max(a, b), limit ?? 0), metric.most ?? Infinity);
  const low = found.reduce((a, b) => Math.min(a, b), 0);
  const top = low + 1.08 * Math.max(highest - low, 1e-3);
  const span = spanOf(models);
  const x = (t: number): number => LEFT + ((width - LEFT - RIGHT) * t) / span;
  const y = (v: number): number => TOP + (height - TOP - FOOT) * (1 - (Math.min(v, metric.most ?? Infinity) - low) / (top - low));
  drawAxes(g, theme, x, y, [model.scene!.start, span], [low, top], width, height);
  if (limit !== undefined) {
    g.strokeStyle = theme.faint;
    g.setLineDash([3, 3]);
    line(g, [LEFT, y(limit)], [width - RIGHT, y(limit)]);
    g.setLineDash([]);
  }
  [...models.entries()].reverse().forEach(([k, one]) => drawValues(g, all[k]!, one.scene!.dt, x, y, k ? theme.mark : theme.goal));
  g.strokeStyle = theme.robot;
  g.lineWidth = 1.5;
  const cursor = x(elapsed(model));
  line(g, [cursor, TOP - 2], [cursor, height - FOOT]);
  const size = 12;
  const shown = models.map((one, k) => [valueNow(all[k]![one.step], metric), k ? theme.mark : models.length > 1 ? theme.goal : theme.ink] as const);
  shown.reverse().reduce((right, [words, colour]) => {
    text(g, theme, words, right, 15, { align: "right", size, colour });
    return right - g.measureText(words).width - 10;
  }, width - RIGHT);
}

function valueNow(value: number | undefined, metric: Metric): string {
  const shown = value === undefined ? "–" : number(Number(value.toFixed(Math.abs(value) < 10 ? 2 : 1)));
  return `${shown} ${metric.unit}`;
}

function line(g: Context, from: [number, number], to: [number, number]): void {
  g.beginPath();
  g.moveTo(...from);
  g.lineTo(...to);
  g.stroke();
}

function drawAxes(
  g: Context,
  theme: Theme,
  x: (t: number) => number,
  y: (v: number) => number,
  [start, span]: [number, number],
  [low, top]: [number, number],
  width: number,
  height: number,
): void {
  const base = height - FOOT;
  g.strokeStyle = theme.grid;
  g.lineWidth = 1;
  for (const value of labels(low, top, (base - TOP) / (26 * type.scale))) {
    line(g, [LEFT, y(value)], [width - RIGHT, y(value)]);
    text(g, theme, number(value), LEFT - 5, y(value), { align: "right", baseline: "middle", size: 10, colour: theme.faint, plain: true });
  }
  const times = labels(start, start + span, (width - LEFT) / (60 * type.scale));
  for (const t of times) {
    line(g, [x(t - start), base], [x(t - start), base + 3]);
    const words = t === times[times.length - 1] ? `${number(t)} s` : number(t);
    text(g, theme, words, x(t - start), base + 5, { align: "center", baseline: "top", size: 10, colour: theme.faint, plain: true });
  }
  g.strokeStyle = theme.faint;
  line(g, [LEFT, base], [width - RIGHT, base]);
}

function drawValues(
  g: Context,
  values: (number | undefined)[],
  dt: number,
  x: (t: number) => number,
  y: (v: number) => number,
  colour: string,
): void {
  g.strokeStyle = colour;
  g.lineWidth = 1.8;
  g.beginPath();
  let before: number | null = null;
  values.forEach((v, k) => {
    if (v === undefined) return;
    // Values that are known at decisions alone are joined across the steps between them.
    if (before !== null && k - before < 20) g.lineTo(x(k * dt), y(v));
    else g.moveTo(x(k * dt), y(v));
    before = k;
  });
  g.stroke();
}

/** [s] Since the start of a run. */
export function elapsed(model: Model): number {
  return model.scene!.dt * model.playhead;
}

/** [s] The time axis of some runs: that of the longest, once it is known. */
export function spanOf(models: Model[]): number {
  const spans = models.map((model) => {
    const scene = model.scene!;
    const made = scene.dt * (model.count - 1);
    return model.complete || !scene.live ? made : Math.max(made, scene.duration / 4);
  });
  return Math.max(...spans, 1e-3);
}

/** [s] Since the start, of a pixel on a chart. */
export function timeAt(models: Model[], px: number, width: number): number {
  return ((px - LEFT) / (width - LEFT - RIGHT)) * spanOf(models);
}

/** The lines that a chart shows of a pixel: the time, and the value of each run. */
export function chartWords(models: Model[], metric: Metric, px: number, width: number): string[] {
  const time = timeAt(models, px, width);
  return models.flatMap((model) => {
    const scene = model.scene!;
    const step = Math.max(0, Math.min(model.count - 1, Math.round(time / scene.dt)));
    const name = models.length > 1 ? `${scene.method}: ` : "";
    return [`${name}${metric.name} ${valueNow(valuesOf(model, metric)[step], metric)} at ${(scene.start + scene.dt * step).toFixed(2)} s`];
  });
}

/** The metrics that the charts show at first. */
export const SHOWN = METRICS.slice(0, 3);
