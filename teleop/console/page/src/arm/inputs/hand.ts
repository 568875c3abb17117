/** A hand that leads the arm's tip: a value that any input fills, be it a mouse, a gamepad or, some day, a headset. */

import { Quaternion, Vector3 } from "three";
import type { Pose } from "../../values";

export interface Hand {
  /** Of the hand in `frame`, x pointing ahead; only its changes count. */
  readonly pose: Pose;
  /** `arm_base`, `base_link`, or a name of the operator's own room. */
  readonly frame: string;
  /** Whether the clutch is closed: the tip follows from where it stands then. */
  readonly engaged: boolean;
  /** Of the gripper: 0 open, 1 closed. It counts from when it agrees with the jaws or passes them. */
  readonly trigger: number;
  /** Whether the pose was measured, and not guessed. */
  readonly tracked: boolean;
  /** Way of the tip over way of the hand. */
  readonly scale: number;
}

/**
 * Trigger of inputs that have none. One that stays pulled never lets go of what the jaws hold, and closes none that
 * stand open, since it does not pass them.
 */
export const NO_TRIGGER = 1;

/** Fastest hand that the page makes [m/s, rad/s]: that of a careful person, far below what the robot takes for a jump. */
const FASTEST = 0.25;
const FASTEST_TURN = 1.2;
/** The hand waits after a pause of the page that is longer [ms]: the robot lets the tip catch up over 100 ms at most. */
const PAUSE = 80;

/** A hand that follows a place on the screen, no faster than a careful person's. */
export class LedHand {
  readonly #position = new Vector3();
  readonly #turn = new Quaternion();
  #at = 0;

  /** Begin at a pose. */
  begin(pose: Pose, now: number): void {
    this.#position.copy(pose.position);
    this.#turn.copy(pose.orientation);
    this.#at = now;
  }

  /** Bring the hand nearer to a pose; returns where it is then. */
  follow(pose: Pose, now: number): Pose {
    const passed = now - this.#at;
    this.#at = now;
    if (passed > 0 && passed <= PAUSE) {
      const way = new Vector3().copy(pose.position).sub(this.#position);
      this.#position.addScaledVector(way, Math.min(1, (FASTEST * passed) / 1000 / Math.max(way.length(), 1e-9)));
      const goal = new Quaternion().copy(pose.orientation);
      const angle = this.#turn.angleTo(goal);
      this.#turn.slerp(goal, Math.min(1, (FASTEST_TURN * passed) / 1000 / Math.max(angle, 1e-9)));
    }
    const [{ x, y, z }, turn] = [this.#position, this.#turn];
    return { position: { x, y, z }, orientation: { x: turn.x, y: turn.y, z: turn.z, w: turn.w } };
  }
}
