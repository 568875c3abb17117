import { afterEach, beforeEach, describe, expect, it, vi } from "vitest";
import { Alarms, type AlarmEnvironment } from "../../src/alarms/alarms";
import { AlarmSound } from "../../src/alarms/alarm_sound";
import { unknownState, type RobotState } from "../../src/robot/robot_state";
import type { ControlState, LocalizationStatus, Severity } from "../../src/values";
import { CONTROL } from "../driving/harness";

const STATUS: LocalizationStatus = { stamp: 1, health: "tracking", reasons: [], fit: 1, positionSigma: 0.01, headingSigma: 0.01 };

/** A sound that writes down what was played. */
class Heard extends AlarmSound {
  readonly played: Severity[] = [];
  unlocked = false;
  override get state() { return this.unlocked ? "ready" as const : "locked" as const; }
  override unlock() { this.unlocked = true; return Promise.resolve(this.state); }
  override play(severity: Severity) { this.played.push(severity); return true; }
}

let state: RobotState;
let heard: Heard;
let vibrated: (readonly number[])[];
let kept: string | null;
let gesture: () => void;
let told: string[];
let alarms: Alarms;

function environment(): AlarmEnvironment {
  return {
    now: () => Date.now(),
    every: (period, callback) => {
      const id = setInterval(callback, period);
      return () => { clearInterval(id); };
    },
    sound: heard,
    vibrate: (pattern) => { vibrated.push(pattern); },
    keeper: { getItem: () => kept, setItem: (_key, value) => { kept = value; } },
    onGesture: (callback) => { gesture = callback; return () => undefined; },
  };
}

function start(): void {
  alarms = new Alarms(state, undefined, (alarm, ended) => { told.push(`${ended ? "over" : "begins"} ${alarm.kind}`); }, environment());
}

/** The robot reports for so many milliseconds. */
function report(duration: number, control: Partial<ControlState> = {}, status: Partial<LocalizationStatus> = {}): void {
  for (let t = 0; t < duration; t += 100) {
    state.control.value = { ...CONTROL, ...control };
    state.status.value = { ...STATUS, ...status };
    vi.advanceTimersByTime(100);
  }
}

beforeEach(() => {
  vi.useFakeTimers();
  state = unknownState();
  state.connection.value = { phase: "open", words: "", sinceAt: Date.now() };
  [heard, vibrated, kept, told] = [new Heard(undefined), [], null, []];
  start();
});

afterEach(() => {
  alarms.dispose();
  vi.useRealTimers();
});

const kinds = (): string[] => alarms.active.value.map(({ kind }) => kind);

describe("the alarms of a robot", () => {
  it("are silent while it reports, and say within 0.6 s that it has stopped", () => {
    report(2000);
    expect(kinds()).toEqual([]);
    vi.advanceTimersByTime(600);
    expect(kinds()).toEqual(["stale"]);
    expect(heard.played).toEqual(["alarm"]);
    report(200);
    expect(kinds()).toEqual([]);
    expect(told).toEqual(["begins stale", "over stale"]);
  });

  it("do not count the time without a connection as silence once it is back", () => {
    report(500);
    state.connection.value = { phase: "lost", words: "The robot does not answer.", sinceAt: Date.now() };
    vi.advanceTimersByTime(5000);
    expect(kinds()).toEqual(["connection"]);
    expect(alarms.active.value[0]?.words).toBe("No connection for 5.0 s. The robot does not answer.");
    state.connection.value = { phase: "open", words: "", sinceAt: Date.now() };
    vi.advanceTimersByTime(300);
    expect(kinds()).toEqual([]);
  });

  it("are seen, heard and felt once", () => {
    report(500);
    report(1000, {}, { health: "lost", reasons: ["carried"] });
    expect(kinds()).toEqual(["lost"]);
    expect(heard.played).toEqual(["alarm"]);
    expect(vibrated).toHaveLength(1);
  });

  it("are not heard when muted, and the choice is kept", () => {
    alarms.muted.value = true;
    expect(kept).toBe("true");
    report(500, { estop: true });
    expect(kinds()).toEqual(["estop"]);
    expect(heard.played).toEqual([]);
    expect(vibrated).toHaveLength(1);
    alarms.dispose();
    start();
    expect(alarms.muted.value).toBe(true);
  });

  it("keep the words that a screen reader was given, while the shown ones change", () => {
    report(500);
    vi.advanceTimersByTime(600);
    const [first] = alarms.announced.value;
    vi.advanceTimersByTime(500);
    expect(alarms.announced.value).toEqual([first]);
    expect(alarms.active.value[0]?.words).not.toBe(first?.words);
  });

  it("wait for a gesture before they sound", async () => {
    expect(alarms.sound.value).toBe("locked");
    gesture();
    await vi.advanceTimersByTimeAsync(0);
    expect(alarms.sound.value).toBe("ready");
  });

  it("of tilt come from the attitude, and not from an old one", () => {
    state.attitude.value = { roll: 0.3, pitch: 0, source: "/tf", receivedAt: Date.now() };
    report(200);
    expect(kinds()).toEqual(["tipping"]);
    report(700);
    expect(kinds()).toEqual([]);
  });
});
