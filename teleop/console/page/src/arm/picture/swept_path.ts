/** The way of a planned move as it will be gone: the arm several times along it, and the line of its tip. */

import { BufferGeometry, Group, Line, type LineBasicMaterial, type MeshBasicMaterial, type Object3D, Vector3 } from "three";
import type { ArmInfo, ArmPath } from "../../robot/arm";
import { ArmFigure } from "./arm_figure";

/** How often the arm is shown, and how many points the line has. */
const FIGURES = 6;
const POINTS = 60;

export class SweptPath {
  /** In the frame of the arm's base. */
  readonly object = new Group();
  readonly #line: Line;
  #figures: readonly ArmFigure[] = [];

  constructor(line: LineBasicMaterial) {
    this.#line = new Line(new BufferGeometry(), line);
    this.#line.frustumCulled = false;
    this.object.add(this.#line);
    this.object.visible = false;
  }

  /** Copy the arm of a robot. */
  setModel(model: Object3D, info: ArmInfo, material: MeshBasicMaterial): void {
    for (const figure of this.#figures) {
      figure.object.removeFromParent();
    }
    this.#figures = Array.from({ length: FIGURES }, () => ArmFigure.of(model, info, material)).filter((figure) => figure !== undefined);
    this.object.add(...this.#figures.map(({ object }) => object));
  }

  /** Show a way from the pose in which the arm stands; an empty one hides it. */
  show(path: ArmPath): void {
    const last = this.#figures.at(-1);
    this.object.visible = path.length > 1 && last !== undefined;
    if (!this.object.visible || last === undefined) {
      return;
    }
    const points: Vector3[] = [];
    for (let step = 0; step <= POINTS; step++) {
      last.move(along(path, step / POINTS));
      points.push(new Vector3().setFromMatrixPosition(last.tip()));
    }
    this.#line.geometry.dispose();
    this.#line.geometry = new BufferGeometry().setFromPoints(points);
    this.#figures.forEach((figure, at) => { figure.move(along(path, (at + 1) / this.#figures.length)); });
  }

  dispose(): void {
    this.#line.geometry.dispose();
  }
}

/** Return the angles at a share of a way, by the largest angle that a joint turns. */
export function along(path: ArmPath, share: number): readonly number[] {
  const [first = []] = path;
  const ways = path.slice(1).map((corner, at) => Math.max(0, ...corner.map((angle, joint) => Math.abs(angle - (path[at]?.[joint] ?? angle)))));
  let left = share * ways.reduce((sum, way) => sum + way, 0);
  for (const [at, way] of ways.entries()) {
    const [from, to] = [path[at] ?? first, path[at + 1] ?? first];
    if (left <= way && way > 0) {
      return from.map((angle, joint) => angle + (left / way) * ((to[joint] ?? angle) - angle));
    }
    left -= way;
  }
  return path.at(-1) ?? first;
}
