// The elements of the page, without behaviour.

import { METRICS } from "./metrics.ts";
import { TOOLS, type Tool } from "./tools.ts";

type Child = Node | string;

export function el<K extends keyof HTMLElementTagNameMap>(
  tag: K,
  attributes: Record<string, string> = {},
  ...children: Child[]
): HTMLElementTagNameMap[K] {
  const found = document.createElement(tag);
  for (const [name, value] of Object.entries(attributes)) found.setAttribute(name, value);
  found.append(...children);
  return found;
}

export function button(name: string, label: string, title: string): HTMLButtonElement {
  return el("button", { type: "button", "data-name": name, title, "aria-label": title }, label);
}

export function field(words: string, input: HTMLElement, name: string): HTMLLabelElement {
  return el("label", { class: "field", "data-field": name }, el("span", {}, words), input);
}

/** A button that is pressed or not, as `aria-pressed` says. */
function toggle(name: string, label: string, title: string): HTMLButtonElement {
  const found = button(name, label, title);
  found.setAttribute("aria-pressed", "false");
  return found;
}

/** A row of buttons that another button shows. */
function toolbar(name: string, ...children: Child[]): HTMLElement {
  const found = el("div", { class: "toolbar", role: "toolbar", "aria-label": name }, ...children);
  found.hidden = true;
  return found;
}

export function panel(name: string): { section: HTMLElement; title: HTMLElement; canvas: HTMLCanvasElement; legend: HTMLElement } {
  const title = el("h2", {});
  const canvas = el("canvas", { tabindex: "0", "data-panel": name, role: "img" });
  const legend = el("div", { class: "legend" });
  const frame = el("div", { class: "frame" }, canvas);
  return { section: el("section", { class: `panel ${name}` }, title, frame, legend), title, canvas, legend };
}

const KEYS = [
  ["space", "play or pause"],
  ["← →", "one step back or forward"],
  ["home, end", "first or last step"],
  ["− +", "slower or faster"],
  [", .", "look ahead less or more"],
  ["n, p", "next or previous robot"],
  ["d", "deciding elements on or off"],
  ["t", "light or dark"],
  ["f", "whole workspace"],
  ["o", "follow the robot"],
  ["l", "ruler"],
  ["s", "save the picture"],
  ["e", "lecture: large type, the choice is hidden"],
  ["v", "show or hide the choice in a lecture"],
  ["[ ]", "workspace smaller or larger"],
  ["{ }", "control space smaller or larger"],
  ["1 2 3", "plane of the slice, in space"],
  ["h", "next handle: robot, velocity, goal, control, obstacles"],
  ["shift + arrows", "move the handle; in space without one: turn the view"],
  ["escape", "let the handle go"],
];
const LIVE_KEYS = [
  ["shift + page up, down", "move the handle along z"],
  ["m, c, r", "next method, method beside it, response"],
  ["a, x", "add an obstacle, remove the handle's"],
  ["b", "the second method as a run of its own"],
  ["u", "undo"],
  ["y", "copy the scene as YAML"],
];

export function build(live: boolean) {
  const workspace = panel("workspace");
  const controls = [panel("control"), panel("control second")] as const;
  const charts = [0, 1, 2].map((k) => {
    const canvas = el("canvas", { class: "chart", role: "img", "data-panel": "chart" });
    const list = el("select", { "aria-label": `metric of chart ${k + 1}` });
    METRICS.forEach(({ name }) => list.append(new Option(name, name)));
    list.selectedIndex = k;
    return { canvas, list, frame: el("div", { class: "frame" }, canvas, list) };
  });
  const tools = new Map(Object.entries(TOOLS).map(([name, [label, title]]) => [name as Tool, toggle(name, label, title)]));
  const measure = (value: string, words: string) => el("input", { type: "number", min: "0.05", step: "0.1", value, "aria-label": words });
  const parts = {
    title: el("span", { class: "title" }),
    result: el("span", { class: "result", role: "status" }),
    method: el("select", { "aria-label": "method" }),
    foresight: el("select", { "aria-label": "foresight of the method" }),
    compare: el("select", { "aria-label": "second method, side by side" }),
    response: el("select", { "aria-label": "response whose control space is drawn" }),
    own: toggle("own", "as a run", "run the second method from the same start, beside this run (b)"),
    horizon: el("input", { type: "number", min: "0.5", max: "30", step: "0.5", "aria-label": "horizon in seconds" }),
    robot: el("input", { type: "number", min: "0", step: "1", "aria-label": "robot" }),
    colouring: el("select", { "aria-label": "colour of robots" }),
    undo: button("undo", "undo", "undo the last change (u)"),
    yaml: button("yaml", "copy YAML", "copy the scene as YAML (y)"),
    add: button("add", "add", "add an obstacle ahead of the robot (a)"),
    remove: button("remove", "remove", "remove the selected obstacle or robot (x)"),
    empty: button("empty", "empty page", "begin with an empty scene"),
    save: button("save", "save YAML", "save the scene as a YAML file for slalom run"),
    tools,
    size: measure("0.5", "radius of obstacles and robots that are drawn, in metres"),
    pace: measure("1", "speed along paths that are drawn, in metres a second"),
    drawing: toggle("draw", "draw", "draw walls, obstacles, paths and robots"),
    more: toggle("more", "more", "ruler, follow, picture, lecture, colours, keys"),
    follow: toggle("follow", "follow", "keep the robot in the middle (o)"),
    picture: button("picture", "save picture", "save what is shown as a PNG file (s)"),
    lecture: toggle("lecture", "lecture", "large type; the choice is hidden until it is asked for (e)"),
    reveal: button("reveal", "show the choice", "show or hide the choice (v)"),
    theme: button("theme", "light or dark", "light or dark (t)"),
    help: button("help", "keys", "keys (?)"),
    play: button("play", "▶", "play or pause (space)"),
    back: button("back", "◀︎ step", "one step back (←)"),
    forward: button("forward", "step ▶︎", "one step forward (→)"),
    speed: el("select", { "aria-label": "speed of the replay" }),
    time: el("input", { type: "range", min: "0", max: "1", step: "1", value: "0", "aria-label": "time of the run" }),
    clock: el("output", { class: "clock" }),
    events: el("canvas", { class: "events", role: "img", "aria-label": "events of the run" }),
    element: el("input", { type: "range", min: "0", step: "0.05", value: "0", "aria-label": "time ahead" }),
    ahead: el("output", { class: "clock" }),
    deciding: el("input", { type: "checkbox" }),
    why: el("p", { class: "why", role: "status", "aria-live": "polite" }),
    note: el("p", { class: "note", role: "alert" }),
    runs: el("div", { class: "runs" }),
    run: el("div", { class: "run" }),
    heading: el("p", { class: "heading" }),
    main: el("main"),
    workspace,
    hover: el("div", { class: "hover" }),
    controls,
    charts,
    keys: el("dialog", { class: "keys", "aria-label": "keys" }),
    yamlDialog: el("dialog", { class: "keys", "aria-label": "scene as YAML" }),
    yamlText: el("textarea", { class: "yaml", readonly: "", "aria-label": "scene as YAML" }),
    yamlNote: el("p", { role: "status" }),
  };
  for (const value of ["0.25", "0.5", "1", "2", "4", "8"]) parts.speed.append(new Option(`${value}×`, value));
  parts.speed.value = "1";
  for (const [value, words] of [
    ["role", "time to collision"],
    ["outcome", "outcome"],
    ["speed", "speed"],
    ["time", "time to goal"],
  ] as const)
    parts.colouring.append(new Option(words, value));
  const rows = [...KEYS, ...(live ? LIVE_KEYS : [])];
  const close = button("close", "close", "close");
  close.onclick = () => parts.keys.close();
  const done = button("close", "close", "close");
  done.onclick = () => parts.yamlDialog.close();
  parts.yamlDialog.append(el("h2", {}, "The scene as YAML"), parts.yamlText, parts.yamlNote, done);
  parts.keys.append(
    el("h2", {}, "Keys"),
    el("dl", {}, ...rows.flatMap(([key, words]) => [el("dt", {}, key!), el("dd", {}, words!)])),
    close,
  );
  const pick = (...names: Tool[]): HTMLButtonElement[] => names.map((name) => tools.get(name)!);
  parts.run.append(parts.heading, parts.main, el("div", { class: "told" }, parts.why, parts.reveal));
  const line = el("div", { class: "line" });
  workspace.title.replaceWith(line);
  line.append(workspace.title, parts.result);
  parts.runs.append(parts.run);
  parts.main.append(workspace.section, controls[0].section, controls[1].section);
  const bars = {
    drawing: toolbar(
      "draw",
      ...pick("obstacle", "path", "wall", "robot"),
      field("radius, m", parts.size, "size"),
      field("speed, m/s", parts.pace, "pace"),
      parts.add,
      parts.remove,
      parts.empty,
      parts.yaml,
      parts.save,
    ),
    more: toolbar("more", parts.follow, ...pick("ruler"), parts.picture, parts.lecture, parts.theme, parts.help),
  };
  const root = el(
    "div",
    { class: "slalom" },
    el(
      "header",
      {},
      el("strong", {}, "slalom"),
      parts.title,
      ...(live
        ? [
            field("method", parts.method, "method"),
            field("foresight", parts.foresight, "foresight"),
            field("beside it", parts.compare, "compare"),
            parts.own,
            field("response", parts.response, "response"),
            field("horizon", parts.horizon, "horizon"),
          ]
        : []),
      ...(live ? [parts.undo, parts.drawing] : []),
      parts.more,
    ),
    bars.drawing,
    bars.more,
    parts.note,
    parts.runs,
    el(
      "div",
      { class: "transport" },
      parts.play,
      parts.back,
      parts.forward,
      parts.speed,
      el("div", { class: "time" }, parts.time, parts.events),
      parts.clock,
      el("span", { class: "ahead" }, el("span", {}, "look ahead"), parts.element, parts.ahead),
      field("robot", parts.robot, "robot"),
      field("colour", parts.colouring, "colour"),
      el("label", { class: "field", "data-field": "deciding" }, parts.deciding, el("span", {}, "deciding elements")),
    ),
    el("div", { class: "charts" }, ...charts.map(({ frame }) => frame)),
    parts.yamlDialog,
    parts.keys,
  );
  parts.reveal.hidden = parts.own.hidden = true;
  workspace.canvas.after(parts.hover);
  parts.deciding.checked = true;
  return { root, parts: { ...parts, bars } };
}

export type Parts = ReturnType<typeof build>["parts"];

/** A legend entry: a mark and words, hidden where the picture lacks the mark. */
export function entry(mark: string, words: string, colour = "", there = true): HTMLElement {
  const swatch = el("i", { class: `mark ${mark}` });
  if (colour) swatch.style.setProperty("--mark", colour);
  return el("span", { class: there ? "entry" : "entry absent" }, swatch, words);
}
