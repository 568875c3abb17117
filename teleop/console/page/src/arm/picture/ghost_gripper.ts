/** The ghost of the gripper: where the tip is wanted, with a line down to the floor that shows how high it is. */

import { BufferGeometry, Group, Line, type LineBasicMaterial, type MeshBasicMaterial, RingGeometry, Mesh, Vector3 } from "three";
import type { ArmInfo } from "../../robot/arm";
import { moveJoints } from "../../scene/robot_model";
import { place } from "../../scene/robot_layer";
import type { Pose } from "../../values";

/** Radius of the mark on the floor [m]. */
const MARK = 0.02;

export class GhostGripper {
  /** In the frame of the arm's base. */
  readonly object = new Group();
  /** The gripper itself, in the place of the tip: what is dragged. */
  readonly hand = new Group();
  readonly #drop: Line;
  readonly #mark: Mesh;

  constructor(line: LineBasicMaterial, private readonly fill: MeshBasicMaterial, private readonly info: ArmInfo) {
    this.#drop = new Line(new BufferGeometry().setFromPoints([new Vector3(), new Vector3()]), line);
    this.#drop.frustumCulled = false;
    this.#mark = new Mesh(new RingGeometry(0.7 * MARK, MARK, 24), fill);
    this.object.add(this.hand, this.#drop, this.#mark);
  }

  /** Look like this gripper, which is in the frame of the tip. */
  setGripper(gripper: Group): void {
    this.hand.clear();
    this.hand.add(gripper);
  }

  /** Open the jaws [m]. */
  setOpening(opening: number): void {
    moveJoints(this.hand, new Map([[this.info.gripperJoint, opening]]));
  }

  get pose(): Pose {
    const { position: { x, y, z }, quaternion: turn } = this.hand;
    return { position: { x, y, z }, orientation: { x: turn.x, y: turn.y, z: turn.z, w: turn.w } };
  }

  set pose(pose: Pose) {
    place(this.hand, pose);
    this.shown();
  }

  /** Bring the line down to the floor after the hand was moved. */
  shown(): void {
    const { x, y, z } = this.hand.position;
    const floor = -this.info.mount.position.z;
    this.#drop.geometry.setFromPoints([new Vector3(x, y, z), new Vector3(x, y, floor)]);
    this.#mark.position.set(x, y, floor + 0.002);
  }

  dispose(): void {
    this.#drop.geometry.dispose();
    this.#mark.geometry.dispose();
    this.fill.dispose();
  }
}
