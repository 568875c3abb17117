/** How old data are: by the robot's clock, since their stamps are the robot's. */

import { robotTimeNow, type RobotState } from "./robot_state";

/** Data with the robot time that they are of [s], undefined if that is unknown, and when they came [ms]. */
export interface Dated {
  readonly stamp: number | undefined;
  readonly receivedAt: number;
}

/** How old something is. */
export interface DataAge {
  /** Its age [ms]. */
  readonly age: number;
  /** Whether it may be older: nothing said a time of the robot that is later than the data's. */
  readonly lowerBound: boolean;
}

/**
 * Return the age of data: the robot's time now less their stamp.
 *
 * The quickest word of the robot's time was half a round trip under way. No data are younger than the time since they came.
 */
export function dataAge(data: Dated, state: RobotState, roundTrip: number | undefined, now: number): DataAge {
  const here = Math.max(0, now - data.receivedAt);
  const robotNow = robotTimeNow(state, now);
  if (data.stamp === undefined || robotNow === undefined) {
    return { age: here, lowerBound: true };
  }
  const age = 1000 * (robotNow - data.stamp) + (roundTrip ?? 0) / 2;
  return age > here ? { age, lowerBound: false } : { age: here, lowerBound: true };
}
