import { describe, expect, fc, points, test } from "./tools";
import { boundsOf, ellipseOf, ellipseOutline, floorHeight, headingOf, planar, SIGMAS_95_PLANE, upright, wrap } from "../../src/scene/geometry";

const angle = fc.double({ min: -50, max: 50, noNaN: true });

describe("angles", () => {
  test("are wrapped to one turn without changing direction", () => {
    fc.assert(fc.property(angle, (value) => {
      const wrapped = wrap(value);
      expect(wrapped).toBeGreaterThan(-Math.PI - 1e-9);
      expect(wrapped).toBeLessThanOrEqual(Math.PI + 1e-9);
      expect(Math.cos(wrapped)).toBeCloseTo(Math.cos(value), 9);
      expect(Math.sin(wrapped)).toBeCloseTo(Math.sin(value), 9);
    }));
  });

  test("survive being an orientation", () => {
    fc.assert(fc.property(fc.double({ min: -3.1, max: 3.1, noNaN: true }), (yaw) => {
      expect(headingOf(upright({ x: 1, y: 2, yaw }, 0).orientation)).toBeCloseTo(yaw, 9);
    }));
  });
});

describe("a pose on the floor", () => {
  test("has the heading of an orientation with pitch too", () => {
    const [yaw, pitch] = [2.5, 0.2];
    const [sy, cy, sp, cp] = [Math.sin(yaw / 2), Math.cos(yaw / 2), Math.sin(pitch / 2), Math.cos(pitch / 2)];
    const pose = planar({ position: { x: 1, y: 2, z: 3 }, orientation: { x: -sy * sp, y: cy * sp, z: sy * cp, w: cy * cp } });
    expect([pose.x, pose.y]).toEqual([1, 2]);
    expect(pose.yaw).toBeCloseTo(yaw);
  });
});

describe("the ellipse of a covariance", () => {
  test("has 95 % axes along the eigenvectors", () => {
    const ellipse = ellipseOf([0.04, 0, 0, 0, 0.01, 0, 0, 0, 0.1]);
    expect(ellipse?.major).toBeCloseTo(0.2 * SIGMAS_95_PLANE, 9);
    expect(ellipse?.minor).toBeCloseTo(0.1 * SIGMAS_95_PLANE, 9);
    expect(ellipse?.turn).toBeCloseTo(0, 9);
    expect(ellipseOf([0.01, 0, 0, 0, 0.04, 0, 0, 0, 0])?.turn).toBeCloseTo(Math.PI / 2, 9);
  });

  test("is closed, and all of it is at the same Mahalanobis distance", () => {
    const [xx, xy, yy] = [0.05, 0.02, 0.03];
    const ellipse = ellipseOf([xx, xy, 0, xy, yy, 0, 0, 0, 0]);
    const outline = ellipse === undefined ? [] : ellipseOutline(ellipse);
    const determinant = xx * yy - xy * xy;
    expect(outline.length).toBeGreaterThan(20);
    for (let at = 0; at < outline.length; at += 2) {
      const [x, y] = [outline[at] ?? NaN, outline[at + 1] ?? NaN];
      expect((yy * x * x - 2 * xy * x * y + xx * y * y) / determinant).toBeCloseTo(SIGMAS_95_PLANE ** 2, 6);
    }
    expect(outline.slice(-2)[0]).toBeCloseTo(outline[0] ?? NaN, 9);
  });

  test("is missing for what is no covariance", () => {
    for (const matrix of [[], [NaN, 0, 0, 0, 1], [1, 5, 0, 5, 1], [0, 0, 0, 0, 0], [1, Infinity, 0, 0, 1]]) {
      expect(ellipseOf(matrix)).toBeUndefined();
    }
  });
});

describe("the map's extent", () => {
  test("spans all finite points", () => {
    const bounds = boundsOf(points([1, 2, 3], [NaN, 0, -1], [-4, 5, 0]));
    expect(bounds).toEqual({ min: { x: -4, y: 0, z: -1 }, max: { x: 1, y: 5, z: 3 } });
  });

  test("is unknown without points", () => {
    expect(boundsOf(new Float32Array())).toBeUndefined();
    expect(boundsOf(points([NaN, NaN, NaN]))).toBeUndefined();
  });

  test("has its floor where most points of the lower half are, not at the lowest or the ceiling", () => {
    const cloud: [number, number, number][] = [[0, 0, -0.6]];
    for (let index = 0; index < 1000; index += 1) {
      cloud.push([index, 0, 0.01], [index, 1, (index % 27) / 10], [index, 2, 2.7], [index, 3, 2.7]);
    }
    const positions = points(...cloud);
    const bounds = boundsOf(positions);
    expect(bounds && floorHeight(positions, bounds)).toBeCloseTo(0, 1);
  });
});
