/** Arcs at the robot's side towards what is nearest: their number says how near it is, without any colour. */

import type { Box3 } from "three";
import type { NearestObstacle } from "../values";
import type { SceneColours } from "./palette";
import { type Line, WideLine } from "./wide_line";

/** Distances from the outline below which one arc, a second and a third are drawn [m]; the third is red. */
const STEPS = [2, 1, 0.5] as const;
/** Half of what an arc spans [rad], and the room between two [m]. */
const HALF = 0.44;
const GAP = 0.1;
const HEIGHT = 0.05;

export class NearestArc {
  readonly line = new WideLine(64, { width: 5, overlaid: true });
  #colours: SceneColours | undefined;
  #close = false;

  /** Show the arcs in the robot's frame, outside the ring about its body; undefined hides them. */
  set(nearest: NearestObstacle | undefined, body: Box3): void {
    const count = nearest === undefined ? 0 : STEPS.filter((step) => nearest.distance < step).length;
    const inner = Math.hypot(body.max.x - body.min.x, body.max.y - body.min.y) / 2 + 2 * GAP;
    this.line.set(Array.from({ length: count }, (_, index) => arc(inner + index * GAP, nearest?.bearing ?? 0)));
    this.#close = count === STEPS.length;
    this.#paint();
  }

  setColours(colours: SceneColours): void {
    this.#colours = colours;
    this.#paint();
  }

  #paint(): void {
    if (this.#colours !== undefined) {
      this.line.setColour(this.#close ? this.#colours.near : this.#colours.doubtful);
    }
  }
}

function arc(radius: number, middle: number): Line {
  const steps = 16;
  return Array.from({ length: steps + 1 }, (_, step) => {
    const angle = middle - HALF + (2 * HALF * step) / steps;
    return [radius * Math.cos(angle), radius * Math.sin(angle), HEIGHT];
  }).flat();
}
