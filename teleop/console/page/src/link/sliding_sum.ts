/** A rate over the last seconds, in a fixed number of buckets however much is counted. */

const BUCKETS = 20;

export class SlidingSum {
  readonly #width: number;
  readonly #sums = new Float64Array(BUCKETS);
  /** Number of the newest bucket since time began. */
  #newest = -Infinity;

  /** @param window Time over which is summed [ms]. */
  constructor(window: number) {
    this.#width = window / BUCKETS;
  }

  add(amount: number, now: number): void {
    this.#advance(now);
    this.#sums[this.#slot(this.#newest)] = (this.#sums[this.#slot(this.#newest)] ?? 0) + amount;
  }

  /**
   * Amount per second.
   *
   * @param since When counting began, if that is later than the window does [ms].
   */
  rate(now: number, since: number): number {
    this.#advance(now);
    // The newest bucket is not over yet.
    const begin = Math.max(since, (this.#newest - BUCKETS + 1) * this.#width);
    const sum = this.#sums.reduce((all, part) => all + part, 0);
    return (sum * 1000) / Math.max(now - begin, this.#width);
  }

  #slot(bucket: number): number {
    return ((bucket % BUCKETS) + BUCKETS) % BUCKETS;
  }

  #advance(now: number): void {
    const bucket = Math.floor(now / this.#width);
    const first = Math.max(this.#newest + 1, bucket - BUCKETS + 1);
    for (let passed = first; passed <= bucket; passed++) {
      this.#sums[this.#slot(passed)] = 0;
    }
    this.#newest = Math.max(this.#newest, bucket);
  }
}
