// The keyboard: everything that the pointer can do.

import type { App } from "./app.ts";
import { savePicture } from "./saving.ts";
import { DARK, LIGHT } from "./theme.ts";

const SPEEDS = [0.25, 0.5, 1, 2, 4, 8];
const ARROWS: Record<string, [number, number, number]> = {
  ArrowLeft: [-1, 0, 0],
  ArrowRight: [1, 0, 0],
  ArrowUp: [0, 1, 0],
  ArrowDown: [0, -1, 0],
  PageUp: [0, 0, 1],
  PageDown: [0, 0, -1],
};

export function onKey(app: App, event: KeyboardEvent): void {
  const target = event.target as HTMLElement;
  const field = target instanceof HTMLInputElement ? target.type : target.tagName;
  if (target.closest("dialog[open]")) return;
  const own =
    field === "number" ||
    field === "TEXTAREA" ||
    (field === "range" && /^(Arrow|Page|Home|End)/.test(event.key)) ||
    (field === "SELECT" && !/^(ArrowLeft|ArrowRight|Escape)$/.test(event.key)) ||
    (event.key === " " && ["BUTTON", "checkbox"].includes(field));
  if (own || event.ctrlKey || event.metaKey || event.altKey) return;
  const direction = ARROWS[event.key];
  if (direction && event.shiftKey) {
    app.dragging.nudge(direction);
    event.preventDefault();
    return;
  }
  const action = actions(app)[event.key];
  if (!action) return;
  action();
  event.preventDefault();
}

function actions(app: App): Record<string, () => void> {
  const { model, parts, dragging } = app;
  const live = app.source.live;
  const faster = (by: number): void => {
    const k = Math.max(0, Math.min(SPEEDS.length - 1, SPEEDS.indexOf(model.speed) + by));
    model.speed = SPEEDS[k]!;
    parts.speed.value = String(model.speed);
  };
  const robots = model.scene?.robots.length ?? 1;
  const found: Record<string, () => void> = {
    " ": () => app.play(),
    ArrowLeft: () => app.stepBy(-1),
    ArrowRight: () => app.stepBy(1),
    Home: () => app.seek(0),
    End: () => app.seek(Infinity),
    "+": () => faster(1),
    "=": () => faster(1),
    "-": () => faster(-1),
    ".": () => app.setElement(model.element + 0.1),
    ",": () => app.setElement(model.element - 0.1),
    n: () => app.select((model.selected + 1) % robots),
    p: () => app.select((model.selected + robots - 1) % robots),
    d: () => app.setDeciding(!model.deciding),
    t: () => app.setTheme(app.theme === DARK ? LIGHT : DARK),
    f: () => app.fit(),
    o: () => app.setFollow(!app.follow),
    l: () => app.tools.choose("ruler"),
    s: () => savePicture(app),
    e: () => app.setLecture(!model.quiz),
    v: () => app.reveal(),
    h: () => dragging.next(),
    Escape: () => {
      app.tools.choose(null);
      dragging.release();
    },
    "]": () => dragging.magnify(-1, 1.25, ...app.selectedPixel()),
    "[": () => dragging.magnify(-1, 0.8, ...app.selectedPixel()),
    "}": () => dragging.magnify(0, 1.25),
    "{": () => dragging.magnify(0, 0.8),
    "?": () => parts.keys.showModal(),
  };
  for (const plane of [0, 1, 2]) {
    found[String(plane + 1)] = () => {
      const planes = model.control()?.planes.length ?? 1;
      app.plane = Math.min(planes - 1, plane);
      app.redraw();
    };
  }
  if (live) {
    found["a"] = () => dragging.add();
    found["x"] = () => dragging.remove();
    found["b"] = () => parts.own.click();
    found["u"] = () => parts.undo.click();
    found["y"] = () => parts.yaml.click();
    for (const [key, list] of [
      ["m", parts.method],
      ["c", parts.compare],
      ["r", parts.response],
    ] as const) {
      found[key] = () => {
        list.selectedIndex = (list.selectedIndex + 1) % list.options.length;
        list.dispatchEvent(new Event("change"));
      };
    }
  }
  return found;
}
