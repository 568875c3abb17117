/** Hints are placed, and places that a search found are compared, on the map as seen from above. */

import { effect, type ReadonlySignal, type Signal } from "@preact/signals";
import { isSearching } from "../hint/hint_reducer";
import type { HintState } from "../hint/hint_state";
import type { View } from "../scene/settings";

/**
 * Show the map from above when a hint or a search is begun, and the view of before once it is over.
 *
 * A view that the person chooses meanwhile stays. The returned function ends it.
 */
export function viewHintsFromAbove(hint: ReadonlySignal<Pick<HintState, "phase" | "result">>, view: Signal<View>): () => void {
  let before: View | undefined;
  let looking = false;
  const stopWatching = effect(() => {
    if (view.value !== "top") {
      before = undefined; // somebody wants to see it so
    }
  });
  const stop = effect(() => {
    const { phase } = hint.value;
    const looks = phase === "placing" || isSearching(hint.value);
    if (looks) {
      const present = view.peek();
      if (!looking && present !== "top") {
        view.value = "top";
        before = present;
      }
    } else if (phase !== "waiting" && before !== undefined) {
      view.value = before;
      before = undefined;
    }
    looking = looks;
  });
  return () => { stopWatching(); stop(); };
}
