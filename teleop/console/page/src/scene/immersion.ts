/** The picture as a headset sees it: all of the world about an operator, who stands somewhere in it at some scale. */

import { Group, type PerspectiveCamera } from "three";
import type { SmoothPose } from "./smooth_pose";
import type { Stage } from "./stage";
import type { World } from "./world";

/** Distances of the operator's room between which things are drawn [m]: a hand's breadth, and beyond any building. */
const DEPTH = { near: 0.05, far: 1000 };
/** Points of the map farther away than this are thinned, so that as many are drawn for each degree of view [m]. */
const THIN_FROM = 4;

/** How the operator stands in the world. */
export interface Standing {
  /** Metres of the map for one of the operator's room: 1, or 20 before a table. */
  readonly scale: number;
  /** Whether floors are drawn; not where the room's own is to be seen. */
  readonly ground: boolean;
}

/** What the picture knows beside the world itself. */
export interface ImmersionFacts {
  readonly located: boolean;
  readonly floor: number;
  readonly size: number;
  readonly decay: number;
}

export class Immersion {
  /** The operator's room, in which the headset gives its poses, placed in the map: x right, y up, z back. */
  readonly room = new Group();
  readonly camera: PerspectiveCamera;
  /** The robot as it is drawn. */
  readonly robot: SmoothPose;

  constructor(
    private readonly stage: Stage, private readonly world: World, pose: SmoothPose,
    private readonly facts: () => ImmersionFacts,
  ) {
    [this.camera, this.robot] = [stage.camera, pose];
  }

  /** Reference space of the headset's poses; null while none is worn. */
  get space(): XRReferenceSpace | null {
    return this.stage.roomSpace;
  }

  /** Script time of the last frames [ms], oldest first. */
  frameTimes(): number[] {
    return this.stage.frameTimes.values();
  }

  /** Extent of the building [m], as far as it is known, and the height of its floor. */
  get plan(): { readonly bounds: World["bounds"]; readonly floor: number } {
    return { bounds: this.world.bounds, floor: this.facts().floor };
  }

  /**
   * Draw for a headset until its session ends.
   *
   * @param frame Brings everything to this moment, so many ms after the last one, and says how the operator stands.
   * @param ended Is called once the page draws again.
   */
  async begin(session: XRSession, frame: (interval: number, xr: XRFrame) => Standing, ended: () => void): Promise<void> {
    const { camera, room } = this;
    this.stage.scene.add(room);
    room.add(camera);
    [camera.near, camera.far] = [DEPTH.near, DEPTH.far];
    await this.stage.immerse(session, (interval, xr) => {
      // After a pause, time begins anew: nothing leaps because nothing was drawn for a while.
      this.robot.advance(Math.min(interval, 100));
      this.#look(session, frame(interval, xr));
    }, () => {
      room.removeFromParent();
      camera.removeFromParent();
      this.world.setGround(true);
      this.world.robot.setBodyVisible(true);
      ended();
    });
  }

  #look(session: XRSession, { scale, ground }: Standing): void {
    const { located, floor, size, decay } = this.facts();
    const layer = session.renderState.baseLayer;
    const height = layer?.framebufferHeight ?? 1000;
    const tangent = 1 / Math.max(this.camera.projectionMatrix.elements[5], 1e-3);
    const pixelsPerMetre = height / (2 * tangent) / scale;
    const metresPerPixel = 1 / pixelsPerMetre;
    this.world.setGround(ground);
    this.world.look({
      viewport: { width: layer?.framebufferWidth ?? 1000, height, ratio: 1, tangent, pixelsPerMetre, metresPerPixel },
      distance: 10, inside: scale === 1, view: "chase", located, floor, size, decay, thin: THIN_FROM,
    }, this.robot, performance.now());
    this.world.robot.setBodyVisible(true);
  }
}
