import { Box3, Vector3 } from "three";
import { expect, test } from "vitest";
import { PathLayer } from "../../src/prediction/path_layer";
import type { Motion } from "../../src/prediction/predicted_motion";

const BODY = new Box3(new Vector3(-0.25, -0.2, 0), new Vector3(0.25, 0.2, 0.4));
const POSE = { position: { x: 3, y: 4, z: 0 }, orientation: { x: 0, y: 0, z: 0, w: 1 } };

/** Motions straight on, each of a centimetre. */
function ahead(count: number): Motion[] {
  return Array.from({ length: count }, (_, index) => ({ x: index / 100, y: 0, yaw: 0, forward: 0.5, turn: 0 }));
}

/** Segments of each of the lines: edges, outline, end. */
function segments({ object }: PathLayer): number[] {
  return object.children.map((line) => (line as unknown as { geometry: { instanceCount: number } }).geometry.instanceCount);
}

test("both edges of the path, the outline where it begins, and a bar where the guard ends it are drawn at the robot's pose", () => {
  const layer = new PathLayer();
  expect(layer.object.visible).toBe(false);
  layer.set({ motions: ahead(100), effect: 40, cut: false }, POSE, BODY);
  expect(layer.object.visible).toBe(true);
  expect(layer.object.position.toArray()).toEqual([3, 4, 0]);
  expect(segments(layer)).toEqual([20, 4, 0]);
  layer.set({ motions: ahead(100), effect: 40, cut: true }, POSE, BODY);
  expect(segments(layer)).toEqual([20, 4, 1]);
  layer.dispose();
});

test("where the guard stops the robot before a command takes effect, only the place is drawn at which it will stand", () => {
  const layer = new PathLayer();
  layer.set({ motions: ahead(20), effect: 40, cut: true }, POSE, BODY);
  expect(segments(layer)).toEqual([0, 4, 1]);
  layer.clear();
  expect(layer.object.visible).toBe(false);
  layer.dispose();
});
