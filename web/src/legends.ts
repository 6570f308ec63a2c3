// Titles, legends and the sentence that explains the choice.

import type { App } from "./app.ts";
import { css, DARK, OUTCOMES, viridis } from "./theme.ts";
import { el, entry } from "./ui.ts";

const shown = new WeakMap<HTMLElement, string>();

/** Replaces the content of an element if it differs. */
function put(parent: HTMLElement, key: string, make: () => Node[]): void {
  if (shown.get(parent) === key) return;
  shown.set(parent, key);
  parent.replaceChildren(...make());
}

export function titles(app: App): void {
  const { model, parts } = app;
  const scene = model.scene!;
  const name = scene.robots.length > 1 ? `, ${scene.robots[model.selected]!.name} selected` : "";
  const left = `workspace at t = ${model.time.toFixed(1)} s${name}`;
  put(parts.workspace.title, left, () => [document.createTextNode(left)]);
  const alone = !model.control() && model.complete;
  app.root.querySelector("main")!.classList.toggle("alone", alone);
  parts.controls[0].section.hidden = alone;
  parts.controls.forEach(({ title }, slot) => {
    const control = model.control(slot);
    if (!control) return;
    const own = `${control.quantity.name}, ${control.response}`;
    const plane = control.planes[app.plane]!;
    const hidden = [0, 1, 2].filter((axis) => !plane.axes.includes(axis) && axis < plane.through.length)[0];
    const letters = ["x", "y", "z"];
    const slice =
      hidden === undefined
        ? ""
        : ` · slice at ${control.quantity.letter}${letters[hidden]} = ${plane.through[hidden]!.toFixed(2)} (keys 1 2 3)`;
    const when = ` at t = ${control.time.toFixed(1)} s`;
    put(title, own + slice + when + control.method, () => [
      document.createTextNode(`${control.method.toUpperCase()}: ${own} `),
      el("small", {}, `${when.trim()}${slice}`),
    ]);
  });
  const control = model.control();
  const outcome = model.outcomes[model.step]?.[model.selected] ?? "";
  const words = model.probe ? model.probe.sentence : control ? control.sentences.join(" ") : outcomeWords(outcome);
  if (parts.why.textContent !== words) parts.why.textContent = words;
  if (control && app.source.live) {
    const key = control.responses.join("|") + control.response;
    if (parts.response.dataset["key"] !== key) {
      parts.response.dataset["key"] = key;
      parts.response.replaceChildren(new Option("as committed", "-1"));
      control.responses.forEach((response, k) => parts.response.append(new Option(response, String(k))));
    }
  }
}

function outcomeWords(outcome: string): string {
  return outcome ? `Last decision: ${outcome.toLowerCase()}.` : "";
}

export function legends(app: App): void {
  const { model, parts, theme } = app;
  const scene = model.scene!;
  const several = scene.robots.length > 1;
  const control = model.control();
  const key = `${several} ${model.colouring} ${theme === DARK} ${!!control} ${model.element > 0} ${!!control?.binding.length}`;
  put(parts.workspace.legend, key, () => {
    const items = [entry("disc", several ? "selected robot" : "robot, arrow: motion in 1 s", theme.robot)];
    items.push(entry("ring", "goal", theme.goal));
    if (control) {
      items.push(entry("line", "committed, dot per second", theme.robot));
      items.push(entry("dash", "preferred, to first contact", theme.ink));
    }
    if (scene.obstacles.length) items.push(entry("disc", "obstacle", theme.neutral));
    if (several && model.colouring === "role") items.push(entry("disc", "other robot", theme.neutral));
    if (several && model.colouring === "outcome") {
      const known = new Map(Object.values(OUTCOMES).map(({ colour, label }) => [label, colour]));
      for (const [label, colour] of known) items.push(entry("disc", label, colour));
    }
    if (several && model.colouring === "speed") {
      items.push(entry("disc", "at rest", css(viridis(0, theme))), entry("disc", "fastest", css(viridis(1, theme))));
    }
    if (several && model.colouring === "time") {
      items.push(entry("disc", "close to its goal", css(viridis(0, theme))), entry("disc", "far", css(viridis(1, theme))));
    }
    if (control && (model.colouring === "role" || !several)) {
      items.push(entry("scale", "hit by the preferred control: soon to late"));
    }
    if (model.element > 0) items.push(entry("dash", "predicted, at the time ahead", theme.faint));
    return items;
  });
  for (const { legend } of parts.controls) {
    put(legend, key, () => [
      entry("ring", "preferred", theme.robot),
      entry("disc", "chosen", theme.robot),
      entry("line", "admissible set", theme.ink),
      entry("thin", "control obstacle of each obstacle", theme.ink),
      ...(model.deciding && control?.binding.length ? [entry("dash", "elements that decided", theme.robot)] : []),
      ...(model.element > 0 ? [entry("thin", "elements at the time ahead", theme.ink)] : []),
    ]);
  }
}
