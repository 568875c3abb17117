import fc from "fast-check";
import { Group, Quaternion, Vector3 } from "three";
import { describe, expect, it } from "vitest";
import { SmoothPose } from "../../src/scene/smooth_pose";
import { Place, TABLE } from "../../src/xr/place";

const LEVEL = { turns: false, tilts: false };

function standing(x = 3, y = -2, yaw = 0.4) {
  const robot = new SmoothPose();
  robot.set({ position: { x, y, z: 0.1 }, orientation: { x: 0, y: 0, z: Math.sin(yaw / 2), w: Math.cos(yaw / 2) } }, true);
  const room = new Group();
  const place = new Place(room, robot);
  const head = new Vector3(0.3, 1.6, -0.2);
  const look = (turn = new Quaternion()): void => { place.seeHead(head, turn); };
  look();
  const inMap = (): Vector3 => room.localToWorld(head.clone());
  return { robot, room, place, head, look, inMap };
}

describe("where the operator stands", () => {
  it("is behind the robot at first, looking its way, with the feet on its floor and the head as high as it is", () => {
    const { place, room, robot, inMap } = standing();
    place.take("free", new Vector3());
    place.update(14, LEVEL);
    const head = inMap();
    expect(head.z).toBeCloseTo(0.1 + 1.6, 9);
    expect(Math.atan2(robot.position.y - head.y, robot.position.x - head.x)).toBeCloseTo(0.4, 9);
    const ahead = new Vector3(0, 0, -1).transformDirection(room.matrixWorld);
    expect(Math.atan2(ahead.y, ahead.x)).toBeCloseTo(0.4, 9);
    expect(ahead.z).toBeCloseTo(0, 9);
  });

  it("stays while one turns about oneself, whatever the turn", () => {
    fc.assert(fc.property(fc.double({ min: -7, max: 7, noNaN: true }), (angle) => {
      const { place, inMap } = standing();
      place.take("free", new Vector3());
      place.update(14, LEVEL);
      const before = inMap();
      place.turn(angle);
      expect(inMap().distanceTo(before)).toBeLessThan(1e-9);
    }));
  });

  it("goes with the robot that is ridden, without a jerk, and never turns or tilts the head unless that is asked for", () => {
    const { place, robot, room, inMap } = standing(0, 0, 0);
    place.take("ride", new Vector3());
    place.update(14, LEVEL);
    let [before, speed, jump] = [inMap().x, 0, 0];
    for (let tick = 1; tick <= 400; tick += 1) {
      // At full speed from one moment to the next, tilted and turning.
      const turn = new Quaternion(0.05, 0.02, Math.sin(tick / 400), Math.cos(tick / 400)).normalize();
      robot.set({ position: { x: 0.7 * tick / 72, y: 0, z: 0.1 }, orientation: turn }, true);
      place.update(1000 / 72, LEVEL);
      const now = inMap().x;
      jump = Math.max(jump, Math.abs((now - before) * 72 - speed));
      [speed, before] = [(now - before) * 72, now];
    }
    // The robot's own jump was one of 0.7 m/s in a frame.
    expect(jump).toBeLessThan(0.7 / 10);
    expect(robot.position.x - inMap().x).toBeLessThan(0.25);
    expect(place.speed).toBeCloseTo(0.7, 2);
    const ahead = new Vector3(0, 0, -1).transformDirection(room.matrixWorld);
    expect(ahead.distanceTo(new Vector3(1, 0, 0))).toBeLessThan(1e-9);
  });

  it("turns and tilts with the robot where that is set", () => {
    const { place, robot, room } = standing(0, 0, 0);
    place.take("ride", new Vector3());
    place.update(14, { turns: true, tilts: true });
    for (const heading of [0.2, 0.4, 0.6]) {
      const tilt = new Quaternion().setFromAxisAngle(new Vector3(1, 0, 0), 0.1);
      robot.set({ position: { x: 0, y: 0, z: 0.1 }, orientation: new Quaternion().setFromAxisAngle(new Vector3(0, 0, 1), heading).multiply(tilt) }, true);
      place.update(14, { turns: true, tilts: true });
    }
    expect(place.heading).toBeCloseTo(0.6, 6);
    const up = new Vector3(0, 1, 0).transformDirection(room.matrixWorld);
    expect(Math.acos(up.z)).toBeCloseTo(0.1, 6);
  });

  it("stays on the robot when the room's origin moves", () => {
    const { place, head, look, inMap } = standing();
    place.take("ride", new Vector3());
    place.update(14, LEVEL);
    const before = inMap();
    head.set(2.5, 1.6, 4);
    look();
    place.recentre();
    place.update(14, LEVEL);
    expect(inMap().distanceTo(before)).toBeLessThan(1e-9);
  });

  it("is before a table with the building on it, at 1 to 20, or wherever that table was found", () => {
    const { place, room } = standing();
    const middle = new Vector3(10, 5, 0);
    place.take("table", middle);
    place.update(14, LEVEL);
    const on = room.worldToLocal(middle.clone());
    expect([on.x, on.y, on.z]).toEqual([expect.closeTo(0.3, 9), expect.closeTo(TABLE.height, 9), expect.closeTo(-0.2 - TABLE.ahead, 9)]);
    expect(room.worldToLocal(new Vector3(30, 5, 0)).distanceTo(on)).toBeCloseTo(1, 9);
    place.putTable(new Vector3(1, 0.6, 1));
    place.update(14, LEVEL);
    expect(room.worldToLocal(middle.clone()).distanceTo(new Vector3(1, 0.6, 1))).toBeLessThan(1e-9);
  });
});
