/** Notices that the robot has begun anew: another identity, another map, or a clock that went back. */

import type { MapInfo } from "../values";

/** Topics come from several programs, each of which is a little late in its own way [s]. */
const CLOCK_TOLERANCE = 2;
/** A topic whose clock goes back more often has two publishers, each with a clock of its own. */
const MOST_JUMPS = 3;

export type NewRun = "first" | "run" | "map" | "clock";

export class RunWatch {
  readonly #stamps = new Map<string, number>();
  readonly #jumps = new Map<string, number>();
  #info: MapInfo | undefined;

  /** Why what is known of the robot is void; undefined if it is not. */
  mapInfo(info: MapInfo): NewRun | undefined {
    const before = this.#info;
    this.#info = info;
    if (before === undefined) {
      return "first";
    }
    if (before.run !== info.run) {
      this.#stamps.clear();
      return before.sha256 === info.sha256 ? "run" : "map";
    }
    return before.sha256 === info.sha256 ? undefined : "map";
  }

  /** The same by a message's stamp [s]. */
  stamp(topic: string, stamp: number): NewRun | undefined {
    const before = this.#stamps.get(topic);
    if (before === undefined || stamp >= before - CLOCK_TOLERANCE) {
      this.#stamps.set(topic, stamp);
      return undefined;
    }
    const jumps = (this.#jumps.get(topic) ?? 0) + 1;
    this.#jumps.set(topic, jumps);
    if (jumps > MOST_JUMPS) {
      return undefined;
    }
    this.#stamps.clear();
    this.#stamps.set(topic, stamp);
    return "clock";
  }

  /** Know nothing: another robot answers. */
  clear(): void {
    this.#stamps.clear();
    this.#jumps.clear();
    this.#info = undefined;
  }
}
