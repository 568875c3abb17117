/** The emergency stop, always on screen, and its release, which asks once. */

import { useEffect, useRef } from "preact/hooks";
import type { Driving } from "../../driving/driving";
import { drivingTexts as texts } from "../../texts/driving";
import type { DrivingProps } from "./driving_props";

export function EstopButton({ driving, state }: DrivingProps) {
  const latched = state.control.value?.estop === true;
  const { pending, resetAsked, resetRefused } = driving.estop;
  const mayReset = state.session.value?.mayReset !== false;
  return (
    <div class="driving-estop">
      <button
        type="button"
        class={`driving-estop-button${latched ? " driving-latched" : ""}`}
        aria-label={latched ? texts.estopLatchedLabel : texts.estopLabel}
        aria-pressed={latched}
        data-stops=""
        // At once when it is touched; the click is for keys and assistive technology, and to stop twice does no harm.
        onPointerDown={() => { driving.emergencyStop(); }}
        onClick={() => { driving.emergencyStop(); }}
      >
        {latched ? texts.estopLatched : texts.estop}
      </button>
      <div role="alert" class="driving-estop-words">
        {pending.value !== undefined && <p>{pendingWords(driving)}</p>}
        {resetRefused.value !== undefined && <p>{texts.releaseRefused(resetRefused.value)}</p>}
      </div>
      {latched && mayReset && !resetAsked.value && (
        <button type="button" onClick={() => { driving.estop.askReset(); }}>{texts.release}</button>
      )}
      {latched && resetAsked.value && <ReleaseQuestion driving={driving} />}
    </div>
  );
}

function ReleaseQuestion({ driving }: { readonly driving: Driving }) {
  const keep = useRef<HTMLButtonElement>(null);
  useEffect(() => { keep.current?.focus(); }, []);
  return (
    <div class="driving-release" role="alertdialog" aria-label={texts.release} aria-describedby="driving-release-question">
      <p id="driving-release-question">{texts.releaseQuestion}</p>
      <button type="button" onClick={() => { void driving.estop.confirmReset(); }}>{texts.releaseYes}</button>
      <button type="button" ref={keep} onClick={() => { driving.estop.cancelReset(); }}>{texts.releaseNo}</button>
    </div>
  );
}

function pendingWords(driving: Driving): string {
  const pending = driving.estop.pending.value;
  if (pending === undefined) {
    return "";
  }
  return pending.refusal === ""
    ? texts.estopPending((driving.now() - pending.sinceAt) / 1000)
    : texts.estopRefused(pending.refusal);
}
