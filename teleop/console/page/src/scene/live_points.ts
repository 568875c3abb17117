/** What the scanners see: the live cloud, the scan of a robot without a place, old sweeps. */

import { Group, Quaternion, Vector3 } from "three";
import type { CloudPoints, Pose } from "../values";
import { CloudLayer, PointBuffer, type CloudLook } from "./cloud_layer";
import { planar } from "./geometry";
import { OldSweeps, OLD_POINTS, thinned } from "./old_sweeps";
import type { SceneColours } from "./palette";
import { place } from "./robot_layer";

/** Live points that are drawn at most; larger clouds are thinned. */
const LIVE_POINTS = 65_536;
/** Frames of clouds that lie where they say, in the world of the picture. */
const WORLD_FRAMES = ["map", "odom"];
/** Share of the live points that is kept as old is chosen for at least this rate of sweeps [1/s]. */
const LEAST_RATE = 1;

export class LivePoints {
  readonly object = new Group();
  /** Points of the cloud, and of the scan in `base_link`. */
  readonly cloud = new PointBuffer(LIVE_POINTS);
  readonly scan = new PointBuffer(LIVE_POINTS);
  /** The robot's pose when the cloud came. */
  cloudPose: Pose | undefined;
  readonly #cloudLayer = new CloudLayer(this.cloud);
  readonly #scanLayer = new CloudLayer(this.scan);
  readonly #oldBuffer = new PointBuffer(OLD_POINTS);
  readonly #oldLayer = new CloudLayer(this.#oldBuffer);
  readonly #old = new OldSweeps(this.#oldBuffer);
  readonly #layers = [this.#oldLayer, this.#scanLayer, this.#cloudLayer];
  #last: CloudPoints | undefined;
  #hasCloud = false;

  constructor() {
    this.#oldLayer.setDecay(1);
    this.#oldLayer.object.renderOrder = 1;
    this.object.add(...this.#layers.map((layer) => layer.object));
  }

  get hasCloud(): boolean {
    return this.#hasCloud;
  }

  /** Show a new cloud; the one before becomes old, if the robot has moved. Times in ms. */
  setCloud(cloud: CloudPoints | undefined, pose: Pose | undefined, now: number, decay: number): void {
    const [before, beforePose] = [this.#last, this.cloudPose];
    if (before !== undefined && beforePose !== undefined && decay > 0 && inWorld(before)) {
      const from = planar(beforePose);
      const rate = cloud === undefined ? LEAST_RATE : 1000 / Math.max(cloud.receivedAt - before.receivedAt, 1);
      if (this.#old.isNews(from)) {
        this.#old.push(before.positions, before.distances, from, now / 1000, decay, Math.min(Math.max(rate, LEAST_RATE), 20));
      }
    }
    this.#last = cloud;
    this.cloudPose = pose;
    this.#hasCloud = cloud !== undefined;
    fill(this.cloud, cloud);
    this.#cloudLayer.object.position.set(0, 0, 0);
    this.#cloudLayer.object.quaternion.identity();
    if (cloud !== undefined && pose !== undefined && !inWorld(cloud)) {
      place(this.#cloudLayer.object, pose);
    }
  }

  /** Show another scan, of a robot without a place only what is this near [m]. */
  setScan(scan: CloudPoints | undefined, radius = Infinity): void {
    fill(this.scan, scan === undefined || radius === Infinity ? scan : nearby(scan, radius));
  }

  /** Put the scan where the robot stands. */
  placeScan(position: Vector3, orientation: Quaternion): void {
    this.#scanLayer.object.position.copy(position);
    this.#scanLayer.object.quaternion.copy(orientation);
  }

  /** Whether points of old sweeps are still to be seen to fade. */
  isFading(now: number, decay: number): boolean {
    return this.#old.count > 0 && now / 1000 - this.#old.newest < decay + 0.3;
  }

  show(cloud: boolean, scan: boolean, old: boolean): void {
    this.#cloudLayer.object.visible = cloud;
    this.#scanLayer.object.visible = scan;
    this.#oldLayer.object.visible = old;
  }

  setColours(colours: SceneColours, stale: boolean): void {
    for (const layer of this.#layers) {
      layer.setColours(colours);
      layer.setTint(colours.stale, stale ? 0.85 : 0);
    }
  }

  setLook(look: CloudLook, decay: number): void {
    this.#oldLayer.setDecay(Math.max(decay, 0));
    this.#oldLayer.setLook(look);
    this.#scanLayer.setLook(look);
    this.#cloudLayer.setLook(look);
  }

  /** Drop what belongs to a run of the robot. */
  clear(): void {
    this.#old.clear();
    this.setCloud(undefined, undefined, 0, 0);
    this.setScan(undefined);
  }

  dispose(): void {
    for (const layer of this.#layers) {
      layer.dispose();
    }
  }
}

function inWorld(cloud: CloudPoints): boolean {
  return WORLD_FRAMES.includes(cloud.frame);
}

/** Return the points within a radius about the origin of their frame. */
function nearby(points: CloudPoints, radius: number): CloudPoints {
  const { positions, distances } = points;
  const kept = [...distances.keys()].filter((at) => Math.hypot(positions[3 * at] ?? NaN, positions[3 * at + 1] ?? NaN) <= radius);
  return {
    ...points,
    positions: Float32Array.from(kept.flatMap((at) => [...positions.subarray(3 * at, 3 * at + 3)])),
    distances: Float32Array.from(kept, (at) => distances[at] ?? NaN),
  };
}

function fill(buffer: PointBuffer, points: CloudPoints | undefined): void {
  const shown = points && thinned(points.positions, points.distances, LIVE_POINTS);
  if (shown !== undefined) {
    buffer.write(0, shown.positions, shown.distances, 0);
  }
  buffer.geometry.setDrawRange(0, shown === undefined ? 0 : Math.floor(shown.positions.length / 3));
}
