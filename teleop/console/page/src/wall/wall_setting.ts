/** A wall of screens, as the page's address names it: `?screen=X,Y,Z,HEADING,WIDTH,HEIGHT&screen=…&eye=X,Y,Z&stereo=GAP`. */

/** A flat, upright screen before the operator: x ahead, y left, z up from the floor below the operator [m]. */
export interface WallScreen {
  readonly middle: readonly [x: number, y: number, z: number];
  /** Direction in which it is looked at, left of ahead [rad]. */
  readonly heading: number;
  readonly width: number;
  readonly height: number;
}

export interface Wall {
  /** Screens of this window, left to right, each in an equal part of it. */
  readonly screens: readonly WallScreen[];
  /** Between the operator's eyes [m]. */
  readonly eye: readonly [x: number, y: number, z: number];
  /** From one eye to the other, for screens that take both pictures side by side; 0 draws one [m]. */
  readonly stereo: number;
}

/** A person who sits, 1.2 m above the floor; chosen. */
const EYE = "0,0,1.2";

/**
 * Return the wall that an address names; undefined if it names none.
 *
 * @throws Error If a number is missing or wrong, with what would have been right.
 */
export function wallOf(query: string): Wall | undefined {
  const words = new URLSearchParams(query);
  if (!words.has("screen")) {
    return undefined;
  }
  const screens = words.getAll("screen").map((text): WallScreen => {
    const [x = NaN, y = NaN, z = NaN, heading = NaN, width = NaN, height = NaN] = numbers("screen", text, 6);
    if (!(width > 0 && height > 0)) {
      throw new Error(`The address names a screen “${text}” without a width and height above 0 m.`);
    }
    return { middle: [x, y, z], heading: (heading * Math.PI) / 180, width, height };
  });
  const [x = NaN, y = NaN, z = NaN] = numbers("eye", words.get("eye") ?? EYE, 3);
  const [stereo = 0] = numbers("stereo", words.get("stereo") ?? "0", 1);
  for (const { middle, heading } of screens) {
    if (!((middle[0] - x) * Math.cos(heading) + (middle[1] - y) * Math.sin(heading) > 0)) {
      throw new Error(`The address names a screen with its middle at ${middle.join(", ")} that does not face the eye at ${x}, ${y}, ${z}.`);
    }
  }
  return { screens, eye: [x, y, z], stereo };
}

function numbers(name: string, text: string, count: number): readonly number[] {
  const found = text.split(",").map((word) => (word.trim() === "" ? NaN : Number(word)));
  if (found.length !== count || !found.every(Number.isFinite)) {
    throw new Error(`The address names ${name}=“${text}”, which is not ${count === 1 ? "a number" : `${count} numbers with commas between them`}.`);
  }
  return found;
}
