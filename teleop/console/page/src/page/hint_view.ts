/** Hints are placed on the map as seen from above: that view comes and goes with them. */

import { effect, type ReadonlySignal, type Signal } from "@preact/signals";
import type { HintState } from "../hint/hint_state";
import type { View } from "../scene/settings";

/**
 * Show the map from above when a hint is begun, and the view of before once the robot has judged it or it was left.
 *
 * A view that the person chooses meanwhile stays. The returned function ends it.
 */
export function viewHintsFromAbove(hint: ReadonlySignal<Pick<HintState, "phase">>, view: Signal<View>): () => void {
  let before: View | undefined;
  let placing = false;
  const stopWatching = effect(() => {
    if (view.value !== "top") {
      before = undefined; // somebody wants to see it so
    }
  });
  const stop = effect(() => {
    const { phase } = hint.value;
    if (phase === "placing") {
      const present = view.peek();
      if (!placing && present !== "top") {
        view.value = "top";
        before = present;
      }
    } else if (phase !== "waiting" && before !== undefined) {
      view.value = before;
      before = undefined;
    }
    placing = phase === "placing";
  });
  return () => { stopWatching(); stop(); };
}
