// Drawing of the page: the workspace, and the control space of a method.

import { drawAxes, drawBar, drawMark, NARROW, square } from "./control.ts";
import {
  acceleration,
  admissible,
  BANDS,
  METHODS,
  position,
  robotAt,
  velocity,
  type Body,
  type ControlObstacle,
  type Curve,
  type Decision,
  type Quantity,
  type Vector,
} from "./engine.ts";
import { half, hasVelocity, onTheRoad, type Scene } from "./explorer_scene.ts";
import { arrow, polyline, text, type Context, type Viewport } from "./geometry.ts";
import { css, viridis, type Theme } from "./theme.ts";
import { drawGrid, drawScale, tip } from "./workspace.ts";

export const UNITS: Record<Quantity, { letter: string; unit: string; many: string }> = {
  velocity: { letter: "v", unit: "m/s", many: "velocities" },
  acceleration: { letter: "a", unit: "m/s²", many: "accelerations" },
};
/** [1] Obstacles up to which the velocities of all have handles and arrows; of more, that of the selected one. */
export const FEW = 4;

export interface Picture {
  scene: Scene;
  decision: Decision;
  found: ControlObstacle[];
  /** [s] Of each method, first contacts with each obstacle under its control; Infinity for none. */
  times: number[][];
  /** [s] Look ahead. */
  ahead: number;
  selected: number | null;
  theme: Theme;
}

function circle(g: Context, view: Viewport, [x, y]: Vector, radius: number): void {
  g.beginPath();
  g.arc(view.px(x), view.py(y), Math.max(1, radius * view.scale), 0, 2 * Math.PI);
}

function stroke(g: Context, colour: string, width: number, dash: number[] = []): void {
  g.strokeStyle = colour;
  g.lineWidth = width;
  g.setLineDash(dash);
  g.stroke();
  g.setLineDash([]);
}

// ---------------------------------------------------------------------------------------------------------------------
// The control space.

export function controlSquare(scene: Scene, quantity: Quantity, width: number, height: number): Viewport {
  return square(width, height, half(scene, quantity), width >= NARROW);
}

/** [pixel] Points of a curve that are nearer to the last drawn one are left out. Larger: curves have corners. */
const CLOSE = 0.8;

function trace(g: Context, view: Viewport, curves: Curve[]): void {
  g.beginPath();
  for (const curve of curves) {
    let [x, y] = [NaN, NaN];
    for (let k = 0; k < curve.length; k += 2) {
      const [px, py] = [view.px(curve[k]!), view.py(curve[k + 1]!)];
      if (Math.abs(px - x) + Math.abs(py - y) < CLOSE) continue;
      [x, y] = [px, py];
      if (k) g.lineTo(x, y);
      else g.moveTo(x, y);
    }
    g.closePath();
  }
}

export function drawControlSpace(g: Context, picture: Picture, slot: number, width: number, height: number): void {
  const { scene, decision, theme } = picture;
  const found = picture.found[slot]!;
  const { quantity } = found;
  const view = controlSquare(scene, quantity, width, height);
  g.fillStyle = theme.paper;
  g.fillRect(0, 0, width, height);
  g.save();
  g.beginPath();
  g.rect(view.left, view.top, view.width, view.height);
  g.clip();
  // The colours cover the inner half of this line, and all of it that is within the union.
  trace(g, view, found.curves.flat());
  g.lineJoin = "bevel";
  stroke(g, theme.blocked, 2.4);
  for (let band = BANDS - 1; band >= 0; band--) {
    trace(g, view, found.bands[band]!);
    g.fillStyle = css(viridis((band + 0.5) / BANDS, theme));
    g.fill("nonzero");
  }
  drawApexes(g, picture, found, view);
  drawElements(g, picture, found, view);
  drawAdmissible(g, decision, quantity, view, theme);
  drawMark(g, scene.controls[quantity], false, view, theme);
  g.restore();
  const named = width >= NARROW;
  const { letter, unit } = UNITS[quantity];
  drawAxes(g, [`${letter}x`, `${letter}y`], unit, view, theme, named);
  drawBar(g, scene.horizon, view, theme, named);
}

/** The velocity or acceleration of each obstacle now, a cross: the apex of a straight cone. */
function drawApexes(g: Context, { decision, theme }: Picture, { quantity, motions }: ControlObstacle, view: Viewport): void {
  if (decision.bodies.length > FEW) return;
  for (const { body: one } of motions.filter((motion) => motion !== null)) {
    const [x, y] = quantity === "velocity" ? velocity(one, 0) : acceleration(one);
    const [px, py] = [view.px(x), view.py(y)];
    g.beginPath();
    for (const side of [1, -1]) {
      g.moveTo(px - 5, py - 5 * side);
      g.lineTo(px + 5, py + 5 * side);
    }
    stroke(g, theme.halo, 5);
    stroke(g, theme.ink, 1.8);
  }
}

function drawElements(g: Context, { ahead, theme }: Picture, { motions }: ControlObstacle, view: Viewport): void {
  if (ahead <= 0) return;
  for (const motion of motions) {
    if (!motion || ahead < motion.begin || ahead > motion.end) continue;
    const { x, y, radius } = motion.element(ahead);
    circle(g, view, [x, y], radius);
    stroke(g, theme.paper, 3.2);
    stroke(g, theme.ink, 1.4);
  }
}

/** The border of an intersection of balls: of each circle what is within the others. */
function drawAdmissible(g: Context, decision: Decision, quantity: Quantity, view: Viewport, theme: Theme): void {
  const balls = admissible(decision, quantity);
  for (const [colour, width] of [
    [theme.halo, 5],
    [theme.ink, 2.2],
  ] as const) {
    for (const { center, radius } of balls) {
      const points: number[][] = [];
      for (let k = 0; k <= 360; k++) {
        const angle = (k * Math.PI) / 180;
        const [x, y] = [center[0] + radius * Math.cos(angle), center[1] + radius * Math.sin(angle)];
        const within = balls.every((b) => Math.hypot(x - b.center[0], y - b.center[1]) < b.radius * (1 + 1e-9) + 1e-12);
        points.push(within ? [x, y] : [NaN, NaN]);
      }
      polyline(g, view, points);
      stroke(g, colour, width);
    }
  }
}

// ---------------------------------------------------------------------------------------------------------------------
// The workspace.

/** Pixel of the handle of an acceleration: where the velocity would be after a second, but not on the body. */
export function accelerationTip(view: Viewport, at: number[], [x, y]: Vector): [number, number] {
  return x || y ? tip(view, at, [x, y]) : [view.px(at[0]!), view.py(at[1]!) - 18];
}

/** Whether the velocity of an obstacle has a handle. */
export function moves(scene: Scene, selected: number | null, index: number): boolean {
  return scene.obstacles.length <= FEW || selected === index;
}

/** Whether the acceleration of an obstacle has a handle. */
export function accelerates(scene: Scene, selected: number | null, index: number): boolean {
  const shown = scene.methods.some((method) => METHODS[method].quantity === "acceleration");
  return shown && !scene.obstacles[index]!.road && moves(scene, selected, index);
}

export function drawScene(g: Context, picture: Picture, view: Viewport, width: number, height: number): void {
  const { scene, theme } = picture;
  g.fillStyle = theme.paper;
  g.fillRect(0, 0, width, height);
  drawGrid(g, { theme, view, width, height, handles: true });
  drawRoad(g, scene, view, theme);
  drawPaths(g, picture, view);
  drawObstacles(g, picture, view);
  drawManoeuvres(g, picture, view);
  drawContacts(g, picture, view);
  drawRobot(g, picture, view);
  drawScale(g, { theme, view, width, height, handles: true });
}

function drawRoad(g: Context, { road }: Scene, view: Viewport, theme: Theme): void {
  if (!road) return;
  road.borders.forEach((across, k) => {
    const alongs = Array.from({ length: 121 }, (_, j) => road.from + ((road.to - road.from) * j) / 120);
    polyline(g, view, alongs.map((along) => onTheRoad(road, along, across).at));
    const inner = k > 0 && k < road.borders.length - 1;
    stroke(g, theme.neutral, inner ? 1.2 : 2, inner ? [7, 6] : []);
  });
  if (road.handle !== null) {
    const { at } = onTheRoad(road, road.handle, 0);
    knob(g, [view.px(at[0]), view.py(at[1])], theme, true);
  }
}

/** [1] Parts of a path, one colour each. */
const PARTS = 32;

/** Positions of a body at even times of the horizon, while it exists. */
function sampled(one: Body, horizon: number): Vector[] {
  const [from, to] = [Math.max(0, one.from), Math.min(horizon, one.to)];
  return Array.from({ length: PARTS + 1 }, (_, k) => position(one, from + ((to - from) * k) / PARTS));
}

/** Paths of the obstacles, coloured by time; dashed what a method extrapolates, where it differs. */
function drawPaths(g: Context, { scene, decision, times, theme }: Picture, view: Viewport): void {
  const few = scene.obstacles.length <= FEW;
  const firsts = times.map(first);
  for (const shown of [false, true]) {
    const bodies = decision.bodies.filter((_, index) => (few || firsts.includes(index)) === shown);
    const paths = bodies.map((one) => sampled(one, scene.horizon));
    g.lineWidth = shown ? 2.2 : 1.2;
    for (let k = 0; k < PARTS && paths.length; k++) {
      g.strokeStyle = css(viridis(k / PARTS, theme), shown ? 0.95 : 0.4);
      polyline(g, view, paths.flatMap((path) => [[NaN], path[k]!, path[k + 1]!]));
      g.stroke();
    }
  }
  for (const predicted of extrapolated({ scene, decision, times })) {
    polyline(g, view, sampled(predicted, scene.horizon));
    stroke(g, theme.faint, 1.3, [3, 4]);
  }
}

/** Bodies as methods extrapolate them, where that differs from their motion. */
function extrapolated({ scene, decision, times }: Pick<Picture, "scene" | "decision" | "times">): Body[] {
  const few = scene.obstacles.length <= FEW;
  const firsts = times.map(first);
  return decision.bodies.flatMap((one, index) =>
    scene.methods.flatMap((method, slot) => {
      const predicted = METHODS[method].predict(one);
      if (!predicted || !(few || firsts[slot] === index)) return [];
      const [a, b] = [position(one, scene.horizon), position(predicted, scene.horizon)];
      return Math.hypot(a[0] - b[0], a[1] - b[1]) < 1e-6 ? [] : [predicted];
    }),
  );
}

/** Whether a method extrapolates a motion that differs from the true one. */
export function extrapolates(picture: Picture): boolean {
  return extrapolated(picture).length > 0;
}

/** Index of the obstacle that is touched first, -1 for none. */
export function first(times: number[]): number {
  const soonest = Math.min(...times);
  return soonest < Infinity ? times.indexOf(soonest) : -1;
}

/** A handle: a small circle, or a square for what is no velocity. */
function knob(g: Context, [x, y]: [number, number], theme: Theme, angular: boolean): void {
  g.beginPath();
  if (angular) g.rect(x - 4.5, y - 4.5, 9, 9);
  else g.arc(x, y, 4.5, 0, 2 * Math.PI);
  g.fillStyle = theme.paper;
  g.fill();
  stroke(g, theme.ink, 1.5);
}

function drawObstacles(g: Context, { scene, decision, times, ahead, selected, theme }: Picture, view: Viewport): void {
  const shown = times[times.length - 1]!;
  decision.bodies.forEach((one, index) => {
    const time = shown[index]!;
    const hit = time < Infinity;
    circle(g, view, one.position, one.radius);
    g.fillStyle = hit ? css(viridis(time / scene.horizon, theme)) : theme.neutral;
    g.fill();
    stroke(g, theme.ink, hit ? 1.6 : 0.8);
    if (ahead > 0 && ahead >= one.from && ahead <= one.to) {
      circle(g, view, position(one, ahead), one.radius);
      stroke(g, theme.faint, 1.2, [4, 3]);
    }
    if (!moves(scene, selected, index)) return;
    arrow(g, view, one.position, one.velocity, theme.ink, 1.8);
    knob(g, tip(view, one.position, one.velocity), theme, false);
    if (!accelerates(scene, selected, index)) return;
    arrow(g, view, one.position, one.acceleration, theme.goal, 1.8);
    knob(g, accelerationTip(view, one.position, one.acceleration), theme, true);
  });
}

/** Motion of the robot under the control of each kind that is shown, with a dot for each second. */
function drawManoeuvres(g: Context, { scene, decision, ahead, theme }: Picture, view: Viewport): void {
  const shown = [...new Set(scene.methods.map((method) => METHODS[method].quantity))];
  for (const quantity of shown) {
    const at = (t: number): Vector => robotAt(decision, quantity, scene.controls[quantity], t);
    // Beside the manoeuvre of an acceleration that of a velocity is thin.
    const main = quantity === shown[shown.length - 1];
    polyline(g, view, Array.from({ length: 81 }, (_, k) => at((scene.horizon * k) / 80)));
    if (main) stroke(g, theme.halo, 6);
    stroke(g, theme.robot, main ? 3 : 1.6, main ? [] : [6, 4]);
    for (let second = 1; second <= scene.horizon + 1e-9; second++) {
      circle(g, view, at(second), (main ? 3.4 : 2.4) / view.scale);
      g.fillStyle = theme.robot;
      g.fill();
    }
    if (ahead <= 0) continue;
    circle(g, view, at(ahead), scene.robot.radius);
    stroke(g, theme.robot, 2, [4, 3]);
  }
}

/** First contact that each method predicts: robot and obstacle then, and the name of the method. */
function drawContacts(g: Context, { scene, decision, times, theme }: Picture, view: Viewport): void {
  scene.methods.forEach((method, slot) => {
    const index = first(times[slot]!);
    if (index < 0) return;
    const { quantity, predict } = METHODS[method];
    const t = times[slot]![index]!;
    const at = robotAt(decision, quantity, scene.controls[quantity], t);
    const other = predict(decision.bodies[index]!)!;
    for (const [where, radius, colour] of [
      [position(other, t), other.radius, theme.ink],
      [at, scene.robot.radius, theme.robot],
    ] as const) {
      circle(g, view, where, radius);
      stroke(g, theme.halo, 3.5);
      stroke(g, colour, 1.5);
    }
    // The second method below the robot, as the first one may state nearly the same contact.
    const y = view.py(at[1]) + (slot ? 1 : -1) * (scene.robot.radius * view.scale + 5) + (slot ? 10 : 0);
    text(g, theme, `${method} ${t.toFixed(1)} s`, view.px(at[0]), y, { size: 12, align: "center" });
  });
}

function drawRobot(g: Context, { scene, theme }: Picture, view: Viewport): void {
  const { position: at, radius } = scene.robot;
  circle(g, view, at, radius);
  g.fillStyle = theme.robot;
  g.fill();
  stroke(g, theme.ink, 1.5);
  const shown = robotArrow(scene);
  arrow(g, view, at, shown, theme.ink, 2);
  knob(g, tip(view, at, shown), theme, false);
}

/** The velocity at the robot: its own, or the control where only that counts. */
export function robotArrow(scene: Scene): Vector {
  return hasVelocity(scene) ? scene.robot.velocity : scene.controls.velocity;
}
