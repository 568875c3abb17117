/** The ways to lose one's grip on the robot that events report; what no event reports is seen by the loop's own checks. */

/** Why everything counts as released. */
export type Loss =
  | "hidden" | "blurred" | "menu" | "closed" | "frozen-page" | "slept" | "touch" | "unplugged" | "frozen" | "connection"
  | "unsent" | "silent" | "taken" | "not-listening" | "headset-off" | "headset-left" | "controller" | "recentred";

/** Call `lose` for each event by which the page loses the person; returns what undoes it. */
export function watchPage(window: Window, document: Document, lose: (loss: Loss) => void): () => void {
  const listening = new AbortController();
  const options = { signal: listening.signal, capture: true };
  document.addEventListener("visibilitychange", () => {
    if (document.visibilityState !== "visible") {
      lose("hidden");
    }
  }, options);
  // Not in the capturing phase, which also shows how the focus leaves a button.
  window.addEventListener("blur", () => { lose("blurred"); }, { signal: listening.signal });
  window.addEventListener("pagehide", () => { lose("closed"); }, options);
  document.addEventListener("freeze", () => { lose("frozen-page"); }, options);
  return () => { listening.abort(); };
}

/** A pause of the loop from which on the computer counts as having slept [ms]. */
export const SLEPT = 500;

/**
 * Notices pauses of the loop. The monotonic clock of some browsers stands still while the computer sleeps, so the
 * wall clock is asked too.
 */
export class SleepWatch {
  private nowAt: number;
  private wallAt: number;

  constructor(private readonly now: () => number, private readonly wall: () => number) {
    this.nowAt = now();
    this.wallAt = wall();
  }

  /** Return whether too much time has passed since the last call. */
  slept(): boolean {
    const [now, wall] = [this.now(), this.wall()];
    const pause = Math.max(now - this.nowAt, wall - this.wallAt);
    this.nowAt = now;
    this.wallAt = wall;
    return pause > SLEPT;
  }
}
