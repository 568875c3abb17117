/** Keys that move the ghost. */

import type { HintEvent } from "./hint_state";

export type HintKey = Extract<HintEvent, { type: "move" | "turn" | "cancel" }> | { readonly type: "confirm" };

/** Step of an arrow key [m], alone and with Shift. */
export const STEP = 0.1;
export const LONG_STEP = 0.5;

/** Step of Q and E [rad]. */
export const TURN = (5 * Math.PI) / 180;

/**
 * Return what a key does while a hint is being placed, or undefined if it is none of ours.
 *
 * @param up Direction in the map that is up on the screen [rad]; +y in the view from above.
 */
export function hintKey(key: string, shift: boolean, up = Math.PI / 2): HintKey | undefined {
  const step = shift ? LONG_STEP : STEP;
  switch (key) {
    case "ArrowUp":
      return along(up, step);
    case "ArrowDown":
      return along(up + Math.PI, step);
    case "ArrowLeft":
      return along(up + Math.PI / 2, step);
    case "ArrowRight":
      return along(up - Math.PI / 2, step);
    case "q":
    case "Q":
      return { type: "turn", angle: TURN };
    case "e":
    case "E":
      return { type: "turn", angle: -TURN };
    case "Enter":
      return { type: "confirm" };
    case "Escape":
      return { type: "cancel" };
    default:
      return undefined;
  }
}

function along(direction: number, step: number): HintKey {
  return { type: "move", dx: step * Math.cos(direction), dy: step * Math.sin(direction) };
}
