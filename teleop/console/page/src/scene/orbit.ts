/**
 * Where the camera is: an orbit about a target, in a world with z up.
 *
 * All three views are such orbits: the chase view behind the robot, the top view with the camera overhead, and
 * first person with the target at the eye and no distance.
 */

import { Quaternion, Vector3 as ThreeVector, Matrix4, type PerspectiveCamera } from "three";
import type { Vector3 } from "../values";
import { wrap, type Bounds } from "./geometry";

export interface Orbit {
  readonly target: Vector3;
  /** Direction of view in the plane [rad], as a heading; in the view from above what is up on the screen. */
  readonly azimuth: number;
  /** How far the view looks down [rad]: 0 level, pi/2 straight down. */
  readonly elevation: number;
  /** From the camera to the target [m]. */
  readonly distance: number;
  /** Vertical field of view [rad]. */
  readonly fieldOfView: number;
}

const DISTANCE_RANGE = [0.3, 2000] as const;

/** Return the direction of view. */
export function direction({ azimuth, elevation }: Orbit): Vector3 {
  const level = Math.cos(elevation);
  return { x: level * Math.cos(azimuth), y: level * Math.sin(azimuth), z: -Math.sin(elevation) };
}

/** Return the orbit between two, going the shorter way round; share 0 is `a`, 1 is `b`. */
export function blend(a: Orbit, b: Orbit, share: number): Orbit {
  const between = (from: number, to: number): number => from + (to - from) * share;
  return {
    target: {
      x: between(a.target.x, b.target.x),
      y: between(a.target.y, b.target.y),
      z: between(a.target.z, b.target.z),
    },
    azimuth: a.azimuth + wrap(b.azimuth - a.azimuth) * share,
    elevation: between(a.elevation, b.elevation),
    distance: Math.exp(between(Math.log(Math.max(a.distance, 1e-3)), Math.log(Math.max(b.distance, 1e-3)))),
    fieldOfView: between(a.fieldOfView, b.fieldOfView),
  };
}

/** Return the distance after zooming: a factor above 1 goes farther away. */
export function zoomedDistance(distance: number, factor: number): number {
  return Math.min(Math.max(distance * factor, DISTANCE_RANGE[0]), DISTANCE_RANGE[1]);
}

/** Return the size of a pixel at the target [m]; the height of the picture is in the same pixels. */
export function metresPerPixel(orbit: Orbit, height: number): number {
  return (2 * orbit.distance * Math.tan(orbit.fieldOfView / 2)) / Math.max(height, 1);
}

/** Return how the target moves [m] when the picture is dragged by so many pixels: it goes with the pointer. */
export function panned(orbit: Orbit, right: number, down: number, height: number): Vector3 {
  const metres = metresPerPixel(orbit, height);
  const [cos, sin] = [Math.cos(orbit.azimuth), Math.sin(orbit.azimuth)];
  // Seen at a slant, a pixel up covers more of the floor than a pixel aside.
  const along = (down * metres) / Math.max(Math.sin(orbit.elevation), 0.3);
  const aside = -right * metres;
  return {
    x: orbit.target.x + aside * sin + along * cos,
    y: orbit.target.y - aside * cos + along * sin,
    z: orbit.target.z,
  };
}

/** Return the distance at which an orbit shows all of these bounds about its target. */
export function fittingDistance(orbit: Orbit, { min, max }: Bounds, aspect: number): number {
  const forward = direction(orbit);
  const right = { x: Math.sin(orbit.azimuth), y: -Math.cos(orbit.azimuth), z: 0 };
  const up = cross(right, forward);
  const vertical = Math.tan(orbit.fieldOfView / 2);
  const corners = [min.x, max.x].flatMap((x) => [min.y, max.y].flatMap((y) => [min.z, max.z].map((z) => ({ x, y, z }))));
  const needed = corners.map((corner) => {
    const { target } = orbit;
    const offset = { x: corner.x - target.x, y: corner.y - target.y, z: corner.z - target.z };
    const aside = Math.max(Math.abs(dot(offset, right)) / (vertical * aspect), Math.abs(dot(offset, up)) / vertical);
    return aside - dot(offset, forward);
  });
  return Math.max(...needed, 0.1);
}

function dot(a: Vector3, b: Vector3): number {
  return a.x * b.x + a.y * b.y + a.z * b.z;
}

function cross(a: Vector3, b: Vector3): Vector3 {
  return { x: a.y * b.z - a.z * b.y, y: a.z * b.x - a.x * b.z, z: a.x * b.y - a.y * b.x };
}

/** Put a camera where the orbit says; the basis is made directly, so that straight down is no special case. */
export function placeCamera(camera: PerspectiveCamera, orbit: Orbit, aspect: number): void {
  const forward = direction(orbit);
  const right = new ThreeVector(Math.sin(orbit.azimuth), -Math.cos(orbit.azimuth), 0);
  const back = new ThreeVector(-forward.x, -forward.y, -forward.z);
  const up = new ThreeVector().crossVectors(back, right);
  camera.quaternion.copy(new Quaternion().setFromRotationMatrix(new Matrix4().makeBasis(right, up, back)));
  camera.position
    .set(orbit.target.x, orbit.target.y, orbit.target.z)
    .addScaledVector(back, orbit.distance);
  camera.fov = (orbit.fieldOfView * 180) / Math.PI;
  camera.aspect = aspect;
  camera.near = Math.min(Math.max(orbit.distance * 0.02, 0.05), 5);
  camera.far = Math.max(orbit.distance * 4, 400);
  camera.updateProjectionMatrix();
  camera.updateMatrixWorld();
}
