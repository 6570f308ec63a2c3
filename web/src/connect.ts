// What the elements of the page do.

import type { App } from "./app.ts";
import { stepAt } from "./charts.ts";
import { onKey } from "./keys.ts";
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
  parts.compare.onchange = () => app.compare(parts.compare.value);
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
  parts.charts.forEach((canvas) => {
    const seek = (event: PointerEvent): void => {
      if (event.buttons) app.seek(stepAt(model, event.offsetX, canvas.clientWidth));
    };
    canvas.onpointerdown = (event) => {
      canvas.setPointerCapture(event.pointerId);
      seek(event);
    };
    canvas.onpointermove = seek;
  });
  // On a page of its own the view takes every key, in a notebook only those of its elements.
  const keys: HTMLElement | Document = app.root.parentElement?.id === "slalom" ? document : app.root;
  keys.addEventListener("keydown", (event) => onKey(app, event as KeyboardEvent));
  app.root.tabIndex = -1;
}
