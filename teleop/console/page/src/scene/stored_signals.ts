/** Signals that outlive the page in `localStorage`, where the browser allows it. */

import { effect, signal, type Signal } from "@preact/signals";

/** Where settings are kept; a part of `Storage`, so that tests give their own. */
export interface Keeper {
  getItem(key: string): string | null;
  setItem(key: string, value: string): void;
}

/** The browser's storage, or undefined where it is blocked: reading the property may throw already. */
export function browserKeeper(): Keeper | undefined {
  try {
    return window.localStorage;
  } catch {
    return undefined;
  }
}

/**
 * Return a signal that begins with the kept value and keeps each new one.
 *
 * `check` turns what was kept, which may be anything, into a valid value, or undefined for `initial`.
 * The initial value is not written, so that a default which follows the system goes on following it.
 */
export function remembered<T>(
  key: string,
  initial: T,
  check: (kept: unknown) => T | undefined,
  keeper: Keeper | undefined,
): Signal<T> {
  const value = signal<T>(read(key, check, keeper) ?? initial);
  let first = true;
  effect(() => {
    const text = JSON.stringify(value.value);
    if (!first) {
      write(key, text, keeper);
    }
    first = false;
  });
  return value;
}

/** Return a switch that begins as it was kept. */
export function rememberedSwitch(key: string, initial: boolean, keeper: Keeper | undefined): Signal<boolean> {
  return remembered(key, initial, (kept) => (typeof kept === "boolean" ? kept : undefined), keeper);
}

function read<T>(key: string, check: (kept: unknown) => T | undefined, keeper: Keeper | undefined): T | undefined {
  try {
    const text = keeper?.getItem(key);
    return text === null || text === undefined ? undefined : check(JSON.parse(text));
  } catch {
    return undefined;
  }
}

function write(key: string, text: string, keeper: Keeper | undefined): void {
  try {
    keeper?.setItem(key, text);
  } catch {
    // A full or blocked storage: the setting holds until the page is closed.
  }
}
