// Files that the user saves: what is shown as a picture, and the scene.

import type { App } from "./app.ts";

/** Pixels of a picture for each pixel of the page, so that it stays sharp in print. */
const SHARPNESS = 2;

/** [ms] After which a file that was given is let go. */
const KEPT = 60_000;

/** Gives the user a file. */
export function download(content: Blob, name: string): void {
  const link = document.createElement("a");
  link.href = URL.createObjectURL(content);
  link.download = name;
  link.click();
  setTimeout(() => URL.revokeObjectURL(link.href), KEPT);
}

/** Saves titles, pictures, legends, sentences and charts where they are on the page, without lists and buttons. */
export function savePicture(app: App): void {
  const scene = app.model.scene;
  if (!scene || !app.model.count) return;
  app.drawAt(SHARPNESS);
  const page = app.root.getBoundingClientRect();
  const shown = [...app.root.querySelectorAll<HTMLElement>(PARTS)].filter((one) => one.offsetParent);
  const boxes = shown.map((one) => one.getBoundingClientRect());
  const top = Math.min(...boxes.map((box) => box.top)) - 10;
  const bottom = Math.max(...boxes.map((box) => box.bottom)) + 10;
  const picture = document.createElement("canvas");
  [picture.width, picture.height] = [SHARPNESS * page.width, SHARPNESS * (bottom - top)];
  const g = picture.getContext("2d")!;
  g.scale(SHARPNESS, SHARPNESS);
  g.fillStyle = app.theme.paper;
  g.fillRect(0, 0, page.width, bottom - top);
  g.translate(-page.left, -top);
  shown.forEach((one, k) => {
    const box = boxes[k]!;
    if (one instanceof HTMLCanvasElement) g.drawImage(one, box.left, box.top, box.width, box.height);
    else if (one instanceof HTMLSelectElement) words(g, one, one.selectedOptions[0]?.textContent ?? "", box.left + 6, box.top + box.height / 2);
    else if (one.classList.contains("mark")) mark(g, one, box);
    else lines(g, one);
  });
  app.redraw();
  picture.toBlob((blob) => blob && download(blob, `${scene.title} ${app.model.time.toFixed(1)} s.png`), "image/png");
}

/** What a picture holds. */
const PARTS = ".title, .result, .heading, .panel h2, .panel canvas, .mark, .entry, .why, .charts canvas, .charts select";

function words(g: CanvasRenderingContext2D, styled: Element, said: string, x: number, middle: number): void {
  const style = getComputedStyle(styled);
  g.font = `${style.fontWeight} ${style.fontSize} ${style.fontFamily}`;
  g.fillStyle = style.color;
  g.textAlign = "left";
  g.textBaseline = "middle";
  g.fillText(said, x, middle);
}

/** The text of an element, line by line as the page breaks it. */
function lines(g: CanvasRenderingContext2D, element: HTMLElement): void {
  const walker = document.createTreeWalker(element, NodeFilter.SHOW_TEXT);
  const range = document.createRange();
  for (let node = walker.nextNode(); node; node = walker.nextNode()) {
    const text = node.textContent ?? "";
    if (!text) continue;
    let [begin, before]: [number, DOMRect | null] = [0, null];
    for (let k = 0; k <= text.length; k++) {
      range.setStart(node, Math.min(k, text.length - 1));
      range.setEnd(node, Math.min(k + 1, text.length));
      const box = k < text.length ? range.getBoundingClientRect() : null;
      if (before && (!box || (box.width > 0 && box.top > before.top + 2))) {
        words(g, node.parentElement!, text.slice(begin, k).trimEnd(), before.left, before.top + before.height / 2);
        [begin, before] = [k, null];
      }
      if (box && box.width > 0) before ??= box;
    }
  }
}

/** The mark of a legend, as its style draws it. */
function mark(g: CanvasRenderingContext2D, element: HTMLElement, box: DOMRect): void {
  const style = getComputedStyle(element);
  const line = parseFloat(style.borderTopWidth);
  const middle = box.top + box.height / 2;
  g.strokeStyle = style.borderTopColor;
  g.lineWidth = line;
  g.beginPath();
  if (element.classList.contains("scale")) {
    const gradient = g.createLinearGradient(box.left, 0, box.right, 0);
    const colours = style.backgroundImage.match(/rgb\([^)]*\)/g) ?? [];
    colours.forEach((colour, k) => gradient.addColorStop(k / (colours.length - 1), colour));
    g.fillStyle = gradient;
    g.fillRect(box.left, box.top, box.width, box.height);
  } else if (parseFloat(style.height) <= line + 0.5) {
    g.setLineDash(style.borderTopStyle === "dashed" ? [4, 2.5] : []);
    g.moveTo(box.left, middle);
    g.lineTo(box.right, middle);
  } else if (style.borderTopLeftRadius === "0px") g.rect(box.left + line / 2, box.top + line / 2, box.width - line, box.height - line);
  else g.arc(box.left + box.width / 2, middle, (box.width - line) / 2, 0, 2 * Math.PI);
  g.fillStyle = style.backgroundColor;
  if (box.height > line + 0.5) g.fill();
  if (line) g.stroke();
  g.setLineDash([]);
}
