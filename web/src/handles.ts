// Handles: what can be dragged, where it is, and which of them is at a pixel.

import type { App } from "./app.ts";
import type { Viewport } from "./geometry.ts";
import { tip } from "./workspace.ts";

export type What = "robot" | "robot_velocity" | "goal" | "obstacle" | "obstacle_velocity" | "control";

export interface Handle {
  what: What;
  index: number;
  slot?: number;
}

const NEAR = 11;

/** Where a handle is, in metres. */
export function place(app: App, handle: Handle): number[] | null {
  const { model } = app;
  const scene = model.scene!;
  const { what, index } = handle;
  if (what === "control") {
    const control = model.control(handle.slot ?? 0);
    if (!control) return null;
    const u = model.probe?.control ?? control.chosen ?? control.preferred;
    return control.planes[app.plane]!.axes.map((axis) => u[axis]!);
  }
  if (what === "robot") return model.robot(index);
  if (what === "goal") return model.goal(index);
  if (what === "robot_velocity") return model.robot(index).map((x, c) => x + model.velocity(index)[c]!);
  const at = scene.obstacles[index] ? model.obstacle(index) : null;
  if (!at || what === "obstacle") return at;
  return at.map((x, c) => x + model.obstacleVelocity(index)[c]!);
}

/** Where the handle at a place is drawn. */
export function pixel(app: App, { what, index }: Handle, at: number[], view: Viewport): [number, number] {
  const { model } = app;
  if (what === "robot_velocity") return tip(view, model.robot(index), model.velocity(index));
  const body = what === "obstacle_velocity" ? model.obstacle(index) : null;
  return body ? tip(view, body, model.obstacleVelocity(index)) : [view.px(at[0]!), view.py(at[1]!)];
}

export function handles(app: App, selected: Handle | null): Handle[] {
  const { model } = app;
  const scene = model.scene!;
  const k = model.selected;
  const own: Handle[] = [
    { what: "robot_velocity", index: k },
    { what: "robot", index: k },
    { what: "goal", index: k },
  ];
  if (model.control()) own.push({ what: "control", index: 0, slot: 0 });
  scene.obstacles.forEach((_, index) => {
    if (selected?.index === index && selected.what.startsWith("obstacle"))
      own.push({ what: "obstacle_velocity", index });
    own.push({ what: "obstacle", index });
  });
  return own;
}

/** The handle at a point; another robot counts as a handle, which selects it. */
export function hit(app: App, selected: Handle | null, x: number, y: number, all = app.source.live): Handle | null {
  const { model, view } = app;
  const scene = model.scene!;
  if (!view || !model.count) return null;
  const reach = (handle: Handle): number => {
    if (handle.what === "robot") return Math.max(NEAR, scene.robots[handle.index]!.radius * view.scale);
    if (handle.what === "obstacle") return Math.max(NEAR, Math.min(60, scene.obstacles[handle.index]!.radius * view.scale));
    return NEAR;
  };
  const others = scene.robots.map((_, index): Handle => ({ what: "robot", index }));
  const candidates = all ? [...handles(app, selected), ...others] : others;
  let best: Handle | null = null;
  let nearest = Infinity;
  for (const handle of candidates) {
    const at = place(app, handle);
    if (!at || handle.what === "control" || (handle.what === "robot" && !model.present(handle.index))) continue;
    const [px, py] = pixel(app, handle, at, view);
    const share = Math.hypot(px - x, py - y) / reach(handle);
    // Small handles win over the bodies on which they lie.
    const weight = handle.what.endsWith("velocity") || handle.what === "goal" ? 0.5 : 1;
    if (share <= 1 && share * weight < nearest) [best, nearest] = [handle, share * weight];
  }
  return best;
}
