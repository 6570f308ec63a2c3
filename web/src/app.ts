// The view: takes messages, runs the clock, draws, and passes on what the user does.

import { CHARTS, drawChart } from "./charts.ts";
import { connect } from "./connect.ts";
import { controlView, drawControl, enlargedView, type Panel } from "./control.ts";
import { Dragging } from "./drag.ts";
import { Viewport } from "./geometry.ts";
import { legends, titles } from "./legends.ts";
import { Model } from "./model.ts";
import type { Message, Scene } from "./protocol.ts";
import type { Command, Source } from "./sources.ts";
import { camera, Eye } from "./camera.ts";
import { projectionViews } from "./projections.ts";
import { read, write, type Held } from "./state.ts";
import { drawSpace } from "./space.ts";
import { DARK, LIGHT, type Theme } from "./theme.ts";
import { build, type Parts } from "./ui.ts";
import { drawWorkspace } from "./workspace.ts";

/** [ms] Longest time that a view which plays waits for the control space of a decision. */
const PATIENCE = 1000;

export class App {
  readonly model = new Model();
  readonly parts: Parts;
  readonly root: HTMLElement;
  readonly camera = camera();
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
  private looked = new Set<string>();
  /** [ms] When the playing began to wait for a control space; null: it does not. */
  private waits: number | null = null;
  private answered: number | null = null;
  /** A text that is shown until the next frames. */
  private notice = "";
  /** Whether the address holds the state: on a page of its own. */
  private readonly addressed: boolean;
  private held: Held = {};
  /** The step to show once it is there, of an address. */
  private due: number | null = null;
  private restoring = false;
  /** Whether the scene in `held` is the one that is shown. */
  private current = false;
  private written = "";
  private writtenAt = 0;

  constructor(
    host: HTMLElement,
    readonly source: Source,
  ) {
    const { root, parts } = build(source.live);
    parts.why.textContent = "The scene is being prepared.";
    this.root = root;
    this.parts = parts;
    this.addressed = host.id === "slalom";
    host.append(root);
    root.classList.add("waiting");
    const dark = window.matchMedia("(prefers-color-scheme: dark)");
    this.setTheme(dark.matches ? DARK : LIGHT);
    dark.addEventListener("change", () => this.setTheme(dark.matches ? DARK : LIGHT));
    this.dragging = new Dragging(this);
    connect(this);
    source.start(
      (messages) => this.receive(messages),
      (sentence) => this.say(sentence),
      () => this.opened(),
    );
    if (this.addressed && !source.live) void this.restore();
    const resized = new ResizeObserver(() => (this.drawn = ""));
    root.querySelectorAll(".frame").forEach((frame) => resized.observe(frame));
    const tick = (now: number): void => {
      requestAnimationFrame(tick);
      try {
        this.frame(now);
      } catch (error) {
        // One picture that cannot be drawn must not end the drawing of all later ones.
        console.error(error);
        this.say(`This picture cannot be drawn: ${String(error)}`);
      }
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
      if (message.kind === "control") this.waits = null;
      const fresh = this.model.take(message);
      if (fresh) this.say("");
      if (fresh) this.begin(message as Scene);
      if (message.kind === "control" || message.kind === "probe") this.answered = message.answers;
      if (message.kind === "control" || message.kind === "probe") this.dragging.answer(message.answers);
      if (message.kind === "error" || message.kind === "note") this.say(message.text);
      if (message.kind === "note") this.notice = message.text;
      if (message.kind === "note" && !this.model.scene) this.parts.why.textContent = `The scene is being prepared: ${message.text}.`;
      if (message.kind === "frames") this.endNotice();
      if (message.kind === "error") this.dragging.answer(Infinity);
      if (message.kind === "error") {
        this.restoring = false;
        this.reset();
      }
      if (message.kind === "yaml" && message.quiet) this.held.scene = message.text;
      else if (message.kind === "yaml") void this.showYaml(message.text);
      if (message.kind === "control" && message.slot === 1) this.compareWith(message.method);
    }
  }

  /** The lists show what is shown, also after a choice that was refused. */
  private reset(): void {
    const { model, parts } = this;
    if (!model.scene) return;
    const [method, foresight] = model.scene.method.split("@") as [string, string?];
    parts.method.value = method;
    parts.foresight.value = foresight ?? "";
    parts.compare.value = model.scene.compare ?? "";
    parts.horizon.value = String(model.scene.horizon);
    parts.robot.value = String(model.selected);
  }

  /** The name of the chosen method with its foresight. */
  chooseMethod(): void {
    const { method, foresight } = this.parts;
    this.act({ do: "method", name: method.value + (foresight.value ? `@${foresight.value}` : "") });
  }

  /** Sends a command of the user; what was said of the last one is no longer shown. */
  act(command: Command): number {
    this.say("");
    return this.send(command);
  }

  /** Restores what the page held, from its address at first; when it connects again what it showed. */
  private opened(): void {
    this.say("");
    void this.restore();
  }

  private async restore(): Promise<void> {
    if (!this.addressed || this.restoring) return;
    this.restoring = true;
    try {
      if (!this.model.scene) this.held = await read();
    } catch (error) {
      this.say(`The address holds no scene that can be read: ${String(error)}`);
    }
    const { step, ...state } = this.held;
    this.due = step ?? null;
    if (this.source.live && (state.scene || state.method || state.compare || state.robot)) this.send({ do: "restore", ...state });
    else this.restoring = false;
  }

  /** Keeps the state in the address, at most twice a second. */
  private keep(now: number): void {
    const { model } = this;
    const scene = model.scene!;
    if (this.due !== null && !this.restoring && (model.count > this.due || model.complete)) {
      if (!this.source.live && this.held.robot) this.select(this.held.robot);
      this.seek(this.due);
      this.due = null;
    }
    if (!this.addressed || this.restoring || this.due !== null || now - this.writtenAt < 500) return;
    if (this.source.live && scene.undo && model.complete && !this.current) {
      this.current = true;
      this.send({ do: "yaml", quiet: true });
    }
    if (!scene.undo) delete this.held.scene;
    const { scene: text } = this.held;
    this.held = {
      ...(text ? { scene: text } : {}),
      ...(this.source.live && !scene.recorded ? { method: scene.method } : {}),
      ...(scene.compare ? { compare: scene.compare } : {}),
      robot: model.selected,
      step: model.step,
    };
    const state = JSON.stringify(this.held);
    if (model.playing || state === this.written) return;
    this.written = state;
    this.writtenAt = now;
    void write(this.held);
  }

  private begin(scene: Scene): void {
    const { parts, model } = this;
    parts.title.textContent = [scene.title, ...(scene.live ? [] : [scene.method]), ...(scene.recorded ? ["replay"] : [])].join(" · ");
    parts.title.title = scene.notes.join(" ");
    document.title = `${scene.title} – slalom`;
    const several = scene.robots.length > 1;
    this.show("robot", several);
    this.show("colour", several);
    this.show("deciding", scene.dimension === 2);
    parts.robot.max = String(scene.robots.length - 1);
    parts.robot.value = String(model.selected);
    this.root.classList.remove("waiting");
    this.restoring = this.restoring && !scene.restored;
    this.current = false;
    if (parts.method.options.length === 0) {
      parts.compare.append(new Option("none", ""));
      parts.foresight.append(new Option("its own", ""), ...scene.foresights.map((name) => new Option(name, name)));
      for (const [name, sentence] of Object.entries(scene.methods)) {
        for (const list of [parts.method, parts.compare]) {
          const option = new Option(name, name);
          option.title = sentence;
          list.append(option);
        }
      }
    }
    this.reset();
    parts.undo.disabled = !scene.undo;
    parts.element.max = String(scene.horizon);
    if (model.element > scene.horizon) model.element = 0;
    this.arrange();
    if (!this.view || !scene.live) this.view = null;
    if (scene.notes.length && (!scene.live || scene.recorded)) this.say(scene.notes.join(" "));
    this.drawn = "";
    this.looked.clear();
  }

  /** Shows or hides the panel of the second method. */
  private arrange(): void {
    const second = Boolean(this.model.scene?.compare);
    this.parts.controls[1].section.hidden = !second;
    this.root.querySelector("main")!.className = second ? "three" : "";
    this.drawn = "";
  }

  /** Asks for the decision of a second method in the same state; "" for none. */
  compare(name: string): void {
    this.outdate();
    if (!name) this.compareWith("");
    this.dragging.expect(this.act({ do: "compare", name, step: this.model.step }));
  }

  /** Shows the panel of a second method; "" for none. */
  private compareWith(name: string): void {
    const { model } = this;
    if ((model.scene!.compare ?? "") === name) return;
    model.scene!.compare = name || null;
    if (!name) model.controls[1]!.clear();
    this.reset();
    this.arrange();
  }

  private show(name: string, visible: boolean): void {
    const found = this.root.querySelector<HTMLElement>(`[data-field="${name}"]`);
    if (found) found.hidden = !visible;
  }

  say(sentence: string): void {
    this.parts.note.textContent = sentence;
  }

  private endNotice(): void {
    if (this.notice && this.parts.note.textContent === this.notice) this.say("");
    this.notice = "";
  }

  private async showYaml(text: string): Promise<void> {
    const area = this.parts.yamlText;
    area.value = text;
    if (!this.parts.yamlDialog.open) this.parts.yamlDialog.showModal();
    area.select();
    area.scrollTop = 0;
    try {
      await navigator.clipboard.writeText(text);
      this.parts.yamlNote.textContent = "The scene is in the clipboard.";
    } catch {
      this.parts.yamlNote.textContent = "The clipboard is not accessible: copy the selected text.";
    }
  }

  play(on = !this.model.playing): void {
    const { model } = this;
    if (on && model.playhead >= model.count - 1 && model.complete) model.playhead = 0;
    model.playing = on;
    this.parts.play.textContent = on ? "❚❚" : "▶";
  }

  seek(step: number): void {
    this.model.playhead = Math.max(0, Math.min(this.model.count - 1, step));
    this.drawn = "";
  }

  select(robot: number): void {
    const { model } = this;
    if (!model.scene || !Number.isFinite(robot)) return;
    model.selected = Math.max(0, Math.min(model.scene.robots.length - 1, Math.round(robot)));
    this.parts.robot.value = String(model.selected);
    this.looked.clear();
    this.drawn = "";
    if (this.source.live) this.send({ do: "select", robot: model.selected });
  }

  setElement(time: number): void {
    this.model.element = Math.max(0, Math.min(this.model.scene?.horizon ?? 0, time));
    this.parts.element.value = String(this.model.element);
    this.drawn = "";
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
      const next = Math.min(model.count - 1, model.playhead + (passed * model.speed) / scene.dt);
      model.playhead = this.lacks(next) && this.patient(now) ? model.playhead : next;
      if (model.complete && model.playhead >= model.count - 1) this.play(false);
    }
    this.look();
    this.keep(now);
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
    const result = model.ended?.text ?? "";
    if (parts.result.textContent !== result) parts.result.textContent = result;
    parts.result.classList.toggle("alert", Boolean(model.ended?.collided));
    parts.ahead.textContent = model.element ? `+${model.element.toFixed(2)} s` : "now";
  }

  /** Whether the control space of the decision at a playhead is missing, of a view that shows control spaces. */
  private lacks(playhead: number): boolean {
    return this.source.live && this.model.control() !== null && !this.model.has(Math.floor(playhead + 1e-9));
  }

  /** Whether to wait for a control space: not longer than PATIENCE. */
  private patient(now: number): boolean {
    this.waits ??= now;
    return now - this.waits < PATIENCE;
  }

  /** Asks the server for the control space of the decision that is shown, and while it plays for the next one. */
  private look(): void {
    const { model } = this;
    if (!this.source.live || this.dragging.active || this.dragging.waiting) return;
    const ahead = model.playing ? [model.step + model.scene!.period_steps] : [];
    for (const step of [model.step, ...ahead]) {
      const key = `${step} ${model.selected}`;
      if (step >= model.count || model.has(step) || this.looked.has(key)) continue;
      this.looked.add(key);
      this.dragging.expect(this.send({ do: "look", step }));
      return;
    }
  }

  /** Forgets what was asked, after a change of what control spaces show. */
  outdate(): void {
    this.looked.clear();
    this.model.outdate();
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

  /** The viewport of a control space; with a pixel on the enlarged picture in it, that of this picture. */
  controlViewport(slot: number, pixel?: [number, number]): Viewport | null {
    const control = this.model.control(slot);
    if (!control) return null;
    const view = controlView(control, this.panel(slot));
    const inset = pixel ? enlargedView(control, this.panel(slot), view) : null;
    return inset?.holds(...pixel!) ? inset : view;
  }

  /** Shows the slice of the projection at a pixel; returns whether there is one. */
  choosePlane(slot: number, x: number, y: number): boolean {
    const control = this.model.control(slot);
    if (!control || control.planes.length < 2) return false;
    const found = projectionViews(control, this.panel(slot)).findIndex((view) => view.holds(x, y));
    if (found >= 0) this.plane = found;
    this.drawn = "";
    return found >= 0;
  }

  private context(canvas: HTMLCanvasElement): CanvasRenderingContext2D {
    const ratio = window.devicePixelRatio || 1;
    // Whole pixels: a picture that is stretched by a fraction of one is blurred.
    const frame = canvas.parentElement!.getBoundingClientRect();
    const [across, down] = [`${Math.floor(frame.width)}px`, `${Math.floor(frame.height)}px`];
    if (canvas.style.width !== across) canvas.style.width = across;
    if (canvas.style.height !== down) canvas.style.height = down;
    const [width, height] = [Math.round(canvas.clientWidth * ratio), Math.round(canvas.clientHeight * ratio)];
    if (canvas.width !== width || canvas.height !== height) [canvas.width, canvas.height] = [width, height];
    const g = canvas.getContext("2d")!;
    g.setTransform(ratio, 0, 0, ratio, 0, 0);
    return g;
  }

  /** Pixel of the selected robot in the plane, if it is in the picture. */
  selectedPixel(): [number?, number?] {
    const { model, view } = this;
    if (!view || model.scene!.dimension === 3) return [];
    const at = model.robot(model.selected);
    const [x, y] = [view.px(at[0]!), view.py(at[1]!)];
    return x >= 0 && y >= 0 && x <= view.width && y <= view.height ? [x, y] : [];
  }

  fit(): void {
    this.view = null;
    this.zoom = 1;
    Object.assign(this.camera, camera());
    this.drawn = "";
  }

  private draw(): void {
    const { model, parts } = this;
    const scene = model.scene!;
    const canvas = parts.workspace.canvas;
    const g = this.context(canvas);
    const [width, height] = [canvas.clientWidth, canvas.clientHeight];
    if (scene.dimension === 3) {
      const eye = new Eye(model, this.camera, width, height);
      drawSpace(g, model, this.theme, eye, width, height);
      this.dragging.drawInSpace(g, eye, this.theme);
    }
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
