/** Gathers what the alarms follow from. */

import type { LinkStatistics, RobotState } from "../robot/robot_state";
import { alarmTexts } from "../texts/alarms";
import { linkPanelTexts } from "../texts/panels";
import type { ControlState, Session } from "../values";
import type { AlarmFacts } from "./alarm";
import { STALE_AFTER } from "./alarm_rules";
import { linkWord } from "./link_grade";

/** An attitude older than this says nothing about now [ms]. */
const ATTITUDE_HOLDS = STALE_AFTER;

/**
 * Return the facts at a time, read from the state without subscribing.
 *
 * @param now Time of the page's clock [ms].
 * @param heardAt When anything of the robot last arrived [ms]; undefined if nothing has.
 */
export function alarmFacts(
  state: RobotState,
  link: LinkStatistics | undefined,
  now: number,
  heardAt: number | undefined,
  wasConnected: boolean,
): AlarmFacts {
  const connection = state.connection.peek();
  const connected = connection.phase === "open";
  const status = state.status.peek();
  const control = state.control.peek();
  const attitude = state.attitude.peek();
  const word = link === undefined ? "unknown" : linkWord(connected, link);
  return {
    connected,
    connectionWords: connection.words,
    wasConnected,
    silence: heardAt === undefined ? undefined : now - Math.max(heardAt, connection.sinceAt),
    health: status?.health,
    reasons: status?.reasons ?? [],
    estop: control?.estop ?? false,
    estopReason: pressedBy(control?.reason ?? "", state.session.peek()?.name),
    tilt: attitude === undefined || now - attitude.receivedAt > ATTITUDE_HOLDS
      ? undefined
      : tiltOf(attitude.roll, attitude.pitch),
    link: word,
    linkWords: link === undefined ? "" : linkPanelTexts.summary(link.roundTrip, link.jitter),
    asking: askingUs(control, state.session.peek()),
  };
}

/** Return who pressed the e-stop, in words; another reason of the robot as it is. */
export function pressedBy(reason: string, me: string | undefined): string {
  const who = /^e-stop by (.{1,100})$/.exec(reason)?.[1];
  return who === undefined ? reason : alarmTexts.pressedBy(who === me ? undefined : who);
}

/** Return the angle between the robot's up and the vertical [rad] of a roll and a pitch [rad]. */
export function tiltOf(roll: number, pitch: number): number | undefined {
  const cosine = Math.cos(roll) * Math.cos(pitch);
  return Number.isFinite(cosine) ? Math.acos(Math.min(1, Math.max(-1, cosine))) : undefined;
}

/** Return who asks for the robot, if it is this page that drives it and can give it. */
export function askingUs(control: ControlState | undefined, session: Session | undefined): string | undefined {
  if (control === undefined || session === undefined || control.asking === 0 || control.asking === session.client) {
    return undefined;
  }
  const ours = control.controller === session.name
    || new RegExp(`\\bclient ${session.client}\\b`).test(control.controller);
  return ours ? (control.askingName === "" ? `client ${control.asking}` : control.askingName) : undefined;
}
