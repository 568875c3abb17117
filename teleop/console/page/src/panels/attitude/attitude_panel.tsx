/** Roll and pitch, as an artificial horizon and in degrees. */

import { tiltOf } from "../../alarms/alarm_facts";
import { limitOf } from "../../alarms/alarm_rules";
import type { RobotState } from "../../robot/robot_state";
import { attitudeTexts as texts, panelTexts } from "../../texts/panels";
import type { Attitude } from "../../values";
import { Panel, Row } from "../panel";
import { MaybeStale, staleness } from "../staleness";
import { useNow } from "../use_now";

/** Degrees of pitch from the middle of the horizon to its edge. */
const RANGE = 30;
const RADIUS = 50;

export function AttitudePanel({ state }: { state: RobotState }) {
  const now = useNow();
  const attitude = state.attitude.value;
  const { stale } = staleness(attitude?.receivedAt, now);
  const known = attitude !== undefined && !stale && Number.isFinite(attitude.roll) && Number.isFinite(attitude.pitch);
  const grade = known ? tiltGrade(attitude) : "unknown";
  return (
    <Panel title={texts.title} name="attitude">
      <MaybeStale receivedAt={attitude?.receivedAt} now={now}>
        <div class="panel-attitude" data-grade={grade}>
          <Horizon attitude={known ? attitude : undefined} />
          <dl class="panel-rows">
            <Row name={texts.roll}>
              <span title={texts.rollMeaning}>{known ? texts.degrees(attitude.roll) : panelTexts.unknown}</span>
            </Row>
            <Row name={texts.pitch}>
              <span title={texts.pitchMeaning}>{known ? texts.degrees(attitude.pitch) : panelTexts.unknown}</span>
            </Row>
          </dl>
        </div>
        {attitude !== undefined && <p class="panel-quiet">{texts.source(attitude.source)}</p>}
      </MaybeStale>
    </Panel>
  );
}

/** Return the colour of a tilt, by the alarms' limits. */
export function tiltGrade({ roll, pitch }: Pick<Attitude, "roll" | "pitch">): "unknown" | "green" | "amber" | "red" {
  const tilt = tiltOf(roll, pitch);
  if (tilt === undefined) {
    return "unknown";
  }
  const degrees = (tilt * 180) / Math.PI;
  return degrees > limitOf("tipping") ? "red" : degrees > limitOf("tilt") ? "amber" : "green";
}

/**
 * Return how the horizon lies, for SVG: as seen by somebody who sits in the robot. With its left side up it sees the
 * horizon turned left; with its nose down, higher.
 */
export function horizonTransform({ roll, pitch }: Pick<Attitude, "roll" | "pitch">): string {
  const degrees = 180 / Math.PI;
  const shift = Math.max(-RADIUS, Math.min(RADIUS, -pitch * degrees * (RADIUS / RANGE)));
  return `rotate(${(-roll * degrees).toFixed(2)}) translate(0 ${shift.toFixed(2)})`;
}

function Horizon({ attitude }: { attitude: Attitude | undefined }) {
  const label = attitude === undefined
    ? texts.unknownHorizon
    : texts.horizon(texts.degrees(attitude.roll), texts.degrees(attitude.pitch));
  return (
    <svg class="panel-horizon" viewBox="-52 -52 104 104" role="img" aria-label={label}>
      <clipPath id="panel-horizon-clip"><circle r={RADIUS} /></clipPath>
      <g clip-path="url(#panel-horizon-clip)">
        {attitude === undefined
          ? <circle class="panel-horizon-unknown" r={RADIUS} />
          : (
            <g transform={horizonTransform(attitude)}>
              <rect class="panel-horizon-sky" x="-150" y="-200" width="300" height="200" />
              <rect class="panel-horizon-ground" x="-150" y="0" width="300" height="200" />
              <line class="panel-horizon-line" x1="-150" x2="150" y1="0" y2="0" />
              {[-20, -10, 10, 20].map((degrees) => (
                <line key={degrees} class="panel-horizon-step" x1="-12" x2="12"
                  y1={(degrees * RADIUS) / RANGE} y2={(degrees * RADIUS) / RANGE} />
              ))}
            </g>
          )}
      </g>
      {attitude === undefined && <text class="panel-horizon-mark" text-anchor="middle" y="8">?</text>}
      <path class="panel-horizon-robot" d="M-34 0H-14L-8 7M34 0H14L8 7M-2 0H2" />
      <circle class="panel-horizon-rim" r={RADIUS} />
    </svg>
  );
}
