/** Where the robot believes to be, how sure it is, and why. */

import { HEALTH } from "../../operating_data";
import type { RobotState } from "../../robot/robot_state";
import { headingOf } from "../../scene/geometry";
import { hintTexts } from "../../texts/hint";
import { localizationTexts as texts, panelTexts } from "../../texts/panels";
import { Panel, Row } from "../panel";
import { MaybeStale, staleness } from "../staleness";
import { useArrival } from "../use_arrival";
import { useNow } from "../use_now";

/** Whether the robot knows its place, for the page's bar. */
export function HealthLamp({ state }: { state: RobotState }) {
  const now = useNow();
  const health = state.status.value?.health;
  const old = staleness(useArrival(state.status), now).stale;
  if (health === undefined) {
    return null;
  }
  return (
    <span class="panel-lamp" data-grade={old ? "unknown" : HEALTH[health].colour}>
      <span class="panel-lamp-mark" aria-hidden="true" />
      {old ? texts.oldHealth(HEALTH[health].words) : HEALTH[health].words}
    </span>
  );
}

/** Sigmas and fit belong to a pose: without one the robot reports zeros, which are not shown. */
export function LocalizationPanel({ state }: { state: RobotState }) {
  const now = useNow();
  const status = state.status.value;
  const pose = state.mapFromBase.value;
  const receivedAt = useArrival(state.status);
  const placed = !staleness(pose?.receivedAt, now).stale;
  const degrees = pose === undefined ? 0 : (headingOf(pose.orientation) * 180) / Math.PI;
  return (
    <Panel title={texts.title} name="localization">
      <MaybeStale receivedAt={receivedAt} now={now}>
        <p class="panel-health" data-grade={status === undefined ? "unknown" : HEALTH[status.health].colour}>
          {status === undefined ? panelTexts.unknown : HEALTH[status.health].words}
        </p>
        {status !== undefined && status.reasons.length > 0 && (
          <ul class="panel-reasons">{status.reasons.map((reason) => <li key={reason}>{reason}</li>)}</ul>
        )}
        <dl class="panel-rows">
          <Row name={texts.pose}>
            {pose === undefined
              ? panelTexts.unknown
              : (
                <MaybeStale receivedAt={pose.receivedAt} now={now}>
                  {hintTexts.pose(pose.position.x, pose.position.y, degrees)}
                </MaybeStale>
              )}
          </Row>
          <Row name={texts.position}>
            <span title={texts.sigma}>{texts.metres(placed ? status?.positionSigma ?? NaN : NaN)}</span>
          </Row>
          <Row name={texts.heading}>
            <span title={texts.sigma}>{texts.degrees(placed ? status?.headingSigma ?? NaN : NaN)}</span>
          </Row>
          <Row name={texts.fit}>{texts.share(placed ? status?.fit ?? NaN : NaN)}</Row>
        </dl>
      </MaybeStale>
    </Panel>
  );
}
