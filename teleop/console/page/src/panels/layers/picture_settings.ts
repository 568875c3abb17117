/** What the panel of the picture needs of its settings. */

import type { ReadonlySignal, Signal } from "@preact/signals";

export type View = "chase" | "top" | "first";
export type Theme = "day" | "night";
export type Layer = "map" | "cloud" | "oldSweeps" | "path" | "covariance" | "hypotheses" | "truth" | "grid";

export interface PictureSettings {
  readonly view: Signal<View>;
  readonly theme: Signal<Theme>;
  /** Factor on the size of all points. */
  readonly pointSize: Signal<number>;
  readonly layers: Signal<Readonly<Record<Layer, boolean>>>;
  /** How long old sweeps stay in the picture [s]; 0 keeps none. */
  readonly decay: Signal<number>;
}

/** The setting that saves bandwidth, which belongs to the link. */
export interface LeanSetting {
  readonly lean: ReadonlySignal<boolean>;
  readonly setLean: (lean: boolean) => void;
}

/** A value of the legend: a distance [m], or undefined for "unknown", and its colour for CSS. */
export interface LegendEntry {
  readonly distance: number | undefined;
  readonly colour: string;
}
