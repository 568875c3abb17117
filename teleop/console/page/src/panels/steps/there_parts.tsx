/** "Drive there": a switch that lets presses on the picture choose a place, and a button that is held to drive to it. */

import type { Driving } from "../../driving/driving";
import type { DriveThere } from "../../steps/drive_there";
import { stepTexts as texts } from "../../texts/steps";
import { HoldButton } from "../hold_button";

export function ThereSwitch({ there }: { readonly there: DriveThere }) {
  const choosing = there.choosing.value;
  return (
    <div class="panel">
      <button type="button" class="steps-there" aria-pressed={choosing} onClick={() => { there.choosing.value = !choosing; }}>{texts.there}</button>
    </div>
  );
}

interface HoldProps {
  readonly there: DriveThere;
  readonly driving: Driving;
}

/** Over the picture, while a place is chosen. */
export function ThereHold({ there, driving }: HoldProps) {
  if (!there.choosing.value) {
    return null;
  }
  const why = there.refusal(driving.status.value);
  return (
    <div class="panel steps-hold">
      <HoldButton disabled={why !== undefined} begin={() => { there.hold(); }} end={() => { there.letGo(); }}>{texts.thereHold}</HoldButton>
      {why !== undefined && <p role="status" class="panel-quiet">{why}</p>}
    </div>
  );
}
