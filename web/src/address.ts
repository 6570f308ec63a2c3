// The address of a page of its own holds what it shows: scene, methods, robot and step.

import type { App } from "./app.ts";
import type { Scene } from "./protocol.ts";
import { read, write, type Held } from "./state.ts";

/** [ms] Between two changes of the address. */
const PAUSE = 500;

export class Address {
  private held: Held = {};
  /** The step to show once it is there, of an address. */
  private due: number | null = null;
  /** Whether a scene of before is to come. */
  restoring = false;
  /** Whether the scene in `held` is the one that is shown. */
  private current = false;
  private written = "";
  private writtenAt = 0;

  constructor(
    private readonly app: App,
    /** Whether there is a page whose address may change. */
    private readonly own: boolean,
  ) {}

  /** Holds the text of the scene that is shown. */
  hold(scene: string): void {
    this.held.scene = scene;
  }

  refused(): void {
    this.restoring = false;
  }

  began(scene: Scene): void {
    this.restoring = this.restoring && !scene.restored;
    this.current = false;
  }

  /** Restores what the page held, from its address at first; when it connects again what it showed. */
  async restore(): Promise<void> {
    const { app } = this;
    if (!this.own || this.restoring) return;
    this.restoring = true;
    try {
      if (!app.model.scene) this.held = await read();
    } catch (error) {
      app.say(`The address holds no scene that can be read: ${String(error)}`);
    }
    const { step, own, ...state } = this.held;
    this.due = step ?? null;
    if (own) delete state.compare;
    if (app.source.live && (state.scene || state.method || state.compare || state.robot)) app.send({ do: "restore", ...state });
    else this.restoring = false;
    if (own && this.held.compare) app.pair.open(this.held.compare, state.scene);
  }

  /** Keeps the state in the address, at most twice a second. */
  keep(now: number): void {
    const { app } = this;
    const { model, source, pair } = app;
    const scene = model.scene!;
    if (this.due !== null && !this.restoring && (app.last >= this.due || pair.complete)) {
      if (!source.live && this.held.robot) app.select(this.held.robot);
      app.seek(this.due);
      this.due = null;
    }
    if (app.leader || this.restoring || this.due !== null || now - this.writtenAt < PAUSE) return;
    if (source.live && scene.undo && model.complete && !this.current && (this.own || pair.method)) {
      this.current = true;
      app.send({ do: "yaml", quiet: true });
    }
    if (!this.own) return;
    if (!scene.undo) delete this.held.scene;
    const { scene: text } = this.held;
    const beside = pair.method || scene.compare;
    this.held = {
      ...(text ? { scene: text } : {}),
      ...(source.live && !scene.recorded ? { method: scene.method } : {}),
      ...(beside ? { compare: beside } : {}),
      ...(pair.method ? { own: 1 } : {}),
      robot: model.selected,
      step: Math.floor(model.playhead + 1e-9),
    };
    const state = JSON.stringify(this.held);
    if (model.playing || state === this.written) return;
    this.written = state;
    this.writtenAt = now;
    void write(this.held);
  }
}
