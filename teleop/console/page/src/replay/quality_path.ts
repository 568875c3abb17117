/** The way that a run went, coloured by how well the robot knew where it was. */

import { BufferGeometry, Float32BufferAttribute, Line, LineBasicMaterial, SRGBColorSpace, Color } from "three";
import { COLOURS } from "../scene/palette";
import type { Theme } from "../scene/settings";
import { gradeOf, type Quality } from "./quality";

/** Height over the floor [m], so that the line is not drawn into it. */
const HEIGHT = 0.05;

/** Return the line in the map's frame. */
export function qualityPath(moments: readonly Quality[], theme: Theme): Line {
  const colours = COLOURS[theme];
  const shades = { good: colours.good, warn: colours.distances[1], bad: colours.bad, stale: colours.stale };
  const [places, tints]: [number[], number[]] = [[], []];
  for (const { position, health } of moments) {
    if (position !== undefined) {
      places.push(position.x, position.y, HEIGHT);
      const { r, g, b } = new Color().setRGB(...shades[gradeOf(health)], SRGBColorSpace);
      tints.push(r, g, b);
    }
  }
  const geometry = new BufferGeometry();
  geometry.setAttribute("position", new Float32BufferAttribute(places, 3));
  geometry.setAttribute("color", new Float32BufferAttribute(tints, 3));
  return new Line(geometry, new LineBasicMaterial({ vertexColors: true, depthTest: false }));
}
