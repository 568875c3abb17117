/** Gathers what the alarms follow from. */

import { stoppedBy } from "../driving/robot_reasons";
import { turnsOf } from "../driving/turn_taking";
import { STALE_AFTER } from "../operating_data";
import type { LinkStatistics, RobotState } from "../robot/robot_state";
import type { Facts } from "../texts/filled";
import { linkPanelTexts } from "../texts/panels";
import type { Bumpers } from "../values";
import { linkWord } from "./link_grade";

/**
 * Return the facts at a time, read from the state without subscribing; times in seconds, angles in degrees.
 *
 * @param now Time of the page's clock [ms].
 * @param heardAt When anything of the robot last arrived [ms]; undefined if nothing has.
 * @param wasConnected Whether there was ever a connection: before the first one there is nothing to lose.
 */
export function alarmFacts(
  state: RobotState,
  link: LinkStatistics | undefined,
  now: number,
  heardAt: number | undefined,
  wasConnected: boolean,
): Facts {
  const connection = state.connection.peek();
  const connected = connection.phase === "open";
  const status = state.status.peek();
  const control = state.control.peek();
  const attitude = state.attitude.peek();
  return {
    connected,
    was_connected: wasConnected,
    why: connection.words,
    offline: (now - connection.sinceAt) / 1000,
    silence: heardAt === undefined ? undefined : (now - Math.max(heardAt, connection.sinceAt)) / 1000,
    link: link === undefined ? "unknown" : linkWord(connected, link),
    link_figures: link === undefined ? "" : linkPanelTexts.summary(link.roundTrip, link.jitter),
    health: status?.health,
    // The first clause of the first reason: the whole ones stand in the panel of the place.
    reason: status?.reasons[0]?.split(";")[0],
    estop: control?.estop,
    guard_off_by: control?.guardOffBy,
    blocked: blockedFor(state, now),
    ...bumpFacts(state.bumpers.peek(), now),
    drive_level: state.driveTrouble.peek()?.level,
    drive_trouble: state.driveTrouble.peek()?.words,
    ...stopFacts(control?.reason ?? "", state.session.peek()?.name),
    ...(attitude === undefined || now - attitude.receivedAt > STALE_AFTER ? {} : tiltFacts(attitude.roll, attitude.pitch)),
    asking: turnsOf(control, state.session.peek()).askedBy || undefined,
  };
}

/** Return for how long the robot has stood though it is asked to move [s]; undefined if it moves or that is old. */
export function blockedFor(state: RobotState, now: number): number | undefined {
  const since = state.blockedSince.peek();
  const seenAt = state.motion.peek()?.receivedAt ?? -Infinity;
  return since === undefined || now - seenAt > STALE_AFTER ? undefined : (now - since) / 1000;
}

/** Return where the bumpers were pressed last, and how long ago [s]. */
export function bumpFacts(bumpers: Bumpers | undefined, now: number): Facts {
  if (bumpers === undefined) {
    return {};
  }
  const sides = [sideWords("in front", bumpers.front), sideWords("behind", bumpers.rear)].filter((words) => words !== "");
  return sides.length === 0 ? {} : { bump: sides.join(" and "), bump_age: (now - bumpers.receivedAt) / 1000 };
}

function sideWords(name: string, ring: readonly boolean[]): string {
  const pressed = ring.flatMap((isPressed, index) => (isPressed ? [index] : []));
  if (pressed.length === 0) {
    return "";
  }
  const aside = (ring.length - 1) / 2 - pressed.reduce((sum, index) => sum + index, 0) / pressed.length;
  return Math.abs(aside) < 0.75 ? name : `${name}, ${aside > 0 ? "left" : "right"}`;
}

/** Return who pressed the e-stop, or another reason of the robot. */
export function stopFacts(reason: string, me: string | undefined): Facts {
  const who = stoppedBy(reason);
  return who === undefined ? { estop_reason: reason } : { estop_by: who === me ? "you" : who };
}

/** Return the tilt and where to, of a roll and a pitch [rad]. */
export function tiltFacts(roll: number, pitch: number): Facts {
  const tilt = tiltOf(roll, pitch);
  const sideways = roll > 0 ? "to the right" : "to the left";
  return {
    tilt: tilt === undefined ? undefined : (tilt * 180) / Math.PI,
    tilt_direction: Math.abs(roll) > Math.abs(pitch) ? sideways : pitch > 0 ? "nose down" : "nose up",
  };
}

/** Return the angle between the robot's up and the vertical [rad] of a roll and a pitch [rad]. */
export function tiltOf(roll: number, pitch: number): number | undefined {
  const cosine = Math.cos(roll) * Math.cos(pitch);
  return Number.isFinite(cosine) ? Math.acos(Math.min(1, Math.max(-1, cosine))) : undefined;
}
