// What has been received, and what is shown of it.

import type { Control, Frames, Message, Numbers, ObstacleInfo, Probe, RobotInfo, Scene } from "./protocol.ts";

export type Colouring = "role" | "outcome" | "speed" | "time";

/** Control spaces that a live view keeps: those of the last decisions that were shown. */
const KEPT = 32;
/** The place of a control space that is shown until the next one comes. */
const OUTDATED = -1;

/** A robot or an obstacle of the scene. */
export interface Body {
  kind: "robot" | "obstacle";
  index: number;
}

export function among(bodies: Body[], kind: string, index: number): boolean {
  return bodies.some((body) => body.kind === kind && body.index === index);
}

/** Rows of numbers that grow, (frames, n, d). */
class Rows {
  values = new Float32Array(0);
  constructor(readonly width: number) {}
  write(first: number, given: ArrayLike<number>): void {
    const end = first * this.width + given.length;
    if (end > this.values.length) {
      const larger = new Float32Array(Math.max(end, 2 * this.values.length));
      larger.set(this.values);
      this.values = larger;
    }
    this.values.set(given as ArrayLike<number>, first * this.width);
  }
}

export class Model {
  scene: Scene | null = null;
  count = 0;
  complete = false;
  positions = new Rows(0);
  velocities = new Rows(0);
  accelerations = new Rows(0);
  obstacles = new Rows(0);
  directions: Rows | null = null;
  goals: Rows | null = null;
  ended: Frames["ended"] = null;
  outcomes: string[][] = [];
  arrived: (number | null)[] = [];
  /** Numbers of a robot at each step, by "name robot". */
  series = new Map<string, Float32Array>();
  controls: Map<number, Control>[] = [new Map(), new Map()];
  probe: Probe | null = null;
  playhead = 0;
  playing = false;
  speed = 1;
  selected = 0;
  colouring: Colouring = "role";
  element = 0;
  deciding = true;
  version = 0;
  /** What the pointer is on. */
  focus: Body[] = [];
  /** Whether choices are hidden until they are asked for, and the decision whose choice was asked for. */
  quiz = false;
  private asked = -1;
  /** [s] Where the colours of times to the goal end; null: not known yet. */
  farthest: number | null = null;

  /** Takes a message; returns whether it replaced the scene. */
  take(message: Message): boolean {
    this.version++;
    switch (message.kind) {
      case "scene":
        this.begin(message);
        return true;
      case "frames":
        this.append(message);
        return false;
      case "series": {
        for (const [name, { values }] of Object.entries(message.arrays)) {
          const key = `${name} ${message.robot}`;
          const joined = new Float32Array(message.first + values.length);
          joined.set((this.series.get(key) ?? joined).subarray(0, message.first));
          joined.set(values, message.first);
          this.series.set(key, joined);
        }
        return false;
      }
      case "control": {
        const slot = this.controls[message.slot]!;
        slot.delete(OUTDATED);
        slot.delete(message.step);
        slot.set(message.step, message);
        // A file holds all, a live view the latest ones.
        if (this.scene?.live && slot.size > KEPT) slot.delete(slot.keys().next().value!);
        this.probe = null;
        return false;
      }
      case "probe":
        this.probe = message;
        return false;
      default:
        return false;
    }
  }

  private begin(scene: Scene): void {
    const same = this.scene !== null && this.scene.robots.length === scene.robots.length;
    const others = same && this.scene!.obstacles.length === scene.obstacles.length;
    // A live control space stays until the next one, unless it names bodies that may not exist any more.
    if (this.scene && scene.live && others) this.outdate();
    else this.controls.forEach((slot) => slot.clear());
    this.scene = scene;
    this.count = 0;
    this.complete = false;
    const { robots, moving, dimension } = scene;
    this.positions = new Rows(robots.length * dimension);
    this.velocities = new Rows(robots.length * dimension);
    this.accelerations = new Rows(robots.length * dimension);
    this.obstacles = new Rows(moving.length * dimension);
    this.directions = null;
    this.goals = null;
    this.ended = null;
    this.outcomes = [];
    this.series.clear();
    this.focus = [];
    if (!scene.compare) this.controls[1]!.clear();
    this.probe = null;
    this.farthest = null;
    this.playhead = 0;
    this.selected = scene.chosen ?? (same ? this.selected : 0);
  }

  private append(frames: Frames): void {
    const { arrays, first } = frames;
    this.positions.write(first, arrays["positions"]!.values);
    this.velocities.write(first, arrays["velocities"]!.values);
    this.accelerations.write(first, arrays["accelerations"]!.values);
    if (arrays["obstacles"]) this.obstacles.write(first, arrays["obstacles"].values);
    if (arrays["directions"]) {
      this.directions ??= new Rows(this.scene!.moving.length);
      this.directions.write(first, arrays["directions"].values);
    }
    if (arrays["goals"]) {
      this.goals ??= new Rows(this.positions.width);
      this.goals.write(first, arrays["goals"].values);
    }
    const n = this.scene!.robots.length;
    const codes = arrays["outcomes"]!.values;
    for (let k = 0; k < frames.count; k++) {
      const before = this.outcomes[first + k - 1];
      this.outcomes[first + k] = Array.from({ length: n }, (_, j) => {
        const name = frames.outcomes_table[codes[k * n + j]!]!;
        return name || (before?.[j] ?? "");
      });
    }
    this.count = Math.max(this.count, first + frames.count);
    this.arrived = frames.arrived;
    this.complete = frames.complete;
    this.ended = frames.ended;
  }

  /** The playhead, at most the last step: that of two runs beside each other is that of the longer one. */
  get shown(): number {
    return Math.max(0, Math.min(this.count - 1, this.playhead));
  }

  get step(): number {
    return Math.floor(this.shown + 1e-9);
  }

  get time(): number {
    return this.scene ? this.scene.start + this.scene.dt * this.shown : 0;
  }

  /** The step of the decision that is in force at a step; after the last step that of the last one. */
  private decided(step: number): number {
    const last = this.complete ? Math.max(0, Math.min(step, this.count - 2)) : step;
    return last - (last % this.scene!.period_steps);
  }

  /** The control space to show in a panel: of the decision in force, else the latest before it, else any. */
  control(slot = 0): Control | null {
    const known = [...this.controls[slot]!.values()];
    const own = known.filter((one) => one.robot === this.selected);
    let best: Control | null = null;
    for (const one of own)
      if (this.decided(one.step) <= this.decided(this.step) && (!best || one.step >= best.step)) best = one;
    return best ?? own.pop() ?? known.pop() ?? null;
  }

  /** Whether the control space of the decision in force at a step is there. */
  has(step: number): boolean {
    const made = this.decided(step);
    for (let k = made; k < made + this.scene!.period_steps; k++)
      if (this.controls[0]!.get(k)?.robot === this.selected) return true;
    return false;
  }

  /** Whether a control space is of another decision than the one in force. */
  late(control: Control): boolean {
    return this.decided(control.step) !== this.decided(this.step);
  }

  /** Whether the choice of the decision that is shown is hidden. */
  get hidden(): boolean {
    return this.quiz && this.asked !== this.decided(this.step);
  }

  /** Shows the choice of the decision that is shown, or hides it again. */
  reveal(): void {
    this.asked = this.hidden ? this.decided(this.step) : -1;
    this.version++;
  }

  /** The path of the control that is tried, else of the manoeuvre unless it is hidden. */
  path(control: Control): Numbers | undefined {
    return this.probe?.arrays["path"] ?? (this.hidden ? undefined : control.arrays["manoeuvre"]);
  }

  /** The bodies that the sentence names: those that the control would hit or that the manoeuvre passes closely. */
  named(): Body[] {
    const control = this.overlay();
    if (!control) return [];
    const rows = this.probe ? [this.probe.first ?? -1] : [control.first, ...(this.hidden ? [] : control.binding.slice(0, 2)).map(({ other }) => other)];
    const others = this.probe?.slot ? (this.control(1) ?? control).others : control.others;
    return [...new Set(rows)].flatMap((row) => {
      const [kind, index] = others[row] ?? ["hidden", 0];
      return kind === "hidden" ? [] : [{ kind, index }];
    });
  }

  info(body: Body): RobotInfo | ObstacleInfo {
    return (body.kind === "robot" ? this.scene!.robots : this.scene!.obstacles)[body.index]!;
  }

  /** Where a body is; null where it does not exist. */
  at({ kind, index }: Body): number[] | null {
    return kind === "robot" ? (this.present(index) ? this.robot(index) : null) : this.obstacle(index);
  }

  /** The control space whose paths are drawn at the positions: a live one of the decision in force, or none. */
  overlay(): Control | null {
    const control = this.control();
    if (!control || control.robot !== this.selected) return null;
    return this.scene!.live && !this.has(this.step) ? null : control;
  }

  /** Forgets the control spaces; those that are shown stay in their panels until the next ones. */
  outdate(): void {
    const shown = [0, 1].map((slot) => this.control(slot));
    this.controls.forEach((slot, k) => {
      slot.clear();
      if (shown[k]) slot.set(OUTDATED, shown[k]);
    });
  }

  /** Position of a robot at the playhead: exact for accelerations that are constant over a step. */
  robot(k: number): number[] {
    const d = this.scene!.dimension;
    const i = this.step;
    const h = (this.shown - i) * this.scene!.dt;
    const at = i * this.positions.width + k * d;
    return Array.from(
      { length: d },
      (_, c) =>
        this.positions.values[at + c]! +
        h * (this.velocities.values[at + c]! + 0.5 * h * this.accelerations.values[at + c]!),
    );
  }

  velocity(k: number): number[] {
    const d = this.scene!.dimension;
    const i = this.step;
    const h = (this.shown - i) * this.scene!.dt;
    const at = i * this.velocities.width + k * d;
    return Array.from(
      { length: d },
      (_, c) => this.velocities.values[at + c]! + h * this.accelerations.values[at + c]!,
    );
  }

  /** Position of the goal of a robot at the playhead. */
  goal(k: number): number[] {
    const still = this.scene!.robots[k]!.goal;
    if (!this.goals || !this.count) return still;
    const next = Math.min(this.count - 1, this.step + 1);
    const share = this.shown - this.step;
    const [a, b] = [this.step, next].map((i) => i * this.goals!.width + k * still.length) as [number, number];
    const values = this.goals.values;
    return still.map((_, c) => values[a + c]! + share * (values[b + c]! - values[a + c]!));
  }

  /** Position of an obstacle at the playhead; null where it does not exist. */
  obstacle(k: number): number[] | null {
    const scene = this.scene!;
    const still = scene.obstacles[k]!.position;
    if (still) return still;
    const d = scene.dimension;
    const at = this.step * this.obstacles.width + scene.moving.indexOf(k) * d;
    const next = Math.min(this.count - 1, this.step + 1) * this.obstacles.width + scene.moving.indexOf(k) * d;
    const share = this.shown - this.step;
    const values = this.obstacles.values;
    const here = Array.from({ length: d }, (_, c) => values[at + c]!);
    if (!Number.isFinite(here[0]!)) return null;
    if (!Number.isFinite(values[next]!)) return here;
    return here.map((x, c) => x + share * (values[next + c]! - x));
  }

  heading(k: number): number {
    const column = this.scene!.moving.indexOf(k);
    if (!this.scene!.obstacles[k]!.turns || column < 0 || !this.directions) return this.scene!.obstacles[k]!.heading;
    return this.directions.values[this.step * this.directions.width + column] ?? 0;
  }

  obstacleVelocity(k: number): number[] {
    const scene = this.scene!;
    const d = scene.dimension;
    const column = scene.moving.indexOf(k);
    if (column < 0 || this.count < 2) return new Array(d).fill(0) as number[];
    const i = Math.min(this.step, this.count - 2);
    const at = i * this.obstacles.width + column * d;
    const values = this.obstacles.values;
    return Array.from({ length: d }, (_, c) => {
      const v = (values[at + this.obstacles.width + c]! - values[at + c]!) / scene.dt;
      return Number.isFinite(v) ? v : 0;
    });
  }

  /** Whether a robot is in the scene: from its appearance on; one that need not stop leaves it at its goal. */
  present(k: number): boolean {
    const at = this.arrived[k];
    if (!Number.isFinite(this.robot(k)[0]!)) return false;
    return this.scene!.robots[k]!.stop || at == null || this.time <= at + 1e-9;
  }

  speedOf(step: number, k: number): number {
    return length(this.velocities.values, step * this.velocities.width + k * this.scene!.dimension, this.scene!.dimension);
  }

  accelerationOf(step: number, k: number): number {
    const d = this.scene!.dimension;
    return length(this.accelerations.values, step * this.accelerations.width + k * d, d);
  }
}

function length(values: Float32Array, at: number, d: number): number {
  let sum = 0;
  for (let c = 0; c < d; c++) sum += values[at + c]! ** 2;
  return Math.sqrt(sum);
}
