import fc from "fast-check";
import { expect, it } from "vitest";
import { ANGLE, DIRECTIONS, DISTANCE, PACES, readSize, shareDriven, stepGoal } from "../../src/steps/step_size";

it("reads sizes within their limits, and says what would fit", () => {
  expect(readSize("Distance", " 0,25 ", DISTANCE)).toEqual({ ok: true, value: 0.25 });
  for (const entered of ["", "0", "-1", "101", "1e1", "0x10", "Infinity", "five"]) {
    const size = readSize("Distance", entered, DISTANCE);
    expect(size).toEqual({ ok: false, words: `Distance: a number from 0.01 to 100 m, not “${entered}”.` });
  }
});

it("never makes a goal that the robot's limits refuse", () => {
  fc.assert(fc.property(
    fc.string(), fc.double(), fc.constantFrom(...DIRECTIONS), fc.constantFrom(...PACES),
    (text, number, direction, pace) => {
      const straight = direction === "forward" || direction === "back";
      for (const entered of [text, String(number)]) {
        const size = readSize("Size", entered, straight ? DISTANCE : ANGLE);
        if (size.ok) {
          const { distance, angle, speed } = stepGoal(direction, size.value, pace);
          expect((distance === 0) !== (angle === 0)).toBe(true);
          expect(Math.abs(distance) <= 100 && Math.abs(angle) <= 2 * Math.PI && speed >= 0).toBe(true);
        }
      }
    },
  ));
});

it("turns left by positive angles", () => {
  expect(stepGoal("left", 90, "slow")).toEqual({ distance: 0, angle: Math.PI / 2, speed: 0.2 });
  expect(stepGoal("right", 90, "own").angle).toBeLessThan(0);
  expect(stepGoal("back", 2, "own")).toEqual({ distance: -2, angle: 0, speed: 0 });
});

it("knows the share that is driven", () => {
  expect(shareDriven(stepGoal("back", 2, "own"), { distance: -0.5, angle: 0.1 })).toBe(0.25);
  expect(shareDriven(stepGoal("left", 90, "own"), { distance: 0.3, angle: 9 })).toBe(1);
});
