/** Geometry of hints on the floor: poses in `map`, metres and radians, headings left positive (REP 103). */

import type { FloorPoint } from "../scene/floor_pointer";
import type { PlanarPose, Pose, Quaternion } from "../values";

/** A drag shorter than this gives no heading [m]: a finger's tremble would decide where the robot looks. */
export const SHORTEST_DRAG = 0.3;

/** Return an angle [rad] as one from -π to π, π itself excluded. */
export function wrapAngle(angle: number): number {
  const wrapped = (angle + Math.PI) % (2 * Math.PI);
  return (wrapped < 0 ? wrapped + 2 * Math.PI : wrapped) - Math.PI;
}

/** Return the heading of an orientation [rad]: the direction of its x axis on the floor. */
export function headingOf(q: Quaternion): number {
  return Math.atan2(2 * (q.w * q.z + q.x * q.y), q.w * q.w + q.x * q.x - q.y * q.y - q.z * q.z);
}

/** Return a pose's part on the floor. */
export function planar(pose: Pose): PlanarPose {
  return { x: pose.position.x, y: pose.position.y, yaw: headingOf(pose.orientation) };
}

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
  return { x: pose.x, y: pose.y, yaw: wrapAngle(pose.yaw + angle) };
}

/** Return whether two poses are the same within a distance [m] and an angle [rad]. */
export function samePose(a: PlanarPose, b: PlanarPose, distance = 0.02, angle = 0.02): boolean {
  return Math.hypot(a.x - b.x, a.y - b.y) <= distance && Math.abs(wrapAngle(a.yaw - b.yaw)) <= angle;
}

/** Return whether all numbers of a pose are finite. */
export function isFinitePose(pose: PlanarPose): boolean {
  return Number.isFinite(pose.x) && Number.isFinite(pose.y) && Number.isFinite(pose.yaw);
}
