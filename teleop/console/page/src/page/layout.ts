/** How much room the page has, which decides what stands where. */

import { signal, type ReadonlySignal } from "@preact/signals";

/**
 * `wide`: panels on both sides of the picture; `stacked`: panels below it; `phone`: the picture alone with what a driver
 * needs on it, and the panels in a drawer.
 */
export type Layout = "wide" | "stacked" | "phone";

/** Phones, held across or upright; the widest there are have 60 rem. */
const PHONE = "(max-width: 62rem) and (max-height: 34rem), (max-width: 40rem)";
const STACKED = "(max-width: 62rem)";

/** Return the layout, which follows the window. */
export function pageLayout(matches: Window["matchMedia"] = (query) => window.matchMedia(query)): ReadonlySignal<Layout> {
  const [phone, stacked] = [matches(PHONE), matches(STACKED)];
  const now = (): Layout => (phone.matches ? "phone" : stacked.matches ? "stacked" : "wide");
  const layout = signal(now());
  for (const query of [phone, stacked]) {
    query.addEventListener("change", () => { layout.value = now(); });
  }
  return layout;
}
