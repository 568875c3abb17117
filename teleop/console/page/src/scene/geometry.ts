/** Plane geometry, angles and heights: pure functions. */

import type { PlanarCovariance, PlanarPose, Pose, Quaternion, Vector3 } from "../values";

/** 95 % of a bivariate normal distribution lie within this many standard deviations: sqrt(-2 ln 0.05). */
export const SIGMAS_95_PLANE = Math.sqrt(-2 * Math.log(0.05));
/** The same for one variable. */
export const SIGMAS_95_LINE = 1.959964;

/** Return the angle within (-pi, pi] [rad]. */
export function wrap(angle: number): number {
  const turn = 2 * Math.PI;
  const rest = angle - turn * Math.floor((angle + Math.PI) / turn);
  return rest === -Math.PI ? Math.PI : rest;
}

/** Return the heading of an orientation [rad], the yaw of its x axis. */
export function headingOf({ x, y, z, w }: Quaternion): number {
  return Math.atan2(2 * (w * z + x * y), 1 - 2 * (y * y + z * z));
}

/** Return a pose's part on the floor. */
export function planar({ position: { x, y }, orientation }: Pose): PlanarPose {
  return { x, y, yaw: headingOf(orientation) };
}

/** Return a pose standing upright on a floor of height z [m]. */
export function upright({ x, y, yaw }: PlanarPose, z: number): Pose {
  const orientation = { x: 0, y: 0, z: Math.sin(yaw / 2), w: Math.cos(yaw / 2) };
  return { position: { x, y, z }, orientation };
}

/** Half axes [m] and turn [rad] of the ellipse that holds 95 % of the positions. */
export interface Ellipse {
  readonly major: number;
  readonly minor: number;
  readonly turn: number;
}

/** Return the 95 % ellipse of a covariance of x, y, yaw (row by row), or undefined if it is none. */
export function ellipseOf(covariance: PlanarCovariance): Ellipse | undefined {
  const [xx, xy, , , yy] = covariance;
  if (xx === undefined || xy === undefined || yy === undefined || ![xx, xy, yy].every(Number.isFinite)) {
    return undefined;
  }
  const middle = (xx + yy) / 2;
  const spread = Math.hypot((xx - yy) / 2, xy);
  if (middle - spread < -1e-9 || middle + spread <= 0) {
    return undefined;
  }
  return {
    major: SIGMAS_95_PLANE * Math.sqrt(middle + spread),
    minor: SIGMAS_95_PLANE * Math.sqrt(Math.max(middle - spread, 0)),
    turn: 0.5 * Math.atan2(2 * xy, xx - yy),
  };
}

/** Return points x, y in turn around an ellipse at the origin, the last one equal to the first. */
export function ellipseOutline(ellipse: Ellipse, steps = 48): number[] {
  const [cos, sin] = [Math.cos(ellipse.turn), Math.sin(ellipse.turn)];
  return Array.from({ length: steps + 1 }, (_, step) => {
    const angle = (2 * Math.PI * step) / steps;
    const [u, v] = [ellipse.major * Math.cos(angle), ellipse.minor * Math.sin(angle)];
    return [cos * u - sin * v, sin * u + cos * v];
  }).flat();
}

export interface Bounds {
  readonly min: Vector3;
  readonly max: Vector3;
}

/** Return the bounds of points x, y, z in turn; undefined if none is finite. */
export function boundsOf(positions: Float32Array): Bounds | undefined {
  const [min, max] = [[Infinity, Infinity, Infinity], [-Infinity, -Infinity, -Infinity]];
  for (let axis = 0; axis < 3; axis += 1) {
    let low = Infinity;
    let high = -Infinity;
    for (let at = axis; at < positions.length; at += 3) {
      const value = positions[at] ?? NaN;
      low = value < low ? value : low;
      high = value > high ? value : high;
    }
    min[axis] = low;
    max[axis] = high;
  }
  const vector = ([x = 0, y = 0, z = 0]: number[]): Vector3 => ({ x, y, z });
  return [...min, ...max].every(Number.isFinite) ? { min: vector(min), max: vector(max) } : undefined;
}

/**
 * Return the height of the floor [m]: the fullest 5 cm of height in the lower half of the points.
 *
 * A floor is the largest flat surface of a building that a scanner sees beside the ceiling.
 */
export function floorHeight(positions: Float32Array, bounds: Bounds): number {
  const bin = 0.05;
  const half = (bounds.max.z - bounds.min.z) / 2;
  const counts = new Uint32Array(Math.min(Math.floor(half / bin) + 1, 10_000));
  // A sample of the points is enough for a maximum that stands out.
  const step = 3 * Math.max(1, Math.floor(positions.length / 3 / 50_000));
  for (let at = 2; at < positions.length; at += step) {
    const index = Math.floor(((positions[at] ?? NaN) - bounds.min.z) / bin);
    if (index >= 0 && index < counts.length) {
      counts[index] = (counts[index] ?? 0) + 1;
    }
  }
  const fullest = counts.reduce((best, count, index) => (count > (counts[best] ?? 0) ? index : best), 0);
  return bounds.min.z + (fullest + 0.5) * bin;
}

/** Return how much of the way to a goal is made in `elapsed` ms by an exponential approach. */
export function approach(elapsed: number, timeConstant: number): number {
  return 1 - Math.exp(-Math.max(elapsed, 0) / timeConstant);
}
