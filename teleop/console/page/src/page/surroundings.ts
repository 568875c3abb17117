/** What the page itself works out from the robot's poses and points: how fast it moves, what is near, what holds it. */

import { effect } from "@preact/signals";
import { setIfChanged } from "../driving/set_if_changed";
import { HELD } from "../operating_data";
import type { RobotState } from "../robot/robot_state";
import { motionMeter } from "../scene/measured_motion";
import { nearestObstacle, type Body } from "../scene/nearest_obstacle";

/** Keep `motion`, `nearest` and `blockedSince` of a state true to its poses and points. */
export function watchSurroundings(state: RobotState, body: () => Body): void {
  const meter = motionMeter();
  effect(() => { setIfChanged(state.motion, meter(state.mapFromBase.value)); });
  effect(() => {
    const cloud = state.cloud.value;
    const place = state.mapFromBase.peek();
    state.nearest.value = cloud && place && cloud.frame === "map" ? nearestObstacle(cloud, place, body()) : undefined;
  });
  effect(() => {
    const [asked, motion] = [state.control.value, state.motion.value];
    const held = asked !== undefined && motion !== undefined && isHeld(asked, motion);
    state.blockedSince.value = held ? state.blockedSince.peek() ?? motion.receivedAt : undefined;
  });
}

interface Velocity {
  readonly linear: number;
  readonly angular: number;
}

function isHeld(asked: Velocity, motion: Velocity): boolean {
  return exceeds(asked, HELD.asked) && !exceeds(motion, HELD.stands);
}

function exceeds(speed: Velocity, limit: Velocity): boolean {
  return Math.abs(speed.linear) > limit.linear || Math.abs(speed.angular) > limit.angular;
}
