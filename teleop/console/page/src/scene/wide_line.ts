/** Lines of a width in pixels, whatever their distance: path, outlines, ellipses. One draw call each. */

import {
  BufferAttribute, InstancedBufferGeometry, InstancedInterleavedBuffer, InterleavedBufferAttribute, Mesh,
  ShaderMaterial, Vector2, Vector3, DynamicDrawUsage,
} from "three";
import { markChanged } from "./changed";
import type { Rgb } from "./palette";
import { LINE_FRAGMENT, LINE_VERTEX } from "./shaders";

/** A height [m] that says: no line from or to this point. */
const GAP = -1e9;

const QUAD = new Float32Array([0, -1, 0, 1, -1, 0, 1, 1, 0, 0, 1, 0]);

/** How a wide line looks. */
export interface LineLook {
  /** Width [px of the screen at a pixel ratio of 1]. */
  readonly width: number;
  readonly opacity?: number;
  /** Seen through everything else. */
  readonly overlaid?: boolean;
}

/** A line through points, which may be appended to until the capacity is reached. */
export class WideLine {
  readonly object: Mesh<InstancedBufferGeometry, ShaderMaterial>;
  readonly #buffer: InstancedInterleavedBuffer;
  readonly #points: Float32Array;
  readonly #width: number;
  #count = 0;

  constructor(capacity: number, look: LineLook) {
    this.#points = new Float32Array(3 * capacity);
    this.#width = look.width;
    this.#buffer = new InstancedInterleavedBuffer(this.#points, 3);
    this.#buffer.setUsage(DynamicDrawUsage);
    const geometry = new InstancedBufferGeometry();
    geometry.setAttribute("position", new BufferAttribute(QUAD, 3));
    geometry.setIndex([0, 1, 2, 0, 2, 3]);
    // Start and end of a segment are the same buffer, read one point apart.
    geometry.setAttribute("aStart", new InterleavedBufferAttribute(this.#buffer, 3, 0));
    geometry.setAttribute("aEnd", new InterleavedBufferAttribute(this.#buffer, 3, 3));
    geometry.instanceCount = 0;
    const opacity = look.opacity ?? 1;
    const material = new ShaderMaterial({
      vertexShader: LINE_VERTEX,
      fragmentShader: LINE_FRAGMENT,
      uniforms: {
        uViewport: { value: new Vector2(1, 1) },
        uWidth: { value: look.width },
        uColour: { value: new Vector3() },
        uOpacity: { value: opacity },
      },
      transparent: opacity < 1 || look.overlaid === true,
      depthTest: look.overlaid !== true,
      depthWrite: false,
    });
    this.object = new Mesh(geometry, material);
    this.object.frustumCulled = false;
    this.object.renderOrder = look.overlaid === true ? 6 : 2;
  }

  get count(): number {
    return this.#count;
  }

  set visible(shown: boolean) {
    this.object.visible = shown;
  }

  setColour(colour: Rgb): void {
    (this.object.material.uniforms["uColour"]?.value as Vector3).set(...colour);
  }

  /** Tell the line how large the picture is [px], and how many pixels of it make one of the screen. */
  setViewport(width: number, height: number, ratio: number): void {
    const { uniforms } = this.object.material;
    (uniforms["uViewport"]?.value as Vector2).set(width, height);
    if (uniforms["uWidth"] !== undefined) {
      uniforms["uWidth"].value = this.#width * ratio;
    }
  }

  /** Replace the points: x, y, z in turn; more than the capacity are left out. */
  set(points: ArrayLike<number>): void {
    const length = Math.min(points.length, this.#points.length);
    for (let at = 0; at < length; at += 1) {
      this.#points[at] = points[at] ?? 0;
    }
    this.#count = Math.floor(length / 3);
    this.#changed(0, this.#count);
  }

  /** Append a point; when the line is full, its oldest quarter goes. */
  append(x: number, y: number, z: number): void {
    const capacity = this.#points.length / 3;
    if (this.#count === capacity) {
      const dropped = Math.max(Math.floor(capacity / 4), 1);
      this.#points.copyWithin(0, 3 * dropped);
      this.#count -= dropped;
      this.#changed(0, this.#count);
    }
    this.#points.set([x, y, z], 3 * this.#count);
    this.#count += 1;
    this.#changed(this.#count - 1, this.#count);
  }

  /** Interrupt the line: no segment joins the last point and the next one. */
  gap(): void {
    if (this.#count > 0) {
      this.append(0, 0, GAP);
    }
  }

  clear(): void {
    this.#count = 0;
    this.object.geometry.instanceCount = 0;
  }

  dispose(): void {
    this.object.geometry.dispose();
    this.object.material.dispose();
  }

  #changed(from: number, to: number): void {
    this.object.geometry.instanceCount = Math.max(this.#count - 1, 0);
    markChanged(this.#buffer, 3 * from, 3 * (to - from));
  }
}

/** Return the points of several lines, one after the other, with gaps between them. */
export function joined(lines: readonly (readonly number[])[]): number[] {
  return lines.flatMap((line, index) => (index === 0 ? [...line] : [0, 0, GAP, ...line]));
}
