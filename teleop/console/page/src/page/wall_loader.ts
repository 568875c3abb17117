/** Loads what shows the page as a wall of screens, where its address asks for that. */

import { signal, type ReadonlySignal } from "@preact/signals";
import { pageTexts as texts } from "../texts/page";
import type { Severity } from "../values";

type WallModule = typeof import("../wall");

type WallParts = Parameters<WallModule["showWall"]>[1] & {
  readonly events: (severity: Severity, words: string) => void;
};

/** The wall, as far as one is asked for. */
export interface WallPart {
  /** Whether the page is to be one: then it has no panels. */
  readonly asked: ReadonlySignal<boolean>;
  /** What tells of the newest picture; undefined until there is one. */
  readonly shown: ReadonlySignal<ReturnType<WallModule["showWall"]> | undefined>;
}

/** Whether the address of a page asks for a wall. */
export function asksForWall(query: string): boolean {
  return new URLSearchParams(query).has("screen");
}

/** Show the wall that an address names. */
export function loadWall(query: string, parts: WallParts, root: HTMLElement): WallPart {
  const asked = signal(asksForWall(query));
  const shown = signal<ReturnType<WallModule["showWall"]> | undefined>(undefined);
  if (asked.peek()) {
    void import("../wall").then(({ showWall, wallOf }) => {
      const wall = wallOf(query);
      asked.value = wall !== undefined;
      if (wall !== undefined) {
        shown.value = showWall(wall, parts);
        root.dataset["wall"] = "";
      }
    }).catch((error: unknown) => {
      asked.value = false;
      parts.events("warning", error instanceof Error ? error.message : texts.rejected(String(error)));
    });
  }
  return { asked, shown };
}
