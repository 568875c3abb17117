import { expect, it } from "vitest";
import { pointCells } from "../../src/scene/plan";

const BOUNDS = { min: { x: 10, y: 20, z: 0 }, max: { x: 10.75, y: 20.5, z: 3 } };
const COLOURS = { floor: [1, 0, 0], wallHigh: [0, 1, 0] } as const;

/** What is at each pixel, row by row from the north: # a wall, . the floor, a blank nothing. */
function drawn(points: readonly (readonly [number, number, number])[], floor = 0.5): string[] {
  const { width, height, pixels } = pointCells(Float32Array.from(points.flat()), BOUNDS, floor, 4, COLOURS);
  return Array.from({ length: height }, (_, row) => Array.from({ length: width }, (_, column) => {
    const [red, green, , opacity] = pixels.subarray(4 * (row * width + column));
    return opacity === 0 ? " " : (green ?? 0) > (red ?? 0) ? "#" : ".";
  }).join(""));
}

it("shows walls and floor of a map of points from above, north up", () => {
  expect(drawn([[10.1, 20.4, 1], [10.3, 20.4, 0.5], [10.6, 20.2, 0.55]])).toEqual(["#.  ", "  . ", "    "]);
});

it("leaves what is above a door out, and draws no floor over a wall, in whatever order the points come", () => {
  const [lintel, floor, wall] = [[10.1, 20.4, 2.6], [10.3, 20.4, 0.5], [10.3, 20.4, 1.2]] as const;
  expect(drawn([lintel, floor, wall])).toEqual([" #  ", "    ", "    "]);
  expect(drawn([wall, floor, lintel])).toEqual([" #  ", "    ", "    "]);
});
