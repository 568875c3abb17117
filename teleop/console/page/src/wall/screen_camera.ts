/** Cameras that see the world through a wall's screens, as through windows. */

import { PerspectiveCamera, Vector3 } from "three";
import { frameCorners } from "three/addons/utils/CameraUtils.js";
import type { ViewShare } from "../scene/stage";
import type { Wall, WallScreen } from "./wall_setting";

/** Distances between which things are drawn [m]: a hand's breadth, and beyond any building. */
const DEPTH = { near: 0.05, far: 1000 };

/** Return the cameras of a wall, each with its part of the window; they stand in the frame of its screens. */
export function screenCameras({ screens, eye: [x, y, z], stereo }: Wall): ViewShare[] {
  const eyes = stereo === 0 ? [y] : [y + stereo / 2, y - stereo / 2];
  const width = 1 / (screens.length * eyes.length);
  return screens.flatMap((screen, at) => eyes.map((aside, side) => ({
    camera: screenCamera(screen, new Vector3(x, aside, z)), left: (at * eyes.length + side) * width, width,
  })));
}

/** The camera of one screen and one eye: generalised perspective projection (Kooima 2009), by three's own function. */
function screenCamera({ middle, heading, width, height }: WallScreen, eye: Vector3): PerspectiveCamera {
  const camera = new PerspectiveCamera(undefined, undefined, DEPTH.near, DEPTH.far);
  const right = new Vector3(Math.sin(heading), -Math.cos(heading), 0).multiplyScalar(width);
  const up = new Vector3(0, 0, height);
  const corner = new Vector3(...middle).addScaledVector(right, -0.5).addScaledVector(up, -0.5);
  camera.position.copy(eye);
  frameCorners(camera, corner, right.add(corner), up.add(corner));
  return camera;
}
