/** Three gears: slow and exact, normal, fast. */

import { GEARS, JOY_LAYOUT, type Gear } from "../operating_data";
import { withoutDeadZone } from "./drive_source";

/** A deflection after the gear, and whether the robot's own turbo is asked for. */
export interface Wanted {
  readonly forward: number;
  readonly turn: number;
  readonly turbo: boolean;
}

/** Return the speed of a full deflection in a gear [m/s]. */
export function topSpeed(gear: Gear): number {
  const engaged = GEARS.find((candidate) => candidate.gear === gear);
  return (engaged?.turbo === true ? JOY_LAYOUT.turbo_speed : JOY_LAYOUT.speed) * (engaged?.forward ?? 0);
}

/** Return the velocity that a deflection asks the robot for [m/s, rad/s], by the dead zone and the scales of `/joy`. */
export function velocityOf({ forward, turn, turbo }: Wanted): { readonly forward: number; readonly turn: number } {
  const { deadzone, speed, turbo_speed, turn: rate } = JOY_LAYOUT;
  return { forward: (turbo ? turbo_speed : speed) * withoutDeadZone(forward, deadzone), turn: rate * withoutDeadZone(turn, deadzone) };
}

/** Put a deflection through a gear. `lift` is the input's own turbo button: it lifts the gear while it is held. */
export function geared(forward: number, turn: number, gear: Gear, lift: boolean): Wanted {
  const engaged = GEARS.find((candidate) => candidate.gear === (lift ? "turbo" : gear));
  return { forward: forward * (engaged?.forward ?? 0), turn: turn * (engaged?.turn ?? 0), turbo: engaged?.turbo ?? false };
}
