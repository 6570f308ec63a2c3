// The page of the documentation: scenes of the paper that the reader changes, without a server.

import {
  admissible,
  area,
  blockedShare,
  contacts,
  controlObstacle,
  METHODS,
  type ControlObstacle,
  type Decision,
  type Method,
  type Vector,
} from "./engine.ts";
import { controlSquare, drawControlSpace, drawScene, extrapolates, FEW, first, UNITS, type Picture } from "./explorer_draw.ts";
import { Grasp } from "./explorer_drag.ts";
import { copied, decision, half, IDEAS, read, written, type Scene } from "./explorer_scene.ts";
import css from "./explorer.css";
import { Viewport } from "./geometry.ts";
import viewCss from "./style.css";
import { DARK, LIGHT, type Theme } from "./theme.ts";
import { button, el, entry, field, panel } from "./ui.ts";

/** [1] Error of the drawn curves, as a share of half the width of a control space. */
const TOLERANCE = 1 / 6000;
/** [ms] Least time between two changes of the address, which browsers limit. */
const REST = 300;

const WORDS: Record<Method, string> = {
  VO: "obstacles keep their velocity",
  NLVO: "obstacles on known paths",
  AO: "obstacles keep their acceleration",
  NAO: "obstacles on known paths",
};
const HOLDS: [string, string][] = [
  ["horizon", "to the horizon"],
  ["0.5", "for 0.5 s, then coasts"],
  ["1", "for 1 s, then coasts"],
  ["2", "for 2 s, then coasts"],
];
const KEYS = [
  ["h", "next handle"],
  ["shift + arrows", "move the handle"],
  ["escape", "let it go"],
  ["space", "play or pause"],
  [", .", "look ahead less or more"],
  ["a, x", "add an obstacle, remove the selected one"],
  ["t", "light or dark"],
] as const;

function input(name: string, min: number, max: number, step: number): HTMLInputElement {
  return el("input", { type: "number", min: `${min}`, max: `${max}`, step: `${step}`, "data-name": name, "aria-label": name });
}

/** Numbers of a scene that have a field: its words, the least and largest value, and the step. */
const FIELDS = {
  horizon: ["horizon [s]", 1, 20, 0.5],
  margin: ["margin [m]", 0, 5, 0.1],
  maxSpeed: ["speed limit [m/s]", 0.5, 40, 0.5],
  maxAcceleration: ["acceleration limit [m/s²]", 0.25, 20, 0.25],
} as const;
type Field = keyof typeof FIELDS;

export class Explorer {
  scene: Scene = copied(IDEAS["vo"]!);
  theme: Theme = LIGHT;
  /** [s] Look ahead. */
  ahead = 0;
  selected: number | null = null;
  found: ControlObstacle[] = [];
  times: number[][] = [];
  /** [ms] Script of each drawn picture. */
  readonly drawings: number[] = [];
  readonly workspace = panel("workspace");
  readonly controls = [panel("control"), panel("control")] as const;
  readonly hover = el("div", { class: "hover" });
  view = new Viewport(0, 0, 1, 1, 1);
  readonly grasp: Grasp;
  private readonly why = el("p", { class: "why", role: "status", "aria-live": "polite" });
  private readonly note = el("p", { class: "note", role: "alert" });
  private readonly tabs = el("nav", { "aria-label": "ideas" });
  private readonly play = button("play", "▶", "play or pause the look ahead (space)");
  private readonly slider = el("input", { type: "range", min: "0", step: "0.02", value: "0", "aria-label": "look ahead" });
  private readonly clock = el("output", { class: "clock" });
  private readonly lists = this.controls.map((_, slot) => el("select", { "aria-label": slot ? "second method" : "method" }));
  private readonly hold = el("select", { "aria-label": "how long an acceleration is held" });
  private readonly fields = Object.fromEntries(
    Object.entries(FIELDS).map(([name, [, low, high, step]]) => [name, input(name, low, high, step)]),
  ) as Record<Field, HTMLInputElement>;
  private playing = false;
  private stale = true;
  private lastTime = 0;
  private writtenAt = 0;
  private unwritten = false;

  constructor(readonly root: HTMLElement) {
    const ideas = [...root.querySelectorAll<HTMLElement>("section.idea")];
    for (const idea of ideas)
      this.tabs.append(el("a", { href: `#${idea.id}&` }, idea.querySelector("h1")!.dataset["short"] ?? ""));
    this.workspace.canvas.after(this.hover);
    this.controls.forEach(({ title }, slot) => title.append(this.lists[slot]!, el("small", {})));
    for (const [slot, list] of this.lists.entries()) {
      if (slot) list.append(new Option("none", ""));
      for (const method of Object.keys(METHODS)) list.append(new Option(method, method));
    }
    for (const [value, words] of HOLDS) this.hold.append(new Option(words, value));
    this.build(ideas);
    this.grasp = new Grasp(this);
    this.listen();
    this.setTheme(window.matchMedia("(prefers-color-scheme: dark)").matches ? DARK : LIGHT);
    this.open();
    requestAnimationFrame((now) => this.frame(now));
  }

  private build(ideas: HTMLElement[]): void {
    const act = (name: string, label: string, title: string, action: () => void): HTMLButtonElement => {
      const made = button(name, label, title);
      made.onclick = action;
      return made;
    };
    this.root.classList.add("slalom", "explorer");
    this.root.replaceChildren(
      el(
        "header",
        {},
        this.tabs,
        act("reset", "reset", "the scene as it was", () => this.show(copied(IDEAS[this.scene.idea]!))),
        act("link", "copy link", "copy the address, which holds this scene", () => void this.copyLink()),
        act("add", "+ obstacle", "add an obstacle (a)", () => this.add()),
        act("remove", "− obstacle", "remove the selected obstacle (x)", () => this.remove()),
        act("theme", "◐", "light or dark (t)", () => this.setTheme(this.theme === DARK ? LIGHT : DARK)),
      ),
      el("div", { class: "ideas" }, ...ideas),
      this.note,
      el("main", {}, this.workspace.section, ...this.controls.map(({ section }) => section)),
      this.why,
      el(
        "div",
        { class: "transport" },
        this.play,
        el("label", { class: "ahead" }, el("span", {}, "look ahead"), this.slider, this.clock),
        ...Object.entries(FIELDS).map(([name, [words]]) => field(words, this.fields[name as Field], name)),
        field("an acceleration is held", this.hold, "hold"),
      ),
      el(
        "details",
        {},
        el("summary", {}, "Keys"),
        el("dl", {}, ...KEYS.flatMap(([key, words]) => [el("dt", {}, key), el("dd", {}, words)])),
      ),
    );
    this.workspace.title.textContent = "workspace [m]";
  }

  private listen(): void {
    window.addEventListener("hashchange", () => this.open());
    window.addEventListener("keydown", (event) => this.key(event));
    new ResizeObserver(() => this.redraw()).observe(this.root);
    this.play.onclick = () => this.setPlaying(!this.playing);
    this.slider.oninput = () => {
      this.setPlaying(false);
      this.look(Number(this.slider.value));
    };
    this.lists.forEach((list) => (list.onchange = () => this.chooseMethods()));
    this.hold.onchange = () => {
      this.scene.hold = this.hold.value === "horizon" ? null : Number(this.hold.value);
      this.changed();
    };
    for (const [name, one] of Object.entries(this.fields) as [Field, HTMLInputElement][])
      one.onchange = () => {
        const [words, low, high] = FIELDS[name];
        const value = one.valueAsNumber;
        if (value >= low && value <= high) this.scene[name] = value;
        this.changed();
        if (!(value >= low && value <= high)) this.say(`${words}: expected a number from ${low} to ${high}.`);
      };
  }

  /** Shows the scene that the address holds. */
  private open(): void {
    try {
      this.show(read(location.hash), false);
    } catch (error) {
      this.show(this.scene, false);
      this.say(`The address holds no scene: ${(error as Error).message}.`);
    }
  }

  show(scene: Scene, changed = true): void {
    this.scene = scene;
    this.selected = null;
    this.grasp.release();
    this.setPlaying(false);
    this.look(0);
    for (const idea of this.root.querySelectorAll<HTMLElement>("section.idea")) idea.hidden = idea.id !== scene.idea;
    for (const tab of this.tabs.querySelectorAll("a")) {
      if (tab.hash === `#${scene.idea}&`) tab.setAttribute("aria-current", "page");
      else tab.removeAttribute("aria-current");
    }
    this.arrange();
    this.say("");
    if (changed) this.changed();
    this.redraw();
  }

  /** Fields and panels as in the scene. */
  private arrange(): void {
    const { scene } = this;
    const second = scene.methods[1];
    this.controls[1].section.hidden = !second;
    this.root.querySelector("main")!.className = second ? "three" : "";
    this.lists.forEach((list, slot) => (list.value = scene.methods[slot] ?? ""));
    scene.methods.forEach((method, slot) => {
      const { title, legend } = this.controls[slot]!;
      title.querySelector("small")!.textContent = WORDS[method];
      const { quantity } = METHODS[method];
      legend.replaceChildren(
        entry("disc", quantity, this.theme.robot),
        entry("line", "admissible set", this.theme.ink),
        ...(scene.obstacles.length && scene.obstacles.length <= FEW ? [entry("cross", `${quantity} of an obstacle`)] : []),
        ...(this.ahead > 0 ? [entry("thin", "elements at the time ahead", this.theme.ink)] : []),
      );
    });
    const value = scene.hold === null ? "horizon" : String(scene.hold);
    if (![...this.hold.options].some((option) => option.value === value))
      this.hold.append(new Option(`for ${value} s, then coasts`, value));
    this.hold.value = value;
    const accelerates = scene.methods.some((method) => METHODS[method].quantity === "acceleration");
    for (const one of [this.hold, this.fields.maxAcceleration]) one.closest<HTMLElement>(".field")!.hidden = !accelerates;
    for (const [name, one] of Object.entries(this.fields) as [Field, HTMLInputElement][]) one.value = String(scene[name]);
    this.slider.max = String(scene.horizon);
  }

  private chooseMethods(): void {
    this.scene.methods = this.lists.map((list) => list.value).filter(Boolean) as Method[];
    this.changed();
  }

  /** After a change of the scene. */
  changed(): void {
    this.say("");
    this.unwritten = true;
    this.ahead = Math.min(this.ahead, this.scene.horizon);
    this.arrange();
    this.redraw();
  }

  redraw(): void {
    this.stale = true;
  }

  say(sentence: string): void {
    this.note.textContent = sentence;
  }

  setTheme(theme: Theme): void {
    this.theme = theme;
    this.root.dataset["theme"] = theme === DARK ? "dark" : "light";
    this.arrange();
    this.redraw();
  }

  private setPlaying(on: boolean): void {
    if (on && this.ahead >= this.scene.horizon) this.look(0);
    this.playing = on;
    this.play.textContent = on ? "❚❚" : "▶";
  }

  private look(ahead: number): void {
    const shown = this.ahead > 0;
    this.ahead = Math.max(0, Math.min(this.scene.horizon, ahead));
    this.slider.value = String(this.ahead);
    this.clock.textContent = this.ahead ? `+${this.ahead.toFixed(2)} s` : "now";
    if (shown !== this.ahead > 0) this.arrange();
    this.redraw();
  }

  private async copyLink(): Promise<void> {
    this.write();
    try {
      await navigator.clipboard.writeText(location.href);
      this.say("The link is in the clipboard.");
    } catch {
      this.say("The clipboard is not accessible: the address of this page is the link.");
    }
  }

  private write(): void {
    history.replaceState(null, "", `#${written(this.scene)}`);
    this.unwritten = false;
  }

  private add(): void {
    const { low, high, obstacles, robot } = this.scene;
    const at: Vector = [low[0] + 0.7 * (high[0] - low[0]), low[1] + (0.2 + 0.15 * (obstacles.length % 5)) * (high[1] - low[1])];
    const radius = obstacles[0]?.radius ?? robot.radius;
    obstacles.push({ radius, road: null, position: at, velocity: [0, 0], acceleration: [0, 0], from: 0, to: Infinity });
    this.selected = obstacles.length - 1;
    this.changed();
  }

  private remove(): void {
    const { obstacles } = this.scene;
    const index = this.selected ?? obstacles.length - 1;
    if (index < 0) return this.say("There is no obstacle to remove.");
    obstacles.splice(index, 1);
    this.selected = null;
    this.grasp.release();
    this.changed();
  }

  private key(event: KeyboardEvent): void {
    const target = event.target as HTMLElement;
    if (target.matches("input, select, summary") || event.ctrlKey || event.metaKey || event.altKey) return;
    if (event.key === " " && target.matches("button, a")) return;
    const arrows: Record<string, Vector> = { ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowUp: [0, 1], ArrowDown: [0, -1] };
    const actions: Record<string, () => void> = {
      h: () => this.grasp.next(),
      Escape: () => this.grasp.release(),
      " ": () => this.setPlaying(!this.playing),
      ",": () => this.look(this.ahead - 0.1),
      ".": () => this.look(this.ahead + 0.1),
      a: () => this.add(),
      x: () => this.remove(),
      t: () => this.setTheme(this.theme === DARK ? LIGHT : DARK),
    };
    const by = event.shiftKey ? arrows[event.key] : undefined;
    const action = by ? () => this.grasp.nudge(by) : actions[event.key];
    if (!action) return;
    action();
    event.preventDefault();
  }

  /** Name of an obstacle. */
  name(index: number): string {
    return `${this.scene.obstacles[index]!.road ? "car" : "obstacle"} ${index + 1}`;
  }

  /** What each method says of its control. */
  private sentences(picture: Picture): string {
    const { scene } = this;
    return picture.found
      .map((found, slot) => {
        const { method, quantity } = found;
        const { unit, many } = UNITS[quantity];
        const words = scene.controls[quantity].map((x) => x.toFixed(2).replace("-", "−")).join(", ");
        const overlapped = found.motions.findIndex((motion) => motion?.overlaps);
        if (overlapped >= 0) return `${method}: the robot overlaps ${this.name(overlapped)}: every ${quantity} collides.`;
        const index = first(picture.times[slot]!);
        const contact = index < 0 ? "" : `${this.name(index)} after ${picture.times[slot]![index]!.toFixed(1)} s`;
        const share = blockedShare(picture.decision, found);
        const all = `${(100 * share).toFixed(1)} % of the admissible ${many} collide.`;
        return (
          `${method}: the ${quantity} (${words}) ${unit} collides with ${contact || `nothing within ${scene.horizon} s`}. ` +
          (Number.isNaN(share) ? `No ${quantity} obeys the limits.` : all)
        );
      })
      .join("\n");
  }

  /** What is drawn of the scene, computed anew. */
  picture(): Picture {
    const { scene, ahead, selected, theme } = this;
    const known = decision(scene);
    const found = scene.methods.map((method) => {
      const size = half(scene, METHODS[method].quantity);
      return controlObstacle(known, method, { center: [0, 0], radius: size * Math.SQRT2 }, size * TOLERANCE);
    });
    const times = found.map((one) => contacts(one, scene.controls[one.quantity]));
    return { scene, decision: known, found, times, ahead, selected, theme };
  }

  /** What the page computes of a decision, for tests: areas within a disc of controls, admissible set, first contacts. */
  measure(given: Decision & { method: Method }, controls: Vector[], radius: number) {
    const found = controlObstacle(given, given.method, { center: [0, 0], radius: radius * Math.SQRT2 }, radius * TOLERANCE);
    return {
      area: area(found.curves.flat(), [{ center: [0, 0], radius }]),
      share: blockedShare(given, found),
      balls: admissible(given, found.quantity),
      times: controls.map((u) => Math.min(...contacts(found, u))).map((t) => (t < Infinity ? t : null)),
    };
  }

  private frame(now: number): void {
    requestAnimationFrame((next) => this.frame(next));
    const passed = Math.min(0.1, (now - this.lastTime) / 1000);
    this.lastTime = now;
    if (this.playing) {
      this.look(this.ahead + passed);
      if (this.ahead >= this.scene.horizon) this.setPlaying(false);
    }
    if (this.unwritten && now - this.writtenAt > REST) {
      this.writtenAt = now;
      this.write();
    }
    if (!this.stale) return;
    this.stale = false;
    const before = performance.now();
    this.draw();
    this.drawings.push(performance.now() - before);
    if (this.drawings.length > 600) this.drawings.shift();
  }

  private context(canvas: HTMLCanvasElement): [CanvasRenderingContext2D, number, number] {
    const ratio = window.devicePixelRatio || 1;
    const frame = canvas.parentElement!.getBoundingClientRect();
    const [width, height] = [Math.floor(frame.width), Math.floor(frame.height)];
    if (canvas.width !== Math.round(width * ratio) || canvas.height !== Math.round(height * ratio)) {
      [canvas.width, canvas.height] = [Math.round(width * ratio), Math.round(height * ratio)];
      [canvas.style.width, canvas.style.height] = [`${width}px`, `${height}px`];
    }
    const g = canvas.getContext("2d")!;
    g.setTransform(ratio, 0, 0, ratio, 0, 0);
    return [g, width, height];
  }

  /** What the legend of the workspace shows. */
  private marks = "";

  private draw(): void {
    const picture = this.picture();
    const [g, width, height] = this.context(this.workspace.canvas);
    this.view = Viewport.fit(this.scene.low, this.scene.high, 0, 0, width, height);
    drawScene(g, picture, this.view, width, height);
    this.grasp.draw(g, this.view);
    picture.found.forEach((_, slot) => {
      const [h, across, down] = this.context(this.controls[slot]!.canvas);
      drawControlSpace(h, picture, slot, across, down);
    });
    const { scene, times } = picture;
    const some = scene.obstacles.length > 0;
    const marks = [times[times.length - 1]!.includes(Infinity), some, extrapolates(picture)];
    const key = `${this.theme === DARK} ${scene.horizon} ${marks.join()}`;
    if (key !== this.marks) {
      this.marks = key;
      this.workspace.legend.replaceChildren(
        entry("disc", "robot", this.theme.robot),
        entry("scale", `contact: now to ${scene.horizon} s`, "", marks[1]),
        entry("disc", "obstacle", this.theme.neutral, marks[0]),
        entry("dash", "as a method extrapolates", this.theme.faint, marks[2]),
      );
    }
    const words = this.sentences(picture);
    if (this.why.textContent !== words) this.why.textContent = words;
  }

  /** The viewport of a control space. */
  controlView(slot: number): Viewport {
    const { clientWidth, clientHeight } = this.controls[slot]!.canvas;
    return controlSquare(this.scene, METHODS[this.scene.methods[slot]!].quantity, clientWidth, clientHeight);
  }
}

const style = document.createElement("style");
style.textContent = viewCss + css;
document.head.append(style);
const host = document.getElementById("slalom") as HTMLElement & { slalom?: Explorer };
host.slalom = new Explorer(host);
