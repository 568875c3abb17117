import { expect, it } from "vitest";
import { placeAt, placesInQuestion } from "../../src/robot/places";
import type { Pose } from "../../src/values";

const at = (x: number, y: number): Pose => ({ position: { x, y, z: 0 }, orientation: { x: 0, y: 0, z: 0, w: 1 } });
const PLACES = [{ name: "kitchen", pose: at(3, 14) }, { name: "hall", pose: at(24, 3) }];

it("names a position by the nearest place within a room's reach", () => {
  expect(placeAt(PLACES, at(4, 12).position)).toBe("kitchen");
  expect(placeAt(PLACES, at(14, 8).position)).toBe("");
});

it("lists places in question nearest first, each with the share that it explains itself", () => {
  const found = placesInQuestion([at(3, 13), at(14, 8), at(23, 3)], [0.9, 0.8, 0.7], PLACES, at(20, 3));
  expect(found.map(({ name, share, away }) => [name, share, Math.round(away ?? 0)]))
    .toEqual([["hall", 0.7, 3], ["", 0.8, 8], ["kitchen", 0.9, 20]]);
});

it("keeps the order, best first, while nobody knows where the robot was, and has no share of another sweep", () => {
  const found = placesInQuestion([at(3, 13), at(23, 3)], [0.9], PLACES, undefined);
  expect(found.map(({ name, share, away }) => [name, share, away])).toEqual([["kitchen", undefined, undefined], ["hall", undefined, undefined]]);
});

it("gives the present place no share until it has been compared", () => {
  const found = placesInQuestion([at(3, 13), at(23, 3)], [0.9, 0], PLACES, undefined);
  expect(found.map(({ share }) => share)).toEqual([0.9, undefined]);
});
