/**
 * Where the time between robot and page goes, as `teleop/link/hops.py` has it: parts of the way of what is seen, and of
 * a command. Times of the page are [ms] of its steady clock, those of the robot [s] of its own.
 */

import type { Hop, HopName } from "../robot/robot_state";

/** The robot's answer of `/teleop/link`. */
export interface LinkAnswer {
  readonly now: number;
  /** What a message of that time is stamped with [s]. */
  readonly stamp: number;
  /** How long the newest command waited for its tick [s]; negative if there was none. */
  readonly taken: number;
  readonly topics: ReadonlyMap<string, { readonly dropped: number; readonly made: number; readonly queued: number }>;
}

/** The newest message of a topic before an answer. */
export interface Seen {
  /** Its stamp [s]. */
  readonly stamp: number;
  readonly cameAt: number;
  /** Until the next frame was drawn [ms]; undefined if none was. */
  readonly drawn: number | undefined;
}

/** Time for which a round trip relates the clocks: clocks that differ by 100 ppm drift by 6 ms in it [ms]. */
const MEMORY = 60_000;
/** Growth within a time that makes a part worth naming [ms]. */
const GROWTH = 50;
const WINDOW = 2000;
/** From the tick that takes a command to its end, when the wheels have it [ms]. */
const TICK = 20;

export class HopRecorder {
  #trips: { readonly at: number; readonly trip: number; readonly offset: number }[] = [];
  #past: { readonly at: number; readonly hops: ReadonlyMap<HopName, number> }[] = [];
  #hops: ReadonlyMap<HopName, number> = new Map();
  #growing: HopName | undefined;

  /** A connection may be to another robot. */
  reset(): void {
    this.#trips = [];
    this.#past = [];
    this.#hops = new Map();
    this.#growing = undefined;
  }

  /**
   * Take an answer.
   *
   * @param topic The topic whose way is shown, and `seen` its newest message.
   * @param pageLag How late the page comes to what is due, on average [ms].
   */
  answered(answer: LinkAnswer, askedAt: number, cameAt: number, topic: string, seen: Seen | undefined, pageLag: number): void {
    const trip = cameAt - askedAt;
    this.#trips.push({ at: cameAt, trip, offset: 1000 * answer.now - (askedAt + trip / 2) });
    this.#trips = this.#trips.filter(({ at }) => at >= cameAt - MEMORY);
    const offset = this.#trips.reduce((best, each) => (each.trip < best.trip ? each : best)).offset;
    const hops = new Map<HopName, number>();
    const sent = answer.topics.get(topic);
    if (seen !== undefined && sent !== undefined && sent.made >= 0 && sent.queued >= 0) {
      const [made, queued] = [1000 * sent.made, 1000 * sent.queued];
      const age = seen.cameAt + offset - 1000 * (seen.stamp + answer.now - answer.stamp);
      // A page that is late takes messages late, too: no browser says when they came.
      const page = Math.max(0, Math.min(pageLag, age - made - queued));
      hops.set("robot", made).set("queue", queued).set("wireDown", age - made - queued - page).set("page", page);
      if (seen.drawn !== undefined) {
        hops.set("drawn", seen.drawn);
      }
    }
    hops.set("hand", pageLag).set("wireUp", 1000 * answer.now - (askedAt + offset));
    if (answer.taken >= 0) {
      hops.set("gateway", 1000 * answer.taken).set("control", TICK);
    }
    this.#hops = hops;
    this.#past = [...this.#past.filter(({ at }) => at >= cameAt - WINDOW), { at: cameAt, hops }];
    this.#growing = grown(this.#past.map((each) => each.hops));
  }

  get hops(): readonly Hop[] {
    return [...this.#hops].map(([name, took]) => ({ name, took: Math.max(0, took), grows: name === this.#growing }));
  }
}

/** The part that has grown most, if it has grown enough; one that is late once does not grow. */
function grown(past: readonly ReadonlyMap<HopName, number>[]): HopName | undefined {
  const [before, last, now] = [past[0], past.at(-2), past.at(-1)];
  let most = GROWTH;
  let found: HopName | undefined;
  for (const [name, took] of now ?? []) {
    const growth = Math.min(took, last?.get(name) ?? 0) - (before?.get(name) ?? took);
    if (growth >= most) {
      most = growth;
      found = name;
    }
  }
  return found;
}
