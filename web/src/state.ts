// The state that the address of a page holds: scene, method, robot and step.

export interface Held {
  scene?: string;
  method?: string;
  compare?: string;
  /** 1: the second method has a run of its own. */
  own?: number;
  robot?: number;
  step?: number;
}

async function through(stream: CompressionStream | DecompressionStream, given: BlobPart): Promise<ArrayBuffer> {
  return new Response(new Blob([given]).stream().pipeThrough(stream)).arrayBuffer();
}

/** A text as letters, digits, - and _. */
async function packed(text: string): Promise<string> {
  const bytes = new Uint8Array(await through(new CompressionStream("gzip"), text));
  let letters = "";
  bytes.forEach((byte) => (letters += String.fromCharCode(byte)));
  return btoa(letters).replace(/\+/g, "-").replace(/\//g, "_").replace(/=+$/, "");
}

async function unpacked(letters: string): Promise<string> {
  const bytes = Uint8Array.from(atob(letters.replace(/-/g, "+").replace(/_/g, "/")), (c) => c.charCodeAt(0));
  return new TextDecoder().decode(await through(new DecompressionStream("gzip"), bytes));
}

export async function write(held: Held): Promise<void> {
  const found = new URLSearchParams();
  for (const [name, value] of Object.entries(held))
    if (value !== undefined) found.set(name, name === "scene" ? await packed(String(value)) : String(value));
  // A frame without an address of its own, as of a notebook, has no history to write to.
  if (location.protocol !== "about:") history.replaceState(null, "", `#${found}`);
}

export async function read(): Promise<Held> {
  const found = new URLSearchParams(location.hash.slice(1));
  const held: Held = {};
  const [scene, method, compare] = [found.get("scene"), found.get("method"), found.get("compare")];
  if (scene) held.scene = await unpacked(scene);
  if (method) held.method = method;
  if (compare) held.compare = compare;
  for (const name of ["own", "robot", "step"] as const) if (found.has(name)) held[name] = Number(found.get(name)) || 0;
  return held;
}
