/** The stream of wishes: one at rest first, motion, three at rest at the end, then silence. */

import { atRest, type ArmWish } from "./arm_wish";

/** Time between two wishes [ms]: of a hand, whose way between them is lost, and of what goes on by itself. */
const PERIODS = { hand: 20, jog: 50, twist: 50, plan: 100 } as const;
/** Time for which the beginning rests [ms]: of wishes in one tick of the robot only the newest counts. */
const BEGINNING = 60;
/** Time between two that rest at the end [ms]. */
const ENDING = 40;
const LAST = 3;
/** A wish is due this much before its period is over [ms]: half the time to the next look. */
const EARLY = 8;

export class ArmStream {
  #phase: "silent" | "beginning" | "moving" | "ending" = "silent";
  #kind: ArmWish["kind"] | undefined;
  #last: ArmWish | undefined;
  #sentAt = 0;
  #left = 0;

  /** @param send Sends a wish; false if it cannot be sent now. */
  constructor(private readonly send: (wish: ArmWish) => boolean) {}

  /** Whether the robot may still think that something is held. */
  get flowing(): boolean {
    return this.#phase === "beginning" || this.#phase === "moving";
  }

  /** Send what is due; false if that could not be sent. @param wish What is held; undefined if nothing is. */
  step(now: number, wish: ArmWish | undefined): boolean {
    if (wish === undefined || (this.flowing && wish.kind !== this.#kind)) {
      return this.#rest(now);
    }
    if (!this.flowing) {
      if (this.#phase === "ending" && wish.kind !== this.#kind) {
        this.#phase = "silent";
      }
      return this.begin(now, wish);
    }
    const wait = this.#phase === "beginning" ? BEGINNING : PERIODS[wish.kind] - EARLY;
    if (now - this.#sentAt < wait) {
      return true;
    }
    this.#phase = "moving";
    return this.#sent(now, wish);
  }

  /** Begin, or begin again, with a wish at rest: the robot wants to see one before it moves. */
  begin(now: number, wish: ArmWish): boolean {
    this.#phase = "beginning";
    this.#kind = wish.kind;
    return this.#sent(now, atRest(wish));
  }

  #rest(now: number): boolean {
    if (this.#phase === "silent" || this.#last === undefined) {
      return true;
    }
    const first = this.#phase !== "ending";
    if (first) {
      this.#phase = "ending";
      this.#left = LAST;
    } else if (now - this.#sentAt < ENDING) {
      return true;
    }
    const sent = this.#sent(now, atRest(this.#last));
    this.#left -= Number(sent); // one that cannot be sent is sent as soon as it can
    if (this.#left === 0) {
      this.#phase = "silent";
    }
    return sent || !first;
  }

  #sent(now: number, wish: ArmWish): boolean {
    this.#last = wish;
    this.#sentAt = now;
    return this.send(wish);
  }
}
