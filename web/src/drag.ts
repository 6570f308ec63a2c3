// Direct manipulation: handles of the workspace, the control, the camera, and moving the view.

import type { App } from "./app.ts";
import { arrow, text, type Context, type Viewport } from "./geometry.ts";
import { Eye } from "./space.ts";
import type { Theme } from "./theme.ts";

export type What = "robot" | "robot_velocity" | "goal" | "obstacle" | "obstacle_velocity" | "control";

export interface Handle {
  what: What;
  index: number;
  slot?: number;
}

const NEAR = 11;

export class Dragging {
  active: Handle | null = null;
  /** The handle that the keyboard moves. */
  handle: Handle | null = null;
  private offset: [number, number] = [0, 0];
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
    canvas.addEventListener("wheel", (event) => this.wheel(slot, event), { passive: false });
  }

  private down(canvas: HTMLCanvasElement, slot: number, event: PointerEvent): void {
    canvas.setPointerCapture(event.pointerId);
    canvas.focus({ preventScroll: true });
    const { app } = this;
    const { model } = app;
    if (!model.scene) return;
    if (slot >= 0) {
      if (!model.control(slot)) return;
      this.gesture++;
      this.active = { what: "control", index: 0, slot };
      this.offset = [0, 0];
      this.drag(slot, event, false);
      return;
    }
    const found = model.scene.dimension === 2 ? this.hit(event.offsetX, event.offsetY) : this.hitSpace(event);
    if (found && found.what === "robot" && found.index !== model.selected) {
      app.select(found.index);
      return;
    }
    if (found && app.source.live && model.scene.dimension === 2) {
      app.play(false);
      this.gesture++;
      this.active = this.handle = found;
      const at = this.place(found)!;
      const view = app.view!;
      this.offset = [view.px(at[0]!) - event.offsetX, view.py(at[1]!) - event.offsetY];
      app.redraw();
      return;
    }
    this.panning = { x: event.offsetX, y: event.offsetY };
  }

  private move(canvas: HTMLCanvasElement, slot: number, event: PointerEvent): void {
    const { app } = this;
    if (this.active) return this.drag(slot, event, false);
    if (this.panning && slot < 0) {
      const [dx, dy] = [event.offsetX - this.panning.x, event.offsetY - this.panning.y];
      this.panning = { x: event.offsetX, y: event.offsetY };
      if (app.model.scene!.dimension === 3) {
        app.camera.yaw += dx * 0.008;
        app.camera.pitch = Math.max(-0.2, Math.min(1.5, app.camera.pitch + dy * 0.008));
      } else if (app.view) {
        app.view.x -= dx / app.view.scale;
        app.view.y += dy / app.view.scale;
      }
      app.redraw();
      return;
    }
    if (slot < 0 && app.model.scene?.dimension === 2) {
      canvas.style.cursor = this.hit(event.offsetX, event.offsetY) ? "grab" : "default";
    }
  }

  private up(slot: number, event: PointerEvent): void {
    this.panning = null;
    if (!this.active) return;
    this.drag(slot, event, true);
    this.active = null;
    if (!this.app.source.live) {
      this.app.model.probe = null;
      this.app.redraw();
    }
  }

  private wheel(slot: number, event: WheelEvent): void {
    const { app } = this;
    const factor = Math.exp(-event.deltaY * 0.0015);
    if (slot >= 0) app.zoom = Math.max(1, Math.min(20, app.zoom * factor));
    else if (app.model.scene?.dimension === 3)
      app.camera.distance = Math.max(0.6, Math.min(5, app.camera.distance / factor));
    else if (app.view) {
      const [x, y] = app.view.inverse(event.offsetX, event.offsetY);
      app.view.scale *= factor;
      app.view.x = x - (event.offsetX - app.view.left - app.view.width / 2) / app.view.scale;
      app.view.y = y + (event.offsetY - app.view.top - app.view.height / 2) / app.view.scale;
    }
    app.redraw();
    event.preventDefault();
  }

  private drag(slot: number, event: PointerEvent, final: boolean): void {
    const { app, active } = this;
    const view = slot >= 0 ? app.controlViewport(slot) : app.view;
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

  /** Where a handle is, in metres. */
  private place(handle: Handle): number[] | null {
    const { model } = this.app;
    const scene = model.scene!;
    const { what, index } = handle;
    if (what === "robot") return model.robot(index);
    if (what === "goal") return scene.robots[index]!.goal;
    if (what === "robot_velocity") return model.robot(index).map((x, c) => x + model.velocity(index)[c]!);
    const at = scene.obstacles[index] ? model.obstacle(index) : null;
    if (!at || what === "obstacle") return at;
    return at.map((x, c) => x + model.obstacleVelocity(index)[c]!);
  }

  private handles(): Handle[] {
    const { model } = this.app;
    const scene = model.scene!;
    const k = model.selected;
    const own: Handle[] = [
      { what: "robot_velocity", index: k },
      { what: "robot", index: k },
      { what: "goal", index: k },
    ];
    scene.obstacles.forEach((_, index) => {
      if (this.handle?.index === index && this.handle.what.startsWith("obstacle"))
        own.push({ what: "obstacle_velocity", index });
      own.push({ what: "obstacle", index });
    });
    return own;
  }

  /** The handle at a point; another robot counts as a handle, which selects it. */
  private hit(x: number, y: number): Handle | null {
    const { app } = this;
    const { model, view } = app;
    const scene = model.scene!;
    if (!view || !model.count) return null;
    const reach = (handle: Handle): number => {
      if (handle.what === "robot") return Math.max(NEAR, scene.robots[handle.index]!.radius * view.scale);
      if (handle.what === "obstacle") return Math.max(NEAR, Math.min(60, scene.obstacles[handle.index]!.radius * view.scale));
      return NEAR;
    };
    const others = scene.robots.map((_, index): Handle => ({ what: "robot", index }));
    const all = app.source.live ? [...this.handles(), ...others] : others;
    let best: Handle | null = null;
    let nearest = Infinity;
    for (const handle of all) {
      const at = this.place(handle);
      if (!at || (handle.what === "robot" && !model.present(handle.index))) continue;
      const share = Math.hypot(view.px(at[0]!) - x, view.py(at[1]!) - y) / reach(handle);
      // Small handles win over the bodies on which they lie.
      const weight = handle.what.endsWith("velocity") || handle.what === "goal" ? 0.5 : 1;
      if (share <= 1 && share * weight < nearest) [best, nearest] = [handle, share * weight];
    }
    return best;
  }

  private hitSpace(event: PointerEvent): Handle | null {
    const { model, parts, camera } = this.app;
    const canvas = parts.workspace.canvas;
    const eye = new Eye(model, camera, canvas.clientWidth, canvas.clientHeight);
    const index = model.scene!.robots.findIndex((robot, k) => {
      const p = eye.project(model.robot(k));
      return Math.hypot(p.x - event.offsetX, p.y - event.offsetY) < Math.max(NEAR, robot.radius * p.scale);
    });
    return index < 0 || index === model.selected ? null : { what: "robot", index };
  }

  next(): void {
    const all = this.handles();
    const k = all.findIndex((h) => h.what === this.handle?.what && h.index === this.handle.index);
    this.handle = all[(k + 1) % all.length]!;
    this.app.redraw();
  }

  nudge([dx, dy]: [number, number]): void {
    const handle = this.handle ?? { what: "robot" as const, index: this.app.model.selected };
    const at = this.place(handle);
    if (!at || !this.app.source.live || this.app.model.scene!.dimension === 3) return;
    this.handle = handle;
    this.gesture++;
    this.ask(handle, [at[0]! + 0.25 * dx, at[1]! + 0.25 * dy], true);
  }

  add(): void {
    const { model, view } = this.app;
    if (model.scene?.dimension !== 2 || !view) return;
    const at = model.robot(model.selected);
    const goal = model.scene.robots[model.selected]!.goal;
    const middle = at.map((x, c) => (x + goal[c]!) / 2);
    const span = (view.width / view.scale) * 0.05;
    this.app.send({ do: "add", to: middle, radius: Math.max(0.3, Math.min(span, 2)), step: model.step });
    this.handle = { what: "obstacle", index: model.scene.obstacles.length };
  }

  remove(): void {
    const handle = this.handle;
    if (!handle?.what.startsWith("obstacle")) {
      this.app.say("Select an obstacle first: click it, or press h.");
      return;
    }
    this.app.send({ do: "remove", index: handle.index, step: this.app.model.step });
    this.handle = null;
  }

  draw(g: Context, view: Viewport, theme: Theme): void {
    const handle = this.handle;
    if (!handle || !this.app.source.live) return;
    const at = this.place(handle);
    if (!at) return;
    const { model } = this.app;
    if (handle.what.startsWith("obstacle")) {
      const body = model.obstacle(handle.index);
      const tip = body && body.map((x, c) => x + model.obstacleVelocity(handle.index)[c]!);
      if (body && tip) {
        arrow(g, view, body, model.obstacleVelocity(handle.index), theme.ink, 2);
        g.beginPath();
        g.arc(view.px(tip[0]!), view.py(tip[1]!), 5, 0, 2 * Math.PI);
        g.fillStyle = theme.paper;
        g.fill();
        g.stroke();
      }
    }
    const [x, y] = [view.px(at[0]!), view.py(at[1]!)];
    g.strokeStyle = theme.goal;
    g.lineWidth = 2;
    g.strokeRect(x - 9, y - 9, 18, 18);
    const name = handle.what.replace("_", " ");
    const of = handle.what.startsWith("obstacle") ? ` ${model.scene!.obstacles[handle.index]?.name ?? ""}` : "";
    text(g, theme, name + of.replace(/^ obstacle/, ""), x + 13, y - 8, { size: 12, colour: theme.goal });
  }
}

/** What the grid of times says of a control, where no server is asked. */
function gridWords(control: import("./protocol.ts").Control, plane: number, at: number[]): string {
  const grid = control.arrays[`grid${plane}`]!;
  const n = grid.shape[0]!;
  const { half } = control.planes[plane]!;
  const [column, row] = at.map((x) => Math.round(((x + half) / (2 * half)) * (n - 1))) as [number, number];
  if (column < 0 || row < 0 || column >= n || row >= n) return "outside the picture.";
  const value = grid.values[row * n + column]!;
  if (value === 255) return `hits nothing within ${control.horizon} s.`;
  return `collides in about ${((value / 250) * control.horizon).toFixed(1)} s.`;
}
