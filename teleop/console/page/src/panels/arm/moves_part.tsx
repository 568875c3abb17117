/** Planned moves: named poses and the ghost as goals, the way that is shown, and the button that is held to go it. */

import type { Arm, KnownArm } from "../../arm/arm";
import type { EndedMove, PendingMove } from "../../arm/goals/move_control";
import { armTexts as texts } from "../../texts/arm";
import { press } from "../driving/press";
import { HoldButton } from "../hold_button";

export function MovesPart({ arm, known }: { readonly arm: Arm; readonly known: KnownArm }) {
  const { moved, hold } = arm;
  const { picture, taught, info } = known;
  const [pending, placed, may] = [moved.pending.value, picture.placed.value, arm.mayMove.value];
  // Positions that are gone through go on as the button stays held; any other way is shown first.
  const goesOn = taught.running.value !== undefined && (taught.running.value > 0 || pending === undefined);
  const ask = (title: string, goal: Parameters<typeof moved.ask>[1]): void => {
    taught.stop();
    moved.ask(title, goal, (well) => {
      if (well) {
        picture.forget();
      }
    });
  };
  return (
    <fieldset class="arm-moves">
      <legend>{texts.poses}</legend>
      <div class="panel-buttons">
        {info.poses.map(({ name }) => (
          <button
            key={name} type="button" disabled={!may} aria-label={texts.pose(name)}
            {...press(() => { ask(texts.pose(name), { name }); })}
          >
            {name}
          </button>
        ))}
      </div>
      {placed !== undefined && (
        <div class="panel-buttons">
          <button type="button" disabled={!may} {...press(() => { ask(texts.ghostMove, { pose: placed }); })}>{texts.toGhost}</button>
          <button type="button" {...press(() => { picture.forget(); })}>{texts.forgetGhost}</button>
        </div>
      )}
      <p role="status" class="arm-move" data-grade={gradeOf(pending, moved.last.value)}>{wordsOf(pending, moved.last.value)}</p>
      <div class="panel-buttons arm-go">
        <HoldButton
          kind="panel-primary" disabled={!goesOn && (pending === undefined || pending.state === "planning")}
          begin={() => { hold.begin("button", () => ({ kind: "plan", confirmed: true })); }} end={() => { hold.end("button"); }}
        >
          {texts.hold}
        </HoldButton>
        <button type="button" disabled={pending === undefined} {...press(() => { taught.stop(); moved.stop(); })}>{texts.giveUp}</button>
      </div>
      {pending !== undefined && pending.path.length > 0 && <p class="panel-quiet">{texts.holdHint}</p>}
    </fieldset>
  );
}

/** Return what the panel says of a move under way, else of the last one. */
export function wordsOf(pending: PendingMove | undefined, last: EndedMove | undefined): string {
  if (pending !== undefined) {
    const { title, state, share } = pending;
    return state === "planning" ? texts.planning(title) : state === "moving" ? texts.moving(title, share) : texts.waiting(title);
  }
  return last === undefined ? texts.noMove : texts.ended(last.title, last.end.outcome, last.end.message);
}

function gradeOf(pending: PendingMove | undefined, last: EndedMove | undefined): string | undefined {
  return pending !== undefined || last === undefined ? undefined : last.end.outcome === "done" ? "green" : "amber";
}
