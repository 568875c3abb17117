/** What an alarm is. */

import type { Severity } from "../values";

export type AlarmKind =
  | "connection" | "stale" | "estop" | "tipping" | "tilt" | "lost" | "suspect" | "searching" | "link" | "asking";

export interface Alarm {
  readonly kind: AlarmKind;
  readonly severity: Severity;
  readonly words: string;
}

/** What alarms follow from; times in milliseconds of the page's clock. */
export interface AlarmFacts {
  /** Whether the page has a connection, and the link's sentence if it has none. */
  readonly connected: boolean;
  readonly connectionWords: string;
  /** Whether there was ever a connection: before the first one there is nothing to lose. */
  readonly wasConnected: boolean;
  /** Since anything of the robot arrived [ms]; undefined if nothing ever has. */
  readonly silence: number | undefined;
  readonly health: string | undefined;
  readonly reasons: readonly string[];
  readonly estop: boolean;
  readonly estopReason: string;
  /** Angle between the robot's up and the vertical [rad]; undefined if it is not known now. */
  readonly tilt: number | undefined;
  readonly link: "unknown" | "good" | "slow" | "bad" | "lost";
  readonly linkWords: string;
  /** Who asks for the robot; undefined if nobody does, or if it is not ours to give. */
  readonly asking: string | undefined;
}
