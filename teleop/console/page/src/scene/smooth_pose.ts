/** The robot's pose as it is drawn: it glides from report to report, and leaps where the robot was found elsewhere. */

import { Quaternion, Vector3 } from "three";
import type { Pose } from "../values";
import { approach, headingOf } from "./geometry";

/** Time of gliding [ms]: about a report of 10 per second late, which no eye sees as a jerk. */
const TIME = 60;
const LEAP = 1;
/** Nearer than this [m, rad] is arrived. */
const ARRIVED = 1e-3;

export class SmoothPose {
  readonly position = new Vector3();
  readonly orientation = new Quaternion();
  readonly #goal = { position: new Vector3(), orientation: new Quaternion() };
  #known = false;

  get known(): boolean {
    return this.#known;
  }

  /** Heading of what is drawn [rad]. */
  get heading(): number {
    return headingOf(this.orientation);
  }

  /** Set where to go; `atOnce` without gliding. */
  set(pose: Pose | undefined, atOnce: boolean): void {
    if (pose === undefined) {
      this.#known = false;
      return;
    }
    const { position: at, orientation: turned } = pose;
    this.#goal.position.set(at.x, at.y, at.z);
    this.#goal.orientation.set(turned.x, turned.y, turned.z, turned.w).normalize();
    if (atOnce || !this.#known || this.position.distanceTo(this.#goal.position) > LEAP) {
      this.position.copy(this.#goal.position);
      this.orientation.copy(this.#goal.orientation);
    }
    this.#known = true;
  }

  /** Glide on for so many ms; true while not yet there. */
  advance(elapsed: number): boolean {
    const left = this.position.distanceTo(this.#goal.position) + this.orientation.angleTo(this.#goal.orientation);
    if (!this.#known || left === 0) {
      return false;
    }
    const share = left < ARRIVED ? 1 : approach(elapsed, TIME);
    this.position.lerp(this.#goal.position, share);
    this.orientation.slerp(this.#goal.orientation, share);
    return share < 1;
  }
}
