/** The picture as a headset or a wall of screens shows it: all of the world about an operator, who stands somewhere in it. */

import type { ReadonlySignal } from "@preact/signals";
import { Group, type PerspectiveCamera } from "three";
import type { SmoothPose } from "./smooth_pose";
import type { Stage, ViewShare } from "./stage";
import type { Renewed } from "../values";
import type { Viewport } from "./viewport";
import type { Look, World } from "./world";

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
  located(): boolean;
  floor(): number;
  readonly pointSize: ReadonlySignal<number>;
  readonly decay: ReadonlySignal<number>;
}

export class Immersion {
  /** The operator's room, in which the headset gives its poses, placed in the map: x right, y up, z back. */
  readonly room = new Group();
  readonly camera: PerspectiveCamera;
  /** One object for good, renewed each frame: what is thrown away in the frame loop comes back as a pause. */
  readonly #kept: Renewed<Omit<Look, "viewport">> & { readonly viewport: Renewed<Viewport> } = {
    viewport: { width: 1, height: 1, ratio: 1, tangent: 1, pixelsPerMetre: 1, metresPerPixel: 1 },
    distance: 10, inside: true, view: "chase", located: false, floor: 0, size: 1, decay: 0, thin: THIN_FROM,
  };
  /** The robot as it is drawn. */
  readonly robot: SmoothPose;

  constructor(
    private readonly stage: Stage, private readonly world: World, pose: SmoothPose,
    private readonly facts: ImmersionFacts,
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

  /** Extent of the building [m], as far as it is known. */
  get bounds(): World["bounds"] {
    return this.world.bounds;
  }

  /** Height of its floor [m]. */
  get floor(): number {
    return this.facts.floor();
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
      const { scale, ground } = frame(interval, xr);
      const { framebufferWidth = 1000, framebufferHeight = 1000 } = session.renderState.baseLayer ?? {};
      this.#look(framebufferWidth, framebufferHeight, this.camera, scale, ground);
    }, () => {
      room.removeFromParent();
      camera.removeFromParent();
      this.world.setGround(true);
      this.world.robot.setBodyVisible(true);
      ended();
    });
  }

  /**
   * Draw what cameras see that stand on a platform in the map, each in its part of the page, from now on.
   *
   * @param frame Brings the platform to this moment; true if another picture is wanted soon.
   */
  divide(platform: Group, views: readonly ViewShare[], frame: () => boolean): void {
    this.#kept.view = "first"; // names would be cut where screens meet
    this.stage.scene.add(platform);
    this.stage.divide(views, (interval) => {
      const moving = frame();
      this.robot.advance(Math.min(interval, 100));
      const { width, height, ratio } = this.stage.size;
      const [first] = views;
      this.#look(width * ratio, height * ratio, first?.camera ?? this.camera, 1, true);
      this.world.robot.setBodyVisible(false);
      return moving;
    });
  }

  #look(width: number, height: number, camera: PerspectiveCamera, scale: number, ground: boolean): void {
    const look = this.#kept;
    const { viewport } = look;
    viewport.width = width;
    viewport.height = height;
    viewport.tangent = 1 / Math.max(camera.projectionMatrix.elements[5], 1e-3);
    viewport.pixelsPerMetre = viewport.height / (2 * viewport.tangent) / scale;
    viewport.metresPerPixel = 1 / viewport.pixelsPerMetre;
    look.inside = scale === 1;
    look.located = this.facts.located();
    look.floor = this.facts.floor();
    look.size = this.facts.pointSize.value;
    look.decay = this.facts.decay.value;
    this.world.setGround(ground);
    this.world.look(look, this.robot, performance.now());
    this.world.robot.setBodyVisible(true);
  }
}
