/** Commands that write down what was asked of the robot. */

import type { RobotCommands } from "../../src/robot/robot_commands";
import type { Answer, HintPreview, PlanarPose } from "../../src/values";

export class RecordingCommands implements RobotCommands {
  readonly hints: { pose: PlanarPose; sigma: number; headingSigma: number }[] = [];
  readonly previews: PlanarPose[] = [];
  readonly tokens: string[] = [];
  connected = true;
  answer: Answer = { success: true, message: "done" };
  explained = 0.93;

  joy(): boolean { return this.connected; }
  velocity(): boolean { return this.connected; }
  request(): Promise<Answer> { return Promise.resolve(this.answer); }
  authenticate(token: string): void { this.tokens.push(token); }

  hint(pose: PlanarPose, sigma: number, headingSigma: number): boolean {
    if (this.connected) {
      this.hints.push({ pose, sigma, headingSigma });
    }
    return this.connected;
  }

  previewHint(pose: PlanarPose): Promise<HintPreview | undefined> {
    this.previews.push(pose);
    return Promise.resolve({ pose, explained: this.explained, present: 0.41 });
  }
}
