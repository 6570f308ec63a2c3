// Direct manipulation: handles of the workspace, the control, the camera, and moving the view.

import type { App } from "./app.ts";
import { arrow, text, type Context, type Viewport } from "./geometry.ts";
import { orbit, type Eye } from "./camera.ts";
import { handles, hit, pixel, place, type Handle } from "./handles.ts";
import { bodyInSpace } from "./hover.ts";
import { gridWords } from "./legends.ts";
import { among } from "./model.ts";
import type { Theme } from "./theme.ts";
import { tip } from "./workspace.ts";

/** [pixel] A pointer that moves less does not drag: a click names a body and changes nothing. */
const STILL = 4;
/** [pixel] How near a finger must be to a control that it drags. */
const FINGER = 30;

/** The robot at a pixel in space. */
function robotInSpace(app: App, at: [number, number]): Handle | null {
  const found = bodyInSpace(app, ...at);
  return found?.kind === "robot" ? { what: "robot", index: found.index } : null;
}

export class Dragging {
  active: Handle | null = null;
  /** The handle that the keyboard moves. */
  handle: Handle | null = null;
  private offset: [number, number] = [0, 0];
  /** What the pointer went down on, until it moves. */
  private pressed: Handle | null = null;
  /** Where the pointers are, by id: two of them magnify. */
  private readonly pointers = new Map<number, [number, number]>();
  /** Where the pointer went down. */
  private from: [number, number] = [0, 0];
  private gesture = 0;
  private pending: { handle: Handle; to: number[]; final: boolean } | null = null;
  private expected: number | null = null;
  private panning: { x: number; y: number } | null = null;
  private lastAsked = 0;

  constructor(private readonly app: App) {
    const { workspace, controls } = app.parts;
    this.listen(workspace.canvas, -1);
    controls.forEach(({ canvas }, slot) => this.listen(canvas, slot));
  }

  get waiting(): boolean {
    // An answer that was dropped on the way does not block the view for ever.
    return this.expected !== null && performance.now() - this.lastAsked < 3000;
  }

  expect(id: number): void {
    this.expected = id;
    this.lastAsked = performance.now();
  }

  answer(id: number): void {
    if (this.expected !== null && id >= this.expected) this.expected = null;
    this.flush();
  }

  private listen(canvas: HTMLCanvasElement, slot: number): void {
    canvas.addEventListener("pointerdown", (event) => this.down(canvas, slot, event));
    canvas.addEventListener("pointermove", (event) => this.move(canvas, slot, event));
    for (const name of ["pointerup", "pointercancel"] as const)
      canvas.addEventListener(name, (event) => this.up(slot, event));
    // A finger that drags something does not move the page.
    canvas.addEventListener("touchstart", (event) => (this.active || this.pressed || this.app.tools.chosen || event.touches.length > 1) && event.preventDefault(), {
      passive: false,
    });
    canvas.addEventListener("pointerleave", () => this.app.hover.leave());
    canvas.addEventListener("wheel", (event) => this.wheel(slot, event), { passive: false });
  }

  private down(canvas: HTMLCanvasElement, slot: number, event: PointerEvent): void {
    canvas.setPointerCapture(event.pointerId);
    canvas.focus({ preventScroll: true });
    const { app } = this;
    const { model } = app;
    this.pointers.set(event.pointerId, [event.offsetX, event.offsetY]);
    if (!model.scene) return;
    if (this.pointers.size > 1) {
      this.active = this.pressed = this.panning = null;
      return;
    }
    this.from = [event.offsetX, event.offsetY];
    if (slot >= 0) {
      if (!model.control(slot) || app.choosePlane(slot, event.offsetX, event.offsetY)) return;
      if (event.pointerType === "touch" && !this.nearChosen(slot)) return;
      this.gesture++;
      this.active = { what: "control", index: 0, slot };
      app.hover.leave();
      this.offset = [0, 0];
      this.drag(slot, event, false);
      return;
    }
    app.hover.workspace(canvas, ...this.from);
    if (app.tools.chosen && model.scene.dimension === 2) return app.tools.down(...this.from);
    const found = model.scene.dimension === 2 ? hit(app, this.handle, ...this.from) : robotInSpace(app, this.from);
    if (found && found.what === "robot" && found.index !== model.selected) {
      app.select(found.index);
      this.handle = found;
      return;
    }
    if (found && app.source.live && model.scene.dimension === 2) {
      this.pressed = this.handle = found;
      const at = place(this.app, found)!;
      const view = app.view!;
      this.offset = [view.px(at[0]!) - event.offsetX, view.py(at[1]!) - event.offsetY];
      app.redraw();
      return;
    }
    this.panning = { x: event.offsetX, y: event.offsetY };
  }

  private move(canvas: HTMLCanvasElement, slot: number, event: PointerEvent): void {
    const { app } = this;
    if (this.pointers.has(event.pointerId)) {
      const before = this.spread();
      this.pointers.set(event.pointerId, [event.offsetX, event.offsetY]);
      if (before) return this.magnify(slot, this.spread() / before, ...this.middle());
    }
    const moved = Math.hypot(event.offsetX - this.from[0], event.offsetY - this.from[1]);
    if (this.pressed && !this.active && moved > STILL) {
      app.play(false);
      this.gesture++;
      this.active = this.pressed;
      app.hover.leave();
    }
    if (this.active) return this.drag(slot, event, false);
    if (slot < 0 && app.tools.chosen) app.tools.move(event.offsetX, event.offsetY);
    if (this.panning && slot < 0) {
      const [dx, dy] = [event.offsetX - this.panning.x, event.offsetY - this.panning.y];
      this.panning = { x: event.offsetX, y: event.offsetY };
      if (app.model.scene!.dimension === 3) {
        orbit(app.camera, dx * 0.008, dy * 0.008);
      } else if (app.view) {
        app.view.x -= dx / app.view.scale;
        app.view.y += dy / app.view.scale;
        app.setFollow(false);
      }
      app.redraw();
      return;
    }
    if (slot >= 0) return app.hover.control(canvas, slot, event.offsetX, event.offsetY);
    const found = app.hover.workspace(canvas, event.offsetX, event.offsetY);
    if (!app.tools.chosen) canvas.style.cursor = found && app.source.live ? "grab" : "default";
  }

  /** Whether the pointer went down near the chosen control: elsewhere a finger moves the page. */
  private nearChosen(slot: number): boolean {
    const view = this.app.controlViewport(slot, this.from)!;
    const [x, y] = place(this.app, { what: "control", index: 0, slot })!;
    return Math.hypot(view.px(x!) - this.from[0], view.py(y!) - this.from[1]) < FINGER;
  }

  /** [pixel] Distance of two pointers; 0 for one. */
  private spread(): number {
    const [a, b] = [...this.pointers.values()];
    return a && b ? Math.hypot(a[0] - b[0], a[1] - b[1]) : 0;
  }

  /** Middle of two pointers. */
  private middle(): [number, number] {
    const [a, b] = [...this.pointers.values()] as [[number, number], [number, number]];
    return [(a[0] + b[0]) / 2, (a[1] + b[1]) / 2];
  }

  private up(slot: number, event: PointerEvent): void {
    this.panning = this.pressed = null;
    this.pointers.delete(event.pointerId);
    if (slot < 0 && this.app.tools.chosen && this.app.view) this.app.tools.up(event.offsetX, event.offsetY);
    if (!this.active) return;
    this.drag(slot, event, true);
    this.active = null;
    if (!this.app.source.live) {
      this.app.model.probe = null;
      this.app.redraw();
    }
  }

  private wheel(slot: number, event: WheelEvent): void {
    const factor = Math.exp(-event.deltaY * 0.0015);
    this.magnify(slot, factor, event.offsetX, event.offsetY);
    event.preventDefault();
  }

  /** Magnifies a control space, or the workspace about a pixel (by default its middle). */
  magnify(slot: number, factor: number, px?: number, py?: number): void {
    const { app } = this;
    if (slot >= 0) app.zoom = Math.max(1, Math.min(20, app.zoom * factor));
    else if (app.model.scene?.dimension === 3) app.camera.zoom = Math.max(0.3, Math.min(20, app.camera.zoom * factor));
    else if (app.view) {
      const [x, y] = [px ?? app.view.width / 2, py ?? app.view.height / 2];
      const [wx, wy] = app.view.inverse(x, y);
      app.view.scale *= factor;
      app.view.x = wx - (x - app.view.left - app.view.width / 2) / app.view.scale;
      app.view.y = wy + (y - app.view.top - app.view.height / 2) / app.view.scale;
    }
    app.redraw();
  }

  private drag(slot: number, event: PointerEvent, final: boolean): void {
    const { app, active } = this;
    const view = slot >= 0 ? app.controlViewport(slot, this.from) : app.view;
    if (!view || !active) return;
    const to = view.inverse(event.offsetX + this.offset[0], event.offsetY + this.offset[1]) as number[];
    if (active.what === "control") this.probe(slot, to, final);
    else this.ask(active, to, final);
  }

  /** Moves the control: the path at once, what it hits from the server. */
  private probe(slot: number, to: number[], final: boolean): void {
    const { model } = this.app;
    const control = model.control(slot)!;
    const plane = control.planes[this.app.plane]!;
    const u = [...(control.chosen ?? control.preferred)];
    if (model.scene!.dimension === 3) plane.through.forEach((x, c) => (u[c] = x));
    u[plane.axes[0]] = to[0]!;
    u[plane.axes[1]] = to[1]!;
    const d = model.scene!.dimension;
    const gain = control.arrays["gain"]!.values;
    const drift = control.arrays["drift"]!.values;
    const path = new Float32Array(gain.length * d);
    gain.forEach((g, k) => u.forEach((x, c) => (path[k * d + c] = drift[k * d + c]! + g * x)));
    const words = u.map((x) => x.toFixed(2).replace("-", "−")).join(", ");
    model.probe = {
      kind: "probe",
      answers: 0,
      slot,
      control: u,
      time: null,
      sentence: `${control.quantity.name} (${words}) ${control.quantity.unit}: ${gridWords(control, this.app.plane, to)}`,
      arrays: { path: { shape: [gain.length, d], values: path } },
    };
    model.version++;
    if (this.app.source.live) this.ask({ what: "control", index: 0, slot }, u, final);
  }

  private ask(handle: Handle, to: number[], final: boolean): void {
    this.pending = { handle, to, final };
    this.flush();
  }

  /** Sends the latest drag if none is unanswered, so that none waits behind an older one. */
  private flush(): void {
    if (!this.pending || (this.waiting && !this.pending.final)) return;
    const { handle, to, final } = this.pending;
    this.pending = null;
    const command = { do: "drag", ...handle, to, final, gesture: this.gesture, step: this.app.model.step };
    this.expect(this.app.send(command));
  }

  next(): void {
    const all = handles(this.app, this.handle);
    const k = all.findIndex((h) => h.what === this.handle?.what && h.index === this.handle.index);
    this.handle = all[(k + 1) % all.length]!;
    this.app.redraw();
  }

  /** Moves the handle of the keyboard by a step; without one the robot in the plane, and the camera in space. */
  nudge(by: [number, number, number]): void {
    const { app } = this;
    const space = app.model.scene!.dimension === 3;
    if (!this.handle && space) {
      orbit(app.camera, 0.1 * by[0], 0.1 * by[1]);
      app.redraw();
      return;
    }
    const handle = this.handle ?? { what: "robot" as const, index: app.model.selected };
    const at = place(this.app, handle);
    if (!at || (!app.source.live && handle.what !== "control")) return;
    this.handle = handle;
    if (handle.what === "control") {
      const { half } = app.model.control(handle.slot ?? 0)!.planes[app.plane]!;
      this.gesture++;
      this.probe(handle.slot ?? 0, at.map((x, c) => x + (half / 40) * by[c]!), true);
      app.redraw();
      return;
    }
    this.gesture++;
    this.ask(handle, at.map((x, c) => x + 0.25 * by[c]!), true);
  }

  /** Lets the handle of the keyboard go. */
  release(): void {
    this.handle = null;
    this.app.model.probe = null;
    this.app.redraw();
  }

  add(): void {
    const { model } = this.app;
    if (!model.scene) return;
    const at = model.robot(model.selected);
    const goal = model.goal(model.selected);
    const middle = at.map((x, c) => (x + goal[c]!) / 2);
    this.app.send({ do: "add", what: "obstacle", points: [middle], radius: this.app.parts.size.valueAsNumber, step: model.step });
    this.handle = { what: "obstacle", index: model.scene.obstacles.length };
  }

  remove(): void {
    const handle = this.handle;
    if (!handle || !/^(obstacle|robot)/.test(handle.what)) {
      this.app.say("Select an obstacle or a robot first: click it, or press h.");
      return;
    }
    const what = handle.what.replace("_velocity", "");
    this.app.act({ do: "remove", what, index: handle.index, step: this.app.model.step });
    this.handle = null;
  }

  draw(g: Context, view: Viewport, theme: Theme): void {
    const handle = this.handle;
    if (!handle || !this.app.source.live) return;
    const at = place(this.app, handle);
    if (!at || handle.what === "control") return;
    const { model } = this.app;
    if (handle.what.startsWith("obstacle")) {
      const body = model.obstacle(handle.index);
      if (body) {
        const [x, y] = tip(view, body, model.obstacleVelocity(handle.index));
        arrow(g, view, body, model.obstacleVelocity(handle.index), theme.ink, 2);
        g.beginPath();
        g.arc(x, y, 4.5, 0, 2 * Math.PI);
        g.fillStyle = theme.paper;
        g.fill();
        g.stroke();
      }
    }
    const [x, y] = pixel(this.app, handle, at, view);
    this.label(g, handle, x, y, theme);
  }

  /** Frames the handle of the keyboard at a pixel, with its name. */
  private label(g: Context, handle: Handle, x: number, y: number, theme: Theme): void {
    g.strokeStyle = theme.goal;
    g.lineWidth = 2;
    g.strokeRect(x - 9, y - 9, 18, 18);
    const { model } = this.app;
    const name = handle.what.replace("_", " ");
    // The name of a body that the sentence names is there already.
    if (handle.what === "obstacle" && among(model.named(), "obstacle", handle.index)) return;
    const of = handle.what.startsWith("obstacle") ? ` ${model.scene!.obstacles[handle.index]?.name ?? ""}` : "";
    text(g, theme, name + of.replace(/^ obstacle/, ""), x + 13, y - 8, { size: 12, colour: theme.goal });
  }

  /** As `draw`, in space. */
  drawInSpace(g: Context, eye: Eye, theme: Theme): void {
    const at = this.handle && this.handle.what !== "control" ? place(this.app, this.handle) : null;
    if (!at || !this.app.source.live) return;
    const p = eye.project(at);
    this.label(g, this.handle!, p.x, p.y, theme);
  }
}
