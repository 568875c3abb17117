/** The gripper: open, close, with how much force, and what it holds. */

import type { Arm } from "../../arm/arm";
import { armTexts as texts } from "../../texts/arm";
import { press } from "../driving/press";

export function GripperPart({ arm }: { readonly arm: Arm }) {
  const { gripper, feed } = arm;
  const [info, state, doing, effort] = [feed.info.value, feed.state.value, gripper.doing.value, gripper.effort.value];
  const may = arm.mayMove.value;
  const failed = doing?.moving === false && "failed" in doing ? doing.failed : undefined;
  return (
    <fieldset class="arm-gripper">
      <legend>{texts.gripper}</legend>
      <div class="panel-buttons">
        <button type="button" disabled={!may} {...press(() => { gripper.open(); })}>{texts.open}</button>
        <button type="button" disabled={!may} {...press(() => { gripper.close(); })}>{texts.close}</button>
        <label class="arm-force">
          <span>{texts.force}</span>
          <input
            type="range" min={0.1} max={1} step={0.05} value={effort}
            onInput={({ currentTarget }) => { gripper.effort.value = Number(currentTarget.value); }}
          />
          <output>{texts.newtons(effort * (info?.force ?? 0))}</output>
        </label>
      </div>
      <p role="status" data-grade={failed !== undefined ? "red" : state?.holding === true ? "green" : undefined}>
        {failed !== undefined ? texts.gripFailed(failed) : state && texts.jaws(state.opening, state.holding, state.gripForce)}
      </p>
    </fieldset>
  );
}
