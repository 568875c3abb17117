/** The ghost of a hint: the robot's outline at a proposed pose, and what it sees now as it would lie there. */

import { Box3, Group, Matrix4, Quaternion, Vector3 } from "three";
import type { PlanarPose, Pose } from "../values";
import { CloudLayer, type CloudLook, NO_CUT, type PointBuffer } from "./cloud_layer";
import { upright } from "./geometry";
import { arrow, boxEdges, circle } from "./outline";
import type { Rgb, SceneColours } from "./palette";
import { place } from "./robot_layer";
import { WideLine } from "./wide_line";
import type { Viewport } from "./viewport";

/** How well the sweep fits at the proposed pose, as far as that is known. */
export type GhostQuality = "unknown" | "good" | "bad";

export class Ghost {
  readonly object = new Group();
  readonly #robot = new Group();
  readonly #outline = new WideLine(120, { width: 3, overlaid: true });
  readonly #heading = new WideLine(8, { width: 5, overlaid: true });
  /** Says by its shape what the colour says: a bad place is crossed out. */
  readonly #cross = new WideLine(8, { width: 4, overlaid: true });
  readonly #lines = [this.#outline, this.#heading, this.#cross];
  readonly #sweep: CloudLayer;

  constructor(buffer: PointBuffer) {
    this.#sweep = new CloudLayer(buffer);
    this.#sweep.object.matrixAutoUpdate = false;
    this.#sweep.object.renderOrder = 5;
    this.#robot.add(...this.#lines.map((line) => line.object));
    this.object.add(this.#robot, this.#sweep.object);
    this.#heading.set(arrow(0, 1.1, 0.1, 0.22));
    this.#cross.set([[-0.34, -0.34, 0.1, 0.34, 0.34, 0.1], [-0.34, 0.34, 0.1, 0.34, -0.34, 0.1]]);
    this.object.visible = false;
  }

  /**
   * Show the ghost at a pose on a floor of height z [m], with a buffer's points; `sweepFrom` is the pose at which
   * these were seen, undefined if they are in `base_link` as they are.
   */
  show(pose: PlanarPose, z: number, box: Box3, buffer: PointBuffer, sweepFrom: Pose | undefined): void {
    this.object.visible = true;
    this.#sweep.object.geometry = buffer.geometry;
    const proposed = upright(pose, z);
    place(this.#robot, proposed);
    const radius = Math.hypot(box.max.x - box.min.x, box.max.y - box.min.y) / 2 + 0.06;
    this.#outline.set([...boxEdges(box), circle(radius, 0.03)]);
    this.#sweep.object.matrix.copy(matrixOf(proposed));
    if (sweepFrom !== undefined) {
      this.#sweep.object.matrix.multiply(matrixOf(sweepFrom).invert());
    }
    this.#sweep.object.matrixWorldNeedsUpdate = true;
  }

  hide(): void {
    this.object.visible = false;
  }

  setColours(colours: SceneColours, quality: GhostQuality): void {
    const colour: Rgb = { unknown: colours.ink, good: colours.good, bad: colours.bad }[quality];
    this.#outline.setColour(colour);
    this.#heading.setColour(colour);
    this.#cross.setColour(colour);
    this.#cross.visible = quality === "bad";
    this.#sweep.setColours(colours);
    this.#sweep.setTint(colour, 1);
  }

  setViewport(viewport: Viewport, look: CloudLook): void {
    if (!this.object.visible) {
      return;
    }
    const scale = Math.max(1, (24 * viewport.metresPerPixel) / 0.6);
    for (const line of this.#lines) {
      line.object.scale.setScalar(scale);
    }
    this.#sweep.setLook(look, NO_CUT);
  }

  dispose(): void {
    this.#lines.forEach((line) => { line.dispose(); });
    this.#sweep.object.material.dispose();
  }
}

/** Return the transform from a pose's own frame. */
export function matrixOf({ position, orientation }: Pose): Matrix4 {
  return new Matrix4().compose(
    new Vector3(position.x, position.y, position.z),
    new Quaternion(orientation.x, orientation.y, orientation.z, orientation.w),
    new Vector3(1, 1, 1),
  );
}
