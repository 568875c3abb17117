/** Which keys do what, and where they do something else. By position on the keyboard, so that WASD works on all layouts. */

import type { Gear } from "./gears";

export type Direction = "forward" | "backward" | "left" | "right";

const DIRECTIONS: ReadonlyMap<string, Direction> = new Map([
  ["ArrowUp", "forward"], ["KeyW", "forward"],
  ["ArrowDown", "backward"], ["KeyS", "backward"],
  ["ArrowLeft", "left"], ["KeyA", "left"],
  ["ArrowRight", "right"], ["KeyD", "right"],
]);

const GEAR_KEYS: ReadonlyMap<string, Gear> = new Map([
  ["Digit1", "precision"], ["Numpad1", "precision"],
  ["Digit2", "normal"], ["Numpad2", "normal"],
  ["Digit3", "turbo"], ["Numpad3", "turbo"],
]);

export function directionOf(code: string): Direction | undefined {
  return DIRECTIONS.get(code);
}

export function gearOf(code: string): Gear | undefined {
  return GEAR_KEYS.get(code);
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
