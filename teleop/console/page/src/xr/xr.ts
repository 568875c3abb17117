/** The page in a headset: one session after the other, and what stops the robot when the person may be gone. */

import { signal, type ReadonlySignal } from "@preact/signals";
import type { Arm } from "../arm/arm";
import type { Joined } from "../driving/driving_environment";
import type { Loss } from "../driving/page_watch";
import type { Standing } from "../scene/immersion";
import { FRAMES_MISSING, HeadsetSource } from "./headset_source";
import { OperatorRoom, type RoomParts } from "./operator_room";

export const MODES = ["immersive-vr", "immersive-ar"] as const;
export type Mode = (typeof MODES)[number];

/** How often it is seen to that frames come [ms]. */
const WATCH = 50;
/** How one stands in a frame that nobody sees. */
const AS_BEFORE: Standing = { scale: 1, ground: true };

export interface HeadsetParts extends Omit<RoomParts, "leave"> {
  readonly arm: ReadonlySignal<{ readonly arm: Arm } | undefined>;
}

export class Headset {
  /** What is shown in the headset; undefined while it shows nothing of this page. */
  readonly mode: ReadonlySignal<Mode | undefined>;
  readonly room: OperatorRoom;
  readonly #mode = signal<Mode | undefined>(undefined);
  readonly #source: HeadsetSource;
  #session: XRSession | undefined;
  #joined: Joined | undefined;
  #frameAt = -Infinity;
  #gone = true;
  /** In the person's own room: what is looked at. */
  #hits: XRHitTestSource | undefined;
  #hit: DOMPointReadOnly | undefined;

  constructor(private readonly xr: XRSystem, private readonly parts: HeadsetParts) {
    this.mode = this.#mode;
    this.room = new OperatorRoom({ ...parts, leave: () => { this.leave(); } });
    this.#source = new HeadsetSource(parts.now, () => { this.#lose(this.#asleep ? "headset-off" : "controller"); });
  }

  /**
   * Show the page in the headset; call it while the person presses, for browsers allow it only then.
   *
   * @throws Error If the headset does not begin.
   */
  async enter(mode: Mode): Promise<void> {
    if (this.#session !== undefined) {
      return;
    }
    const session = await this.xr.requestSession(mode, { requiredFeatures: ["local-floor"], optionalFeatures: ["hand-tracking", "hit-test"] });
    this.#session = session;
    const listening = new AbortController();
    const { signal: ended } = listening;
    // From the very end of the session on, before anybody else hears of it.
    session.addEventListener("end", () => { this.#lose("headset-left"); }, { signal: ended });
    try {
      await this.parts.immersion.begin(session, (interval, frame) => this.#frame(interval, frame), () => { listening.abort(); this.#ended(); });
    } catch (error) {
      listening.abort();
      this.#ended();
      throw error;
    }
    if (this.#session === session) {
      this.#begin(mode, session, ended);
    }
  }

  leave(): void {
    this.#lose("headset-left");
    void this.#session?.end().catch(() => undefined);
  }

  /** What a test or a measurement asks for; undefined while nothing is shown. */
  figures() {
    return this.#mode.peek() && { ...this.room.figures(), frameTimes: this.parts.immersion.frameTimes() };
  }

  get #asleep(): boolean {
    return this.parts.now() - this.#frameAt >= FRAMES_MISSING;
  }

  #begin(mode: Mode, session: XRSession, ended: AbortSignal): void {
    const { driving, arm, immersion } = this.parts;
    this.#joined = driving.join(this.#source);
    this.#frameAt = this.parts.now();
    this.#gone = false;
    this.room.begin(session.environmentBlendMode === "opaque");
    const watch = setInterval(() => {
      if (this.#asleep && !this.#gone) {
        this.#lose("headset-off");
      }
    }, WATCH);
    ended.addEventListener("abort", () => { clearInterval(watch); });
    session.addEventListener("visibilitychange", () => {
      if (session.visibilityState !== "visible") {
        this.#lose("headset-off");
      }
    }, { signal: ended });
    session.addEventListener("selectstart", (event) => {
      const space = immersion.space;
      if (space !== null) {
        this.room.inputs.update(event.frame, space);
        this.room.selectStart(event.inputSource.handedness);
      }
    }, { signal: ended });
    session.addEventListener("selectend", () => { this.room.selectEnd(); }, { signal: ended });
    // Where the origin went is told by few browsers: what the head does in the next frame says it as well.
    immersion.space?.addEventListener("reset", () => {
      this.#lose("recentred");
      this.room.recentre();
    }, { signal: ended });
    const feed = arm.peek()?.arm.feed;
    if (feed !== undefined) {
      const before = feed.onRumble;
      feed.onRumble = (strength) => { before(strength); this.room.arm.feel(strength); };
      ended.addEventListener("abort", () => { feed.onRumble = before; });
    }
    this.#hitTest(session, ended);
    this.#mode.value = mode;
  }

  #frame(interval: number, frame: XRFrame): Standing {
    const { immersion, arm } = this.parts;
    const space = immersion.space;
    if (space === null || frame.session.visibilityState !== "visible") {
      return AS_BEFORE;
    }
    this.#frameAt = this.parts.now();
    this.#gone = false;
    this.#hit = this.#hits && frame.getHitTestResults(this.#hits)[0]?.getPose(space)?.transform.position;
    return this.room.frame(interval, frame, space, this.#source, arm.value?.arm);
  }

  /** Stop whatever this page moves: the person may be gone. */
  #lose(loss: Loss): void {
    this.#gone = true;
    this.#source.clear();
    this.room.lose();
    this.room.arm.lose(this.parts.arm.peek()?.arm);
    this.#joined?.lose(loss);
  }

  #ended(): void {
    this.#joined?.leave();
    this.#joined = this.#session = undefined;
    this.room.end();
    this.#mode.value = undefined;
  }

  /** In the person's own room, the building is put where the trigger is pulled at something. */
  #hitTest(session: XRSession, ended: AbortSignal): void {
    const { space } = this.parts.immersion;
    if (session.environmentBlendMode === "opaque" || space === null || session.requestHitTestSource === undefined) {
      return;
    }
    void session.requestReferenceSpace("viewer").then((viewer) => session.requestHitTestSource?.({ space: viewer })).then((source) => {
      this.#hits = source;
      session.addEventListener("select", () => {
        if (this.#hit !== undefined && this.room.stand.peek() === "table" && !this.room.pointsAtBoard) {
          this.room.putTable(this.#hit);
        }
      }, { signal: ended });
    }, () => undefined); // a headset without it has its table before the operator
    ended.addEventListener("abort", () => { this.#hits = this.#hit = undefined; });
  }
}
