/** The alarms in words, and the switch of their sound. */

import type { Alarm } from "../../alarms/alarm";
import type { Alarms } from "../../alarms/alarms";
import { alarmTexts as texts } from "../../texts/alarms";

/**
 * What is wrong now, the gravest first. The visible words may change all the time (ages, angles); a screen reader is told
 * once that an alarm began, by a live region whose words change with the set of alarms only.
 */
export function AlarmBar({ alarms }: { alarms: Alarms }) {
  const active = alarms.active.value;
  return (
    <section class="panel-alarms" aria-label={texts.title}>
      {active.length > 0 && (
        <ul class="panel-alarm-list">
          {active.map((alarm) => (
            <li key={alarm.kind} data-severity={alarm.severity} data-kind={alarm.kind}>
              <strong class="panel-severity">{texts.severity[alarm.severity]}</strong> {alarm.words}
            </li>
          ))}
        </ul>
      )}
      <Spoken alarms={alarms.announced.value} />
    </section>
  );
}

function Spoken({ alarms }: { alarms: readonly Alarm[] }) {
  const grave = alarms.filter((alarm) => alarm.severity === "alarm");
  const other = alarms.filter((alarm) => alarm.severity !== "alarm");
  return (
    <>
      <div class="panel-spoken" role="alert">{grave.map((alarm) => <p key={alarm.kind}>{alarm.words}</p>)}</div>
      <div class="panel-spoken" role="status">{other.map((alarm) => <p key={alarm.kind}>{alarm.words}</p>)}</div>
    </>
  );
}

/** Switches the sound; its state is always shown, also when the browser keeps the page silent. */
export function MuteButton({ alarms }: { alarms: Alarms }) {
  const muted = alarms.muted.value;
  const sound = alarms.sound.value;
  const words = sound === "unavailable"
    ? texts.unavailable
    : muted ? texts.muted : sound === "locked" ? texts.locked : texts.sounding;
  return (
    <button
      type="button"
      class="panel-mute"
      data-muted={muted}
      disabled={sound === "unavailable"}
      title={muted ? texts.unmute : texts.mute}
      onClick={() => { alarms.muted.value = !alarms.muted.peek(); }}
    >
      <svg viewBox="0 0 20 20" aria-hidden="true">
        <path d="M2 7h4l5-4v14l-5-4H2z" />
        {muted || sound !== "ready"
          ? <path class="panel-stroke" d="M13 7l5 6M18 7l-5 6" />
          : <path class="panel-stroke" d="M13.5 7q2 3 0 6M16 5q4 5 0 10" />}
      </svg>
      <span class="panel-mute-words" data-room={sound === "unavailable" ? words : texts.locked}>{words}</span>
    </button>
  );
}
