/** The plan that the small map shows, of whatever the map is made of: surfaces, points, or the cells of a grid. */

import type { GridMap, MapPoints } from "../values";
import { headingOf, type Bounds } from "./geometry";
import { cellColours } from "./grid_layer";
import type { Rgb, SceneColours } from "./palette";
import { planImage, type PlanImage } from "./plan_image";
import type { World } from "./world";

export type { PlanImage } from "./plan_image";

/** Pixels for a metre of a plan of points: cells of 10 cm have no gaps between points 6 cm apart. */
const COARSE = 10;
const FINE = 20;
const LONGEST = 2000;
/** Heights above the floor [m] between which points are walls: above what lies on it, and below any door's lintel (2.0 m, DIN 18101). */
const WALL = { from: 0.1, to: 1.9 };

/** What there is of the map; surfaces as soon as they have been built. */
export interface MapParts {
  readonly surfaces: boolean;
  readonly points: MapPoints | undefined;
  readonly grid: GridMap | undefined;
}

/** Return the plan of the best that there is; undefined without a map, or nothing to draw with. */
export function planOf(world: World, { surfaces, points, grid }: MapParts, colours: SceneColours): PlanImage | undefined {
  if (surfaces) {
    return planImage(world.building, colours);
  }
  const { bounds, floor } = world.map;
  if (points !== undefined && bounds !== undefined) {
    const perMetre = finest(bounds, COARSE);
    const { width, height, pixels } = pointCells(points.positions, bounds, floor, perMetre, colours);
    const image = imageOf(width, height, pixels);
    return image && { image, bounds, perMetre };
  }
  return grid && world.grid.bounds && gridPlan(grid, world.grid.bounds, colours);
}

/** Pixels from the upper left on, four bytes each: walls, floor, and nothing where no point is. */
export interface Pixels {
  readonly width: number;
  readonly height: number;
  readonly pixels: Uint8ClampedArray<ArrayBuffer>;
}

/** Return points from above; a wall covers the floor below it. */
export function pointCells(
  positions: Float32Array, { min, max }: Bounds, floor: number, perMetre: number, { floor: low, wallHigh: high }: Pick<SceneColours, "floor" | "wallHigh">,
): Pixels {
  const [width, height] = [Math.floor((max.x - min.x) * perMetre) + 1, Math.floor((max.y - min.y) * perMetre) + 1];
  const pixels = new Uint8ClampedArray(4 * width * height);
  const isWall = new Uint8Array(width * height);
  const [lowBytes, highBytes] = [bytesOf(low), bytesOf(high)];
  for (let at = 0; at + 2 < positions.length; at += 3) {
    const above = (positions[at + 2] ?? NaN) - floor;
    const cell = Math.floor((max.y - (positions[at + 1] ?? NaN)) * perMetre) * width + Math.floor(((positions[at] ?? NaN) - min.x) * perMetre);
    const wall = above > WALL.from && above < WALL.to;
    if ((wall || Math.abs(above) <= WALL.from) && isWall[cell] === 0) {
      isWall[cell] = wall ? 1 : 0;
      pixels.set(wall ? highBytes : lowBytes, 4 * cell);
    }
  }
  return { width, height, pixels };
}

function bytesOf(colour: Rgb): readonly number[] {
  return [...colour.map((share) => 255 * share), 255];
}

function finest({ min, max }: Bounds, wanted: number): number {
  return Math.min(wanted, LONGEST / Math.max(max.x - min.x, max.y - min.y, 1));
}

function imageOf(width: number, height: number, pixels: Uint8ClampedArray<ArrayBuffer>): HTMLCanvasElement | undefined {
  const image = document.createElement("canvas");
  [image.width, image.height] = [width, height];
  const pen = image.getContext("2d");
  pen?.putImageData(new ImageData(pixels, width, height), 0, 0);
  return pen === null ? undefined : image;
}

/** Return the cells of a grid, turned as its origin is. */
function gridPlan(grid: GridMap, bounds: Bounds, colours: SceneColours): PlanImage | undefined {
  const cells = imageOf(grid.width, grid.height, new Uint8ClampedArray(cellColours(grid, colours)));
  const perMetre = finest(bounds, FINE);
  const image = document.createElement("canvas");
  [image.width, image.height] = [Math.ceil((bounds.max.x - bounds.min.x) * perMetre), Math.ceil((bounds.max.y - bounds.min.y) * perMetre)];
  const pen = image.getContext("2d");
  if (pen === null || cells === undefined) {
    return undefined;
  }
  const { position: { x, y }, orientation } = grid.origin;
  pen.imageSmoothingEnabled = false;
  pen.setTransform(perMetre, 0, 0, -perMetre, -bounds.min.x * perMetre, bounds.max.y * perMetre);
  pen.translate(x, y);
  pen.rotate(headingOf(orientation));
  pen.scale(grid.resolution, grid.resolution); // the first row of cells is the lowest, as of an image in these axes
  pen.drawImage(cells, 0, 0);
  return { image, bounds, perMetre };
}
