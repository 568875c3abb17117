/** A plate under the map, so that the building stands on something where nobody scanned the floor. */

import { Mesh, MeshBasicMaterial, PlaneGeometry, SRGBColorSpace } from "three";
import type { Bounds } from "./geometry";
import type { SceneColours } from "./palette";

/** Room around the map [m]. */
const EDGE = 0.6;

export class FloorPlate {
  readonly object: Mesh<PlaneGeometry, MeshBasicMaterial>;

  constructor() {
    // It hides nothing, also where the ground is lower: it is drawn first, and leaves no depth behind.
    this.object = new Mesh(new PlaneGeometry(1, 1), new MeshBasicMaterial({ depthTest: false, depthWrite: false }));
    this.object.renderOrder = -3;
    this.object.visible = false;
  }

  set(bounds: Bounds | undefined, floor: number): void {
    this.object.visible = bounds !== undefined;
    if (bounds !== undefined) {
      const { min, max } = bounds;
      this.object.position.set((min.x + max.x) / 2, (min.y + max.y) / 2, floor);
      this.object.scale.set(max.x - min.x + 2 * EDGE, max.y - min.y + 2 * EDGE, 1);
    }
  }

  setColours(colours: SceneColours): void {
    this.object.material.color.setRGB(...colours.plate, SRGBColorSpace);
  }

  dispose(): void {
    this.object.geometry.dispose();
    this.object.material.dispose();
  }
}
