/** From inputs to commands: which input drives, what it asks for, and whether the robot follows. */

import type { Gear } from "../operating_data";
import type { ControlState } from "../values";
import { ArmingWatch } from "./arming_watch";
import { CommandStream } from "./command_stream";
import type { DriveChannel } from "./drive_channel";
import type { DriveSource, SourceName, SourceReading } from "./drive_source";
import { geared, type Wanted } from "./gears";
import { SourceSelection } from "./source_selection";

/** What the page sends: deflections after the gear. */
export interface Sending extends Wanted {
  readonly source: SourceName;
}

/** What a step came to: a command could not be sent, or the robot does not listen any more. */
export type StepResult = "fine" | "began" | "unsent" | "refused";

export class DriveLoop {
  private readonly selection = new SourceSelection();
  private readonly stream = new CommandStream();
  private readonly arming = new ArmingWatch();
  private source: SourceName | undefined;

  constructor(private readonly sources: DriveSource[]) {}

  /** Let one more input drive; returns what takes it away. */
  join(source: DriveSource): () => void {
    this.sources.push(source);
    return () => { this.sources.splice(this.sources.indexOf(source), 1); };
  }

  /** Whether the deadman is held as far as the robot knows. */
  get driving(): boolean {
    return this.stream.driving;
  }

  get sending(): Sending | undefined {
    const { sent } = this.stream;
    return sent && this.source && { ...sent, source: this.source };
  }

  poll(now: number): void {
    for (const source of this.sources) {
      source.poll?.(now);
    }
  }

  read(): ReadonlyMap<SourceName, SourceReading> {
    return new Map(this.sources.map((source) => [source.name, source.read()]));
  }

  /** Count everything as released, and say so to the robot at once. */
  releaseAll(now: number): void {
    for (const source of this.sources) {
      source.release();
    }
    this.stream.stop(now);
  }

  /** Send no more than the one command that lets go. */
  fallSilent(): void {
    this.stream.fallSilent();
  }

  /**
   * Send what is due.
   *
   * @param now Time [ms].
   * @param channel Way to the robot.
   * @param gear Gear that is engaged.
   * @param control The robot's newest state; undefined for a robot that reports none.
   */
  step(now: number, channel: DriveChannel, gear: Gear, control: ControlState | undefined): StepResult {
    const readings = this.read();
    const source = this.selection.choose(readings);
    const reading = source && readings.get(source);
    const wanted = reading && geared(reading.forward, reading.turn, gear, reading.turbo);
    const was = this.stream.driving;
    let sent = true;
    if (was && source !== undefined && source !== this.source) {
      sent = this.stream.rearm(now);
    }
    this.source = source;
    sent = this.stream.step(now, channel, wanted) && sent;
    if (!sent) {
      return "unsent";
    }
    if (!this.stream.driving) {
      return "fine";
    }
    if (!was) {
      this.arming.begin(now);
    }
    const verdict = this.arming.judge(now, control);
    if (verdict === "rearm" && !this.stream.rearm(now)) {
      return "unsent";
    }
    return verdict === "refused" ? "refused" : was ? "fine" : "began";
  }
}
