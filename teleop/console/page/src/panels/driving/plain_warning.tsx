/** The question that comes before driving a robot that nothing guards. */

import { drivingTexts as texts } from "../../texts/driving";
import type { DrivingProps } from "./driving_props";

export function PlainWarning({ driving, state }: DrivingProps) {
  if (state.dialect.value !== "plain" || driving.plainConfirmed.value) {
    return null;
  }
  return (
    <div class="driving-plain" role="group" aria-label={texts.plainQuestion}>
      <p>{texts.plainQuestion}</p>
      <button type="button" onClick={() => { driving.confirmPlain("velocity"); }}>{texts.plainVelocity}</button>
      <button type="button" onClick={() => { driving.confirmPlain("joy"); }}>{texts.plainJoy}</button>
    </div>
  );
}
