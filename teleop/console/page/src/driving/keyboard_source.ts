/** Driving by keys: a held key is the deadman. */

import type { Gear } from "../operating_data";
import { actionOf, dialogOpen, directionOf, gearOf, ownsKeys, spacePresses, stops, type Direction } from "./key_bindings";
import { RESTING, type DriveSource, type SourceReading } from "./drive_source";

/** A key that was held when everything counted as released repeats within this time [ms] if it is still held. */
const QUIET = 500;

export interface KeyHooks {
  /** Something was pressed or released. */
  changed(): void;
  /** The end of what is pressed would not be seen. */
  lost(): void;
  /** The space bar: stop. */
  stop(): void;
  gear(gear: Gear): void;
  /** Escape was pressed; a held one counts once. */
  escape(event: KeyboardEvent): void;
  /** Whether something drives now, so that the space bar stops it and presses no button. */
  driving(): boolean;
}

export class KeyboardSource implements DriveSource {
  readonly name = "keyboard";
  private readonly pressed = new Set<string>();
  /** Keys that were held when everything counted as released, with the time of their last sign of life [ms]. */
  private readonly doubtful = new Map<string, number>();
  private readonly listening = new AbortController();
  private spaceTaken = false;

  constructor(
    window: Window,
    private readonly document: Document,
    private readonly now: () => number,
    private readonly hooks: KeyHooks,
  ) {
    const { signal } = this.listening;
    window.addEventListener("keydown", (event) => { this.special(event); }, { signal, capture: true });
    window.addEventListener("keydown", (event) => { this.down(event); }, { signal });
    window.addEventListener("keyup", (event) => { this.up(event); }, { signal, capture: true });
    // A menu swallows the key-up; over the picture none opens.
    window.addEventListener("contextmenu", (event) => {
      if (!event.defaultPrevented) {
        this.letGo();
      }
    }, { signal });
    // Doubt begins when keys can arrive again.
    window.addEventListener("focus", () => { this.stillDoubtful(); }, { signal });
  }

  read(): SourceReading {
    if (this.pressed.size > 0 && (ownsKeys(this.document.activeElement) || dialogOpen(this.document))) {
      this.release();
    }
    const held = this.pressed.size + this.doubtful.size > 0;
    if (this.pressed.size === 0) {
      return held ? { ...RESTING, held: this.repeating() } : RESTING;
    }
    const directions = new Set([...this.pressed].map(directionOf));
    const axis = (plus: Direction, minus: Direction) => Number(directions.has(plus)) - Number(directions.has(minus));
    return { ...RESTING, held, active: true, forward: axis("forward", "backward"), turn: axis("left", "right") };
  }

  release(): void {
    for (const code of this.pressed) {
      this.doubtful.set(code, this.now());
    }
    this.pressed.clear();
  }

  dispose(): void {
    this.listening.abort();
    this.pressed.clear();
  }

  /** Handle what works everywhere on the page, before anything on it can keep the key for itself. */
  private special(event: KeyboardEvent): void {
    const action = actionOf(event.code);
    if (action === "escape" && !event.repeat && !event.isComposing) {
      this.hooks.escape(event);
    } else if (action === "stop" && stops(event.target)) {
      this.hooks.stop(); // and presses the button, which stops for good
    } else if (action === "stop" && (this.hooks.driving() || !(ownsKeys(event.target) || spacePresses(event.target)))) {
      this.spaceTaken = true;
      event.preventDefault();
      this.hooks.stop();
    }
  }

  private down(event: KeyboardEvent): void {
    const direction = directionOf(event.code);
    // With these held other keys mean something else, and macOS reports no key-up.
    if (event.ctrlKey || event.metaKey || event.altKey) {
      this.letGo();
      return;
    }
    if (event.defaultPrevented || ownsKeys(event.target) || dialogOpen(this.document)) {
      return;
    }
    const gear = gearOf(event.code);
    if (gear !== undefined && !event.repeat) {
      this.hooks.gear(gear);
    }
    if (direction === undefined) {
      return;
    }
    event.preventDefault(); // the page would scroll
    if (!this.pressed.has(event.code) && !event.repeat && this.trusted(event.code)) {
      this.pressed.add(event.code);
      this.hooks.changed();
    } else if (this.doubtful.has(event.code)) {
      this.doubtful.set(event.code, this.now());
    }
  }

  private up(event: KeyboardEvent): void {
    if (actionOf(event.code) === "stop" && this.spaceTaken) {
      this.spaceTaken = false;
      event.preventDefault(); // Firefox presses a button at key-up
    }
    this.doubtful.delete(event.code);
    if (this.pressed.delete(event.code)) {
      this.hooks.changed();
    }
  }

  private letGo(): void {
    if (this.pressed.size > 0) {
      this.hooks.lost();
    }
  }

  private stillDoubtful(): void {
    for (const code of this.doubtful.keys()) {
      this.doubtful.set(code, this.now());
    }
  }

  /** Whether a key is pressed anew: not one that never went up, and whose repetition goes on. */
  private trusted(code: string): boolean {
    const since = this.doubtful.get(code);
    if (since !== undefined && this.now() - since < QUIET) {
      return false;
    }
    this.doubtful.delete(code);
    return true;
  }

  private repeating(): boolean {
    return [...this.doubtful.values()].some((at) => this.now() - at < QUIET);
  }
}
