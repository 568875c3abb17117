/** Which keys do what, and where they do something else. By position on the keyboard, so that WASD works on all layouts. */

import { GEARS, KEYS, type Gear } from "../operating_data";

const DIRECTIONS = ["forward", "backward", "left", "right"] as const;
export type Direction = (typeof DIRECTIONS)[number];

const ACTIONS: ReadonlyMap<string, string> = new Map(KEYS.flatMap(({ codes }) => Object.entries(codes)));

/** Return what a key is for; undefined if it is for nothing here. */
export function actionOf(code: string): string | undefined {
  return ACTIONS.get(code);
}

export function directionOf(code: string): Direction | undefined {
  return DIRECTIONS.find((direction) => direction === actionOf(code));
}

export function gearOf(code: string): Gear | undefined {
  return GEARS.find(({ gear }) => gear === actionOf(code))?.gear;
}

/** Elements that need the driving keys themselves; others can ask for it with `data-own-keys`. */
const OWN_KEYS =
  "input, textarea, select, dialog, [contenteditable=''], [contenteditable='true'], [role='slider'], [role='dialog'],"
  + " [role='alertdialog'], [role='textbox'], [role='listbox'], [role='menu'], [role='tablist'], [data-own-keys]";
const PRESSABLE = "button, a[href], summary, [role='button'], [role='switch'], [role='checkbox']";

/** Whether keys pressed in this element are its own. */
export function ownsKeys(target: EventTarget | null): boolean {
  return target instanceof Element && target.closest(OWN_KEYS) !== null;
}

/** Whether the space bar presses this element. */
export function spacePresses(target: EventTarget | null): boolean {
  return target instanceof Element && target.closest(PRESSABLE) !== null;
}

/** Whether this element is the emergency stop's button. */
export function stops(target: EventTarget | null): boolean {
  return target instanceof Element && target.closest("[data-stops]") !== null;
}

/** Whether a dialog is open in front of the page. */
export function dialogOpen(document: Document): boolean {
  return document.querySelector("dialog[open]") !== null;
}
