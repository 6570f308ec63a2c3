// What a chart can show of the selected robot at each step of a run.

import type { Model } from "./model.ts";

export interface Metric {
  name: string;
  unit: string;
  /** At a step; undefined where it is not known. `before` is the value of the step before. */
  value: (model: Model, step: number, before: number | undefined) => number | undefined;
  /** A line of this name at a value. */
  limit?: [string, (model: Model) => number];
  /** Values above are drawn at this one: far ones tell nothing. */
  most?: number;
}

const own = (model: Model) => model.scene!.robots[model.selected]!;

/** Numbers of the robot at a step. */
function at(model: Model, rows: "positions" | "velocities" | "accelerations", step: number): number[] {
  const d = model.scene!.dimension;
  const { values, width } = model[rows];
  const begin = step * width + model.selected * d;
  return Array.from(values.subarray(begin, begin + d));
}

function apart(a: number[], b: number[]): number {
  return Math.hypot(...a.map((x, c) => x - b[c]!));
}

function toGoal(model: Model, step: number): number {
  const { goals, selected } = model;
  const { goal } = own(model);
  const d = goal.length;
  const begin = goals ? step * goals.width + selected * d : 0;
  const there = goals ? Array.from(goals.values.subarray(begin, begin + d)) : goal;
  return apart(at(model, "positions", step), there);
}

/** [rad/s] Change of the direction of motion, of a robot that moves. */
function turning(model: Model, step: number): number | undefined {
  const [v, a] = [at(model, "velocities", step), at(model, "accelerations", step)];
  const speed = Math.hypot(...v);
  if (speed < 0.05 * own(model).max_speed) return undefined;
  const along = v.reduce((sum, x, c) => sum + x * a[c]!, 0) / speed;
  return Math.sqrt(Math.max(0, Math.hypot(...a) ** 2 - along ** 2)) / speed;
}

function travelled(model: Model, step: number, before = 0): number {
  return step ? before + apart(at(model, "positions", step), at(model, "positions", step - 1)) : 0;
}

/** [s] Of the preferred control of the decision that was made at a step, where its control space is there. */
function contact(model: Model, step: number): number | undefined {
  const control = model.controls[0]!.get(step);
  if (!control || control.robot !== model.selected) return undefined;
  return control.first < 0 ? control.horizon : control.arrays["contact"]!.values[control.first];
}

export const METRICS: Metric[] = [
  {
    name: "clearance",
    unit: "m",
    value: (model, k) => model.series.get(`clearance ${model.selected}`)?.[k],
    limit: ["margin", (model) => model.scene!.margin],
    most: 5,
  },
  { name: "speed", unit: "m/s", value: (m, k) => m.speedOf(k, m.selected), limit: ["limit", (m) => own(m).max_speed] },
  {
    name: "acceleration",
    unit: "m/s²",
    value: (model, k) => model.accelerationOf(k, model.selected),
    limit: ["limit", (model) => own(model).max_acceleration],
  },
  {
    name: "jerk",
    unit: "m/s³",
    value: (m, k) => (k ? apart(at(m, "accelerations", k), at(m, "accelerations", k - 1)) / m.scene!.dt : undefined),
  },
  { name: "rate of turn", unit: "rad/s", value: turning },
  { name: "distance to the goal", unit: "m", value: toGoal },
  { name: "path length", unit: "m", value: travelled },
  { name: "time to collision of the preferred control", unit: "s", value: contact },
  {
    name: "time of the decision",
    unit: "ms",
    value: (model, k) => model.series.get(`decision ${model.selected}`)?.[k] || undefined,
  },
];
