/** Every field of every message may be missing, null, NaN, huge, or of another type. */

import fc from "fast-check";
import { describe, expect, it } from "vitest";
import { check } from "../../../src/link/message_checks/field";
import { EXAMPLES } from "./valid_messages";

const BAD: readonly unknown[] = [
  undefined, null, NaN, Infinity, -Infinity, 1e308, -1, 0.5, 2 ** 53, 10n ** 400n, "", "text", "x".repeat(100_000), true,
  {}, [], [null], [[]], { x: 1 }, new Map([[1, 2]]), new Date(NaN), new Uint8Array(3), new Float32Array([NaN]),
  new BigUint64Array(2), Array<number>(20_000).fill(1e300), Symbol("s"), /x/, "<script>alert(1)</script>",
];

/** Numbers of a value that are not finite, which only distances to the map may be, by where they stand. */
function strange(value: unknown, path = ""): string[] {
  if (typeof value === "number") {
    return Number.isFinite(value) ? [] : [path];
  }
  if (value instanceof Float32Array) {
    return path.endsWith("distances") || value.every(Number.isFinite) ? [] : [path];
  }
  if (ArrayBuffer.isView(value) || typeof value !== "object" || value === null) {
    return [];
  }
  return Object.entries(value).flatMap(([name, part]) => strange(part, `${path}.${name}`));
}

/** All places in a message, as paths of keys. */
function places(value: unknown): string[][] {
  if (typeof value !== "object" || value === null || ArrayBuffer.isView(value)) {
    return [[]];
  }
  return [[], ...Object.entries(value).flatMap(([key, part]) => places(part).map((path) => [key, ...path]))];
}

/** The message with another value in a place; undefined leaves it out. */
function replaced(value: unknown, [key, ...rest]: readonly string[], by: unknown): unknown {
  if (key === undefined) {
    return by;
  }
  if (Array.isArray(value)) {
    return value.map((item: unknown, i) => (String(i) === key ? replaced(item, rest, by) : item));
  }
  const entries = Object.entries(value ?? {}).map(([name, part]): [string, unknown] => [
    name, name === key ? replaced(part, rest, by) : part,
  ]);
  return Object.fromEntries(entries.filter(([, part]) => part !== undefined));
}

describe.each(Object.entries(EXAMPLES))("a message of kind %s", (_kind, { read, message }) => {
  it("is read when it is good", () => {
    expect(check(read, message).ok).toBe(true);
  });

  it("is read or complained of, whatever it is", () => {
    fc.assert(
      fc.property(fc.anything({ withBigInt: true, withTypedArray: true, withMap: true, withDate: true }), (value) => {
        const checked = check(read, value);
        expect(checked.ok ? strange(checked.value) : checked.complaint).not.toBe("");
      }),
      { numRuns: 200 },
    );
  });

  it("is read or complained of, whatever stands in one of its fields", () => {
    for (const path of places(message)) {
      for (const bad of BAD) {
        const checked = check(read, replaced(message, path, bad));
        if (checked.ok) {
          expect(strange(checked.value)).toEqual([]);
        } else {
          expect(checked.complaint).toMatch(/^\S.* (is|has|have|does|begins|ends)\b/);
          expect(checked.complaint.length).toBeLessThan(500);
        }
      }
    }
  });
});
