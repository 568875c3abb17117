/** What the guard keeps free: the floor that the robot would sweep until it stands, and the point that decides. */

import type { GuardZone } from "../values";
import type { SceneColours } from "./palette";
import { type Line, WideLine } from "./wide_line";

const HEIGHT = 0.06;
/** Half the size of the mark on the point [m]. */
const MARK = 0.08;
/** Corners of an outline that are drawn at most. */
const MOST = 64;

export class GuardZoneLayer {
  readonly line = new WideLine(MOST + 4, { width: 3, overlaid: true });
  #colours: SceneColours | undefined;
  #stopped = false;

  /** Show it in the robot's frame; undefined, or a guard that limits nothing, hides it. */
  set(zone: GuardZone | undefined): void {
    const { outline = [], point } = zone ?? {};
    const corners = outline.length < 3 ? [] : [...outline.slice(0, MOST), ...outline.slice(0, 1)];
    this.line.set([
      corners.flatMap(({ x, y }) => [x, y, HEIGHT]),
      ...(point === undefined ? [] : [cross(point.x, point.y, 1), cross(point.x, point.y, -1)]),
    ].filter((line) => line.length > 0));
    this.#stopped = zone?.stopped === true;
    this.#paint();
  }

  setColours(colours: SceneColours): void {
    this.#colours = colours;
    this.#paint();
  }

  #paint(): void {
    if (this.#colours !== undefined) {
      this.line.setColour(this.#stopped ? this.#colours.near : this.#colours.doubtful);
    }
  }
}

function cross(x: number, y: number, slope: 1 | -1): Line {
  return [x - MARK, y - slope * MARK, HEIGHT, x + MARK, y + slope * MARK, HEIGHT];
}
