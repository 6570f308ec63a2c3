// Temporal elements: the controls that touch an obstacle at one time.

import { hull, rounded, type Context, type Viewport } from "./geometry.ts";
import type { Model } from "./model.ts";
import { forPredicted } from "./predicted.ts";
import type { Control, Part } from "./protocol.ts";
import type { Theme } from "./theme.ts";

/** Parts of the Minkowski sum of an obstacle's part and the reflected robot: a hull of differences of corners. */
function grown(other: Part, own: Part, at: number[], heading: number): { corners: number[][]; radius: number } {
  const [c, s] = [Math.cos(heading), Math.sin(heading)];
  const corners = other.corners.flatMap(([x, y]) =>
    own.corners.map(([p, q]) => [at[0]! + c * x! - s * y! - p!, at[1]! + s * x! + c * y! - q!]),
  );
  return { corners: corners.length > 2 ? hull(corners) : corners, radius: other.radius + own.radius };
}

/** Draws the temporal element of one other at a time: the controls that are in it then. */
function drawElement(
  g: Context,
  model: Model,
  control: Control,
  view: Viewport,
  time: number,
  rows: Set<number> | null,
  line: () => void,
): void {
  const scene = model.scene!;
  const times = control.arrays["times"]!.values;
  const share = Math.min(times.length - 1.000001, (time / control.horizon) * (times.length - 1));
  const k = Math.floor(share);
  const mixed = (name: string, c: number, d: number): number => {
    const values = control.arrays[name]!.values;
    const a = values[k * d + c]!;
    return a + (share - k) * (values[(k + 1) * d + c]! - a);
  };
  const gain = mixed("gain", 0, 1);
  if (gain <= 0) return;
  const drift = [mixed("drift", 0, 2), mixed("drift", 1, 2)];
  const own = scene.shapes[scene.robots[control.robot]!.shape]!;
  forPredicted(model, control, time, times, (shape, at, heading, more, row) => {
    if (rows && !rows.has(row)) return;
    for (const part of shape) {
      for (const mine of own) {
        const whole = grown(part, mine, at, heading);
        const radius = ((whole.radius + more + control.margins[row]!) / gain) * view.scale;
        const points = rounded(whole.corners, whole.radius + more + control.margins[row]!);
        if (radius > 8000) continue;
        g.beginPath();
        points.forEach(([x, y], k) => {
          const [px, py] = [view.px((x! - drift[0]!) / gain), view.py((y! - drift[1]!) / gain)];
          if (k) g.lineTo(px, py);
          else g.moveTo(px, py);
        });
        g.closePath();
        line();
      }
    }
  });
}

export function drawElements(g: Context, model: Model, control: Control, view: Viewport, theme: Theme): void {
  drawElement(g, model, control, view, model.element, null, () => haloed(g, theme.ink, 1.2, theme.paper));
}

function haloed(g: Context, colour: string, width: number, halo: string): void {
  for (const [c, w] of [
    [halo, width + 2],
    [colour, width],
  ] as const) {
    g.strokeStyle = c;
    g.lineWidth = w;
    g.stroke();
  }
}

export function drawDeciding(g: Context, model: Model, control: Control, view: Viewport, theme: Theme): void {
  g.setLineDash([5, 3]);
  for (const { other, time } of control.binding.slice(0, 2)) {
    if (time <= 0) continue;
    drawElement(g, model, control, view, time, new Set([other]), () =>
      haloed(g, theme.robot, 1.8, theme.paper),
    );
  }
  g.setLineDash([]);
}
