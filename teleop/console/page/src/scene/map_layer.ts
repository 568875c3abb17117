/** The map as points, quiet, so that what is alive stands out before it. */

import { BufferGeometry, Group, Points, ShaderMaterial, Vector2, Vector3 } from "three";
import type { MapPoints } from "../values";
import { FloorPlate } from "./floor_plate";
import { boundsOf, floorHeight, type Bounds } from "./geometry";
import { MapGeometry } from "./map_points";
import type { SceneColours } from "./palette";
import { MAP_FRAGMENT, MAP_VERTEX } from "./shaders";

/** Heights above the floor below which nothing is cut away [m]. */
const NO_CUT = 1e6;
/** Size of a map's point [m]. */
const POINT = 0.062;
/** Points that are taken in at once, in a few ms. */
const PART = 50_000;

/** What the points look like from here. */
export interface MapLook {
  /** What is higher is left out [m in the map]; undefined leaves nothing out. */
  readonly cut: number | undefined;
  readonly focus: { readonly x: number; readonly y: number };
  /** Distance from the focus at which points begin to fade; they are faint at three times that [m]. */
  readonly fadeFrom: number;
  readonly pixelsPerMetre: number;
  /** Factor on the size of points. */
  readonly size: number;
  readonly ratio: number;
  /** Distance of the eye from which on points are thinned [m]; undefined: nowhere. */
  readonly thin?: number | undefined;
}

export class MapLayer {
  readonly object = new Group();
  readonly #points: Points<BufferGeometry, ShaderMaterial>;
  readonly #plate = new FloorPlate();
  bounds: Bounds | undefined;
  /** Height of the floor [m]. */
  floor = 0;
  #share = 1;
  #content: MapGeometry | undefined;
  #timer: ReturnType<typeof setTimeout> | undefined;
  readonly #grown: () => void;

  /** `grown` is called when more of a map can be drawn than before. */
  constructor(grown: () => void = () => undefined) {
    this.#grown = grown;
    const material = new ShaderMaterial({
      vertexShader: MAP_VERTEX,
      fragmentShader: MAP_FRAGMENT,
      uniforms: {
        uPixelsPerMetre: { value: 1 }, uPixels: { value: new Vector2(1, 8) }, uSize: { value: POINT },
        uFloor: { value: 0 }, uCut: { value: NO_CUT }, uFade: { value: new Vector2(1e5, 2e5) },
        uThin: { value: NO_CUT }, uCount: { value: 1 },
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
    clearTimeout(this.#timer);
    this.#points.geometry.dispose();
    this.#content = map && new MapGeometry(map);
    this.#points.geometry = this.#content?.geometry ?? new BufferGeometry();
    this.bounds = map && boundsOf(map.positions);
    this.floor = map && this.bounds ? floorHeight(map.positions, this.bounds) : 0;
    this.#plate.set(this.bounds, this.floor);
    this.#fill();
  }

  /** Draw only a share of the points, evenly spread: for graphics that are too slow while the view moves. */
  setShare(share: number): void {
    this.#share = share;
    const { count, filled } = this.#content ?? { count: 0, filled: 0 };
    const drawn = Math.min(Math.ceil(count * share), filled);
    this.#points.geometry.setDrawRange(0, drawn);
    this.#set("uCount", drawn);
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
    this.#set("uPixelsPerMetre", look.pixelsPerMetre);
    this.#set("uSize", (POINT * look.size) / Math.sqrt(this.#share));
    this.#set("uFloor", this.floor);
    this.#set("uCut", look.cut ?? NO_CUT);
    this.#set("uThin", look.thin ?? NO_CUT);
    (uniforms["uPixels"]?.value as Vector2).set(Math.max(1.5 * look.ratio * look.size, 1), 9 * look.ratio * look.size);
    (uniforms["uFade"]?.value as Vector2).set(look.fadeFrom, 3 * look.fadeFrom);
    this.#vector("uFocus").set(look.focus.x, look.focus.y, 0);
  }

  /** Draw the plate below the points, or leave it out. */
  setPlate(shown: boolean): void {
    this.#plate.object.material.visible = shown;
  }

  dispose(): void {
    clearTimeout(this.#timer);
    this.#plate.dispose();
    this.#points.geometry.dispose();
    this.#points.material.dispose();
  }

  #fill(): void {
    const content = this.#content;
    if (content !== undefined) {
      content.fill(PART);
      if (content.filled < content.count) {
        this.#timer = setTimeout(() => { this.#fill(); }, 0);
      }
    }
    this.setShare(this.#share);
    this.#grown();
  }

  #set(name: string, value: number): void {
    const uniform = this.#points.material.uniforms[name];
    // A number put into it becomes an object: most are the same in each frame.
    if (uniform !== undefined && uniform.value !== value) {
      uniform.value = value;
    }
  }

  #vector(name: string): Vector3 {
    return this.#points.material.uniforms[name]?.value as Vector3;
  }
}
