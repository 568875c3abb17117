/** Points of outlines: x, y, z in turn, for wide lines. */

import type { Box3 } from "three";
import { joined } from "./wide_line";

/** Return a circle about the origin. */
export function circle(radius: number, z: number, steps = 40): number[] {
  return Array.from({ length: steps + 1 }, (_, step) => {
    const angle = (2 * Math.PI * step) / steps;
    return [radius * Math.cos(angle), radius * Math.sin(angle), z];
  }).flat();
}

/** Return the edges of a box: bottom, top and the four that join them. */
export function boxEdges({ min, max }: Box3): number[] {
  const corners = [[min.x, min.y], [max.x, min.y], [max.x, max.y], [min.x, max.y]] as const;
  const ring = (z: number): number[] => [...corners, corners[0]].flatMap(([x, y]) => [x, y, z]);
  return joined([ring(min.z), ring(max.z), ...corners.map(([x, y]) => [x, y, min.z, x, y, max.z])]);
}

/** Return an arrow along x on a floor. */
export function arrow(from: number, to: number, z: number, head = 0.16): number[] {
  return joined([
    [from, 0, z, to, 0, z],
    [to - head, head * 0.75, z, to, 0, z, to - head, -head * 0.75, z],
  ]);
}
