/** The place beside the map where a robot waits that does not know where it is. */

import { Group } from "three";
import { sceneTexts } from "../texts/scene";
import type { Pose } from "../values";
import { Label } from "./labels";
import { WAITING_RADIUS } from "./located";
import { circle } from "./outline";
import type { SceneColours } from "./palette";
import { place } from "./robot_layer";
import type { Viewport } from "./viewport";
import { WideLine } from "./wide_line";

const LABEL_HEIGHT = 26;

export class NotLocatedRing {
  readonly object = new Group();
  readonly #edge = new WideLine(80, { width: 1.5 });
  #label: Label | undefined;

  constructor() {
    this.#edge.set([circle(WAITING_RADIUS, 0, 72)]);
    this.object.add(this.#edge.object);
    this.object.visible = false;
  }

  /** Show the place about a pose, or hide it. */
  set(pose: Pose | undefined): void {
    this.object.visible = pose !== undefined;
    if (pose !== undefined) {
      place(this.object, pose);
    }
  }

  setColours(colours: SceneColours): void {
    this.#edge.setColour(colours.doubtful);
    this.#removeLabel();
    this.#label = new Label(sceneTexts.notLocated, LABEL_HEIGHT, colours.background, colours.doubtful);
    this.#label.object.position.set(0, WAITING_RADIUS, 0);
    this.object.add(this.#label.object);
  }

  setViewport(viewport: Viewport): void {
    this.#label?.setViewport(viewport.height / viewport.ratio, viewport.tangent);
  }

  dispose(): void {
    this.#removeLabel();
    this.#edge.dispose();
  }

  #removeLabel(): void {
    if (this.#label !== undefined) {
      this.object.remove(this.#label.object);
      this.#label.dispose();
    }
  }
}
