/** Whether a gamepad still reports: one that is out of radio range keeps its last deflection for seconds. */

/** An analogue stick in a hand is never at rest for so long [ms]. */
const STILL = 1000;
/** One at its stop may be [ms]. */
const STILL_AT_STOP = 3000;

/**
 * Follows the times of a gamepad's reports. Only pads that are known to renew them, and whose axes are analogue,
 * are judged: a digital one rests with its key held.
 */
export class GamepadFreshness {
  private timestamp = 0;
  private changedAt = 0;
  private changes = 0;
  private analogue = false;

  /** Return whether the pad is frozen, given that its deadman is held and its stick is pushed. */
  frozen(pad: Gamepad, now: number): boolean {
    if (pad.timestamp !== this.timestamp) {
      this.timestamp = pad.timestamp;
      this.changedAt = now;
      this.changes += 1;
    }
    this.analogue ||= pad.axes.some((axis) => Math.abs(axis) > 0.02 && Math.abs(axis) < 0.98);
    const atStop = pad.axes.some((axis) => Math.abs(axis) >= 0.98);
    return this.analogue && this.changes > 2 && now - this.changedAt > (atStop ? STILL_AT_STOP : STILL);
  }

  /** Note that nothing was held until now, so that what was still before does not count. */
  rested(now: number): void {
    this.changedAt = now;
  }
}
