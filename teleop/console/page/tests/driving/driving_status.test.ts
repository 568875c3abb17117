import { describe, expect, it } from "vitest";
import type { RobotView } from "../../src/driving/blockage";
import { drivingStatus, type OwnInput } from "../../src/driving/driving_status";
import { inOurWords } from "../../src/driving/robot_reasons";
import type { ControlState, Session } from "../../src/values";
import { CONTROL, ME, OTHER, SESSION } from "./harness";

const OWN: OwnInput = {
  driving: false, held: false, centring: false, noDeadman: false, unmapped: false, focused: true, elsewhere: false, thumbs: false, moving: false, stopped: undefined,
};

interface Case {
  readonly control?: Partial<ControlState>;
  readonly session?: Partial<Session>;
  readonly own?: Partial<OwnInput>;
  readonly view?: Partial<RobotView>;
}

function statusOf({ control, session, own, view }: Case) {
  return drivingStatus({
    connection: { phase: "open", words: "", sinceAt: 0 },
    dialect: "farsteer",
    session: { ...SESSION, ...session },
    control: { ...CONTROL, ...control },
    controlAge: 50,
    plainConfirmed: false,
    ...view,
  }, { ...OWN, ...own });
}

const MINE = { state: "armed", armed: true, controller: ME, reason: "driving" } as const;

describe("the driving status", () => {
  const table: readonly (readonly [string, Case, boolean, RegExp, RegExp])[] = [
    ["no connection yet", { view: { connection: { phase: "connecting", words: "", sinceAt: 0 } } }, false, /not connected/i, /by itself/],
    ["a lost connection", { view: { connection: { phase: "lost", words: "", sinceAt: 0 } } }, false, /connection is lost/, /press again/],
    ["the link's own way out", { view: { connection: { phase: "refused", words: "Log in first.", sinceAt: 0 } } }, false, /refuses/, /Log in first/],
    ["no answer yet", { view: { dialect: "unknown" } }, false, /first answer/, /moment/],
    ["a plain robot", { view: { dialect: "plain", control: undefined } }, false, /Nothing guards/, /Confirm/],
    ["a plain robot that was stopped", { view: { dialect: "plain", control: undefined }, own: { stopped: "Stopped: zero." } }, false, /^Stopped: zero/, /Confirm/],
    ["a plain robot, confirmed", { view: { dialect: "plain", control: undefined, plainConfirmed: true } }, true, /Nothing there guards/, /Hold/],
    ["driving a plain robot", { view: { dialect: "plain", control: undefined, plainConfirmed: true }, own: { driving: true } }, true, /You drive/, /^$/],
    ["another's e-stop", { control: { state: "estop", estop: true, reason: `e-stop by ${OTHER}` } }, false, /pressed by client 3/, /Release/],
    ["my own e-stop", { control: { state: "estop", estop: true, reason: `e-stop by ${ME}` } }, false, /pressed by you/, /Release/],
    ["an e-stop that I may not reset", { control: { estop: true, reason: "?" }, session: { mayReset: false } }, false, /unknown/, /Somebody/],
    ["a viewer", { session: { mayDrive: false } }, false, /may only watch/, /token/],
    ["no state of the robot", { view: { control: undefined } }, false, /who drives/, /moment/],
    ["an old state of the robot", { view: { controlAge: 2500 } }, false, /nothing for 2\.5 s/, /Wait/],
    ["another driver", { control: { ...MINE, controller: OTHER } }, false, /client 3 .* drives/, /Ask for the robot, or take it over/],
    ["another driver, whom I may only ask", { control: { ...MINE, controller: OTHER }, session: { mayTakeOver: false, mayShare: false, link: false, mayPlay: false } }, false, /drives/, /^Ask for the robot\.$/],
    ["another driver, already asked by somebody else",
      { control: { ...MINE, controller: OTHER, asking: 9 }, session: { mayTakeOver: false, mayShare: false, link: false, mayPlay: false } }, false, /drives/, /Wait/],
    ["another window with the keys", { own: { focused: false } }, false, /Another window/, /Click/],
    ["keys that place a hint or move the arm", { own: { elsewhere: true } }, true, /Ready/, /elsewhere/],
    ["keys that are still held", { own: { held: true, stopped: "Stopped: the tab was hidden." } }, false, /tab was hidden/, /Let go/],
    ["keys that were pressed in vain", { own: { held: true } }, false, /does not count/, /Let go/],
    ["a stick that was pushed first", { own: { driving: true, centring: true } }, false, /before its deadman/, /Let go of the stick/],
    ["a stick without deadman", { own: { noDeadman: true } }, false, /deadman button is not held/, /LB/],
    ["a gamepad without mapping", { own: { unmapped: true } }, true, /unknown kind/, /Gamepads/],
    ["a tab that was hidden", { own: { stopped: "Stopped: the tab was hidden." } }, true, /tab was hidden/, /Press again/],
    ["late commands", { control: { ...MINE, linkAge: 0.7 }, own: { driving: true } }, true, /0\.7 s late.*slower/, /lean/],
    ["commands that are too late", { control: { ...MINE, linkAge: 1.2 } }, false, /1\.2 s late.*refuses/, /Let go/],
    ["the guard that slows down", { control: { ...MINE, guard: "slowed", guardReason: "0.3 m/s: obstacle 0.9 m ahead" }, own: { driving: true } }, true, /^Guard: 0\.3 m\/s: obstacle 0\.9 m ahead\.$/, /^$/],
    ["limits that are switched off", { control: { ...MINE, linkAge: 9, slowAbove: 0, refuseAbove: 0 }, own: { driving: true } }, true, /You drive/, /^$/],
    ["driving", { control: MINE, own: { driving: true } }, true, /You drive/, /^$/],
    ["a robot that arms", { own: { driving: true } }, true, /gets ready/, /Hold on/],
    ["the watchdog, after letting go", { control: { state: "disarmed", controller: ME, reason: "no command for 0.500 s" } }, true, /is yours/, /Hold/],
    ["a robot that stopped listening", { control: { state: "disarmed", controller: ME, reason: "commands arrive 1.2 s late, and 1 s is the limit: x" } },
      true, /commands arrived 1\.2 s late/, /Hold/],
    ["a robot that is mine", { control: MINE }, true, /is yours/, /Hold/],
    ["a step that the robot drives", { control: MINE, own: { moving: true } }, true, /by itself/, /Space/],
    ["a free robot", {}, true, /Ready/, /Hold/],
    ["a robot that offers no session", { view: { session: undefined }, control: { ...MINE, controller: OTHER } }, true, /Ready/, /Hold/],
  ];
  it.each<readonly [string, Case]>([
    ["at rest", {}], ["that is mine", { control: MINE }], ["after a stop", { own: { stopped: "Stopped: the tab was hidden." } }],
    ["that is held", { own: { held: true } }], ["without the focus", { own: { focused: false } }], ["with keys elsewhere", { own: { elsewhere: true } }],
    ["on a step", { control: MINE, own: { moving: true } }],
  ])("speaks of no key to thumbs, with a robot %s", (_, given) => {
    const { remedy } = statusOf({ ...given, own: { ...given.own, thumbs: true } });
    expect(remedy).not.toBe("");
    expect(remedy).not.toMatch(/key|W A S D|gamepad|click|press|space/i);
  });

  it.each(table)("says why and what to do: %s", (_, given, will, words, remedy) => {
    const status = statusOf(given);
    expect(status.words).toMatch(words);
    expect(status.remedy).toMatch(remedy);
    expect(status.will).toBe(will);
  });
});

describe("the robot's reasons", () => {
  // Every reason and refusal that teleop/robot/safety can give.
  it.each([
    ["no driver yet", /nobody/],
    ["neutral", /at rest/],
    ["driving", /drives/],
    ["driving slowly, for commands arrive late", /slowly/],
    ["send a neutral stick first", /let go of the stick/],
    ["send a zero velocity first", /zero velocity/],
    ["no command for too long: send a zero velocity, or pause for a second, before driving on", /zero velocity/],
    ["the server does not answer", /started again/],
    ["the server has ended", /started again/],
    [`e-stop by ${OTHER}`, /^e-stop by client 3/],
    [`e-stop by ${ME} is latched; reset it first`, /^e-stop by you$/],
    [`e-stop reset by ${ME}`, /released by you/],
    ["no command for 0.500 s", /^watchdog: no command for 0.5 s$/],
    [`${ME} was silent for 2.0 s`, /^you sent nothing for 2.0 s/],
    ["commands arrive 1.2 s late, and 1 s is the limit: release the stick, and wait for a faster link", /1\.2 s late$/],
    [`${OTHER} taken over from ${ME}`, /client 3 .* took it over from you/],
    [`${ME} taken over from nobody`, /you took it over from nobody/],
    [`${OTHER} took the free lease`, /client 3 .* drives/],
    [`${OTHER} disconnected`, /client 3 .* left/],
    [`${OTHER} drives; call /teleop/take_over`, /client 3 .* drives$/],
  ])("are in the words of the page: %s", (reason, words) => {
    expect(inOurWords(reason, ME)).toMatch(words);
    if (!/\d/.test(reason) && !reason.startsWith("driving")) {
      expect(inOurWords(reason, ME)).not.toBe(reason);
    }
  });

  it("are shown as they are if they are unknown, but not endless", () => {
    expect(inOurWords("the wheels are tired", ME)).toBe("the wheels are tired");
    expect(inOurWords("x".repeat(5000), ME)).toHaveLength(200);
  });
});
