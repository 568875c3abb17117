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
          <meter min={-1} max={1} value={Number.isFinite(value) ? value : 0}>{value.toFixed(2)}</meter>
        </label>
      ))}
      <p>{pressed.join(", ")}</p>
    </div>
  );
}
