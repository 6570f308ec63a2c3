// Where messages come from: a file, a server, or a notebook.

import { decode, decodeAll, type Message } from "./protocol.ts";

export interface Command {
  do: string;
  [key: string]: unknown;
}

export interface Source {
  /** Whether commands are answered. */
  readonly live: boolean;
  /** `opened` is called when commands are answered, also again after an interruption. */
  start(receive: (messages: Message[]) => void, failed: (sentence: string) => void, opened: () => void): void;
  send(command: Command): void;
  /** A source of a run beside this one, where there can be one: of the same scene (0), or of the second file (1). */
  beside?(run: number): Source;
  end?(): void;
}

async function inflated(block: Uint8Array): Promise<ArrayBuffer> {
  const stream = new Blob([block as BlobPart]).stream().pipeThrough(new DecompressionStream("gzip"));
  return new Response(stream).arrayBuffer();
}

/** Messages of a block of bytes, compressed by gzip. */
export class BlockSource implements Source {
  readonly live = false;
  constructor(private readonly block: () => Uint8Array) {}
  start(receive: (messages: Message[]) => void, failed: (sentence: string) => void): void {
    inflated(this.block()).then(
      (buffer) => receive(decodeAll(buffer)),
      (error) => failed(`The data of this view cannot be read: ${String(error)}`),
    );
  }
  send(): void {
    // A file answers nothing.
  }
}

export function fromBase64(text: string): Uint8Array {
  const binary = atob(text.trim());
  const bytes = new Uint8Array(binary.length);
  for (let k = 0; k < binary.length; k++) bytes[k] = binary.charCodeAt(k);
  return bytes;
}

/** What a widget of a notebook (anywidget) offers. */
export interface WidgetModel {
  get(name: "data"): DataView;
  get(name: "live"): boolean;
  send(content: unknown): void;
  on(name: "msg:custom", taken: (content: { complete: boolean }, buffers: DataView[]) => void): void;
}

/** Messages of the kernel of a notebook. It makes further steps of the run when it is asked, one chunk at a time. */
export class WidgetSource implements Source {
  readonly live = true;
  private making = false;
  constructor(private readonly model: WidgetModel) {}
  start(receive: (messages: Message[]) => void): void {
    this.model.on("msg:custom", (content, buffers) => {
      this.making = false;
      receive(buffers.map((view) => decode(new Uint8Array(view.buffer, view.byteOffset, view.byteLength).slice().buffer)));
      if (!content.complete) this.more();
    });
    this.model.send({ do: "open" });
  }
  private more(): void {
    if (this.making) return;
    this.making = true;
    this.model.send({ do: "more" });
  }
  send(command: Command): void {
    this.model.send(command);
  }
}

/** [ms] After which a page connects again to a server that it lost. */
const AGAIN = 2000;
const STOPPED =
  "The server has stopped; the address of this page holds the scene. " +
  "Start `slalom view` again, and add everything from # on to its address.";

/** Messages of a server. */
export class ServerSource implements Source {
  readonly live = true;
  private socket: WebSocket | null = null;
  private readonly waiting: string[] = [];
  private ended = false;
  constructor(private readonly run = 0) {}
  beside(run: number): Source {
    return new ServerSource(run);
  }
  end(): void {
    this.ended = true;
    this.socket?.close();
  }
  start(receive: (messages: Message[]) => void, failed: (sentence: string) => void, opened: () => void): void {
    const address = new URL("messages", location.href);
    address.protocol = location.protocol === "https:" ? "wss:" : "ws:";
    address.search = location.search;
    address.searchParams.set("run", String(this.run));
    const socket = new WebSocket(address);
    socket.binaryType = "arraybuffer";
    socket.onopen = () => {
      opened();
      this.waiting.splice(0).forEach((text) => socket.send(text));
    };
    socket.onmessage = (event) => receive([decode(event.data as ArrayBuffer)]);
    socket.onclose = () => {
      if (this.ended) return;
      failed(STOPPED);
      this.waiting.length = 0;
      setTimeout(() => this.start(receive, failed, opened), AGAIN);
    };
    this.socket = socket;
  }
  send(command: Command): void {
    const text = JSON.stringify(command);
    if (this.socket?.readyState === WebSocket.OPEN) this.socket.send(text);
    else this.waiting.push(text);
  }
}
