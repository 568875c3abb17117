/** Rotations and poses composed; Hamilton quaternions, poses as in REP 103. */

import type { Pose, Quaternion, Vector3 } from "../values";

export const IDENTITY: Pose = { position: { x: 0, y: 0, z: 0 }, orientation: { x: 0, y: 0, z: 0, w: 1 } };

/** Rotate a vector. */
export function rotate(q: Quaternion, v: Vector3): Vector3 {
  // v + 2 w (q × v) + 2 q × (q × v)
  const tx = 2 * (q.y * v.z - q.z * v.y);
  const ty = 2 * (q.z * v.x - q.x * v.z);
  const tz = 2 * (q.x * v.y - q.y * v.x);
  return {
    x: v.x + q.w * tx + q.y * tz - q.z * ty,
    y: v.y + q.w * ty + q.z * tx - q.x * tz,
    z: v.z + q.w * tz + q.x * ty - q.y * tx,
  };
}

function multiply(a: Quaternion, b: Quaternion): Quaternion {
  return {
    x: a.w * b.x + a.x * b.w + a.y * b.z - a.z * b.y,
    y: a.w * b.y - a.x * b.z + a.y * b.w + a.z * b.x,
    z: a.w * b.z + a.x * b.y - a.y * b.x + a.z * b.w,
    w: a.w * b.w - a.x * b.x - a.y * b.y - a.z * b.z,
  };
}

/** Pose of c in a, of b in a and c in b. */
export function compose(aFromB: Pose, bFromC: Pose): Pose {
  const moved = rotate(aFromB.orientation, bFromC.position);
  const { x, y, z } = aFromB.position;
  return {
    position: { x: x + moved.x, y: y + moved.y, z: z + moved.z },
    orientation: multiply(aFromB.orientation, bFromC.orientation),
  };
}

/** Roll (left side up) and pitch (nose down) [rad]. */
export function rollAndPitch(q: Quaternion): { readonly roll: number; readonly pitch: number } {
  const sine = Math.max(-1, Math.min(1, 2 * (q.w * q.y - q.z * q.x)));
  return {
    roll: Math.atan2(2 * (q.w * q.x + q.y * q.z), 1 - 2 * (q.x * q.x + q.y * q.y)),
    pitch: Math.asin(sine),
  };
}

/** Move points, x, y, z in turn, from frame b to frame a. */
export function movePoints(aFromB: Pose, positions: Float32Array): Float32Array {
  const moved = new Float32Array(positions.length);
  for (let i = 0; i + 2 < positions.length; i += 3) {
    const point = rotate(aFromB.orientation, {
      x: positions[i] ?? 0, y: positions[i + 1] ?? 0, z: positions[i + 2] ?? 0,
    });
    moved[i] = point.x + aFromB.position.x;
    moved[i + 1] = point.y + aFromB.position.y;
    moved[i + 2] = point.z + aFromB.position.z;
  }
  return moved;
}
