import { describe, expect, it } from "vitest";
import { eventsAsText, EventLog, LONGEST_WORDS, MOST_EVENTS, withEvent } from "../../../src/panels/events/event_log";
import type { ConsoleEvent } from "../../../src/values";

const at = (second: number): Date => new Date(Date.UTC(2030, 0, 1, 12, 0, second));

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
