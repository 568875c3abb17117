/** Leads a newcomer through picking something up: which step is next, by what the arm itself says. */

import type { ArmInfo, ArmState } from "../robot/arm";

export const GUIDE_STEPS = ["open", "reach", "close", "lift"] as const;
export type GuideStep = (typeof GUIDE_STEPS)[number] | "done";

/** Share of the widest opening from which the gripper counts as open. */
const OPEN = 0.6;
/** Height to which something must be lifted [m]. */
const LIFTED = 0.04;

export class Guide {
  #grippedAt: number | undefined;

  /** Return the step that is next; call it with each state. */
  next(info: ArmInfo, state: ArmState): GuideStep {
    const height = state.tip.position.z;
    if (!state.holding) {
      this.#grippedAt = undefined;
      return state.opening < OPEN * info.opening ? "open" : "reach";
    }
    this.#grippedAt = Math.min(this.#grippedAt ?? height, height);
    return height - this.#grippedAt > LIFTED ? "done" : "lift";
  }
}
