/** The picture for parts of the page that are loaded later and draw into it. */

import type { ReadonlySignal } from "@preact/signals";
import type { Object3D, PerspectiveCamera } from "three";

export interface Workshop {
  readonly canvas: HTMLCanvasElement;
  readonly camera: PerspectiveCamera;
  /** The map's frame. */
  readonly world: Object3D;
  /** The robot's own frame: what is in it goes with the robot. */
  readonly base: Object3D;
  /** The robot as it is drawn, in `base`; another one when its description changes. */
  readonly model: ReadonlySignal<Object3D>;
  /** Have a picture drawn soon; whole with all pixels, also where the machine is too slow for that while driving. */
  draw(whole?: boolean): void;
  /** Leave pointers on the picture to somebody else, with the view held still, or give them back to the camera. */
  holdView(held: boolean): void;
}
