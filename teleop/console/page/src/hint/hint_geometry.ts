/** Geometry of hints on the floor: poses in `map`, metres and radians, headings left positive (REP 103). */

import type { FloorPoint } from "../scene/floor_pointer";
import { wrap } from "../scene/geometry";
import type { PlanarPose } from "../values";

/** A drag shorter than this gives no heading [m]: a finger's tremble would decide where the robot looks. */
export const SHORTEST_DRAG = 0.3;

/**
 * Return the heading from one point to another [rad], or undefined if they are nearer to each other than `shortest` [m].
 */
export function headingOfDrag(from: FloorPoint, to: FloorPoint, shortest = SHORTEST_DRAG): number | undefined {
  const dx = to.x - from.x;
  const dy = to.y - from.y;
  return Math.hypot(dx, dy) < shortest ? undefined : Math.atan2(dy, dx);
}

/** Return the pose moved in the map [m]. */
export function moved(pose: PlanarPose, dx: number, dy: number): PlanarPose {
  return { x: pose.x + dx, y: pose.y + dy, yaw: pose.yaw };
}

/** Return the pose turned on the spot [rad]. */
export function turned(pose: PlanarPose, angle: number): PlanarPose {
  return { x: pose.x, y: pose.y, yaw: wrap(pose.yaw + angle) };
}

/** Return whether two poses are the same within a distance [m] and an angle [rad]. */
export function samePose(a: PlanarPose, b: PlanarPose, distance = 0.02, angle = 0.02): boolean {
  return Math.hypot(a.x - b.x, a.y - b.y) <= distance && Math.abs(wrap(a.yaw - b.yaw)) <= angle;
}

/** Return whether all numbers of a pose are finite. */
export function isFinitePose(pose: PlanarPose): boolean {
  return Number.isFinite(pose.x) && Number.isFinite(pose.y) && Number.isFinite(pose.yaw);
}
