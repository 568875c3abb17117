/** Learns a mapping from what a person does with the gamepad. */

import type { AxisUse } from "../operating_data";
import type { GamepadMapping } from "./gamepad_mapping";

/** A mapping that is not complete yet. */
export type MappingDraft = { readonly [Use in keyof GamepadMapping]?: GamepadMapping[Use] | undefined };

export const AXIS_USES = ["forward", "turn"] as const;
export const BUTTON_USES = ["deadman", "turbo", "estop", "takeOver"] as const;
export type AxisUseName = (typeof AXIS_USES)[number];
export type ButtonUseName = (typeof BUTTON_USES)[number];

/** Deflections and buttons of a gamepad at one moment. */
export interface PadSnapshot {
  readonly axes: readonly number[];
  readonly buttons: readonly boolean[];
}

export function snapshot(pad: Gamepad): PadSnapshot {
  return { axes: [...pad.axes], buttons: pad.buttons.map(({ pressed }) => pressed) };
}

/** The axis that was pushed since a moment of rest, and to which side; triggers, which rest at an end, do not count. */
export function pushedAxis(rest: PadSnapshot, now: PadSnapshot): AxisUse | undefined {
  let best: AxisUse | undefined;
  let most = 0.5;
  now.axes.forEach((value, axis) => {
    const before = rest.axes[axis] ?? 0;
    if (Math.abs(before) < 0.5 && Math.abs(value - before) > most) {
      most = Math.abs(value - before);
      best = { axis, sign: value > before ? 1 : -1 };
    }
  });
  return best;
}

/** The button that was pressed since a moment of rest. */
export function pressedButton(rest: PadSnapshot, now: PadSnapshot): number | undefined {
  const index = now.buttons.findIndex((pressed, button) => pressed && rest.buttons[button] !== true);
  return index < 0 ? undefined : index;
}

/** Give an axis or a button a use; what used it before loses it. */
export function withUse(draft: MappingDraft, use: AxisUseName | ButtonUseName, value: AxisUse | number): MappingDraft {
  const same = (other: unknown) => JSON.stringify(other) === JSON.stringify(value) || sameAxis(other, value);
  const kept = Object.entries(draft).filter(([name, other]) => name === "deadZone" || !same(other));
  return { ...Object.fromEntries(kept), [use]: value };
}

function sameAxis(one: unknown, other: AxisUse | number): boolean {
  return typeof other === "object" && typeof one === "object" && one !== null && "axis" in one && one.axis === other.axis;
}

/** The finished mapping; undefined while something indispensable is missing. */
export function completed(draft: MappingDraft, deadZone: number): GamepadMapping | undefined {
  const { forward, turn, deadman, turbo, estop, takeOver } = draft;
  return forward && turn && deadman !== undefined
    ? { forward, turn, deadman, turbo, estop, takeOver, deadZone: draft.deadZone ?? deadZone }
    : undefined;
}
