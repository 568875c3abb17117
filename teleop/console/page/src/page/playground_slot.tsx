/** The playground's panel, which is fetched when it is opened for the first time. */

import { useSignal } from "@preact/signals";
import { playgroundTexts } from "../texts/playground";
import { pageTexts as texts } from "../texts/page";
import { Guarded } from "./guarded";
import type { PageParts } from "./page_parts";

type Panel = typeof import("../panels/playground/playground_panel")["PlaygroundPanel"];

export function PlaygroundSlot({ parts: { wire, hint, state, events } }: { readonly parts: PageParts }) {
  const panel = useSignal<{ readonly Panel: Panel } | undefined>(undefined);
  const open = (): void => {
    import("../panels/playground/playground_panel").then(
      ({ PlaygroundPanel }) => { panel.value = { Panel: PlaygroundPanel }; },
      () => { events.add("warning", texts.playgroundNotLoaded); },
    );
  };
  const loaded = panel.value;
  return (
    <details class="page-fold" onToggle={({ currentTarget }) => { if (currentTarget.open && loaded === undefined) { open(); } }}>
      <summary>{playgroundTexts.title}</summary>
      <Guarded name={playgroundTexts.title}>
        {loaded !== undefined && <loaded.Panel wire={wire} tool={hint} run={state.run.value} />}
      </Guarded>
    </details>
  );
}
