// What is under the pointer: its name and values beside the pointer, and the bodies that are then emphasised.

import type { App } from "./app.ts";
import { Eye } from "./camera.ts";
import { hit, type Handle } from "./handles.ts";
import { gridTime } from "./legends.ts";
import { among, type Body } from "./model.ts";
import { signed } from "./geometry.ts";
import type { Control } from "./protocol.ts";

/** [pixel] From the pointer to its words. */
const AWAY = 14;
/** [pixel] How near the pointer must be to a small body in space. */
const NEAR = 11;

const seconds = (time: number): string => `${time.toFixed(1)} s`;

export class Hover {
  private words = "";
  constructor(private readonly app: App) {}

  /** Shows lines beside a pixel of a picture, and emphasises bodies. */
  show(canvas: HTMLCanvasElement, x: number, y: number, lines: string[], bodies: Body[]): void {
    const { model, parts } = this.app;
    const { hover } = parts;
    const same = bodies.length === model.focus.length && bodies.every(({ kind, index }) => among(model.focus, kind, index));
    if (!same) this.focus(bodies);
    const words = lines.filter(Boolean).join("\n");
    if (words !== this.words) hover.textContent = this.words = words;
    if (!words) return;
    if (hover.previousElementSibling !== canvas) canvas.after(hover);
    const [width, height] = [canvas.clientWidth, canvas.clientHeight];
    const left = x + AWAY + hover.offsetWidth > width ? x - AWAY - hover.offsetWidth : x + AWAY;
    const top = y + AWAY + hover.offsetHeight > height ? y - AWAY - hover.offsetHeight : y + AWAY;
    hover.style.transform = `translate(${Math.max(0, left)}px, ${Math.max(0, top)}px)`;
  }

  /** Emphasises bodies in both pictures. */
  focus(bodies: Body[]): void {
    this.app.model.focus = bodies;
    this.app.redraw();
  }

  leave(): void {
    this.words = this.app.parts.hover.textContent = "";
    if (this.app.model.focus.length) this.focus([]);
  }

  /** What is at a pixel of the workspace; the handle there, if it is one. */
  workspace(canvas: HTMLCanvasElement, x: number, y: number): Handle | null {
    const { app } = this;
    const { model } = app;
    if (!model.scene || !model.count) return null;
    if (model.scene.dimension === 3) {
      const body = bodyInSpace(app, x, y);
      this.show(canvas, x, y, body ? this.told(body) : [], body ? [body] : []);
      return null;
    }
    const found = hit(app, app.dragging.handle, x, y, true);
    if (!found) {
      const [px, py] = app.view?.inverse(x, y) ?? [0, 0];
      this.show(canvas, x, y, app.tools.chosen ? [`(${signed(px, 2)}, ${signed(py, 2)}) m`] : [], []);
    } else if (found.what === "goal") {
      const robot = model.scene.robots[found.index]!;
      this.show(canvas, x, y, [`goal of ${robot.name}`, `reached within ${robot.tolerance} m`], []);
    } else {
      const body: Body = { kind: found.what.startsWith("robot") ? "robot" : "obstacle", index: found.index };
      this.show(canvas, x, y, this.told(body), [body]);
    }
    return found;
  }

  /** Name and values of a body. */
  private told(body: Body): string[] {
    const { model } = this.app;
    const robot = body.kind === "robot";
    const velocity = robot ? model.velocity(body.index) : model.obstacleVelocity(body.index);
    const { name } = model.info(body);
    const lines = [`${name}: ${Math.hypot(...velocity).toFixed(1)} m/s`];
    const outcome = model.outcomes[model.step]?.[body.index] ?? "";
    if (robot && outcome && !model.hidden) lines.push(`last decision: ${outcome.toLowerCase()}`);
    if (robot && body.index === model.selected) {
      const clearance = model.series.get(`clearance ${body.index}`)?.[model.step];
      return Number.isFinite(clearance) ? [...lines, `clearance ${signed(clearance!, 2)} m`] : lines;
    }
    const control = model.overlay();
    const row = control?.others.findIndex(([kind, k]) => kind === body.kind && k === body.index) ?? -1;
    if (!control) return lines;
    if (row < 0) return [...lines, "not in the control space: it cannot be met, or it was not known"];
    const contact = control.arrays["contact"]!.values[row]!;
    const met = model.hidden ? undefined : control.binding.find(({ other }) => other === row);
    lines.push(contact >= 0 ? `hit by the preferred control in ${seconds(contact)}` : "not hit by the preferred control");
    if (met) lines.push(`passed in ${seconds(met.time)} with ${signed(met.clearance, 2)} m`);
    return lines;
  }

  /** What is at a pixel of a control space. */
  control(canvas: HTMLCanvasElement, slot: number, x: number, y: number): void {
    const { app } = this;
    const control = app.model.control(slot);
    const view = app.controlViewport(slot, [x, y]);
    if (!control || !view?.holds(x, y)) return this.show(canvas, x, y, [], []);
    const at = view.inverse(x, y);
    const { quantity } = control;
    const time = gridTime(control, app.plane, at);
    const owners = control.planes.length > 1 ? [] : ownersOf(control, at);
    const bodies = owners.flatMap((row): Body[] => {
      const [kind, index] = control.others[row]!;
      return kind === "hidden" ? [] : [{ kind, index }];
    });
    const names = bodies.map((body) => app.model.info(body).name);
    const border = admissible(control, app.plane);
    this.show(
      canvas,
      x,
      y,
      [
        `${quantity.name} (${signed(at[0], 2)}, ${signed(at[1], 2)}) ${quantity.unit}`,
        time === null ? "" : time < Infinity ? `collides in about ${seconds(time)}` : `hits nothing within ${control.horizon} s`,
        names.length ? `control obstacle of ${names.slice(0, 4).join(", ")}${names.length > 4 ? ` and ${names.length - 4} more` : ""}` : "",
        border && !wound(border, 0, border.length / 2, at) ? "outside the limits" : "",
      ],
      bodies,
    );
  }
}

function admissible(control: Control, plane: number): ArrayLike<number> | null {
  return control.arrays[`admissible${plane}`]?.values ?? null;
}

/** Winding number of a closed line of points about a point. */
function wound(points: ArrayLike<number>, begin: number, end: number, [x, y]: [number, number]): number {
  let turns = 0;
  for (let k = begin, before = end - 1; k < end; before = k++) {
    const [ax, ay, bx, by] = [points[2 * before]!, points[2 * before + 1]!, points[2 * k]!, points[2 * k + 1]!];
    if (ay <= y === by <= y) continue;
    const left = (bx - ax) * (y - ay) - (x - ax) * (by - ay);
    if (by > ay && left > 0) turns++;
    if (by <= ay && left < 0) turns--;
  }
  return turns;
}

/** Rows of the others whose control obstacles hold a control. */
export function ownersOf(control: Control, at: [number, number]): number[] {
  const points = control.arrays["rings0"]?.values;
  if (!points) return [];
  const [ends, owners] = [control.arrays["ends0"]!.values, control.arrays["owners0"]!.values];
  const turns = new Map<number, number>();
  let begin = 0;
  ends.forEach((end, k) => {
    turns.set(owners[k]!, (turns.get(owners[k]!) ?? 0) + wound(points, begin, end, at));
    begin = end;
  });
  return [...turns].filter(([, n]) => n !== 0).map(([row]) => row);
}

/** The body at a pixel of a picture in space, the nearest one. */
export function bodyInSpace(app: App, x: number, y: number): Body | null {
  const { model, parts, camera } = app;
  const { clientWidth, clientHeight } = parts.workspace.canvas;
  const eye = new Eye(model, camera, clientWidth, clientHeight);
  const bodies: Body[] = [
    ...model.scene!.robots.map((_, index): Body => ({ kind: "robot", index })),
    ...model.scene!.obstacles.map((_, index): Body => ({ kind: "obstacle", index })),
  ];
  let [found, depth]: [Body | null, number] = [null, Infinity];
  for (const body of bodies) {
    const at = model.at(body);
    if (!at) continue;
    const p = eye.project(at);
    if (Math.hypot(p.x - x, p.y - y) < Math.max(NEAR, model.info(body).radius * p.scale) && p.depth < depth) [found, depth] = [body, p.depth];
  }
  return found;
}
