// The view: takes messages, runs the clock, draws, and passes on what the user does.

import { Address } from "./address.ts";
import { drawChart } from "./charts.ts";
import { connect } from "./connect.ts";
import { controlView, drawControl, enlargedView, type Panel } from "./control.ts";
import { Dragging } from "./drag.ts";
import { drawEvents } from "./events.ts";
import { Viewport, type } from "./geometry.ts";
import { Hover } from "./hover.ts";
import { legends, titles } from "./legends.ts";
import { METRICS } from "./metrics.ts";
import { Model } from "./model.ts";
import { Pair } from "./pair.ts";
import type { Message, Scene } from "./protocol.ts";
import type { Command, Source } from "./sources.ts";
import { camera, Eye } from "./camera.ts";
import { projectionViews } from "./projections.ts";
import { download } from "./saving.ts";
import { sentence } from "./sentence.ts";
import { drawSpace } from "./space.ts";
import { DARK, LIGHT, type Theme } from "./theme.ts";
import { Tools } from "./tools.ts";
import { build, type Parts } from "./ui.ts";
import { drawWorkspace } from "./workspace.ts";

/** [ms] Longest time that a view which plays waits for the control space of a decision. */
const PATIENCE = 1000;
/** Factor of the type in a lecture. */
const LECTURE = 1.45;

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
  readonly hover = new Hover(this);
  readonly tools = new Tools(this);
  readonly pair = new Pair(this);
  readonly address: Address;
  follow = false;
  private ended = false;
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
  constructor(
    host: HTMLElement,
    readonly source: Source,
    /** The view beside which this one is, whose time it shows. */
    readonly leader: App | null = null,
  ) {
    const { root, parts } = build(source.live);
    parts.why.textContent = "The scene is being prepared.";
    this.root = root;
    this.parts = parts;
    this.address = new Address(this, host.id === "slalom");
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
    if (!source.live) void this.address.restore();
    const resized = new ResizeObserver(() => (this.drawn = ""));
    root.querySelectorAll(".frame").forEach((frame) => resized.observe(frame));
    const tick = (now: number): void => {
      if (this.ended) return;
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

  /** Takes the view from the page. */
  end(): void {
    this.ended = true;
    this.source.end?.();
    this.root.remove();
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
        this.address.refused();
        this.reset();
      }
      if (message.kind === "yaml" && message.quiet) {
        this.address.hold(message.text);
        this.pair.changed(message.text);
      } else if (message.kind === "yaml") void this.takeYaml(message.text);
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
    parts.compare.value = this.pair.method || (model.scene.compare ?? "");
    this.show("compare", !this.pair.fixed);
    parts.own.hidden = this.pair.fixed || !parts.compare.value || !this.source.beside;
    parts.own.setAttribute("aria-pressed", String(this.pair.method !== ""));
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

  /** Restores what the page held. */
  private opened(): void {
    this.say("");
    void this.address.restore();
  }

  private begin(scene: Scene): void {
    const { parts, model } = this;
    parts.title.textContent = [scene.title, ...(scene.live ? [] : [scene.method]), ...(scene.recorded ? ["replay"] : [])].join(" · ");
    parts.title.title = scene.notes.join(" ");
    if (!this.leader) document.title = `${scene.title} – slalom`;
    const several = scene.robots.length > 1;
    this.show("robot", several);
    this.show("colour", several);
    this.show("deciding", scene.dimension === 2);
    parts.robot.max = String(scene.robots.length - 1);
    parts.robot.value = String(model.selected);
    this.root.classList.remove("waiting");
    this.address.began(scene);
    if (!this.address.restoring) this.pair.began(scene);
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
    this.parts.main.className = second ? "three" : "";
    this.drawn = "";
  }

  /** Shows a second method beside the first one: its decision in the same state, or its run from the same start. */
  chooseBeside(name: string, own: boolean): void {
    this.pair.open(own ? name : "");
    const shared = own ? "" : name;
    if (shared !== (this.model.scene!.compare ?? "")) this.compare(shared);
    this.reset();
    this.parts.compare.value = name;
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
    // The view beside this one is in this one, before the fields.
    const all = [...this.root.querySelectorAll<HTMLElement>(`[data-field="${name}"]`)];
    const found = all.find((field) => field.closest(".slalom") === this.root);
    if (found) found.hidden = !visible;
  }

  say(sentence: string): void {
    this.parts.note.textContent = sentence;
  }

  private endNotice(): void {
    if (this.notice && this.parts.note.textContent === this.notice) this.say("");
    this.notice = "";
  }

  /** Saves or shows the scene, whichever was asked for. */
  private async takeYaml(text: string): Promise<void> {
    if (this.saving) return this.saveYaml(text);
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

  private saving = false;

  /** Asks for the scene as YAML, to save it. */
  save(): void {
    this.saving = true;
    this.act({ do: "yaml" });
  }

  private saveYaml(text: string): void {
    this.saving = false;
    download(new Blob([text], { type: "application/yaml" }), `${this.model.scene!.title}.yaml`);
  }

  play(on = !this.model.playing): void {
    const { model } = this;
    if (on && model.playhead >= this.last && this.pair.complete) model.playhead = 0;
    model.playing = on;
    this.parts.play.textContent = on ? "❚❚" : "▶";
  }

  seek(step: number): void {
    this.model.playhead = Math.max(0, Math.min(this.last, step));
    this.drawn = "";
  }

  /** The last step, of the longer of two runs. */
  get last(): number {
    const { scene } = this.model;
    return scene ? Math.max(0, Math.round(Math.max(...this.pair.models.map((one) => one.scene!.dt * (one.count - 1))) / scene.dt)) : 0;
  }

  setFollow(on: boolean): void {
    this.follow = on;
    if (!on) this.camera.at = null;
    this.parts.follow.setAttribute("aria-pressed", String(on));
    this.drawn = "";
  }

  /** Large type, and choices are hidden until they are asked for. */
  setLecture(on: boolean): void {
    this.model.quiz = on;
    type.scale = on ? LECTURE : 1;
    this.root.classList.toggle("lecture", on);
    this.parts.lecture.setAttribute("aria-pressed", String(on));
    this.drawn = "";
  }

  reveal(): void {
    if (this.model.quiz) [this, this.pair.second].forEach((one) => one?.model.reveal());
  }

  select(robot: number): void {
    const { model } = this;
    if (!model.scene || !Number.isFinite(robot)) return;
    model.selected = Math.max(0, Math.min(model.scene.robots.length - 1, Math.round(robot)));
    this.parts.robot.value = String(model.selected);
    this.looked.clear();
    this.drawn = "";
    if (this.source.live) this.send({ do: "select", robot: model.selected });
    this.pair.second?.select(robot);
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
    if (!this.leader) this.advance(now, passed);
    this.look();
    this.address.keep(now);
    const second = this.pair.second?.model.version ?? 0;
    const state = `${model.version} ${second} ${model.playhead} ${model.selected} ${this.plane} ${this.zoom}`;
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
    parts.time.max = String(Math.max(1, this.last));
    parts.time.value = String(Math.floor(model.playhead + 1e-9));
    parts.clock.textContent = `t ${(scene.start + scene.dt * model.playhead).toFixed(2)} s`;
    const result = model.ended?.text ?? "";
    if (parts.result.textContent !== result) parts.result.textContent = parts.result.title = result;
    parts.result.classList.toggle("alert", Boolean(model.ended?.collided));
    const heading = this.pair.second || this.leader ? [scene.title, scene.method, result].filter(Boolean).join(" · ") : "";
    if (parts.heading.textContent !== heading) parts.heading.textContent = heading;
    parts.heading.classList.toggle("alert", Boolean(model.ended?.collided));
    parts.ahead.textContent = model.element ? `+${model.element.toFixed(2)} s` : "now";
  }

  /** Moves the time of the view, and of the one beside it. */
  private advance(now: number, passed: number): void {
    const { model } = this;
    const { dt } = model.scene!;
    if (model.playing) {
      const next = Math.min(this.last, model.playhead + (passed * model.speed) / dt);
      const waiting = this.lacks(next * dt) || this.pair.second?.lacks(next * dt);
      model.playhead = waiting && this.patient(now) ? model.playhead : next;
      if (this.pair.complete && model.playhead >= this.last) this.play(false);
    }
    this.pair.follow(dt * model.playhead);
  }

  /** Whether the control space of the decision at a time [s] since the start is missing, of a view that shows them. */
  private lacks(time: number): boolean {
    const { model } = this;
    if (!this.source.live || model.control() === null) return false;
    return !model.has(Math.min(model.count - 1, Math.floor(time / model.scene!.dt + 1e-9)));
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

  /** Draws now, with some pixels for each pixel of the page, until the next drawing. */
  drawAt(ratio: number): void {
    for (const one of [this, this.pair.second]) {
      if (!one?.model.count) continue;
      one.ratio = ratio;
      one.draw();
      one.ratio = null;
    }
  }

  private ratio: number | null = null;

  private context(canvas: HTMLCanvasElement): CanvasRenderingContext2D {
    const ratio = this.ratio ?? (window.devicePixelRatio || 1);
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
    this.setFollow(false);
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
      if (this.follow) this.camera.at = model.robot(model.selected);
      const eye = new Eye(model, this.camera, width, height);
      drawSpace(g, model, this.theme, eye, width, height);
      this.dragging.drawInSpace(g, eye, this.theme);
    } else {
      if (!this.view || this.view.width !== width || this.view.height !== height) {
        this.view = Viewport.fit(scene.low, scene.high, 0, 0, width, height);
      }
      if (this.follow) [this.view.x, this.view.y] = model.robot(model.selected) as [number, number];
      const handles = this.source.live;
      drawWorkspace(g, model, { theme: this.theme, view: this.view, width, height, handles });
      this.dragging.draw(g, this.view, this.theme);
      this.tools.draw(g, this.view, this.theme);
    }
    parts.controls.forEach(({ section, canvas: own }, slot) => {
      const control = model.control(slot);
      if (section.hidden) return;
      const h = this.context(own);
      if (control) drawControl(h, model, control, this.panel(slot));
      else h.clearRect(0, 0, own.clientWidth, own.clientHeight);
    });
    if (!this.leader) this.drawTime();
    titles(this);
    legends(this);
    sentence(this);
  }

  /** The charts and the events on the time line. */
  private drawTime(): void {
    const { parts, theme } = this;
    const { models } = this.pair;
    for (const { canvas, list } of parts.charts) {
      if (!canvas.offsetParent) continue;
      const g = this.context(canvas);
      drawChart(g, models, METRICS[list.selectedIndex]!, theme, canvas.clientWidth, canvas.clientHeight);
    }
    const { events } = parts;
    drawEvents(this.context(events), this.model, this.last, theme, events.clientWidth, events.clientHeight);
  }
}
