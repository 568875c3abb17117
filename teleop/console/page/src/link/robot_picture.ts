/** Turns checked messages into the robot's state: one method for each kind of message. */

import { batch } from "@preact/signals";
import type { RobotState } from "../robot/robot_state";
import type { CloudPoints, Quaternion } from "../values";
import type { Estimate, Inertial, Odometry, Transform } from "./message_checks/pose_messages";
import { movePoints, rollAndPitch } from "./rigid_transform";
import { TransformTree } from "./transform_tree";

/** Frames that are the robot's own, by REP 105; the first that is known counts. */
const BASES = ["base_link", "base_footprint"];
const MAP = "map";
const ODOM = "odom";

/** Attitude is taken from the inertial unit if the pose is older than this [ms]. */
const POSE_FRESH = 500;
/** For so long `map` to `odom` is combined with newer odometry [ms]; of a robot that sends both together. */
const TOGETHER = 300;
/** The same of other robots, whose localisers publish seldom. */
const APART = 10_000;

export class RobotPicture {
  readonly #state: RobotState;
  readonly #tree = new TransformTree();
  readonly #fixed = new TransformTree();

  constructor(state: RobotState) {
    this.#state = state;
  }

  /** Forget the frames of a run; those that never move are kept, being renewed by their own topic. */
  clear(): void {
    this.#tree.clear();
  }

  transforms(transforms: readonly Transform[], fixed: boolean, now: number): void {
    for (const transform of transforms) {
      this.#tree.add(transform, now);
      if (fixed) {
        this.#fixed.add(transform, now);
      }
    }
    this.#poses(now);
  }

  #poses(now: number): void {
    const tree = this.#tree;
    const base = BASES.find((name) => tree.branch(name) !== undefined);
    if (base === undefined) {
      return;
    }
    const mapBranch = tree.branch(ODOM);
    const stamp = tree.branch(base)?.stamp ?? 0;
    const farsteer = this.#state.dialect.value === "farsteer";
    batch(() => {
      const odomFromBase = tree.lookup(ODOM, base);
      if (odomFromBase !== undefined) {
        this.#state.odomFromBase.value = { ...odomFromBase, stamp, receivedAt: now };
      }
      if (mapBranch?.parent === MAP) {
        const { position, orientation, stamp: mapStamp, receivedAt } = mapBranch;
        this.#state.mapFromOdom.value = { position, orientation, stamp: mapStamp, receivedAt };
        if (now - receivedAt > (farsteer ? TOGETHER : APART)) {
          return;
        }
      }
      const mapFromBase = tree.lookup(MAP, base);
      if (mapFromBase !== undefined) {
        this.#state.mapFromBase.value = { ...mapFromBase, stamp, receivedAt: now };
        this.#attitude(mapFromBase.orientation, "/tf", now);
      }
    });
  }

  #attitude(orientation: Quaternion, source: string, now: number): void {
    this.#state.attitude.value = { ...rollAndPitch(orientation), source, receivedAt: now };
  }

  inertial({ orientation }: Inertial, topic: string, now: number): void {
    const pose = this.#state.mapFromBase.peek();
    if (orientation !== undefined && (pose === undefined || now - pose.receivedAt > POSE_FRESH)) {
      this.#attitude(orientation, topic, now);
    }
  }

  /** The estimate with its covariance; its pose counts where no transforms give one. */
  estimate({ pose, covariance }: Estimate): void {
    batch(() => {
      this.#state.covariance.value = covariance;
      const known = this.#state.mapFromBase.peek();
      if (known === undefined || pose.receivedAt - known.receivedAt > POSE_FRESH) {
        this.#state.mapFromBase.value = pose;
        this.#attitude(pose.orientation, "/amcl_pose", pose.receivedAt);
      }
    });
  }

  /** Odometry of a robot without transforms. */
  odometry({ pose }: Odometry): void {
    const known = this.#state.odomFromBase.peek();
    if (known === undefined || pose.receivedAt - known.receivedAt > POSE_FRESH) {
      this.#state.odomFromBase.value = pose;
    }
  }

  /** A cloud as it came if it is in the map, else moved there; into the robot's frame if there is no pose. */
  cloud(cloud: CloudPoints): void {
    this.#state.cloud.value = cloud.frame === MAP ? cloud : (this.#moved(cloud, [MAP, ...BASES]) ?? cloud);
  }

  /** A scan moved to the robot's frame; true if its scanner's place is known. */
  scan(scan: CloudPoints): boolean {
    const moved = this.#moved(scan, BASES);
    this.#state.scan.value = moved ?? { ...scan, frame: "base_link" };
    return moved !== undefined;
  }

  #moved(points: CloudPoints, frames: readonly string[]): CloudPoints | undefined {
    for (const frame of frames) {
      const pose = this.#tree.lookup(frame, points.frame) ?? this.#fixed.lookup(frame, points.frame);
      if (pose !== undefined) {
        const shown = BASES.includes(frame) ? "base_link" : frame;
        return { ...points, frame: shown, positions: movePoints(pose, points.positions) };
      }
    }
    return undefined;
  }
}
