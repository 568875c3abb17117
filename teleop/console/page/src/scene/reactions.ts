/** Small helpers for reacting to signals and to the system's settings. */

import type { ReadonlySignal } from "@preact/signals";

/** Have the effect that calls this run again when one of the signals changes. */
export function depend(...signals: readonly ReadonlySignal<unknown>[]): readonly unknown[] {
  return signals.map((each) => each.value);
}

/** Report whether the person wants little motion, now and whenever that changes; returns what ends it. */
export function onReducedMotion(report: (reduced: boolean) => void): () => void {
  if (typeof window.matchMedia !== "function") {
    return () => undefined;
  }
  const query = window.matchMedia("(prefers-reduced-motion: reduce)");
  const changed = (): void => { report(query.matches); };
  changed();
  query.addEventListener("change", changed);
  return () => { query.removeEventListener("change", changed); };
}
