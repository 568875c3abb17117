/** Whether a proposed pose looks right. */

import type { HintPreview } from "../values";

export type HintQuality = "unknown" | "good" | "bad";

/** A right pose seldom explains a smaller share of a sweep, whatever was moved since the survey. */
export const BELIEVED = 0.55;

/** One place is clearly better than another if it explains this share more. */
export const CLEARLY = 0.1;

/**
 * Judge a preview: good if the place explains enough, and not clearly less than the present pose. The robot weighs more
 * than the share, and searches around a hint, so a bad one may still be accepted.
 *
 * @param preview Newest preview.
 * @param old Whether it is of a pose that the ghost has left.
 */
export function qualityOf(preview: HintPreview | undefined, old: boolean): HintQuality {
  if (preview === undefined || old || !Number.isFinite(preview.explained)) {
    return "unknown";
  }
  const present = preview.present ?? 0;
  return preview.explained >= BELIEVED && preview.explained > present - CLEARLY ? "good" : "bad";
}
