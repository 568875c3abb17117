/**
 * The arm by gamepads: LB is the deadman, the sticks move the tip, with RB they turn it, the triggers move the jaws; on
 * the cross, up and down choose a joint, left and right move it.
 *
 * Which of wheels and arm a gamepad moves is switched for all of it, so that it never moves both.
 */

import { withoutDeadZone } from "../../driving/drive_source";
import { GamepadFreshness } from "../../driving/gamepad_freshness";
import type { GamepadSource } from "../../driving/gamepad_source";
import type { ArmHold } from "./arm_hold";
import type { ArmWish } from "./arm_wish";
import { TIP_AT_REST, type TipDeflection } from "./tip_motion";

/** Buttons of the standard mapping, beside those of driving. */
const [LEFT_TRIGGER, RIGHT_TRIGGER, SELECT, TURN] = [6, 7, 8, 5];
const [UP, DOWN, LEFT, RIGHT] = [12, 13, 14, 15];
/** How far a trigger must be pulled. */
const PULLED = 0.6;
/** How long a vibration lasts that is not renewed [ms]; the robot tells of it at each tick. */
const BUZZ = 120;

export interface ArmPadHooks {
  /** Whether gamepads are the arm's now. */
  active(): boolean;
  /** Switch between wheels and arm. */
  toggle(): void;
  open(): void;
  close(): void;
  tip(at: TipDeflection): ArmWish;
  /** Choose another joint, so many on. */
  choose(on: number): void;
  /** What moves the chosen joint at a share of its rate. */
  joint(share: number): ArmWish;
}

interface Pulled {
  readonly open: boolean;
  readonly close: boolean;
  readonly select: boolean;
  readonly up: boolean;
  readonly down: boolean;
}

const NOTHING: Pulled = { open: false, close: false, select: false, up: false, down: false };

export class ArmPad {
  #before = NOTHING;
  /** Whether the deadman was seen up, and the sticks at rest since it was pressed. */
  #ready = false;
  #centred = false;
  readonly #freshness = new GamepadFreshness();

  constructor(
    private readonly pads: Pick<GamepadSource, "connected" | "store">, private readonly hold: ArmHold,
    private readonly hooks: ArmPadHooks,
  ) {
    hold.onLook.add((now) => { this.poll(now); });
    hold.onLoss.add(() => { this.#ready = false; });
  }

  /** Look at the gamepad; the first one with the standard mapping counts. */
  poll(now: number): void {
    const pad = this.pads.connected().find(({ mapping }) => mapping === "standard");
    const at = pad === undefined ? NOTHING : pulled(pad);
    const before = this.#before;
    this.#before = at;
    if (at.select && !before.select) {
      this.hooks.toggle();
    }
    if (pad === undefined || !this.hooks.active()) {
      this.#ready = this.#centred = false;
      this.hold.end("gamepad");
      return;
    }
    const chosen = Number(at.down && !before.down) - Number(at.up && !before.up);
    if (chosen !== 0) {
      this.hooks.choose(chosen);
    }
    const deadman = pad.buttons[this.pads.store.of(pad)?.deadman ?? 4]?.pressed === true;
    if (!deadman) {
      this.#ready = true;
      this.#centred = false;
      this.#freshness.rested(now);
      this.hold.end("gamepad");
      return;
    }
    this.#centred ||= Object.values(deflection(pad)).every((share) => share === 0) && jogged(pad) === 0;
    if (this.#ready && this.#freshness.frozen(pad, now)) {
      this.#ready = false;
    }
    if (!this.#ready || !this.#centred) {
      this.hold.end("gamepad");
      return;
    }
    if (at.open && !before.open) {
      this.hooks.open();
    } else if (at.close && !before.close) {
      this.hooks.close();
    }
    if (this.hold.input.peek() !== "gamepad") {
      this.#ready = this.hold.begin("gamepad", () => this.#wish());
    }
  }

  /** Let the person feel what the arm does, 0 to 1. */
  buzz(strength: number): void {
    for (const pad of this.pads.connected()) {
      // Not all browsers have it, nor all gamepads.
      const motor = (pad as { readonly vibrationActuator?: GamepadHapticActuator | null }).vibrationActuator;
      void motor?.playEffect("dual-rumble", {
        duration: strength > 0 ? BUZZ : 0, strongMagnitude: strength, weakMagnitude: strength,
      }).catch(() => undefined);
    }
  }

  #wish(): ArmWish {
    const pad = this.pads.connected().find(({ mapping }) => mapping === "standard");
    if (pad === undefined) {
      return this.hooks.tip(TIP_AT_REST);
    }
    const jog = jogged(pad);
    return jog === 0 ? this.hooks.tip(deflection(pad)) : this.hooks.joint(jog);
  }
}

function pulled(pad: Gamepad): Pulled {
  const value = (button: number): number => pad.buttons[button]?.value ?? 0;
  const is = (button: number): boolean => value(button) > PULLED;
  return { open: is(LEFT_TRIGGER), close: is(RIGHT_TRIGGER), select: is(SELECT), up: is(UP), down: is(DOWN) };
}

function jogged(pad: Gamepad): number {
  return Number(pad.buttons[RIGHT]?.pressed === true) - Number(pad.buttons[LEFT]?.pressed === true);
}

function deflection(pad: Gamepad): TipDeflection {
  const [x = 0, y = 0, , height = 0] = pad.axes.map((axis) => -withoutDeadZone(axis, 0.12) || 0);
  return pad.buttons[TURN]?.pressed === true
    ? { ...TIP_AT_REST, raise: y, turnLeft: x }
    : { ...TIP_AT_REST, ahead: y, left: x, up: height };
}
