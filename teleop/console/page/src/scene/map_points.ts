/** The map's points as the graphics card takes them, in an order of which any first part shows all of the map. */

import { BufferAttribute, BufferGeometry } from "three";
import type { MapPoints } from "../values";
import { markChanged } from "./changed";

/** Horizontal direction of the light that gives walls their shade. */
const LIGHT = [0.8, 0.6] as const;

/** A geometry that is filled little by little, so that a large map does not stop the page, and with it the driving. */
export class MapGeometry {
  readonly geometry = new BufferGeometry();
  readonly count: number;
  readonly #map: MapPoints;
  readonly #step: number;
  readonly #positions: BufferAttribute;
  readonly #looks: BufferAttribute;
  #filled = 0;

  constructor(map: MapPoints) {
    this.#map = map;
    this.count = Math.floor(map.positions.length / 3);
    this.#step = evenStep(this.count);
    this.#positions = new BufferAttribute(new Float32Array(3 * this.count), 3);
    this.#looks = new BufferAttribute(new Uint8Array(4 * this.count), 4, true);
    this.geometry.setAttribute("position", this.#positions);
    this.geometry.setAttribute("aLook", this.#looks);
  }

  /** Points that are there already. */
  get filled(): number {
    return this.#filled;
  }

  /** Fill in so many more points. */
  fill(most: number): void {
    const { positions, normals } = this.#map;
    const known = normals !== undefined && normals.length >= 3 * this.count;
    const [from, to] = [this.#filled, Math.min(this.#filled + most, this.count)];
    const [out, looks] = [this.#positions.array, this.#looks.array];
    for (let index = from; index < to; index += 1) {
      const at = 3 * spreadIndex(index, this.#step, this.count);
      out[3 * index] = positions[at] ?? 0;
      out[3 * index + 1] = positions[at + 1] ?? 0;
      out[3 * index + 2] = positions[at + 2] ?? 0;
      // How much it faces up or down, and its shade, both 0 to 255; two bytes stay unused.
      const up = known ? Math.abs(normals[at + 2] ?? 0) : 0;
      const facing = known ? Math.abs((normals[at] ?? 0) * LIGHT[0] + (normals[at + 1] ?? 0) * LIGHT[1]) : 127;
      looks[4 * index] = Math.min(2 * up, 255);
      looks[4 * index + 1] = Math.min(2 * Math.max(facing, up), 255);
    }
    if (to > from) {
      markChanged(this.#positions, 3 * from, 3 * (to - from));
      markChanged(this.#looks, 4 * from, 4 * (to - from));
    }
    this.#filled = to;
  }
}

/** Return which of n points is drawn as number `index`: equal steps, round and round. */
export function spreadIndex(index: number, step: number, n: number): number {
  return (index * step) % n;
}

/**
 * Return the step near the golden section of n that misses no point and leaves the most even gaps.
 *
 * The gaps that steps round a circle leave are the more even, the smaller the partial quotients of the continued
 * fraction of step / n (three-gap theorem, Steinhaus). The golden section has the smallest; rounding to whole points
 * spoils the last of them, so that the best of some neighbours is taken.
 */
export function evenStep(n: number): number {
  const golden = Math.max(Math.round(n * 0.6180339887), 1);
  let best = { step: 1, quotient: Infinity };
  for (let step = Math.max(golden - 40, 1); step <= Math.min(golden + 40, n); step += 1) {
    const quotient = largestQuotient(step, n);
    best = quotient < best.quotient ? { step, quotient } : best;
  }
  return best.step;
}

/** Return the largest partial quotient of a / b; infinite if the two have a common divisor. */
function largestQuotient(a: number, b: number): number {
  let largest = 0;
  let [high, low] = [b, a];
  while (low > 1) {
    largest = Math.max(largest, Math.floor(high / low));
    [high, low] = [low, high % low];
  }
  return low === 1 ? Math.max(largest, high) : Infinity;
}
