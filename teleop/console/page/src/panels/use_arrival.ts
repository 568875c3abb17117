/** When a signal's value arrived, for values that do not carry it. */

import { effect, useSignal, type ReadonlySignal } from "@preact/signals";
import { useEffect } from "preact/hooks";
import { pageClock } from "./use_now";

/** Return the page's time of the last change of a signal [ms]; undefined while it has no value. */
export function useArrival(part: ReadonlySignal<unknown>): number | undefined {
  const at = useSignal<number | undefined>(part.peek() === undefined ? undefined : pageClock.peek()());
  useEffect(() => effect(() => {
    at.value = part.value === undefined ? undefined : pageClock.peek()();
  }), [part, at]);
  return at.value;
}
