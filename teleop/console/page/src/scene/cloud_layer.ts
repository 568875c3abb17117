/** Live points, coloured by their distance to the map; also the old sweeps and the ghost of a sweep at a hint. */

import { BufferAttribute, BufferGeometry, DynamicDrawUsage, Points, ShaderMaterial, Vector2, Vector3 } from "three";
import { markChanged } from "./changed";
import { DISTANCE_FULL, type Rgb, type SceneColours } from "./palette";
import { CLOUD_FRAGMENT, CLOUD_VERTEX } from "./shaders";

/** Height [m] above which nothing is cut. */
export const NO_CUT = 1e6;
/** Size of a live point [m]. */
const POINT = 0.075;

/** Points that several layers may show at different places: positions, distances and births. */
export class PointBuffer {
  readonly geometry = new BufferGeometry();
  readonly capacity: number;
  readonly positions: BufferAttribute;
  readonly distances: BufferAttribute;
  readonly births: BufferAttribute;

  constructor(capacity: number) {
    this.capacity = capacity;
    const attribute = (size: number): BufferAttribute =>
      new BufferAttribute(new Float32Array(size * capacity), size).setUsage(DynamicDrawUsage);
    this.positions = attribute(3);
    this.distances = attribute(1);
    this.births = attribute(1);
    this.geometry.setAttribute("position", this.positions);
    this.geometry.setAttribute("aDistance", this.distances);
    this.geometry.setAttribute("aBirth", this.births);
    this.geometry.setDrawRange(0, 0);
  }

  /** Write points from an index on, and have just these sent to the graphics card. */
  write(at: number, positions: Float32Array, distances: Float32Array, birth: number): void {
    const count = Math.min(Math.floor(positions.length / 3), this.capacity - at);
    if (count <= 0) {
      return;
    }
    this.positions.array.set(positions.subarray(0, 3 * count), 3 * at);
    for (let index = 0; index < count; index += 1) {
      const distance = distances[index] ?? NaN;
      this.distances.array[at + index] = Number.isFinite(distance) ? Math.abs(distance) : -1;
    }
    this.births.array.fill(birth, at, at + count);
    for (const attribute of [this.positions, this.distances, this.births]) {
      markChanged(attribute, at * attribute.itemSize, count * attribute.itemSize);
    }
  }
}

/** What points look like from here. */
export interface CloudLook {
  readonly cut: number | undefined;
  readonly pixelsPerMetre: number;
  readonly size: number;
  readonly ratio: number;
  /** Time of the births' clock [s]. */
  readonly now: number;
}

export class CloudLayer {
  readonly object: Points<BufferGeometry, ShaderMaterial>;

  constructor(buffer: PointBuffer) {
    const material = new ShaderMaterial({
      vertexShader: CLOUD_VERTEX,
      fragmentShader: CLOUD_FRAGMENT,
      uniforms: {
        uPixelsPerMetre: { value: 1 }, uPixels: { value: new Vector2(2, 14) }, uSize: { value: POINT },
        uCut: { value: NO_CUT }, uFull: { value: DISTANCE_FULL },
        uScale: { value: [new Vector3(), new Vector3(), new Vector3()] }, uUnknown: { value: new Vector3() },
        uTint: { value: new Vector3() }, uTinted: { value: 0 }, uNow: { value: 0 }, uDecay: { value: -1 },
        uBackground: { value: new Vector3() }, uHalo: { value: new Vector3() },
      },
    });
    this.object = new Points(buffer.geometry, material);
    this.object.frustumCulled = false;
    this.object.renderOrder = 3;
  }

  setColours(colours: SceneColours): void {
    const { uniforms } = this.object.material;
    const scale = uniforms["uScale"]?.value as Vector3[];
    scale.forEach((stop, index) => stop.set(...(colours.distances[index] ?? colours.unknown)));
    (uniforms["uUnknown"]?.value as Vector3).set(...colours.unknown);
    (uniforms["uBackground"]?.value as Vector3).set(...colours.background);
    (uniforms["uHalo"]?.value as Vector3).set(...colours.background);
  }

  /** Paint the points in one colour, wholly or in part. */
  setTint(colour: Rgb, share: number): void {
    (this.object.material.uniforms["uTint"]?.value as Vector3).set(...colour);
    this.#set("uTinted", share);
  }

  /** Let points fade away within so many seconds; negative: they stay. */
  setDecay(seconds: number): void {
    this.#set("uDecay", seconds);
  }

  /** @param cut What is higher is left out [m]. */
  setLook(look: CloudLook, cut = look.cut): void {
    this.#set("uPixelsPerMetre", look.pixelsPerMetre);
    this.#set("uSize", POINT * look.size);
    this.#set("uCut", cut ?? NO_CUT);
    this.#set("uNow", look.now);
    const least = 3.4 * look.ratio * look.size;
    (this.object.material.uniforms["uPixels"]?.value as Vector2).set(least, 4 * least);
  }

  dispose(): void {
    this.object.geometry.dispose();
    this.object.material.dispose();
  }

  #set(name: string, value: number): void {
    const uniform = this.object.material.uniforms[name];
    // A number put into it becomes an object: most are the same in each frame.
    if (uniform !== undefined && uniform.value !== value) {
      uniform.value = value;
    }
  }
}
