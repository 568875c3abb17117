/** The arm: what it is, what it does, and how its goals go on. */

import type { ArmInfo, ArmPath, ArmState, GripEnd, MoveEnd, MoveProgress } from "../../robot/arm";
import type { Field } from "./field";
import { headerStamp, pose } from "./geometry";

/** The page shows arms of this many joints at most, and ways of this many corners. */
const MOST_JOINTS = 12;
const MOST_POSES = 100;
const MOST_CORNERS = 10_000;
/** No joint turns farther [rad], and no gripper opens wider [m] or presses more [N]. */
const FARTHEST = 100;
const LARGEST = 1e6;

function angles(field: Field, count?: number): readonly number[] {
  const values = field.numbers(MOST_JOINTS * MOST_POSES);
  if (count !== undefined && values.length !== count) {
    field.fail("does not have a number for each joint");
  }
  return Array.from(values, (value) => (Math.abs(value) <= FARTHEST ? value : field.fail("has an angle that is none")));
}

/** `farsteer_msgs/ArmInfo`. */
export function readArmInfo(message: Field): ArmInfo {
  const names = message.at("joints").list(MOST_JOINTS).map((name) => name.text());
  const turns = message.at("turns").list(MOST_JOINTS).map((name) => name.text());
  const [lower, upper] = [angles(message.at("lower"), names.length), angles(message.at("upper"), names.length)];
  const poses = message.at("pose_names").list(MOST_POSES).map((name) => name.text());
  const all = angles(message.at("pose_angles"), poses.length * names.length);
  return {
    name: message.at("name").text(),
    joints: names.map((name, at) => ({ name, turns: turns[at] ?? name, lower: lower[at] ?? 0, upper: upper[at] ?? 0 })),
    gripperJoint: message.at("gripper_joint").text(),
    opening: message.at("opening").within(0, LARGEST),
    force: message.at("force").within(0, LARGEST),
    poses: poses.map((name, at) => ({ name, angles: all.slice(at * names.length, (at + 1) * names.length) })),
    mount: pose(message.at("mount")),
  };
}

/** `farsteer_msgs/ArmState`. */
export function readArmState(message: Field): ArmState {
  const measured = angles(message.at("angles"));
  return {
    stamp: headerStamp(message),
    mode: message.at("mode").text(),
    reason: message.at("reason").text(1000),
    wayOut: message.at("way_out").text(),
    wayOutText: message.at("way_out_text").text(),
    angles: measured,
    load: angles(message.at("load"), measured.length),
    tip: pose(message.at("tip")),
    opening: message.at("opening").within(-LARGEST, LARGEST),
    gripForce: message.at("grip_force").within(-LARGEST, LARGEST),
    holding: message.at("holding").boolean(),
    stowed: message.at("stowed").boolean(),
  };
}

/** `sensor_msgs/JoyFeedbackArray`: the strength of the vibration, 0 to 1. */
export function readRumble(message: Field): number {
  return Math.max(0, ...message.at("array").list(100).map((one) => one.at("intensity").within(0, 1)));
}

function path(field: Field): ArmPath {
  return field.at("points").list(MOST_CORNERS).map((point) => angles(point.at("positions")));
}

/** Feedback of `farsteer_msgs/ArmMove`. */
export function readMoveProgress(values: Field): MoveProgress {
  return { state: values.at("state").text(), share: values.at("share").within(0, 1), path: path(values.at("path")) };
}

/** Result of `farsteer_msgs/ArmMove`. */
export function readMoveEnd(values: Field): MoveEnd {
  return { outcome: values.at("outcome").text(), message: values.at("message").text(1000) };
}

/** Result of `control_msgs/GripperCommand`. */
export function readGripEnd(values: Field): GripEnd {
  return {
    opening: values.at("position").within(-LARGEST, LARGEST),
    stalled: values.at("stalled").boolean(),
    reached: values.at("reached_goal").boolean(),
  };
}
