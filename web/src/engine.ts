// Control obstacles of discs in the plane: responses, predictions, boundaries, areas and first contacts.
// docs/theory.md, sections 2 to 6, derives the formulas. Lengths in m, times in s, angles in rad.

export type Vector = [number, number];

/** A disc that keeps its speed and turns at `rate` [rad/s], or for a rate of 0 keeps `acceleration`. */
export interface Body {
  radius: number;
  position: Vector;
  velocity: Vector;
  acceleration: Vector;
  rate: number;
  /** [s] When it exists. */
  from: number;
  to: number;
}

/** The robot after t is at p + state v + gain u and has the velocity stateRate v + gainRate u. */
export interface Coefficients {
  state: number;
  gain: number;
  stateRate: number;
  gainRate: number;
}

export type Response = (t: number) => Coefficients;

export interface Limits {
  maxSpeed: number;
  maxAcceleration: number;
}

export interface Ball {
  center: Vector;
  radius: number;
}

/** What a decision knows. `hold`: how long an acceleration is held; null: to the horizon. `ramp`: to a new velocity. */
export interface Decision extends Limits {
  robot: { radius: number; position: Vector; velocity: Vector };
  bodies: Body[];
  horizon: number;
  margin: number;
  hold: number | null;
  ramp: number;
}

export type Method = "VO" | "NLVO" | "AO" | "NAO";
export type Quantity = "velocity" | "acceleration";

/** A method is a kind of control and a prediction of bodies; null: of a body that it does not know yet. */
export const METHODS: Record<Method, { quantity: Quantity; predict: (body: Body) => Body | null }> = {
  VO: { quantity: "velocity", predict: (body) => extrapolated(body, [0, 0]) },
  NLVO: { quantity: "velocity", predict: (body) => body },
  AO: { quantity: "acceleration", predict: (body) => extrapolated(body, acceleration(body)) },
  NAO: { quantity: "acceleration", predict: (body) => body },
};

function extrapolated(body: Body, constant: Vector): Body | null {
  return body.from > 0 ? null : { ...body, acceleration: constant, rate: 0, to: Infinity };
}

/** Acceleration of a body now. */
export function acceleration({ velocity: [x, y], acceleration: given, rate }: Body): Vector {
  return rate ? [-rate * y, rate * x] : given;
}

export function position(body: Body, t: number): Vector {
  const [[px, py], [vx, vy], [ax, ay]] = [body.position, body.velocity, body.acceleration];
  if (!body.rate) return [px + t * (vx + 0.5 * t * ax), py + t * (vy + 0.5 * t * ay)];
  const turn = body.rate * t;
  // 1 - cos loses all digits of small turns; the square of a sine keeps them.
  const [along, across] = [Math.sin(turn) / body.rate, (2 * Math.sin(turn / 2) ** 2) / body.rate];
  return [px + along * vx - across * vy, py + along * vy + across * vx];
}

export function velocity(body: Body, t: number): Vector {
  const [[vx, vy], [ax, ay]] = [body.velocity, body.acceleration];
  if (!body.rate) return [vx + t * ax, vy + t * ay];
  const [c, s] = [Math.cos(body.rate * t), Math.sin(body.rate * t)];
  return [c * vx - s * vy, s * vx + c * vy];
}

/** A velocity that is reached by a constant acceleration over `ramp`; 0: at once. */
function towardsVelocity(ramp: number): Response {
  return (t) => {
    const gain = t < ramp ? (t * t) / (2 * ramp) : t - ramp / 2;
    const gainRate = t < ramp ? t / ramp : 1;
    return { state: t - gain, gain, stateRate: 1 - gainRate, gainRate };
  };
}

/** An acceleration for `hold`, then a constant velocity. */
function accelerating(hold: number): Response {
  return (t) => ({ state: t, gain: t < hold ? (t * t) / 2 : hold * (t - hold / 2), stateRate: 1, gainRate: Math.min(t, hold) });
}

export function response(decision: Decision, quantity: Quantity): Response {
  return quantity === "velocity" ? towardsVelocity(decision.ramp) : accelerating(decision.hold ?? Infinity);
}

/** Position of the robot after t under a control. */
export function robotAt(decision: Decision, quantity: Quantity, u: Vector, t: number): Vector {
  const { state, gain } = response(decision, quantity)(t);
  const { position: p, velocity: v } = decision.robot;
  return [p[0] + state * v[0] + gain * u[0], p[1] + state * v[1] + gain * u[1]];
}

/** [1] Share of full braking by which a robot above its speed limit must slow down. */
const OVERSPEED_BRAKING = 0.5;

/** The balls whose intersection is the admissible set. */
export function admissible(decision: Decision, quantity: Quantity): Ball[] {
  const { maxSpeed, maxAcceleration, ramp, hold, horizon } = decision;
  const v = decision.robot.velocity;
  const allowed = (settled: number): number =>
    Math.max(maxSpeed, Math.hypot(...v) - OVERSPEED_BRAKING * maxAcceleration * settled);
  if (quantity === "velocity")
    return [{ center: [0, 0], radius: allowed(ramp) }, ...(ramp ? [{ center: v, radius: maxAcceleration * ramp }] : [])];
  // The speed is largest at the end of the hold.
  const end = hold ?? horizon;
  return [
    { center: [-v[0] / end, -v[1] / end], radius: allowed(hold ?? Math.min(1, horizon)) / end },
    { center: [0, 0], radius: maxAcceleration },
  ];
}

// ---------------------------------------------------------------------------------------------------------------------
// Elements and their envelope.

/** A temporal element with its grazing controls, at the angles heading + opening (left) and heading - opening. */
export interface Element {
  t: number;
  x: number;
  y: number;
  radius: number;
  heading: number;
  opening: number;
  /** Cosine of the opening; 1 or more where the element shrinks inside its predecessors, with an opening of 0. */
  shrinking: number;
  left: Vector;
  right: Vector;
}

export interface Window {
  center: Vector;
  radius: number;
}

/** Part of a horizon in which the chords of both branches are within the tolerance; `band` numbers its colour. */
interface Span {
  band: number;
  a: Element;
  b: Element;
}

/** [1] Bands of time over the horizon, one colour each. More: finer colours, and more to draw. */
export const BANDS = 40;
/** Halvings of a band. More: finer curves near the time 0, where elements are large; each doubles the work there. */
const DEPTH = 12;

export class Motion {
  private readonly respond: Response;
  readonly radius: number;
  constructor(
    private readonly decision: Decision,
    quantity: Quantity,
    readonly body: Body,
  ) {
    this.respond = response(decision, quantity);
    this.radius = body.radius + decision.robot.radius + decision.margin;
  }

  get begin(): number {
    return Math.max(0, this.body.from);
  }

  get end(): number {
    return Math.min(this.decision.horizon, this.body.to);
  }

  /** Whether the robot overlaps the body now: then every control collides. */
  get overlaps(): boolean {
    return this.begin === 0 && this.end > 0 && this.apart([0, 0], 0) < 0;
  }

  /** [m] Distance between the surfaces after t under a control. */
  apart(u: Vector, t: number): number {
    const { state, gain } = this.respond(t);
    const c = position(this.body, t);
    const { position: p, velocity: v } = this.decision.robot;
    return Math.hypot(c[0] - p[0] - state * v[0] - gain * u[0], c[1] - p[1] - state * v[1] - gain * u[1]) - this.radius;
  }

  /** [m/s] Bound on the rate of this distance up to t. */
  private rate(u: Vector, t: number): number {
    const own = Math.hypot(...this.decision.robot.velocity) + this.respond(t).gainRate * Math.hypot(...u);
    const { velocity: v, acceleration: a, rate } = this.body;
    return own + Math.hypot(...v) + (rate ? 0 : t * Math.hypot(...a));
  }

  /** Time of the first contact under a control, Infinity for none. */
  contact(u: Vector): number {
    const bound = this.rate(u, this.end);
    let t = this.begin;
    while (t <= this.end) {
      const distance = this.apart(u, t);
      if (distance < 1e-6) return t;
      // No contact is sooner; the least step ends an approach that only grazes.
      t += Math.max(bound ? distance / bound : Infinity, 1e-4 * this.decision.horizon);
    }
    return Infinity;
  }

  element(t: number): Element {
    const { state, gain, stateRate, gainRate } = this.respond(t);
    const [c, rate] = [position(this.body, t), velocity(this.body, t)];
    const { position: p, velocity: v } = this.decision.robot;
    const [x, y] = [c[0] - p[0] - state * v[0], c[1] - p[1] - state * v[1]];
    // The centre moves along w; the element touches the envelope where |w| cos(opening) = gain' R.
    const wx = gain * (rate[0] - stateRate * v[0]) - gainRate * x;
    const wy = gain * (rate[1] - stateRate * v[1]) - gainRate * y;
    const size = Math.max(Math.hypot(wx, wy), 1e-300);
    const shrinking = (gainRate * this.radius) / size;
    const cosine = Math.min(1, shrinking);
    const sine = Math.sqrt(1 - cosine * cosine);
    const [mx, my, radius] = [x / gain, y / gain, this.radius / gain];
    const [ax, ay] = [(radius * cosine * wx) / size, (radius * cosine * wy) / size];
    const [sx, sy] = [(-radius * sine * wy) / size, (radius * sine * wx) / size];
    return {
      t,
      x: mx,
      y: my,
      radius,
      heading: Math.atan2(wy, wx),
      opening: Math.acos(cosine),
      shrinking,
      left: [mx + ax + sx, my + ay + sy],
      right: [mx + ax - sx, my + ay - sy],
    };
  }

  /** Whether no element between two times meets a window. */
  private misses({ center, radius }: Window, from: number, to: number): boolean {
    const middle = (from + to) / 2;
    const reach = radius * this.respond(to).gain + (this.rate(center, to) * (to - from)) / 2;
    return this.apart(center, middle) > reach;
  }

  /** Parts of the horizon in which elements may meet the window, in order. */
  spans(window: Window, tolerance: number): Span[] {
    const found: Span[] = [];
    const step = this.decision.horizon / BANDS;
    for (let band = 0; band < BANDS; band++) {
      const [from, to] = [Math.max(this.begin, band * step), Math.min(this.end, (band + 1) * step)];
      if (from < to) this.halve(from, to, null, null, band, DEPTH, window, tolerance, found);
    }
    return found;
  }

  private halve(
    from: number,
    to: number,
    before: Element | null,
    after: Element | null,
    band: number,
    depth: number,
    window: Window,
    tolerance: number,
    found: Span[],
  ): void {
    if (this.misses(window, from, to)) return;
    const middle = (from + to) / 2;
    const m = this.element(middle);
    const b = after ?? this.element(to);
    if (from > 0) {
      const a = before ?? this.element(from);
      if (depth === 0 || !bent(a, m, b, window, tolerance)) {
        found.push({ band, a, b: m }, { band, a: m, b });
        return;
      }
      this.halve(from, middle, a, m, band, depth - 1, window, tolerance, found);
    } else if (depth > 0) this.halve(from, middle, null, m, band, depth - 1, window, tolerance, found);
    this.halve(middle, to, m, b, band, depth - 1, window, tolerance, found);
  }
}

function wrapped(angle: number): number {
  return angle - 2 * Math.PI * Math.round(angle / (2 * Math.PI));
}

/** Distance of c from the segment from a to b. */
function chordDistance(a: Vector, b: Vector, c: Vector): number {
  const [x, y] = [b[0] - a[0], b[1] - a[1]];
  const along = ((c[0] - a[0]) * x + (c[1] - a[1]) * y) / Math.max(x * x + y * y, 1e-300);
  const share = Math.max(0, Math.min(1, along));
  return Math.hypot(c[0] - a[0] - share * x, c[1] - a[1] - share * y);
}

/** Whether a branch of the envelope leaves its chords near the window. It is tangent to each element. */
function bent(a: Element, m: Element, b: Element, { center, radius }: Window, tolerance: number): boolean {
  // Shrinking inside the predecessors at the three times, by more than it varies: there is no envelope.
  const [p, q, r] = [1 / a.shrinking, 1 / m.shrinking, 1 / b.shrinking];
  if (2 * Math.max(p, q, r) - Math.min(p, q, r) < 1) return false;
  for (const side of [1, -1]) {
    const [start, middle, end] = side > 0 ? [a.left, m.left, b.left] : [a.right, m.right, b.right];
    const before = Math.abs(wrapped(m.heading - a.heading) + side * (m.opening - a.opening));
    const after = Math.abs(wrapped(b.heading - m.heading) + side * (b.opening - m.opening));
    const rise = Math.max(
      before * Math.hypot(middle[0] - start[0], middle[1] - start[1]),
      after * Math.hypot(end[0] - middle[0], end[1] - middle[1]),
    );
    const distance = Math.min(chordDistance(start, middle, center), chordDistance(middle, end, center));
    if (distance > radius + 2 * rise && Math.max(before, after) < 0.5) continue;
    // Both halves become chords, each with a quarter of what both together rise.
    if (rise / 4 > tolerance) return true;
  }
  return false;
}

// ---------------------------------------------------------------------------------------------------------------------
// Closed curves: their winding number about a control is the number of visits to the body, so that the rule "nonzero"
// fills the control obstacle. All run clockwise.

/** Points x, y, x, y ... of a closed curve. */
export type Curve = number[];

/** [rad] Longest chord of an arc outside of the window. Longer: arcs that surround the window lose their shape. */
const COARSE = 0.3;

/** Appends an arc between two angles from the heading of an element, without its ends, clockwise. */
function arc(curve: Curve, element: Element, from: number, to: number, window: Window, tolerance: number): void {
  const [{ x, y, radius, heading }, { center, radius: reach }] = [element, window];
  const fine = 2 * Math.acos(1 - Math.min(tolerance / radius, 0.1));
  let angle = from;
  for (;;) {
    // The arc may come nearer to the window by its length: half of the distance at most.
    const [px, py] = [x + radius * Math.cos(heading + angle), y + radius * Math.sin(heading + angle)];
    const outside = Math.hypot(px - center[0], py - center[1]) - reach;
    angle -= Math.max(fine, Math.min(COARSE, outside / (2 * radius)));
    if (angle <= to) return;
    curve.push(x + radius * Math.cos(heading + angle), y + radius * Math.sin(heading + angle));
  }
}

/** The union of the elements of consecutive spans: both branches, the front of the last and the back of the first.
 *  Without `back` a chord replaces the back, in the first element, which another curve is to hold. */
function closed(spans: Span[], window: Window, tolerance: number, back: boolean): Curve {
  const [first, last] = [spans[0]!.a, spans[spans.length - 1]!.b];
  const curve: Curve = [first.left[0], first.left[1]];
  for (const { b } of spans) curve.push(b.left[0], b.left[1]);
  arc(curve, last, last.opening, -last.opening, window, tolerance);
  for (let k = spans.length - 1; k >= 0; k--) curve.push(spans[k]!.b.right[0], spans[k]!.b.right[1]);
  curve.push(first.right[0], first.right[1]);
  if (back) arc(curve, first, -first.opening, first.opening - 2 * Math.PI, window, tolerance);
  return curve;
}

/** Consecutive spans without a gap in time, also apart where `splits` says so. */
function runs(spans: Span[], splits: (before: Span, after: Span) => boolean): Span[][] {
  const found: Span[][] = [];
  spans.forEach((span, k) => {
    const before = spans[k - 1];
    if (!before || before.b.t !== span.a.t || splits(before, span)) found.push([]);
    found[found.length - 1]!.push(span);
  });
  return found;
}

export interface ControlObstacle {
  method: Method;
  quantity: Quantity;
  /** Predicted motion of each body; null of one that the method does not know yet. */
  motions: (Motion | null)[];
  /** Curves of each body. */
  curves: Curve[][];
  /** Curves of all bodies by band of time; those of earlier bands are to be drawn over those of later ones. */
  bands: Curve[][];
}

/** The control obstacle of a method within a window, its curves within `tolerance` [unit of the control]. */
export function controlObstacle(decision: Decision, method: Method, window: Window, tolerance: number): ControlObstacle {
  const { quantity, predict } = METHODS[method];
  const motions = decision.bodies.map(predict).map((body) => body && new Motion(decision, quantity, body));
  const bands: Curve[][] = Array.from({ length: BANDS }, () => []);
  const curves = motions.map((motion) => {
    if (!motion) return [];
    if (motion.overlaps) {
      const whole = around(window);
      bands[0]!.push(whole);
      return [whole];
    }
    const spans = motion.spans(window, tolerance);
    let end = NaN;
    for (const run of runs(spans, (a, b) => a.band !== b.band)) {
      bands[run[0]!.band]!.push(closed(run, window, tolerance, run[0]!.a.t !== end));
      end = run[run.length - 1]!.b.t;
    }
    return runs(spans, () => false).map((run) => closed(run, window, tolerance, true));
  });
  return { method, quantity, motions, curves, bands };
}

/** Time of the first contact with each body under a control, Infinity for none. */
export function contacts({ motions }: ControlObstacle, u: Vector): number[] {
  return motions.map((motion) => motion?.contact(u) ?? Infinity);
}

/** A square that holds a window, clockwise. */
function around({ center: [x, y], radius }: Window): Curve {
  const r = 1.5 * radius;
  return [x - r, y - r, x - r, y + r, x + r, y + r, x + r, y - r];
}

/** [1] Rows over which an area is summed. More: slower; the error of an area falls with the power 1.5. */
const ROWS = 600;

/** Area that curves, all clockwise, enclose by the rule "nonzero" within the intersection of balls. */
export function area(curves: Curve[], balls: Ball[]): number {
  let [low, high] = [Infinity, -Infinity];
  for (const curve of curves)
    for (let k = 1; k < curve.length; k += 2) [low, high] = [Math.min(low, curve[k]!), Math.max(high, curve[k]!)];
  for (const { center, radius } of balls) [low, high] = [Math.max(low, center[1] - radius), Math.min(high, center[1] + radius)];
  const step = (high - low) / ROWS;
  if (!(step > 0)) return 0;
  // Where edges cross the middle of each row, upwards and downwards: a clockwise curve is entered upwards.
  const up: number[][] = Array.from({ length: ROWS }, () => []);
  const down: number[][] = Array.from({ length: ROWS }, () => []);
  for (const curve of curves) {
    let [x0, y0] = [curve[curve.length - 2]!, curve[curve.length - 1]!];
    for (let k = 0; k < curve.length; k += 2) {
      const [x1, y1] = [curve[k]!, curve[k + 1]!];
      // Rows whose middle is in [bottom, top): each end of an edge counts once.
      const begin = Math.max(0, Math.ceil((Math.min(y0, y1) - low) / step - 0.5));
      const end = Math.min(ROWS, Math.ceil((Math.max(y0, y1) - low) / step - 0.5));
      const rows = y1 > y0 ? up : down;
      const slope = (x1 - x0) / (y1 - y0);
      for (let row = begin; row < end; row++) rows[row]!.push(x0 + (low + (row + 0.5) * step - y0) * slope);
      [x0, y0] = [x1, y1];
    }
  }
  let sum = 0;
  for (let row = 0; row < ROWS; row++) {
    const y = low + (row + 0.5) * step;
    let [left, right] = [-Infinity, Infinity];
    for (const { center, radius } of balls) {
      const half = Math.sqrt(Math.max(0, radius ** 2 - (y - center[1]) ** 2));
      [left, right] = [Math.max(left, center[0] - half), Math.min(right, center[0] + half)];
    }
    sum += covered(Float64Array.from(up[row]!).sort(), Float64Array.from(down[row]!).sort(), left, right);
  }
  return sum * step;
}

/** Length of a row between two ends where more curves are entered than left, by the places of both, in order. */
function covered(entered: Float64Array, left: Float64Array, from: number, to: number): number {
  let [sum, depth, begin, k, j] = [0, 0, 0, 0, 0];
  while (j < left.length) {
    const enters = k < entered.length && entered[k]! <= left[j]!;
    const x = enters ? entered[k++]! : left[j++]!;
    if (depth === 0) begin = x;
    depth += enters ? 1 : -1;
    if (depth === 0) sum += Math.max(0, Math.min(to, x) - Math.max(from, begin));
  }
  return sum;
}

/** Share of the admissible controls that collide; NaN where no control is admissible. */
export function blockedShare(decision: Decision, found: ControlObstacle): number {
  const balls = admissible(decision, found.quantity);
  const whole = Math.max(...balls.map(({ center, radius }) => Math.hypot(...center) + radius));
  return area(found.curves.flat(), balls) / area([around({ center: [0, 0], radius: whole })], balls);
}
