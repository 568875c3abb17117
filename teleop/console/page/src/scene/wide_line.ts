/** Lines of a width in pixels, whatever their distance: path, outlines, ellipses. One draw call each. */

import { DynamicDrawUsage, InstancedInterleavedBuffer, InterleavedBufferAttribute, SRGBColorSpace } from "three";
import { LineMaterial } from "three/addons/lines/LineMaterial.js";
import { LineSegments2 } from "three/addons/lines/LineSegments2.js";
import { LineSegmentsGeometry } from "three/addons/lines/LineSegmentsGeometry.js";
import { markChanged } from "./changed";
import type { Rgb } from "./palette";

/** The points of a line: x, y, z in turn [m]. */
export type Line = readonly number[];

/** How a wide line looks. */
export interface LineLook {
  /** Width [px of the page]. */
  readonly width: number;
  /** Seen through everything else. */
  readonly overlaid?: boolean;
}

/** Lines of which the last may be appended to. */
export class WideLine {
  readonly object: LineSegments2;
  readonly #buffer: InstancedInterleavedBuffer;
  /** Both ends of each segment: six numbers. */
  readonly #ends: Float32Array;
  #count = 0;
  #last: readonly [number, number, number] | undefined;

  /** @param capacity Most segments; when more are appended, the oldest go. */
  constructor(capacity: number, { width, overlaid = false }: LineLook) {
    this.#ends = new Float32Array(6 * capacity);
    // One buffer for good: three's own way makes a new one for each change, and would not free the last.
    this.#buffer = new InstancedInterleavedBuffer(this.#ends, 6);
    this.#buffer.setUsage(DynamicDrawUsage);
    const geometry = new LineSegmentsGeometry();
    geometry.setAttribute("instanceStart", new InterleavedBufferAttribute(this.#buffer, 3, 0));
    geometry.setAttribute("instanceEnd", new InterleavedBufferAttribute(this.#buffer, 3, 3));
    geometry.instanceCount = 0;
    const material = new LineMaterial({ linewidth: width, transparent: overlaid, depthTest: !overlaid, depthWrite: false });
    this.object = new LineSegments2(geometry, material);
    this.object.frustumCulled = false;
    this.object.renderOrder = overlaid ? 6 : 2;
  }

  set visible(shown: boolean) {
    this.object.visible = shown;
  }

  setColour(colour: Rgb): void {
    this.object.material.color.setRGB(...colour, SRGBColorSpace);
  }

  /** Replace the lines. */
  set(lines: readonly Line[]): void {
    this.clear();
    for (const line of lines) {
      this.gap();
      for (let at = 0; at < line.length; at += 3) {
        this.#write(line[at] ?? 0, line[at + 1] ?? 0, line[at + 2] ?? 0);
      }
    }
    this.#changed(0);
  }

  /** Append a point; when there is no more room, the oldest quarter goes. */
  append(x: number, y: number, z: number): void {
    this.#changed(this.#write(x, y, z));
  }

  /** Interrupt the line: no segment joins the last point and the next one. */
  gap(): void {
    this.#last = undefined;
  }

  clear(): void {
    this.#count = this.object.geometry.instanceCount = 0;
    this.#last = undefined;
  }

  dispose(): void {
    this.object.geometry.dispose();
    this.object.material.dispose();
  }

  /** Write a point; returns from which segment on something is new. */
  #write(x: number, y: number, z: number): number {
    let from = this.#count;
    const capacity = this.#ends.length / 6;
    if (this.#count === capacity) {
      const dropped = Math.max(Math.floor(capacity / 4), 1);
      this.#ends.copyWithin(0, 6 * dropped);
      this.#count -= dropped;
      from = 0;
    }
    if (this.#last !== undefined) {
      this.#ends.set([...this.#last, x, y, z], 6 * this.#count);
      this.#count += 1;
    }
    this.#last = [x, y, z];
    return from;
  }

  #changed(from: number): void {
    this.object.geometry.instanceCount = this.#count;
    if (this.#count > from) {
      markChanged(this.#buffer, 6 * from, 6 * (this.#count - from));
    }
  }
}
