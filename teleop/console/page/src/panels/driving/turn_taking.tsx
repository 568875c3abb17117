/** Who drives, and how the robot changes hands. */

import type { Driving } from "../../driving/driving";
import type { Turns } from "../../driving/turn_taking";
import { drivingTexts as texts } from "../../texts/driving";
import { press } from "./press";

export function TurnTaking({ driving }: { readonly driving: Driving }) {
  const { turns: taking } = driving;
  const turns = taking.turns.value;
  return (
    <section class="driving-turns" aria-label={texts.turns}>
      <p role="status">{driverWords(turns)}</p>
      {turns.waiting && <p role="status">{texts.waiting}</p>}
      {turns.askedBy !== "" && (
        <div class="driving-asked" role="alert">
          <p>{texts.asks(turns.askedBy)}</p>
          <button type="button" {...press(() => { driving.stop(); void taking.request("give"); })}>{texts.give}</button>
          <button type="button" {...press(() => { void taking.request("refuse"); })}>{texts.refuse}</button>
        </div>
      )}
      {turns.mayAsk && <button type="button" {...press(() => { void taking.request("ask"); })}>{texts.ask}</button>}
      {turns.driver === "other" && turns.mayTakeOver && (
        <button type="button" {...press(() => { void taking.request("takeOver"); })}>{texts.takeOver}</button>
      )}
      <p role="status" class="driving-outcome">{taking.outcome.value}</p>
    </section>
  );
}

function driverWords(turns: Turns): string {
  const words = { nobody: texts.nobodyDrives, me: texts.youDrive, other: texts.drives(turns.name) };
  return words[turns.driver];
}
