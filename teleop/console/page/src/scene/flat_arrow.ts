/** An arrow on the floor that says where a robot is that is too small to be seen. */

import { BufferGeometry, Float32BufferAttribute, Group, Mesh, MeshBasicMaterial, SRGBColorSpace } from "three";
import type { Rgb } from "./palette";

/** Tip, corners and notch of an arrow of length 1 along x. */
const SHAPE = [0.58, 0, 0, -0.42, 0.4, 0, -0.2, 0, 0, -0.42, -0.4, 0];

export class FlatArrow {
  readonly object = new Group();
  readonly #geometry = new BufferGeometry();
  readonly #inside = new MeshBasicMaterial({ depthTest: false, transparent: true });
  readonly #edge = new MeshBasicMaterial({ depthTest: false, transparent: true });

  constructor() {
    this.#geometry.setAttribute("position", new Float32BufferAttribute(SHAPE, 3));
    this.#geometry.setIndex([0, 1, 2, 0, 2, 3]);
    const [edge, inside] = [new Mesh(this.#geometry, this.#edge), new Mesh(this.#geometry, this.#inside)];
    edge.scale.setScalar(1.35);
    edge.renderOrder = 7;
    inside.renderOrder = 8;
    this.object.add(edge, inside);
  }

  setColours(inside: Rgb, edge: Rgb): void {
    this.#inside.color.setRGB(...inside, SRGBColorSpace);
    this.#edge.color.setRGB(...edge, SRGBColorSpace);
  }

  dispose(): void {
    this.#geometry.dispose();
    this.#inside.dispose();
    this.#edge.dispose();
  }
}
