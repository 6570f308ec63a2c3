// The scenes of the page: one for each idea of the paper, the road, and the address that holds a scene.

import { METHODS, type Body, type Decision, type Limits, type Method, type Quantity, type Vector } from "./engine.ts";

/** A road with a constant curvature: it begins at `origin` along `heading`, and bends to the left by `curvature`. */
export interface Road {
  origin: Vector;
  heading: number;
  /** [1/m] */
  curvature: number;
  /** [m] From the reference line to the left: borders of the lanes. */
  borders: number[];
  /** [m] Along the reference line: what is drawn, and where the handle of its curvature is; null: it has none. */
  from: number;
  to: number;
  handle: number | null;
}

/** A car on the road: along its reference line, to the left of it [m], and its speed along the lane. */
interface OnRoad {
  along: number;
  across: number;
  speed: number;
}

export interface Obstacle {
  radius: number;
  road: OnRoad | null;
  position: Vector;
  velocity: Vector;
  acceleration: Vector;
  from: number;
  to: number;
}

export interface Scene extends Limits {
  idea: string;
  methods: Method[];
  robot: Decision["robot"];
  controls: Record<Quantity, Vector>;
  obstacles: Obstacle[];
  road: Road | null;
  horizon: number;
  margin: number;
  hold: number | null;
  ramp: number;
  /** [m] Corners of the drawn workspace. */
  low: Vector;
  high: Vector;
}

function free(radius: number, position: Vector, velocity: Vector, acceleration: Vector = [0, 0]): Obstacle {
  return { radius, road: null, position, velocity, acceleration, from: 0, to: Infinity };
}

function onRoad(radius: number, along: number, across: number, speed: number): Obstacle {
  return { ...free(radius, [0, 0], [0, 0]), road: { along, across, speed } };
}

/** Phases [rad] of ten cars in each lane: those of the figure of the paper, seed 39 of `roundabout_crossing`. */
const LANES: readonly [radius: number, speed: number, phases: number[]][] = [
  [12, 5, [4.186, 4.905, 5.318, 5.891, 6.462, 7.332, 7.802, 8.278, 9.19, 9.943]],
  [16, 6.5, [0.743, 1.76, 2.084, 2.387, 3.541, 4.11, 4.719, 5.366, 5.749, 6.662]],
  [20, 8, [2.404, 3.328, 3.878, 4.198, 4.975, 5.59, 6.867, 7.112, 7.449, 7.87]],
];

/** The default scene of each idea, in the order of the page. */
export const IDEAS: Record<string, Scene> = {
  vo: {
    idea: "vo",
    methods: ["VO"],
    robot: { radius: 0.5, position: [0, 0], velocity: [2, 0] },
    controls: { velocity: [2, 0], acceleration: [0, 0] },
    obstacles: [free(1, [6, 3], [0, -1.2])],
    road: null,
    horizon: 8,
    margin: 0,
    hold: null,
    ramp: 0,
    maxSpeed: 3,
    maxAcceleration: 2,
    low: [-3, -7],
    high: [15, 7],
  },
  curved_road: {
    idea: "curved_road",
    methods: ["VO", "NLVO"],
    robot: { radius: 1, position: [0, 0], velocity: [8, 0] },
    controls: { velocity: [8, 0], acceleration: [0, 0] },
    obstacles: [onRoad(1.5, -8.36, 4, 10.4), onRoad(1.5, 26.6, 4, 7.2), onRoad(1.5, 3.8, 8, 8)],
    road: {
      origin: [0, 0],
      heading: 0,
      curvature: 0.0263,
      borders: [-2, 2, 6, 10],
      from: -30,
      to: 75,
      handle: 34,
    },
    horizon: 3,
    margin: 0,
    hold: null,
    ramp: 0,
    maxSpeed: 12.8,
    maxAcceleration: 4,
    low: [-14, -9],
    high: [42, 31],
  },
  ao: {
    idea: "ao",
    methods: ["VO", "AO"],
    robot: { radius: 0.6, position: [0, 0], velocity: [1.6, 0] },
    controls: { velocity: [1.6, 0], acceleration: [0, 0] },
    obstacles: [free(1, [7, 4], [-0.4, -0.8])],
    road: null,
    horizon: 6,
    margin: 0,
    hold: null,
    ramp: 0,
    maxSpeed: 4,
    maxAcceleration: 1,
    low: [-3, -6],
    high: [15, 9],
  },
  roundabout: {
    idea: "roundabout",
    methods: ["AO", "NAO"],
    robot: { radius: 1, position: [-26, 0], velocity: [5, 0] },
    controls: { velocity: [5, 0], acceleration: [2.7, -0.4] },
    obstacles: LANES.flatMap(([radius, speed, phases]) =>
      phases.map((phase) => {
        const turn = (((phase + Math.PI / 2) % (2 * Math.PI)) * 16).toFixed(2);
        return onRoad(1, Number(turn), 16 - radius, speed);
      }),
    ),
    road: {
      origin: [0, -16],
      heading: 0,
      curvature: 1 / 16,
      borders: [-6, -2, 2, 6],
      from: 0,
      to: 32 * Math.PI,
      handle: null,
    },
    horizon: 6,
    margin: 0,
    hold: null,
    ramp: 0,
    maxSpeed: 30,
    maxAcceleration: 4,
    low: [-30, -24],
    high: [30, 24],
  },
};

export function copied(scene: Scene): Scene {
  return structuredClone(scene);
}

// ---------------------------------------------------------------------------------------------------------------------
// The road.

/** Position and unit tangent at a place of the road. */
export function onTheRoad({ origin, heading, curvature }: Road, along: number, across: number): { at: Vector; tangent: Vector } {
  const turn = curvature * along;
  // sin(x) / x and (1 - cos x) / x for any curvature, 0 too.
  const [x, y] = [
    curvature ? Math.sin(turn) / curvature : along,
    curvature ? (2 * Math.sin(turn / 2) ** 2) / curvature : 0,
  ];
  const [c, s] = [Math.cos(heading), Math.sin(heading)];
  const tangent: Vector = [Math.cos(heading + turn), Math.sin(heading + turn)];
  const at: Vector = [origin[0] + c * x - s * y - across * tangent[1], origin[1] + s * x + c * y + across * tangent[0]];
  return { at, tangent };
}

/** The place of the road at a position, on it or beside it. */
export function placeOnRoad(road: Road, [px, py]: Vector): { along: number; across: number } {
  const [c, s] = [Math.cos(road.heading), Math.sin(road.heading)];
  const [dx, dy] = [px - road.origin[0], py - road.origin[1]];
  const [x, y] = [c * dx + s * dy, c * dy - s * dx];
  const k = road.curvature;
  if (!k) return { along: x, across: y };
  const turn = Math.atan2(k * x, 1 - k * y);
  const across = (1 - Math.hypot(k * x, 1 - k * y)) / k;
  const along = turn / k;
  // On a full circle places repeat: the one that is drawn.
  const round = (2 * Math.PI) / Math.abs(k);
  return { along: along < road.from ? along + round : along > road.to ? along - round : along, across };
}

/** The curvature with which the road passes through a position, ahead of its origin. */
export function curvatureThrough({ origin, heading }: Road, [px, py]: Vector): number {
  const [c, s] = [Math.cos(heading), Math.sin(heading)];
  const [dx, dy] = [px - origin[0], py - origin[1]];
  return (2 * (c * dy - s * dx)) / Math.max(dx * dx + dy * dy, 1e-9);
}

/** An obstacle as the engine takes it: on the road it turns with its lane. */
export function body(scene: Scene, { radius, road: on, position, velocity, acceleration, from, to }: Obstacle): Body {
  if (!on || !scene.road) return { radius, position, velocity, acceleration, rate: 0, from, to };
  const { at, tangent } = onTheRoad(scene.road, on.along, on.across);
  const bend = 1 - scene.road.curvature * on.across;
  const rate = (scene.road.curvature * on.speed) / bend;
  return { radius, position: at, velocity: [on.speed * tangent[0], on.speed * tangent[1]], acceleration: [0, 0], rate, from, to };
}

export function decision(scene: Scene): Decision {
  return { ...scene, bodies: scene.obstacles.map((obstacle) => body(scene, obstacle)) };
}

/** Whether what is shown depends on the velocity of the robot. */
export function hasVelocity(scene: Scene): boolean {
  return scene.ramp > 0 || scene.methods.some((method) => METHODS[method].quantity === "acceleration");
}

/** Half of the width of a control space [unit of the control]. */
export function half(scene: Scene, quantity: Quantity): number {
  return 1.25 * (quantity === "velocity" ? scene.maxSpeed : scene.maxAcceleration);
}

// ---------------------------------------------------------------------------------------------------------------------
// The address: the name of the idea, and what differs from its default scene. #ao&robot=0,0,2,0,0.6

const SETTINGS = ["horizon", "margin", "ramp", "maxSpeed", "maxAcceleration"] as const;

function numbers(values: number[]): string {
  return values.map((x) => (Number.isFinite(x) ? String(Number(x.toFixed(3))) : "")).join(",");
}

function entries(scene: Scene): [string, string][] {
  const { robot, controls, road } = scene;
  const found: [string, string][] = [
    ["methods", scene.methods.join(",")],
    ["robot", numbers([...robot.position, ...robot.velocity, robot.radius])],
    ["velocity", numbers(controls.velocity)],
    ["acceleration", numbers(controls.acceleration)],
    ["hold", scene.hold === null ? "horizon" : numbers([scene.hold])],
    ...SETTINGS.map((name): [string, string] => [name, numbers([scene[name]])]),
    ...(road ? [["curvature", String(Number(road.curvature.toFixed(5)))] as [string, string]] : []),
  ];
  const obstacles = scene.obstacles.map(({ radius, road: on, position, velocity, acceleration, from, to }) => {
    const where = on ? [on.along, on.across, on.speed] : [...position, ...velocity, ...acceleration];
    const when = from > 0 || to < Infinity ? [from, to] : [];
    return `${on ? "r" : "o"}${numbers([radius, ...where, ...when])}`;
  });
  found.push(["obstacles", obstacles.join("_")]);
  return found;
}

export function written(scene: Scene): string {
  const usual = new Map(entries(IDEAS[scene.idea]!));
  const changed = entries(scene).filter(([name, value]) => usual.get(name) !== value);
  return [scene.idea, ...changed.map(([name, value]) => `${name}=${value}`)].join("&");
}

/** `count` numbers of a text; an empty one is `otherwise`. */
function parsed(name: string, text: string, counts: number[], otherwise = Infinity): number[] {
  const found = text.split(",").map((part) => (part === "" ? otherwise : Number(part)));
  if (!counts.includes(found.length) || found.some(Number.isNaN))
    throw new Error(`${name}: expected ${counts.join(" or ")} numbers, found ${text}`);
  return found;
}

function finite(name: string, text: string, count: number): number[] {
  const found = parsed(name, text, [count], NaN);
  if (!found.every(Number.isFinite)) throw new Error(`${name}: expected finite numbers, found ${text}`);
  return found;
}

function above(name: string, value: number, least: number): number {
  if (!(value > least)) throw new Error(`${name}: expected a number above ${least}, found ${value}`);
  return value;
}

function obstacle(text: string): Obstacle {
  const [kind, rest] = [text[0], text.slice(1)];
  if (kind !== "r" && kind !== "o") throw new Error(`obstacles: expected each to begin with o or r, found ${text}`);
  const size = kind === "r" ? 4 : 7;
  const given = parsed("obstacles", rest, [size, size + 2]);
  const [radius, a, b, c, d, e, f] = given as [number, number, number, number, number, number, number];
  const [from, to] = given.length > size ? given.slice(size) : [0, Infinity];
  if (given.slice(0, size).some((x) => !Number.isFinite(x))) throw new Error(`obstacles: expected finite numbers, found ${text}`);
  above("radius of an obstacle", radius, 0);
  above("end of an obstacle", to!, from!);
  const made = kind === "r" ? onRoad(radius, a, b, c) : free(radius, [a, b], [c, d], [e, f]);
  return { ...made, from: from!, to: to! };
}

/** The scene that an address holds. Throws an error that states what was expected and what was found. */
export function read(hash: string): Scene {
  const [idea, ...parts] = hash.replace(/^#/, "").split("&");
  const usual = IDEAS[idea || "vo"];
  if (!usual) throw new Error(`expected one of ${Object.keys(IDEAS).join(", ")}, found ${idea}`);
  const scene = copied(usual);
  // #ao& names no part of the page, to which browsers scroll, also from a page around it.
  for (const part of parts.filter(Boolean)) {
    const [name, text] = [part.slice(0, part.indexOf("=")), decodeURIComponent(part.slice(part.indexOf("=") + 1))];
    if (name === "methods") {
      scene.methods = text.split(",") as Method[];
      if (scene.methods.length > 2 || scene.methods.some((method) => !(method in METHODS)))
        throw new Error(`methods: expected one or two of ${Object.keys(METHODS).join(", ")}, found ${text}`);
    } else if (name === "robot") {
      const [x, y, vx, vy, radius] = finite(name, text, 5) as [number, number, number, number, number];
      scene.robot = { position: [x, y], velocity: [vx, vy], radius: above("radius of the robot", radius, 0) };
    } else if (name === "velocity" || name === "acceleration") scene.controls[name] = finite(name, text, 2) as Vector;
    else if (name === "hold") scene.hold = text === "horizon" ? null : above(name, finite(name, text, 1)[0]!, 0);
    else if (SETTINGS.includes(name as "horizon")) {
      const least = name === "margin" || name === "ramp" ? -1e-9 : 0;
      scene[name as "horizon"] = above(name, finite(name, text, 1)[0]!, least);
    } else if (name === "curvature" && scene.road) scene.road.curvature = finite(name, text, 1)[0]!;
    else if (name === "obstacles") scene.obstacles = text ? text.split("_").map(obstacle) : [];
    else throw new Error(`expected ${entries(scene).map(([known]) => known).join(", ")}, found ${name}`);
  }
  for (const { road: on } of scene.obstacles) {
    if (on && !scene.road) throw new Error(`obstacles: expected none on a road, as ${idea} has none, found one`);
    if (on && !(scene.road!.curvature * on.across < 1))
      throw new Error(`obstacles: expected a lane outside the centre of the road, found one ${on.across} m to its left`);
  }
  return scene;
}
