/** Velocities of the arm's tip along the axes that a person chose, and rates of single joints. */

import type { ArmInfo } from "../../robot/arm";
import type { Gear } from "../../operating_data";
import type { Vector3 } from "../../values";
import type { ArmWish } from "./arm_wish";

export const TIP_FRAMES = ["base", "tool", "view"] as const;
/** Axes of the tip's motion: of the arm's base, of the gripper, or as the picture is looked at. */
export type TipFrame = (typeof TIP_FRAMES)[number];

/** Speeds by the gear: of the tip [m/s], of its turning [rad/s] and of a joint [rad/s]. */
export const SPEEDS: Readonly<Record<Gear, { readonly tip: number; readonly turn: number; readonly joint: number }>> = {
  precision: { tip: 0.02, turn: 0.15, joint: 0.15 },
  normal: { tip: 0.08, turn: 0.5, joint: 0.5 },
  turbo: { tip: 0.2, turn: 1, joint: 1.2 },
};

/** Deflections, each -1 to 1: ahead, left, up; turned to point higher and farther left. */
export interface TipDeflection {
  readonly ahead: number;
  readonly left: number;
  readonly up: number;
  readonly raise: number;
  readonly turnLeft: number;
}

export const TIP_AT_REST: TipDeflection = { ahead: 0, left: 0, up: 0, raise: 0, turnLeft: 0 };

/**
 * Return what moves the tip. It turns about the gripper's own axes in any frame: about others a part of the turn would
 * be one about the gripper's length, which the arm cannot make.
 *
 * @param heading Direction in which the picture is looked at, in the arm's base [rad].
 */
export function tipWish(at: TipDeflection, frame: TipFrame, heading: number, gear: Gear): ArmWish {
  const { tip, turn } = SPEEDS[gear];
  const angular: Vector3 = { x: 0, y: -turn * at.raise || 0, z: turn * at.turnLeft || 0 };
  if (angular.y !== 0 || angular.z !== 0) {
    return { kind: "twist", frame: "tool0", angular, linear: { x: 0, y: 0, z: 0 } };
  }
  const [c, s] = frame === "view" ? [Math.cos(heading), Math.sin(heading)] : [1, 0];
  const linear = { x: tip * (c * at.ahead - s * at.left), y: tip * (s * at.ahead + c * at.left), z: tip * at.up };
  return { kind: "twist", frame: frame === "tool" ? "tool0" : "arm_base", linear, angular };
}

/** Return what moves one joint. @param share Of the gear's rate, -1 to 1. */
export function jointWish(info: ArmInfo, joint: number, share: number, gear: Gear): ArmWish {
  return {
    kind: "jog", names: info.joints.map(({ name }) => name),
    rates: info.joints.map((_, at) => (at === joint ? share * SPEEDS[gear].joint : 0)),
  };
}

/** Difference of angles at which a joint goes at its full rate [rad], and the one that counts as none. */
const FULL_FROM = 0.12;
const THERE = 0.004;

/** Return what brings a joint to an angle, slower as it comes near. */
export function jointTowards(info: ArmInfo, joint: number, wanted: number, measured: number, gear: Gear): ArmWish {
  const away = wanted - measured;
  return jointWish(info, joint, Math.abs(away) < THERE ? 0 : Math.max(-1, Math.min(1, away / FULL_FROM)), gear);
}
