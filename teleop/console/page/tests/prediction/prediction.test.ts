import { signal } from "@preact/signals";
import { expect, test } from "vitest";
import type { Wanted } from "../../src/driving/gears";
import { prediction } from "../../src/prediction/prediction";
import { unknownState, type LinkStatistics } from "../../src/robot/robot_state";
import type { PathAhead } from "../../src/scene/settings";
import type { ControlState, Pace } from "../../src/values";
import { CONTROL } from "../driving/harness";

const FREE: Pace = { guard: 1, late: 1, ahead: 4 };

/** A page whose robot's clock runs with its own, at a round trip of so many ms. */
function page(roundTrip: number) {
  const [state, when, sending] = [unknownState(), signal<PathAhead>("late"), signal<Wanted | undefined>(undefined)];
  const statistics = signal({ roundTrip } as LinkStatistics);
  let now = 100_000;
  const shown = prediction({ state, sending, statistics, when, now: () => now });
  state.driveLimits.value = { acceleration: 0.5, braking: 1, turnAcceleration: 2.6, turnBraking: 5.2, lag: 0.05 };
  let x = 0;
  return {
    when, sending, statistics, shown, state,
    /** Let time pass, with a state and a pose of the robot each tenth of a second. */
    pass: (seconds: number, control: Partial<ControlState>): void => {
      for (let tenth = 0; tenth < 10 * seconds; tenth += 1) {
        now += 100;
        const stamp = now / 1000;
        x += 0.1 * (control.linear ?? 0);
        state.time.value = { stamp, receivedAt: now };
        state.control.value = { ...CONTROL, pace: FREE, ...control, stamp };
        state.mapFromBase.value = {
          position: { x, y: 0, z: 0 }, orientation: { x: 0, y: 0, z: 0, w: 1 }, stamp, receivedAt: now,
        };
      }
    },
  };
}

test("the path begins where a command sent now takes effect, and follows the stick for three seconds", () => {
  const { pass, shown, sending } = page(400);
  sending.value = { forward: 0.5, turn: 0, turbo: false };
  pass(2, { linear: 0.2 });
  expect(shown.value?.effect).toBe(20);
  // 0.5 less the dead zone of 0.05, of 0.5 m/s, is what is on its way, or the robot follows already.
  expect(shown.value?.motions.at(-1)?.x).toBeCloseTo(0.2 * 3.4, 1);
  sending.value = { forward: -0.5, turn: 0, turbo: false };
  expect(shown.value?.motions[20]?.x).toBeCloseTo(0.08, 2);
  expect(shown.value?.motions.at(-1)?.forward).toBeCloseTo((-0.5 * 0.45) / 0.95, 3);
  sending.value = undefined;
  expect(shown.value?.motions.at(-1)?.forward).toBe(0);
});

test("it is shown by itself above 200 ms, and as the person wants", () => {
  const { pass, shown, statistics, when } = page(190);
  pass(1, { linear: 0.5 });
  expect(shown.value).toBeUndefined();
  statistics.value = { ...statistics.value, roundTrip: 210 };
  expect(shown.value).toBeDefined();
  statistics.value = { ...statistics.value, roundTrip: 190 };
  expect(shown.value).toBeDefined();
  statistics.value = { ...statistics.value, roundTrip: 150 };
  expect(shown.value).toBeUndefined();
  when.value = "always";
  expect(shown.value).toBeDefined();
  when.value = "never";
  expect(shown.value).toBeUndefined();
});

test("it is cut where the guard ends the arc, and another arc is not", () => {
  const { pass, shown, sending } = page(300);
  sending.value = { forward: 1, turn: 0, turbo: false };
  pass(1.5, { linear: 0.5, pace: { guard: 1, late: 1, ahead: 1.5 } });
  expect(shown.value?.cut).toBe(true);
  expect(shown.value?.motions.at(-1)?.x).toBeCloseTo(0.75, 1);
  sending.value = { forward: 0, turn: 1, turbo: false };
  expect(shown.value?.cut).toBe(false);
});

test("a robot that is limited is foreseen as slow as it is, and one at rest or of old has no path", () => {
  const { pass, shown, sending, state } = page(300);
  sending.value = { forward: 1, turn: 0, turbo: false };
  pass(1.5, { linear: 0.1, pace: { guard: 0.5, late: 0.4, ahead: 4 } });
  sending.value = { forward: 0.9, turn: 0, turbo: false };
  expect(shown.value?.motions.at(-1)?.forward).toBeCloseTo((0.2 * 0.5 * 0.85) / 0.95, 3);
  sending.value = undefined;
  pass(3, { linear: 0 });
  expect(shown.value).toBeUndefined();
  pass(1, { linear: 0.3 });
  expect(shown.value).toBeDefined();
  state.run.value = "another";
  state.driveLimits.value = undefined;
  expect(shown.value).toBeUndefined();
});
