import { expect, it } from "vitest";
import { apart, clear, minimapView, scaleBar } from "../../src/scene/minimap";
import type { PlanImage } from "../../src/scene/plan_image";

const PLAN = { bounds: { min: { x: 0, y: 0, z: 0 }, max: { x: 30, y: 10, z: 2 } }, perMetre: 20 } as PlanImage;
const ROBOT = { position: { x: 3, y: 4, z: 0 }, orientation: { x: 0, y: 0, z: 0, w: 1 } };

it("shows the robot's surroundings about the robot, and all of the map when that is wanted or the robot has no place", () => {
  expect(minimapView({ plan: PLAN, robot: ROBOT }, 160, false)).toMatchObject({ x: 3, y: 4, scale: 10 });
  for (const view of [minimapView({ plan: PLAN, robot: ROBOT }, 160, true), minimapView({ plan: PLAN, robot: undefined }, 160, false)]) {
    expect(view).toMatchObject({ x: 15, y: 5 });
    expect(view.scale * 30).toBeLessThan(160);
  }
});

it.each([[10, 5], [5, 10], [40, 1], [2, 20], [100, 0.5]])("has, at %s pixels for a metre, a scale bar of %s m", (scale, length) => {
  expect(scaleBar(scale, 160)).toBeCloseTo(length);
});

it("writes the nearest names only where they fit and lie over no other", () => {
  const words = (name: string, x: number, y: number): { name: string; at: [number, number]; width: number } => ({ name, at: [x, y], width: 40 });
  const kept = apart([words("over hall", 95, 84), words("hall", 80, 80), words("cut off", 10, 40), words("kitchen", 80, 120)], 160);
  expect(kept.map(({ name }) => name)).toEqual(["hall", "kitchen"]);
});

it("writes the name of the room that the robot is in below its mark", () => {
  const hall = { at: [80, 84] as const, width: 30 };
  expect(clear(hall, [85, 80]).at).toEqual([80, 101]);
  expect([clear(hall, [130, 80]), clear(hall, undefined)]).toEqual([hall, hall]);
});
