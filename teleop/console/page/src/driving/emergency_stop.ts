/** The emergency stop: pressed once, sent until the robot says that it is latched. */

import { effect, signal } from "@preact/signals";
import type { RobotCommands } from "../robot/robot_commands";
import type { RobotState } from "../robot/robot_state";
import { drivingTexts as texts } from "../texts/driving";
import type { ControlState } from "../values";

/** Times between the attempts [ms]; the last one holds for all further ones. */
const WAITS = [250, 250, 500, 1000] as const;

/** An e-stop that the robot has not confirmed. */
export interface PendingStop {
  /** When it was pressed, by the page's clock [ms]. */
  readonly sinceAt: number;
  readonly attempts: number;
  /** What the robot answered if it refused; empty else. */
  readonly refusal: string;
}

export class EmergencyStop {
  readonly pending = signal<PendingStop | undefined>(undefined);
  /** Whether the person is asked to confirm the reset. */
  readonly resetAsked = signal(false);
  /** Why the robot did not reset it; undefined if it did, or was not asked. */
  readonly resetRefused = signal<string | undefined>(undefined);
  private before: ControlState | undefined;
  private answered = false;
  private timer: ReturnType<typeof setTimeout> | undefined;
  private readonly stopWatching: () => void;

  constructor(
    private readonly commands: RobotCommands,
    private readonly state: RobotState,
    private readonly now: () => number,
  ) {
    this.stopWatching = effect(() => {
      const control = state.control.value;
      if (control?.estop === true) {
        this.seen(control);
      } else if (control !== undefined) {
        this.resetAsked.value = false;
        this.resetRefused.value = undefined;
      }
    });
  }

  /** Latch the e-stop, and go on trying until the robot's state says so. */
  press(): void {
    this.resetAsked.value = false;
    this.resetRefused.value = undefined;
    if (this.pending.peek() !== undefined) {
      this.attempt();
      return;
    }
    this.before = this.state.control.peek();
    this.answered = false;
    this.pending.value = { sinceAt: this.now(), attempts: 0, refusal: "" };
    this.attempt();
  }

  /** Ask the person whether the e-stop may be released. */
  askReset(): void {
    this.resetRefused.value = undefined;
    this.resetAsked.value = true;
  }

  /** Leave the robot stopped. */
  cancelReset(): void {
    this.resetAsked.value = false;
  }

  /** Release the e-stop, as the person has confirmed. */
  async confirmReset(): Promise<void> {
    if (!this.resetAsked.peek()) {
      return;
    }
    this.resetAsked.value = false;
    const answer = await this.commands.request("resetEstop");
    this.resetRefused.value = answer.success ? undefined : answer.message || texts.noReason;
  }

  dispose(): void {
    clearTimeout(this.timer);
    this.stopWatching();
  }

  private attempt(): void {
    const pending = this.pending.peek();
    if (pending === undefined) {
      return;
    }
    this.pending.value = { ...pending, attempts: pending.attempts + 1 };
    clearTimeout(this.timer);
    this.timer = setTimeout(() => { this.attempt(); }, WAITS[Math.min(pending.attempts, WAITS.length - 1)]);
    void this.call();
  }

  private async call(): Promise<void> {
    const answer = await this.commands.request("estop");
    const [pending, control] = [this.pending.peek(), this.state.control.peek()];
    if (answer.success) {
      this.answered = true;
      if (control?.estop === true) {
        this.seen(control);
      } else if (this.state.dialect.peek() === "plain") {
        this.done(); // no state will say so
      }
    } else if (pending !== undefined) {
      this.pending.value = { ...pending, refusal: answer.message || texts.noReason };
    }
  }

  /** Note a state with the e-stop latched; one from before the press may be from before somebody's reset. */
  private seen(control: ControlState): void {
    if (this.pending.peek() !== undefined && (control !== this.before || this.answered)) {
      this.done();
    }
  }

  private done(): void {
    clearTimeout(this.timer);
    this.pending.value = undefined;
  }
}
