/** Steps that this page has asked for: those that wait, the one that is driven, and how the last one ended. */

import { computed, signal, type ReadonlySignal } from "@preact/signals";
import type { StepMotion } from "../driving/step_motion";
import type { StepCommands, StepEnd, StepGoal, StepProgress } from "../robot/robot_actions";

/** A step that has not ended. */
export interface PendingStep {
  readonly number: number;
  readonly goal: StepGoal;
  /** What the robot said last; undefined before it has. */
  readonly progress: StepProgress | undefined;
  readonly cancel: () => void;
}

/** The step that ended last. */
export interface EndedStep {
  readonly goal: StepGoal;
  readonly end: StepEnd;
}

export class StepControl implements StepMotion {
  readonly pending: ReadonlySignal<readonly PendingStep[]>;
  /** The step that is driven, or will be next. */
  readonly present: ReadonlySignal<PendingStep | undefined>;
  readonly last: ReadonlySignal<EndedStep | undefined>;
  readonly #pending = signal<readonly PendingStep[]>([]);
  readonly #last = signal<EndedStep | undefined>(undefined);
  #number = 0;

  constructor(private readonly commands: StepCommands) {
    this.pending = this.#pending;
    this.present = computed(() => this.#pending.value.find(({ progress }) => progress?.moving) ?? this.#pending.value[0]);
    this.last = this.#last;
  }

  get moves(): boolean {
    return this.#pending.peek().length > 0;
  }

  /** Ask for a step, behind those that wait; returns whether it was sent. */
  ask(goal: StepGoal): boolean {
    this.#number += 1;
    const number = this.#number;
    const cancel = this.commands.step(goal, {
      progress: (progress) => {
        this.#pending.value = this.#pending.peek().map((step) => (step.number === number ? { ...step, progress } : step));
      },
      ended: (end) => {
        this.#pending.value = this.#pending.peek().filter((step) => step.number !== number);
        this.#last.value = { goal, end };
      },
    });
    if (cancel !== undefined) {
      this.#last.value = undefined;
      this.#pending.value = [...this.#pending.peek(), { number, goal, progress: undefined, cancel }];
    }
    return cancel !== undefined;
  }

  /** Cancel all steps; the last one first, so that none begins meanwhile. */
  stop(): void {
    for (const step of [...this.#pending.peek()].reverse()) {
      step.cancel();
    }
  }

  /** Cancel all steps when the page is hidden: nobody looks at what the robot does. The returned function ends that. */
  stopWhenHidden(document: Document): () => void {
    const look = (): void => {
      if (document.visibilityState === "hidden") {
        this.stop();
      }
    };
    document.addEventListener("visibilitychange", look);
    return () => { document.removeEventListener("visibilitychange", look); };
  }
}
