// Bundles the view into the Python package and the page of the documentation, or both into the folder that is given.
import { readFile, writeFile } from "node:fs/promises";
import { join } from "node:path";
import { build } from "esbuild";

const folder = process.argv[2];

async function bundled(entry) {
  const { outputFiles } = await build({
    entryPoints: [entry],
    bundle: true,
    minify: true,
    format: "esm",
    target: "es2022",
    charset: "utf8",
    loader: { ".css": "text" },
    legalComments: "none",
    write: false,
  });
  return outputFiles[0].text;
}

await writeFile(join(folder ?? "../src/slalom/live/renderer", "view.js"), await bundled("src/main.ts"));
const script = await bundled("src/explorer.ts");
const page = (await readFile("src/explorer.html", "utf8")).replace("<!-- script -->", () => script);
await writeFile(join(folder ?? "../docs/_static", "explorer.html"), page);
