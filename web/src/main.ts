// Entry: a file, a page of the server, or a notebook.

import { App } from "./app.ts";
import { BlockSource, fromBase64, ServerSource, WidgetSource, type WidgetModel } from "./sources.ts";
import css from "./style.css";

function styled(): void {
  if (document.getElementById("slalom-style")) return;
  const style = document.createElement("style");
  style.id = "slalom-style";
  style.textContent = css;
  document.head.append(style);
}

interface Host extends HTMLElement {
  slalom?: App;
}

function mount(host: Host, app: () => App): App {
  styled();
  host.slalom = app();
  return host.slalom;
}

/** For notebooks (anywidget). */
function render({ model, el }: { model: WidgetModel; el: HTMLElement }): void {
  const block = (): Uint8Array => {
    const data = model.get("data");
    return new Uint8Array(data.buffer, data.byteOffset, data.byteLength);
  };
  mount(el, () => new App(el, model.get("live") ? new WidgetSource(model) : new BlockSource(block))).root.classList.add("embedded");
}

const host = document.getElementById("slalom") as Host | null;
const data = document.getElementById("slalom-data");
if (host && data) mount(host, () => new App(host, new BlockSource(() => fromBase64(data.textContent ?? ""))));
else if (host?.dataset["live"]) {
  const app = mount(host, () => new App(host, new ServerSource()));
  if (host.dataset["live"] === "2") app.pair.show(new ServerSource(1));
}

export default { render };
