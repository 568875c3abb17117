// Builds the page: one script, one style sheet, the licences of what is bundled. Usage: node build.mjs [FOLDER]
import { copyFile, mkdir, readFile, rm, writeFile } from "node:fs/promises";
import { dirname, join } from "node:path";
import { fileURLToPath } from "node:url";
import { build } from "esbuild";

const here = dirname(fileURLToPath(import.meta.url));
const target = process.argv[2] ?? join(here, "dist");

await rm(target, { recursive: true, force: true });
await mkdir(target, { recursive: true });
const result = await build({
  absWorkingDir: here,
  entryPoints: { console: "src/main.tsx" },
  outdir: target,
  bundle: true,
  minify: true,
  format: "esm",
  target: ["chrome110", "firefox115", "safari16.4"],
  jsx: "automatic",
  jsxImportSource: "preact",
  legalComments: "none",
  metafile: true,
  logLevel: "warning",
});
for (const file of ["index.html", "style.css"]) {
  await copyFile(join(here, file), join(target, file));
}
await writeFile(join(target, "licences.txt"), await licences(Object.keys(result.metafile.inputs)));

/** The licence texts of all packages that the bundle contains. */
async function licences(inputs) {
  const folders = new Set(
    inputs.flatMap((path) => path.match(/^.*node_modules\/(?:@[^/]+\/)?[^/]+/)?.[0] ?? []),
  );
  const parts = [];
  for (const folder of [...folders].sort()) {
    const about = JSON.parse(await readFile(join(here, folder, "package.json"), "utf8"));
    const text = await licenceText(join(here, folder));
    parts.push(`${about.name} ${about.version} (${about.license})\n\n${text}`);
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
