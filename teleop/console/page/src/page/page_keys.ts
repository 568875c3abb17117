/** Keys of the page that do not drive: the next view, and a hint. */

import { dialogOpen, ownsKeys } from "../driving/key_bindings";
import { VIEWS } from "../scene/settings";
import type { PageParts } from "./page_parts";

/** Act on V and H wherever no field, dialog or hint takes keys. */
export function watchKeys({ settings, hint, state }: PageParts): void {
  window.addEventListener("keydown", (event) => {
    const modified = event.ctrlKey || event.altKey || event.metaKey || event.repeat;
    if (modified || ownsKeys(event.target) || dialogOpen(document) || hint.placing) {
      return;
    }
    if (event.code === "KeyV") {
      const next = (VIEWS.indexOf(settings.view.peek()) + 1) % VIEWS.length;
      settings.view.value = VIEWS[next] ?? "chase";
    } else if (event.code === "KeyH" && state.session.peek()?.mayHint !== false) {
      hint.begin();
    }
  });
}
