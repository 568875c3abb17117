/** A robot that writes down steps and leaves their end to the test. */

import type { StepCommands, StepGoal, StepListener } from "../../src/robot/robot_actions";

export class RecordingSteps implements StepCommands {
  readonly sent: { goal: StepGoal; listener: StepListener }[] = [];
  /** Numbers of the steps whose cancellation was asked for. */
  readonly cancelled: number[] = [];
  connected = true;

  step(goal: StepGoal, listener: StepListener): (() => void) | undefined {
    if (!this.connected) {
      return undefined;
    }
    const number = this.sent.push({ goal, listener }) - 1;
    return () => { this.cancelled.push(number); };
  }
}
