import fc from "fast-check";
import { describe, expect, it } from "vitest";
import type { AlarmFacts, AlarmKind } from "../../src/alarms/alarm";
import { askingUs, tiltOf } from "../../src/alarms/alarm_facts";
import { alarmsOf } from "../../src/alarms/alarm_rules";
import { colourOf, LINK_THRESHOLDS, linkWord } from "../../src/alarms/link_grade";
import type { LinkStatistics } from "../../src/robot/robot_state";
import type { ControlState, Session } from "../../src/values";

const degrees = Math.PI / 180;

const WELL: AlarmFacts = {
  connected: true, connectionWords: "", wasConnected: true, silence: 40, health: "tracking", reasons: [],
  estop: false, estopReason: "", tilt: 0.01, link: "good", linkWords: "", asking: undefined,
};

function kinds(facts: Partial<AlarmFacts>, active: AlarmKind[] = []): string[] {
  return alarmsOf({ ...WELL, ...facts }, new Set(active)).map(({ kind, severity }) => `${severity} ${kind}`);
}

describe("alarms", () => {
  it("are none while all is well, and none before anything is known", () => {
    expect(kinds({})).toEqual([]);
    expect(kinds({
      connected: false, wasConnected: false, silence: undefined, health: undefined, tilt: undefined, link: "unknown",
    })).toEqual([]);
  });

  it.each<[string, Partial<AlarmFacts>, string[]]>([
    ["lost", { health: "lost" }, ["alarm lost"]],
    ["in doubt", { health: "suspect" }, ["warning suspect"]],
    ["searching", { health: "relocalising" }, ["info searching"]],
    ["e-stop", { estop: true }, ["alarm estop"]],
    ["silence of 0.5 s", { silence: 500 }, []],
    ["more silence", { silence: 501 }, ["alarm stale"]],
    ["no connection", { connected: false, silence: 9000, link: "lost" }, ["alarm connection"]],
    ["a bad link", { link: "bad" }, ["warning link"]],
    ["a slow link", { link: "slow" }, []],
    ["somebody asks", { asking: "anna" }, ["info asking"]],
    ["a slope", { tilt: 7.9 * degrees }, []],
    ["a steep slope", { tilt: 8.1 * degrees }, ["warning tilt"]],
    ["tipping over", { tilt: 15.1 * degrees }, ["alarm tipping"]],
    ["several", { health: "suspect", asking: "anna", estop: true }, ["alarm estop", "warning suspect", "info asking"]],
  ])("of %s", (_, facts, expected) => {
    expect(kinds(facts)).toEqual(expected);
  });

  it("of tilt end a degree below where they began", () => {
    expect(kinds({ tilt: 7.5 * degrees }, ["tilt"])).toEqual(["warning tilt"]);
    expect(kinds({ tilt: 6.9 * degrees }, ["tilt"])).toEqual([]);
    expect(kinds({ tilt: 14.5 * degrees }, ["tipping"])).toEqual(["alarm tipping"]);
  });

  it("give the reason in words", () => {
    const words = (facts: Partial<AlarmFacts>): string => alarmsOf({ ...WELL, ...facts })[0]?.words ?? "";
    expect(words({ estop: true, estopReason: "pressed by client 3" })).toContain("pressed by client 3");
    expect(words({ health: "lost", reasons: ["the map explains only 41 %"] })).toContain("the map explains only 41 %");
    expect(words({ connected: false, connectionWords: "Nothing answers there." })).toBe("Nothing answers there.");
    expect(words({ silence: 1234 })).toContain("1.2 s");
  });
});

describe("tilt", () => {
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
  const control: ControlState = {
    stamp: 1, state: "armed", reason: "", controller: "client 4 (127.0.0.1:53284)", armed: true, estop: false, commandAge: 0,
    linear: 0, angular: 0, linkAge: 0, slowAbove: 0.5, refuseAbove: 1, asking: 7, askingName: "anna",
  };
  const session: Session = {
    client: 4, name: "client 4 (127.0.0.1:53284)", role: "", tokens: false,
    mayDrive: true, mayStop: true, mayReset: true, mayHint: true, maySearch: true, mayTakeOver: true,
  };

  it("is told to the one who drives", () => {
    expect(askingUs(control, session)).toBe("anna");
    expect(askingUs({ ...control, askingName: "" }, session)).toBe("client 7");
    expect(askingUs({ ...control, controller: "anna (client 4)" }, session)).toBe("anna");
  });

  it("is not told to others, nor when nobody asks", () => {
    expect(askingUs(control, { ...session, client: 9, name: "client 9" })).toBeUndefined();
    expect(askingUs({ ...control, controller: "client 40" }, { ...session, name: "me" })).toBeUndefined();
    expect(askingUs({ ...control, asking: 0 }, session)).toBeUndefined();
    expect(askingUs(undefined, session)).toBeUndefined();
  });
});

describe("the link", () => {
  const link: LinkStatistics = {
    roundTrip: 20, roundTripP95: 40, jitter: 5, bytesPerSecond: 1e5, silence: 30, streams: [],
  };

  it("is one word by its worst figure", () => {
    expect(linkWord(true, link)).toBe("good");
    expect(linkWord(true, { ...link, roundTripP95: 250 })).toBe("slow");
    expect(linkWord(true, { ...link, roundTripP95: 900 })).toBe("slow");
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
