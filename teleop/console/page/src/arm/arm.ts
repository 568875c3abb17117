/** The arm in the page: what is heard of it, what holds it, and what the picture shows; made once the robot has one. */

import { computed, effect, signal, untracked, type ReadonlySignal, type Signal } from "@preact/signals";
import type { Driving } from "../driving/driving";
import type { StepMotion } from "../driving/step_motion";
import type { RobotWire } from "../link/robot_wire";
import type { ArmInfo } from "../robot/arm";
import type { RobotState } from "../robot/robot_state";
import { browserKeeper, remembered, rememberedSwitch } from "../scene/stored_signals";
import type { Theme } from "../scene/settings";
import type { Workshop } from "../scene/workshop";
import { ArmFeed } from "./arm_feed";
import { ArmHold, type HoldEnvironment } from "./inputs/arm_hold";
import { ArmKeys } from "./inputs/arm_keys";
import { ArmPad } from "./inputs/arm_pad";
import { sendWish, type ArmWish } from "./inputs/arm_wish";
import { GripperControl } from "./goals/gripper_control";
import { LedHand, NO_TRIGGER } from "./inputs/hand";
import { MoveControl } from "./goals/move_control";
import { ArmPicture } from "./picture/arm_picture";
import { Taught } from "./goals/taught";
import { jointTowards, jointWish, TIP_AT_REST, TIP_FRAMES, tipWish, type TipDeflection, type TipFrame } from "./inputs/tip_motion";
import { WayOut } from "./goals/way_out";

export interface ArmParts {
  readonly wire: RobotWire;
  readonly workshop: Workshop;
  readonly robot: RobotState;
  readonly driving: Driving;
  readonly theme: ReadonlySignal<Theme>;
  /** Whether bandwidth is saved. */
  readonly lean: ReadonlySignal<boolean>;
  readonly environment: HoldEnvironment;
}

/** What there is as soon as it is known which arm it is. */
export interface KnownArm {
  readonly info: ArmInfo;
  readonly picture: ArmPicture;
  readonly taught: Taught;
}

export class Arm implements StepMotion {
  readonly feed: ArmFeed;
  readonly hold: ArmHold;
  readonly keys: ArmKeys;
  readonly gripper: GripperControl;
  readonly moved: MoveControl;
  readonly wayOut: WayOut;
  readonly known: ReadonlySignal<KnownArm | undefined>;
  /** Whether what is asked of the arm next would be refused for no reason that the page knows. */
  readonly mayMove: ReadonlySignal<boolean>;
  /** Whether keys, gamepad and the handles in the picture are the arm's; else they are the wheels'. */
  readonly chosen: Signal<boolean> = signal(false);
  readonly frame: Signal<TipFrame>;
  /** Whether the arm follows the ghost as it is dragged; else it goes there when it is told to. */
  readonly follows: Signal<boolean>;
  readonly #known = signal<KnownArm | undefined>(undefined);
  readonly #undo: (() => void)[] = [];

  constructor(private readonly parts: ArmParts) {
    const { wire, robot, driving, environment } = parts;
    const keeper = browserKeeper();
    this.frame = remembered<TipFrame>("farsteer.arm.frame", "base", (kept) => TIP_FRAMES.find((frame) => frame === kept), keeper);
    this.follows = rememberedSwitch("farsteer.arm.follows", true, keeper);
    this.known = this.#known;
    this.mayMove = computed(() => driving.status.value.blocked === undefined);
    this.feed = new ArmFeed(wire, robot, parts.lean);
    this.gripper = new GripperControl(wire, this.feed.info);
    this.moved = new MoveControl(wire);
    this.wayOut = new WayOut(wire);
    this.hold = new ArmHold((wish) => sendWish(wire, wish), driving, this.feed.state, environment);
    this.keys = new ArmKeys(environment.window, () => environment.now(), this.hold, {
      active: () => this.chosen.peek(),
      joints: () => this.feed.info.peek()?.joints.length ?? 1,
      gripper: () => { this.gripper.toggle(this.feed.state.peek()); },
      tip: (at) => this.#tip(at),
      joint: (joint, share) => this.jog(joint, share),
    });
    const pad = new ArmPad(driving.pads, this.hold, {
      active: () => this.chosen.peek(),
      toggle: () => { this.chosen.value = !this.chosen.peek(); },
      open: () => { this.gripper.open(); },
      close: () => { this.gripper.close(); },
      tip: (at) => this.#tip(at),
      choose: (on) => { this.keys.choose(this.keys.joint.peek() + on); },
      joint: (share) => this.jog(this.keys.joint.peek(), share) ?? this.#tip(TIP_AT_REST),
    });
    this.feed.onRumble = (strength) => {
      if (driving.turns.turns.peek().driver === "me") {
        pad.buzz(strength);
      }
    };
    this.#watch(environment.document);
  }

  /** Whether the arm moves, or will, because this page asked for it. */
  get moves(): boolean {
    return this.hold.input.peek() !== undefined || this.moved.pending.peek() !== undefined || this.gripper.moves
      || this.wayOut.going.peek();
  }

  /** Stop everything that this page has asked of the arm; what the gripper holds it goes on holding. */
  stop(): void {
    this.hold.release();
    this.known.peek()?.taught.stop();
    this.moved.stop();
    this.gripper.stop();
    void this.wayOut.stop();
  }

  /** Return what turns a joint at a share of the gear's rate, -1 to 1; undefined before the arm is known. */
  jog(joint: number, share: number): ArmWish | undefined {
    const info = this.feed.info.peek();
    return info && jointWish(info, joint, share, this.parts.driving.gear.peek());
  }

  /** Return what brings a joint to an angle [rad]. */
  towards(joint: number, wanted: number): ArmWish | undefined {
    const [info, measured] = [this.feed.info.peek(), this.feed.state.peek()?.angles[joint]];
    return info === undefined || measured === undefined ? undefined : jointTowards(info, joint, wanted, measured, this.parts.driving.gear.peek());
  }

  dispose(): void {
    this.stop();
    for (const undo of this.#undo) {
      undo();
    }
    this.known.peek()?.picture.dispose();
    this.keys.dispose();
    this.hold.dispose();
    this.feed.dispose();
  }

  #watch(document: Document): void {
    const hidden = (): void => {
      if (document.visibilityState === "hidden") {
        this.stop();
      }
    };
    document.addEventListener("visibilitychange", hidden);
    this.#undo.push(
      () => { document.removeEventListener("visibilitychange", hidden); },
      effect(() => {
        this.parts.driving.pads.elsewhere.value = this.chosen.value;
        if (!this.chosen.value) {
          this.hold.release();
        }
      }),
      effect(() => {
        const info = this.feed.info.value;
        untracked(() => {
          this.known.peek()?.picture.dispose();
          this.#known.value = info && this.#knownBy(info);
        });
      }),
    );
  }

  #knownBy(info: ArmInfo): KnownArm {
    const picture = new ArmPicture({
      info, workshop: this.parts.workshop, theme: this.parts.theme, state: this.feed.state, active: this.chosen, frame: this.frame,
      path: computed(() => this.moved.pending.value?.path ?? []),
      stays: computed(() => !this.follows.value),
      begin: () => { this.#drag(); },
      end: () => { this.hold.end("gizmo"); },
    });
    return { info, picture, taught: new Taught(info, this.moved, this.gripper, browserKeeper()) };
  }

  #tip(at: TipDeflection): ArmWish {
    const heading = this.frame.peek() === "view" ? this.known.peek()?.picture.heading() ?? 0 : 0;
    return tipWish(at, this.frame.peek(), heading, this.parts.driving.gear.peek());
  }

  /** Have the arm follow the ghost, from where its gripper is. */
  #drag(): void {
    const picture = this.known.peek()?.picture;
    if (picture === undefined || !this.follows.peek()) {
      return;
    }
    const hand = new LedHand();
    hand.begin(picture.ghost, this.parts.environment.now());
    this.hold.begin("gizmo", (now) => ({
      kind: "hand",
      hand: {
        pose: hand.follow(picture.ghost, now), frame: "arm_base", engaged: true, trigger: NO_TRIGGER, tracked: true, scale: 1,
      },
    }));
  }
}
