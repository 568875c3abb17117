/** How far a step goes and how fast: what a person enters, and what may be. */

import type { StepGoal } from "../robot/robot_actions";
import { stepTexts as texts } from "../texts/steps";

export const DIRECTIONS = ["forward", "back", "left", "right"] as const;
export type StepDirection = (typeof DIRECTIONS)[number];

/** Presets and limits; the upper limits are the robot's own. */
export const DISTANCE = { presets: [0.1, 0.25, 0.5, 1, 2], initial: 0.5, min: 0.01, max: 100, unit: "m" } as const;
export const ANGLE = { presets: [5, 15, 45, 90, 180], initial: 15, min: 0.5, max: 360, unit: "°" } as const;

export const PACES = ["own", "slow", "fast"] as const;
export type Pace = (typeof PACES)[number];

/** Speed of straight steps [m/s] and of turns [rad/s]; 0 is the robot's own. */
export const SPEEDS: Readonly<Record<Pace, { readonly straight: number; readonly turn: number }>> = {
  own: { straight: 0, turn: 0 },
  slow: { straight: 0.1, turn: 0.2 },
  fast: { straight: 0.6, turn: 1 },
};

/** A size as it was entered: a number within its limits, or what is wrong with it. */
export type Size =
  | { readonly ok: true; readonly value: number }
  | { readonly ok: false; readonly words: string };

interface Range {
  readonly min: number;
  readonly max: number;
  readonly unit: string;
}

/** Read a size from a field; a comma is taken as the decimal point. */
export function readSize(name: string, entered: string, range: Range): Size {
  const text = entered.trim().replace(",", ".");
  const value = /^\+?(\d+\.?\d*|\.\d+)$/.test(text) ? Number(text) : NaN;
  const fits = value >= range.min && value <= range.max;
  return fits ? { ok: true, value } : { ok: false, words: texts.outOfRange(name, range, entered.trim().slice(0, 20)) };
}

/** Return the goal of a step. @param size Distance [m] or angle [degrees]. */
export function stepGoal(direction: StepDirection, size: number, pace: Pace): StepGoal {
  const { straight, turn } = SPEEDS[pace];
  if (direction === "forward" || direction === "back") {
    return { distance: direction === "forward" ? size : -size, angle: 0, speed: straight };
  }
  const angle = (size * Math.PI) / 180;
  return { distance: 0, angle: direction === "left" ? angle : -angle, speed: turn };
}

/** Return the share of a step that is driven, 0 to 1. */
export function shareDriven(goal: StepGoal, driven: { readonly distance: number; readonly angle: number }): number {
  const share = goal.distance === 0 ? driven.angle / goal.angle : driven.distance / goal.distance;
  return Number.isFinite(share) ? Math.min(1, Math.max(0, share)) : 0;
}
