/** What an alarm is. */

import type { Severity } from "../values";

export interface Alarm {
  /** Which rule it follows from. */
  readonly kind: string;
  readonly severity: Severity;
  readonly words: string;
}
