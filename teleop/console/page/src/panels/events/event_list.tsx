/** The events, newest first, to be read and copied. */

import { useSignal } from "@preact/signals";
import { useEffect, useMemo, useRef } from "preact/hooks";
import { browserKeeper, rememberedSwitch, type Keeper } from "../../scene/stored_signals";
import { eventTexts as texts } from "../../texts/panels";
import type { ConsoleEvent } from "../../values";
import { Panel } from "../panel";
import { copyText } from "./copy_text";
import { eventsAsText, timeOfDay, type EventLog } from "./event_log";

/** So many are drawn; all of them are copied. */
const DRAWN = 100;

interface EventListProps {
  readonly log: EventLog;
  readonly copy?: (text: string) => Promise<boolean>;
  readonly keeper?: Keeper | undefined;
}

export function EventList({ log, copy = copyText, keeper = browserKeeper() }: EventListProps) {
  const events = log.events.value;
  const gravest = useMemo(() => rememberedSwitch("farsteer.gravest", false, keeper), [keeper]);
  const copied = useSignal<"no" | "yes" | "failed">("no");
  const byHand = useSignal("");
  const press = async (): Promise<void> => {
    const text = eventsAsText(log.events.peek());
    const done = await copy(text);
    copied.value = done ? "yes" : "failed";
    byHand.value = done ? "" : text;
  };
  const shown = gravest.value ? events.filter(({ severity }) => severity !== "info") : events;
  const newest = shown.slice(-DRAWN).reverse();
  return (
    <Panel
      title={texts.title}
      name="events"
      aside={(
        <button type="button" disabled={events.length === 0} onClick={() => { void press(); }}>
          {copied.value === "yes" ? texts.copied : texts.copy}
        </button>
      )}
    >
      {copied.value === "failed" && <ByHand text={byHand.value} />}
      <label class="panel-check">
        <input type="checkbox" checked={gravest.value} onChange={({ currentTarget }) => { gravest.value = currentTarget.checked; }} />
        {texts.gravest}
      </label>
      {shown.length === 0 && <p class="panel-quiet">{texts.none}</p>}
      <div class="panel-event-list" role="log" aria-live="polite" tabIndex={0} aria-label={texts.title}>
        <ol>{newest.map((event) => <Line key={`${event.time.getTime()} ${event.words}`} event={event} />)}</ol>
      </div>
    </Panel>
  );
}

function Line({ event }: { event: ConsoleEvent }) {
  return (
    <li data-severity={event.severity}>
      <time dateTime={event.time.toISOString()}>{timeOfDay(event.time)}</time>{" "}
      {event.severity !== "info" && <strong class="panel-severity">{texts.severity[event.severity]}</strong>}{" "}
      <span class="panel-words">{event.words}</span>
      {event.count > 1 && <span class="panel-quiet"> · {texts.times(event.count)}</span>}
      {event.alarm?.active === false && <span class="panel-quiet"> · {texts.over(event.alarm.lasted)}</span>}
    </li>
  );
}

function ByHand({ text }: { text: string }) {
  const field = useRef<HTMLTextAreaElement>(null);
  useEffect(() => {
    field.current?.focus();
    field.current?.select();
  }, [text]);
  return (
    <div class="panel-by-hand">
      <p role="status">{texts.byHand}</p>
      <textarea ref={field} readOnly rows={4} value={text} aria-label={texts.title} />
    </div>
  );
}
