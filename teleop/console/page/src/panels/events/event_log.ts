/** The page's list of events: what happened, when, and how often in a row. */

import { signal, type ReadonlySignal } from "@preact/signals";
import { eventTexts as texts } from "../../texts/panels";
import type { ConsoleEvent, Severity } from "../../values";

/** The oldest events are dropped beyond so many. */
export const MOST_EVENTS = 500;

/** Longer sentences are cut: words from the wire may be of any length. */
export const LONGEST_WORDS = 500;

/** Return the events with one more; the same sentence again counts up the last one, and gives it the new time. */
export function withEvent(
  events: readonly ConsoleEvent[],
  severity: Severity,
  words: string,
  time: Date,
): readonly ConsoleEvent[] {
  const text = words.length > LONGEST_WORDS ? `${words.slice(0, LONGEST_WORDS)}…` : words;
  const last = events.at(-1);
  if (last?.alarm === undefined && last?.words === text && last.severity === severity) {
    return [...events.slice(0, -1), { ...last, time, count: last.count + 1 }];
  }
  return [...events.slice(1 - MOST_EVENTS), { time, severity, words: text, count: 1 }];
}

/** An alarm that began so many lines before, or longer ago [ms], is another event. */
const SAME = { lines: 20, time: 600_000 };

/** Return the events with the begin or the end of an alarm: those of the same kind are one event, with their number. */
export function withAlarm(
  events: readonly ConsoleEvent[],
  { kind, severity, words }: { readonly kind: string; readonly severity: Severity; readonly words: string },
  ended: boolean,
  time: Date,
): readonly ConsoleEvent[] {
  const known = events.slice(-SAME.lines).findLast(({ alarm, time: last }) =>
    alarm?.kind === kind && (alarm.active || time.getTime() - last.getTime() < SAME.time));
  if (ended) {
    return events.map((event) => (event === known ? { ...event, alarm: overAt(event.alarm, time) } : event));
  }
  const begun = withEvent(events.filter((event) => event !== known), severity, words, time);
  const alarm = { kind, begun: time, active: true, lasted: known?.alarm?.lasted ?? 0 };
  return begun.map((event, index) => index === begun.length - 1 ? { ...event, count: (known?.count ?? 0) + 1, alarm } : event);
}

function overAt<T extends NonNullable<ConsoleEvent["alarm"]>>(alarm: T | undefined, time: Date): T | undefined {
  return alarm && { ...alarm, active: false, lasted: alarm.lasted + (time.getTime() - alarm.begun.getTime()) / 1000 };
}

/** Return an event's time of day, to the second. */
export function timeOfDay(time: Date): string {
  const two = (value: number): string => String(value).padStart(2, "0");
  return `${two(time.getHours())}:${two(time.getMinutes())}:${two(time.getSeconds())}`;
}

/** Return the events as text, one a line, with whole times for a report. */
export function eventsAsText(events: readonly ConsoleEvent[]): string {
  return events
    .map(({ time, severity, words, count, alarm }) =>
      [time.toISOString(), severity, words, ...(count > 1 ? [`(${count}x)`] : []), ...(alarm?.active === false ? [`(${texts.over(alarm.lasted)})`] : [])].join(" "))
    .join("\n");
}

/** Holds the events. */
export class EventLog {
  private readonly kept = signal<readonly ConsoleEvent[]>([]);

  constructor(private readonly clock: () => Date = () => new Date()) {}

  get events(): ReadonlySignal<readonly ConsoleEvent[]> {
    return this.kept;
  }

  readonly add = (severity: Severity, words: string): void => {
    this.kept.value = withEvent(this.kept.peek(), severity, words, this.clock());
  };
  readonly alarm = (alarm: Parameters<typeof withAlarm>[1], ended: boolean): void => {
    this.kept.value = withAlarm(this.kept.peek(), alarm, ended, this.clock());
  };
}
