/** The three gears as buttons. */

import type { Driving } from "../../driving/driving";
import { GEARS } from "../../operating_data";
import { drivingTexts as texts } from "../../texts/driving";
import { press } from "./press";

export function GearSwitch({ driving }: { readonly driving: Driving }) {
  return (
    <div class="driving-gears" role="group" aria-label={texts.gears}>
      {GEARS.map(({ gear, name, meaning }, i) => (
        <button
          type="button"
          key={gear}
          title={texts.gearHint(meaning, i + 1)}
          aria-pressed={driving.gear.value === gear}
          {...press(() => { driving.gear.value = gear; })}
        >
          {name}
        </button>
      ))}
    </div>
  );
}
