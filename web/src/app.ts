// The view: takes messages, runs the clock, draws, and passes on what the user does.

import { CHARTS, drawChart, stepAt } from "./charts.ts";
import { controlView, drawControl, type Panel } from "./control.ts";
import { Dragging } from "./drag.ts";
import { Viewport } from "./geometry.ts";
import { onKey } from "./keys.ts";
import { legends, titles } from "./legends.ts";
import { Model } from "./model.ts";
import type { Message, Scene } from "./protocol.ts";
import type { Command, Source } from "./sources.ts";
import { drawSpace, type Camera } from "./space.ts";
import { DARK, LIGHT, type Theme } from "./theme.ts";
import { build, type Parts } from "./ui.ts";
import { drawWorkspace } from "./workspace.ts";

export class App {
  readonly model = new Model();
  readonly parts: Parts;
  readonly root: HTMLElement;
  readonly camera: Camera = { yaw: 0.6, pitch: 0.45, distance: 1.9 };
  theme: Theme = LIGHT;
  view: Viewport | null = null;
  plane = 0;
  zoom = 1;
  /** Milliseconds from a command to the picture of its answer, and of each drawing. */
  readonly latencies: number[] = [];
  readonly drawings: number[] = [];
  readonly dragging: Dragging;
  private lastTime = 0;
  private drawn = "";
  private asked = new Map<number, number>();
  private number = 0;
  private looked = "";
  private answered: number | null = null;

  constructor(
    host: HTMLElement,
    readonly source: Source,
  ) {
    const { root, parts } = build(source.live);
    this.root = root;
    this.parts = parts;
    host.append(root);
    const dark = window.matchMedia("(prefers-color-scheme: dark)");
    this.setTheme(dark.matches ? DARK : LIGHT);
    dark.addEventListener("change", () => this.setTheme(dark.matches ? DARK : LIGHT));
    this.dragging = new Dragging(this);
    this.connect();
    source.start(
      (messages) => this.receive(messages),
      (sentence) => (parts.note.textContent = sentence),
    );
    const resized = new ResizeObserver(() => (this.drawn = ""));
    root.querySelectorAll(".frame").forEach((frame) => resized.observe(frame));
    const tick = (now: number): void => {
      this.frame(now);
      requestAnimationFrame(tick);
    };
    requestAnimationFrame(tick);
  }

  setTheme(theme: Theme): void {
    this.theme = theme;
    this.root.dataset["theme"] = theme === DARK ? "dark" : "light";
    this.drawn = "";
  }

  /** Sends a command; its answer carries the number that is returned. */
  send(command: Command): number {
    const id = ++this.number;
    this.asked.set(id, performance.now());
    this.source.send({ ...command, id });
    return id;
  }

  private receive(messages: Message[]): void {
    for (const message of messages) {
      const fresh = this.model.take(message);
      if (fresh) this.begin(message as Scene);
      if (message.kind === "control" || message.kind === "probe") this.answered = message.answers;
      if (message.kind === "control" || message.kind === "probe") this.dragging.answer(message.answers);
      if (message.kind === "error" || message.kind === "note") this.say(message.text);
      if (message.kind === "error") this.dragging.answer(Infinity);
      if (message.kind === "yaml") void this.showYaml(message.text);
    }
  }

  private begin(scene: Scene): void {
    const { parts, model } = this;
    parts.title.textContent = `${scene.title} · ${scene.method}${scene.recorded ? " · recording" : ""}`;
    parts.title.title = scene.notes.join(" ");
    document.title = `${scene.title} – slalom`;
    const several = scene.robots.length > 1;
    this.show("robot", several);
    this.show("colour", several);
    parts.robot.max = String(scene.robots.length - 1);
    parts.robot.value = String(model.selected);
    if (parts.method.options.length === 0) {
      parts.compare.append(new Option("none", ""));
      for (const [name, sentence] of Object.entries(scene.methods)) {
        for (const list of [parts.method, parts.compare]) {
          const option = new Option(name, name);
          option.title = sentence;
          list.append(option);
        }
      }
    }
    parts.method.value = scene.method;
    parts.compare.value = scene.compare ?? "";
    parts.horizon.value = String(scene.horizon);
    parts.undo.disabled = !scene.undo;
    parts.element.max = String(scene.horizon);
    if (model.element > scene.horizon) model.element = 0;
    const second = parts.controls[1].section;
    second.hidden = !scene.compare;
    this.root.querySelector("main")!.className = scene.compare ? "three" : "";
    if (!this.view || !scene.live) this.view = null;
    if (scene.notes.length && (!scene.live || scene.recorded)) this.say(scene.notes.join(" "));
    this.drawn = "";
    this.looked = "";
  }

  private show(name: string, visible: boolean): void {
    const found = this.root.querySelector<HTMLElement>(`[data-field="${name}"]`);
    if (found) found.hidden = !visible;
  }

  say(sentence: string): void {
    this.parts.note.textContent = sentence;
  }

  private async showYaml(text: string): Promise<void> {
    const area = this.parts.yamlText;
    area.value = text;
    area.hidden = false;
    area.select();
    try {
      await navigator.clipboard.writeText(text);
      this.say("The scene is in the clipboard, and below.");
    } catch {
      this.say("The clipboard is not accessible: the scene is below, selected.");
    }
  }

  play(on = !this.model.playing): void {
    const { model } = this;
    if (on && model.playhead >= model.count - 1 && model.complete) model.playhead = 0;
    model.playing = on;
    this.parts.play.textContent = on ? "❚❚" : "▶";
    this.looked = "";
  }

  seek(step: number): void {
    this.model.playhead = Math.max(0, Math.min(this.model.count - 1, step));
    this.drawn = "";
  }

  select(robot: number): void {
    const { model } = this;
    model.selected = Math.max(0, Math.min(model.scene!.robots.length - 1, robot));
    this.parts.robot.value = String(model.selected);
    this.looked = "";
    this.drawn = "";
    if (this.source.live) this.send({ do: "select", robot: model.selected });
  }

  setElement(time: number): void {
    this.model.element = Math.max(0, Math.min(this.model.scene?.horizon ?? 0, time));
    this.parts.element.value = String(this.model.element);
    this.drawn = "";
  }

  private connect(): void {
    const { parts, model } = this;
    parts.play.onclick = () => this.play();
    parts.back.onclick = () => this.stepBy(-1);
    parts.forward.onclick = () => this.stepBy(1);
    parts.speed.onchange = () => (model.speed = Number(parts.speed.value));
    parts.time.oninput = () => this.seek(Number(parts.time.value));
    parts.element.oninput = () => this.setElement(Number(parts.element.value));
    parts.deciding.onchange = () => this.setDeciding(parts.deciding.checked);
    parts.robot.onchange = () => this.select(Number(parts.robot.value));
    parts.colouring.onchange = () => {
      model.colouring = parts.colouring.value as typeof model.colouring;
      this.drawn = "";
    };
    parts.theme.onclick = () => this.setTheme(this.theme === DARK ? LIGHT : DARK);
    parts.help.onclick = () => parts.keys.showModal();
    parts.method.onchange = () => this.send({ do: "method", name: parts.method.value });
    parts.compare.onchange = () => this.send({ do: "compare", name: parts.compare.value });
    parts.response.onchange = () => this.send({ do: "response", number: Number(parts.response.value) });
    parts.horizon.onchange = () => this.send({ do: "set", name: "horizon", value: Number(parts.horizon.value) });
    parts.undo.onclick = () => this.send({ do: "undo" });
    parts.yaml.onclick = () => this.send({ do: "yaml" });
    parts.add.onclick = () => this.dragging.add();
    parts.remove.onclick = () => this.dragging.remove();
    parts.charts.forEach((canvas) => {
      const seek = (event: PointerEvent): void => {
        if (event.buttons) this.seek(stepAt(model, event.offsetX, canvas.clientWidth));
      };
      canvas.onpointerdown = (event) => {
        canvas.setPointerCapture(event.pointerId);
        seek(event);
      };
      canvas.onpointermove = seek;
    });
    // On a page of its own the view takes every key, in a notebook only those of its elements.
    const keys: HTMLElement | Document = this.root.parentElement?.id === "slalom" ? document : this.root;
    keys.addEventListener("keydown", (event) => onKey(this, event as KeyboardEvent));
    this.root.tabIndex = -1;
  }

  setDeciding(on: boolean): void {
    this.model.deciding = on;
    this.parts.deciding.checked = on;
    this.drawn = "";
  }

  stepBy(steps: number): void {
    this.play(false);
    this.seek(Math.round(this.model.playhead) + steps);
  }

  private frame(now: number): void {
    const { model, parts } = this;
    const passed = Math.min(0.25, (now - this.lastTime) / 1000);
    this.lastTime = now;
    const scene = model.scene;
    if (!scene || !model.count) return;
    if (model.playing) {
      model.playhead = Math.min(model.count - 1, model.playhead + (passed * model.speed) / scene.dt);
      if (model.complete && model.playhead >= model.count - 1) this.play(false);
    }
    this.look();
    const state = `${model.version} ${model.playhead} ${model.selected} ${this.plane} ${this.zoom}`;
    if (state === this.drawn) return;
    this.drawn = state;
    const before = performance.now();
    this.draw();
    this.drawings.push(performance.now() - before);
    if (this.drawings.length > 600) this.drawings.shift();
    if (this.answered !== null) {
      const sent = this.asked.get(this.answered);
      if (sent !== undefined) this.latencies.push(performance.now() - sent);
      this.asked.delete(this.answered);
      this.answered = null;
    }
    parts.time.max = String(Math.max(1, model.count - 1));
    parts.time.value = String(model.step);
    parts.clock.textContent = `t ${model.time.toFixed(2)} s`;
    parts.ahead.textContent = model.element ? `+${model.element.toFixed(2)} s` : "now";
  }

  /** Asks the server for the control space of the step that is shown. */
  private look(): void {
    const { model } = this;
    if (!this.source.live || this.dragging.active) return;
    const key = `${model.step} ${model.selected}`;
    if (key === this.looked || this.dragging.waiting) return;
    this.looked = key;
    this.dragging.expect(this.send({ do: "look", step: model.step, robot: model.selected }));
  }

  redraw(): void {
    this.drawn = "";
  }

  panel(slot: number): Panel {
    const canvas = this.parts.controls[slot]!.canvas;
    return {
      width: canvas.clientWidth,
      height: canvas.clientHeight,
      theme: this.theme,
      plane: this.plane,
      zoom: this.zoom,
    };
  }

  controlViewport(slot: number): Viewport | null {
    const control = this.model.control(slot);
    return control ? controlView(control.planes[this.plane]!, this.panel(slot)) : null;
  }

  private context(canvas: HTMLCanvasElement): CanvasRenderingContext2D {
    const ratio = window.devicePixelRatio || 1;
    const [width, height] = [Math.round(canvas.clientWidth * ratio), Math.round(canvas.clientHeight * ratio)];
    if (canvas.width !== width || canvas.height !== height) [canvas.width, canvas.height] = [width, height];
    const g = canvas.getContext("2d")!;
    g.setTransform(ratio, 0, 0, ratio, 0, 0);
    return g;
  }

  fit(): void {
    this.view = null;
    this.zoom = 1;
    this.drawn = "";
  }

  private draw(): void {
    const { model, parts } = this;
    const scene = model.scene!;
    const canvas = parts.workspace.canvas;
    const g = this.context(canvas);
    const [width, height] = [canvas.clientWidth, canvas.clientHeight];
    if (scene.dimension === 3) drawSpace(g, model, this.theme, this.camera, width, height);
    else {
      if (!this.view || this.view.width !== width || this.view.height !== height) {
        this.view = Viewport.fit(scene.low, scene.high, 0, 0, width, height);
      }
      const handles = this.source.live;
      drawWorkspace(g, model, { theme: this.theme, view: this.view, width, height, handles });
      this.dragging.draw(g, this.view, this.theme);
    }
    parts.controls.forEach(({ section, canvas: own }, slot) => {
      const control = model.control(slot);
      if (section.hidden) return;
      const h = this.context(own);
      if (control) drawControl(h, model, control, this.panel(slot));
      else h.clearRect(0, 0, own.clientWidth, own.clientHeight);
    });
    CHARTS.forEach((chart, k) => {
      const own = parts.charts[k]!;
      drawChart(this.context(own), model, chart, this.theme, own.clientWidth, own.clientHeight);
    });
    titles(this);
    legends(this);
  }
}
