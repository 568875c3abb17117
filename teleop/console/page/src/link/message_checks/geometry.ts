/** Stamps, vectors, rotations and poses, of which most messages consist. */

import type { Pose, Quaternion, StampedPose, Vector3 } from "../../values";
import type { Field } from "./field";

/** Frames of ROS 1 may begin with a slash; those of ROS 2 do not. */
export function frame(field: Field): string {
  return field.text().replace(/^\//, "");
}

/** Time [s] of a stamp, in the words of ROS 2 (`sec`, `nanosec`) or ROS 1 (`secs`, `nsecs`). */
export function stamp(field: Field): number {
  const sec = field.at("sec").missing ? field.at("secs") : field.at("sec");
  const nanosec = field.at("nanosec").missing ? field.at("nsecs") : field.at("nanosec");
  return sec.within(-1e12, 1e12) + nanosec.within(0, 4.3e9) * 1e-9;
}

/** Time [s] of a message's header. */
export function headerStamp(message: Field): number {
  return stamp(message.at("header").at("stamp"));
}

export function headerFrame(message: Field): string {
  return frame(message.at("header").at("frame_id"));
}

/** A place [m]. */
export function vector(field: Field): Vector3 {
  return { x: field.at("x").coordinate(), y: field.at("y").coordinate(), z: field.at("z").coordinate() };
}

/** A rotation of length 1; one that is far from it is refused, as ROS's own tools do. */
export function quaternion(field: Field): Quaternion {
  const part = (name: string): number => field.at(name).within(-2, 2);
  const [x, y, z, w] = [part("x"), part("y"), part("z"), part("w")];
  const length = Math.hypot(x, y, z, w);
  if (Math.abs(length - 1) > 0.1) {
    return field.fail("is not of length 1");
  }
  return { x: x / length, y: y / length, z: z / length, w: w / length };
}

export function pose(field: Field): Pose {
  return { position: vector(field.at("position")), orientation: quaternion(field.at("orientation")) };
}

/** A pose with the stamp of its message's header. */
export function stampedPose(message: Field, at: Field, receivedAt: number): StampedPose {
  return { ...pose(at), stamp: headerStamp(message), receivedAt };
}
