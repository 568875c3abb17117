/** The time as a panel sees it. */

import { signal, useSignal } from "@preact/signals";
import { useEffect } from "preact/hooks";

/** The page's clock [ms]; replaced in tests. */
export const pageClock = signal<() => number>(() => performance.now());

/**
 * Return the time of the page's clock [ms], renewed each `period` [ms]. What is shown with its age uses it, since nothing
 * arrives that would draw it anew once the robot is silent.
 */
export function useNow(period = 250): number {
  const now = useSignal(pageClock.peek()());
  useEffect(() => {
    const id = setInterval(() => { now.value = pageClock.peek()(); }, period);
    return () => { clearInterval(id); };
  }, [period, now]);
  return now.value;
}
