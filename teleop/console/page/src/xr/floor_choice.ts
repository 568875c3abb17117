/** The place of the floor that a ray with its trigger held chooses: for a hint, or to drive there. */

import type { HintTool } from "../hint/hint_tool";
import type { DriveThere } from "../steps/drive_there";
import type { Ray } from "./pointing";

export class FloorChoice {
  #ray: Ray | undefined;

  constructor(private readonly hint: HintTool, private readonly there: DriveThere) {}

  begin(ray: Ray): void {
    this.#ray = ray;
    this.#choose("press", ray);
  }

  /** Go with the ray, in each frame. */
  follow(): void {
    if (this.#ray?.onFloor === true) {
      this.#choose("drag", this.#ray);
    }
  }

  end(): void {
    if (this.#ray !== undefined) {
      this.#ray = undefined;
      this.hint.nudge({ type: "release" });
    }
  }

  #choose(type: "press" | "drag", { floor: { x, y } }: Ray): void {
    if (this.hint.placing) {
      this.hint.nudge({ type, point: { x, y } });
    } else {
      this.there.aim({ x, y });
    }
  }
}
