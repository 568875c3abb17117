/** Where the robot will go, on the floor: its outline where a command sent now takes effect, and the edges of its path. */

import { Group, type Box3 } from "three";
import type { SceneColours } from "../scene/palette";
import { place } from "../scene/robot_layer";
import { WideLine, type Line } from "../scene/wide_line";
import type { Pose } from "../values";
import type { Foresight } from "./foresight";
import type { Motion } from "./predicted_motion";

/** Height of the lines over the floor [m]. */
const LIFT = 0.04;
/** Each so many motions a point of the line: 8 cm at 0.7 m/s. */
const STRIDE = 6;

export class PathLayer {
  readonly object = new Group();
  readonly #edges = new WideLine(200, { width: 3.5 });
  readonly #outline = new WideLine(8, { width: 2, overlaid: true });
  readonly #end = new WideLine(2, { width: 6, overlaid: true });

  constructor() {
    this.object.add(this.#edges.object, this.#outline.object, this.#end.object);
    this.clear();
  }

  /** Show a foresight of a robot with this body [m] from its known pose on. */
  set({ motions, effect, cut }: Foresight, pose: Pose, { min, max }: Box3): void {
    const [path, last, there] = [motions.slice(effect), motions.at(-1), motions[effect] ?? motions.at(-1)];
    const kept = path.filter((_, index) => index % STRIDE === 0 || index === path.length - 1);
    const corners: [number, number][] = [[min.x, min.y], [max.x, min.y], [max.x, max.y], [min.x, max.y], [min.x, min.y]];
    this.#edges.set([min.y, max.y].map((aside) => kept.flatMap((motion) => at(motion, 0, aside))));
    this.#outline.set(there === undefined ? [] : [corners.flatMap(([x, y]) => at(there, x, y))]);
    const front = last !== undefined && last.forward < 0 ? min.x : max.x;
    this.#end.set(cut && last !== undefined ? [[...at(last, front, min.y), ...at(last, front, max.y)]] : []);
    place(this.object, pose);
    this.object.visible = true;
  }

  clear(): void {
    this.object.visible = false;
  }

  setColours(colours: SceneColours): void {
    this.#edges.setColour(colours.path);
    this.#outline.setColour(colours.robot);
    this.#end.setColour(colours.near);
  }

  dispose(): void {
    for (const line of [this.#edges, this.#outline, this.#end]) {
      line.dispose();
    }
  }
}

/** Return a point of the robot's own frame [m] where it will be. */
function at({ x, y, yaw }: Motion, ahead: number, aside: number): Line {
  return [x + ahead * Math.cos(yaw) - aside * Math.sin(yaw), y + ahead * Math.sin(yaw) + aside * Math.cos(yaw), LIFT];
}
