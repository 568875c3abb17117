/** The button that gets the arm out of where it is stuck: the robot says what it would do, and does it. */

import { signal, type ReadonlySignal } from "@preact/signals";
import type { RobotWire } from "../../link/robot_wire";
import { armTexts as texts } from "../../texts/arm";

/** A planned motion takes some seconds; the robot answers when it is done [s]. */
const PATIENCE = 60;

export class WayOut {
  /** Whether the robot is at it. */
  readonly going: ReadonlySignal<boolean>;
  /** Why it did not work, in words; empty otherwise. */
  readonly failed: ReadonlySignal<string>;
  readonly #going = signal(false);
  readonly #failed = signal("");

  constructor(private readonly wire: Pick<RobotWire, "call" | "trigger">) {
    [this.going, this.failed] = [this.#going, this.#failed];
  }

  async go(): Promise<void> {
    this.#failed.value = "";
    this.#going.value = true;
    const answer = await this.wire.trigger("/arm/way_out", {}, PATIENCE);
    this.#going.value = false;
    this.#failed.value = answer.success ? "" : texts.notOut(answer.message);
  }

  /** Stop it; a service has no goal that could be cancelled, so all that moves the arm is paused for a moment. */
  async stop(): Promise<void> {
    if (this.#going.peek()) {
      const pause = (data: boolean) => this.wire.call("/servo_node/pause_servo", { data });
      await pause(true);
      await pause(false);
    }
  }
}
