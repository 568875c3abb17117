/** A ring of points of the last sweeps: bounded in number, one draw call, aged by the shader. */

import type { PointBuffer } from "./cloud_layer";

/** Points of old sweeps on the screen at most. */
export const OLD_POINTS = 8000;
/** A sweep is kept if the robot has moved this far [m] or turned this much [rad] since the last one kept. */
const STEP = { metres: 0.08, radians: 0.05 };

/** A sweep's place in the ring. */
interface Place {
  readonly x: number;
  readonly y: number;
  readonly yaw: number;
}

export class OldSweeps {
  readonly #buffer: PointBuffer;
  #next = 0;
  #used = 0;
  #last: Place | undefined;
  #newest = -Infinity;

  constructor(buffer: PointBuffer) {
    this.#buffer = buffer;
  }

  /** Birth of the newest point [s]. */
  get newest(): number {
    return this.#newest;
  }

  /** Number of points in the ring. */
  get count(): number {
    return this.#used;
  }

  /** Whether a sweep seen from here adds something to the last one that was kept. */
  isNews(place: Place): boolean {
    const last = this.#last;
    return (
      last === undefined ||
      Math.hypot(place.x - last.x, place.y - last.y) > STEP.metres ||
      Math.abs(Math.sin((place.yaw - last.yaw) / 2)) > STEP.radians / 2
    );
  }

  /** Keep a share of a sweep's points, so that the ring holds sweeps of `decay` seconds at this rate [1/s]. */
  push(positions: Float32Array, distances: Float32Array, place: Place, now: number, decay: number, rate: number): void {
    this.#last = place;
    this.#newest = now;
    const points = Math.floor(positions.length / 3);
    const room = Math.max(Math.floor(this.#buffer.capacity / Math.max(decay * rate, 1)), 1);
    const kept = thinned(positions, distances, Math.min(points, room));
    const count = kept.distances.length;
    const first = Math.min(count, this.#buffer.capacity - this.#next);
    this.#buffer.write(this.#next, kept.positions.subarray(0, 3 * first), kept.distances.subarray(0, first), now);
    if (first < count) {
      this.#buffer.write(0, kept.positions.subarray(3 * first), kept.distances.subarray(first), now);
    }
    this.#next = (this.#next + count) % this.#buffer.capacity;
    this.#used = Math.min(this.#used + count, this.#buffer.capacity);
    this.#buffer.geometry.setDrawRange(0, this.#used);
  }

  clear(): void {
    this.#next = 0;
    this.#used = 0;
    this.#last = undefined;
    this.#newest = -Infinity;
    this.#buffer.geometry.setDrawRange(0, 0);
  }
}

/** Return so many of the points, evenly spread over their order. */
export function thinned(
  positions: Float32Array, distances: Float32Array, count: number,
): { readonly positions: Float32Array; readonly distances: Float32Array } {
  const points = Math.floor(positions.length / 3);
  if (count >= points) {
    return { positions, distances: distances.subarray(0, points) };
  }
  const kept = { positions: new Float32Array(3 * count), distances: new Float32Array(count) };
  for (let index = 0; index < count; index += 1) {
    const at = Math.floor((index * points) / count);
    kept.positions.set(positions.subarray(3 * at, 3 * at + 3), 3 * index);
    kept.distances[index] = distances[at] ?? NaN;
  }
  return kept;
}
