/** Names of places in the picture. */

import { Group } from "three";
import type { NamedPlace } from "../values";
import { Label, withoutOverlap } from "./labels";
import type { SceneColours } from "./palette";
import type { View } from "./settings";
import type { Viewport } from "./viewport";

const LABEL_HEIGHT = 20;
/** From behind the robot only names within this distance of it are shown [m]: farther ones would lie over each other. */
const NEAR = 9;
/** They are chosen anew when the robot has gone this far [m]. */
const AGAIN = 0.1;
/** Pixels of a metre with which no names lie over each other. */
const OF_ONE_PLACE = 1e6;
const NOWHERE = { x: Infinity, y: Infinity, view: "top", scale: 0 } as const;

interface Named {
  readonly label: Label;
  readonly place: NamedPlace;
}

export class PlaceNames {
  readonly object = new Group();
  #labels: readonly Named[] = [];
  /** Height of a pixel, at a distance of one, for which they have their size; none at first. */
  #fitted = NaN;
  /** From where, and how, the names were chosen last. */
  #chosenFor: { readonly x: number; readonly y: number; readonly view: View; readonly scale: number } = NOWHERE;

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
    this.#fit(viewport);
    const scale = view === "top" ? 1 / viewport.metresPerPixel : OF_ONE_PLACE;
    const moved = Math.hypot(x - this.#chosenFor.x, y - this.#chosenFor.y);
    if (moved > AGAIN || view !== this.#chosenFor.view || scale !== this.#chosenFor.scale) {
      this.#chosenFor = { x, y, view, scale };
      this.#choose(view, x, y, scale);
    }
  }

  /** Keep the height of the names in pixels, where the picture has another size now. */
  #fit({ height, ratio, tangent }: Viewport): void {
    if (this.#fitted !== tangent * ratio / height) {
      this.#fitted = tangent * ratio / height;
      for (const { label } of this.#labels) {
        label.setViewport(height / ratio, tangent);
      }
    }
  }

  #choose(view: View, x: number, y: number, scale: number): void {
    const away = ({ place: { pose: { position } } }: Named): number => Math.hypot(position.x - x, position.y - y);
    const near = this.#labels
      .filter((named) => view === "top" || (view === "chase" && away(named) > 1 && away(named) < NEAR))
      .sort((a, b) => away(a) - away(b));
    // From above they lie as on a map; those nearest to the robot are kept.
    const shown = new Set(withoutOverlap(near.map(({ label, place: { pose: { position } } }) =>
      ({ label, at: [position.x * scale, position.y * scale] as const, width: label.width })), LABEL_HEIGHT).map(({ label }) => label));
    for (const { label } of this.#labels) {
      label.object.visible = shown.has(label);
    }
  }

  dispose(): void {
    for (const { label } of this.#labels) {
      this.object.remove(label.object);
      label.dispose();
    }
    this.#labels = [];
    this.#chosenFor = NOWHERE;
    this.#fitted = NaN;
  }
}
