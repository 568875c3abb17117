/** The floor of a robot without a map of points: its occupancy grid, and a grid of metres where there is nothing. */

import {
  BufferAttribute, BufferGeometry, DataTexture, Group, LineBasicMaterial, LineSegments, Mesh, MeshBasicMaterial,
  NearestFilter, PlaneGeometry, SRGBColorSpace,
} from "three";
import type { GridMap } from "../values";
import type { Bounds } from "./geometry";
import { headingOf } from "./geometry";
import type { Rgb, SceneColours } from "./palette";
import { place } from "./robot_layer";

/** Half the side of the grid of metres [m]. */
const HALF = 30;
const PIECE = 2;

export class GridLayer {
  readonly object = new Group();
  bounds: Bounds | undefined;
  readonly #metres: LineSegments<BufferGeometry, LineBasicMaterial>;
  #plane: Mesh<PlaneGeometry, MeshBasicMaterial> | undefined;
  #grid: GridMap | undefined;

  constructor() {
    const lines: number[] = [];
    for (let at = -HALF; at <= HALF; at += 1) {
      // In pieces, for software renderers drop lines that begin behind the camera.
      for (let from = -HALF; from < HALF; from += PIECE) {
        lines.push(from, at, 0, from + PIECE, at, 0, at, from, 0, at, from + PIECE, 0);
      }
    }
    const geometry = new BufferGeometry();
    geometry.setAttribute("position", new BufferAttribute(new Float32Array(lines), 3));
    this.#metres = new LineSegments(geometry, new LineBasicMaterial({ depthWrite: false }));
    this.#metres.renderOrder = -1;
    this.object.add(this.#metres);
  }

  /** Show another grid of cells, or none. */
  set(grid: GridMap | undefined, colours: SceneColours): void {
    this.#free();
    this.#grid = grid;
    this.bounds = grid && boundsOfGrid(grid);
    if (grid !== undefined && grid.width > 0 && grid.height > 0) {
      const [wide, tall] = [grid.width * grid.resolution, grid.height * grid.resolution];
      const texture = new DataTexture(cellColours(grid, colours), grid.width, grid.height);
      texture.colorSpace = SRGBColorSpace;
      texture.magFilter = NearestFilter;
      texture.needsUpdate = true;
      const plane = new PlaneGeometry(wide, tall).translate(wide / 2, tall / 2, 0);
      // Cells are opaque or missing, so that the floor is drawn before all that stands or lies on it.
      this.#plane = new Mesh(plane, new MeshBasicMaterial({ map: texture, alphaTest: 0.5, depthWrite: false }));
      this.#plane.renderOrder = -2;
      place(this.#plane, grid.origin);
      this.object.add(this.#plane);
    }
  }

  /** Show the grid of metres about a place on the floor, moved by whole metres, or hide it. */
  setMetres(shown: boolean, x: number, y: number, z: number): void {
    this.#metres.visible = shown;
    this.#metres.position.set(Math.round(x), Math.round(y), z);
  }

  setColours(colours: SceneColours): void {
    this.#metres.material.color.setRGB(...colours.grid, SRGBColorSpace);
    if (this.#grid !== undefined) {
      this.set(this.#grid, colours);
    }
  }

  dispose(): void {
    this.#free();
    this.#metres.geometry.dispose();
    this.#metres.material.dispose();
  }

  #free(): void {
    if (this.#plane !== undefined) {
      this.object.remove(this.#plane);
      this.#plane.material.map?.dispose();
      this.#plane.material.dispose();
      this.#plane.geometry.dispose();
      this.#plane = undefined;
    }
  }
}

/** Return red, green, blue and opacity of each cell: unknown cells are seen through. */
export function cellColours(grid: GridMap, colours: SceneColours): Uint8Array<ArrayBuffer> {
  const cells = grid.width * grid.height;
  const result = new Uint8Array(4 * cells);
  const bytes = (colour: Rgb): readonly number[] => colour.map((share) => Math.round(255 * share));
  const [free, occupied] = [bytes(colours.cellFree), bytes(colours.cellOccupied)];
  for (let cell = 0; cell < cells; cell += 1) {
    const value = grid.cells[cell] ?? -1;
    if (value >= 0) {
      const share = Math.min(value, 100) / 100;
      for (let channel = 0; channel < 3; channel += 1) {
        const low = free[channel] ?? 0;
        result[4 * cell + channel] = low + ((occupied[channel] ?? 0) - low) * share;
      }
      result[4 * cell + 3] = 255;
    }
  }
  return result;
}

function boundsOfGrid(grid: GridMap): Bounds {
  const heading = headingOf(grid.origin.orientation);
  const { x, y, z } = grid.origin.position;
  const [wide, tall] = [grid.width * grid.resolution, grid.height * grid.resolution];
  const corners = [[0, 0], [wide, 0], [wide, tall], [0, tall]].map(([u = 0, v = 0]) => [
    x + Math.cos(heading) * u - Math.sin(heading) * v,
    y + Math.sin(heading) * u + Math.cos(heading) * v,
  ]);
  const [xs, ys] = [corners.map(([at = 0]) => at), corners.map(([, at = 0]) => at)];
  return {
    min: { x: Math.min(...xs), y: Math.min(...ys), z },
    max: { x: Math.max(...xs), y: Math.max(...ys), z: z + 1 },
  };
}
