/** The map as points, quiet, so that what is alive stands out before it. */

import { BufferAttribute, BufferGeometry, Group, Points, ShaderMaterial, Vector2, Vector3 } from "three";
import type { MapPoints } from "../values";
import { FloorPlate } from "./floor_plate";
import { boundsOf, floorHeight, type Bounds } from "./geometry";
import type { SceneColours } from "./palette";
import { MAP_FRAGMENT, MAP_VERTEX } from "./shaders";

/** Heights above the floor below which nothing is cut away [m]. */
const NO_CUT = 1e6;
/** Size of a map's point [m]. */
const POINT = 0.062;
/** Horizontal direction of the light that gives walls their shade. */
const LIGHT = [0.8, 0.6] as const;

/** What the points look like from here. */
export interface MapLook {
  /** What is higher is left out [m in the map]; undefined leaves nothing out. */
  readonly cut: number | undefined;
  readonly focus: { readonly x: number; readonly y: number };
  /** Distances from the focus at which points begin to fade and are faint [m]. */
  readonly fade: readonly [number, number];
  readonly pixelsPerMetre: number;
  /** Factor on the size of points. */
  readonly size: number;
  readonly ratio: number;
}

export class MapLayer {
  readonly object = new Group();
  readonly #points: Points<BufferGeometry, ShaderMaterial>;
  readonly #plate = new FloorPlate();
  bounds: Bounds | undefined;
  /** Height of the floor [m]. */
  floor = 0;
  #share = 1;
  #count = 0;

  constructor() {
    const material = new ShaderMaterial({
      vertexShader: MAP_VERTEX,
      fragmentShader: MAP_FRAGMENT,
      uniforms: {
        uPixelsPerMetre: { value: 1 }, uPixels: { value: new Vector2(1, 8) }, uSize: { value: POINT },
        uFloor: { value: 0 }, uCut: { value: NO_CUT }, uFade: { value: new Vector2(1e5, 2e5) },
        uFocus: { value: new Vector3() }, uFloorColour: { value: new Vector3() }, uLow: { value: new Vector3() },
        uHigh: { value: new Vector3() }, uBackground: { value: new Vector3() },
      },
    });
    this.#points = new Points(new BufferGeometry(), material);
    this.#points.frustumCulled = false;
    this.object.add(this.#plate.object, this.#points);
  }

  /** Show another map, or none; what the last one held on the graphics card is freed. */
  set(map: MapPoints | undefined): void {
    this.#points.geometry.dispose();
    const geometry = new BufferGeometry();
    this.#points.geometry = geometry;
    this.bounds = map && boundsOf(map.positions);
    this.floor = map && this.bounds ? floorHeight(map.positions, this.bounds) : 0;
    this.#plate.set(this.bounds, this.floor);
    this.#count = map === undefined ? 0 : Math.floor(map.positions.length / 3);
    if (map !== undefined) {
      const order = spread(this.#count);
      geometry.setAttribute("position", new BufferAttribute(reordered(map.positions, order), 3));
      geometry.setAttribute("aLook", new BufferAttribute(looks(map.normals, order), 4, true));
    }
    this.setShare(this.#share);
  }

  /** Draw only a share of the points, evenly spread: for graphics that are too slow while the view moves. */
  setShare(share: number): void {
    this.#share = share;
    this.#points.geometry.setDrawRange(0, Math.ceil(this.#count * share));
  }

  setColours(colours: SceneColours): void {
    this.#plate.setColours(colours);
    this.#vector("uFloorColour").set(...colours.floor);
    this.#vector("uLow").set(...colours.wallLow);
    this.#vector("uHigh").set(...colours.wallHigh);
    this.#vector("uBackground").set(...colours.background);
  }

  setLook(look: MapLook): void {
    const { uniforms } = this.#points.material;
    const values = {
      uPixelsPerMetre: look.pixelsPerMetre,
      uSize: (POINT * look.size) / Math.sqrt(this.#share),
      uFloor: this.floor,
      uCut: look.cut ?? NO_CUT,
    };
    for (const [name, value] of Object.entries(values)) {
      const uniform = uniforms[name];
      if (uniform !== undefined) {
        uniform.value = value;
      }
    }
    (uniforms["uPixels"]?.value as Vector2).set(Math.max(1.5 * look.ratio * look.size, 1), 9 * look.ratio * look.size);
    (uniforms["uFade"]?.value as Vector2).set(...look.fade);
    this.#vector("uFocus").set(look.focus.x, look.focus.y, 0);
  }

  dispose(): void {
    this.#plate.dispose();
    this.#points.geometry.dispose();
    this.#points.material.dispose();
  }

  #vector(name: string): Vector3 {
    return this.#points.material.uniforms[name]?.value as Vector3;
  }
}

/** Return an order of n points in which any first part is spread evenly over all of them: equal steps, round and round. */
export function spread(n: number): Uint32Array {
  const order = new Uint32Array(n);
  const step = evenStep(n);
  for (let index = 0, at = 0; index < n; index += 1, at = (at + step) % n) {
    order[index] = at;
  }
  return order;
}

/**
 * Return the step near the golden section of n that misses no point and leaves the most even gaps.
 *
 * The gaps that steps round a circle leave are the more even, the smaller the partial quotients of the continued
 * fraction of step / n (three-gap theorem, Steinhaus). The golden section has the smallest; rounding to whole points
 * spoils the last of them, so that the best of some neighbours is taken.
 */
function evenStep(n: number): number {
  const golden = Math.max(Math.round(n * 0.6180339887), 1);
  let best = { step: 1, quotient: Infinity };
  for (let step = Math.max(golden - 40, 1); step <= Math.min(golden + 40, n); step += 1) {
    const quotient = largestQuotient(step, n);
    best = quotient < best.quotient ? { step, quotient } : best;
  }
  return best.step;
}

/** Return the largest partial quotient of a / b; infinite if the two have a common divisor. */
function largestQuotient(a: number, b: number): number {
  let largest = 0;
  let [high, low] = [b, a];
  while (low > 1) {
    largest = Math.max(largest, Math.floor(high / low));
    [high, low] = [low, high % low];
  }
  return low === 1 ? Math.max(largest, high) : Infinity;
}

function reordered(positions: Float32Array, order: Uint32Array): Float32Array {
  const result = new Float32Array(3 * order.length);
  for (let index = 0; index < order.length; index += 1) {
    const at = 3 * (order[index] ?? 0);
    result[3 * index] = positions[at] ?? 0;
    result[3 * index + 1] = positions[at + 1] ?? 0;
    result[3 * index + 2] = positions[at + 2] ?? 0;
  }
  return result;
}

/** Return for each point how much it faces up or down and its shade, both 0 to 255, and two bytes unused. */
function looks(normals: Int8Array | undefined, order: Uint32Array): Uint8Array {
  const result = new Uint8Array(4 * order.length);
  const known = normals !== undefined && normals.length >= 3 * order.length;
  for (let index = 0; index < order.length; index += 1) {
    const at = 3 * (order[index] ?? 0);
    const up = known ? Math.abs(normals[at + 2] ?? 0) : 0;
    const facing = known ? Math.abs((normals[at] ?? 0) * LIGHT[0] + (normals[at + 1] ?? 0) * LIGHT[1]) : 127;
    result[4 * index] = Math.min(2 * up, 255);
    result[4 * index + 1] = Math.min(2 * Math.max(facing, up), 255);
  }
  return result;
}
