/** The building as an image from above, drawn once: the floor that was seen, and the tops of walls and furniture. */

import { Mesh, Vector3, type BufferAttribute, type InterleavedBufferAttribute, type MeshBasicMaterial } from "three";
import type { BuildingLayer } from "./building_layer";
import type { Bounds } from "./geometry";
import { css, type SceneColours } from "./palette";

/** Pixels for a metre, and the longest side [px]: a wall of 10 cm has two. */
const FINE = 20;
const LONGEST = 2000;
/** What is lower above the floor is none of what a plan shows [m]. */
const LOWEST = 0.1;

export interface PlanImage {
  readonly image: HTMLCanvasElement;
  readonly bounds: Bounds;
  /** Pixels of the image for a metre. */
  readonly perMetre: number;
}

/** Return the plan of a building; undefined if there is none, or nothing to draw with. */
export function planImage(building: BuildingLayer, colours: SceneColours): PlanImage | undefined {
  const { bounds, floor } = building;
  const image = document.createElement("canvas");
  const pen = image.getContext("2d");
  if (bounds === undefined || pen === null) {
    return undefined;
  }
  const [wide, tall] = [bounds.max.x - bounds.min.x, bounds.max.y - bounds.min.y];
  const perMetre = Math.min(FINE, LONGEST / Math.max(wide, tall));
  [image.width, image.height] = [Math.ceil(wide * perMetre), Math.ceil(tall * perMetre)];
  const meshes = building.object.children.filter((part) => part instanceof Mesh) as Mesh[];
  pen.setTransform(perMetre, 0, 0, -perMetre, -bounds.min.x * perMetre, bounds.max.y * perMetre);
  meshes.filter(({ name }) => name === "floor").forEach((mesh) => { drawFloor(pen, mesh, css(colours.floor)); });
  pen.fillStyle = css(colours.wallHigh);
  meshes.filter(({ name }) => name !== "floor").forEach((mesh) => { drawTops(pen, mesh, floor + LOWEST); });
  return { image, bounds, perMetre };
}

/** Fill the triangles that lie above a height [m]; upright ones have no area from above. */
function drawTops(pen: CanvasRenderingContext2D, { geometry }: Mesh, lowest: number): void {
  const [position, index] = [geometry.getAttribute("position"), geometry.getIndex()];
  const corners = [new Vector3(), new Vector3(), new Vector3()] as const;
  pen.beginPath();
  for (let at = 0; at + 2 < (index?.count ?? position.count); at += 3) {
    corners.forEach((corner, side) => corner.fromBufferAttribute(position, index?.getX(at + side) ?? at + side));
    const [a, b, c] = corners;
    const area = (b.x - a.x) * (c.y - a.y) - (c.x - a.x) * (b.y - a.y);
    if (Math.min(a.z, b.z, c.z) > lowest && Math.abs(area) > 1e-6) {
      // One way round, so that overlapping faces do not cancel each other.
      const [second, third] = area > 0 ? [b, c] : [c, b];
      pen.moveTo(a.x, a.y);
      pen.lineTo(second.x, second.y);
      pen.lineTo(third.x, third.y);
      pen.closePath();
    }
  }
  pen.fill();
}

/** Draw where the floor's picture is opaque, in one colour. */
function drawFloor(pen: CanvasRenderingContext2D, { geometry, material }: Mesh, colour: string): void {
  const picture = (material as MeshBasicMaterial).map?.image as ImageBitmap | HTMLImageElement | undefined;
  const [position, uv] = [geometry.getAttribute("position"), geometry.getAttribute("uv")];
  if (picture === undefined || position.count === 0) {
    return;
  }
  const [x0, x1] = spread(position, uv, 0);
  const [y0, y1] = spread(position, uv, 1);
  const stencil = document.createElement("canvas");
  [stencil.width, stencil.height] = [picture.width, picture.height];
  const fill = stencil.getContext("2d");
  if (fill !== null) {
    fill.drawImage(picture, 0, 0);
    fill.globalCompositeOperation = "source-in";
    fill.fillStyle = colour;
    fill.fillRect(0, 0, stencil.width, stencil.height);
    pen.save();
    pen.transform((x1 - x0) / stencil.width, 0, 0, (y1 - y0) / stencil.height, x0, y0);
    pen.drawImage(stencil, 0, 0);
    pen.restore();
  }
}

type Attribute = BufferAttribute | InterleavedBufferAttribute;

/** Return where a picture's first and last pixels lie along an axis [m], by the farthest two corners of the floor. */
function spread(position: Attribute, uv: Attribute, axis: 0 | 1): [number, number] {
  const at = (attribute: Attribute, index: number): number => (axis === 0 ? attribute.getX(index) : attribute.getY(index));
  const order = Array.from({ length: position.count }, (_, index) => index).sort((a, b) => at(position, a) - at(position, b));
  const [low, high] = [order[0] ?? 0, order.at(-1) ?? 0];
  const [m0, m1, u0, u1] = [at(position, low), at(position, high), at(uv, low), at(uv, high)];
  const scale = (m1 - m0) / (u1 - u0);
  return [m0 - u0 * scale, m0 + (1 - u0) * scale];
}
