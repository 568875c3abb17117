/** Which signals an effect depends on, said in one line. */

import type { ReadonlySignal } from "@preact/signals";

/** Have the effect that calls this run again when one of the signals changes. */
export function depend(...signals: readonly ReadonlySignal<unknown>[]): readonly unknown[] {
  return signals.map((each) => each.value);
}
