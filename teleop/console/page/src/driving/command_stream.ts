/** The stream of commands: neutral first, motion at 20 Hz, zeros at the end, then silence. */

import type { DriveChannel } from "./drive_channel";
import type { Wanted } from "./gears";

/** Period of the commands [ms]: a tenth of the robot's watchdog. */
export const PERIOD = 50;
/** Shortest time between two commands that differ [ms]: the robot's tick, of whose commands only the newest counts. */
export const SPACING = 20;
/** Zeros at the end, the first one included. */
const ZEROS = 3;
/** A command is due this much before its period is over [ms]: half the time to the loop's next look. */
const EARLY = 8;

type Phase = "silent" | "starting" | "moving" | "ending";

export class CommandStream {
  private phase: Phase = "silent";
  private sentAt = 0;
  /** When a command differed from the one before: repeated ones hold up no other. */
  private changedAt = 0;
  private zerosLeft = 0;
  private last: Wanted | undefined;
  private channel: DriveChannel | undefined;

  /** Whether the deadman is held as far as the robot knows. */
  get driving(): boolean {
    return this.phase === "starting" || this.phase === "moving";
  }

  /** What was sent last, while it moves the robot. */
  get sent(): Wanted | undefined {
    return this.phase === "moving" ? this.last : undefined;
  }

  /**
   * Send what is due.
   *
   * @param now Time [ms].
   * @param channel Way to the robot; a stream that has begun ends on the way on which it began.
   * @param wanted Motion to ask for; undefined if nobody holds an input.
   * @returns False if something was due and could not be sent.
   */
  step(now: number, channel: DriveChannel | undefined, wanted: Wanted | undefined): boolean {
    if (wanted === undefined || channel === undefined) {
      return this.rest(now);
    }
    if (!this.driving) {
      this.channel = channel;
      return this.begin(now);
    }
    const news = this.phase === "moving" && changed(this.last, wanted);
    if (news ? now - this.changedAt < SPACING : now - this.sentAt < PERIOD - EARLY) {
      return true;
    }
    this.changedAt = news ? now : this.changedAt;
    this.phase = "moving";
    this.sentAt = now;
    this.last = wanted;
    return this.channel?.move(wanted) ?? false;
  }

  /** Begin again with a neutral command: for a robot that has not armed, and when another input goes on. */
  rearm(now: number): boolean {
    return this.driving ? this.begin(now) : true;
  }

  /** End at once. Returns false if it could not be sent. */
  stop(now: number): boolean {
    return this.driving ? this.rest(now) : true;
  }

  /** Leave out the zeros that would follow the first one: a robot whose e-stop is latched complains of each command. */
  fallSilent(): void {
    if (this.phase === "ending" && this.zerosLeft < ZEROS) {
      this.phase = "silent";
    }
  }

  private begin(now: number): boolean {
    this.phase = "starting";
    this.sentAt = now;
    this.last = undefined;
    return this.channel?.neutral() ?? false;
  }

  private rest(now: number): boolean {
    if (this.phase === "silent") {
      return true;
    }
    const first = this.phase !== "ending";
    if (first) {
      this.phase = "ending";
      this.zerosLeft = ZEROS;
    } else if (now - this.sentAt < PERIOD - EARLY) {
      return true;
    }
    this.sentAt = now;
    const sent = this.channel?.release() ?? false;
    this.zerosLeft -= Number(sent); // one that cannot be sent is sent as soon as it can
    if (this.zerosLeft === 0) {
      this.phase = "silent";
    }
    return sent || !first;
  }
}

/** Whether a command differs enough to be sent before its time. */
function changed(last: Wanted | undefined, wanted: Wanted): boolean {
  return (
    last === undefined
    || last.turbo !== wanted.turbo
    || Math.abs(last.forward - wanted.forward) > 0.01
    || Math.abs(last.turn - wanted.turn) > 0.01
  );
}
