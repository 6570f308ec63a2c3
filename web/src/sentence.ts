// The sentence that explains the choice; the names in it emphasise their bodies.

import type { App } from "./app.ts";
import { among, type Body, type Model } from "./model.ts";
import type { Control } from "./protocol.ts";
import { el } from "./ui.ts";

const QUESTION = "Which control does the robot choose? ";
/** What follows a name in a sentence: when the body is hit or passed. */
const WHEN = /(?= in \d)/;

const shown = new WeakMap<HTMLElement, string>();

export function sentence(app: App): void {
  const { model, parts } = app;
  const control = model.control();
  const second = model.scene!.compare ? model.control(1) : null;
  const outcome = model.outcomes[model.step]?.[model.selected] ?? "";
  const words = model.probe
    ? model.probe.sentence
    : model.hidden
      ? QUESTION
      : control && second
        ? [control, second].map((one) => `${one.method.toUpperCase()}: ${told(model, control, one)}`).join("\n")
        : control
          ? told(model, control, control)
          : outcome && `Last decision: ${outcome.toLowerCase()}.`;
  const named = model.named();
  const key = `${words} ${named.map(({ kind, index }) => `${kind} ${index}`).join()} ${model.quiz}`;
  if (shown.get(parts.why) !== key) parts.why.replaceChildren(...withNames(app, words, named));
  shown.set(parts.why, key);
  parts.why.querySelectorAll("b").forEach((name) => {
    const [kind, index] = name.dataset["body"]!.split(" ");
    name.classList.toggle("focus", among(model.focus, kind!, Number(index)));
  });
  parts.reveal.hidden = !model.quiz;
  parts.reveal.textContent = model.hidden ? "show the choice" : "hide the choice";
}

/** The sentences of one of the decisions in a state, with its time where the first one is not in force. */
function told(model: Model, control: Control, one: Control): string {
  const { start, dt } = model.scene!;
  const when = model.late(control) ? `At t = ${(start + dt * control.step).toFixed(1)} s: ` : "";
  return when + one.sentences.join(" ");
}

/** A text whose names of bodies, where they are hit or passed, can be pointed at. */
function withNames(app: App, words: string, bodies: Body[]): Node[] {
  const { model } = app;
  const byName = new Map(bodies.map((body) => [model.info(body).name, body]));
  return words.split(WHEN).flatMap((part): Node[] => {
    const name = [...byName.keys()].filter((one) => part.endsWith(` ${one}`)).sort((a, b) => b.length - a.length)[0];
    if (name === undefined) return [document.createTextNode(part)];
    const body = byName.get(name)!;
    const found = el("b", { "data-body": `${body.kind} ${body.index}` }, name);
    found.onpointerenter = () => app.hover.focus([body]);
    found.onpointerleave = () => app.hover.focus([]);
    return [document.createTextNode(part.slice(0, -name.length)), found];
  });
}
