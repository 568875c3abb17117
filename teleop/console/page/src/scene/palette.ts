/**
 * Colours of the picture.
 *
 * The distance of live points from the map runs from blue (on it) to orange (off it), a pair that people with any
 * common colour blindness tell apart; what is unknown is grey. Marks use the palette of Okabe and Ito
 * ("Color Universal Design", 2008).
 */

import type { Theme } from "./settings";

/** Red, green and blue, 0 to 1, as the screen takes them (sRGB). */
export type Rgb = readonly [number, number, number];

/** Distance from the map at which the scale ends [m], as in the robot's own display. */
export const DISTANCE_FULL = 0.2;

export interface SceneColours {
  readonly background: Rgb;
  /** Floor that nobody scanned, and that was. */
  readonly plate: Rgb;
  readonly floor: Rgb;
  /** What the colours of the building's surfaces, and of the floor that was seen, are multiplied by. */
  readonly surfaces: Rgb;
  readonly ground: Rgb;
  readonly wallLow: Rgb;
  readonly wallHigh: Rgb;
  readonly grid: Rgb;
  readonly cellOccupied: Rgb;
  readonly cellFree: Rgb;
  /** Stops of the scale of distances, equally spaced from 0 to `DISTANCE_FULL`. */
  readonly distances: readonly [Rgb, Rgb, Rgb];
  readonly unknown: Rgb;
  readonly path: Rgb;
  readonly robot: Rgb;
  readonly doubtful: Rgb;
  readonly stale: Rgb;
  readonly hypothesis: Rgb;
  readonly truth: Rgb;
  readonly good: Rgb;
  readonly bad: Rgb;
  /** What the robot is about to touch. */
  readonly near: Rgb;
  readonly ink: Rgb;
}

/** Turn 0xrrggbb into red, green and blue. */
export function rgb(hex: number): Rgb {
  return [((hex >> 16) & 255) / 255, ((hex >> 8) & 255) / 255, (hex & 255) / 255];
}

/** Turn a colour into the notation of CSS. */
export function css([red, green, blue]: Rgb): string {
  return `rgb(${[red, green, blue].map((share) => Math.round(share * 255)).join(", ")})`;
}

export const COLOURS: Readonly<Record<Theme, SceneColours>> = {
  night: {
    background: rgb(0x0d1117),
    plate: rgb(0x151b24),
    floor: rgb(0x252e3a),
    surfaces: rgb(0x7c8696),
    ground: rgb(0x4a5563),
    wallLow: rgb(0x3a4556),
    wallHigh: rgb(0x718096),
    grid: rgb(0x2b3543),
    cellOccupied: rgb(0x9aa7ba),
    cellFree: rgb(0x1a212b),
    distances: [rgb(0x3fa7ff), rgb(0xf4f1ea), rgb(0xff8a1c)],
    unknown: rgb(0x9a9a9a),
    path: rgb(0x56b4e9),
    robot: rgb(0x2fd6a3),
    doubtful: rgb(0xff9d3c),
    stale: rgb(0x80868f),
    hypothesis: rgb(0xf0e442),
    truth: rgb(0xe08bc0),
    good: rgb(0x2fd6a3),
    bad: rgb(0xff6a2b),
    near: rgb(0xff4d4d),
    ink: rgb(0xe8edf4),
  },
  day: {
    background: rgb(0xf4f6f9),
    plate: rgb(0xe9edf2),
    floor: rgb(0xd9dfe7),
    surfaces: rgb(0xffffff),
    ground: rgb(0xf3f6fa),
    wallLow: rgb(0xb9c2ce),
    wallHigh: rgb(0x7f8c9d),
    grid: rgb(0xd3dae3),
    cellOccupied: rgb(0x4b5563),
    cellFree: rgb(0xffffff),
    distances: [rgb(0x0a5fd0), rgb(0x8d5d86), rgb(0xe24a00)],
    unknown: rgb(0x7d7d7d),
    path: rgb(0x0072b2),
    robot: rgb(0x00805c),
    doubtful: rgb(0xc65200),
    stale: rgb(0x888e97),
    hypothesis: rgb(0x7a5f00),
    truth: rgb(0xa8327f),
    good: rgb(0x00805c),
    bad: rgb(0xc94a00),
    near: rgb(0xc01016),
    ink: rgb(0x16202c),
  },
};

/** Return the colour of a live point by its distance to the map [m]; NaN is unknown. */
export function distanceColour(distance: number, colours: SceneColours): Rgb {
  if (!Number.isFinite(distance)) {
    return colours.unknown;
  }
  const share = Math.min(Math.abs(distance) / DISTANCE_FULL, 1);
  const [near, middle, far] = colours.distances;
  return share < 0.5 ? mix(near, middle, 2 * share) : mix(middle, far, 2 * share - 1);
}

/** A value of the legend: a distance [m], or undefined for "unknown", and its colour for CSS. */
export interface LegendEntry {
  readonly distance: number | undefined;
  readonly colour: string;
}

/** Return what a legend of the live points shows, from "on the map" to "off it", last what is unknown. */
export function distanceLegend(theme: Theme, steps = 5): readonly LegendEntry[] {
  const colours = COLOURS[theme];
  const known = Array.from({ length: steps }, (_, step) => (step / (steps - 1)) * DISTANCE_FULL);
  return [
    ...known.map((distance) => ({ distance, colour: css(distanceColour(distance, colours)) })),
    { distance: undefined, colour: css(colours.unknown) },
  ];
}

function mix(a: Rgb, b: Rgb, share: number): Rgb {
  return [a[0] + (b[0] - a[0]) * share, a[1] + (b[1] - a[1]) * share, a[2] + (b[2] - a[2]) * share];
}
