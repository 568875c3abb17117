/** A deadman without a stick: held, it lets the robot go on with what it was told. */

import { RESTING, type DriveSource, type SourceReading } from "./drive_source";

export class HoldSource implements DriveSource {
  readonly name = "hold";
  #held = false;
  #counts = false;

  hold(): void {
    this.#held = this.#counts = true;
  }

  letGo(): void {
    this.#held = this.#counts = false;
  }

  read(): SourceReading {
    return { ...RESTING, held: this.#held, active: this.#counts };
  }

  release(): void {
    this.#counts = false;
  }
}
