// Perspective on a scene in space.

import type { Model } from "./model.ts";

export interface Camera {
  /** [rad] About the vertical axis, and above the ground. */
  yaw: number;
  pitch: number;
  zoom: number;
  /** [m] What is in the middle of the picture; null: the scene. */
  at: number[] | null;
}

const REST = { yaw: -0.5, pitch: 0.45 };
/** Distance from the middle of the scene, in its largest sizes. */
const DISTANCE = 2.2;
const BORDER = 40;

export function camera(): Camera {
  return { ...REST, zoom: 1, at: null };
}

/** Turns a camera about the scene by angles [rad]; it stays above the ground. */
export function orbit(camera: Camera, yaw: number, pitch: number): void {
  camera.yaw += yaw;
  camera.pitch = Math.max(0.02, Math.min(1.55, camera.pitch + pitch));
}

export interface Projected {
  x: number;
  y: number;
  depth: number;
  /** [pixel / m] at this depth. */
  scale: number;
}

export class Eye {
  private readonly middle: number[];
  private readonly size: number;
  private readonly unit: number;
  private readonly centre: [number, number];
  readonly floor: number;
  constructor(
    model: Model,
    private readonly camera: Camera,
    private readonly width: number,
    private readonly height: number,
  ) {
    const { low, high } = model.scene!;
    this.middle = camera.at ?? low.map((x, c) => (x + high[c]!) / 2);
    this.floor = low[2]!;
    this.size = Math.max(...low.map((x, c) => high[c]! - x));
    const corners = [0, 1, 2, 3, 4, 5, 6, 7].map((k) => [0, 1, 2].map((c) => ((k >> c) & 1 ? high[c]! : low[c]!)));
    // The scale is that of the camera at rest, so that it does not change while the camera turns.
    const rest = extent(corners.map((corner) => this.flat(corner, REST)));
    this.unit = camera.zoom * Math.min((width - 2 * BORDER) / rest.width, (height - 2 * BORDER) / rest.height);
    const now = extent(corners.map((corner) => this.flat(corner, camera)));
    this.centre = camera.at ? [0, 0] : [now.x, now.y];
  }

  /** Position on a screen at distance 1, and depth, in sizes of the scene. */
  private flat(point: number[], { yaw, pitch }: { yaw: number; pitch: number }): [number, number, number] {
    const [x, y, z] = point.map((p, c) => (p - this.middle[c]!) / this.size) as [number, number, number];
    const side = Math.cos(yaw) * x + Math.sin(yaw) * y;
    const ahead = -Math.sin(yaw) * x + Math.cos(yaw) * y;
    const up = Math.cos(pitch) * z + Math.sin(pitch) * ahead;
    const depth = Math.max(0.1, DISTANCE + Math.cos(pitch) * ahead - Math.sin(pitch) * z);
    return [side / depth, up / depth, depth];
  }

  project(point: number[]): Projected {
    const [side, up, depth] = this.flat(point, this.camera);
    const x = this.width / 2 + this.unit * (side - this.centre[0]);
    const y = this.height / 2 - this.unit * (up - this.centre[1]);
    return { x, y, depth, scale: this.unit / depth / this.size };
  }
}

function extent(points: number[][]): { x: number; y: number; width: number; height: number } {
  const [xs, ys] = [points.map((p) => p[0]!), points.map((p) => p[1]!)];
  const [x0, x1, y0, y1] = [Math.min(...xs), Math.max(...xs), Math.min(...ys), Math.max(...ys)];
  return { x: (x0 + x1) / 2, y: (y0 + y1) / 2, width: x1 - x0, height: y1 - y0 };
}
