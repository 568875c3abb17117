/** What has changed between two sets of alarms, and what of it is to be heard. */

import { ALARM_RULES } from "../operating_data";
import type { Severity } from "../values";
import type { Alarm } from "./alarm";

export interface AlarmEdges {
  readonly raised: readonly Alarm[];
  readonly ended: readonly Alarm[];
}

/** Return which alarms began and which ended; one whose words alone changed did neither. */
export function alarmEdges(before: readonly Alarm[], after: readonly Alarm[]): AlarmEdges {
  return { raised: without(after, before), ended: without(before, after) };
}

function without(alarms: readonly Alarm[], others: readonly Alarm[]): readonly Alarm[] {
  const kinds = new Set(others.map((alarm) => alarm.kind));
  return alarms.filter((alarm) => !kinds.has(alarm.kind));
}

/** An alarm that comes and goes is heard once in this time [ms]. */
export const QUIET = 2000;

/** How often alarms are heard again while they last [ms]; most are not. */
const REPEATED: ReadonlyMap<string, number> = new Map(ALARM_RULES.map(({ kind, repeat }) => [kind, 1000 * (repeat ?? Infinity)]));

/** Decides which sound is due: the gravest of the alarms that began, or that are to be heard again. */
export class AlarmBell {
  private readonly heardAt = new Map<string, number>();

  /** Return the severity to sound now, if any. */
  due(edges: AlarmEdges, active: readonly Alarm[], now: number): Severity | undefined {
    const raised = new Set(edges.raised.map((alarm) => alarm.kind));
    const sounding = active.filter(({ kind }) => {
      const since = now - (this.heardAt.get(kind) ?? -Infinity);
      return raised.has(kind) ? since >= QUIET : since >= (REPEATED.get(kind) ?? Infinity) && this.heardAt.has(kind);
    });
    for (const { kind } of sounding) {
      this.heardAt.set(kind, now);
    }
    return (["alarm", "warning", "info"] as const).find((severity) => sounding.some((alarm) => alarm.severity === severity));
  }
}
