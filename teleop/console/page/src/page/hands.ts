/** What the page does for hands: the gear stays as it was chosen, phones stay awake and may fill the screen. */

import { effect, signal, type ReadonlySignal, type Signal } from "@preact/signals";
import { GEARS, type Gear } from "../operating_data";
import type { RobotState } from "../robot/robot_state";
import { browserKeeper, remembered } from "../scene/stored_signals";

/** Return the gear as it was chosen last in this browser. */
export function rememberedGear(): Signal<Gear> {
  return remembered<Gear>("farsteer.gear", "normal", (kept) => GEARS.find(({ gear }) => gear === kept)?.gear, browserKeeper());
}

/** Return a function that tells whether there is a touch screen, and neither mouse nor keyboard as far as browsers say. */
export function thumbsOnly(matches: Window["matchMedia"] = (query) => window.matchMedia(query)): () => boolean {
  const thumbs = matches("(pointer: coarse) and (hover: none)");
  return () => thumbs.matches;
}

/** Keep the screen from going dark while a robot is connected: a dark screen ends the drive. Needs https or localhost. */
export function keepAwake(state: RobotState, navigator: Partial<Pick<Navigator, "wakeLock">>, document: Document): void {
  const seen = signal(document.visibilityState !== "hidden");
  document.addEventListener("visibilitychange", () => { seen.value = document.visibilityState !== "hidden"; });
  effect(() => {
    // The browser itself ends a lock when the page is hidden.
    if (!seen.value || state.connection.value.phase !== "open") {
      return undefined;
    }
    const lock = navigator.wakeLock?.request("screen").catch(() => undefined); // refused, such as at low battery
    return () => { void lock?.then((held) => held?.release()); };
  });
}

/** Whether the page fills the screen, and how to change that; undefined where browsers do not let it. */
export interface FullScreen {
  readonly on: ReadonlySignal<boolean>;
  toggle(): void;
}

export function fullScreen(document: Document): FullScreen | undefined {
  if (!document.fullscreenEnabled) {
    return undefined;
  }
  const on = signal(document.fullscreenElement !== null);
  document.addEventListener("fullscreenchange", () => { on.value = document.fullscreenElement !== null; });
  const refused = (): void => undefined; // stays as it is
  return {
    on,
    toggle: () => { (on.peek() ? document.exitFullscreen() : document.documentElement.requestFullscreen()).catch(refused); },
  };
}
