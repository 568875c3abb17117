/** Which of a controller's buttons and axes are what: by the first of its profiles that the registry knows, else as WebXR's own mapping has it. */

import PROFILES from "farsteer:input-profiles";

/** Places in the lists of buttons and axes; what a controller does not have is missing. */
export interface ControllerLayout {
  readonly trigger?: number;
  readonly squeeze?: number;
  /** Axes of the stick, or of the pad in its place: to the right, and backwards. */
  readonly stick?: readonly [number, number];
  /** The face button near the wrist (A, X), and that above it (B, Y). */
  readonly lower?: number;
  readonly upper?: number;
}

/** Buttons that a layout names. */
export type ControllerButton = "trigger" | "squeeze" | "lower" | "upper";

/** The mapping "xr-standard" (W3C, WebXR Gamepads Module, 3.3), with the face buttons where the registry has them. */
const STANDARD: ControllerLayout = { trigger: 0, squeeze: 1, stick: [2, 3], lower: 4, upper: 5 };
/** Of one that has a touch pad and no stick. */
const STANDARD_PAD: ControllerLayout = { ...STANDARD, stick: [0, 1] };

/**
 * Return the layout of a controller; undefined if nothing says which button is which.
 *
 * @param profiles Names from the model itself to those that it is alike, as the browser gives them.
 */
export function layoutOf(profiles: readonly string[], hand: XRHandedness, { mapping, axes }: Pick<Gamepad, "axes"> & { readonly mapping: string }): ControllerLayout | undefined {
  for (const name of profiles) {
    const layout = Object.hasOwn(PROFILES, name) ? PROFILES[name]?.[hand] : undefined;
    if (layout !== undefined) {
      return layout;
    }
  }
  return mapping !== "xr-standard" ? undefined : axes.length < 4 ? STANDARD_PAD : STANDARD;
}
