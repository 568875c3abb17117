import { describe, expect, it } from "vitest";
import type { Alarm } from "../../src/alarms/alarm";
import { AlarmBell, alarmEdges, QUIET } from "../../src/alarms/alarm_edges";
import { TONES } from "../../src/alarms/alarm_sound";

const alarm = (kind: string, severity: Alarm["severity"], words = ""): Alarm => ({ kind, severity, words });
const lost = alarm("lost", "alarm");
const suspect = alarm("suspect", "warning");
const tipping = alarm("tipping", "alarm");

describe("edges", () => {
  it("are what began and what ended, whatever the words", () => {
    expect(alarmEdges([suspect], [lost])).toEqual({ raised: [lost], ended: [suspect] });
    expect(alarmEdges([alarm("stale", "alarm", "0.6 s")], [alarm("stale", "alarm", "0.7 s")])).toEqual({ raised: [], ended: [] });
  });
});

describe("the bell", () => {
  const ring = (bell: AlarmBell, before: Alarm[], after: Alarm[], now: number) =>
    bell.due(alarmEdges(before, after), after, now);

  it("sounds the gravest of those that begin, once", () => {
    const bell = new AlarmBell();
    expect(ring(bell, [], [suspect, lost], 0)).toBe("alarm");
    expect(ring(bell, [suspect, lost], [suspect, lost], 100)).toBeUndefined();
    expect(ring(bell, [lost], [lost, suspect], QUIET + 100)).toBe("warning");
  });

  it("sounds one that comes and goes only now and then", () => {
    const bell = new AlarmBell();
    expect(ring(bell, [], [suspect], 0)).toBe("warning");
    expect(ring(bell, [suspect], [], 100)).toBeUndefined();
    expect(ring(bell, [], [suspect], 200)).toBeUndefined();
    expect(ring(bell, [], [suspect], QUIET)).toBe("warning");
  });

  it("repeats what must be acted upon while it lasts", () => {
    const bell = new AlarmBell();
    expect(ring(bell, [], [tipping], 0)).toBe("alarm");
    expect(ring(bell, [tipping], [tipping], 1000)).toBeUndefined();
    expect(ring(bell, [tipping], [tipping], 1500)).toBe("alarm");
  });
});

describe("tones", () => {
  it("are distinct for each severity and short", () => {
    expect(new Set(Object.values(TONES).map((tones) => tones.length)).size).toBe(3);
    for (const { begin, length } of Object.values(TONES).flat()) {
      expect(begin + length).toBeLessThan(1);
    }
  });
});
