/** Who drives: asking for the robot, giving it, refusing it, taking it over. */

import { computed, signal, type ReadonlySignal } from "@preact/signals";
import type { RobotCommands } from "../robot/robot_commands";
import type { RobotState } from "../robot/robot_state";
import { drivingTexts as texts } from "../texts/driving";
import type { Answer, ControlState, Session } from "../values";
import { wordsOf } from "./emergency_stop";

export interface Turns {
  /** Who drives. */
  readonly driver: "nobody" | "me" | "other";
  /** Name of whoever drives. */
  readonly name: string;
  /** Whether I have asked for the robot and wait for the driver's answer. */
  readonly waiting: boolean;
  /** Who asks me for the robot; empty if nobody does. */
  readonly askedBy: string;
  readonly mayAsk: boolean;
  readonly mayTakeOver: boolean;
}

/** Make out who drives, and what this page may do about it. */
export function turnsOf(control: ControlState | undefined, session: Session | undefined): Turns {
  const name = control?.controller ?? "";
  const driver = name === "" ? "nobody" : name === session?.name ? "me" : "other";
  const asking = control?.asking ?? 0;
  const waiting = asking !== 0 && asking === session?.client;
  return {
    driver,
    name,
    waiting,
    askedBy: driver === "me" && asking !== 0 && !waiting ? control?.askingName || texts.somebody(asking) : "",
    mayAsk: driver === "other" && session?.mayDrive === true && asking === 0,
    mayTakeOver: driver !== "me" && session?.mayDrive === true && session.mayTakeOver,
  };
}

export class TurnTaking {
  readonly turns: ReadonlySignal<Turns>;
  /** What came of the last request, in words; empty while there is nothing to say. */
  readonly outcome = signal("");

  constructor(private readonly commands: RobotCommands, state: RobotState) {
    this.turns = computed(() => turnsOf(state.control.value, state.session.value));
  }

  ask(): Promise<void> {
    return this.request(() => this.commands.askForControl(), texts.asked);
  }

  give(): Promise<void> {
    return this.request(() => this.commands.giveControl(), texts.given);
  }

  refuse(): Promise<void> {
    return this.request(() => this.commands.refuseControl(), texts.refused);
  }

  takeOver(): Promise<void> {
    return this.request(() => this.commands.takeOver(), texts.tookOver);
  }

  private async request(call: () => Promise<Answer>, done: string): Promise<void> {
    this.outcome.value = "";
    try {
      const answer = await call();
      this.outcome.value = answer.success ? done : texts.notDone(answer.message || texts.noReason);
    } catch (error) {
      this.outcome.value = texts.notDone(wordsOf(error));
    }
  }
}
