import fc from "fast-check";
import { Group, Vector3 } from "three";
import { describe, expect, it } from "vitest";
import { CommonClock, SHOWN_AGE, StampedPoses } from "../../src/wall/common_clock";
import { screenCameras } from "../../src/wall/screen_camera";
import { wallOf } from "../../src/wall/wall_setting";

/** Three screens of 2 m by 1.5 m about a person: to the left, ahead, to the right. */
const THREE = "?screen=0,1,1.2,90,2,1.5&screen=1,0,1.2,0,2,1.5&screen=0,-1,1.2,-90,2,1.5";

function cameras(query: string) {
  const wall = wallOf(query);
  if (wall === undefined) {
    throw new Error("no wall");
  }
  const views = screenCameras(wall);
  const platform = new Group().add(...views.map(({ camera }) => camera));
  platform.updateMatrixWorld(true);
  return views;
}

describe("a wall of screens", () => {
  it("has what is seen behind the edge of two screens at the same height of both, wherever the eye is", () => {
    const inside = (most: number) => fc.double({ min: -most, max: most, noNaN: true });
    fc.assert(fc.property(inside(0.8), inside(0.8), fc.double({ min: 0.5, max: 2, noNaN: true }), inside(0.7), fc.double({ min: 1, max: 30, noNaN: true }), (x, y, z, up, times) => {
      const views = cameras(`${THREE}&eye=${x},${y},${z}`);
      for (const [left, side] of [[0, 1], [1, -1]] as const) {
        // A place of the edge, and what lies behind it as the eye sees it.
        const eye = new Vector3(x, y, z);
        const place = new Vector3(1, side, 1.2 + up).sub(eye).multiplyScalar(times).add(eye);
        const [before, after] = [views[left], views[left + 1]].map((view) => place.clone().project(view?.camera ?? fail()));
        expect(before?.x).toBeCloseTo(1, 8);
        expect(after?.x).toBeCloseTo(-1, 8);
        expect(before?.y).toBeCloseTo(after?.y ?? NaN, 8);
      }
    }));
  });

  it("divides the window among screens and, in stereo, among eyes that are as far apart as is said", () => {
    expect(cameras(THREE).map(({ left, width }) => [left, width])).toEqual([[0, 1 / 3], [1 / 3, 1 / 3], [2 / 3, 1 / 3]]);
    const eyes = cameras("?screen=1,0,1.2,0,2,1.5&stereo=0.064");
    expect(eyes.map(({ left, width, camera }) => [left, width, camera.position.y])).toEqual([[0, 0.5, 0.032], [0.5, 0.5, -0.032]]);
  });

  it.each([
    ["?screen=1,0,1.2", "6 numbers"], ["?screen=1,0,1.2,0,2,x", "6 numbers"], ["?screen=1,0,1.2,0,0,1", "width and height"],
    ["?screen=1,0,1.2,180,2,1", "does not face"], ["?screen=1,0,1.2,0,2,1&eye=1", "3 numbers"], ["?screen=1,0,1.2,0,2,1&stereo=", "a number"],
  ])("of a wrong address %s says what would have been right", (query, words) => {
    expect(() => wallOf(query)).toThrow(words);
  });

  it("is none without a screen", () => {
    expect(wallOf("?eye=0,0,1")).toBeUndefined();
  });
});

describe("the moment that all screens show", () => {
  it("is the same on links of different delay, also where some words of the robot come late", () => {
    const stamps = [2, 120].map((way) => {
      const clock = new CommonClock();
      for (let now = 0; now <= 5000; now += 50) {
        const late = now % 300 === 0 ? 0 : 40;
        clock.received(100 + (now - way - late) / 1000, now);
        clock.answered(2 * way + late, now);
      }
      return clock.stamp(5000);
    });
    expect(stamps[0]).toBeCloseTo(105 - SHOWN_AGE, 6);
    expect(stamps[1]).toBeCloseTo(105 - SHOWN_AGE, 6);
  });

  it("is unknown before the robot said a time", () => {
    expect(new CommonClock().stamp(5000)).toBeUndefined();
  });

  it("lies between two poses, and after the last one waits there", () => {
    const poses = new StampedPoses();
    const pose = (stamp: number, x: number) => ({ stamp, receivedAt: 0, position: { x, y: 0, z: 0 }, orientation: { x: 0, y: 0, z: 0, w: 1 } });
    expect(poses.moveTo(1)).toBe(false);
    poses.add(pose(1, 10));
    poses.add(pose(2, 20));
    expect([poses.moveTo(1.25), poses.position.x]).toEqual([true, 12.5]);
    expect([poses.moveTo(9), poses.position.x]).toEqual([false, 20]);
    expect([poses.moveTo(0), poses.position.x]).toEqual([true, 10]);
    // The robot began anew.
    poses.add(pose(0.5, 3));
    expect([poses.moveTo(9), poses.position.x]).toEqual([false, 3]);
  });
});

function fail(): never {
  throw new Error("there is no such view");
}
