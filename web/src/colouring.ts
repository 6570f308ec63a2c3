// Colours of the robots of a fleet: by outcome, speed or time to the goal.

import type { Model } from "./model.ts";
import { css, OUTCOMES, viridis, type Theme } from "./theme.ts";

/** Time [s] to a robot's goal at its largest speed. */
export function timeToGoal(model: Model, k: number): number {
  const robot = model.scene!.robots[k]!;
  const goal = model.goal(k);
  return Math.hypot(...model.robot(k).map((x, c) => goal[c]! - x)) / robot.max_speed;
}

/** The time [s] at which the colours of times to the goal end: that of the farthest robot at the start, rounded. */
export function farthest(model: Model): number {
  const scene = model.scene!;
  const d = scene.dimension;
  const times = scene.robots.map((robot, k) => {
    const at = Array.from({ length: d }, (_, c) => model.positions.values[k * d + c]!);
    return Math.hypot(...at.map((x, c) => robot.goal[c]! - x)) / robot.max_speed;
  });
  return Math.max(1, Math.ceil(times.reduce((a, b) => Math.max(a, b), 0)));
}

/** Colour of a robot that is not selected. */
export function robotColour(model: Model, k: number, theme: Theme): string {
  const scene = model.scene!;
  if (model.colouring === "outcome") return OUTCOMES[model.outcomes[model.step]?.[k] ?? ""]?.colour ?? theme.neutral;
  if (model.colouring === "speed") {
    const share = model.speedOf(model.step, k) / scene.robots[k]!.max_speed;
    return css(viridis(Math.round(share * 12) / 12, theme));
  }
  if (model.colouring === "time") {
    model.farthest ??= farthest(model);
    const share = timeToGoal(model, k) / model.farthest;
    return css(viridis(Math.round(Math.min(1, share) * 12) / 12, theme));
  }
  return theme.neutral;
}
