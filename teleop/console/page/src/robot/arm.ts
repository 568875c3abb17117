/** What the page knows of a robot's arm, and what it hears of it. */

import type { Pose } from "../values";

export interface ArmJoint {
  readonly name: string;
  /** What it turns, for people. */
  readonly turns: string;
  /** Smallest and largest angle [rad]. */
  readonly lower: number;
  readonly upper: number;
}

export interface NamedPose {
  readonly name: string;
  /** Of the joints [rad]. */
  readonly angles: readonly number[];
}

/** What does not change about the arm. */
export interface ArmInfo {
  readonly name: string;
  /** From the base. */
  readonly joints: readonly ArmJoint[];
  readonly gripperJoint: string;
  /** Of the gripper at its widest [m]. */
  readonly opening: number;
  /** Of the gripper, largest [N]. */
  readonly force: number;
  readonly poses: readonly NamedPose[];
  /** `base_from_arm_base`. */
  readonly mount: Pose;
}

/** What the arm does, and why it does not move. */
export interface ArmState {
  readonly stamp: number;
  /** idle, hand, twist, jog, pose, trajectory, plan or held. */
  readonly mode: string;
  readonly reason: string;
  /** What `/arm/way_out` would do, as a word and for people; empty for nothing. */
  readonly wayOut: string;
  readonly wayOutText: string;
  /** Angles of the joints, measured [rad]. */
  readonly angles: readonly number[];
  /** Torque of each joint's servo over its stall torque. */
  readonly load: readonly number[];
  /** `arm_base_from_tool0`, measured. */
  readonly tip: Pose;
  /** Of the gripper [m]. */
  readonly opening: number;
  /** Of its jaws together [N]. */
  readonly gripForce: number;
  readonly holding: boolean;
  readonly stowed: boolean;
}

/** A motion of the joints: its corners [rad], straight from each to the next. */
export type ArmPath = readonly (readonly number[])[];

/** What the robot says of a planned move that has not ended. */
export interface MoveProgress {
  /** planning, waiting or moving. */
  readonly state: string;
  /** Of the way that is done, 0 to 1. */
  readonly share: number;
  /** Empty where it has been told before. */
  readonly path: ArmPath;
}

/** How a planned move ended. */
export interface MoveEnd {
  /** `done`, or in a word why not; empty if the robot never began it. */
  readonly outcome: string;
  readonly message: string;
}

/** How a motion of the gripper ended. */
export interface GripEnd {
  /** Distance of the jaws [m]. */
  readonly opening: number;
  /** Whether they press on something. */
  readonly stalled: boolean;
  readonly reached: boolean;
}
