/** Three gears: slow and exact, normal, fast. */

import { GEARS, JOY_LAYOUT, type Gear } from "../operating_data";

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

/** Put a deflection through a gear. `lift` is the input's own turbo button: it lifts the gear while it is held. */
export function geared(forward: number, turn: number, gear: Gear, lift: boolean): Wanted {
  const engaged = GEARS.find((candidate) => candidate.gear === (lift ? "turbo" : gear));
  return { forward: forward * (engaged?.forward ?? 0), turn: turn * (engaged?.turn ?? 0), turbo: engaged?.turbo ?? false };
}
