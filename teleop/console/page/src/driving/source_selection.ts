/** One input drives at a time: whoever drives keeps the robot until released, then the newest held one follows. */

import type { SourceName, SourceReading } from "./drive_source";

export class SourceSelection {
  private owner: SourceName | undefined;
  private active: SourceName[] = [];

  /** Return the input that drives; undefined if none is held. */
  choose(readings: ReadonlyMap<SourceName, SourceReading>): SourceName | undefined {
    const isActive = (name: SourceName) => readings.get(name)?.active === true;
    this.active = this.active.filter(isActive);
    for (const name of readings.keys()) {
      if (isActive(name) && !this.active.includes(name)) {
        this.active.push(name);
      }
    }
    if (this.owner === undefined || !isActive(this.owner)) {
      this.owner = this.active.at(-1);
    }
    return this.owner;
  }
}
