/** What is nearest to the robot in the points that it sees now. */

import { headingOf } from "./geometry";
import type { CloudPoints, NearestObstacle, Pose } from "../values";

/** What is lower above the floor is driven over, or is the floor itself [m]. */
const LOWEST = 0.1;

/** The robot's body in its own frame [m]. */
export interface Body {
  readonly min: { readonly x: number; readonly y: number };
  readonly max: { readonly x: number; readonly y: number; readonly z: number };
}

/**
 * Return the nearest point beside the robot's body, from the floor to its top; undefined if there is none.
 *
 * @param points In the frame of `place`, in which the robot is at `place`.
 */
export function nearestObstacle(points: CloudPoints, place: Pose, body: Body): NearestObstacle | undefined {
  const heading = headingOf(place.orientation);
  const [c, s] = [Math.cos(heading), Math.sin(heading)];
  const { x: x0, y: y0, z: z0 } = place.position;
  let found: NearestObstacle | undefined;
  for (let at = 0; at + 2 < points.positions.length; at += 3) {
    const [x, y, z] = [(points.positions[at] ?? NaN) - x0, (points.positions[at + 1] ?? NaN) - y0, (points.positions[at + 2] ?? NaN) - z0];
    if (!(z > LOWEST && z < body.max.z)) {
      continue;
    }
    const [ahead, left] = [x * c + y * s, y * c - x * s];
    const distance = Math.hypot(
      Math.max(body.min.x - ahead, 0, ahead - body.max.x), Math.max(body.min.y - left, 0, left - body.max.y),
    );
    // What is inside the outline is the robot's own, such as its arm.
    if (distance > 0 && distance < (found?.distance ?? Infinity)) {
      found = { distance, bearing: Math.atan2(left, ahead), receivedAt: points.receivedAt };
    }
  }
  return found;
}
