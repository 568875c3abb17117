import { beforeEach, describe, expect, it } from "vitest";
import { blockedFor, bumpFacts } from "../../src/alarms/alarm_facts";
import { watchSurroundings } from "../../src/page/surroundings";
import { unknownState, type RobotState } from "../../src/robot/robot_state";
import type { ControlState, StampedPose } from "../../src/values";
import { CONTROL, ME } from "../driving/harness";

const BODY = { min: { x: -0.25, y: -0.25 }, max: { x: 0.25, y: 0.25, z: 0.5 } };

function pose(stamp: number, x: number): StampedPose {
  return { position: { x, y: 0, z: 0 }, orientation: { x: 0, y: 0, z: 0, w: 1 }, stamp, receivedAt: 1000 * stamp };
}

function asked(linear: number): ControlState {
  return { ...CONTROL, state: "armed", controller: ME, armed: true, linear };
}

describe("what the page works out of the robot's surroundings", () => {
  let state: RobotState;
  const drive = (from: number, to: number, speed: number): void => {
    for (let stamp = from; stamp < to; stamp += 0.1) {
      state.mapFromBase.value = pose(stamp, speed * stamp);
    }
  };

  beforeEach(() => {
    state = unknownState();
    watchSurroundings(state, () => BODY);
  });

  it("holds a robot for blocked that is asked to move and stands, from the first moment on", () => {
    state.control.value = asked(0.5);
    drive(0, 3, 0);
    expect(state.motion.value?.linear).toBe(0);
    expect(blockedFor(state, 2900)).toBeGreaterThan(2.4);
    expect(blockedFor(state, 9000)).toBeUndefined();
  });

  it.each([["that moves", 0.5, 0.5], ["that is not asked to move", 0, 0], ["that turns its wheels to start", 0.05, 0]])(
    "does not for one %s", (_, wanted, speed) => {
      state.control.value = asked(wanted);
      drive(0, 3, speed);
      expect(blockedFor(state, 2900)).toBeUndefined();
    },
  );

  it("knows the nearest thing once there are points and a pose in the map", () => {
    const cloud = {
      stamp: 1, receivedAt: 1000, frame: "map", positions: new Float32Array([2, 0, 0.3]), distances: new Float32Array(1),
    };
    state.cloud.value = cloud;
    expect(state.nearest.value).toBeUndefined();
    drive(0, 0.2, 0);
    state.cloud.value = { ...cloud };
    expect(state.nearest.value?.distance).toBeCloseTo(1.75, 5);
  });
});

describe("a bump", () => {
  const ring = (...pressed: number[]): boolean[] => Array.from({ length: 5 }, (_, index) => pressed.includes(index));

  it.each([
    [ring(2), ring(), "in front"], [ring(0, 1), ring(), "in front, left"], [ring(4), ring(1, 2, 3), "in front, right and behind"],
  ])("is said with its side, as the station says it", (front, rear, words) => {
    expect(bumpFacts({ front, rear, receivedAt: 1000 }, 2500)).toEqual({ bump: words, bump_age: 1.5 });
  });

  it("is none as long as nothing was pressed", () => {
    expect(bumpFacts(undefined, 0)).toEqual({});
  });
});
