import { mkdirSync, mkdtempSync, rmSync, writeFileSync } from "node:fs";
import { tmpdir } from "node:os";
import { dirname, join } from "node:path";

import { Linter } from "eslint";
import tseslint from "typescript-eslint";
import { afterEach, beforeEach, expect, test } from "vitest";

import { folders } from "../../lint/folders.js";

let house = "";
beforeEach(() => { house = mkdtempSync(join(tmpdir(), "house-")); });
afterEach(() => { rmSync(house, { recursive: true }); });

/** Write the files of a made-up page, and return what the rule says of each of them. */
function problems(files, floors) {
  for (const [name, text] of Object.entries(files)) {
    mkdirSync(dirname(join(house, "src", name)), { recursive: true });
    writeFileSync(join(house, "src", name), text);
  }
  const linter = new Linter({ cwd: house });
  const config = {
    files: ["**/*.ts"],
    languageOptions: { parser: tseslint.parser },
    plugins: { farsteer: { rules: { folders } } },
    rules: { "farsteer/folders": ["error", { root: "src", floors }] },
  };
  return Object.entries(files).flatMap(([name, text]) =>
    linter.verify(text, [config], { filename: join(house, "src", name) }).map(({ message }) => `${name}: ${message}`));
}

const TWO_FLOORS = { "": ["roof", "cellar"] };

test("imports that lead down are allowed, also by way of a file", () => {
  const files = {
    "roof/tiles.ts": 'import { heap } from "../cellar/coal"; import "../door";',
    "door.ts": 'export * from "./cellar/coal";',
    "cellar/coal.ts": "export const heap = 1;",
  };
  expect(problems(files, TWO_FLOORS)).toEqual([]);
});

test("an import of a type that leads up is an error, and so is the circle that it closes", () => {
  const files = {
    "roof/tiles.ts": 'import { heap } from "../cellar/coal";',
    "cellar/coal.ts": "export const heap = 1;",
    "cellar/drain.ts": 'import type { Gutter } from "../roof/gutter";',
    "roof/gutter.ts": "export interface Gutter { readonly long: boolean }",
  };
  expect(problems(files, TWO_FLOORS)).toEqual([
    "cellar/drain.ts: cellar must not import roof: cellar/drain.ts -> roof/gutter.ts",
    "cellar/drain.ts: imports run in a circle: cellar/drain.ts -> roof/gutter.ts, roof/tiles.ts -> cellar/coal.ts",
  ]);
});

test("an import that leads up by way of a file is an error", () => {
  const files = {
    "roof/tiles.ts": "export const red = 1;",
    "ladder.ts": 'export const up = () => import("./roof/tiles");',
    "cellar/coal.ts": 'import { up } from "../ladder";',
  };
  expect(problems(files, TWO_FLOORS)).toEqual([
    "cellar/coal.ts: cellar must not import roof: cellar/coal.ts -> ladder.ts, ladder.ts -> roof/tiles.ts",
  ]);
});

test("folders on one floor must not import each other", () => {
  const files = { "roof/tiles.ts": 'import "../cellar";', "cellar/index.ts": "" };
  expect(problems(files, { "": ["roof | cellar"] })).toEqual([
    "roof/tiles.ts: roof must not import cellar: roof/tiles.ts -> cellar/index.ts",
  ]);
});

test("a circle of two files in one folder is an error", () => {
  const files = {
    "roof/tiles.ts": 'import type { Gutter } from "./gutter";',
    "roof/gutter.ts": 'import { red } from "./tiles";',
    "cellar/coal.ts": "",
  };
  expect(problems(files, TWO_FLOORS)).toEqual([
    "roof/gutter.ts: imports run in a circle: roof/gutter.ts -> roof/tiles.ts, roof/tiles.ts -> roof/gutter.ts",
  ]);
});

test("a folder without a floor is an error, at any depth", () => {
  const files = { "roof/tiles.ts": "", "cellar/coal.ts": "", "cellar/wine/red.ts": "" };
  expect(problems(files, TWO_FLOORS)).toEqual([
    "cellar/wine/red.ts: wine has no floor: name it among those of cellar",
  ]);
});

test("a floor without a folder is an error", () => {
  const files = { "cellar/coal.ts": "", "roof/tiles.ts": "" };
  expect(problems(files, { "": ["attic", "roof", "cellar"], "garden": ["shed"] })).toEqual([
    'cellar/coal.ts: "garden" has floors, but there is no such folder',
    "cellar/coal.ts: attic has a floor in the root, but does not exist",
  ]);
});
