/** Asks the robot for previews while a ghost is moved: at most 10 a second, one at a time, the newest pose wins. */

import type { HintPreview, PlanarPose } from "../values";

export interface PreviewClock {
  now(): number;
  /** Call back after a time [ms]; the returned function cancels that. */
  after(delay: number, callback: () => void): () => void;
}

/** Least time between two requests [ms]. */
export const PREVIEW_PERIOD = 100;

/** A request that was not answered for this long no longer holds up the next [ms]. */
export const PREVIEW_TIMEOUT = 1000;

export class HintPreviews {
  private wanted: PlanarPose | undefined;
  private asked = 0;
  private waiting = false;
  private lastAt = -Infinity;
  private cancelTimer: (() => void) | undefined;

  /**
   * @param ask Asks the robot; undefined if the request was overtaken or cannot be answered.
   * @param show Is given each answer to the newest request.
   */
  constructor(
    private readonly ask: (pose: PlanarPose) => Promise<HintPreview | undefined>,
    private readonly show: (preview: HintPreview) => void,
    private readonly clock: PreviewClock,
  ) {}

  /** Ask for this pose as soon as that is allowed; it replaces a pose that still waits. */
  request(pose: PlanarPose): void {
    this.wanted = pose;
    this.schedule();
  }

  /** Forget what waits, and ignore what is still to be answered. */
  stop(): void {
    this.wanted = undefined;
    this.waiting = false;
    this.asked += 1;
    this.cancelTimer?.();
    this.cancelTimer = undefined;
  }

  private schedule(): void {
    if (this.wanted === undefined || this.cancelTimer !== undefined) {
      return;
    }
    const earliest = this.lastAt + (this.waiting ? PREVIEW_TIMEOUT : PREVIEW_PERIOD);
    const delay = earliest - this.clock.now();
    if (delay <= 0) {
      this.send(this.wanted);
    } else {
      this.cancelTimer = this.clock.after(delay, () => {
        this.cancelTimer = undefined;
        this.schedule();
      });
    }
  }

  private send(pose: PlanarPose): void {
    this.wanted = undefined;
    this.waiting = true;
    this.lastAt = this.clock.now();
    this.asked += 1;
    const number = this.asked;
    const done = (preview: HintPreview | undefined): void => {
      if (number !== this.asked) {
        return;
      }
      this.waiting = false;
      this.cancelTimer?.();
      this.cancelTimer = undefined;
      if (preview !== undefined) {
        this.show(preview);
      }
      this.schedule();
    };
    this.ask(pose).then(done, () => { done(undefined); });
  }
}
