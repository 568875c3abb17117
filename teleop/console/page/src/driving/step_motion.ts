/** Motion that the robot goes on with by itself once it was asked for. */

export interface StepMotion {
  /** Whether the robot drives, or will drive, what was asked for. */
  readonly moves: boolean;
  /** Cancel all of it. */
  stop(): void;
}
