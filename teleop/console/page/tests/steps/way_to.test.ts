import fc from "fast-check";
import { describe, expect, test } from "vitest";
import { pointsOf, wayTo } from "../../src/steps/way_to";

const FROM = { x: 1, y: 2, yaw: Math.PI / 2 };

describe("the way to a place", () => {
  test("is straight to what is ahead", () => {
    expect(wayTo(FROM, { x: 1, y: 5 })).toEqual([{ distance: 3, angle: 0, speed: 0, held: true }]);
  });

  test("is one arc to what is up to 45 degrees aside", () => {
    const [arc, ...rest] = wayTo(FROM, { x: 0, y: 4 });
    expect(rest).toEqual([]);
    // A chord of length sqrt(5) at 26.6 degrees to the left.
    expect(arc?.angle).toBeCloseTo(2 * Math.atan2(1, 2));
    expect(arc?.distance).toBeCloseTo((Math.sqrt(5) * Math.atan2(1, 2)) / Math.sin(Math.atan2(1, 2)));
  });

  test("is a turn and a straight step to what is farther aside or behind, so that the robot sees where it drives", () => {
    const way = wayTo(FROM, { x: 4, y: 2 });
    expect(way.map(({ distance }) => distance)).toEqual([0, 3]);
    expect(way[0]?.angle).toBeCloseTo(-Math.PI / 2);
    expect(Math.abs(wayTo(FROM, { x: 1, y: 0 })[0]?.angle ?? 0)).toBeCloseTo(Math.PI);
  });

  test("is none to where the robot stands", () => {
    expect(wayTo(FROM, { x: 1.05, y: 2.05 })).toEqual([]);
  });

  test("ends at the place and never backs, wherever that is", () => {
    const metres = fc.double({ min: -20, max: 20, noNaN: true });
    fc.assert(fc.property(metres, metres, fc.double({ min: -4, max: 4, noNaN: true }), (x, y, yaw) => {
      const from = { x: 0, y: 0, yaw };
      const way = wayTo(from, { x, y });
      const last = pointsOf(from, way).at(-1);
      expect(way.every(({ distance, held }) => distance >= 0 && held === true)).toBe(true);
      if (way.length > 0) {
        // The points stand for circles of short chords.
        expect(Math.hypot((last?.x ?? 0) - x, (last?.y ?? 0) - y)).toBeLessThan(0.02);
      }
    }));
  });
});
