/**
 * The arm by gamepads: LB is the deadman, the sticks move the tip, with RB they turn it, the triggers move the jaws.
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
}

interface Pulled {
  readonly open: boolean;
  readonly close: boolean;
  readonly select: boolean;
}

const NOTHING: Pulled = { open: false, close: false, select: false };

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
    const deadman = pad.buttons[this.pads.store.of(pad)?.deadman ?? 4]?.pressed === true;
    if (!deadman) {
      this.#ready = true;
      this.#centred = false;
      this.#freshness.rested(now);
      this.hold.end("gamepad");
      return;
    }
    const wanted = deflection(pad);
    this.#centred ||= Object.values(wanted).every((share) => share === 0);
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
      this.#ready = this.hold.begin("gamepad", () => this.hooks.tip(this.#now()));
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

  #now(): TipDeflection {
    const pad = this.pads.connected().find(({ mapping }) => mapping === "standard");
    return pad === undefined ? TIP_AT_REST : deflection(pad);
  }
}

function pulled(pad: Gamepad): Pulled {
  const value = (button: number): number => pad.buttons[button]?.value ?? 0;
  return { open: value(LEFT_TRIGGER) > PULLED, close: value(RIGHT_TRIGGER) > PULLED, select: value(SELECT) > PULLED };
}

function deflection(pad: Gamepad): TipDeflection {
  const [x = 0, y = 0, , height = 0] = pad.axes.map((axis) => -withoutDeadZone(axis, 0.12) || 0);
  return pad.buttons[TURN]?.pressed === true
    ? { ...TIP_AT_REST, raise: y, turnLeft: x }
    : { ...TIP_AT_REST, ahead: y, left: x, up: height };
}
