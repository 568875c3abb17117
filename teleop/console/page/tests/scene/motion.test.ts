import { describe, expect, it } from "vitest";
import { motionMeter } from "../../src/scene/measured_motion";
import { nearestObstacle } from "../../src/scene/nearest_obstacle";
import type { CloudPoints, StampedPose } from "../../src/values";

function pose(stamp: number, x: number, y: number, yaw: number): StampedPose {
  const orientation = { x: 0, y: 0, z: Math.sin(yaw / 2), w: Math.cos(yaw / 2) };
  return { position: { x, y, z: 0 }, orientation, stamp, receivedAt: 1000 * stamp };
}

describe("measured motion", () => {
  it.each([[0.7, 0], [-0.3, 0.5], [0, -1.2], [0.5, 0.8]])("is that of a robot which drives %f m/s and turns %f rad/s", (linear, angular) => {
    const meter = motionMeter();
    let motion;
    for (let stamp = 0; stamp <= 1.0; stamp += 0.05) {
      const yaw = 3 + angular * stamp;
      const way = angular === 0
        ? [linear * stamp * Math.cos(3), linear * stamp * Math.sin(3)]
        : [(linear / angular) * (Math.sin(yaw) - Math.sin(3)), (linear / angular) * (Math.cos(3) - Math.cos(yaw))];
      motion = meter(pose(stamp, way[0] ?? 0, way[1] ?? 0, yaw));
    }
    expect(motion?.linear).toBeCloseTo(linear, 2);
    expect(motion?.angular).toBeCloseTo(angular, 6);
  });

  it("is unknown after the robot was placed elsewhere, until it has been there for a while", () => {
    const meter = motionMeter();
    const before = Array.from({ length: 12 }, (_, tick) => meter(pose(0.05 * tick, 0, 0, 0)));
    expect(before.at(-1)?.linear).toBe(0);
    expect(meter(pose(0.6, 5, 0, 0))).toBeUndefined();
    expect(meter(pose(0.65, 5, 0, 0))).toBeUndefined();
    expect(meter(pose(0.9, 5, 0, 0))?.linear).toBe(0);
    expect(meter(undefined)).toBeUndefined();
    expect(meter(pose(0.1, 0, 0, 0))).toBeUndefined();
  });
});

describe("the nearest obstacle", () => {
  const body = { min: { x: -0.25, y: -0.25 }, max: { x: 0.25, y: 0.25, z: 0.5 } };
  const seen = (...points: [number, number, number][]): CloudPoints => ({
    stamp: 0, receivedAt: 0, frame: "map", positions: new Float32Array(points.flat()), distances: new Float32Array(points.length),
  });

  it("is measured from the robot's outline, with its bearing from ahead", () => {
    const found = nearestObstacle(seen([2, 3.65, 0.3], [4, 3, 0.3]), pose(0, 2, 3, Math.PI / 2), body);
    expect(found?.distance).toBeCloseTo(0.4, 6);
    expect(found?.bearing).toBeCloseTo(0, 6);
    const left = nearestObstacle(seen([1.5, 3, 0.3]), pose(0, 2, 3, Math.PI / 2), body);
    expect(left?.bearing).toBeCloseTo(Math.PI / 2, 6);
  });

  it("is neither floor, ceiling, the robot itself nor a point that is no number", () => {
    expect(nearestObstacle(seen([0.5, 0, 0.02], [0.5, 0, 2.4], [0.1, 0, 0.3], [NaN, 0, 0.3]), pose(0, 0, 0, 0), body)).toBeUndefined();
  });
});
