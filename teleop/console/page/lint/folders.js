/**
 * ESLint rule: every folder has a floor and imports only folders below it, and nothing imports in a circle.
 *
 * It is the contract that `tools/import_contracts.py` keeps for the Python packages. Files need no name: what they
 * import counts for the folders that import them. Imports of types count.
 */

import { readdirSync, readFileSync, statSync } from "node:fs";
import { posix, relative, resolve, sep } from "node:path";
import ts from "typescript";

const SOURCE = /\.tsx?$/;
const ENDINGS = ["", ".ts", ".tsx", "/index.ts", "/index.tsx"];

/** What a file imported when it was last read, by its path. */
const read = new Map();

/** The rule; its option names the root of the sources, and the floors of each folder that holds folders. */
export const folders = {
  meta: { type: "problem", schema: [{ type: "object" }] },
  create(context) {
    const [{ root, floors }] = context.options;
    const top = resolve(context.cwd, root);
    const file = relative(top, context.filename).split(sep).join("/");
    return {
      Program(node) {
        if (file.startsWith("../")) {
          return;
        }
        for (const problem of problemsOf(importsBelow(top), floors)) {
          if (problem.file === file) {
            context.report({ node, message: problem.message });
          }
        }
      },
    };
  },
};

/** Return which files below a folder each of them imports, by their paths from there. */
export function importsBelow(top) {
  const names = readdirSync(top, { recursive: true }).map((name) => name.split(sep).join("/"));
  const files = new Set(names.filter((name) => SOURCE.test(name)).sort());
  return new Map([...files].map((file) => [file, importsOf(top, file, files)]));
}

function importsOf(top, file, files) {
  const path = resolve(top, file);
  const changed = statSync(path).mtimeMs;
  if (read.get(path)?.changed !== changed) {
    const named = ts.preProcessFile(readFileSync(path, "utf8")).importedFiles.map((found) => found.fileName);
    read.set(path, { changed, named: named.filter((name) => name.startsWith(".")) });
  }
  return read.get(path).named.map((name) => {
    const meant = posix.join(posix.dirname(file), name);
    return ENDINGS.map((ending) => meant + ending).find((candidate) => files.has(candidate));
  }).filter((found) => found !== undefined);
}

/** Return what is wrong, each with the file that shows it. */
export function problemsOf(imports, floors) {
  const files = [...imports.keys()];
  const parents = new Set(files.flatMap(foldersAbove));
  const gone = Object.keys(floors).filter((parent) => !parents.has(parent));
  return [
    ...gone.map((parent) => ({ file: files[0], message: `"${parent}" has floors, but there is no such folder` })),
    ...[...parents].sort().flatMap((parent) => problemsIn(parent, imports, floors[parent] ?? [])),
  ];
}

function problemsIn(parent, imports, floors) {
  const inside = [...imports.keys()].filter((file) => childOf(parent, file) !== undefined);
  const levels = new Map(floors.flatMap((floor, level) => floor.split("|").map((name) => [name.trim(), level])));
  const children = new Map(inside.map((file) => [childOf(parent, file), file]).reverse());
  const wrong = [...children].filter(([child]) => !SOURCE.test(child) && !levels.has(child));
  const gone = [...levels.keys()].filter((name) => !children.has(name));
  if (wrong.length + gone.length > 0) {
    const where = parent === "" ? "the root" : parent;
    return [
      ...wrong.map(([child, file]) => ({ file, message: `${child} has no floor: name it among those of ${where}` })),
      ...gone.map((name) => ({ file: inside[0], message: `${name} has a floor in ${where}, but does not exist` })),
    ];
  }
  const edges = edgesIn(parent, inside, imports);
  return [...climbs(levels, edges), ...circles(edges)];
}

/** Return what each child of a folder imports of the others, with one pair of files that shows it. */
function edgesIn(parent, inside, imports) {
  const edges = new Map(inside.map((file) => [childOf(parent, file), new Map()]));
  for (const file of inside) {
    for (const imported of imports.get(file)) {
      const [from, to] = [childOf(parent, file), childOf(parent, imported)];
      if (to !== undefined && to !== from && !edges.get(from).has(to)) {
        edges.get(from).set(to, [file, imported]);
      }
    }
  }
  return edges;
}

function climbs(levels, edges) {
  return [...levels].flatMap(([folder, level]) =>
    waysFrom(folder, edges, (child) => !levels.has(child))
      .filter(({ to }) => to !== folder && levels.has(to) && levels.get(to) <= level)
      .map(({ to, way }) => ({ file: way[0][0], message: `${folder} must not import ${to}: ${inWords(way)}` })));
}

function circles(edges) {
  const found = [...edges.keys()].sort().flatMap((child) =>
    waysFrom(child, edges, () => true).filter(({ to }) => to === child)).sort((a, b) => a.way.length - b.way.length);
  return found.slice(0, 1).map(({ way }) => ({ file: way[0][0], message: `imports run in a circle: ${inWords(way)}` }));
}

/** Return the shortest way to each child that imports lead to, by way of those that let pass. */
function waysFrom(start, edges, passes) {
  const seen = new Map();
  const open = [{ at: start, way: [] }];
  for (const { at, way } of open) {
    for (const [to, step] of edges.get(at)) {
      if (!seen.has(to)) {
        seen.set(to, [...way, step]);
        if (passes(to)) {
          open.push({ at: to, way: seen.get(to) });
        }
      }
    }
  }
  return [...seen].map(([to, way]) => ({ to, way }));
}

function inWords(way) {
  return way.map(([file, imported]) => `${file} -> ${imported}`).join(", ");
}

/** Return the folders that a file is in, the root as an empty text. */
function foldersAbove(file) {
  const parts = file.split("/").slice(0, -1);
  return ["", ...parts.map((_, depth) => parts.slice(0, depth + 1).join("/"))];
}

/** Return the folder or file of a folder in which a file is; undefined if it is elsewhere. */
function childOf(parent, file) {
  const inside = parent === "" ? file : file.startsWith(`${parent}/`) ? file.slice(parent.length + 1) : undefined;
  return inside?.split("/")[0];
}
