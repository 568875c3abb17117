/** Keeps signals from waking everybody for the same value again. */

import type { Signal } from "@preact/signals";

/** Set a signal of a small value (fields that JSON can hold), unless it holds the same already. */
export function setIfChanged<T>(target: Signal<T>, value: T): void {
  if (JSON.stringify(target.peek()) !== JSON.stringify(value)) {
    target.value = value;
  }
}
