/** From places of the page to places in the map. */

import { Vector3, type PerspectiveCamera } from "three";

/** Places farther away than this [m] are at the horizon, not on the floor. */
const FARTHEST = 500;

/** Return where the ray through a point of the picture (-1 to 1, right and up) meets the floor of height z [m]. */
export function floorHit(
  camera: PerspectiveCamera, right: number, up: number, z: number,
): { readonly x: number; readonly y: number } | undefined {
  const ray = new Vector3(right, up, 0.5).unproject(camera).sub(camera.position).normalize();
  const length = (z - camera.position.z) / ray.z;
  if (!Number.isFinite(length) || length <= 0 || length > FARTHEST) {
    return undefined;
  }
  return { x: camera.position.x + ray.x * length, y: camera.position.y + ray.y * length };
}

/** Return the index of the point that is drawn nearest to a place of the picture, within so many pixels. */
export function nearest(
  points: readonly Vector3[], camera: PerspectiveCamera, x: number, y: number, within: number,
  size: { readonly width: number; readonly height: number },
): number | undefined {
  let best: { readonly index: number; readonly apart: number } | undefined;
  points.forEach((point, index) => {
    const seen = point.clone().project(camera);
    const apart = Math.hypot(((seen.x + 1) / 2) * size.width - x, ((1 - seen.y) / 2) * size.height - y);
    if (seen.z < 1 && apart <= within && apart < (best?.apart ?? Infinity)) {
      best = { index, apart };
    }
  });
  return best?.index;
}
