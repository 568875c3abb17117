/** Where the robot stands in the picture, and what of the world is to be seen. */

import type { RobotState } from "../robot/robot_state";
import type { Health, Pose } from "../values";
import type { Bounds } from "./geometry";

/** Room beside the map for a robot that does not know its place [m]. */
export const WAITING_RADIUS = 8;

const DOUBTFUL: readonly Health[] = ["suspect", "lost", "relocalising", "slipping"];

/** Whether the robot itself doubts its place. */
export function isDoubtful(health: Health | undefined): boolean {
  return health !== undefined && DOUBTFUL.includes(health);
}

/**
 * Return the robot's pose in the world of the picture; undefined while its place in the map is not known.
 *
 * A robot without any map is shown in its odometry's frame.
 */
export function worldFromBase(state: RobotState): Pose | undefined {
  const located = state.mapFromBase.value;
  const grid = state.gridMap.value;
  const odometryIsWorld = state.mapPoints.value === undefined && state.mapInfo.value === undefined
    && (grid === undefined || grid.frame === "odom");
  return located ?? (odometryIsWorld ? state.odomFromBase.value : undefined);
}

/** Return where a robot waits that does not know its place: left of the map, or below it in an upright picture. */
export function waitingPose(map: Bounds | undefined, floor: number, isUpright: boolean): Pose {
  const orientation = { x: 0, y: 0, z: 0, w: 1 };
  if (map === undefined) {
    return { position: { x: 0, y: 0, z: floor }, orientation };
  }
  const aside = WAITING_RADIUS + 1;
  const [x, y] = isUpright
    ? [(map.min.x + map.max.x) / 2, map.min.y - aside]
    : [map.min.x - aside, (map.min.y + map.max.y) / 2];
  return { position: { x, y, z: floor }, orientation };
}

/** Return the bounds of the map together with the place where a robot waits. */
export function worldBounds(map: Bounds | undefined, floor: number, waiting: Pose | undefined): Bounds | undefined {
  if (waiting === undefined) {
    return map && { min: { ...map.min, z: floor }, max: map.max };
  }
  const { x, y } = waiting.position;
  const [min, max] = [map?.min ?? waiting.position, map?.max ?? waiting.position];
  return {
    min: { x: Math.min(min.x, x - WAITING_RADIUS), y: Math.min(min.y, y - WAITING_RADIUS), z: floor },
    max: { x: Math.max(max.x, x + WAITING_RADIUS), y: Math.max(max.y, y + WAITING_RADIUS), z: max.z },
  };
}
