/** Which alarms follow from what is known, by the rules that the station follows too. */

import { ALARM_RULES, type Condition } from "../operating_data";
import { filled, known, type Facts } from "../texts/filled";
import type { Severity } from "../values";
import type { Alarm } from "./alarm";

/**
 * Return the alarms, the gravest first.
 *
 * @param active Kinds that are active already; some end a little later than they begin.
 */
export function alarmsOf(facts: Facts, active: ReadonlySet<string> = new Set()): readonly Alarm[] {
  const groups = new Set<string>();
  const found: Alarm[] = [];
  for (const { kind, group = kind, severity, when, words } of ALARM_RULES) {
    if (!groups.has(group) && when.every((condition) => meets(condition, facts[condition.fact], active.has(kind)))) {
      groups.add(group);
      found.push({ kind, severity, words: filled(words, facts) });
    }
  }
  return ORDER.flatMap((severity) => found.filter((alarm) => alarm.severity === severity));
}

function meets({ is, above, ends, below }: Condition, value: Facts[string], active: boolean): boolean {
  if (value === undefined || !known(value)) {
    return false;
  }
  if (is !== undefined) {
    return typeof value !== "number" && is.includes(value);
  }
  if (above !== undefined) {
    return Number(value) > (active ? ends ?? above : above);
  }
  return below === undefined || Number(value) < below;
}

const ORDER: readonly Severity[] = ["alarm", "warning", "info"];

/** Return the limit from which an alarm is active [as its fact]. */
export function limitOf(kind: string): number {
  return ALARM_RULES.find((rule) => rule.kind === kind)?.when.find(({ above }) => above !== undefined)?.above ?? Infinity;
}
