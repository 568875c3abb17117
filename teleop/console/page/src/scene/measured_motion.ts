/** How fast the robot moves, by where it is: neither what it was asked for nor what its wheels did. */

import { HELD } from "../operating_data";
import { headingOf, wrap } from "./geometry";
import type { MeasuredMotion, StampedPose } from "../values";

/** A pose that would need this speed [m/s] was set anew, by a hint or a search. */
const LEAP = 3;

/** Return a function that takes each pose and returns the motion, undefined while there are too few. */
export function motionMeter(): (pose: StampedPose | undefined) => MeasuredMotion | undefined {
  let poses: StampedPose[] = [];
  return (pose) => {
    const last = poses.at(-1);
    if (pose === undefined || (last !== undefined && (pose.stamp < last.stamp || leaps(last, pose)))) {
      poses = [];
    }
    if (pose === undefined) {
      return undefined;
    }
    if (pose.stamp !== poses.at(-1)?.stamp) {
      poses.push(pose);
    }
    while (poses.length > 2 && pose.stamp - (poses[1]?.stamp ?? 0) >= HELD.window) {
      poses.shift();
    }
    const first = poses[0];
    return first === undefined || pose.stamp - first.stamp < HELD.window / 2 ? undefined : between(first, pose);
  };
}

function between(first: StampedPose, last: StampedPose): MeasuredMotion {
  const time = last.stamp - first.stamp;
  const turned = wrap(headingOf(last.orientation) - headingOf(first.orientation));
  const middle = headingOf(first.orientation) + turned / 2;
  const [x, y] = [last.position.x - first.position.x, last.position.y - first.position.y];
  return {
    linear: (x * Math.cos(middle) + y * Math.sin(middle)) / time,
    angular: turned / time,
    receivedAt: last.receivedAt,
  };
}

function leaps(before: StampedPose, after: StampedPose): boolean {
  const way = Math.hypot(after.position.x - before.position.x, after.position.y - before.position.y);
  return way > 0.1 + LEAP * (after.stamp - before.stamp);
}
