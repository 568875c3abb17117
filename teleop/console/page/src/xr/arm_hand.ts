/** The other hand leads the arm: its grip is the clutch, its trigger the gripper; it feels what the arm does. */

import { Quaternion } from "three";
import type { Arm } from "../arm/arm";
import type { ArmWish } from "../arm/inputs/arm_wish";
import type { Side } from "./inputs";
import { UPRIGHT } from "./place";

/** Name of the frame of the hand's poses: the operator's own room, which the robot knows nothing of. */
const FRAME = "headset";
/** How long a pulse lasts that is not renewed [ms]: the robot tells of it at each tick. */
const PULSE = 120;
const REFUSED = { strength: 0.8, duration: 60 };

export class ArmHand {
  #closed = true;
  #side: Side | undefined;
  readonly #turn = new Quaternion();
  readonly #back = UPRIGHT.clone().invert();

  /** Whether the clutch is closed: then the trigger is the gripper's. */
  get closed(): boolean {
    return this.#closed && this.#side?.present === true;
  }

  /** Take over what the hand does in a frame. */
  frame(side: Side, arm: Arm | undefined): void {
    this.#side = side;
    if (!side.present) {
      this.lose(arm);
      return;
    }
    const closed = arm !== undefined && side.pressed("squeeze");
    if (closed && !this.#closed && !arm.hold.begin("headset", () => this.#wish())) {
      side.pulse(REFUSED.strength, REFUSED.duration);
    }
    if (!closed && this.#closed) {
      arm?.hold.end("headset");
    }
    this.#closed = closed;
  }

  /** The hand may be gone: the arm stands, and the clutch is opened before it closes again. */
  lose(arm: Arm | undefined): void {
    this.#closed = true;
    arm?.hold.end("headset");
  }

  /** Have the hand feel the strength that the robot tells of, 0 to 1. */
  feel(strength: number): void {
    this.#side?.pulse(strength, PULSE);
  }

  /** In the room with x ahead, y left and z up, the hand's x pointing where its ray points. */
  #wish(): ArmWish {
    const side = this.#side;
    const { x, y, z } = side?.position ?? { x: 0, y: 0, z: 0 };
    const turn = this.#turn.copy(UPRIGHT).multiply(side?.ray.turn ?? UPRIGHT).multiply(this.#back);
    return {
      kind: "hand",
      hand: {
        pose: { position: { x: -z, y: -x, z: y }, orientation: { x: turn.x, y: turn.y, z: turn.z, w: turn.w } },
        frame: FRAME, engaged: this.closed, trigger: side?.trigger ?? 0,
        tracked: side?.tracked === true, scale: 1,
      },
    };
  }
}
