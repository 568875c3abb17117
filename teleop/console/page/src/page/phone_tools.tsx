/** What a phone has in its bar in place of the panels beside the picture: the next view, a hint, the full screen. */

import { useMemo } from "preact/hooks";
import { layerTexts } from "../texts/panels";
import { hintTexts } from "../texts/hint";
import { pageTexts as texts } from "../texts/page";
import { shownView } from "../scene/settings";
import { fullScreen } from "./hands";
import { nextView } from "./page_keys";
import type { PageParts } from "./page_parts";

export function PhoneTools({ parts }: { readonly parts: PageParts }) {
  const { settings, state, hint } = parts;
  const screen = useMemo(() => fullScreen(document), []);
  const mayHint = state.session.value?.mayHint !== false && hint.view.value.phase !== "placing";
  return (
    <>
      <button type="button" onClick={() => { nextView(parts); }}>
        <span class="panel-spoken">{layerTexts.view}: </span>{layerTexts.views[shownView(settings.view.value, state.arm.value)]}
      </button>
      {mayHint && <button type="button" aria-label={hintTexts.begin} onClick={() => { hint.begin(); }}>{texts.where}</button>}
      {screen !== undefined && (
        <button type="button" aria-pressed={screen.on.value} aria-label={texts.fullScreen} onClick={() => { screen.toggle(); }}>
          <svg class="page-icon" viewBox="0 0 20 20" aria-hidden="true"><path d="M2 7V2H7M13 2H18V7M18 13V18H13M7 18H2V13" /></svg>
        </button>
      )}
    </>
  );
}
