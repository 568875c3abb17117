/** Where the robot may be: numbered outlines on the map. */

import { Box3, Group, Vector3 } from "three";
import type { PlaceInQuestion } from "../values";
import { Label } from "./labels";
import { arrow, boxEdges } from "./outline";
import type { SceneColours } from "./palette";
import { place } from "./robot_layer";
import { WideLine } from "./wide_line";
import type { Viewport } from "./viewport";

/** More places than this help nobody. */
const MOST = 20;
const LABEL_HEIGHT = 26;

interface Mark {
  readonly group: Group;
  readonly label: Label;
  readonly lines: readonly WideLine[];
}

/** Its number in the list of the panel, and where there is one its name. */
function labelWords({ name = "" }: PlaceInQuestion, number: number): string {
  return name === "" ? String(number) : `${number} ${name}`;
}

export class Hypotheses {
  readonly object = new Group();
  #marks: readonly Mark[] = [];

  set(poses: readonly PlaceInQuestion[], box: Box3, colours: SceneColours): void {
    this.clear();
    this.#marks = poses.slice(0, MOST).map((pose, index) => {
      const group = new Group();
      place(group, pose);
      const edges = new WideLine(48, { width: 2.5, overlaid: true });
      edges.set(boxEdges(box));
      const heading = new WideLine(8, { width: 3, overlaid: true });
      heading.set(arrow(0, 0.9, 0.05));
      const lines = [edges, heading];
      const label = new Label(labelWords(pose, index + 1), LABEL_HEIGHT, colours.background, colours.hypothesis);
      label.object.position.set(0, 0, box.max.z);
      // Above the outline on the screen, from wherever it is seen.
      label.object.center.set(0.5, -0.6);
      for (const line of lines) {
        line.setColour(colours.hypothesis);
        group.add(line.object);
      }
      group.add(label.object);
      this.object.add(group);
      return { group, label, lines };
    });
  }

  /** Points to aim at when one is to be picked. */
  centres(): Vector3[] {
    return this.#marks.map(({ label }) => label.object.getWorldPosition(new Vector3()));
  }

  setViewport(viewport: Viewport): void {
    if (this.#marks.length === 0) {
      return;
    }
    const scale = Math.max(1, (18 * viewport.metresPerPixel) / 0.5);
    for (const { group, label, lines } of this.#marks) {
      label.setViewport(viewport.height / viewport.ratio, viewport.tangent);
      for (const line of lines) {
        line.object.scale.setScalar(scale);
      }
      group.visible = true;
    }
  }

  clear(): void {
    for (const { group, label, lines } of this.#marks) {
      this.object.remove(group);
      label.dispose();
      for (const line of lines) {
        line.dispose();
      }
    }
    this.#marks = [];
  }
}
