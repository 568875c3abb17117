import { expect, it } from "vitest";
import { GuardZoneLayer } from "../../src/scene/guard_zone";
import { COLOURS } from "../../src/scene/palette";

const SQUARE = [{ x: 1, y: 1 }, { x: -1, y: 1 }, { x: -1, y: -1 }, { x: 1, y: -1 }];

it("closes the outline, crosses the point, is red once the robot is stopped, and goes", () => {
  const layer = new GuardZoneLayer();
  layer.setColours(COLOURS.day);
  layer.set({ stopped: false, outline: SQUARE, point: { x: 2, y: 0 } });
  const { geometry } = layer.line.object;
  expect(geometry.instanceCount).toBe(4 + 2);
  const [start, end] = [geometry.getAttribute("instanceStart"), geometry.getAttribute("instanceEnd")];
  expect([end.getX(3), end.getY(3)]).toEqual([start.getX(0), start.getY(0)]);
  expect((start.getX(4) + end.getX(4)) / 2).toBeCloseTo(2);
  const slowed = layer.line.object.material.color.getHex();
  layer.set({ stopped: true, outline: [], point: { x: 2, y: 0 } });
  expect(layer.line.object.material.color.getHex()).not.toBe(slowed);
  layer.set(undefined);
  expect(geometry.instanceCount).toBe(0);
});
