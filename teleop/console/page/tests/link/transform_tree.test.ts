import fc from "fast-check";
import { describe, expect, it } from "vitest";
import { compose, IDENTITY, movePoints, rollAndPitch, rotate } from "../../src/link/rigid_transform";
import { TransformTree } from "../../src/link/transform_tree";
import type { Pose, Quaternion } from "../../src/values";

const angle = fc.double({ min: -1.5, max: 1.5, noNaN: true });
const coordinate = fc.double({ min: -100, max: 100, noNaN: true });

function about(axis: "x" | "y" | "z", radians: number): Quaternion {
  return { x: 0, y: 0, z: 0, w: Math.cos(radians / 2), [axis]: Math.sin(radians / 2) };
}

function turn(orientation: Quaternion): Pose {
  return { position: { x: 0, y: 0, z: 0 }, orientation };
}

const anyPose = fc.tuple(coordinate, coordinate, coordinate, angle, angle, angle).map(([x, y, z, a, b, c]) => ({
  position: { x, y, z },
  orientation: compose(turn(about("z", a)), compose(turn(about("y", b)), turn(about("x", c)))).orientation,
}));

describe("composed poses", () => {
  it("are associative, as points moved one by one", () => {
    fc.assert(fc.property(anyPose, anyPose, fc.tuple(coordinate, coordinate, coordinate), (a, b, point) => {
      const once = movePoints(compose(a, b), Float32Array.from(point));
      const twice = movePoints(a, movePoints(b, Float32Array.from(point)));
      for (let i = 0; i < 3; i++) {
        expect(once[i]).toBeCloseTo(twice[i] ?? NaN, 2);
      }
    }));
  });

  it("turn left for positive angles about z", () => {
    const turned = rotate(about("z", Math.PI / 2), { x: 1, y: 0, z: 0 });
    expect(turned.x).toBeCloseTo(0);
    expect(turned.y).toBeCloseTo(1);
  });
});

describe("roll and pitch", () => {
  it("are those of a rotation about z, then y, then x", () => {
    fc.assert(fc.property(angle, angle, angle, (yaw, pitch, roll) => {
      const all = compose(turn(about("z", yaw)), compose(turn(about("y", pitch)), turn(about("x", roll))));
      const found = rollAndPitch(all.orientation);
      expect(found.roll).toBeCloseTo(roll);
      expect(found.pitch).toBeCloseTo(pitch);
    }));
  });

  it("have the left side up and the nose down as positive", () => {
    expect(rotate(about("x", 0.1), { x: 0, y: 1, z: 0 }).z).toBeGreaterThan(0);
    expect(rotate(about("y", 0.1), { x: 1, y: 0, z: 0 }).z).toBeLessThan(0);
  });
});

describe("a tree of transforms", () => {
  const branch = (parent: string, child: string, x: number): Parameters<TransformTree["add"]>[0] => ({
    ...IDENTITY, position: { x, y: 0, z: 0 }, parent, child, stamp: 0,
  });

  it("gives the pose of a frame in its ancestors only", () => {
    const tree = new TransformTree();
    tree.add(branch("map", "odom", 1), 0);
    tree.add(branch("odom", "base_link", 2), 0);
    expect(tree.lookup("map", "base_link")?.position.x).toBe(3);
    expect(tree.lookup("base_link", "map")).toBeUndefined();
    expect(tree.lookup("map", "map")).toEqual(IDENTITY);
    expect(tree.lookup("map", "laser")).toBeUndefined();
  });

  it("ends in a circle, and does not grow without end", () => {
    const tree = new TransformTree();
    tree.add(branch("a", "b", 1), 0);
    tree.add(branch("b", "a", 1), 0);
    expect(tree.lookup("map", "a")).toBeUndefined();
    for (let i = 0; i < 10_000; i++) {
      tree.add(branch("map", `frame ${i}`, 1), 0);
    }
    expect(tree.lookup("map", "frame 9999")).toBeUndefined();
  });
});
