/** The stick on the screen: holding it is the deadman, and it begins where the thumb is put. */

import { signal } from "@preact/signals";
import { RESTING, withoutDeadZone, type DriveSource, type SourceReading } from "./drive_source";

const DEAD_ZONE = 0.12;

/** Deflection as drawn: right and down positive, -1 to 1; undefined while nobody holds it. */
export interface Knob {
  readonly x: number;
  readonly y: number;
  readonly counts: boolean;
}

interface Hold {
  readonly pointer: number;
  readonly x: number;
  readonly y: number;
  /** Way to full deflection [px]. */
  readonly radius: number;
  readonly counts: boolean;
  readonly knob: readonly [number, number];
}

export interface StickHooks {
  changed(): void;
  /** The system took the pointer away while it was held. */
  lost(): void;
}

export class StickSource implements DriveSource {
  readonly name = "stick";
  readonly knob = signal<Knob | undefined>(undefined);
  private hold: Hold | undefined;

  constructor(private readonly hooks: StickHooks) {}

  /** Take pointers from an element; returns what undoes it. */
  attach(pad: HTMLElement): () => void {
    const listening = new AbortController();
    const on = (name: "pointerdown" | "pointermove" | "pointerup" | "pointercancel" | "lostpointercapture", does: (event: PointerEvent) => void) => {
      pad.addEventListener(name, (event) => { does(event); }, { signal: listening.signal });
    };
    on("pointerdown", (event) => { this.down(pad, event); });
    on("pointermove", (event) => { this.move(event); });
    // Where there is this one, it comes at once; moves wait for the next picture, which slow graphics make late.
    pad.addEventListener("pointerrawupdate", (event) => {
      if (event instanceof PointerEvent) {
        this.move(event);
      }
    }, { signal: listening.signal });
    on("pointerup", (event) => { this.up(event); });
    on("pointercancel", (event) => { this.cancel(event); });
    on("lostpointercapture", (event) => { this.cancel(event); });
    pad.addEventListener("contextmenu", (event) => { event.preventDefault(); }, { signal: listening.signal });
    return () => {
      listening.abort();
      if (this.hold !== undefined) {
        this.hooks.lost();
        this.drop();
      }
    };
  }

  read(): SourceReading {
    if (this.hold === undefined) {
      return RESTING;
    }
    const [x, y] = this.hold.counts ? this.hold.knob : [0, 0];
    return {
      ...RESTING,
      held: true,
      active: this.hold.counts,
      forward: -withoutDeadZone(y, DEAD_ZONE) || 0,
      turn: -withoutDeadZone(x, DEAD_ZONE) || 0,
    };
  }

  release(): void {
    if (this.hold !== undefined) {
      this.set({ ...this.hold, counts: false });
    }
  }

  private down(pad: HTMLElement, event: PointerEvent): void {
    event.preventDefault();
    if (this.hold !== undefined || event.button !== 0) {
      return; // a second finger on the same stick
    }
    try {
      pad.setPointerCapture(event.pointerId);
    } catch {
      return; // it has gone up already: without capture no end of it would be seen
    }
    const size = Math.min(pad.clientWidth, pad.clientHeight);
    this.set({
      pointer: event.pointerId, x: event.clientX, y: event.clientY, radius: Math.max(30, 0.35 * size), counts: true, knob: [0, 0],
    });
    this.hooks.changed();
  }

  private move(event: PointerEvent): void {
    const { hold } = this;
    if (hold?.pointer !== event.pointerId) {
      return;
    }
    if (event.pointerType === "mouse" && event.buttons === 0) {
      this.up(event); // its release was not seen
      return;
    }
    const [x, y] = [(event.clientX - hold.x) / hold.radius, (event.clientY - hold.y) / hold.radius];
    const excess = Math.max(1, Math.hypot(x, y));
    if (Number.isFinite(excess)) {
      this.set({ ...hold, knob: [x / excess, y / excess] });
      this.hooks.changed();
    }
  }

  private up(event: PointerEvent): void {
    if (this.hold?.pointer === event.pointerId) {
      this.drop();
      this.hooks.changed();
    }
  }

  private cancel(event: PointerEvent): void {
    if (this.hold?.pointer === event.pointerId) {
      this.hooks.lost();
      this.drop();
    }
  }

  private drop(): void {
    this.hold = undefined;
    this.knob.value = undefined;
  }

  private set(hold: Hold): void {
    this.hold = hold;
    this.knob.value = { x: hold.knob[0], y: hold.knob[1], counts: hold.counts };
  }
}
