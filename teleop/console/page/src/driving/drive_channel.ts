/** The two ways to move a robot: by Joy, where it guards itself, and by velocities, where nothing does. */

import type { RobotCommands } from "../robot/robot_commands";
import type { Wanted } from "./gears";

/** Each call returns false if nothing can be sent now. */
export interface DriveChannel {
  /** Hold the deadman with the stick at rest: arms the robot. */
  neutral(): boolean;
  move(wanted: Wanted): boolean;
  /** Let go of the deadman. */
  release(): boolean;
}

/** Drive by `/joy`. */
export function joyChannel(commands: RobotCommands): DriveChannel {
  return {
    neutral: () => commands.joy(0, 0, true, false),
    move: ({ forward, turn, turbo }) => commands.joy(clamped(forward), clamped(turn), true, turbo),
    release: () => commands.joy(0, 0, false, false),
  };
}

/** The page's own limits for a robot of which it knows none [m/s, rad/s]: walking pace, and less without turbo. */
export const PLAIN_LIMITS = {
  normal: { linear: 0.35, angular: 0.8 },
  turbo: { linear: 0.7, angular: 1.2 },
} as const;

/** Drive by `/cmd_vel`, within the page's own limits. */
export function velocityChannel(commands: RobotCommands): DriveChannel {
  return {
    neutral: () => commands.velocity(0, 0),
    move: ({ forward, turn, turbo }) => {
      const limit = turbo ? PLAIN_LIMITS.turbo : PLAIN_LIMITS.normal;
      return commands.velocity(clamped(forward) * limit.linear, clamped(turn) * limit.angular);
    },
    release: () => commands.velocity(0, 0),
  };
}

function clamped(share: number): number {
  return Number.isFinite(share) ? Math.max(-1, Math.min(1, share)) : 0;
}
