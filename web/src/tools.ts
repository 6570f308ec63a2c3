// Tools of the workspace: the ruler, and drawing obstacles, paths, walls and robots by one stroke of the pointer.

import type { App } from "./app.ts";
import { arrow, polyline, text, type Context, type Viewport } from "./geometry.ts";
import { hit } from "./handles.ts";
import type { Body } from "./model.ts";
import { drawRuler, type End } from "./ruler.ts";
import type { Theme } from "./theme.ts";

export type Tool = "ruler" | "obstacle" | "path" | "wall" | "robot";

/** What a tool does, for the page. */
export const TOOLS: Record<Tool, [label: string, title: string]> = {
  ruler: ["ruler", "measure a distance: drag between two points or bodies (l)"],
  obstacle: ["obstacle", "draw an obstacle: press at its middle, drag to its border"],
  path: ["path", "draw the path of an obstacle: drag from the obstacle"],
  wall: ["wall", "draw a wall: drag along it"],
  robot: ["robot", "draw a robot: press at its start, drag to its goal"],
};

/** [pixel] Shorter strokes are a click. */
const CLICK = 6;
/** [pixel] Distance up to which corners are left out of a path that is drawn. */
const SMOOTH = 3;

export class Tools {
  chosen: Tool | null = null;
  /** The stroke that is being drawn, in metres. */
  private stroke: number[][] = [];
  private begun: End | null = null;
  /** The obstacle whose path is being drawn. */
  private along: number | null = null;
  ruled: [End, End] | null = null;

  constructor(private readonly app: App) {}

  choose(tool: Tool | null): void {
    this.chosen = this.chosen === tool ? null : tool;
    this.stroke = [];
    if (this.chosen !== "ruler") this.ruled = null;
    this.app.parts.tools.forEach((button, name) => button.setAttribute("aria-pressed", String(name === this.chosen)));
    this.app.parts.workspace.canvas.style.cursor = this.chosen ? "crosshair" : "default";
    this.app.redraw();
  }

  /** The body at a pixel, else the point there. */
  private end(x: number, y: number): End {
    const found = hit(this.app, null, x, y, true);
    if (!found || found.what === "goal" || found.what.endsWith("velocity")) return this.app.view!.inverse(x, y);
    return { kind: found.what as Body["kind"], index: found.index };
  }

  down(x: number, y: number): void {
    const { app } = this;
    this.begun = this.end(x, y);
    this.along = !Array.isArray(this.begun) && this.begun.kind === "obstacle" ? this.begun.index : null;
    this.stroke = [app.view!.inverse(x, y)];
    if (this.chosen === "path" && this.along === null) app.say("Begin the path on an obstacle.");
    this.move(x, y);
  }

  move(x: number, y: number): void {
    if (!this.stroke.length) return;
    const at = this.app.view!.inverse(x, y);
    if (this.chosen === "ruler") this.ruled = [this.begun!, this.end(x, y)];
    if (this.chosen === "path") this.stroke.push(at);
    else this.stroke[1] = at;
    this.app.redraw();
  }

  up(x: number, y: number): void {
    if (!this.stroke.length) return;
    this.move(x, y);
    const { app, stroke, chosen } = this;
    const { model, parts, view } = app;
    const length = Math.hypot(...stroke[0]!.map((from, c) => stroke[stroke.length - 1]![c]! - from));
    const click = length * view!.scale < CLICK;
    const size = parts.size.valueAsNumber;
    const common = { step: model.step };
    if (chosen === "obstacle") app.act({ do: "add", what: "obstacle", points: [stroke[0]], radius: click ? size : length, ...common });
    else if (click && chosen !== "ruler" && chosen) app.say(`${TOOLS[chosen][1].replace(/^./, (c) => c.toUpperCase())}.`);
    else if (chosen === "wall" || chosen === "robot") app.act({ do: "add", what: chosen, points: stroke, radius: size, ...common });
    else if (chosen === "path" && this.along !== null) {
      const points = smoothed(stroke, SMOOTH / view!.scale);
      app.act({ do: "path", index: this.along, points, speed: parts.pace.valueAsNumber, ...common });
    }
    this.stroke = [];
    app.redraw();
  }

  draw(g: Context, view: Viewport, theme: Theme): void {
    const { chosen, stroke, app } = this;
    if (this.ruled) drawRuler(g, app.model, this.ruled, view, theme);
    if (stroke.length < 2 || chosen === "ruler") return;
    const [from, to] = [stroke[0]!, stroke[stroke.length - 1]!];
    const [x, y] = [view.px(from[0]!), view.py(from[1]!)];
    const length = Math.hypot(to[0]! - from[0]!, to[1]! - from[1]!);
    g.strokeStyle = theme.mark;
    g.lineWidth = 2;
    if (chosen === "obstacle") {
      g.beginPath();
      g.arc(x, y, length * view.scale, 0, 2 * Math.PI);
      g.stroke();
    } else if (chosen === "robot") arrow(g, view, from, [to[0]! - from[0]!, to[1]! - from[1]!], theme.mark, 2);
    else {
      polyline(g, view, stroke);
      g.stroke();
    }
    if (chosen !== "path") text(g, theme, `${length.toFixed(2)} m`, view.px(to[0]!) + 10, view.py(to[1]!) - 8, { colour: theme.mark });
  }
}

/** Some points of a line, from which no other one is farther than a distance (Douglas and Peucker). */
export function smoothed(points: number[][], distance: number): number[][] {
  const [a, b] = [points[0]!, points[points.length - 1]!];
  const [dx, dy] = [b[0]! - a[0]!, b[1]! - a[1]!];
  const length = Math.hypot(dx, dy);
  let [far, most] = [0, distance];
  for (let k = 1; k < points.length - 1; k++) {
    const [x, y] = [points[k]![0]! - a[0]!, points[k]![1]! - a[1]!];
    const away = length > 1e-9 ? Math.abs(dx * y - dy * x) / length : Math.hypot(x, y);
    if (away > most) [far, most] = [k, away];
  }
  if (!far) return [a, b];
  return [...smoothed(points.slice(0, far + 1), distance).slice(0, -1), ...smoothed(points.slice(far), distance)];
}
