/** How good the link is, in three colours and four words. */

import { LINK, type Colour, type LinkWord } from "../operating_data";
import type { LinkStatistics } from "../robot/robot_state";

export interface LinkThreshold {
  /** Up to this, green [ms]. */
  readonly green: number;
  /** Up to this, amber; above, red [ms]. */
  readonly amber: number;
}

const milliseconds = ({ green, amber }: LinkThreshold): LinkThreshold => ({ green: 1000 * green, amber: 1000 * amber });

export const LINK_THRESHOLDS = {
  roundTrip: milliseconds(LINK.limits.round_trip),
  jitter: milliseconds(LINK.limits.jitter),
  silence: milliseconds(LINK.limits.silence),
  age: milliseconds(LINK.limits.age),
} as const;

/** Silence after which the link counts as lost [ms]. */
export const LOST_AFTER = 1000 * LINK.lost_after;

/** Lateness of the page from which on its own slowness is the cause of what looks like a bad link [ms]. */
const PAGE_LATE = 1000 * LINK.page_late;

/** Return the colour of a value [ms]. */
export function colourOf(value: number | undefined, { green, amber }: LinkThreshold): Colour {
  if (value === undefined || Number.isNaN(value)) {
    return "unknown";
  }
  return value <= green ? "green" : value <= amber ? "amber" : "red";
}

/**
 * Return the link as a whole: the worst of round trip, jitter and silence. The 95th percentile of a minute makes it slow
 * at most, since what it tells of may be over.
 *
 * @param connected Whether there is a connection at all.
 */
export function linkWord(connected: boolean, link: LinkStatistics): LinkWord {
  if (!connected || link.silence > LOST_AFTER) {
    return "lost";
  }
  const { roundTrip, jitter, silence } = LINK_THRESHOLDS;
  const colours = [
    colourOf(link.roundTrip, roundTrip),
    colourOf(link.roundTripP95, { ...roundTrip, amber: Infinity }),
    colourOf(link.jitter, jitter),
    colourOf(link.silence, silence),
  ];
  if (colours.includes("red")) {
    // Answers that wait for this page to look at them say nothing of the way.
    return link.pageLag > PAGE_LATE ? "page" : "bad";
  }
  if (colours.includes("amber")) {
    return "slow";
  }
  return link.roundTrip === undefined ? "unknown" : "good";
}
