/** The robot's body from its URDF: boxes, cylinders and spheres; nothing is fetched from anywhere. */

import {
  Box3, BoxGeometry, BufferGeometry, Color, CylinderGeometry, Group, LinearSRGBColorSpace, Mesh, MeshLambertMaterial, MeshPhongMaterial, SRGBColorSpace, type Object3D,
} from "three";
import URDFLoader, { type URDFJoint } from "urdf-loader";

/** Longer models are not robots of boxes and cylinders. */
const LONGEST_URDF = 500_000;
/** No robot that stands on a floor is larger [m]. */
const LARGEST = 20;

/** Black wheels are to be seen at night, too: this share of every colour is that of dust. */
const LIFT = 0.1;
const DUST = new Color(0x9aa4b2);

/** A part's material and the colour that the model gives it. */
export interface Paint {
  readonly material: MeshLambertMaterial;
  readonly colour: Color;
}

/** A body, what it is painted with, and its extent in its own frame [m], without limbs that reach out of it. */
export interface RobotModel {
  readonly object: Object3D;
  readonly paints: readonly Paint[];
  readonly box: Box3;
}

/** Joints by which a limb moves; wheels are continuous. */
const LIMBS = ["revolute", "prismatic"];

/** Return the model of a URDF, or that of an unknown robot if it is missing or cannot be shown. */
export function robotModel(urdf: string | undefined): RobotModel {
  return (urdf === undefined ? undefined : fromUrdf(urdf)) ?? repainted(unknownRobot());
}

function fromUrdf(urdf: string): RobotModel | undefined {
  if (urdf.length > LONGEST_URDF) {
    return undefined;
  }
  try {
    const document = new DOMParser().parseFromString(urdf, "text/xml");
    // Meshes and textures name files elsewhere, which this page never asks for.
    for (const node of [...document.querySelectorAll("mesh")]) {
      node.closest("visual")?.remove();
    }
    for (const node of [...document.querySelectorAll("texture, collision")]) {
      node.remove();
    }
    const loader = new URDFLoader();
    loader.parseCollision = false;
    loader.loadMeshCb = (_url, _manager, _material, done) => { done(new Group()); };
    const model = repainted(loader.parse(document.documentElement));
    const { min, max } = model.box;
    const extents = [...min.toArray(), ...max.toArray()];
    return extents.every((value) => Math.abs(value) < LARGEST) ? model : undefined;
  } catch {
    return undefined;
  }
}

/** Give each part a material of its own kind, and remember them. */
function repainted(object: Object3D): RobotModel {
  const paints: Paint[] = [];
  object.updateMatrixWorld(true);
  object.traverse((part) => {
    if (part instanceof Mesh) {
      const before: unknown = part.material;
      const colour = new Color(0x888888);
      if (before instanceof MeshPhongMaterial) {
        // Colours of a URDF are those of a screen.
        colour.setRGB(before.color.r, before.color.g, before.color.b, SRGBColorSpace).lerp(DUST, LIFT);
      }
      const material = new MeshLambertMaterial({ color: colour });
      part.material = material;
      part.renderOrder = 4;
      paints.push({ material, colour });
    }
  });
  return { object, paints, box: bodyBox(object) };
}

/** Return the extent of all parts that no limb carries. */
function bodyBox(object: Object3D, box = new Box3()): Box3 {
  if (object instanceof Mesh) {
    box.expandByObject(object);
  }
  for (const child of object.children) {
    if (!isJoint(child) || !LIMBS.includes(child.jointType)) {
      bodyBox(child, box);
    }
  }
  return box;
}

/** Put the joints of a model at these positions by their names [rad, m]; true if one of them moved. */
export function moveJoints(model: Object3D, positions: ReadonlyMap<string, number>): boolean {
  let moved = false;
  model.traverse((part) => {
    const position = isJoint(part) ? positions.get(part.name) : undefined;
    if (isJoint(part) && position !== undefined) {
      // A joint that was measured beyond its limit stands there.
      part.ignoreLimits = true;
      moved = part.setJointValue(position) || moved;
    }
  });
  return moved;
}

function isJoint(part: Object3D): part is URDFJoint {
  return "isURDFJoint" in part;
}

/** A body of a usual size for a robot that says nothing of its own: a red box with a light bar in front. */
function unknownRobot(): Object3D {
  const body = new Group();
  const add = (geometry: BoxGeometry | CylinderGeometry, colour: number, x: number, y: number, z: number): Mesh => {
    const part = new Mesh(geometry, new MeshPhongMaterial({ color: new Color().setHex(colour, LinearSRGBColorSpace) }));
    part.position.set(x, y, z);
    body.add(part);
    return part;
  };
  add(new BoxGeometry(0.5, 0.32, 0.18), 0xd23c28, 0, 0, 0.17);
  add(new BoxGeometry(0.06, 0.34, 0.04), 0xf2f2f2, 0.23, 0, 0.27);
  for (const [x, y] of [[0.14, 0.2], [0.14, -0.2], [-0.14, 0.2], [-0.14, -0.2]] as const) {
    add(new CylinderGeometry(0.11, 0.11, 0.07, 20), 0x2c2c30, x, y, 0.11);
  }
  return body;
}

/** Free what a model holds on the graphics card. */
export function disposeModel(model: RobotModel): void {
  model.object.traverse((part) => {
    if (part instanceof Mesh && part.geometry instanceof BufferGeometry) {
      part.geometry.dispose();
    }
  });
  for (const { material } of model.paints) {
    material.dispose();
  }
}
