import { PerspectiveCamera, Vector3 } from "three";
import { describe, expect, fc, test } from "./tools";
import { blend, direction, fittingDistance, placeCamera, type Orbit } from "../../src/scene/orbit";
import { floorHit, nearest } from "../../src/scene/picking";
import { ViewRig } from "../../src/scene/view_rig";

const ORBIT: Orbit = { target: { x: 3, y: -2, z: 0.5 }, azimuth: 0.4, elevation: 0.7, distance: 8, fieldOfView: 0.9 };
const WORLD = { min: { x: 0, y: 0, z: 0 }, max: { x: 26, y: 16, z: 3 } };

function cameraOf(orbit: Orbit, aspect = 1.6): PerspectiveCamera {
  const camera = new PerspectiveCamera();
  placeCamera(camera, orbit, aspect);
  return camera;
}

/** Let all motion of a view end. */
function settle(rig: ViewRig): Orbit {
  for (let step = 0; step < 200; step += 1) {
    rig.advance(50);
  }
  return rig.orbit();
}

const anyOrbit = fc.record({
  target: fc.record({ x: fc.double({ min: -50, max: 50, noNaN: true }), y: fc.double({ min: -50, max: 50, noNaN: true }), z: fc.constant(0) }),
  azimuth: fc.double({ min: -3, max: 3, noNaN: true }),
  elevation: fc.double({ min: 0.2, max: Math.PI / 2, noNaN: true }),
  distance: fc.double({ min: 1, max: 100, noNaN: true }),
  fieldOfView: fc.double({ min: 0.3, max: 1.2, noNaN: true }),
});

describe("the camera", () => {
  test("looks at its target from any side, also straight down", () => {
    fc.assert(fc.property(anyOrbit, (orbit) => {
      const camera = cameraOf(orbit);
      const seen = new Vector3(orbit.target.x, orbit.target.y, 0).project(camera);
      expect(seen.x).toBeCloseTo(0, 5);
      expect(seen.y).toBeCloseTo(0, 5);
      // What lies farther in the direction of view is higher in the picture.
      const { x, y } = orbit.target;
      const ahead = new Vector3(x + 0.1 * Math.cos(orbit.azimuth), y + 0.1 * Math.sin(orbit.azimuth), 0).project(camera);
      expect(ahead.y).toBeGreaterThan(0);
      expect(ahead.x).toBeCloseTo(0, 5);
    }));
  });

  test("goes the shorter way round between two orbits", () => {
    const [from, to] = [{ ...ORBIT, azimuth: 3 }, { ...ORBIT, azimuth: -3 }];
    expect(direction(blend(from, to, 0.5)).x).toBeLessThan(0);
    expect(blend(from, to, 0).distance).toBeCloseTo(from.distance, 9);
    expect(blend(from, to, 1).target).toEqual(to.target);
  });

  test("fits bounds so that all corners are in the picture", () => {
    const target = { x: 13, y: 8, z: 0 };
    for (const aspect of [0.5, 1, 2.2]) {
      const distance = fittingDistance({ ...ORBIT, target }, WORLD, aspect);
      const camera = cameraOf({ ...ORBIT, target, distance }, aspect);
      for (const [x, y, z] of [[0, 0, 0], [26, 0, 3], [26, 16, 0], [0, 16, 3]] as const) {
        const seen = new Vector3(x, y, z).project(camera);
        expect(Math.max(Math.abs(seen.x), Math.abs(seen.y))).toBeLessThanOrEqual(1.001);
      }
    }
  });
});

describe("picking", () => {
  test("returns the place on the floor that is drawn there", () => {
    fc.assert(fc.property(anyOrbit, fc.double({ min: -5, max: 5, noNaN: true }), fc.double({ min: -5, max: 5, noNaN: true }), (orbit, dx, dy) => {
      const camera = cameraOf(orbit);
      const place = new Vector3(orbit.target.x + dx * orbit.distance * 0.05, orbit.target.y + dy * orbit.distance * 0.05, 0.2);
      const seen = place.clone().project(camera);
      const hit = floorHit(camera, seen.x, seen.y, 0.2);
      expect(hit?.x).toBeCloseTo(place.x, 3);
      expect(hit?.y).toBeCloseTo(place.y, 3);
    }));
  });

  test("finds nothing above the horizon", () => {
    const camera = cameraOf({ ...ORBIT, elevation: 0.1 });
    expect(floorHit(camera, 0, 0.9, 0)).toBeUndefined();
    expect(floorHit(camera, NaN, NaN, 0)).toBeUndefined();
  });

  test("takes the nearest mark within reach", () => {
    const camera = cameraOf(ORBIT);
    const marks = [new Vector3(3, -2, 0.5), new Vector3(3.3, -2, 0.5)];
    const size = { width: 800, height: 500 };
    expect(nearest(marks, camera, 401, 250, 20, size)).toBe(0);
    expect(nearest(marks, camera, 10, 10, 20, size)).toBeUndefined();
  });
});

describe("the views", () => {
  test("show the whole map while the robot's place is not known", () => {
    const rig = new ViewRig();
    rig.setAspect(1.6);
    rig.setWorld(WORLD);
    for (const view of ["chase", "top", "first", "arm"] as const) {
      rig.setView(view);
      const camera = cameraOf(settle(rig));
      for (const [x, y] of [[0, 0], [26, 0], [26, 16], [0, 16]] as const) {
        const seen = new Vector3(x, y, 0).project(camera);
        expect(Math.max(Math.abs(seen.x), Math.abs(seen.y))).toBeLessThan(1);
      }
    }
  });

  test("follow the robot: from behind, from above with y up, and with its eyes", () => {
    const rig = new ViewRig();
    const robot = { x: 5, y: 7, z: 0.1, yaw: 1 };
    rig.setAnchor(robot);
    expect(settle(rig).azimuth).toBeCloseTo(1, 2);
    expect(settle(rig).target.x).toBeCloseTo(5 + 0.8 * Math.cos(1), 2);
    rig.setView("top");
    expect(direction(settle(rig)).z).toBeCloseTo(-1, 6);
    expect(settle(rig).azimuth).toBeCloseTo(Math.PI / 2, 6);
    rig.setView("first");
    expect(rig.isInside).toBe(true);
    expect(settle(rig).distance).toBeLessThan(0.01);
    expect(settle(rig).azimuth).toBeCloseTo(1, 6);
    rig.setView("arm");
    expect(settle(rig).target.x).toBeCloseTo(5 + 0.5 * Math.cos(1), 2);
    expect(settle(rig).distance).toBeLessThan(1.5);
  });

  test("show the whole map from above, and the robot once a person zooms in", () => {
    const rig = new ViewRig();
    rig.setAspect(1.6);
    rig.setWorld(WORLD);
    rig.setView("top");
    rig.setAnchor({ x: 24, y: 3, z: 0, yaw: 1 });
    const camera = cameraOf(settle(rig));
    for (const [x, y] of [[0, 0], [26, 16]] as const) {
      const seen = new Vector3(x, y, 0).project(camera);
      expect(Math.max(Math.abs(seen.x), Math.abs(seen.y))).toBeLessThan(1);
    }
    const whole = rig.orbit().distance;
    rig.zoom(2);
    expect(rig.orbit().distance).toBe(whole);
    rig.zoom(0.5);
    expect(rig.orbit().distance).toBeCloseTo(whole / 2, 6);
    expect(rig.orbit().target.x).toBeCloseTo(24, 6);
    expect(rig.following).toBe(true);
    rig.recentre();
    expect(settle(rig).distance).toBe(whole);
  });

  test("show the whole map between what covers the picture, with and without a robot", () => {
    const rig = new ViewRig();
    rig.setAspect(1, { top: 0.1, bottom: 0.3 });
    rig.setWorld(WORLD);
    rig.setView("top");
    for (const robot of [undefined, { x: 24, y: 3, z: 0, yaw: 1 }]) {
      rig.setAnchor(robot);
      const camera = cameraOf(settle(rig), 1);
      for (const [x, y] of [[0, 0], [26, 0], [26, 16], [0, 16]] as const) {
        const seen = new Vector3(x, y, 0).project(camera);
        expect(Math.abs(seen.x)).toBeLessThan(1);
        expect(seen.y).toBeLessThan(0.8);
        expect(seen.y).toBeGreaterThan(-0.4);
      }
    }
  });

  test("show the robot's surroundings from above in a map that is too large", () => {
    const rig = new ViewRig();
    rig.setWorld({ min: { x: -500, y: -500, z: 0 }, max: { x: 500, y: 500, z: 3 } });
    rig.setView("top");
    rig.setAnchor({ x: 24, y: 3, z: 0, yaw: 1 });
    expect(settle(rig).target.x).toBeCloseTo(24, 6);
    expect(settle(rig).distance).toBeLessThan(100);
  });

  test("stay where a person moved them, until they are called back", () => {
    const rig = new ViewRig();
    rig.setView("top");
    rig.setAnchor({ x: 0, y: 0, z: 0, yaw: 0 });
    settle(rig);
    rig.pan(100, 0, 500);
    const moved = rig.orbit().target;
    expect(moved.x).toBeLessThan(-1);
    rig.setAnchor({ x: 1, y: 0, z: 0, yaw: 0 });
    expect(settle(rig).target).toEqual(moved);
    expect(rig.following).toBe(false);
    rig.recentre();
    expect(settle(rig).target.x).toBeCloseTo(1, 2);
  });

  test("keep still while a hint is placed", () => {
    const rig = new ViewRig();
    rig.setAnchor({ x: 0, y: 0, z: 0, yaw: 0 });
    const before = settle(rig);
    rig.mayFollow = false;
    rig.setAnchor({ x: 0.5, y: 0, z: 0, yaw: 0.5 });
    expect(settle(rig)).toEqual(before);
  });

  test("zoom within bounds and about the place that is pointed at", () => {
    const rig = new ViewRig();
    rig.setView("top");
    rig.setAnchor({ x: 0, y: 0, z: 0, yaw: 0 });
    settle(rig);
    rig.pan(1, 0, 500);
    const before = rig.orbit();
    rig.zoom(0.5, { x: 10, y: 4 });
    const after = rig.orbit();
    expect(after.distance).toBeCloseTo(before.distance / 2, 6);
    expect(after.target.x).toBeCloseTo((before.target.x + 10) / 2, 6);
    for (let step = 0; step < 100; step += 1) {
      rig.zoom(1.5);
    }
    expect(rig.orbit().distance).toBeLessThanOrEqual(2000);
  });

  test("do not glide for a person who wants little motion", () => {
    const rig = new ViewRig();
    rig.reducedMotion = true;
    rig.setAnchor({ x: 0, y: 0, z: 0, yaw: 0 });
    rig.advance(16);
    rig.setView("top");
    rig.advance(16);
    expect(direction(rig.orbit()).z).toBeCloseTo(-1, 6);
  });
});
