import { Box3, Vector3 } from "three";
import { expect, it } from "vitest";
import { NearestArc } from "../../src/scene/nearest_arc";
import { COLOURS } from "../../src/scene/palette";

const BODY = new Box3(new Vector3(-0.3, -0.25, 0), new Vector3(0.3, 0.25, 0.4));

it.each([[2.5, 0], [1.4, 1], [0.8, 2], [0.3, 3]])("has, %s m from the robot, %s arcs on the side where the thing is", (distance, count) => {
  const arcs = new NearestArc();
  arcs.set({ distance, bearing: Math.PI / 2, receivedAt: 0 }, BODY);
  const { geometry } = arcs.line.object;
  expect(geometry.instanceCount).toBe(16 * count);
  const start = geometry.getAttribute("instanceStart");
  for (let at = 0; at < geometry.instanceCount; at += 1) {
    expect(start.getY(at), "on the left").toBeGreaterThan(Math.abs(start.getX(at)));
    expect(Math.hypot(start.getX(at), start.getY(at)), "outside the body").toBeGreaterThan(0.4);
  }
});

it("is red only when the thing is within half a metre, and gone when nothing is near", () => {
  const arcs = new NearestArc();
  arcs.setColours(COLOURS.day);
  const colour = (): number => arcs.line.object.material.color.getHex();
  arcs.set({ distance: 0.8, bearing: 0, receivedAt: 0 }, BODY);
  const before = colour();
  arcs.set({ distance: 0.4, bearing: 0, receivedAt: 0 }, BODY);
  expect(colour()).not.toBe(before);
  arcs.set(undefined, BODY);
  expect(arcs.line.object.geometry.instanceCount).toBe(0);
});
