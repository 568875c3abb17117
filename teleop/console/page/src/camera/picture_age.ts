/** How old a picture is: by the robot's clock, since both it and the camera's stamps are the robot's. */

import { robotTimeNow, type RobotState } from "../robot/robot_state";

/** A picture that is shown. */
export interface CameraPicture {
  /** A blob's address, which holds until two newer pictures have come. */
  readonly url: string;
  /** Robot time at which the camera saw it [s]; undefined if it is unknown. */
  readonly stamp: number | undefined;
  /** When it came [ms]. */
  readonly receivedAt: number;
}

/** How old a picture is. */
export interface PictureAge {
  /** Its age [ms]. */
  readonly age: number;
  /** Whether it may be older: nothing said a time of the robot that is later than the picture's. */
  readonly lowerBound: boolean;
}

/**
 * Return the age of a picture: the robot's time now less its stamp.
 *
 * The quickest word of the robot's time was half a round trip under way. No picture is younger than the time since it came.
 */
export function pictureAge(
  picture: CameraPicture, state: RobotState, roundTrip: number | undefined, now: number,
): PictureAge {
  const here = Math.max(0, now - picture.receivedAt);
  const robotNow = robotTimeNow(state, now);
  if (picture.stamp === undefined || robotNow === undefined) {
    return { age: here, lowerBound: true };
  }
  const age = 1000 * (robotNow - picture.stamp) + (roundTrip ?? 0) / 2;
  return age > here ? { age, lowerBound: false } : { age: here, lowerBound: true };
}
