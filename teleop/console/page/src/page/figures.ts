/** Figures of the page for whoever measures it, in the browser's own terms: performance marks and a function. */

import { effect } from "@preact/signals";
import { Vector3 } from "three";
import type { Workshop } from "../scene/workshop";
import type { Foresight } from "../prediction/foresight";
import type { WallFigures } from "../wall";
import type { Headset } from "../xr/xr";
import type { PageParts } from "./page_parts";

/** Name of the mark that is set when the first picture of a located robot in its map has been drawn. */
const SEEN = "farsteer: robot seen";

/** What `window.farsteerFigures()` returns. */
export interface PageFigures {
  /** Script time of the last pictures [ms], oldest first. */
  readonly frameTimes: readonly number[];
  readonly roundTrip: number | undefined;
  readonly bytesPerSecond: number;
  /** Place in the map [m] that is drawn at a place of the window [CSS pixels]. */
  floorPoint(clientX: number, clientY: number): { readonly x: number; readonly y: number } | undefined;
  /** What there is in the headset, with the script time of its pictures [ms]; undefined while nothing is. */
  readonly headset: ReturnType<Headset["figures"]> | undefined;
  /** The newest picture of a wall of screens; undefined where the page is none. */
  readonly wall: WallFigures | undefined;
  /** How far the drawn path leads from the robot's known place [m], and whether the guard ends it; undefined while none is drawn. */
  readonly way: { readonly length: number; readonly cut: boolean } | undefined;
  /** Place of the window [CSS pixels] at which a place in the robot's frame [m] is drawn. */
  screenPoint(x: number, y: number, z: number): { readonly x: number; readonly y: number };
}

declare global {
  interface Window {
    farsteerFigures?: () => PageFigures;
  }
}

/** Set the mark when it is time, and offer the function. */
export function publishFigures({ state, scene, statistics, headset, wall, way }: PageParts): void {
  const stop = effect(() => {
    const map = scene.built.value || state.mapPoints.value !== undefined || state.gridMap.value !== undefined;
    if (map && state.mapFromBase.value !== undefined) {
      // Two frames on, the picture that shows both has been drawn.
      requestAnimationFrame(() => { requestAnimationFrame(() => { mark(); }); });
    }
  });
  const mark = (): void => {
    if (performance.getEntriesByName(SEEN).length === 0) {
      performance.mark(SEEN);
      stop();
    }
  };
  window.farsteerFigures = () => ({
    frameTimes: scene.frameTimes(),
    roundTrip: statistics.peek().roundTrip,
    bytesPerSecond: statistics.peek().bytesPerSecond,
    wall: wall.shown.peek()?.(),
    headset: headset.headset.peek()?.figures(),
    way: drawn(way.peek()),
    floorPoint: (x, y) => scene.floorPoint(x, y),
    screenPoint: (x, y, z) => screenPoint(scene.workshop, new Vector3(x, y, z)),
  });
}

function drawn(way: Foresight | undefined): PageFigures["way"] {
  const end = way?.motions.at(-1);
  return way === undefined || end === undefined ? undefined : { length: Math.hypot(end.x, end.y), cut: way.cut };
}

function screenPoint({ base, camera, canvas }: Workshop, place: Vector3): { readonly x: number; readonly y: number } {
  const { left, top, width, height } = canvas.getBoundingClientRect();
  const { x, y } = base.localToWorld(place).project(camera);
  return { x: left + ((x + 1) / 2) * width, y: top + ((1 - y) / 2) * height };
}
