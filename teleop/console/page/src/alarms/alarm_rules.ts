/** Which alarms follow from what is known. */

import { alarmTexts } from "../texts/alarms";
import type { Severity } from "../values";
import type { Alarm, AlarmFacts, AlarmKind } from "./alarm";

const RADIANS = Math.PI / 180;

/** Tilt that is worth a warning [rad]: more than any ramp indoors has (6 %, 3.4 degrees), and what stations warn at. */
export const TILT_WARNING = 8 * RADIANS;

/**
 * Tilt that is an alarm before the robot tips over [rad]: it tips over its wheels at about 50 degrees, from a step of
 * 10 cm backwards, so 15 leave time to drive back. A ramp of 35 %, 19 degrees, which it climbs, alarms as well.
 */
export const TILT_ALARM = 15 * RADIANS;

/** A tilt alarm ends this much below where it began [rad], so that it does not chatter on rough ground. */
export const TILT_HYSTERESIS = 1 * RADIANS;

/** What is older is shown as old [ms]. */
export const STALE_AFTER = 500;

/**
 * Return the alarms, the gravest first.
 *
 * @param active Kinds that are active already; they end a little later than they begin.
 */
export function alarmsOf(facts: AlarmFacts, active: ReadonlySet<AlarmKind> = new Set()): readonly Alarm[] {
  const found: Alarm[] = [];
  const add = (kind: AlarmKind, severity: Severity, words: string): void => {
    found.push({ kind, severity, words });
  };
  // The first clause of the first reason: the whole ones stand in the panel of the place.
  const reason = facts.reasons[0]?.split(";")[0] ?? "";
  if (facts.estop) {
    add("estop", "alarm", alarmTexts.estop(facts.estopReason));
  }
  const tilt = facts.tilt ?? 0;
  const exceeds = (kind: AlarmKind, limit: number): boolean => tilt > limit - (active.has(kind) ? TILT_HYSTERESIS : 0);
  if (exceeds("tipping", TILT_ALARM)) {
    add("tipping", "alarm", alarmTexts.tipping(tilt / RADIANS));
  }
  const stale = facts.silence !== undefined && facts.silence > STALE_AFTER;
  if (!facts.connected && facts.wasConnected) {
    add("connection", "alarm", alarmTexts.connection(facts.connectionWords));
  } else if (facts.connected && stale) {
    add("stale", "alarm", alarmTexts.stale(facts.silence));
  }
  if (facts.health === "lost") {
    add("lost", "alarm", alarmTexts.lost(reason));
  } else if (facts.health === "suspect") {
    add("suspect", "warning", alarmTexts.suspect(reason));
  } else if (facts.health === "relocalising") {
    add("searching", "info", alarmTexts.searching(reason));
  }
  if (exceeds("tilt", TILT_WARNING) && found.every((alarm) => alarm.kind !== "tipping")) {
    add("tilt", "warning", alarmTexts.tilt(tilt / RADIANS));
  }
  if (facts.connected && !stale && (facts.link === "bad" || facts.link === "lost")) {
    add("link", "warning", alarmTexts.link(facts.linkWords));
  }
  if (facts.asking !== undefined) {
    add("asking", "info", alarmTexts.asking(facts.asking));
  }
  return ORDER.flatMap((severity) => found.filter((alarm) => alarm.severity === severity));
}

const ORDER: readonly Severity[] = ["alarm", "warning", "info"];
