/** What this page is, and what it is made of. */

import { aboutTexts as texts } from "../../texts/panels";
import { Dialog } from "../dialog";

export function AboutDialog(
  { version, open, onClose, keys = [] }:
  { version: string; open: boolean; onClose: () => void; keys?: readonly string[] },
) {
  return (
    <Dialog title={texts.title} open={open} onClose={onClose}>
      <p>{texts.version(version)}</p>
      <p>{texts.what}</p>
      <p>{texts.tried}</p>
      {keys.length > 0 && (
        <>
          <h3>{texts.keys}</h3>
          <ul>{keys.map((line) => <li key={line}>{line}</li>)}</ul>
        </>
      )}
      <p><a href="/console/licences.txt" target="_blank" rel="noopener">{texts.licences}</a></p>
    </Dialog>
  );
}
