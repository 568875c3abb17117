/** The robot where it is said to be: body, ring, path, the ellipse of its covariance, and the truth in simulation. */

import { AmbientLight, Color, DirectionalLight, Group, SRGBColorSpace, type Box3, type Object3D } from "three";
import type { PlanarCovariance, Pose } from "../values";
import { ellipseOf, ellipseOutline, headingOf, SIGMAS_95_LINE } from "./geometry";
import { FlatArrow } from "./flat_arrow";
import { boxEdges, circle, arrow } from "./outline";
import type { Rgb, SceneColours } from "./palette";
import { disposeModel, moveJoints, robotModel, type RobotModel } from "./robot_model";
import { type Line, WideLine } from "./wide_line";
import type { Viewport } from "./viewport";

/** Points of the path that are kept; with one each 5 cm that is 400 m. */
const PATH_POINTS = 8000;
const PATH_STEP = 0.05;
/** A robot that jumps this far [m] was not driven there. */
const PATH_JUMP = 0.8;
/** Pixels below which a robot of usual size gets a mark of its own, and the mark's length. */
const MARK = 30;

export class RobotLayer {
  readonly object = new Group();
  /** Body and ring, moved with the robot. */
  readonly body = new Group();
  readonly #path = new WideLine(PATH_POINTS, { width: 3.5 });
  readonly #ellipse = new WideLine(80, { width: 2, overlaid: true });
  readonly #ring = new WideLine(80, { width: 3, overlaid: true });
  readonly #mark = new FlatArrow();
  readonly #truth = new WideLine(48, { width: 2, overlaid: true });
  #hasTruth = false;
  #showsTruth = false;
  #model: RobotModel = robotModel(undefined);
  #lastPath: Pose["position"] | undefined;

  constructor() {
    const sun = new DirectionalLight(0xffffff, 2);
    sun.position.set(-2, 3, 6);
    this.object.add(new AmbientLight(0xffffff, 1.3), sun);
    this.body.add(this.#model.object, this.#ring.object, this.#mark.object);
    this.object.add(this.body, this.#path.object, this.#ellipse.object, this.#truth.object);
    this.#ring.set(ring(this.#model.box));
    this.#truth.visible = false;
  }

  /** Extent of the body in its own frame [m]. */
  get box(): Box3 {
    return this.#model.box;
  }

  /** The body as it is drawn. */
  get model(): Object3D {
    return this.#model.object;
  }

  setModel(urdf: string | undefined): void {
    this.body.remove(this.#model.object);
    disposeModel(this.#model);
    this.#model = robotModel(urdf);
    this.body.add(this.#model.object);
    this.#ring.set(ring(this.#model.box));
  }

  /** Put the joints where they are [rad, m]. */
  setJoints(positions: ReadonlyMap<string, number>): void {
    moveJoints(this.#model.object, positions);
  }

  /** Put the body at a pose in the map, or hide it. */
  setPose(pose: Pose | undefined): void {
    this.body.visible = pose !== undefined;
    if (pose !== undefined) {
      place(this.body, pose);
    }
  }

  /** Hide the body where the camera looks out of it. */
  setBodyVisible(shown: boolean): void {
    this.#model.object.visible = shown;
    this.#ring.visible = shown;
  }

  /** Lengthen the path to a pose that the robot reported. */
  extendPath({ position }: Pose): void {
    const last = this.#lastPath;
    const step = last === undefined ? Infinity : Math.hypot(position.x - last.x, position.y - last.y);
    if (step < PATH_STEP) {
      return;
    }
    if (step > PATH_JUMP) {
      this.#path.gap();
    }
    this.#path.append(position.x, position.y, position.z + 0.02);
    this.#lastPath = position;
  }

  clearPath(): void {
    this.#path.clear();
    this.#lastPath = undefined;
  }

  /** Show where the robot is with 95 % probability, and between which headings. */
  setCovariance(covariance: PlanarCovariance | undefined, pose: Pose | undefined): void {
    const ellipse = covariance && ellipseOf(covariance);
    if (ellipse === undefined || pose === undefined) {
      this.#ellipse.clear();
      return;
    }
    const outline = ellipseOutline(ellipse);
    const points: number[] = [];
    for (let at = 0; at < outline.length; at += 2) {
      points.push(outline[at] ?? 0, outline[at + 1] ?? 0, 0.03);
    }
    this.#ellipse.set([points, wedge(covariance?.[8] ?? NaN, headingOf(pose.orientation))]);
    const { x, y, z } = pose.position;
    this.#ellipse.object.position.set(x, y, z);
  }

  setTruth(pose: Pose | undefined): void {
    this.#hasTruth = pose !== undefined;
    this.#truth.visible = this.#showsTruth && this.#hasTruth;
    if (pose !== undefined) {
      this.#truth.set([...boxEdges(this.#model.box), ...arrow(0, 0.75, this.#model.box.max.z)]);
      place(this.#truth.object, pose);
    }
  }

  show(shown: { readonly path: boolean; readonly covariance: boolean; readonly truth: boolean }, truth: boolean): void {
    this.#path.visible = shown.path;
    this.#ellipse.visible = shown.covariance;
    this.#showsTruth = shown.truth && truth;
    this.#truth.visible = this.#showsTruth && this.#hasTruth;
  }

  /** Paint everything; a stale robot is grey and seen through. */
  setColours(colours: SceneColours, ringColour: Rgb, stale: boolean): void {
    const mark = stale ? colours.stale : ringColour;
    this.#ring.setColour(mark);
    this.#mark.setColours(mark, colours.background);
    this.#ellipse.setColour(mark);
    this.#path.setColour(stale ? colours.stale : colours.path);
    this.#truth.setColour(colours.truth);
    for (const { material, colour } of this.#model.paints) {
      material.color.copy(stale ? new Color().setRGB(...colours.stale, SRGBColorSpace) : colour);
      material.opacity = stale ? 0.5 : 1;
      // Its program is looked up anew only where that changes.
      material.needsUpdate = material.transparent !== stale;
      material.transparent = stale;
    }
  }

  setViewport(viewport: Viewport): void {
    const length = MARK * viewport.metresPerPixel;
    this.#mark.object.visible = length > 0.9 && this.#model.object.visible;
    this.#mark.object.scale.setScalar(Math.max(length, 0.01));
  }

  dispose(): void {
    disposeModel(this.#model);
    this.#mark.dispose();
    for (const line of [this.#path, this.#ellipse, this.#ring, this.#truth]) {
      line.dispose();
    }
  }
}

/** Put an object at a pose. */
export function place(object: { position: { set: (x: number, y: number, z: number) => unknown }; quaternion: { set: (x: number, y: number, z: number, w: number) => unknown } }, { position, orientation }: Pose): void {
  object.position.set(position.x, position.y, position.z);
  object.quaternion.set(orientation.x, orientation.y, orientation.z, orientation.w);
}

/** A ring about the body with a point where the front is. */
function ring({ min, max }: Box3): Line[] {
  const radius = Math.max(Math.hypot(max.x - min.x, max.y - min.y) / 2, 0.2) + 0.06;
  const tip = radius + 0.22;
  return [circle(radius, 0.03), [radius, 0.15, 0.03, tip, 0, 0.03, radius, -0.15, 0.03]];
}

/** Two lines between which the heading is with 95 % probability. */
function wedge(variance: number, heading: number): Line {
  if (!(variance >= 0)) {
    return [];
  }
  const half = Math.min(SIGMAS_95_LINE * Math.sqrt(variance), Math.PI);
  const at = (angle: number): number[] => [1.1 * Math.cos(heading + angle), 1.1 * Math.sin(heading + angle), 0.03];
  const arc = Array.from({ length: 9 }, (_, step) => at(-half + (half * step) / 4)).flat();
  return [0, 0, 0.03, ...arc, 0, 0, 0.03];
}
