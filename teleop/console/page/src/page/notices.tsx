/** What stands in the way right now, in a sentence each, over the picture. */

import { pageTexts as texts } from "../texts/page";
import { insecure, type PageParts } from "./page_parts";

export function Notices({ parts }: { readonly parts: PageParts }) {
  const { state, scene } = parts;
  const connection = state.connection.value;
  const progress = state.mapProgress.value;
  return (
    <div class="page-notices">
      {connection.phase === "connecting" && connection.words === "" && (
        <p role="status">{texts.connecting(parts.address)}</p>
      )}
      {connection.words !== "" && (connection.phase === "connecting" || connection.phase === "refused") && <p role="alert">{connection.words}</p>}
      {progress !== undefined && (
        <p role="status">
          {texts.loading(progress)} <progress max={1} value={progress} aria-label={texts.loading(progress)} />
        </p>
      )}
      {scene.trouble.value !== "" && <p role="alert">{scene.trouble.value}</p>}
      {insecure.value && (
        <p role="status">
          {texts.insecure} <button type="button" onClick={() => { insecure.value = false; }}>{texts.dismiss}</button>
        </p>
      )}
    </div>
  );
}
