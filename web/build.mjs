// Bundles the renderer into the Python package, or into the file that is given.
import { build } from "esbuild";

const outfile = process.argv[2] ?? "../src/slalom/live/renderer/view.js";
await build({
  entryPoints: ["src/main.ts"],
  bundle: true,
  minify: true,
  format: "esm",
  target: "es2022",
  charset: "utf8",
  loader: { ".css": "text" },
  legalComments: "none",
  outfile,
});
