/** The guided first drive: tasks that are ticked in turn, each by what the robot itself reports. */

import { batch, computed, effect, signal, type ReadonlySignal, type Signal } from "@preact/signals";
import type { RobotState } from "../robot/robot_state";
import type { Task } from "../texts/guide";
import type { Carrier } from "./carrier";

const DRIVING: readonly Task[] = ["forward", "curve", "rest", "stop"];
const WITH_PLAYGROUND: readonly Task[] = [...DRIVING, "carried", "placed"];

/** Measured speeds that count as driving, below those of the lowest gear, and as standing [m/s, rad/s]; chosen. */
const DRIVES = { linear: 0.12, angular: 0.15 };
const STANDS = { linear: 0.02, angular: 0.05 };

type Report = Pick<RobotState, "control" | "motion" | "status" | "verdict">;

export class FirstDrive {
  /** What there is to do, in its order; without a playground nobody can carry the robot off. */
  readonly tasks: ReadonlySignal<readonly Task[]>;
  /** What is to be done now; undefined once all is done. */
  readonly next: ReadonlySignal<Task | undefined>;
  readonly shown: ReadonlySignal<boolean>;
  readonly #done = signal(0);
  readonly #closed: Signal<boolean>;
  readonly #carrier: Carrier;

  /** @param closed Whether it was closed before; kept by whoever made it. */
  constructor(state: RobotState, carrier: Carrier, closed: Signal<boolean>) {
    this.#carrier = carrier;
    this.#closed = closed;
    this.tasks = computed(() => (carrier.there.value ? WITH_PLAYGROUND : DRIVING));
    this.next = computed(() => this.tasks.value[this.#done.value]);
    this.shown = computed(
      () => !closed.value && state.dialect.value === "farsteer" && state.session.value?.mayDrive === true,
    );
    // What the robot said before a task was set does not count for it.
    let before: { readonly task: Task; readonly verdict: unknown } | undefined;
    effect(() => {
      const task = this.next.value;
      if (!this.shown.value || task === undefined) {
        return;
      }
      if (before?.task !== task) {
        before = { task, verdict: state.verdict.peek() };
      }
      if (REPORTED[task](state, before.verdict)) {
        this.#done.value = this.#done.peek() + 1;
      }
    });
  }

  isDone(task: Task): boolean {
    return this.tasks.value.indexOf(task) < this.#done.value;
  }

  /** Have the robot put down elsewhere; returns why not, or an empty text. */
  carry(): Promise<string> {
    return this.#carrier.carry();
  }

  close(): void {
    this.#closed.value = true;
  }

  /** Begin anew. */
  again(): void {
    batch(() => {
      this.#done.value = 0;
      this.#closed.value = false;
    });
  }
}

/** Whether the robot reports what a task asks for. */
const REPORTED: Readonly<Record<Task, (report: Report, verdictBefore: unknown) => boolean>> = {
  forward: ({ motion }) => (motion.value?.linear ?? 0) > DRIVES.linear,
  curve: ({ motion }) =>
    (motion.value?.linear ?? 0) > DRIVES.linear && Math.abs(motion.value?.angular ?? 0) > DRIVES.angular,
  rest: ({ control, motion }) =>
    control.value?.linear === 0 && control.value.angular === 0 && motion.value !== undefined
    && Math.abs(motion.value.linear) < STANDS.linear && Math.abs(motion.value.angular) < STANDS.angular,
  stop: ({ control }) => control.value?.estop === true,
  carried: ({ status }) => ["suspect", "lost", "relocalising"].includes(status.value?.health ?? ""),
  placed: ({ verdict }, before) => verdict.value !== before && verdict.value?.verdict === "accepted",
};
