/** A sum over the last seconds, in a fixed number of buckets however much is counted. */

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

  sum(now: number): number {
    this.#advance(now);
    return this.#sums.reduce((all, sum) => all + sum, 0);
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
