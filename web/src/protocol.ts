// Messages: a JSON object and arrays in one binary block, see docs/view.md.

export type Vector = number[];

export interface Part {
  corners: Vector[];
  radius: number;
}

export interface RobotInfo {
  name: string;
  shape: number;
  radius: number;
  max_speed: number;
  max_acceleration: number;
  goal: Vector;
  tolerance: number;
  stop: boolean;
  path: Vector[] | null;
  method: string | null;
}

export interface ObstacleInfo {
  name: string;
  shape: number;
  radius: number;
  turns: boolean;
  heading: number;
  position: Vector | null;
}

export interface Scene {
  kind: "scene";
  format: string;
  title: string;
  method: string;
  methods: Record<string, string>;
  foresights: string[];
  dimension: 2 | 3;
  start: number;
  dt: number;
  duration: number;
  period_steps: number;
  horizon: number;
  margin: number;
  live: boolean;
  low: Vector;
  high: Vector;
  shapes: Part[][];
  robots: RobotInfo[];
  obstacles: ObstacleInfo[];
  moving: number[];
  notes: string[];
  undo?: number;
  compare?: string | null;
  chosen?: number;
  recorded?: boolean;
  /** Whether the state that a page kept has been restored. */
  restored?: boolean;
  settings?: Record<string, number>;
  editable?: boolean;
}

export interface Frames {
  kind: "frames";
  first: number;
  count: number;
  outcomes_table: string[];
  arrived: (number | null)[];
  complete: boolean;
  ended: { text: string; collided: boolean; hits: [number, number, string][] } | null;
  arrays: Record<string, Numbers>;
}

export interface Series {
  kind: "series";
  robot: number;
  first: number;
  arrays: Record<string, Numbers>;
}

export interface PlaneInfo {
  axes: [number, number];
  half: number;
  through: Vector;
}

export interface Control {
  kind: "control";
  answers: number;
  slot: number;
  step: number;
  time: number;
  robot: number;
  method: string;
  quantity: { name: string; letter: string; unit: string };
  response: string;
  responses: string[];
  horizon: number;
  margin: number;
  outcome: string;
  target: Vector | null;
  preferred: Vector;
  chosen: Vector | null;
  sentences: string[];
  first: number;
  binding: { other: number; time: number; clearance: number }[];
  others: ["obstacle" | "robot" | "hidden", number][];
  margins: number[];
  predicted: number[];
  planes: PlaneInfo[];
  arrays: Record<string, Numbers>;
}

export interface Probe {
  kind: "probe";
  answers: number;
  slot: number;
  control: Vector;
  time: number | null;
  /** Row of the first one that it hits; -1: none. */
  first?: number;
  sentence: string;
  arrays: Record<string, Numbers>;
}

export interface Text {
  kind: "yaml" | "error" | "note";
  text: string;
  /** Of a scene that the page itself asked for, to keep it. */
  quiet?: boolean;
}

export type Message = Scene | Frames | Series | Control | Probe | Text;

export interface Numbers {
  shape: number[];
  values: Float32Array | Int32Array | Uint8Array;
}

interface Described {
  type: "f4" | "i2" | "u1" | "i4";
  shape: number[];
  at: number;
  step?: number;
  origin?: number[];
  order?: number;
  absent?: number;
}

function read(buffer: ArrayBuffer, begin: number, one: Described): Numbers {
  const count = one.shape.reduce((a, b) => a * b, 1);
  if (one.type === "f4") return { shape: one.shape, values: new Float32Array(buffer, begin, count) };
  if (one.type === "i4") return { shape: one.shape, values: new Int32Array(buffer, begin, count) };
  if (one.type === "u1") return { shape: one.shape, values: new Uint8Array(buffer, begin, count) };
  const whole = new Int16Array(buffer, begin, count).slice();
  const row = count / Math.max(1, one.shape[0]!);
  // Sums modulo 2^16 undo the differences along the first axis; an Int16Array wraps by itself.
  for (let round = 0; round < (one.order ?? 0); round++) {
    for (let k = row; k < count; k++) whole[k] = whole[k]! + whole[k - row]!;
  }
  const values = new Float32Array(count);
  const origin = one.origin ?? [0];
  const step = one.step ?? 1;
  const absent = one.absent === undefined ? null : new Uint8Array(buffer, begin - one.at + one.absent, count);
  for (let k = 0; k < count; k++) {
    values[k] = absent?.[k] ? NaN : origin[k % origin.length]! + step * whole[k]!;
  }
  return { shape: one.shape, values };
}

/** Decodes one message; the buffer begins with it. */
export function decode(buffer: ArrayBuffer): Message {
  const length = new DataView(buffer).getUint32(0, true);
  const text = new TextDecoder().decode(new Uint8Array(buffer, 4, length));
  const message = JSON.parse(text) as Message & { arrays: Record<string, unknown> };
  const arrays: Record<string, Numbers> = {};
  for (const [name, one] of Object.entries(message.arrays)) {
    const described = one as Described;
    arrays[name] = read(buffer, 4 + length + described.at, described);
  };
  message.arrays = arrays;
  return message as Message;
}

/** Splits a block of messages, each after its length, and decodes them. */
export function decodeAll(buffer: ArrayBuffer): Message[] {
  const view = new DataView(buffer);
  const found: Message[] = [];
  for (let at = 0; at + 4 <= buffer.byteLength; ) {
    const length = view.getUint32(at, true);
    found.push(decode(buffer.slice(at + 4, at + 4 + length)));
    at += 4 + length;
  }
  return found;
}
