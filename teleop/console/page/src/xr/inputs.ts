/** What the two hands do in a frame: poses in the operator's room, buttons, sticks; and whether they are there at all. */

import { Quaternion, Vector3 } from "three";
import { layoutOf, type ControllerButton, type ControllerLayout } from "./controller_layout";
import { takePose, type Placed } from "./webxr_pose";

/** A hand, empty or with a controller; one object for good, renewed each frame. */
export class Side implements Placed {
  source: XRInputSource | undefined;
  /** Whether it is there: its ray and its buttons mean something. */
  present = false;
  /** Whether its place was measured in this frame, and not guessed. */
  tracked = false;
  readonly position = new Vector3();
  readonly turn = new Quaternion();
  readonly ray: Placed = { position: new Vector3(), turn: new Quaternion() };

  constructor(readonly hand: "left" | "right") {}

  /** Which of its buttons are which; undefined for an empty hand, whose only button is a pinch, and if nothing says so. */
  layout: ControllerLayout | undefined;
  #profiles: readonly string[] = [];
  #mapping = "";

  /** The controller's buttons and sticks, if it is known which is which. */
  get pad(): Gamepad | undefined {
    return this.present && this.layout !== undefined ? this.source?.gamepad : undefined;
  }

  /** Name of a controller that has buttons and cannot drive: nothing says which they are, or there is no grip to hold. */
  get unusable(): string | undefined {
    const { source, present, layout } = this;
    const pad = present && source?.targetRayMode === "tracked-pointer" && !source.hand ? source.gamepad : undefined;
    if (pad === undefined) {
      return undefined;
    }
    const squeeze = layout?.squeeze ?? Infinity;
    const last = layout?.stick?.[1] ?? Infinity;
    return squeeze < pad.buttons.length && last < pad.axes.length ? undefined : source?.profiles[0] ?? "";
  }

  pressed(button: ControllerButton): boolean {
    const at = this.layout?.[button];
    return at !== undefined && this.pad?.buttons[at]?.pressed === true;
  }

  /** Of the trigger or the pinch, 0 to 1. */
  get trigger(): number {
    return this.present ? this.source?.gamepad?.buttons[this.layout?.trigger ?? PINCH]?.value ?? 0 : 0;
  }

  /** Deflection of the stick, or of a pad in its place, -1 to 1: 0 to the right, 1 backwards. */
  axis(which: 0 | 1): number {
    const at = this.layout?.stick?.[which];
    return at === undefined ? 0 : this.pad?.axes[at] ?? 0;
  }

  /** Take over what holds or is this hand from now on, if anything does. */
  become(source: XRInputSource | undefined): void {
    this.source = source;
    const pad = source?.hand ? undefined : source?.gamepad;
    if (source === undefined || pad === undefined) {
      this.layout = undefined;
      this.#profiles = [];
    } else if (source.profiles !== this.#profiles || pad.mapping !== this.#mapping) {
      this.#profiles = source.profiles;
      this.#mapping = pad.mapping;
      this.layout = layoutOf(source.profiles, source.handedness, pad);
    }
  }

  /** Let the person feel something: strength 0 to 1, for so many ms. */
  pulse(strength: number, duration: number): void {
    // Typed as an effect player, but WebXR's actuators only pulse, and not all browsers have them.
    const [actuator] = (this.source?.gamepad as { readonly hapticActuators?: readonly Partial<Actuator>[] } | undefined)?.hapticActuators ?? [];
    void actuator?.pulse?.(Math.min(1, Math.max(0, strength)), duration);
  }
}

/** Place of an empty hand's only button. */
const PINCH = 0;

interface Actuator {
  pulse(value: number, duration: number): Promise<boolean>;
}

export class Inputs {
  readonly left = new Side("left");
  readonly right = new Side("right");

  side(hand: XRHandedness): Side {
    return hand === "left" ? this.left : this.right;
  }

  /** Renew both hands. */
  update(frame: XRFrame, space: XRReferenceSpace): void {
    const { inputSources } = frame.session;
    let left: XRInputSource | undefined;
    let right: XRInputSource | undefined;
    for (let at = 0; at < inputSources.length; at += 1) {
      const source = inputSources[at];
      // A gaze or a pinch that belongs to no hand is the right one's, unless there is a right one.
      if (source?.handedness === "left") {
        left = source;
      } else if (source?.handedness === "right" || right === undefined) {
        right = source;
      }
    }
    this.left.become(left);
    this.right.become(right);
    renew(this.left, frame, space);
    renew(this.right, frame, space);
  }

  /** Count both as gone. */
  clear(): void {
    this.left.present = this.right.present = this.left.tracked = this.right.tracked = false;
  }
}

function renew(side: Side, frame: XRFrame, space: XRReferenceSpace): void {
  const { source } = side;
  const ray = source && frame.getPose(source.targetRaySpace, space);
  const grip = source?.gripSpace ? frame.getPose(source.gripSpace, space) : ray;
  side.present = ray != null && grip != null && takePose(side.ray, ray.transform) && takePose(side, grip.transform);
  side.tracked = side.present && grip?.emulatedPosition === false;
}
