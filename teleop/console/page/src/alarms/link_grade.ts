/** How good the link is, in three colours and four words. */

import type { LinkStatistics } from "../robot/robot_state";

export type LinkColour = "unknown" | "green" | "amber" | "red";
export type LinkWord = "unknown" | "good" | "slow" | "bad" | "lost";

export interface LinkThreshold {
  /** Up to this, green. */
  readonly green: number;
  /** Up to this, amber; above, red. */
  readonly amber: number;
}

/**
 * Thresholds [ms]. Drivers do clearly worse from 200 ms of delay; above 500 ms they begin to move and wait, and the robot
 * drives slower by itself. Robots publish at 10 Hz and more, so half a second of silence is a gap.
 */
export const LINK_THRESHOLDS = {
  roundTrip: { green: 200, amber: 500 },
  jitter: { green: 50, amber: 150 },
  silence: { green: 300, amber: 500 },
  age: { green: 500, amber: 1500 },
} as const satisfies Record<string, LinkThreshold>;

/** Silence after which the link counts as lost [ms]. */
export const LOST_AFTER = 1000;

/** Return the colour of a value. */
export function colourOf(value: number | undefined, { green, amber }: LinkThreshold): LinkColour {
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
    return "bad";
  }
  if (colours.includes("amber")) {
    return "slow";
  }
  return link.roundTrip === undefined ? "unknown" : "good";
}

/** Return the colour that a word is shown in. */
export function colourOfWord(word: LinkWord): LinkColour {
  return ({ unknown: "unknown", good: "green", slow: "amber", bad: "red", lost: "red" } as const)[word];
}
