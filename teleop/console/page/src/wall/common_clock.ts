/** The moment of the robot that all screens of a wall show together, by the robot's own stamps. */

import { Quaternion, Vector3 } from "three";
import type { StampedPose } from "../values";

/** What is shown is so old [s]: three poses at 20 per second, or a pose and a slow link. Chosen. */
export const SHOWN_AGE = 0.15;
/** Poses that are kept: more than come within that time. */
const KEPT = 20;
/**
 * Messages and round trips that are looked back on [ms]; the quickest of them are right. A simulated robot that loses time
 * is followed within the first.
 */
const WINDOWS = { message: 2000, roundTrip: 10_000 };

/** The robot's clock, from stamps of messages that come late by a part of a round trip. */
export class CommonClock {
  readonly #offsets = new Least(WINDOWS.message);
  readonly #roundTrips = new Least(WINDOWS.roundTrip);

  /** A message with this stamp [s] has come now [ms]. */
  received(stamp: number, now: number): void {
    this.#offsets.add(now - 1000 * stamp, now);
  }

  /** The robot has answered after so many ms. */
  answered(roundTrip: number, now: number): void {
    this.#roundTrips.add(roundTrip, now);
  }

  /** The stamp to be shown now [s]; undefined until a message and an answer have come. */
  stamp(now: number): number | undefined {
    const [offset, roundTrip] = [this.#offsets.least, this.#roundTrips.least];
    // The quickest message was half of the quickest round trip under way.
    return offset === undefined || roundTrip === undefined ? undefined : (now - offset + roundTrip / 2) / 1000 - SHOWN_AGE;
  }
}

/** The least of the values of the last so many ms. */
class Least {
  #values: { readonly value: number; readonly at: number }[] = [];

  constructor(private readonly window: number) {}

  add(value: number, now: number): void {
    // What is older and no less is never the least again.
    this.#values = [...this.#values.filter((kept) => now - kept.at < this.window && kept.value < value), { value, at: now }];
  }

  get least(): number | undefined {
    return this.#values[0]?.value;
  }
}

/** The newest poses, to be read at a stamp between two of them. */
export class StampedPoses {
  readonly position = new Vector3();
  readonly orientation = new Quaternion();
  #poses: StampedPose[] = [];
  readonly #next = { position: new Vector3(), orientation: new Quaternion() };

  add(pose: StampedPose): void {
    const last = this.#poses.at(-1);
    this.#poses = last !== undefined && pose.stamp < last.stamp ? [pose] : [...this.#poses.slice(-KEPT + 1), pose];
  }

  /** Put `position` and `orientation` to a stamp [s]; false if no pose is known, or it is later than all. */
  moveTo(stamp: number): boolean {
    const after = this.#poses.findIndex((pose) => pose.stamp > stamp);
    const [before, next] = [this.#poses[(after < 0 ? this.#poses.length : after) - 1], this.#poses[after]];
    const from = before ?? next;
    if (from === undefined) {
      return false;
    }
    set(this, from);
    if (before !== undefined && next !== undefined) {
      set(this.#next, next);
      const share = (stamp - before.stamp) / (next.stamp - before.stamp);
      this.position.lerp(this.#next.position, share);
      this.orientation.slerp(this.#next.orientation, share);
    }
    return next !== undefined;
  }
}

function set(to: { readonly position: Vector3; readonly orientation: Quaternion }, { position: p, orientation: q }: StampedPose): void {
  to.position.set(p.x, p.y, p.z);
  to.orientation.set(q.x, q.y, q.z, q.w);
}
