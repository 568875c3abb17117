/** The gripper by goals: open, closed with a force, or to an opening. */

import { signal, type ReadonlySignal, type Signal } from "@preact/signals";
import { readGripEnd } from "../../link/message_checks/arm_messages";
import type { RobotWire } from "../../link/robot_wire";
import { readReply } from "../../link/service_calls";
import type { ArmInfo, ArmState, GripEnd } from "../../robot/arm";
import { linkTexts } from "../../texts/link";

/** What the gripper does: moves to an opening [m], or how that ended. */
export type Gripping =
  | { readonly moving: true; readonly opening: number }
  | { readonly moving: false; readonly end: GripEnd }
  | { readonly moving: false; readonly failed: string };

/** Force that holds a box of 20 g while it is lifted [N], as a share of what the gripper can. */
const GENTLE = 0.7;

export class GripperControl {
  readonly doing: ReadonlySignal<Gripping | undefined>;
  /** Largest force, as a share of the gripper's own. */
  readonly effort: Signal<number> = signal(GENTLE);
  readonly #doing = signal<Gripping | undefined>(undefined);
  #cancel: (() => void) | undefined;
  #number = 0;

  constructor(
    private readonly wire: Pick<RobotWire, "goal">, private readonly info: ReadonlySignal<ArmInfo | undefined>,
  ) {
    this.doing = this.#doing;
  }

  get moves(): boolean {
    return this.#cancel !== undefined;
  }

  /** Open it as far as it goes. */
  open(): void {
    this.to(this.info.peek()?.opening ?? 0);
  }

  /** Close it, on whatever is between its jaws. */
  close(): void {
    this.to(0);
  }

  /** Close it if it stands open, and open it if it is closed or holds something. */
  toggle(state: ArmState | undefined): void {
    const widest = this.info.peek()?.opening ?? 0;
    if (state !== undefined && (state.holding || state.opening < widest / 2)) {
      this.open();
    } else {
      this.close();
    }
  }

  /** Bring it to an opening [m]; `ended` is called once. */
  to(opening: number, ended: (well: boolean) => void = () => undefined): void {
    const info = this.info.peek();
    if (info === undefined) {
      return;
    }
    this.#number += 1;
    const number = this.#number;
    const command = { position: Math.max(0, Math.min(info.opening, opening)), max_effort: this.effort.peek() * info.force };
    const end = (doing: Gripping, well: boolean): void => {
      if (number === this.#number) {
        this.#cancel = undefined;
        this.#doing.value = doing;
      }
      ended(well);
    };
    this.#doing.value = { moving: true, opening };
    this.#cancel = this.wire.goal("/gripper_controller/gripper_cmd", "control_msgs/action/GripperCommand", { command }, {
      feedback: () => undefined,
      ended: (how) => {
        const read = readReply(how, readGripEnd);
        end(read.ok ? { moving: false, end: read.value } : { moving: false, failed: read.words }, read.ok);
      },
    });
    if (this.#cancel === undefined) {
      end({ moving: false, failed: linkTexts.answers.notConnected }, false);
    }
  }

  /** Stay where it is; what it holds it goes on holding. */
  stop(): void {
    this.#cancel?.();
  }
}
