/** Compares what the robot says with what is sent to it: does the arm follow, and did the robot stop following? */

import type { ArmState } from "../../robot/arm";
import { asksForMotion, type ArmWish } from "./arm_wish";

/** Time in which the robot's answer must come [ms]; states come ten times a second at least. */
const GRACE = 900;
const RETRIES = 3;

export class FollowingWatch {
  #since = 0;
  #retries = 0;
  #followed = false;

  begin(now: number): void {
    this.#since = now;
    this.#retries = 0;
    this.#followed = false;
  }

  /**
   * Judge the robot's newest state.
   *
   * A robot that followed and does not any more was stopped by a limit, its watchdog or somebody: then the person must
   * let go first. One that never did is shown a wish at rest again.
   */
  judge(now: number, wish: ArmWish, state: ArmState | undefined): "fine" | "again" | "refused" {
    // A planned motion has an end of its own, and a wish at rest is followed by standing still.
    if (wish.kind === "plan" || !asksForMotion(wish)) {
      this.begin(now);
      return "fine";
    }
    if (state?.mode === wish.kind) {
      this.#followed = true;
      this.#since = now;
      return "fine";
    }
    if (this.#followed && state?.mode === "held") {
      return "refused";
    }
    if (now - this.#since < GRACE) {
      return "fine";
    }
    this.#since = now;
    this.#retries += 1;
    return this.#retries > RETRIES ? "refused" : "again";
  }
}
