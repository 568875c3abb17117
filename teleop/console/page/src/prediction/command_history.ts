/** The commands that the robot follows now, and those that are on their way to it; as `command_history.py` has it. */

import type { ControlState } from "../values";
import type { Command } from "./predicted_motion";

/** Time for which what was in force is kept [s]: from rest to full speed the robot takes 1.4 s. */
const KEPT = 2;
/** By so much a command may come later than it was expected [s]; until then what the robot says does not overrule it. */
const VARIES = 0.1;
/** Distance of the robot's corners from its middle, by which turn rates are compared with speeds [m]. */
const RADIUS = 0.4;
/** Two motions are alike if they differ by less than this angle, as forward speed and that of a corner. */
const ALIKE = Math.cos((12 * Math.PI) / 180);

export class CommandHistory {
  #followed: Command[] = [];
  #sent: Command[] = [];
  #arrived: Command | undefined;
  #newest: ControlState | undefined;

  /** What the robot said last. */
  get newest(): ControlState | undefined {
    return this.#newest;
  }

  /** Take what the robot says is in force. */
  followed(state: ControlState): void {
    const at = state.stamp;
    if (at < (this.#newest?.stamp ?? -Infinity)) {
      this.clear();
    }
    this.#newest = state;
    this.#followed.push({ at, forward: state.linear, turn: state.angular });
    this.#followed = this.#followed.filter((command) => command.at >= at - KEPT);
    this.#arrived = this.#sent.filter((command) => command.at <= at - VARIES).at(-1) ?? this.#arrived;
    this.#sent = this.#sent.filter((command) => command.at > at - VARIES);
  }

  /** Take what was sent, with the time at which it will be in force [s]. */
  sent(command: Command): void {
    this.#sent.push(command);
  }

  clear(): void {
    [this.#followed, this.#sent, this.#arrived, this.#newest] = [[], [], undefined, undefined];
  }

  /** All of them in their order; those on their way at the speed at which the robot will follow them. */
  get commands(): readonly Command[] {
    return [...this.#followed, ...this.#sent.map((command) => this.#letThrough(command))];
  }

  /** What is asked for now: what was sent last, or what the robot follows. */
  get stick(): Command | undefined {
    return this.#sent.at(-1) ?? this.#followed.at(-1);
  }

  /** What the guard was asked for when the robot spoke last; undefined if that is not known. */
  get asked(): Command | undefined {
    const state = this.#newest;
    const share = state?.pace?.guard ?? 1;
    if (state !== undefined && share > 0) {
      return { at: state.stamp, forward: state.linear / share, turn: state.angular / share };
    }
    return this.#sent.filter(({ at }) => state !== undefined && at <= state.stamp).at(-1) ?? this.#arrived;
  }

  #letThrough(command: Command): Command {
    const { guard, late } = this.#newest?.pace ?? { guard: 1, late: 1 };
    const share = alike(command, this.asked) ? guard * late : late;
    return { at: command.at, forward: share * command.forward, turn: share * command.turn };
  }
}

/** Whether two commands are of the same arc, about. */
export function alike(one: Command | undefined, other: Command | undefined): boolean {
  if (one === undefined || other === undefined) {
    return false;
  }
  const lengths = Math.hypot(one.forward, RADIUS * one.turn) * Math.hypot(other.forward, RADIUS * other.turn);
  return lengths > 0 && one.forward * other.forward + RADIUS * RADIUS * one.turn * other.turn >= ALIKE * lengths;
}
