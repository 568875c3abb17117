/** From a place on the floor to the steps that lead there. */

import type { StepGoal } from "../robot/robot_actions";
import type { FloorPoint } from "../scene/floor_pointer";
import { wrap } from "../scene/geometry";
import type { PlanarPose } from "../values";

/** What is farther aside is turned to on the spot first [rad]: a quarter turn is the most that one arc takes. */
const ASIDE = Math.PI / 4;
/** What is nearer is where the robot stands already [m]. */
const NEAREST = 0.1;

/** Return the steps to a point: one arc that begins along the robot's heading, or a turn and a straight step. */
export function wayTo(from: PlanarPose, to: FloorPoint): StepGoal[] {
  const [x, y] = [to.x - from.x, to.y - from.y];
  const away = Math.hypot(x, y);
  const aside = wrap(Math.atan2(y, x) - from.yaw);
  if (away < NEAREST) {
    return [];
  }
  if (Math.abs(aside) > ASIDE) {
    return [{ distance: 0, angle: aside, speed: 0, held: true }, { distance: away, angle: 0, speed: 0, held: true }];
  }
  // The circle that touches the heading turns by twice the angle of its chord.
  const arc = aside === 0 ? away : (away * aside) / Math.sin(aside);
  return [{ distance: arc, angle: 2 * aside, speed: 0, held: true }];
}

/** Return points of the way of steps from a pose on, about 10 cm apart [m]. */
export function pointsOf(from: PlanarPose, steps: readonly StepGoal[]): FloorPoint[] {
  let { x, y, yaw } = from;
  const points = [{ x, y }];
  for (const { distance, angle } of steps) {
    const count = Math.max(1, Math.ceil(Math.abs(distance) / 0.1));
    for (let part = 0; part < count; part += 1) {
      const middle = yaw + angle / count / 2;
      [x, y, yaw] = [x + (distance / count) * Math.cos(middle), y + (distance / count) * Math.sin(middle), yaw + angle / count];
      points.push({ x, y });
    }
  }
  return points;
}
