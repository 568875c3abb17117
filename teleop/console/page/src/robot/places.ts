/** Places by name: which a position is at, and the places in question of a search, nearest first. */

import type { NamedPlace, PlaceInQuestion, Pose, Vector3 } from "../values";

/** A named place farther away than this names nothing [m]: half the length of a large room. */
const AT = 5;

/** Return the name of the place that a position in the map is at; empty if there is none near. */
export function placeAt(places: readonly NamedPlace[], at: Vector3): string {
  const near = places
    .map(({ name, pose }) => ({ name, away: distance(pose.position, at) }))
    .filter(({ away }) => away < AT)
    .sort((a, b) => a.away - b.away);
  return near[0]?.name ?? "";
}

/**
 * Return the places between which a search has not decided, nearest first, each with its name and the share it explains.
 *
 * @param scores Share of what is seen that each explains, in the same order; of another sweep if their number differs, and 0
 *   of the present place until it has been compared.
 * @param from Where the robot was known to be last; without it the order is kept, which is the best first.
 */
export function placesInQuestion(
  poses: readonly Pose[], scores: readonly number[], places: readonly NamedPlace[], from: Pose | undefined,
): readonly PlaceInQuestion[] {
  const known = poses.map((pose, index) => ({
    ...pose,
    name: placeAt(places, pose.position),
    share: scores.length === poses.length ? scores[index] || undefined : undefined,
    away: from && distance(pose.position, from.position),
  }));
  return from === undefined ? known : known.sort((a, b) => (a.away ?? 0) - (b.away ?? 0));
}

function distance(a: Vector3, b: Vector3): number {
  return Math.hypot(a.x - b.x, a.y - b.y);
}
