/** Positions that were taught: kept, gone through, forgotten. */

import type { Arm, KnownArm } from "../../arm/arm";
import { armTexts as texts } from "../../texts/arm";
import { press } from "../driving/press";

export function TaughtPart({ arm, known: { taught } }: { readonly arm: Arm; readonly known: KnownArm }) {
  const [positions, running, may] = [taught.positions.value, taught.running.value, arm.mayMove.value];
  const state = arm.feed.state.value;
  return (
    <div class="arm-taught">
      {positions.length === 0 && <p class="panel-quiet">{texts.noPositions}</p>}
      <ol>
        {positions.map(({ opening }, at) => (
          <li key={at} aria-current={running === at ? "step" : undefined}>
            <span>{texts.position(at + 1)}, {texts.positionWords(opening)}</span>
            <button type="button" aria-label={texts.forget(at + 1)} {...press(() => { taught.forget(at); })}>{texts.forgetMark}</button>
          </li>
        ))}
      </ol>
      <div class="panel-buttons">
        <button type="button" disabled={state === undefined} {...press(() => { if (state !== undefined) { taught.teach(state); } })}>
          {texts.teach}
        </button>
        <button type="button" disabled={!may || positions.length === 0} {...press(() => { taught.replay(); })}>{texts.replay}</button>
      </div>
    </div>
  );
}
