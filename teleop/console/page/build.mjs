// Builds the page: scripts, one style sheet, manifest and icon, the licences of what is bundled. Usage: node build.mjs
// [FOLDER [--readable]]; readable scripts keep the names of modules and functions, for profiles.
import { cp, mkdir, readdir, readFile, rm, writeFile } from "node:fs/promises";
import { dirname, join, relative } from "node:path";
import { fileURLToPath } from "node:url";
import { build, transform } from "esbuild";

import { forEsbuild } from "./input_profiles.mjs";

const here = dirname(fileURLToPath(import.meta.url));
const target = process.argv[2] ?? join(here, "dist");

await rm(target, { recursive: true, force: true });
await mkdir(target, { recursive: true });
const common = {
  absWorkingDir: here,
  outdir: target,
  bundle: true,
  minify: process.argv[3] !== "--readable",
  format: "esm",
  target: ["chrome110", "firefox115", "safari16.4"],
  jsx: "automatic",
  jsxImportSource: "preact",
  legalComments: "none",
  metafile: true,
  plugins: [forEsbuild],
  logLevel: "warning",
};
// What is imported when it is asked for becomes files of its own, and so does what these share with the page.
const page = await build({ ...common, entryPoints: { console: "src/main.tsx" }, splitting: true, chunkNames: "parts/[name]-[hash]" });
const worker = await build({ ...common, entryPoints: { map_worker: "src/link/map_worker.ts" } });
const [entry] = Object.keys(page.metafile.outputs).filter((name) => name.endsWith("/console.js"));
const index = await readFile(join(here, "index.html"), "utf8");
const links = [...neededBy(entry)].map((name) => `<link rel="modulepreload" href="/console/${relative(target, join(here, name))}" />`);
await writeFile(join(target, "index.html"), index.replace("  </head>", `${links.map((link) => `    ${link}\n`).join("")}  </head>`));
await cp(join(here, "static"), target, { recursive: true });
await writeFile(join(target, "style.css"), await styles());
await writeFile(join(target, "licences.txt"), await licences([page, worker].flatMap(({ metafile }) => Object.keys(metafile.inputs))));

/** The files that a built file needs to run, found by the browser only after each other unless they are named. */
function neededBy(name, found = new Set()) {
  for (const { kind, path } of page.metafile.outputs[name].imports) {
    if (kind === "import-statement" && !found.has(path)) {
      neededBy(path, found.add(path));
    }
  }
  return found;
}

/** All style sheets as one; the theme comes first, since the others use its colours. */
async function styles() {
  const names = (await readdir(join(here, "styles"))).sort();
  const ordered = ["theme.css", ...names.filter((name) => name !== "theme.css")];
  const texts = await Promise.all(ordered.map((name) => readFile(join(here, "styles", name), "utf8")));
  const joined = await transform(texts.join("\n"), { loader: "css", minify: true });
  return joined.code;
}

/** The licence texts of all packages that the bundle contains. */
async function licences(inputs) {
  const folders = new Set(
    inputs.flatMap((path) => path.match(/^.*node_modules\/(?:@[^/]+\/)?[^/]+/)?.[0] ?? []),
  );
  const parts = [];
  for (const folder of [...folders].sort()) {
    const about = JSON.parse(await readFile(join(here, folder, "package.json"), "utf8"));
    const text = await licenceText(join(here, folder));
    parts.push(`${about.name} ${about.version} (${about.license ?? "named below"})\n\n${text}`);
  }
  return parts.join(`\n${"-".repeat(80)}\n\n`);
}

async function licenceText(folder) {
  for (const name of ["LICENSE", "LICENSE.md", "LICENSE.txt", "LICENCE", "license"]) {
    try {
      return await readFile(join(folder, name), "utf8");
    } catch {
      continue;
    }
  }
  return "The package holds no licence file; its name of the licence is given above.\n";
}
