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
        {layerTexts.view}: {layerTexts.views[shownView(settings.view.value, state.arm.value)]}
      </button>
      {mayHint && <button type="button" aria-label={hintTexts.begin} onClick={() => { hint.begin(); }}>{texts.where}</button>}
      {screen !== undefined && (
        <button type="button" aria-pressed={screen.on.value} aria-label={texts.fullScreen} onClick={() => { screen.toggle(); }}>⛶</button>
      )}
    </>
  );
}
