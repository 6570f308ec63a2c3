// What happened in a run: collisions, arrivals, and decisions that did not keep the manoeuvre, below the time line.

import type { Context } from "./geometry.ts";
import type { Model } from "./model.ts";
import { OUTCOMES, type Theme } from "./theme.ts";

export interface Event {
  step: number;
  what: "collision" | "arrival" | "decision";
  words: string;
  colour: string;
}

/** [pixel] Half of the thumb of a slider: its ends are this far from the ends of the element. */
const THUMB = 8;
/** [pixel] How near the pointer must be to an event. */
const NEAR = 5;
/** Outcomes after which the manoeuvre is the same as before. */
const KEPT = ["", "KEPT", "CONTINUED", "INTERRUPTED"];

/** The events of the selected robot, collisions last: they are drawn over the others. */
export function eventsOf(model: Model, theme: Theme): Event[] {
  const scene = model.scene!;
  const k = model.selected;
  const found: Event[] = [];
  for (let step = 0; step < model.count; step += scene.period_steps) {
    const outcome = model.outcomes[step]?.[k] ?? "";
    // After the last decision its outcome is repeated.
    if (KEPT.includes(outcome) || (model.complete && step >= model.count - 1)) continue;
    const { colour, label } = OUTCOMES[outcome] ?? { colour: theme.faint, label: outcome.toLowerCase() };
    const words = label === "fallback" ? `${label}: ${outcome.toLowerCase()}` : label;
    found.push({ step, what: "decision", words: `decision: ${words}`, colour });
  }
  const stepOf = (time: number): number => Math.min(model.count - 1, Math.max(0, Math.round((time - scene.start) / scene.dt)));
  const at = model.arrived[k];
  if (at != null) found.push({ step: stepOf(at), what: "arrival", words: "arrival at the goal", colour: theme.goal });
  for (const [time, robot, name] of model.ended?.hits ?? [])
    if (robot === k) found.push({ step: stepOf(time), what: "collision", words: `collision with ${name}`, colour: theme.robot });
  return found;
}

function place(step: number, steps: number, width: number): number {
  return THUMB + ((width - 2 * THUMB) * step) / Math.max(1, steps);
}

/** Draws events on a time line of some steps. */
export function drawEvents(g: Context, model: Model, steps: number, theme: Theme, width: number, height: number): void {
  g.clearRect(0, 0, width, height);
  const middle = height / 2;
  for (const { step, what, colour } of eventsOf(model, theme)) {
    const x = place(step, steps, width);
    g.fillStyle = g.strokeStyle = colour;
    g.lineWidth = 2;
    g.beginPath();
    if (what === "decision") g.rect(x - 1, middle - 3, 2, 6);
    else if (what === "arrival") g.arc(x, middle, 4, 0, 2 * Math.PI);
    if (what === "collision") {
      g.moveTo(x - 4, middle - 4);
      g.lineTo(x + 4, middle + 4);
      g.moveTo(x - 4, middle + 4);
      g.lineTo(x + 4, middle - 4);
      g.lineWidth = 3;
    }
    if (what === "decision") g.fill();
    else g.stroke();
  }
}

/** The events at a pixel of the time line. */
export function eventsAt(model: Model, steps: number, theme: Theme, width: number, x: number): Event[] {
  return eventsOf(model, theme).filter(({ step }) => Math.abs(place(step, steps, width) - x) <= NEAR);
}
