// Measurements of the selected robot over time, with a cursor at the time that is shown.

import { number, text, type Context } from "./geometry.ts";
import type { Model } from "./model.ts";
import type { Theme } from "./theme.ts";

export interface Chart {
  name: string;
  unit: string;
  value: (model: Model, step: number) => number | undefined;
  limit?: (model: Model) => number;
}

export const CHARTS: Chart[] = [
  {
    name: "clearance",
    unit: "m",
    value: (model, k) => model.clearance.get(model.selected)?.[k],
    limit: (model) => model.scene!.margin,
  },
  {
    name: "speed",
    unit: "m/s",
    value: (model, k) => model.speedOf(k, model.selected),
    limit: (model) => model.scene!.robots[model.selected]!.max_speed,
  },
  {
    name: "acceleration",
    unit: "m/s²",
    value: (model, k) => model.accelerationOf(k, model.selected),
    limit: (model) => model.scene!.robots[model.selected]!.max_acceleration,
  },
];

const LEFT = 8;
const TOP = 20;
const FOOT = 6;

export function drawChart(g: Context, model: Model, chart: Chart, theme: Theme, width: number, height: number): void {
  g.fillStyle = theme.paper;
  g.fillRect(0, 0, width, height);
  const count = model.count;
  const values = Array.from({ length: count }, (_, k) => chart.value(model, k));
  const known = values.filter((v): v is number => v !== undefined && v < 1e5);
  const limit = chart.limit?.(model) ?? 0;
  // Clearances far above the margin tell nothing: the scale ends at some metres.
  const top = chart.name === "clearance" ? Math.min(Math.max(1, ...known), 5) : 1.1 * Math.max(limit, ...known, 0.1);
  const low = Math.min(0, ...known);
  const x = (k: number): number => LEFT + ((width - 2 * LEFT) * k) / Math.max(1, totalSteps(model));
  const y = (v: number): number => TOP + (height - TOP - FOOT) * (1 - (Math.min(v, top) - low) / (top - low));
  g.strokeStyle = theme.faint;
  g.lineWidth = 1;
  g.setLineDash([3, 3]);
  g.beginPath();
  g.moveTo(LEFT, y(limit));
  g.lineTo(width - LEFT, y(limit));
  g.stroke();
  g.setLineDash([]);
  g.strokeStyle = theme.goal;
  g.lineWidth = 1.8;
  g.beginPath();
  let open = false;
  values.forEach((v, k) => {
    if (v === undefined) open = false;
    else if (open) g.lineTo(x(k), y(v));
    else {
      g.moveTo(x(k), y(v));
      open = true;
    }
  });
  g.stroke();
  const cursor = x(model.playhead);
  g.strokeStyle = theme.robot;
  g.lineWidth = 1.5;
  g.beginPath();
  g.moveTo(cursor, TOP - 2);
  g.lineTo(cursor, height - FOOT);
  g.stroke();
  const now = values[model.step];
  const shown = now === undefined || now > 1e5 ? "–" : number(Number(now.toFixed(2)));
  text(g, theme, `${chart.name} ${shown} ${chart.unit}`, LEFT, 13, { size: 12 });
  const words = `${chart.name === "clearance" ? "margin" : "limit"} ${number(Number(limit.toFixed(2)))}`;
  if (width > 210) text(g, theme, words, width - LEFT, 13, { align: "right", size: 11, colour: theme.faint });
}

/** Steps on the time axis: of the whole run, once it is known. */
export function totalSteps(model: Model): number {
  const scene = model.scene!;
  return model.complete || !scene.live ? model.count - 1 : Math.max(model.count - 1, Math.round(scene.duration / scene.dt) / 4);
}

export function stepAt(model: Model, px: number, width: number): number {
  return Math.round(((px - LEFT) / (width - 2 * LEFT)) * totalSteps(model));
}
