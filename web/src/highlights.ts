// Bodies that the sentence names or the pointer is on: a border in the workspace, a line in the control space.

import type { Eye } from "./camera.ts";
import { drawShape, text, type Context } from "./geometry.ts";
import { among, type Model } from "./model.ts";
import type { Control } from "./protocol.ts";
import type { Theme } from "./theme.ts";
import type { Look } from "./workspace.ts";

/** [pixel] Width of the border of a body that is named, and of one that the pointer is on. */
const NAMED = 3;
const FOCUSED = 6;

/** The borders; the bodies are drawn upon them. */
export function drawBorders(g: Context, model: Model, { theme, view }: Look): void {
  for (const [bodies, width] of [
    [model.named(), NAMED],
    [model.focus, FOCUSED],
  ] as const) {
    for (const body of bodies) {
      const [at, info] = [model.at(body), model.info(body)];
      if (!at) continue;
      const heading = body.kind === "obstacle" ? model.heading(body.index) : 0;
      drawShape(g, view, model.scene!.shapes[info.shape]!, at, heading, theme.mark, null, 1, width / view.scale);
    }
  }
}

export function drawNames(g: Context, model: Model, { theme, view }: Look): void {
  for (const body of model.named()) {
    const [at, info] = [model.at(body), model.info(body)];
    if (!at) continue;
    const away = Math.min(40, info.radius * view.scale) + 5;
    text(g, theme, info.name, view.px(at[0]!) + 0.7 * away, view.py(at[1]!) - 0.7 * away, { colour: theme.mark, bold: true });
  }
}

export function drawNamesInSpace(g: Context, model: Model, theme: Theme, eye: Eye): void {
  const named = model.named();
  const focused = model.focus.filter(({ kind, index }) => !among(named, kind, index));
  for (const body of [...named, ...focused]) {
    const at = model.at(body);
    if (!at) continue;
    const [p, info] = [eye.project(at), model.info(body)];
    const radius = Math.max(4, info.radius * p.scale + 3);
    g.strokeStyle = theme.mark;
    g.lineWidth = among(model.focus, body.kind, body.index) ? 3.5 : 2;
    g.beginPath();
    g.arc(p.x, p.y, radius, 0, 2 * Math.PI);
    g.stroke();
    text(g, theme, info.name, p.x + radius, p.y - radius, { colour: theme.mark, bold: true });
  }
}

/** Whether the outlines of a row of others are emphasised in a control space. */
export function emphasised(model: Model, control: Control, row: number): boolean {
  const [kind, index] = control.others[row] ?? ["hidden", 0];
  return among(model.focus, kind, index);
}
