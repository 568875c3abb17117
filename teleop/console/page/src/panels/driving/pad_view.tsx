/** What a gamepad does at the moment: a bar for each axis, a lamp for each button. */

import type { PadSnapshot } from "../../driving/mapping_capture";
import { drivingTexts as texts } from "../../texts/driving";

export function PadView({ now }: { readonly now: PadSnapshot }) {
  const pressed = now.buttons.flatMap((down, button) => (down ? [texts.mappingButton(button)] : []));
  return (
    <div class="driving-pad-view" role="group" aria-label={texts.mappingLive}>
      {now.axes.map((value, axis) => (
        <label key={axis}>
          {texts.mappingAxisName(axis)}
          <progress max={2} value={Number.isFinite(value) ? 1 + value : 1}>{value.toFixed(2)}</progress>
        </label>
      ))}
      <p>{pressed.join(", ")}</p>
    </div>
  );
}
