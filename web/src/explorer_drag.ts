// Handles of the page: what can be dragged or moved by keys, and what a drag changes.

import { METHODS, type Vector } from "./engine.ts";
import type { Explorer } from "./explorer.ts";
import { accelerates, accelerationTip, moves, robotArrow } from "./explorer_draw.ts";
import { body, curvatureThrough, half, hasVelocity, onTheRoad, placeOnRoad } from "./explorer_scene.ts";
import { text, type Context, type Viewport } from "./geometry.ts";
import { tip } from "./workspace.ts";

type What = "robot" | "velocity of the robot" | "obstacle" | "velocity" | "acceleration" | "road" | "control";

interface Handle {
  what: What;
  /** Of the obstacle, or of the control space. */
  index: number;
}

/** [pixel] How near a pointer must be to a small handle. */
const NEAR = 12;
/** [pixel] How near a finger must be to a control that it drags: elsewhere it moves the page. */
const FINGER = 34;

function limited([x, y]: Vector, most: number): Vector {
  const share = Math.min(1, most / Math.max(Math.hypot(x, y), 1e-12));
  return [x * share, y * share];
}

export class Grasp {
  /** What the pointer drags, and the handle of the keyboard. */
  private active: Handle | null = null;
  held: Handle | null = null;
  private offset: Vector = [0, 0];

  constructor(private readonly app: Explorer) {
    this.listen(app.workspace.canvas, null);
    app.controls.forEach(({ canvas }, slot) => this.listen(canvas, slot));
  }

  private listen(canvas: HTMLCanvasElement, slot: number | null): void {
    canvas.addEventListener("pointerdown", (event) => {
      const [x, y] = [event.offsetX, event.offsetY];
      this.active = slot === null ? this.hit(x, y) : this.control(slot, x, y, event.pointerType);
      if (!this.active) return;
      canvas.setPointerCapture(event.pointerId);
      canvas.focus({ preventScroll: true });
      this.held = null;
      const [px, py] = this.pixel(this.active);
      this.offset = slot === null ? [px - x, py - y] : [0, 0];
      const { what, index } = this.active;
      if (slot === null && what !== "road") this.app.selected = this.ofObstacle(this.active) ? index : null;
      if (slot !== null) this.drag(x, y);
      this.app.redraw();
    });
    canvas.addEventListener("pointermove", (event) => {
      if (this.active) {
        this.drag(event.offsetX, event.offsetY);
        this.app.hover.textContent = slot === null ? this.words(this.active) : "";
        return;
      }
      const found = slot === null ? this.hit(event.offsetX, event.offsetY) : null;
      canvas.style.cursor = found ? "grab" : slot === null ? "default" : "crosshair";
      this.app.hover.textContent = found ? this.words(found) : "";
    });
    for (const name of ["pointerup", "pointercancel"]) canvas.addEventListener(name, () => (this.active = null));
    canvas.addEventListener("pointerleave", () => (this.app.hover.textContent = ""));
    // A finger that drags something does not move the page.
    canvas.addEventListener("touchstart", (event) => this.active && event.preventDefault(), { passive: false });
  }

  private ofObstacle({ what }: Handle): boolean {
    return what === "obstacle" || what === "velocity" || what === "acceleration";
  }

  private control(slot: number, x: number, y: number, pointer: string): Handle | null {
    const handle: Handle = { what: "control", index: slot };
    const [px, py] = this.pixel(handle);
    return pointer === "touch" && Math.hypot(px - x, py - y) > FINGER ? null : handle;
  }

  /** Handles of the workspace, small ones first. */
  private handles(): Handle[] {
    const { scene, selected } = this.app;
    const indices = scene.obstacles.map((_, index) => index);
    const own = (what: What, shown: number[]): Handle[] => shown.map((index) => ({ what, index }));
    return [
      { what: "velocity of the robot", index: 0 },
      ...own("velocity", indices.filter((k) => moves(scene, selected, k))),
      ...own("acceleration", indices.filter((k) => accelerates(scene, selected, k))),
      ...(scene.road && scene.road.handle !== null ? own("road", [0]) : []),
      { what: "robot", index: 0 },
      ...own("obstacle", indices),
    ];
  }

  /** Where a handle is drawn. */
  private pixel({ what, index }: Handle): [number, number] {
    const { scene, view } = this.app;
    if (what === "control") {
      const square = this.app.controlView(index);
      const u = scene.controls[METHODS[scene.methods[index]!].quantity];
      return [square.px(u[0]), square.py(u[1])];
    }
    const at = (point: Vector): [number, number] => [view.px(point[0]), view.py(point[1])];
    if (what === "road") return at(onTheRoad(scene.road!, scene.road!.handle!, 0).at);
    if (what === "robot") return at(scene.robot.position);
    if (what === "velocity of the robot") return tip(view, scene.robot.position, robotArrow(scene));
    const one = body(scene, scene.obstacles[index]!);
    if (what === "velocity") return tip(view, one.position, one.velocity);
    if (what === "acceleration") return accelerationTip(view, one.position, one.acceleration);
    return at(one.position);
  }

  private hit(x: number, y: number): Handle | null {
    const { scene, view } = this.app;
    const reach = ({ what, index }: Handle): number => {
      const radius = what === "robot" ? scene.robot.radius : what === "obstacle" ? scene.obstacles[index]!.radius : 0;
      return Math.max(NEAR, radius * view.scale);
    };
    return (
      this.handles().find((handle) => {
        const [px, py] = this.pixel(handle);
        return Math.hypot(px - x, py - y) <= reach(handle);
      }) ?? null
    );
  }

  private drag(x: number, y: number): void {
    const active = this.active!;
    const view = active.what === "control" ? this.app.controlView(active.index) : this.app.view;
    this.put(active, view.inverse(x + this.offset[0], y + this.offset[1]));
  }

  /** Moves a handle to a place of its picture. */
  private put({ what, index }: Handle, to: Vector): void {
    const { scene } = this.app;
    const { robot, road } = scene;
    const [x, y] = to.map((value, c) => Math.max(scene.low[c]!, Math.min(scene.high[c]!, value))) as Vector;
    const obstacle = scene.obstacles[index]!;
    if (what === "control") {
      const { quantity } = METHODS[scene.methods[index]!];
      const size = half(scene, quantity);
      scene.controls[quantity] = to.map((value) => Math.max(-size, Math.min(size, value))) as Vector;
    } else if (what === "robot") robot.position = [x, y];
    else if (what === "velocity of the robot") {
      const velocity = limited([to[0] - robot.position[0], to[1] - robot.position[1]], scene.maxSpeed);
      if (hasVelocity(scene)) robot.velocity = velocity;
      scene.controls.velocity = velocity;
    } else if (what === "road") {
      // The centre of the road stays outside of its lanes.
      const most = 0.9 / Math.max(...road!.borders.map(Math.abs));
      road!.curvature = Math.max(-most, Math.min(most, curvatureThrough(road!, to)));
    } else if (obstacle.road && road) {
      const { at, tangent } = onTheRoad(road, obstacle.road.along, obstacle.road.across);
      if (what === "velocity") obstacle.road.speed = (to[0] - at[0]) * tangent[0] + (to[1] - at[1]) * tangent[1];
      else {
        const { along, across } = placeOnRoad(road, [x, y]);
        const [low, high] = [Math.min(...road.borders), Math.max(...road.borders)];
        Object.assign(obstacle.road, {
          along: Math.max(road.from, Math.min(road.to, along)),
          across: Math.max(low, Math.min(high, across)),
        });
      }
    } else if (what === "obstacle") obstacle.position = [x, y];
    else obstacle[what as "velocity"] = [to[0] - obstacle.position[0], to[1] - obstacle.position[1]];
    this.app.changed();
  }

  next(): void {
    const controls = this.app.scene.methods.map((_, index): Handle => ({ what: "control", index }));
    const all = [...controls, ...this.handles()];
    const k = all.findIndex(({ what, index }) => what === this.held?.what && index === this.held.index);
    this.held = all[(k + 1) % all.length]!;
    if (this.ofObstacle(this.held)) this.app.selected = this.held.index;
    this.app.redraw();
  }

  nudge([x, y]: Vector): void {
    if (!this.held) this.next();
    const handle = this.held!;
    const view = handle.what === "control" ? this.app.controlView(handle.index) : this.app.view;
    const [px, py] = this.pixel(handle);
    this.put(handle, view.inverse(px + 4 * x, py - 4 * y));
  }

  release(): void {
    this.active = this.held = null;
    this.app.redraw();
  }

  /** Name and values of a handle. */
  private words({ what, index }: Handle): string {
    const { scene } = this.app;
    const speed = (v: Vector): string => `${Math.hypot(...v).toFixed(1)} m/s`;
    if (what === "robot") return `robot: ${speed(robotArrow(scene))}`;
    if (what === "velocity of the robot") return `${what}: ${speed(robotArrow(scene))}`;
    if (what === "road") return "curvature of the road";
    const one = body(scene, scene.obstacles[index]!);
    const of = what === "obstacle" ? "" : `${what} of `;
    return of + this.app.name(index) + (what === "acceleration" ? "" : `: ${speed(one.velocity)}`);
  }

  /** Frames the handle of the keyboard, with its name. */
  draw(g: Context, view: Viewport): void {
    if (!this.held) return;
    const { theme } = this.app;
    if (this.held.what === "control") {
      text(g, theme, `control of ${this.app.scene.methods[this.held.index]}`, 8, view.height - 34, { colour: theme.goal });
      return;
    }
    const [x, y] = this.pixel(this.held);
    g.strokeStyle = theme.goal;
    g.lineWidth = 2;
    g.strokeRect(x - 9, y - 9, 18, 18);
    text(g, theme, this.words(this.held), x + 13, y - 8, { colour: theme.goal });
  }
}
