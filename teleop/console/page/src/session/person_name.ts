/** The name by which the robot and everybody at it know the person at this page. */

/** Length of a name that the robot takes [characters]. */
export const LONGEST_NAME = 24;

/** What a person is called who has not said it: two of these tell a few people apart, and nobody minds them. */
const COLOURS = ["Amber", "Blue", "Coral", "Green", "Indigo", "Olive", "Red", "Silver", "Teal", "Violet"];
const BIRDS = ["Crane", "Finch", "Gull", "Heron", "Kite", "Lark", "Owl", "Raven", "Robin", "Swift"];

/** Return a friendly name; `draw` returns numbers from 0 up to 1. */
export function friendlyName(draw: () => number = Math.random): string {
  const one = (words: readonly string[]): string => words[Math.floor(draw() * words.length)] ?? "";
  return `${one(COLOURS)} ${one(BIRDS)}`;
}

/** Return a name that was kept, if it is one. */
export function validName(kept: unknown): string | undefined {
  return typeof kept === "string" && kept.trim() !== "" ? kept.trim().slice(0, LONGEST_NAME) : undefined;
}
