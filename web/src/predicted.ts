// Predicted positions at a time.

import type { Model } from "./model.ts";
import type { Control, Part } from "./protocol.ts";

/** Calls `draw` with shape, position, heading and growth of each predicted other at a time. */
export function forPredicted(
  model: Model,
  control: Control,
  time: number,
  times: ArrayLike<number>,
  draw: (shape: Part[], at: number[], heading: number, grown: number, row: number) => void,
): void {
  const positions = control.arrays["positions"];
  if (!positions) return;
  const scene = model.scene!;
  const d = scene.dimension;
  const m = positions.shape[1]!;
  const directions = control.arrays["directions"];
  const growth = control.arrays["growth"];
  const share = (time / control.horizon) * (times.length - 1);
  const k = Math.min(times.length - 2, Math.floor(share));
  const f = share - k;
  control.predicted.forEach((row, column) => {
    const at = Array.from({ length: d }, (_, c) => {
      const a = positions.values[(k * m + column) * d + c]!;
      return a + f * (positions.values[((k + 1) * m + column) * d + c]! - a);
    });
    if (!Number.isFinite(at[0]!)) return;
    const [kind, index] = control.others[row]!;
    const info = kind === "robot" ? scene.robots[index]! : scene.obstacles[index]!;
    const heading = directions ? directions.values[k * m + column]! : 0;
    const grown = growth ? growth.values[k * m + column]! : 0;
    draw(scene.shapes[info.shape]!, at, heading, grown, row);
  });
}

export function interpolated(values: ArrayLike<number>, d: number, times: ArrayLike<number>, time: number): number[] {
  const share = Math.min(times.length - 1.000001, (time / times[times.length - 1]!) * (times.length - 1));
  const k = Math.floor(share);
  return Array.from({ length: d }, (_, c) => {
    const a = values[k * d + c]!;
    return a + (share - k) * (values[(k + 1) * d + c]! - a);
  });
}
