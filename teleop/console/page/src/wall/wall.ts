/** The page as a wall of screens around an operator who rides on the robot: it shows, and moves nothing. */

import { effect } from "@preact/signals";
import { Group } from "three";
import type { RobotWire } from "../link/robot_wire";
import type { RobotState } from "../robot/robot_state";
import { headingOf } from "../scene/geometry";
import type { Immersion } from "../scene/immersion";
import { CommonClock, StampedPoses } from "./common_clock";
import { screenCameras } from "./screen_camera";
import type { Wall } from "./wall_setting";

export interface WallParts {
  readonly immersion: Immersion;
  readonly state: RobotState;
  readonly wire: Pick<RobotWire, "call">;
}

/** How often the robot is asked something, to know the quickest round trip [ms]. */
const ASK = 200;

/** What a test or a measurement asks for: the stamp that is shown [s], and when it was [ms of the machine's clock]. */
export interface WallFigures {
  readonly stamp: number | undefined;
  readonly at: number;
}

/** Show the wall; return what tells of the newest picture. */
export function showWall(wall: Wall, { immersion, state, wire }: WallParts): () => WallFigures {
  const platform = new Group();
  const views = screenCameras(wall);
  platform.add(...views.map(({ camera }) => camera));
  const [clock, poses] = [new CommonClock(), new StampedPoses()];
  let shown: WallFigures = { stamp: undefined, at: 0 };
  effect(() => {
    const pose = state.mapFromBase.value;
    if (pose !== undefined) {
      poses.add(pose);
      clock.received(pose.stamp, pose.receivedAt);
    }
  });
  setInterval(() => {
    const asked = performance.now();
    void wire.call("/rosapi/get_time", {}).then((reply) => {
      if (reply.ok) {
        clock.answered(performance.now() - asked, performance.now());
      }
    });
  }, ASK);
  immersion.divide(platform, views, () => {
    const now = performance.now();
    const stamp = clock.stamp(now);
    const moving = stamp !== undefined && poses.moveTo(stamp);
    shown = { stamp, at: performance.timeOrigin + now };
    platform.position.copy(poses.position);
    platform.rotation.z = headingOf(poses.orientation); // level: a wall that tilted with each bump would make people ill
    return moving;
  });
  return () => shown;
}
