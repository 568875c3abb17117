/** Script time of the last frames, for the benchmark. */

/** A ring of the newest durations [ms]. */
export class FrameTimes {
  readonly #times: Float64Array;
  #count = 0;

  constructor(capacity = 1000) {
    this.#times = new Float64Array(capacity);
  }

  add(milliseconds: number): void {
    this.#times[this.#count % this.#times.length] = milliseconds;
    this.#count += 1;
  }

  /** The kept durations, oldest first. */
  values(): number[] {
    const capacity = this.#times.length;
    if (this.#count <= capacity) {
      return [...this.#times.subarray(0, this.#count)];
    }
    const oldest = this.#count % capacity;
    return [...this.#times.subarray(oldest), ...this.#times.subarray(0, oldest)];
  }

  clear(): void {
    this.#count = 0;
  }
}
