/** What the page sends, what the robot does, and why it does not. */

import type { Driving } from "../../driving/driving";
import { inOurWords } from "../../driving/robot_reasons";
import type { RobotState } from "../../robot/robot_state";
import { drivingTexts as texts } from "../../texts/driving";
import type { DrivingProps } from "./driving_props";
import { panelTexts } from "../../texts/panels";
import { staleness } from "../staleness";
import { useNow } from "../use_now";
import { PlainWarning } from "./plain_warning";

export function DrivingPanel({ driving, state }: DrivingProps) {
  const { words, remedy, tone } = driving.status.value;
  const { age, stale } = staleness(state.controlAt.value, useNow());
  const old = stale && Number.isFinite(age);
  return (
    <section class="driving-panel" aria-label={texts.title}>
      <div class={`driving-status driving-${tone}`} role="status">
        <strong>{words}</strong> {remedy !== "" && <span>{remedy}</span>}
      </div>
      <PlainWarning driving={driving} state={state} />
      <dl class="driving-facts">
        <dt>{texts.pageSends}</dt>
        <dd>{sentWords(driving)}</dd>
        <dt>{texts.robotDoes}</dt>
        <dd class={old ? "panel-stale" : ""}>{robotWords(state)}{old && ` (${panelTexts.old(age)})`}</dd>
      </dl>
    </section>
  );
}

function sentWords(driving: Driving): string {
  const sending = driving.sending.value;
  if (sending === undefined) {
    return texts.nothing;
  }
  const gear = texts.gear(sending.turbo ? "turbo" : driving.gear.value);
  return `${texts.motion(sending.forward, sending.turn)} · ${gear} · ${texts.by(texts.source[sending.source])}`;
}

function robotWords(state: RobotState): string {
  const control = state.control.value;
  if (control === undefined || state.connection.value.phase !== "open") {
    return texts.unknown;
  }
  const { linear, angular } = control;
  const moves = Math.abs(linear) >= 0.005 || Math.abs(angular) >= 0.005;
  return moves
    ? texts.velocity(linear, angular)
    : `${texts.standstill} (${inOurWords(control.reason, state.session.value?.name)})`;
}
