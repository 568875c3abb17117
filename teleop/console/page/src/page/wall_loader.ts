/** Loads what shows the page as a wall of screens, where its address asks for that. */

import { signal, type ReadonlySignal } from "@preact/signals";
import { pageTexts as texts } from "../texts/page";
import type { Severity } from "../values";

type WallModule = typeof import("../wall");

type WallParts = Parameters<WallModule["showWall"]>[1] & {
  readonly events: (severity: Severity, words: string) => void;
};

/** Show the wall that an address names; until then, and without one, what is returned is undefined. */
export function loadWall(query: string, parts: WallParts, root: HTMLElement): ReadonlySignal<ReturnType<WallModule["showWall"]> | undefined> {
  const shown = signal<ReturnType<WallModule["showWall"]> | undefined>(undefined);
  if (new URLSearchParams(query).has("screen")) {
    void import("../wall").then(({ showWall, wallOf }) => {
      const wall = wallOf(query);
      if (wall !== undefined) {
        shown.value = showWall(wall, parts);
        root.dataset["wall"] = "";
      }
    }).catch((error: unknown) => {
      parts.events("warning", error instanceof Error ? error.message : texts.rejected(String(error)));
    });
  }
  return shown;
}
