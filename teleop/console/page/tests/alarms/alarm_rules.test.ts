import fc from "fast-check";
import { describe, expect, it } from "vitest";
import table from "../../../../../tests/teleop/operator/alarm_cases.json";
import { alarmFacts, stopFacts, tiltFacts, tiltOf } from "../../src/alarms/alarm_facts";
import { alarmsOf } from "../../src/alarms/alarm_rules";
import { colourOf, LINK_THRESHOLDS, linkWord } from "../../src/alarms/link_grade";
import { ALARM_RULES } from "../../src/operating_data";
import { unknownState, type LinkStatistics } from "../../src/robot/robot_state";
import type { Facts } from "../../src/texts/filled";
import { CONTROL, ME, OTHER, SESSION } from "../driving/harness";

const WELL: Facts = table.well;

describe("alarms", () => {
  it.each<Case>(table.cases)("of the table that the station follows too: $name", ({ facts, active, alarms }) => {
    const found = alarmsOf(present({ ...WELL, ...facts }), new Set(active));
    expect(found.map(({ kind, severity, words }) => [severity, kind, words])).toEqual(alarms);
  });

  it("are all in that table", () => {
    const found = new Set(table.cases.flatMap(({ alarms }) => alarms.map(([, kind]) => kind)));
    expect(found).toEqual(new Set(ALARM_RULES.map(({ kind }) => kind)));
  });
});

interface Case {
  readonly name: string;
  readonly facts: Readonly<Record<string, unknown>>;
  readonly active?: string[];
  readonly alarms: string[][];
}

/** What JSON writes as null is unknown. */
function present(facts: Readonly<Record<string, unknown>>): Facts {
  return Object.fromEntries(Object.entries(facts).filter(([, value]) => value !== null)) as Facts;
}

describe("who pressed the e-stop", () => {
  it("is named, and is \"you\" for this page", () => {
    expect(stopFacts("e-stop by anna", "anna")).toEqual({ estop_by: "you" });
    expect(stopFacts("e-stop by anna", "boris")).toEqual({ estop_by: "anna" });
    expect(stopFacts("it has fallen over", "anna")).toEqual({ estop_reason: "it has fallen over" });
  });
});

describe("tilt", () => {
  it.each([[0.3, 0.1, "to the right"], [-0.3, 0.1, "to the left"], [0.1, 0.3, "nose down"], [0.1, -0.3, "nose up"]])(
    "of roll %d and pitch %d is %s", (roll, pitch, direction) => {
      expect(tiltFacts(roll, pitch)).toEqual({ tilt: expect.closeTo(18.1, 1) as number, tilt_direction: direction });
    });

  it("is that of roll and pitch together", () => {
    expect(tiltOf(0.1, 0)).toBeCloseTo(0.1);
    expect(tiltOf(0, -0.2)).toBeCloseTo(0.2);
    expect(tiltOf(NaN, 0)).toBeUndefined();
    fc.assert(fc.property(fc.double(), fc.double(), (roll, pitch) => {
      const tilt = tiltOf(roll, pitch);
      expect(tilt === undefined || (tilt >= 0 && tilt <= Math.PI)).toBe(true);
    }));
  });
});

describe("who asks for the robot", () => {
  it("is told to the one who drives, and to nobody else", () => {
    const state = unknownState();
    const asking = () => alarmFacts(state, undefined, 0, undefined, true).asking;
    state.control.value = { ...CONTROL, controller: ME, asking: 3, askingName: "anna" };
    expect(asking()).toBeUndefined();
    state.session.value = SESSION;
    expect(asking()).toBe("anna");
    state.control.value = { ...CONTROL, controller: OTHER, asking: 3, askingName: "anna" };
    expect(asking()).toBeUndefined();
    state.control.value = { ...CONTROL, controller: ME };
    expect(asking()).toBeUndefined();
  });
});

describe("the link", () => {
  const link: LinkStatistics = {
    roundTrip: 20, roundTripP95: 40, jitter: 5, pageLag: 0, bytesPerSecond: 1e5, silence: 30, streams: [], hops: [],
  };

  it("is one word by its worst figure", () => {
    expect(linkWord(true, link)).toBe("good");
    expect(linkWord(true, { ...link, roundTripP95: 250 })).toBe("slow");
    expect(linkWord(true, { ...link, roundTripP95: 900 })).toBe("slow");
    expect(linkWord(true, { ...link, jitter: 300 })).toBe("bad");
    expect(linkWord(true, { ...link, jitter: 300, pageLag: 80 })).toBe("page");
    expect(linkWord(true, { ...link, jitter: 60 })).toBe("slow");
    expect(linkWord(true, { ...link, roundTrip: 501 })).toBe("bad");
    expect(linkWord(true, { ...link, silence: 600 })).toBe("bad");
    expect(linkWord(true, { ...link, silence: 1001 })).toBe("lost");
    expect(linkWord(false, link)).toBe("lost");
    expect(linkWord(true, { ...link, roundTrip: undefined })).toBe("unknown");
  });

  it("has colours with thresholds that belong to the better one", () => {
    expect(colourOf(200, LINK_THRESHOLDS.roundTrip)).toBe("green");
    expect(colourOf(200.1, LINK_THRESHOLDS.roundTrip)).toBe("amber");
    expect(colourOf(501, LINK_THRESHOLDS.roundTrip)).toBe("red");
    expect(colourOf(NaN, LINK_THRESHOLDS.roundTrip)).toBe("unknown");
  });
});
