/** Names of places in the picture. */

import { Group } from "three";
import type { NamedPlace } from "../values";
import { Label } from "./labels";
import type { SceneColours } from "./palette";
import type { View } from "./settings";
import type { Viewport } from "./viewport";

const LABEL_HEIGHT = 20;
/** From behind the robot only names within this distance of it are shown [m]: farther ones would lie over each other. */
const NEAR = 9;

export class PlaceNames {
  readonly object = new Group();
  #labels: readonly { readonly label: Label; readonly place: NamedPlace }[] = [];

  set(places: readonly NamedPlace[], colours: SceneColours): void {
    this.dispose();
    this.#labels = places.map((place) => {
      const label = new Label(place.name, LABEL_HEIGHT, colours.ink, colours.background);
      const { x, y, z } = place.pose.position;
      label.object.position.set(x, y, z + 0.1);
      label.object.material.opacity = 0.8;
      this.object.add(label.object);
      return { label, place };
    });
  }

  /** Show the names that can be told apart in a view of a robot that is here [m]. */
  look(view: View, x: number, y: number, viewport: Viewport): void {
    for (const { label, place: { pose } } of this.#labels) {
      const away = Math.hypot(pose.position.x - x, pose.position.y - y);
      label.object.visible = view === "top" || (view === "chase" && away > 1 && away < NEAR);
      label.setViewport(viewport.height / viewport.ratio, viewport.tangent);
    }
  }

  dispose(): void {
    for (const { label } of this.#labels) {
      this.object.remove(label.object);
      label.dispose();
    }
    this.#labels = [];
  }
}
