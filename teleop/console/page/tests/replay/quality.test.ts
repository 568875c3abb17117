import { Color, SRGBColorSpace } from "three";
import { expect, it } from "vitest";
import { gradeOf, type Quality } from "../../src/replay/quality";
import { qualityPath } from "../../src/replay/quality_path";
import { COLOURS } from "../../src/scene/palette";
import type { Health } from "../../src/values";

const moment = (health: Health, x: number | undefined): Quality =>
  ({ at: 0, health, fit: 0.9, sigma: 0.01, position: x === undefined ? undefined : { x, y: 2, z: 0 } });

it("draws the way that was driven, in the colour of how well the robot knew where it was", () => {
  const { geometry } = qualityPath([moment("tracking", undefined), moment("tracking", 1), moment("lost", 3)], "day");
  expect([...geometry.getAttribute("position").array].map((value) => Math.round(value * 100) / 100)).toEqual([1, 2, 0.05, 3, 2, 0.05]);
  const { good, bad } = COLOURS.day;
  const tints = [good, bad].flatMap((rgb) => new Color().setRGB(...rgb, SRGBColorSpace).toArray());
  expect([...geometry.getAttribute("color").array].map((value) => Math.round(value * 1e4))).toEqual(tints.map((value) => Math.round(value * 1e4)));
});

it.each([
  ["tracking", "good"], ["degraded", "warn"], ["slipping", "warn"], ["suspect", "bad"], ["lost", "bad"], ["relocalising", "warn"], ["waiting", "stale"],
] as const)("judges the state %s as %s", (health, grade) => {
  expect(gradeOf(health)).toBe(grade);
});
