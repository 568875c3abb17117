import fc from "fast-check";
import { describe, expect, it } from "vitest";
import { headingOfDrag, moved, samePose, turned } from "../../src/hint/hint_geometry";

const degrees = Math.PI / 180;
const number = fc.double({ min: -1e4, max: 1e4, noNaN: true });

describe("headingOfDrag", () => {
  it("is the direction of the drag, left positive from x", () => {
    expect(headingOfDrag({ x: 1, y: 1 }, { x: 1, y: 3 })).toBeCloseTo(90 * degrees);
    expect(headingOfDrag({ x: 1, y: 1 }, { x: 0, y: 1 })).toBeCloseTo(180 * degrees);
    expect(headingOfDrag({ x: 0, y: 0 }, { x: 1, y: -1 })).toBeCloseTo(-45 * degrees);
  });

  it("is unknown for a drag that is too short", () => {
    expect(headingOfDrag({ x: 0, y: 0 }, { x: 0.2, y: 0.2 })).toBeUndefined();
    expect(headingOfDrag({ x: 0, y: 0 }, { x: 0.2, y: 0.2 }, 0.25)).toBeCloseTo(45 * degrees);
  });
});

describe("poses", () => {
  it("are the same across the jump of the angle", () => {
    expect(samePose({ x: 0, y: 0, yaw: Math.PI - 0.001 }, { x: 0, y: 0, yaw: -Math.PI + 0.001 })).toBe(true);
    expect(samePose({ x: 0, y: 0, yaw: 0 }, { x: 0, y: 0, yaw: 0.1 })).toBe(false);
    expect(samePose({ x: 0, y: 0, yaw: 0 }, { x: 0.1, y: 0, yaw: 0 })).toBe(false);
  });

  it("come back after moving and turning there and back", () => {
    fc.assert(fc.property(number, number, fc.double({ min: -3.1, max: 3.1, noNaN: true }), number, (dx, dy, yaw, angle) => {
      const pose = { x: 1, y: -2, yaw };
      const back = turned(moved(turned(moved(pose, dx, dy), angle), -dx, -dy), -angle);
      expect(samePose(back, pose, 1e-6, 1e-6)).toBe(true);
    }));
  });
});
