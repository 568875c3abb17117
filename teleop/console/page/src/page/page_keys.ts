/** Keys of the page that do not drive: the next view, and a hint. */

import { actionOf, dialogOpen, ownsKeys } from "../driving/key_bindings";
import { shownView, viewsOf } from "../scene/settings";
import type { PageParts } from "./page_parts";

/** Show the view after the present one. */
export function nextView({ settings, state }: Pick<PageParts, "settings" | "state">): void {
  const views = viewsOf(state.arm.peek());
  const next = (views.indexOf(shownView(settings.view.peek(), state.arm.peek())) + 1) % views.length;
  settings.view.value = views[next] ?? "chase";
}

/** Act on V and H wherever no field, dialog or hint takes keys. */
export function watchKeys({ settings, hint, state }: PageParts): void {
  window.addEventListener("keydown", (event) => {
    const modified = event.ctrlKey || event.altKey || event.metaKey || event.repeat;
    if (modified || ownsKeys(event.target) || dialogOpen(document) || hint.placing) {
      return;
    }
    const action = actionOf(event.code);
    if (action === "view") {
      nextView({ settings, state });
    } else if (action === "hint" && state.session.peek()?.mayHint !== false) {
      hint.begin();
    }
  });
}
