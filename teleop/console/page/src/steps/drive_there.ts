/** "Drive there": a place on the floor, the way to it, and a deadman under which the robot drives that way by itself. */

import { computed, effect, signal, type ReadonlySignal } from "@preact/signals";
import type { Joined } from "../driving/driving_environment";
import { HoldSource } from "../driving/hold_source";
import type { DriveSource } from "../driving/drive_source";
import type { RobotState } from "../robot/robot_state";
import { watchPointer, type FloorPoint } from "../scene/floor_pointer";
import { planar } from "../scene/geometry";
import { stepTexts as texts } from "../texts/steps";
import type { PlanarPose } from "../values";
import type { StepControl } from "./step_control";
import { pointsOf, wayTo } from "./way_to";

interface ThereParts {
  /** The picture's element. */
  readonly surface: HTMLElement;
  readonly floorPoint: (clientX: number, clientY: number) => FloorPoint | undefined;
  /** Keep the view still, with presses for the place, or give both back to the camera. */
  readonly holdView: (held: boolean) => void;
  readonly state: RobotState;
  readonly steps: StepControl;
  /** Lets a deadman drive. */
  readonly join: (source: DriveSource) => Joined;
}

export class DriveThere {
  /** Whether presses on the picture choose the place. */
  readonly choosing = signal(false);
  readonly target: ReadonlySignal<FloorPoint | undefined>;
  /** Points of the way from where the robot is [m]; empty if there is none. */
  readonly way: ReadonlySignal<readonly FloorPoint[]>;
  readonly #holding = signal(false);
  readonly #target = signal<FloorPoint | undefined>(undefined);
  readonly #deadman = new HoldSource();
  readonly #pose: ReadonlySignal<PlanarPose | undefined>;
  #asked = false;

  constructor(private readonly parts: ThereParts) {
    const { surface, floorPoint, holdView, state, join } = parts;
    this.target = this.#target;
    this.#pose = computed(() => {
      const pose = state.mapFromBase.value;
      return pose && planar(pose);
    });
    this.way = computed(() => {
      const [pose, target] = [this.#pose.value, this.#target.value];
      return pose === undefined || target === undefined ? [] : pointsOf(pose, wayTo(pose, target));
    });
    join(this.#deadman);
    watchPointer(surface, floorPoint, () => this.choosing.peek() && !this.#holding.peek(), (event) => {
      if (event.type !== "release") {
        this.aim(event.point);
      }
    });
    effect(() => {
      if (this.#holding.value && this.parts.steps.pending.value.length === 0) {
        this.#ask();
      }
    });
    // While the robot drives, the view goes with it.
    effect(() => { holdView(this.choosing.value && !this.#holding.value); });
    effect(() => {
      if (!this.choosing.value || state.connection.value.phase !== "open") {
        this.letGo();
        this.#target.value = undefined;
      }
    });
  }

  /** Choose a place of the floor, unless none is to be chosen now or the robot drives to one. */
  aim(point: FloorPoint): void {
    if (this.choosing.peek() && !this.#holding.peek()) {
      this.#target.value = point;
    }
  }

  /** Why the robot cannot drive there now, in words; undefined if it can. @param status What driving says of itself. */
  refusal({ will, words }: { readonly will: boolean; readonly words: string }): string | undefined {
    if (!will) {
      return words;
    }
    return this.#pose.value === undefined ? texts.thereNoPose : this.#target.value === undefined ? texts.thereHelp : undefined;
  }

  /** Hold the deadman, and have the robot drive to the chosen place once the steps before have ended. */
  hold(): void {
    if (this.#pose.peek() !== undefined && this.#target.peek() !== undefined) {
      this.parts.steps.stop();
      this.#deadman.hold();
      this.#asked = false;
      this.#holding.value = true;
    }
  }

  /** A step that is asked for while one brakes ends with it, not begun. */
  #ask(): void {
    const [pose, target] = [this.#pose.peek(), this.#target.peek()];
    if (!this.#asked && pose !== undefined && target !== undefined) {
      this.#asked = true;
      for (const goal of wayTo(pose, target)) {
        this.parts.steps.ask(goal);
      }
    }
  }

  /** Let go: the robot brakes, and its steps end. */
  letGo(): void {
    this.#deadman.letGo();
    this.#holding.value = false;
  }
}
