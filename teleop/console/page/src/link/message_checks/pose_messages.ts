/** Messages that hold poses: transforms, odometry, the estimate, candidates, the attitude of the inertial unit. */

import type { PlanarCovariance, Pose, Quaternion, StampedPose } from "../../values";
import type { Field } from "./field";
import { frame, headerFrame, headerStamp, pose, quaternion, stampedPose, vector } from "./geometry";

/** Pose of one frame in another. */
export interface Transform extends Pose {
  readonly parent: string;
  readonly child: string;
  readonly stamp: number;
}

/** `tf2_msgs/TFMessage` and ROS 1's `tf/tfMessage`. */
export function readTransforms(message: Field): readonly Transform[] {
  return message.at("transforms").list(1000).map((item) => ({
    parent: headerFrame(item),
    child: frame(item.at("child_frame_id")),
    stamp: headerStamp(item),
    position: vector(item.at("transform").at("translation")),
    orientation: quaternion(item.at("transform").at("rotation")),
  }));
}

export interface Odometry {
  readonly parent: string;
  readonly child: string;
  readonly pose: StampedPose;
  /** Forward speed and turn rate [m/s, rad/s]. */
  readonly linear: number;
  readonly angular: number;
}

/** `nav_msgs/Odometry`. */
export function readOdometry(message: Field, receivedAt: number): Odometry {
  const twist = message.at("twist").at("twist");
  return {
    parent: headerFrame(message),
    child: frame(message.at("child_frame_id")),
    pose: stampedPose(message, message.at("pose").at("pose"), receivedAt),
    linear: twist.at("linear").at("x").within(-1e3, 1e3),
    angular: twist.at("angular").at("z").within(-1e3, 1e3),
  };
}

export interface Estimate {
  readonly frame: string;
  readonly pose: StampedPose;
  readonly covariance: PlanarCovariance;
}

/** Rows and columns of x, y and yaw in ROS's covariance of 6 by 6. */
const PLANAR = [0, 1, 5];

/** `geometry_msgs/PoseWithCovarianceStamped`. */
export function readEstimate(message: Field, receivedAt: number): Estimate {
  const part = message.at("pose").at("covariance");
  const all = part.numbers(36);
  if (all.length !== 36) {
    return part.fail("does not have 36 numbers");
  }
  const covariance = PLANAR.flatMap((row) => PLANAR.map((column) => all[6 * row + column] ?? NaN));
  const bad = covariance.some((value) => !(Math.abs(value) < 1e12));
  const diagonal = [0, 4, 8].map((i) => covariance[i] ?? NaN);
  if (bad || diagonal.some((value) => value < 0)) {
    return part.fail("is no covariance");
  }
  return {
    frame: headerFrame(message),
    pose: stampedPose(message, message.at("pose").at("pose"), receivedAt),
    covariance,
  };
}

/** `geometry_msgs/PoseArray`. */
export function readPoses(message: Field): readonly Pose[] {
  return message.at("poses").list(1000).map(pose);
}

export interface Inertial {
  readonly stamp: number;
  /** Undefined if the unit says that it has none. */
  readonly orientation: Quaternion | undefined;
}

/** `sensor_msgs/Imu`, of which the page uses the attitude. */
export function readInertial(message: Field): Inertial {
  // A covariance that begins with -1 says that there is no orientation (REP 145).
  const covariance = message.at("orientation_covariance");
  const absent = !covariance.missing && covariance.numbers(9)[0] === -1;
  return {
    stamp: headerStamp(message),
    orientation: absent ? undefined : quaternion(message.at("orientation")),
  };
}
