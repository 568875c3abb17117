/** What is shown of the future: the way to where a command sent now takes effect, and the path of the stick as it is. */

import type { DriveLimits } from "../values";
import { alike, type CommandHistory } from "./command_history";
import { predicted, TICK, type Motion } from "./predicted_motion";

/** Length of the path [s]: at 0.7 m/s 2.1 m, less than the guard sees. */
export const SECONDS = 3;

/** Motions tick by tick, from the known pose on, in its frame. */
export interface Foresight {
  readonly motions: readonly Motion[];
  /** Index of the one at which a command that is sent now takes effect; beyond the end where the guard stops before. */
  readonly effect: number;
  /** Whether the guard would end the path. */
  readonly cut: boolean;
}

/**
 * Return what is shown.
 *
 * @param stamp Time of the known pose, by the robot's clock [s].
 * @param effect Time at which a command that is sent now takes effect [s].
 */
export function foreseen(history: CommandHistory, stamp: number, effect: number, limits: DriveLimits): Foresight {
  const known = { x: 0, y: 0, yaw: 0, forward: 0, turn: 0 };
  const motions = predicted(known, stamp, history.commands, effect + SECONDS, limits);
  const end = stoppedAt(history, stamp, motions);
  return { motions: motions.slice(0, end), effect: Math.round((effect - stamp) / TICK), cut: end < motions.length };
}

/** Return how many of the motions the guard would let pass, as far as it has looked along their arc. */
function stoppedAt(history: CommandHistory, stamp: number, motions: readonly Motion[]): number {
  const { newest, asked } = history;
  if (newest === undefined || asked === undefined || !alike(history.stick, asked)) {
    return motions.length;
  }
  const by = Math.abs(asked.forward) > 0.1 * Math.abs(asked.turn) ? "forward" : "turn";
  let gone = 0;
  const end = motions.findIndex((motion, index) => {
    gone += stamp + index * TICK > newest.stamp ? TICK * Math.abs(motion[by] / asked[by]) : 0;
    return gone > (newest.pace?.ahead ?? Infinity);
  });
  return end < 0 ? motions.length : end;
}
