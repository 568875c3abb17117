/** How much is drawn while the view moves, for graphics that are too slow for all of it: fewer points, fewer pixels. */

/** Frames farther apart than this [ms] are felt as jerks; closer than the second there is room for more. */
const SLOW = 55;
const FAST = 24;
const LEAST = 1 / 8;
/** Surfaces cost by the pixel, and are never left out: a picture in motion has this share of its pixels along each side, at least. */
const LEAST_SHARPNESS = 1 / 2;

/** Lowers the share of points after a few slow frames, or one that is very slow, and raises it after many fast ones. */
export class Detail {
  #share = 1;
  #slow = 0;
  #fast = 0;

  /** Share of the map's points that are drawn. */
  get share(): number {
    return this.#share;
  }

  /** Share of the screen's pixels that are drawn along each side. */
  get sharpness(): number {
    return Math.max(Math.sqrt(this.#share), LEAST_SHARPNESS);
  }

  /** Take note of a frame that followed the last one without a pause, `interval` ms later. */
  frame(interval: number): void {
    this.#slow = interval > SLOW ? this.#slow + Math.floor(interval / SLOW) : 0;
    this.#fast = interval < FAST ? this.#fast + 1 : 0;
    if (this.#slow >= 3 && this.#share > LEAST) {
      this.#share = Math.max(this.#share / (this.#slow > 8 ? 8 : 2), LEAST);
      this.#slow = 0;
    } else if (this.#fast >= 60 && this.#share < 1) {
      this.#share = Math.min(2 * this.#share, 1);
      this.#fast = 0;
    }
  }
}
