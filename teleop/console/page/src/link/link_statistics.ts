/** How good the connection is, from times at which things happened; times are [ms] of any steady clock. */

import type { LinkStatistics } from "../robot/robot_state";
import type { LinkParts } from "./link_parts";
import { HopRecorder, type LinkAnswer, type Seen } from "./hops";
import { SlidingSum } from "./sliding_sum";

/** Round trips are judged over the last minute. */
const ROUND_TRIP_WINDOW = 60_000;
/** Rates are of the last five seconds. */
const RATE_WINDOW = 5000;
/** Questions without an answer that are kept. */
const MOST_PENDING = 120;

interface RoundTrip {
  readonly at: number;
  readonly took: number;
}

interface StreamRecord {
  readonly count: SlidingSum;
  newest: number;
}

/** The topic whose way to the page is shown: what people steer by. */
export const WAY_TOPIC = "/amcl_pose";

export class LinkRecorder {
  readonly #hops = new HopRecorder();
  #seen: Seen | undefined;
  #roundTrips: RoundTrip[] = [];
  #pending: number[] = [];
  #bytes = new SlidingSum(RATE_WINDOW);
  readonly #streams = new Map<string, StreamRecord>();
  #dropped: ReadonlyMap<string, number> = new Map();
  #since: number;
  #ticks: { readonly at: number; readonly late: number }[] = [];

  constructor(now: number) {
    this.#since = now;
  }

  /** Begin anew with a new connection: its rates, and no question waits; round trips stay. */
  reset(now: number): void {
    this.#since = now;
    this.#pending = [];
    this.#bytes = new SlidingSum(RATE_WINDOW);
    this.#dropped = new Map();
    this.#streams.clear();
    this.#hops.reset();
    this.#seen = undefined;
  }

  /** A question was sent. */
  asked(now: number): void {
    this.#pending.push(now);
    this.#pending = this.#pending.slice(-MOST_PENDING);
  }

  /** A question of `askedAt` was answered. */
  answered(askedAt: number, now: number): void {
    this.#pending = this.#pending.filter((at) => at !== askedAt);
    this.#roundTrips.push({ at: now, took: now - askedAt });
    this.#roundTrips = this.#roundTrips.filter(({ at }) => now - at <= ROUND_TRIP_WINDOW);
  }

  /** What is due every `period` ms was done: as late as that, the page comes to all that arrives. */
  ticked(period: number, now: number): void {
    const last = this.#ticks.at(-1);
    this.#ticks = this.#ticks.filter(({ at }) => now - at <= RATE_WINDOW);
    this.#ticks.push({ at: now, late: last === undefined ? 0 : Math.max(0, now - last.at - period) });
  }

  frame(bytes: number, now: number): void {
    this.#bytes.add(bytes, now);
  }

  message(topic: string, now: number): void {
    let record = this.#streams.get(topic);
    if (record === undefined) {
      record = { count: new SlidingSum(RATE_WINDOW), newest: now };
      this.#streams.set(topic, record);
    }
    record.count.add(1, now);
    record.newest = now;
  }

  /** A message came, with its stamp [s]; of the topic whose way is shown, the next frame shows it. */
  saw(topic: string, stamp: number, parts: Pick<LinkParts, "now" | "nextFrame">): void {
    if (topic !== WAY_TOPIC) {
      return;
    }
    const cameAt = parts.now();
    this.#seen = { stamp, cameAt, drawn: this.#seen?.drawn };
    parts.nextFrame(() => {
      if (this.#seen !== undefined) {
        this.#seen = { ...this.#seen, drawn: parts.now() - cameAt };
      }
    });
  }

  /** The robot said what it left out, and what of the way it knows. */
  counted(answer: LinkAnswer, askedAt: number, now: number): void {
    this.#dropped = new Map([...answer.topics].map(([topic, { dropped }]) => [topic, dropped]));
    this.#hops.answered(answer, askedAt, now, WAY_TOPIC, this.#seen, this.#meanLag);
  }

  get #meanLag(): number {
    return this.#ticks.reduce((sum, { late }) => sum + late, 0) / Math.max(1, this.#ticks.length);
  }

  /**
   * @param topics What the page listens to.
   * @param silence Since the last frame [ms].
   */
  snapshot(topics: readonly string[], silence: number, now: number): LinkStatistics {
    const trips = this.#roundTrips.filter(({ at }) => now - at <= ROUND_TRIP_WINDOW).map(({ took }) => took);
    const last = trips.at(-1);
    const overdue = this.#pending[0] === undefined ? 0 : now - this.#pending[0];
    return {
      // A question that waits for longer than the last took is the better figure.
      roundTrip: last === undefined ? (overdue > 0 ? overdue : undefined) : Math.max(last, overdue),
      roundTripP95: percentile(trips, 0.95),
      jitter: meanDifference(trips),
      pageLag: percentile(this.#ticks.map(({ late }) => late), 0.95) ?? 0,
      hops: this.#hops.hops,
      bytesPerSecond: this.#bytes.rate(now, this.#since),
      silence,
      streams: topics.map((topic) => {
        const record = this.#streams.get(topic);
        return {
          topic,
          age: record === undefined ? undefined : now - record.newest,
          rate: record?.count.rate(now, this.#since) ?? 0,
          dropped: this.#dropped.get(topic) ?? 0,
        };
      }),
    };
  }
}

/** Smallest value that is not below a share of all; undefined of none. */
export function percentile(values: readonly number[], share: number): number | undefined {
  const sorted = [...values].sort((a, b) => a - b);
  return sorted[Math.max(0, Math.ceil(share * sorted.length) - 1)];
}

function meanDifference(values: readonly number[]): number | undefined {
  if (values.length < 2) {
    return undefined;
  }
  let sum = 0;
  for (let i = 1; i < values.length; i++) {
    sum += Math.abs((values[i] ?? 0) - (values[i - 1] ?? 0));
  }
  return sum / (values.length - 1);
}
