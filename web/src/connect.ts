// What the elements of the page do.

import type { App } from "./app.ts";
import { chartWords, timeAt } from "./charts.ts";
import { eventsAt } from "./events.ts";
import { onKey } from "./keys.ts";
import { METRICS } from "./metrics.ts";
import { savePicture } from "./saving.ts";
import { DARK, LIGHT } from "./theme.ts";

export function connect(app: App): void {
  const { parts, model } = app;
  parts.play.onclick = () => app.play();
  parts.back.onclick = () => app.stepBy(-1);
  parts.forward.onclick = () => app.stepBy(1);
  parts.speed.onchange = () => (model.speed = Number(parts.speed.value));
  parts.time.oninput = () => app.seek(Number(parts.time.value));
  parts.element.oninput = () => app.setElement(Number(parts.element.value));
  parts.deciding.onchange = () => app.setDeciding(parts.deciding.checked);
  parts.robot.onchange = () => {
    app.select(parts.robot.valueAsNumber);
    parts.robot.value = String(model.selected);
  };
  parts.colouring.onchange = () => {
    model.colouring = parts.colouring.value as typeof model.colouring;
    app.redraw();
  };
  parts.theme.onclick = () => app.setTheme(app.theme === DARK ? LIGHT : DARK);
  parts.help.onclick = () => parts.keys.showModal();
  parts.method.onchange = parts.foresight.onchange = () => app.chooseMethod();
  parts.compare.onchange = () => app.chooseBeside(parts.compare.value, app.pair.method !== "");
  parts.own.onclick = () => app.chooseBeside(parts.compare.value, !app.pair.method);
  parts.response.onchange = () => {
    app.outdate();
    app.act({ do: "response", number: Number(parts.response.value), step: model.step });
  };
  parts.horizon.onchange = () => app.act({ do: "set", name: "horizon", value: Number(parts.horizon.value) });
  parts.undo.onclick = () => app.act({ do: "undo" });
  parts.yaml.onclick = () => app.act({ do: "yaml" });
  // The arrows then step through time, not through a list that was used.
  app.root.querySelectorAll("select").forEach((list) =>
    list.addEventListener("change", () => parts.workspace.canvas.focus({ preventScroll: true })),
  );
  parts.add.onclick = () => app.dragging.add();
  parts.remove.onclick = () => app.dragging.remove();
  for (const [bar, toggle] of [
    [parts.bars.drawing, parts.drawing],
    [parts.bars.more, parts.more],
  ] as const)
    toggle.onclick = () => {
      bar.hidden = !bar.hidden;
      toggle.setAttribute("aria-pressed", String(!bar.hidden));
      if (bar.hidden && app.tools.chosen && bar.contains(parts.tools.get(app.tools.chosen)!)) app.tools.choose(null);
    };
  parts.tools.forEach((tool, name) => (tool.onclick = () => app.tools.choose(name)));
  parts.empty.onclick = () => app.act({ do: "new" });
  parts.save.onclick = () => app.save();
  parts.follow.onclick = () => app.setFollow(!app.follow);
  parts.picture.onclick = () => savePicture(app);
  parts.lecture.onclick = () => app.setLecture(!model.quiz);
  parts.reveal.onclick = () => app.reveal();
  parts.charts.forEach(({ canvas, list }) => {
    const seek = (event: PointerEvent): void => {
      if (event.buttons) app.seek(Math.round(timeAt(app.pair.models, event.offsetX, canvas.clientWidth) / model.scene!.dt));
      if (!model.scene || !model.count) return;
      const lines = chartWords(app.pair.models, METRICS[list.selectedIndex]!, event.offsetX, canvas.clientWidth);
      app.hover.show(canvas, event.offsetX, event.offsetY, lines, []);
    };
    canvas.onpointerdown = (event) => {
      canvas.setPointerCapture(event.pointerId);
      seek(event);
    };
    canvas.onpointermove = seek;
    canvas.onpointerleave = () => app.hover.leave();
    list.onchange = () => app.redraw();
  });
  const { events } = parts;
  const under = (event: PointerEvent) => (model.count ? eventsAt(model, app.last, app.theme, events.clientWidth, event.offsetX) : []);
  events.onpointermove = (event) => {
    const times = under(event).map(({ step, words }) => `${(model.scene!.start + model.scene!.dt * step).toFixed(1)} s: ${words}`);
    events.title = times.join("\n");
    events.style.cursor = times.length ? "pointer" : "default";
  };
  events.onpointerdown = (event) => {
    const found = under(event).pop();
    if (found) app.seek(found.step);
  };
  // On a page of its own the view takes every key, in a notebook only those of its elements.
  const keys: HTMLElement | Document = app.root.parentElement?.id === "slalom" ? document : app.root;
  if (!app.leader) keys.addEventListener("keydown", (event) => onKey(app, event as KeyboardEvent));
  app.root.tabIndex = -1;
}
