/** Compares what the robot says with what is sent to it: has it armed, and did it stop listening? */

import type { ControlState } from "../values";

/** Time for which a state may still be one from before the press [ms]; the age of commands is added. */
const GRACE = 300;
const RETRIES = 3;

/**
 * The neutral command that begins a stream arms the robot, unless it arrived in one tick with its successor: then
 * it is sent again. A robot that had armed and does not listen any more was stopped by its watchdog, by late
 * commands or by a take-over: then the person must let go first, as the robot's own rule says.
 */
export class ArmingWatch {
  private beganAt = 0;
  private retries = 0;
  private armed = false;
  private seen: ControlState | undefined;
  private seenAt = 0;

  begin(now: number): void {
    this.beganAt = now;
    this.retries = 0;
    this.armed = false;
  }

  /** Judge the newest state of the robot while a stream runs. */
  judge(now: number, control: ControlState | undefined): "fine" | "rearm" | "refused" {
    if (control !== this.seen) {
      this.seen = control;
      this.seenAt = now;
    }
    if (control === undefined || this.seenAt < this.beganAt + GRACE + 1000 * Math.min(1, control.linkAge)) {
      return "fine";
    }
    if (control.armed) {
      this.armed = true;
      return "fine";
    }
    if (this.armed || this.retries === RETRIES) {
      return "refused";
    }
    this.retries += 1;
    this.beganAt = now;
    return "rearm";
  }
}
