/** What a person may set about the picture; remembered by the browser. */

import type { Signal } from "@preact/signals";
import { browserKeeper, remembered, type Keeper } from "./stored_signals";

export const VIEWS = ["chase", "top", "first", "arm"] as const;
/** From behind the robot, from above with north (y) up, with the robot's eyes, or near its arm. */
export type View = (typeof VIEWS)[number];

/** Return the views of a robot: one without an arm has none of it. */
export function viewsOf(arm: boolean): readonly View[] {
  return VIEWS.filter((view) => view !== "arm" || arm);
}

/** Return the view that is shown of a robot when this one is chosen. */
export function shownView(chosen: View, arm: boolean): View {
  return viewsOf(arm).includes(chosen) ? chosen : "chase";
}

export const THEMES = ["day", "night"] as const;
export type Theme = (typeof THEMES)[number];

export const LAYERS = [
  "building", "map", "cloud", "oldSweeps", "path", "covariance", "hypotheses", "names", "minimap", "truth", "grid",
] as const;
export type Layer = (typeof LAYERS)[number];
export type Layers = Readonly<Record<Layer, boolean>>;

/** When it is shown where the robot will go: while the link is slow, always, or never. */
export const PATH_AHEAD = ["late", "always", "never"] as const;
export type PathAhead = (typeof PATH_AHEAD)[number];

export const POINT_SIZE_RANGE = { min: 0.5, max: 4, initial: 1 } as const;
export const DECAY_RANGE = { min: 0, max: 30, initial: 4 } as const;

export interface SceneSettings {
  readonly view: Signal<View>;
  readonly theme: Signal<Theme>;
  /** Factor on the size of all points. */
  readonly pointSize: Signal<number>;
  readonly layers: Signal<Layers>;
  readonly pathAhead: Signal<PathAhead>;
  /** How long old sweeps stay in the picture [s]; 0 keeps none. */
  readonly decay: Signal<number>;
}

/** Points of the map say what its surfaces say, less well; they are shown where there are no surfaces. */
const FIRST_LAYERS: Layers = {
  building: true, map: false, cloud: true, oldSweeps: true, path: true, covariance: true, hypotheses: true, names: true,
  minimap: true, truth: false, grid: true,
};

/** Return the settings as they were kept, else the defaults; the theme follows the system at first. */
export function sceneSettings(
  keeper: Keeper | undefined = browserKeeper(),
  prefersDark: boolean = systemPrefersDark(),
): SceneSettings {
  return {
    view: remembered("farsteer.view", "chase", oneOf(VIEWS), keeper),
    theme: remembered("farsteer.theme", prefersDark ? "night" : "day", oneOf(THEMES), keeper),
    pointSize: remembered("farsteer.pointSize", POINT_SIZE_RANGE.initial, within(POINT_SIZE_RANGE), keeper),
    pathAhead: remembered("farsteer.pathAhead", "late", oneOf(PATH_AHEAD), keeper),
    layers: remembered("farsteer.shown", FIRST_LAYERS, asLayers, keeper),
    decay: remembered("farsteer.decay", DECAY_RANGE.initial, within(DECAY_RANGE), keeper),
  };
}

/** Return the layers with one of them shown or hidden. */
export function withLayer(layers: Layers, layer: Layer, shown: boolean): Layers {
  return { ...layers, [layer]: shown };
}

function systemPrefersDark(): boolean {
  return typeof window.matchMedia === "function" && window.matchMedia("(prefers-color-scheme: dark)").matches;
}

function oneOf<T extends string>(known: readonly T[]): (kept: unknown) => T | undefined {
  return (kept) => known.find((each) => each === kept);
}

function within(range: { readonly min: number; readonly max: number }): (kept: unknown) => number | undefined {
  return (kept) =>
    typeof kept === "number" && kept >= range.min && kept <= range.max ? kept : undefined;
}

function asLayers(kept: unknown): Layers | undefined {
  if (typeof kept !== "object" || kept === null) {
    return undefined;
  }
  const entries = new Map<string, unknown>(Object.entries(kept));
  return LAYERS.reduce<Layers>((layers, layer) => {
    const shown = entries.get(layer);
    return typeof shown === "boolean" ? withLayer(layers, layer, shown) : layers;
  }, FIRST_LAYERS);
}
