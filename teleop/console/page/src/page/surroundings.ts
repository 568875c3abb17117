/** What the page itself works out from the robot's poses and points: how fast it moves, what is near, what holds it. */

import { effect } from "@preact/signals";
import { setIfChanged } from "../driving/set_if_changed";
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

/** Speeds from which the robot is asked to move, and below which it does not [m/s, rad/s]. */
const ASKED = { linear: 0.1, angular: 0.3 };
const STANDS = { linear: 0.03, angular: 0.08 };

interface Velocity {
  readonly linear: number;
  readonly angular: number;
}

function isHeld(asked: Velocity, motion: Velocity): boolean {
  const wants = Math.abs(asked.linear) > ASKED.linear || Math.abs(asked.angular) > ASKED.angular;
  return wants && Math.abs(motion.linear) < STANDS.linear && Math.abs(motion.angular) < STANDS.angular;
}
