import fc from "fast-check";
import { describe, expect, it } from "vitest";
import { headingOf, headingOfDrag, moved, planar, samePose, turned, wrapAngle } from "../../src/hint/hint_geometry";

const degrees = Math.PI / 180;
const number = fc.double({ min: -1e4, max: 1e4, noNaN: true });

describe("wrapAngle", () => {
  it("keeps the direction and stays within half a turn", () => {
    fc.assert(fc.property(number, (angle) => {
      const wrapped = wrapAngle(angle);
      expect(wrapped).toBeGreaterThanOrEqual(-Math.PI);
      expect(wrapped).toBeLessThanOrEqual(Math.PI);
      expect(Math.cos(wrapped)).toBeCloseTo(Math.cos(angle), 6);
      expect(Math.sin(wrapped)).toBeCloseTo(Math.sin(angle), 6);
    }));
  });

  it("goes on from half a turn to the left at half a turn to the right", () => {
    expect(wrapAngle(181 * degrees)).toBeCloseTo(-179 * degrees);
    expect(wrapAngle(-181 * degrees)).toBeCloseTo(179 * degrees);
  });
});

describe("headingOf", () => {
  it("is the turn about the vertical, of an orientation with roll and pitch too", () => {
    const yaw = 2.5;
    expect(headingOf({ x: 0, y: 0, z: Math.sin(yaw / 2), w: Math.cos(yaw / 2) })).toBeCloseTo(yaw);
    const pitch = 0.2;
    const [sy, cy, sp, cp] = [Math.sin(yaw / 2), Math.cos(yaw / 2), Math.sin(pitch / 2), Math.cos(pitch / 2)];
    expect(headingOf({ x: -sy * sp, y: cy * sp, z: sy * cp, w: cy * cp })).toBeCloseTo(yaw);
  });

  it("makes a planar pose of a pose", () => {
    const pose = { position: { x: 1, y: 2, z: 3 }, orientation: { x: 0, y: 0, z: 1, w: 0 } };
    expect(planar(pose)).toEqual({ x: 1, y: 2, yaw: Math.PI });
  });
});

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
