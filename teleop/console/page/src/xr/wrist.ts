/** What is told on the wrist, in the console's own words: states, alarms, speed and delays. */

import { dataAge } from "../robot/data_age";
import { turnsOf } from "../driving/turn_taking";
import type { Alarm } from "../alarms/alarm";
import type { Driving } from "../driving/driving";
import { HEALTH } from "../operating_data";
import type { LinkStatisticsSignal, RobotState } from "../robot/robot_state";
import { cameraTexts } from "../texts/camera";
import { drivingTexts } from "../texts/driving";
import { linkPanelTexts } from "../texts/panels";
import { xrTexts as texts } from "../texts/xr";
import type { CameraFeed } from "../camera/camera_feed";
import type { Row } from "./board";

/** Alarms that are told; the gravest come first. */
const MOST_ALARMS = 2;
/** The driving loop looks at the hand so often, and the robot takes commands so often [ms]. */
const LOOK = 16;
const TICK = 20;

export interface WristParts {
  readonly state: RobotState;
  readonly driving: Driving;
  readonly statistics: LinkStatisticsSignal;
  readonly alarms: readonly Alarm[];
}

/** Times of the headset's frames [ms]. */
export interface FrameClock {
  /** From one to the next. */
  readonly interval: number;
  /** From the head's pose to its picture; NaN where the browser does not say. */
  readonly display: number;
}

/** Return the rows of the wrist's board. */
export function wristRows({ state, driving, alarms }: WristParts, clock: FrameClock, now: number): Row[] {
  const { words, remedy, tone, will } = driving.status.peek();
  const health = state.status.peek()?.health;
  const speed = drivingTexts.speedFigure(state.motion.peek()?.linear);
  const cloud = state.cloud.peek();
  return [
    ...alarms.slice(0, MOST_ALARMS).map((alarm) => ({ words: alarm.words, bad: alarm.severity === "alarm" })),
    { words, bad: tone === "bad" },
    // What the page says of keys and sticks on the screen does not help here.
    ...(remedy === "" ? [] : [{ words: will ? texts.help : remedy }]),
    { words: `${health === undefined ? drivingTexts.unknown : HEALTH[health].words} · ${speed} m/s` },
    { words: texts.delays(handToWheels(state, clock), clock.display, cloud && now - cloud.receivedAt) },
  ];
}

/**
 * Return the time from the hand to the wheels [ms]: a frame and a look of the driving loop, both on average half waited for,
 * the age that the robot finds our commands to have, and its tick. Undefined while this page does not drive.
 */
export function handToWheels(state: RobotState, { interval }: FrameClock): number | undefined {
  const control = state.control.peek();
  const mine = turnsOf(control, state.session.peek()).driver === "me";
  return control === undefined || !mine ? undefined : (interval + LOOK) / 2 + 1000 * control.linkAge + TICK;
}

/** Return the caption of the camera's picture. */
export function captionRows(feed: CameraFeed, { state, statistics }: Pick<WristParts, "state" | "statistics">, now: number): Row[] {
  const picture = feed.picture.peek();
  if (picture === undefined) {
    return [];
  }
  const { age, lowerBound } = dataAge(picture, state, statistics.peek().roundTrip, now);
  return [{ words: `${feed.chosen.peek()?.name ?? ""} · ${cameraTexts.age(linkPanelTexts.ageWords(age), lowerBound)}` }];
}
