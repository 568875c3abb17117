/** What is wrong with messages, reported so that a stream of bad ones does not fill the event list. */

/** Until a complaint that goes on is reported again [ms]. */
export const REPEAT_AFTER = 30_000;
/** Kinds of complaints that are told apart. */
const MOST_KINDS = 200;

interface Kind {
  reportedAt: number;
  since: number;
}

/** Reports each kind of complaint at once, and then how often it came, twice a minute at most. */
export class Complaints {
  readonly #kinds = new Map<string, Kind>();
  readonly #report: (source: string, complaint: string, repeated: number) => void;
  readonly #now: () => number;

  constructor(report: (source: string, complaint: string, repeated: number) => void, now: () => number) {
    this.#report = report;
    this.#now = now;
  }

  add(source: string, complaint: string): void {
    // The same field of another item of a list is the same complaint.
    const key = `${source}: ${complaint.replace(/\[\d+\]/g, "[]")}`;
    const now = this.#now();
    const kind = this.#kinds.get(key);
    if (kind === undefined) {
      if (this.#kinds.size < MOST_KINDS) {
        this.#kinds.set(key, { reportedAt: now, since: 0 });
        this.#report(source, complaint, 0);
      }
      return;
    }
    kind.since += 1;
    if (now - kind.reportedAt >= REPEAT_AFTER) {
      this.#report(source, complaint, kind.since);
      kind.reportedAt = now;
      kind.since = 0;
    }
  }
}
