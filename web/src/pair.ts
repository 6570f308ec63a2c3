// A second run beside the first one, at the same time since the start: of another file, or of another method.

import { App } from "./app.ts";
import type { Model } from "./model.ts";
import type { Scene } from "./protocol.ts";
import type { Source } from "./sources.ts";

export class Pair {
  second: App | null = null;
  /** The method of the second run, from the start of the first one; "": another file, or none. */
  method = "";
  /** The scene that the second run was given; "": the one that the server began with. */
  private scene = "";

  constructor(private readonly app: App) {}

  /** The runs that are shown, the first one first. */
  get models(): Model[] {
    const { second, app } = this;
    return second?.model.scene && second.model.count ? [app.model, second.model] : [app.model];
  }

  /** Whether the second run is one of another file. */
  get fixed(): boolean {
    return this.second !== null && !this.method;
  }

  get complete(): boolean {
    return this.app.model.complete && (this.second?.model.complete ?? true);
  }

  /** Runs a method from the start of the scene of a text, by default that of the server; "" for none. */
  open(method: string, scene = this.scene): void {
    const source = method ? this.app.source.beside?.(0) : null;
    if (!source) return this.close();
    if (!this.second) this.show(source);
    this.method = method;
    this.scene = scene;
    this.second!.send({ do: "restore", method, ...(scene ? { scene } : {}) });
  }

  /** Shows the messages of a source beside the first run. */
  show(source: Source): void {
    const { app } = this;
    this.second = new App(app.parts.runs, source, app);
    app.root.classList.add("pair");
    app.redraw();
  }

  private close(): void {
    this.second?.end();
    [this.second, this.method, this.scene] = [null, "", ""];
    this.app.root.classList.remove("pair");
    this.app.redraw();
  }

  /** The scene of the first run was changed: the second run begins with it too. */
  changed(scene: string): void {
    if (this.method && scene !== this.scene) this.open(this.method, scene);
  }

  /** The first run began anew. */
  began({ undo }: Scene): void {
    if (!this.method || undo || !this.scene) return;
    // All changes were taken back: a new connection begins with the scene of the server.
    const { method } = this;
    this.close();
    this.open(method);
  }

  /** Shows the second run at a time [s] since the start, as the first one is shown. */
  follow(time: number): void {
    const { second, app } = this;
    if (!second?.model.scene) return;
    const { model } = second;
    const { deciding, element, colouring, quiz, playing } = app.model;
    const playhead = time / model.scene!.dt;
    const same = { deciding, element, colouring, quiz, playing };
    const before = JSON.stringify([model.playhead, model.deciding, model.element, model.colouring, model.quiz]);
    Object.assign(model, same, { playhead });
    if (second.theme !== app.theme) second.setTheme(app.theme);
    if (second.follow !== app.follow) second.setFollow(app.follow);
    [second.plane, second.zoom] = [app.plane, app.zoom];
    if (before !== JSON.stringify([playhead, deciding, element, colouring, quiz])) second.redraw();
  }
}
