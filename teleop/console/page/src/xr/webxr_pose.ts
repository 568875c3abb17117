/**
 * Reads WebXR's poses, and nothing else does: the browser makes a pose for the asking, and an object of each number that is
 * read of it. No page can spare itself that, so that it is measured apart from what the page's own code allocates.
 */

import type { Quaternion, Vector3 } from "three";

/** Where something is in the operator's room. */
export interface Placed {
  readonly position: Vector3;
  readonly turn: Quaternion;
}

/** Take a pose over; false for one that is none, as of a controller that lies on a table: all zero, or not finite. */
export function takePose(to: Placed, { position: p, orientation: q }: XRRigidTransform): boolean {
  const px = p.x, py = p.y, pz = p.z, x = q.x, y = q.y, z = q.z, w = q.w; // each read once, and no list of them
  const norm = Math.sqrt(x * x + y * y + z * z + w * w);
  if (!(Math.abs(norm - 1) < 0.1) || !Number.isFinite(px + py + pz)) {
    return false;
  }
  to.position.set(px, py, pz);
  to.turn.set(x, y, z, w);
  return true;
}
