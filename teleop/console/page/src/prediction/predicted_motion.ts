/**
 * Where the robot will be: its pose as it is known, carried on by the commands that it has not answered yet.
 *
 * `teleop/prediction/predicted_motion.py` says the same, explains it, and is what `benchmarks path` measures; both are tested
 * by `tests/teleop/prediction/predictions.json`.
 */

import type { DriveLimits } from "../values";

/** Step of the prediction [s]: the robot's tick. */
export const TICK = 0.02;

/** A motion that is asked of the wheels from a time of the robot's clock on [s, m/s, rad/s]. */
export interface Command {
  readonly at: number;
  readonly forward: number;
  readonly turn: number;
}

/** A pose in the plane with its speeds [m, rad, m/s, rad/s]. */
export interface Motion {
  readonly x: number;
  readonly y: number;
  readonly yaw: number;
  readonly forward: number;
  readonly turn: number;
}

type Speeds = Pick<Motion, "forward" | "turn">;

/**
 * Return the motion tick by tick, from the known pose on.
 *
 * @param known Pose at `stamp`; its speeds count only without any command.
 * @param stamp Time of what is known [s].
 * @param commands In the order of their times, from some time before the stamp on; the last one stays in force.
 * @param until Time to predict to [s].
 */
export function predicted(known: Motion, stamp: number, commands: readonly Command[], until: number, limits: DriveLimits): Motion[] {
  const first = commands[0];
  let speeds: Speeds = first ?? known;
  for (const command of first === undefined ? [] : followedIn(commands, first.at, stamp, limits.lag)) {
    speeds = ramped(speeds, command, limits);
  }
  let motion: Motion = { ...known, forward: speeds.forward, turn: speeds.turn };
  const motions = [motion];
  for (const command of followedIn(commands, stamp, until, limits.lag)) {
    motion = moved(motion, ramped(motion, command, limits));
    motions.push(motion);
  }
  return motions;
}

/** Return the command that the wheels follow in each tick between two times [s]; undefined before the first. */
function followedIn(commands: readonly Command[], begin: number, end: number, lag: number): (Command | undefined)[] {
  const count = Math.max(0, Math.floor((end - begin) / TICK + 1e-6));
  let newest = -1;
  return Array.from({ length: count }, (_, tick) => {
    while ((commands[newest + 1]?.at ?? Infinity) <= begin + (tick + 1) * TICK - lag) {
      newest += 1;
    }
    return commands[newest];
  });
}

function ramped(speeds: Speeds, command: Command | undefined, limits: DriveLimits): Speeds {
  return command === undefined ? speeds : {
    forward: ramp(speeds.forward, command.forward, limits.acceleration, limits.braking),
    turn: ramp(speeds.turn, command.turn, limits.turnAcceleration, limits.turnBraking),
  };
}

/** Return a speed a tick later: slowing down by `loss`, else by `gain`, at rest before it turns round. */
function ramp(now: number, target: number, gain: number, loss: number): number {
  const slows = now * target < 0 || Math.abs(target) < Math.abs(now);
  const most = TICK * (slows ? loss : gain);
  const goal = now * target >= 0 ? target : 0;
  return now + Math.min(most, Math.max(-most, goal - now));
}

function moved(motion: Motion, { forward, turn }: Speeds): Motion {
  const [way, angle] = [0.5 * (motion.forward + forward) * TICK, 0.5 * (motion.turn + turn) * TICK];
  const heading = motion.yaw + angle / 2;
  return {
    x: motion.x + way * Math.cos(heading), y: motion.y + way * Math.sin(heading), yaw: motion.yaw + angle, forward, turn,
  };
}
