/** Loads the part for headsets once there is one: all others never fetch it. */

import { signal, type ReadonlySignal } from "@preact/signals";
import { xrTexts as texts } from "../texts/xr";
import type { Severity } from "../values";
import type { Headset, HeadsetParts, Mode } from "../xr/xr";

type HeadsetModule = typeof import("../xr/xr");

const MODES: readonly Mode[] = ["immersive-vr", "immersive-ar"];

/** The headset, as far as there is one. */
export interface HeadsetPart {
  /** What it can show the page as; empty without a headset, and until the part has been loaded. */
  readonly modes: ReadonlySignal<readonly Mode[]>;
  readonly headset: ReadonlySignal<Headset | undefined>;
  readonly enter: (mode: Mode) => void;
}

interface LoaderParts extends HeadsetParts {
  readonly events: (severity: Severity, words: string) => void;
}

/** Ask the browser for a headset, now and whenever one is plugged in. @param xr Is missing in browsers without headsets. */
export function loadHeadset(
  xr: XRSystem | undefined, parts: LoaderParts, load: () => Promise<HeadsetModule> = () => import("../xr/xr"),
): HeadsetPart {
  const [modes, headset] = [signal<readonly Mode[]>([]), signal<Headset | undefined>(undefined)];
  const look = async (system: XRSystem): Promise<void> => {
    const supported = await Promise.all(MODES.map((mode) => system.isSessionSupported(mode).catch(() => false)));
    const found = MODES.filter((_, at) => supported[at]);
    if (found.length > 0 && headset.peek() === undefined) {
      try {
        const { Headset: Loaded } = await load();
        headset.value ??= new Loaded(system, parts);
      } catch {
        parts.events("warning", texts.notLoaded);
        return;
      }
    }
    modes.value = found;
  };
  if (xr !== undefined) {
    void look(xr);
    xr.addEventListener("devicechange", () => { void look(xr); });
  }
  return {
    modes, headset,
    enter: (mode) => {
      headset.peek()?.enter(mode).catch((error: unknown) => {
        parts.events("warning", texts.notBegun(error instanceof Error ? error.message : String(error)));
      });
    },
  };
}
