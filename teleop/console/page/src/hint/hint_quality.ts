/** Whether a proposed pose looks right. */

import type { HintPreview } from "../values";

export type HintQuality = "unknown" | "good" | "bad";

/** The robot believes a pose that explains this share of a sweep (`min_inlier_ratio` of its search). */
export const BELIEVED = 0.55;

/** One place is better than another if it explains this share more (`min_margin` of the robot's search). */
export const CLEARLY = 0.1;

/**
 * Judge a preview as the robot would judge the place: good if it explains enough, and not clearly less than the present
 * pose. The robot searches around a hint, so a bad one may still be accepted.
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
