/** What the page can ask of the robot. The link implements it; tests give their own. */

import type { Answer, HintPreview, PlanarPose } from "../values";

/** What is asked of the robot by a name alone. */
export type Wish = "estop" | "resetEstop" | "takeOver" | "ask" | "give" | "refuse" | "undo" | "find";

export interface RobotCommands {
  /** Send a Joy: axes[1] forward, axes[0] turn (left positive), buttons[4] deadman, buttons[5] turbo. False if it cannot be sent now. */
  joy(forward: number, turn: number, deadman: boolean, turbo: boolean): boolean;
  /** Send a velocity [m/s, rad/s] on /cmd_vel, for a robot that takes no Joy. */
  velocity(linear: number, angular: number): boolean;
  /** Ask for something that needs no more words; the promise is never rejected. */
  request(wish: Wish): Promise<Answer>;
  /** Hint that the robot is here; sigmas [m, rad] say how sure the operator is. The verdict comes as a message. */
  hint(pose: PlanarPose, sigma: number, headingSigma: number): boolean;
  /** Score a pose without changing anything; undefined if it was overtaken by a newer one or cannot be had. */
  previewHint(pose: PlanarPose): Promise<HintPreview | undefined>;
  /** Log in with a token. */
  authenticate(token: string): void;
}
