/** Poses of frames in their parents, newest of each, as of `/tf` and `/tf_static`. */

import type { Pose } from "../values";
import type { Transform } from "./message_checks/pose_messages";
import { compose, IDENTITY } from "./rigid_transform";

/** Frames that are kept; a robot has a few dozen. */
const MOST_FRAMES = 500;
const DEEPEST = 50;

/** A frame's pose in its parent. */
export interface Branch extends Transform {
  readonly receivedAt: number;
}

export class TransformTree {
  readonly #branches = new Map<string, Branch>();

  add(transform: Transform, receivedAt: number): void {
    if (this.#branches.has(transform.child) || this.#branches.size < MOST_FRAMES) {
      this.#branches.set(transform.child, { ...transform, receivedAt });
    }
  }

  clear(): void {
    this.#branches.clear();
  }

  /** The frame's pose in its parent. */
  branch(child: string): Branch | undefined {
    return this.#branches.get(child);
  }

  /** Pose of a frame in one of its ancestors; undefined if it is none of them. */
  lookup(ancestor: string, frame: string): Pose | undefined {
    let pose = IDENTITY;
    let at = frame;
    for (let depth = 0; depth < DEEPEST; depth++) {
      if (at === ancestor) {
        return pose;
      }
      const branch = this.#branches.get(at);
      if (branch === undefined) {
        return undefined;
      }
      pose = compose(branch, pose);
      at = branch.parent;
    }
    return undefined;
  }
}
