// The committed, preferred and tried manoeuvres in the workspace.

import { drawShape, polyline, type Context } from "./geometry.ts";
import type { Model } from "./model.ts";
import { forPredicted, interpolated } from "./predicted.ts";
import type { Control } from "./protocol.ts";
import type { Look } from "./workspace.ts";

export function drawManoeuvre(g: Context, model: Model, control: Control, look: Look): void {
  const { theme, view } = look;
  const scene = model.scene!;
  const [times, gain] = [control.arrays["times"]!.values, control.arrays["gain"]!.values];
  const drift = control.arrays["drift"]!.values;
  const d = scene.dimension;
  const along = (u: number[], k: number): number[] => u.map((x, c) => drift[k * d + c]! + gain[k]! * x);
  const contact = control.first >= 0 ? control.arrays["contact"]!.values[control.first]! : Infinity;
  g.strokeStyle = theme.ink;
  g.lineWidth = 1.4;
  g.setLineDash([6, 4]);
  const dashed: number[][] = [];
  for (let k = 0; k < times.length && times[k]! <= contact + 1e-6; k++) dashed.push(along(control.preferred, k));
  polyline(g, view, dashed);
  g.stroke();
  g.setLineDash([]);
  const path = model.path(control);
  if (path) {
    const at = (k: number): number[] => Array.from({ length: d }, (_, c) => path.values[k * d + c]!);
    const points = Array.from({ length: path.shape[0]! }, (_, k) => at(k));
    g.lineCap = g.lineJoin = "round";
    for (const [colour, width] of [
      [theme.halo, 6],
      [theme.robot, 3],
    ] as const) {
      g.strokeStyle = colour;
      g.lineWidth = width;
      polyline(g, view, points);
      g.stroke();
    }
    g.fillStyle = theme.robot;
    for (let second = 1; second <= control.horizon; second++) {
      const [x, y] = interpolated(path.values, d, times, second);
      g.beginPath();
      g.arc(view.px(x!), view.py(y!), 3.4, 0, 2 * Math.PI);
      g.fill();
    }
    if (model.element > 0) drawGhosts(g, model, control, look, interpolated(path.values, d, times, model.element));
  }
}

/** Outlines at the time under the slider: of the robot on its manoeuvre, and of the others as they are predicted. */
function drawGhosts(g: Context, model: Model, control: Control, { theme, view }: Look, own: number[]): void {
  const scene = model.scene!;
  const times = control.arrays["times"]!.values;
  g.setLineDash([4, 3]);
  drawShape(g, view, scene.shapes[scene.robots[model.selected]!.shape]!, own, 0, null, theme.robot, 2);
  forPredicted(model, control, model.element, times, (shape, at, heading, grown) =>
    drawShape(g, view, shape, at, heading, null, theme.faint, 1.4, grown),
  );
  g.setLineDash([]);
}
