/** Who drives: asking for the robot, giving it, refusing it, taking it over. */

import { computed, signal, type ReadonlySignal } from "@preact/signals";
import type { RobotCommands } from "../robot/robot_commands";
import type { RobotState } from "../robot/robot_state";
import { drivingTexts as texts } from "../texts/driving";
import type { ControlState, Session } from "../values";

const DONE = { ask: texts.asked, give: texts.given, refuse: texts.refused, takeOver: texts.tookOver };

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

  async request(wish: keyof typeof DONE): Promise<void> {
    this.outcome.value = "";
    const answer = await this.commands.request(wish);
    this.outcome.value = answer.success ? DONE[wish] : texts.notDone(answer.message || texts.noReason);
  }
}
