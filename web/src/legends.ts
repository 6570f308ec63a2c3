// Titles and legends.

import type { App } from "./app.ts";
import type { Body, Model } from "./model.ts";
import { DARK, OUTCOMES } from "./theme.ts";
import type { Control } from "./protocol.ts";
import { el, entry } from "./ui.ts";

const shown = new WeakMap<HTMLElement, string>();

/** Replaces the content of an element if it differs. */
function put(parent: HTMLElement, key: string, make: () => Node[]): void {
  if (shown.get(parent) === key) return;
  shown.set(parent, key);
  parent.replaceChildren(...make());
}

/** Sets what is read aloud of a picture. */
function describe(canvas: HTMLCanvasElement, words: string): void {
  if (canvas.getAttribute("aria-label") !== words) canvas.setAttribute("aria-label", words);
}

export function titles(app: App): void {
  const { model, parts } = app;
  const scene = model.scene!;
  const name = scene.robots.length > 1 ? `, ${scene.robots[model.selected]!.name} selected` : "";
  const left = `workspace at t = ${model.time.toFixed(1)} s${name}`;
  put(parts.workspace.title, left, () => [document.createTextNode(left)]);
  describe(parts.workspace.canvas, left);
  const alone = !model.control() && model.complete;
  parts.main.classList.toggle("alone", alone);
  parts.controls[0].section.hidden = alone;
  parts.controls.forEach(({ title, canvas }, slot) => {
    const control = model.control(slot);
    if (!control) return;
    const own = `${control.quantity.name}, ${control.response}`;
    const plane = control.planes[app.plane]!;
    const hidden = [0, 1, 2].filter((axis) => !plane.axes.includes(axis) && axis < plane.through.length)[0];
    const letters = ["x", "y", "z"];
    const slice =
      hidden === undefined
        ? ""
        : `slice at ${control.quantity.letter}${letters[hidden]} = ${(plane.through[hidden]! + 0).toFixed(2).replace("-", "−")}`;
    const made = scene.start + scene.dt * model.step;
    const when = Math.abs(control.time - made) < 0.5 * scene.dt ? "" : `at t = ${control.time.toFixed(1)} s `;
    describe(canvas, `control space of ${control.method}: ${control.sentences.join(" ")}`);
    put(title, own + slice + when + control.method, () => [
      document.createTextNode(`${control.method.toUpperCase()}: ${own} `),
      el("small", {}, `${when}${slice}`),
    ]);
  });
  const control = model.control();
  if (control && app.source.live) {
    const key = control.responses.join("|") + control.response;
    if (parts.response.dataset["key"] !== key) {
      parts.response.dataset["key"] = key;
      parts.response.replaceChildren(new Option("committed", "-1"));
      control.responses.forEach((response, k) => parts.response.append(new Option(response, String(k))));
    }
  }
}

export function legends(app: App): void {
  const { model, parts, theme } = app;
  const scene = model.scene!;
  const several = scene.robots.length > 1;
  const control = model.control();
  const space = scene.dimension === 3;
  const guided = Boolean(control?.target);
  const target = scene.robots[model.selected]!.path ? "point ahead on the path" : "target of guidance";
  const there = shownOf(model, control);
  const key = `${model.farthest} ${guided} ${target} ${several} ${model.colouring} ${theme === DARK} ${!!control} ${Object.values(there).join()}`;
  put(parts.workspace.legend, key, () => {
    const alone = space ? "robot" : "robot, arrow: motion in 1 s";
    const items = [several ? entry("ring", "selected robot", theme.robot) : entry("disc", alone, theme.robot)];
    items.push(entry("ring", "goal", theme.goal));
    if (guided && !space) items.push(entry("square", target, theme.goal));
    if (control) {
      items.push(entry("dash", "preferred, to first contact", theme.ink));
      items.push(entry("line", "committed, dot per second", theme.robot, there.path));
    }
    if (several && model.colouring === "outcome") {
      const known = new Map(Object.values(OUTCOMES).map(({ colour, label }) => [label, colour]));
      for (const [label, colour] of known) items.push(entry("disc", label, colour));
    }
    if (several && model.colouring === "speed") {
      items.push(entry("scale", "speed: rest to the largest"));
    }
    if (several && model.colouring === "time") {
      items.push(entry("scale", `time to the goal at full speed: 0 to ${model.farthest ?? "…"} s`));
    }
    if (control && (model.colouring === "role" || !several)) {
      items.push(entry("scale", there.hit ? "hit by the preferred control: soon to late" : "predicted paths: soon to late", "", there.coloured));
    }
    if (several && model.colouring === "role") items.push(entry("disc", "other robot", theme.neutral, there.others));
    if (scene.obstacles.length) items.push(entry("disc", "obstacle", theme.neutral, there.obstacles));
    if (model.element > 0) items.push(entry("dash", "predicted, at the time ahead", theme.faint, there.coloured));
    return items;
  });
  for (const [slot, { legend }] of parts.controls.entries()) {
    const own = model.control(slot);
    const rings = Boolean(own?.arrays[`rings${app.plane}`]);
    const marks = [!!own?.arrays[`admissible${app.plane}`], !model.hidden && !!own?.chosen, rings, !model.hidden && !!own?.binding.some(({ time }) => time > 0)];
    put(legend, `${key} ${marks.join()} ${model.deciding} ${model.element > 0}`, () => [
      entry("ring", "preferred", theme.robot),
      entry("line", "admissible set", theme.ink, marks[0]),
      entry("disc", "chosen", theme.robot, marks[1]),
      ...(space
        ? [entry("dash", "where the slice is", theme.goal), entry("blank", "uncoloured in 1, 2, 3: a safe control exists")]
        : [entry("thin", "control obstacles", theme.ink, marks[2])]),
      ...(!space && model.deciding ? [entry("dash", "deciding elements", theme.robot, marks[3])] : []),
      ...(!space && model.element > 0 ? [entry("thin", "elements at the time ahead", theme.ink, there.coloured)] : []),
    ]);
  }
}

/** Which marks the workspace has now. */
function shownOf(model: Model, control: Control | null): Record<"path" | "hit" | "coloured" | "others" | "obstacles", boolean> {
  const { robots, obstacles } = model.scene!;
  const hits = new Set<string>();
  const contact = control?.arrays["contact"]!.values;
  control?.others.forEach(([kind, k], row) => contact![row]! >= 0 && hits.add(`${kind} ${k}`));
  const grey = (kind: Body["kind"], index: number): boolean => !hits.has(`${kind} ${index}`) && model.at({ kind, index }) !== null;
  return {
    path: Boolean(control && model.path(control)),
    hit: hits.size > 0,
    coloured: hits.size > 0 || Boolean(control?.predicted.length),
    others: robots.some((_, k) => k !== model.selected && grey("robot", k)),
    obstacles: obstacles.some((_, k) => grey("obstacle", k)),
  };
}

/** [s] Time to collision of a control by the grid, Infinity for none; null outside of the picture. */
export function gridTime(control: Control, plane: number, at: number[]): number | null {
  const grid = control.arrays[`grid${plane}`]!;
  const n = grid.shape[0]!;
  const { half } = control.planes[plane]!;
  const [column, row] = at.map((x) => Math.round(((x + half) / (2 * half)) * (n - 1))) as [number, number];
  if (column < 0 || row < 0 || column >= n || row >= n) return null;
  const value = grid.values[row * n + column]!;
  return value === 255 ? Infinity : (value / 250) * control.horizon;
}

/** What the grid of times says of a control, where no server is asked. */
export function gridWords(control: Control, plane: number, at: number[]): string {
  const time = gridTime(control, plane, at);
  if (time === null) return "outside the picture.";
  return time < Infinity ? `collides in about ${time.toFixed(1)} s.` : `hits nothing within ${control.horizon} s.`;
}
