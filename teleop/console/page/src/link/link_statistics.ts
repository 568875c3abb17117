/** How good the connection is, from times at which things happened; times are [ms] of any steady clock. */

import type { LinkStatistics } from "../robot/robot_state";

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

interface Arrival {
  readonly at: number;
  readonly bytes: number;
}

export class LinkRecorder {
  #roundTrips: RoundTrip[] = [];
  #pending: number[] = [];
  #frames: Arrival[] = [];
  readonly #streams = new Map<string, number[]>();
  #dropped: ReadonlyMap<string, number> = new Map();
  #since: number;

  constructor(now: number) {
    this.#since = now;
  }

  /** Begin anew with a new connection: its rates, and no question waits; round trips stay. */
  reset(now: number): void {
    this.#since = now;
    this.#pending = [];
    this.#frames = [];
    this.#dropped = new Map();
    this.#streams.clear();
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

  frame(bytes: number, now: number): void {
    this.#frames.push({ at: now, bytes });
    if (this.#frames.length > 2000) {
      this.#frames = recent(this.#frames, now);
    }
  }

  message(topic: string, now: number): void {
    const times = this.#streams.get(topic) ?? [];
    times.push(now);
    // Old times are of no use but for the last, which gives the stream's age.
    this.#streams.set(topic, times.length > 1000 ? times.slice(-500) : times);
  }

  dropped(dropped: ReadonlyMap<string, number>): void {
    this.#dropped = dropped;
  }

  /**
   * @param topics What the page listens to.
   * @param silence Since the last frame [ms].
   */
  snapshot(topics: readonly string[], silence: number, now: number): LinkStatistics {
    this.#frames = recent(this.#frames, now);
    const trips = this.#roundTrips.filter(({ at }) => now - at <= ROUND_TRIP_WINDOW).map(({ took }) => took);
    const last = trips.at(-1);
    const overdue = this.#pending[0] === undefined ? 0 : now - this.#pending[0];
    const window = Math.max(1, Math.min(RATE_WINDOW, now - this.#since));
    const bytes = this.#frames.reduce((sum, frame) => sum + frame.bytes, 0);
    return {
      // A question that waits for longer than the last took is the better figure.
      roundTrip: last === undefined ? (overdue > 0 ? overdue : undefined) : Math.max(last, overdue),
      roundTripP95: percentile(trips, 0.95),
      jitter: meanDifference(trips),
      bytesPerSecond: (bytes * 1000) / window,
      silence,
      streams: topics.map((topic) => {
        const times = this.#streams.get(topic) ?? [];
        const newest = times.at(-1);
        return {
          topic,
          age: newest === undefined ? undefined : now - newest,
          rate: (times.filter((at) => now - at <= RATE_WINDOW).length * 1000) / window,
          dropped: this.#dropped.get(topic) ?? 0,
        };
      }),
    };
  }
}

function recent(frames: readonly Arrival[], now: number): Arrival[] {
  return frames.filter(({ at }) => now - at <= RATE_WINDOW);
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
