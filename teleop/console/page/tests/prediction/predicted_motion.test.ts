import { expect, test } from "vitest";
import predictions from "../../../../../tests/teleop/prediction/predictions.json";
import { predicted } from "../../src/prediction/predicted_motion";

interface Case {
  readonly limits: { acceleration: number; braking: number; turn_acceleration: number; turn_braking: number; lag: number };
  readonly known: readonly [number, number, number, number, number];
  readonly stamp: number;
  readonly commands: readonly (readonly [number, number, number])[];
  readonly until: number;
  readonly count: number;
  readonly last: readonly number[];
}

const cases = predictions as unknown as readonly Case[];

test.each(cases)("the page foresees what the display foresees, from $stamp s on", ({ limits, known: [x, y, yaw, forward, turn], ...given }) => {
  const commands = given.commands.map(([at, ahead, left]) => ({ at, forward: ahead, turn: left }));
  const named = { ...limits, turnAcceleration: limits.turn_acceleration, turnBraking: limits.turn_braking };
  const motions = predicted({ x, y, yaw, forward, turn }, given.stamp, commands, given.until, named);
  expect(motions).toHaveLength(given.count);
  const last = motions.at(-1);
  [last?.x, last?.y, last?.yaw, last?.forward, last?.turn].forEach((value, index) => { expect(value).toBeCloseTo(given.last[index] ?? NaN, 9); });
});
