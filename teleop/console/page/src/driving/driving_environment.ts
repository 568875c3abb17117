/** The browser as driving sees it, and what else it is given. */

import type { Signal } from "@preact/signals";
import type { Gear } from "../operating_data";
import type { Loss } from "./page_watch";

/** What of the browser driving needs. */
export interface DrivingEnvironment {
  readonly window: Window;
  readonly document: Document;
  readonly navigator: Navigator;
  /** Monotonic time [ms], as `performance.now()`. */
  now(): number;
  /** Time of the day [ms], as `Date.now()`, which goes on while the computer sleeps; that one if not given. */
  wallNow?(): number;
  /** Whether the person has a touch screen and nothing else. */
  thumbs?(): boolean;
  /** Where the gear is kept; it begins as normal if not given. */
  readonly gear?: Signal<Gear>;
}

/** An input that has joined the page's own. */
export interface Joined {
  /** Stop everything that this page moves, since the person has lost this input. */
  lose(loss: Loss): void;
  leave(): void;
}
