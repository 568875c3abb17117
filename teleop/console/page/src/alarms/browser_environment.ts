/** The browser as the alarms need it. */

import { browserKeeper } from "../scene/stored_signals";
import { AlarmSound } from "./alarm_sound";
import type { AlarmEnvironment } from "./alarms";

const GESTURES = ["pointerdown", "keydown", "touchend"] as const;

/** Return the environment of this window; what the browser lacks is left out. */
export function browserAlarmEnvironment(): AlarmEnvironment {
  let touched = false;
  return {
    now: () => performance.now(),
    every: (period, callback) => {
      const id = setInterval(callback, period);
      return () => { clearInterval(id); };
    },
    sound: new AlarmSound(typeof AudioContext === "function" ? () => new AudioContext() : undefined),
    vibrate: (pattern) => {
      // Browsers complain about pages that vibrate before anybody touched them.
      if (touched && pattern.length > 0 && "vibrate" in navigator) {
        navigator.vibrate([...pattern]);
      }
    },
    keeper: browserKeeper(),
    onGesture: (callback) => {
      const stop = new AbortController();
      for (const gesture of GESTURES) {
        document.addEventListener(gesture, () => { touched = true; callback(); },
          { capture: true, passive: true, signal: stop.signal });
      }
      return () => { stop.abort(); };
    },
  };
}
