/** How much camera this browser bears: all of it, five pictures a second, or none, before frames and commands suffer. */

import { LINK } from "../operating_data";

/** All pictures, few, or none. */
export type Pace = "full" | "slow" | "off";

/** Most pictures a second at the slow pace. */
export const SLOW_RATE = 5;

/** Lateness of the page [ms] from which on it is too slow, and below which it has time again. */
const LATE = 1000 * LINK.page_late;
const EASY = LATE / 2;
/** The lateness of the last 5 s is measured; so long it has to be too much for the next pace, and little for the one before [ms]. */
const WORSE = 4000;
const BETTER = 20_000;

/** A pace and since when the page has been too slow for it, or has had time to spare [ms]. */
export interface PaceState {
  readonly pace: Pace;
  readonly lateSince: number | undefined;
  readonly easySince: number | undefined;
}

export const FULL: PaceState = { pace: "full", lateSince: undefined, easySince: undefined };

/**
 * Return the pace after a look at the page's lateness [ms] at a time [ms].
 *
 * @param wanted Whether a person has asked for the pictures: then they become few, and never none.
 */
export function paced(state: PaceState, lateness: number, now: number, wanted: boolean): PaceState {
  const lateSince = lateness > LATE ? state.lateSince ?? now : undefined;
  const easySince = lateness < EASY ? state.easySince ?? now : undefined;
  const { pace } = state;
  if (lateSince !== undefined && now - lateSince >= WORSE && pace !== "off" && !(pace === "slow" && wanted)) {
    return { ...FULL, pace: pace === "full" ? "slow" : "off" };
  }
  // What is off stays so until a person asks: on its own it would come and go.
  if (easySince !== undefined && now - easySince >= BETTER && pace === "slow") {
    return FULL;
  }
  return { pace, lateSince, easySince };
}
