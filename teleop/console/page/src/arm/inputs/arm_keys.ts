/** The arm by keys: a held key is the deadman. */

import { signal } from "@preact/signals";
import { dialogOpen, ownsKeys } from "../../driving/key_bindings";
import type { ArmHold } from "./arm_hold";
import type { ArmWish } from "./arm_wish";
import { TIP_AT_REST, type TipDeflection } from "./tip_motion";

/** A key that was held when everything counted as released repeats within this time [ms] if it is still held. */
const QUIET = 500;

type Axis = "ahead" | "left" | "up";
const TIP_KEYS: ReadonlyMap<string, readonly [axis: Axis, sign: number]> = new Map([
  ["KeyI", ["ahead", 1]], ["KeyK", ["ahead", -1]],
  ["KeyJ", ["left", 1]], ["KeyL", ["left", -1]],
  ["KeyU", ["up", 1]], ["KeyO", ["up", -1]],
]);
const JOINT_KEYS: ReadonlyMap<string, number> = new Map([["Comma", -1], ["Period", 1]]);

export interface ArmKeyHooks {
  /** Whether the keys are the arm's now. */
  active(): boolean;
  joints(): number;
  /** Open or close the gripper. */
  gripper(): void;
  tip(at: TipDeflection): ArmWish | undefined;
  joint(number: number, share: number): ArmWish | undefined;
}

export class ArmKeys {
  /** The joint that is moved, from 0. */
  readonly joint = signal(0);
  readonly #pressed = new Set<string>();
  readonly #doubtful = new Map<string, number>();
  readonly #listening = new AbortController();
  #shift = false;

  constructor(
    private readonly window: Window, private readonly now: () => number, private readonly hold: ArmHold,
    private readonly hooks: ArmKeyHooks,
  ) {
    const { signal: ended } = this.#listening;
    // In the capturing phase, since some of the keys move the view while the picture has the focus.
    window.addEventListener("keydown", (event) => { this.#down(event); }, { signal: ended, capture: true });
    window.addEventListener("keyup", (event) => { this.#up(event); }, { signal: ended, capture: true });
    hold.onLoss.add(() => { this.release(); });
  }

  /** Choose a joint, from 0; beyond the last one it is that. */
  choose(joint: number): void {
    this.joint.value = Math.max(0, Math.min(joint, this.hooks.joints() - 1));
  }

  /** Count all keys as released until they are pressed again. */
  release(): void {
    for (const code of this.#pressed) {
      this.#doubtful.set(code, this.now());
    }
    this.#pressed.clear();
    this.hold.end("keys");
  }

  dispose(): void {
    this.#listening.abort();
    this.release();
  }

  #down(event: KeyboardEvent): void {
    const { code } = event;
    if (event.ctrlKey || event.metaKey || event.altKey) {
      this.release(); // other keys mean something else then, and macOS reports no key-up
      return;
    }
    if (!this.hooks.active() || ownsKeys(event.target) || dialogOpen(this.window.document)) {
      return;
    }
    this.#shift = event.shiftKey;
    const digit = /^(?:Digit|Numpad)([1-9])$/.exec(code)?.[1];
    const moves = TIP_KEYS.has(code) || JOINT_KEYS.has(code);
    if (!moves && digit === undefined && code !== "KeyG") {
      return;
    }
    event.preventDefault(); // so that it drives nothing, and shifts no gear
    event.stopPropagation();
    if (digit !== undefined) {
      this.choose(Number(digit) - 1);
    } else if (moves && !event.repeat && this.#trusted(code)) {
      this.#pressed.add(code);
      if (this.hold.input.peek() !== "keys" && !this.hold.begin("keys", () => this.#wish())) {
        this.#pressed.clear();
      }
    } else if (code === "KeyG" && !event.repeat) {
      this.hooks.gripper();
    }
  }

  #up(event: KeyboardEvent): void {
    this.#shift = event.shiftKey;
    this.#doubtful.delete(event.code);
    if (this.#pressed.delete(event.code) && this.#pressed.size === 0) {
      this.hold.end("keys");
    }
  }

  /** Whether a key is pressed anew: not one that never went up, and whose repetition goes on. */
  #trusted(code: string): boolean {
    const since = this.#doubtful.get(code);
    if (since !== undefined && this.now() - since < QUIET) {
      this.#doubtful.set(code, this.now());
      return false;
    }
    this.#doubtful.delete(code);
    return true;
  }

  #wish(): ArmWish {
    const jog = [...this.#pressed].reduce((sum, code) => sum + (JOINT_KEYS.get(code) ?? 0), 0);
    const byJoint = [...this.#pressed].some((code) => JOINT_KEYS.has(code));
    const wish = byJoint ? this.hooks.joint(this.joint.peek(), jog) : this.hooks.tip(this.#deflection());
    return wish ?? { kind: "plan", confirmed: false };
  }

  #deflection(): TipDeflection {
    const at = { ahead: 0, left: 0, up: 0 };
    for (const code of this.#pressed) {
      const [axis, sign] = TIP_KEYS.get(code) ?? ["up", 0];
      at[axis] += sign;
    }
    return this.#shift ? { ...TIP_AT_REST, raise: at.ahead + at.up, turnLeft: at.left } : { ...TIP_AT_REST, ...at };
  }
}
