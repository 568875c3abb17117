/** What holds the arm: one input at a time, whose wishes are sent until it lets go or the person may be gone. */

import { signal, type ReadonlySignal } from "@preact/signals";
import type { Driving } from "../../driving/driving";
import { SleepWatch, watchPage, type Loss } from "../../driving/page_watch";
import type { ArmState } from "../../robot/arm";
import { armTexts as texts } from "../../texts/arm";
import { drivingTexts } from "../../texts/driving";
import { ArmStream } from "./arm_stream";
import type { ArmWish } from "./arm_wish";
import { FollowingWatch } from "./following_watch";

export type ArmInput = "keys" | "gamepad" | "gizmo" | "slider" | "button" | "headset";

/** What of the browser it needs. */
export interface HoldEnvironment {
  readonly window: Window;
  readonly document: Document;
  /** Monotonic time [ms], and the time of the day, which goes on while the computer sleeps. */
  now(): number;
  wallNow(): number;
}

interface Held {
  readonly input: ArmInput;
  readonly wish: (now: number) => ArmWish;
}

/** Period at which the inputs are looked at [ms]: that of the robot's ticks. */
const LOOK = 20;

export class ArmHold {
  readonly input: ReadonlySignal<ArmInput | undefined>;
  /** Why everything counts as released, in words; empty since the last press. */
  readonly stopped: ReadonlySignal<string>;
  /** Called when everything counts as released: each input waits until it is let go and pressed again. */
  readonly onLoss = new Set<() => void>();
  /** Called before each look, for inputs that are polled. */
  readonly onLook = new Set<(now: number) => void>();
  readonly #input = signal<ArmInput | undefined>(undefined);
  readonly #stopped = signal("");
  readonly #stream: ArmStream;
  readonly #watch = new FollowingWatch();
  readonly #sleep: SleepWatch;
  readonly #undo: (() => void)[] = [];
  #held: Held | undefined;

  /**
   * @param send Sends a wish; false if it cannot be sent now.
   * @param driving Says whether this page may move the robot, and whether it drives.
   * @param state The arm's newest state.
   */
  constructor(
    send: (wish: ArmWish) => boolean,
    private readonly driving: Pick<Driving, "sending" | "status">,
    private readonly state: ReadonlySignal<ArmState | undefined>,
    private readonly environment: HoldEnvironment,
  ) {
    const { window, document } = environment;
    [this.input, this.stopped] = [this.#input, this.#stopped];
    this.#stream = new ArmStream(send);
    this.#sleep = new SleepWatch(() => environment.now(), () => environment.wallNow());
    const timer = setInterval(() => { this.#look(); }, LOOK);
    this.#undo.push(
      () => { clearInterval(timer); },
      watchPage(window, document, (loss) => { this.#lose(loss); }),
      driving.status.subscribe(() => { this.#check(); }),
    );
  }

  /** Why nothing moves the arm by this page; empty if something may. */
  get refusal(): string {
    const { blocked, words } = this.driving.status.peek();
    if (blocked !== undefined) {
      return words;
    }
    return this.driving.sending.peek() === undefined ? "" : texts.wheels;
  }

  /** Have an input move the arm, as long as it does not end that; false if the arm is not to be moved now. */
  begin(input: ArmInput, wish: (now: number) => ArmWish): boolean {
    const refusal = this.refusal;
    if (refusal !== "" || this.#held !== undefined) {
      this.#stopped.value = refusal;
      return false;
    }
    const now = this.environment.now();
    this.#held = { input, wish };
    this.#stopped.value = "";
    this.#watch.begin(now);
    this.#input.value = input;
    this.#step(now);
    return true;
  }

  /** Let go, if it is this input that holds the arm. */
  end(input: ArmInput): void {
    if (this.#held?.input === input) {
      this.#letGo();
    }
  }

  /** Count everything as released, because of an order to stop. */
  release(words = ""): void {
    if (this.#held !== undefined) {
      this.#letGo();
      this.#stopped.value = words;
      for (const lost of this.onLoss) {
        lost();
      }
    }
  }

  dispose(): void {
    this.release();
    for (const undo of this.#undo) {
      undo();
    }
  }

  #lose(loss: Loss): void {
    this.release(drivingTexts.lostWords(loss, ""));
  }

  #letGo(): void {
    this.#held = undefined;
    this.#input.value = undefined;
    this.#stream.step(this.environment.now(), undefined);
  }

  /** Let go if the arm is not to be moved any more. */
  #check(): void {
    if (this.#held !== undefined && this.refusal !== "") {
      this.release(this.refusal);
    }
  }

  #look(): void {
    const now = this.environment.now();
    if (this.#sleep.slept()) {
      this.#lose("slept");
    }
    if (this.environment.document.visibilityState === "hidden") {
      this.#lose("hidden");
    }
    for (const look of this.onLook) {
      look(now);
    }
    this.#check();
    this.#step(now);
  }

  #step(now: number): void {
    const wish = this.#held?.wish(now);
    if (!this.#stream.step(now, wish)) {
      this.#lose("unsent");
    } else if (wish !== undefined) {
      const verdict = this.#watch.judge(now, wish, this.state.peek());
      if (verdict === "again") {
        this.#stream.begin(now, wish);
      } else if (verdict === "refused") {
        this.release(drivingTexts.lostWords("not-listening", this.state.peek()?.reason ?? ""));
      }
    }
  }
}
