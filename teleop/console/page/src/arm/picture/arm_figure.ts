/** The arm as a ghost: a see-through copy of what the robot's description says, which can stand anywhere. */

import { Group, Matrix4, Mesh, type MeshBasicMaterial, type Object3D } from "three";
import type { ArmInfo } from "../../robot/arm";
import { moveJoints } from "../../scene/robot_model";

/** Links by the names that the robot gives them. */
const BASE = "arm_base";
const TIP = "tool0";

export class ArmFigure {
  /** In the frame of the arm's base. */
  readonly object = new Group();
  readonly #arm: Object3D;
  readonly #tip: Object3D;

  private constructor(arm: Object3D, tip: Object3D, private readonly info: ArmInfo) {
    [this.#arm, this.#tip] = [arm, tip];
    this.object.add(arm);
  }

  /** Return a copy of a robot's arm in a material; undefined if the robot has none of these links. */
  static of(model: Object3D, info: ArmInfo, material: MeshBasicMaterial): ArmFigure | undefined {
    // The whole robot is copied, as only then the joints of the copy lead its own jaws and not the robot's.
    const arm = model.clone().getObjectByName(BASE);
    const tip = arm?.getObjectByName(TIP);
    if (arm === undefined || tip === undefined) {
      return undefined;
    }
    arm.removeFromParent();
    for (const part of arm.children) {
      part.visible = "isURDFJoint" in part; // the base itself does not move
    }
    paint(arm, material);
    return new ArmFigure(arm, tip, info);
  }

  /** Bring it to angles of the joints [rad]. */
  move(angles: readonly number[], opening?: number): void {
    const positions = new Map(this.info.joints.map(({ name }, at) => [name, angles[at] ?? 0] as const));
    if (opening !== undefined) {
      positions.set(this.info.gripperJoint, opening);
    }
    moveJoints(this.#arm, positions);
    this.object.updateMatrixWorld(true);
  }

  /** Return where its tip is, in the arm's base. */
  tip(): Matrix4 {
    this.object.updateMatrixWorld(true);
    return this.object.matrixWorld.clone().invert().multiply(this.#tip.matrixWorld);
  }

  /** Take the gripper off it, as an object in the frame of the tip; the figure is of no use then. */
  gripper(): Group {
    const hand = new Group();
    const last = this.info.joints.at(-1)?.name;
    const joint = last === undefined ? undefined : this.#arm.getObjectByName(last);
    for (const link of [...joint?.children ?? []]) {
      link.updateMatrixWorld(true);
      const place = this.#tip.matrixWorld.clone().invert().multiply(link.matrixWorld);
      link.removeFromParent();
      place.decompose(link.position, link.quaternion, link.scale);
      hand.add(link);
    }
    return hand;
  }
}

function paint(object: Object3D, material: MeshBasicMaterial): void {
  object.traverse((part) => {
    if (part instanceof Mesh) {
      part.material = material;
      part.renderOrder = 6;
    }
  });
}
