/**
 * What operators see and press, as data that the station reads too: `assets/operating/`.
 *
 * `README.md` there explains the forms.
 */

import layout from "../../../../assets/joysticks/default.json";
import alarms from "../../../../assets/operating/alarms.json";
import controls from "../../../../assets/operating/controls.json";
import words from "../../../../assets/operating/words.json";
import type { Health, HintVerdict, Severity } from "./values";

/** One condition of an alarm. A fact that is unknown or empty meets none; one that is only named has to be known. */
export interface Condition {
  readonly fact: string;
  readonly is?: readonly (boolean | string)[];
  readonly above?: number;
  /** Limit in place of `above` once the alarm is active. */
  readonly ends?: number;
  readonly below?: number;
}

export interface AlarmRule {
  readonly kind: string;
  /** Of a group only the first alarm that applies is active. */
  readonly group?: string;
  readonly severity: Severity;
  /** An alarm that lasts is heard again after this time [s]. */
  readonly repeat?: number;
  readonly when: readonly Condition[];
  readonly words: string;
}

export type Gear = "precision" | "normal" | "turbo";

interface GearData {
  readonly gear: Gear;
  readonly name: string;
  readonly meaning: string;
  readonly forward: number;
  readonly turn: number;
  readonly turbo: boolean;
}

/** A line of the list of keys, and what each of its keys is for. */
interface KeyData {
  readonly keys: string;
  readonly does: string;
  readonly only?: "page" | "station";
  readonly codes: Readonly<Record<string, string>>;
}

/** An axis of a gamepad; sign is +1 if forward (or left) is its positive end, else -1. */
export interface AxisUse {
  readonly axis: number;
  readonly sign: 1 | -1;
}

export type LinkWord = "unknown" | "good" | "slow" | "page" | "bad" | "lost";
export type Colour = "unknown" | "green" | "amber" | "red";

interface Named {
  readonly words: string;
  readonly colour: Colour;
}

export const ALARM_RULES = alarms.rules as readonly AlarmRule[];

/** What is older is shown as old [ms]. */
export const STALE_AFTER = 1000 * alarms.old;

/** Speeds from which the robot is asked to move, and below which it stands [m/s, rad/s], measured over a time [s]. */
export const HELD = alarms.held;

export const AGES = words.ages;
export const LINK = words.link;
export const LINK_WORDS = words.link.words as Readonly<Record<LinkWord, Named>>;
export const HEALTH = words.health as Readonly<Record<Health, Named>>;
export const VERDICTS: Readonly<Record<HintVerdict["verdict"], string>> = words.verdicts;

export const GEARS = controls.gears as readonly GearData[];
/** The standard mapping of a gamepad; its dead zone is a share of the whole deflection. */
export const GAMEPAD = {
  ...controls.gamepad,
  forward: controls.gamepad.forward as AxisUse,
  turn: controls.gamepad.turn as AxisUse,
};

/** Where a `sensor_msgs/Joy` has its axes and buttons. */
export const JOY_LAYOUT = layout;

/** The keys of the page. */
export const KEYS = (controls.keys as readonly KeyData[]).filter(({ only }) => only !== "station");
