/** Planned moves: the robot finds a way, the picture shows it, and the arm goes on as long as a person holds it to that. */

import { signal, type ReadonlySignal } from "@preact/signals";
import { readMoveEnd, readMoveProgress } from "../../link/message_checks/arm_messages";
import { check } from "../../link/message_checks/field";
import type { RobotWire } from "../../link/robot_wire";
import { readReply } from "../../link/service_calls";
import type { ArmPath, MoveEnd, MoveProgress } from "../../robot/arm";
import { linkTexts } from "../../texts/link";
import type { Pose } from "../../values";

/** Where the arm shall go: a named pose, angles of its joints [rad], or a pose of its tip in its base. */
export type MoveGoal =
  | { readonly name: string }
  | { readonly angles: readonly number[] }
  | { readonly pose: Pose };

/** A move that has not ended. */
export interface PendingMove {
  /** Its name for people. */
  readonly title: string;
  readonly state: MoveProgress["state"];
  readonly share: number;
  /** The way; empty while it is looked for. */
  readonly path: ArmPath;
}

export interface EndedMove {
  readonly title: string;
  readonly end: MoveEnd;
}

export class MoveControl {
  readonly pending: ReadonlySignal<PendingMove | undefined>;
  readonly last: ReadonlySignal<EndedMove | undefined>;
  readonly #pending = signal<PendingMove | undefined>(undefined);
  readonly #last = signal<EndedMove | undefined>(undefined);
  #cancel: (() => void) | undefined;
  #number = 0;

  constructor(private readonly wire: Pick<RobotWire, "goal">) {
    [this.pending, this.last] = [this.#pending, this.#last];
  }

  /**
   * Ask for a move; one that has not ended gives way to it. The arm waits until the way is confirmed.
   *
   * @param ended Called once; with whether the arm is there.
   */
  ask(title: string, goal: MoveGoal, ended: (well: boolean) => void = () => undefined): void {
    this.#number += 1;
    const number = this.#number;
    const end = (how: MoveEnd): void => {
      if (number === this.#number) {
        this.#cancel = undefined;
        this.#pending.value = undefined;
        this.#last.value = { title, end: how };
      }
      ended(how.outcome === "done");
    };
    this.#last.value = undefined;
    this.#pending.value = { title, state: "planning", share: 0, path: [] };
    const cancel = this.wire.goal("/arm/move", "farsteer_msgs/action/ArmMove", { ...message(goal), preview: false, hold_to_run: true }, {
      feedback: (values) => {
        const read = check(readMoveProgress, values);
        if (read.ok && number === this.#number) {
          const { state, share, path } = read.value;
          this.#pending.value = { title, state, share, path: path.length > 0 ? path : this.#pending.peek()?.path ?? [] };
        }
      },
      ended: (how) => {
        const read = readReply(how, readMoveEnd);
        end(read.ok ? read.value : { outcome: "", message: read.words });
      },
    });
    if (cancel === undefined) {
      end({ outcome: "", message: linkTexts.answers.notConnected });
    } else if (number === this.#number) {
      this.#cancel = cancel;
    }
  }

  /** Give the move up. */
  stop(): void {
    this.#cancel?.();
  }
}

function message(goal: MoveGoal): object {
  return "pose" in goal ? { pose: { header: { frame_id: "arm_base" }, pose: goal.pose } } : goal;
}
