/** Three gears: slow and exact, normal, fast. */

export type Gear = "precision" | "normal" | "turbo";

export const GEARS: readonly Gear[] = ["precision", "normal", "turbo"];

/** A deflection after the gear, and whether the robot's own turbo is asked for. */
export interface Wanted {
  readonly forward: number;
  readonly turn: number;
  readonly turbo: boolean;
}

/** Share of the deflection that goes out in the precision gear; turning needs more to overcome a skid-steer's friction. */
const PRECISION = { forward: 0.35, turn: 0.5 } as const;

/** Put a deflection through a gear. `turbo` is the input's own turbo button: it lifts the gear while it is held. */
export function geared(forward: number, turn: number, gear: Gear, turbo: boolean): Wanted {
  const engaged = turbo ? "turbo" : gear;
  const share = engaged === "precision" ? PRECISION : { forward: 1, turn: 1 };
  return { forward: forward * share.forward, turn: turn * share.turn, turbo: engaged === "turbo" };
}
