// Bundles script and style of the page into the package: node build.mjs [FOLDER]
import { build } from "esbuild";
import { mkdirSync, readFileSync } from "node:fs";
import { dirname, join } from "node:path";
import { fileURLToPath } from "node:url";

const here = dirname(fileURLToPath(import.meta.url));
const folder = process.argv[2] ?? join(here, "..", "src", "ppafo", "page", "bundle");
mkdirSync(folder, { recursive: true });

const licence = readFileSync(join(here, "vendor", "uplot", "LICENSE"), "utf8").trim();
const banner = `/*! The page of ppafo. It has in it uPlot:\n${licence}\n*/`;

const shared = {
  absWorkingDir: here,
  bundle: true,
  minify: true,
  charset: "utf8",
  legalComments: "inline",
  target: ["chrome109", "firefox115", "safari16.4"],
  logLevel: "warning",
};

// The worker is a script of its own inside the script of the page, as text: a page from a file has nowhere to load it from.
const worker = await build({ ...shared, entryPoints: ["source/worker.ts"], format: "iife", write: false });
await build({
  ...shared,
  entryPoints: { page: "source/main.ts" },
  format: "iife",
  outdir: folder,
  banner: { js: banner },
  inject: ["source/language.ts"],
  define: { WORKER_SCRIPT: JSON.stringify(worker.outputFiles[0].text), "Intl.NumberFormat": "PlainNumbers", "Intl.DateTimeFormat": "NoCalendar" },
});
await build({ ...shared, entryPoints: { loader: "source/loader.ts" }, format: "iife", outdir: folder });
await build({ ...shared, entryPoints: { page: "source/page.css" }, outdir: folder });
