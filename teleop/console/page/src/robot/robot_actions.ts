/** What the page can ask of a robot that takes steps, and of one with a camera. The link implements it. */

import type { Answer } from "../values";

/** One step: straight on [m], a turn on the spot [rad, left positive], or both as an arc. */
export interface StepGoal {
  readonly distance: number;
  readonly angle: number;
  /** Speed [m/s], of a turn on the spot [rad/s]; 0 for the robot's own. */
  readonly speed: number;
  /** Whether it is driven only while the deadman is held, and measured in the map. */
  readonly held?: boolean;
}

/** What the robot says of a step that has not ended. */
export interface StepProgress {
  readonly moving: boolean;
  /** Steps in front of it. */
  readonly ahead: number;
  /** Driven so far [m], turned so far [rad]. */
  readonly distance: number;
  readonly angle: number;
}

/** How a step ended. */
export interface StepEnd {
  /** `done`, or in a word why not; empty if the robot never began it. */
  readonly outcome: string;
  /** The robot's words. */
  readonly message: string;
  readonly distance: number;
  readonly angle: number;
  /** From the first command to the end [s]. */
  readonly duration: number;
}

export interface StepListener {
  progress(progress: StepProgress): void;
  /** Called once, also when the connection ends. */
  ended(end: StepEnd): void;
}

export interface StepCommands {
  /** Send a step; returns what cancels it, or undefined if it cannot be sent now. */
  step(goal: StepGoal, listener: StepListener): (() => void) | undefined;
}

/** A photograph, or why there is none. */
export interface PhotoAnswer extends Answer {
  /** Name of the stored file; empty if there is none. */
  readonly name: string;
}

export interface CameraCommands {
  /** Have the robot take a photograph at full resolution and keep it. */
  takePhoto(): Promise<PhotoAnswer>;
  /** Ask for a ticket, which stands for the token in an address for a minute; it is the answer's message. */
  videoTicket(): Promise<Answer>;
}
