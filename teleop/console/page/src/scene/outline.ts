/** Outlines, for wide lines. */

import type { Box3 } from "three";
import type { Line } from "./wide_line";

/** Return a circle about the origin. */
export function circle(radius: number, z: number, steps = 40): Line {
  return Array.from({ length: steps + 1 }, (_, step) => {
    const angle = (2 * Math.PI * step) / steps;
    return [radius * Math.cos(angle), radius * Math.sin(angle), z];
  }).flat();
}

/** Return the edges of a box: bottom, top and the four that join them. */
export function boxEdges({ min, max }: Box3): Line[] {
  const corners = [[min.x, min.y], [max.x, min.y], [max.x, max.y], [min.x, max.y]] as const;
  const ring = (z: number): Line => [...corners, corners[0]].flatMap(([x, y]) => [x, y, z]);
  return [ring(min.z), ring(max.z), ...corners.map(([x, y]) => [x, y, min.z, x, y, max.z])];
}

/** Return an arrow along x on a floor. */
export function arrow(from: number, to: number, z: number, head = 0.16): Line[] {
  return [
    [from, 0, z, to, 0, z],
    [to - head, head * 0.75, z, to, 0, z, to - head, -head * 0.75, z],
  ];
}
