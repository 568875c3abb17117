import { describe, expect, it } from "vitest";
import { eventsAsText, EventLog, LONGEST_WORDS, MOST_EVENTS, withEvent } from "../../../src/panels/events/event_log";
import type { ConsoleEvent } from "../../../src/values";

const at = (second: number): Date => new Date(Date.UTC(2030, 0, 1, 12, 0, second));

describe("an alarm that comes and goes", () => {
  const alarm = { kind: "stale", severity: "alarm" as const, words: "Nothing received" };

  it("is one event, with how often it began and how long it lasted, whatever else happened between", () => {
    const log = new EventLog(() => now);
    let now = at(0);
    for (const second of [10, 20, 30]) {
      now = at(second);
      log.alarm({ ...alarm, words: `Nothing received for 0.${second} s` }, false);
      log.add("info", `other ${second}`);
      now = at(second + 2);
      log.alarm(alarm, true);
    }
    const folded = log.events.value.filter((event) => event.alarm !== undefined);
    expect(folded).toHaveLength(1);
    expect(folded[0]).toMatchObject({ words: "Nothing received for 0.30 s", count: 3, time: at(30), alarm: { active: false, lasted: 6 } });
    expect(log.events.value).toHaveLength(4);
    expect(eventsAsText(folded)).toContain("(3x) (over, 6.0 s in all)");
  });

  it("is another event after a quarter of an hour, and beside one of another kind", () => {
    const log = new EventLog(() => now);
    let now = at(0);
    log.alarm(alarm, false);
    log.alarm({ ...alarm, kind: "lost" }, false);
    log.alarm(alarm, true);
    now = at(900);
    log.alarm(alarm, false);
    expect(log.events.value.map((event) => event.alarm?.kind)).toEqual(["stale", "lost", "stale"]);
  });
});

describe("the event log", () => {
  it("counts repetitions in a row, with the time of the last", () => {
    let events: readonly ConsoleEvent[] = [];
    for (const [second, words] of [[1, "a"], [2, "a"], [3, "b"], [4, "a"]] as const) {
      events = withEvent(events, "info", words, at(second));
    }
    expect(events.map(({ words, count }) => `${words}${count}`)).toEqual(["a2", "b1", "a1"]);
    expect(events[0]?.time).toEqual(at(2));
  });

  it("tells severities apart", () => {
    const events = withEvent(withEvent([], "info", "a", at(1)), "alarm", "a", at(2));
    expect(events).toHaveLength(2);
  });

  it("keeps the newest 500", () => {
    const log = new EventLog(() => at(0));
    for (let i = 0; i < MOST_EVENTS + 20; i += 1) {
      log.add("info", `event ${i}`);
    }
    expect(log.events.value).toHaveLength(MOST_EVENTS);
    expect(log.events.value.at(-1)?.words).toBe(`event ${MOST_EVENTS + 19}`);
    expect(log.events.value[0]?.words).toBe("event 20");
  });

  it("cuts sentences of any length", () => {
    const [event] = withEvent([], "info", "x".repeat(1e6), at(1));
    expect(event?.words.length).toBe(LONGEST_WORDS + 1);
  });

  it("becomes text with whole times", () => {
    const events = withEvent(withEvent([], "warning", "slow", at(1)), "warning", "slow", at(2));
    expect(eventsAsText(events)).toBe("2030-01-01T12:00:02.000Z warning slow (2x)");
  });
});
