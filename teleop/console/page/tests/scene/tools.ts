/** What the tests of the picture share. */

export { default as fc } from "fast-check";
export { afterEach, describe, expect, test, vi } from "vitest";

/** Points x, y, z in turn. */
export function points(...each: readonly (readonly [number, number, number])[]): Float32Array {
  return Float32Array.from(each.flat());
}
