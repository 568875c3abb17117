/** Whether the system's settings ask for little motion. */

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
