/** Lets the operator say where the robot is, and tells what the robot makes of it. */

import { effect, signal, untracked, type ReadonlySignal } from "@preact/signals";
import type { RobotCommands } from "../robot/robot_commands";
import type { RobotState } from "../robot/robot_state";
import type { PlanarPose, Pose } from "../values";
import { watchPointer, type FloorPoint } from "../scene/floor_pointer";
import { planar } from "../scene/geometry";
import { watchKeys } from "./hint_key_watch";
import { hintKey } from "./hint_keys";
import { HintPreviews, type PreviewClock } from "./hint_previews";
import { qualityOf, type HintQuality } from "./hint_quality";
import { canConfirm, isSearching, previewIsOld, reduceHint } from "./hint_reducer";
import { NO_HINT, type HintEvent, type HintState } from "./hint_state";

/** What the tool needs of the picture. */
export interface HintScene {
  /** The point of the floor under a place of the window [CSS pixels], in `map`. */
  floorPoint(clientX: number, clientY: number): FloorPoint | undefined;
  /** Draw the robot and its live sweep at a pose; undefined removes them. */
  showGhost(pose: PlanarPose | undefined, quality: HintQuality): void;
  /** Whether presses on the picture place a hint, or move the camera. */
  setInteraction(mode: "hint" | "camera"): void;
  /** Direction in `map` that is up on the screen [rad]; without it arrow keys move along the map's axes. */
  upward?(): number;
}

/** How sure a press and a drag are: one sigma, position [m] and heading [rad]; the robot's own defaults for hints. */
const DRAGGED = { sigma: 0.5, headingSigma: (15 * Math.PI) / 180 };

/** How sure a candidate is that the robot itself has found; the robot searches 0.5 m and 10 degrees at least. */
const PICKED = { sigma: 0.1, headingSigma: (3 * Math.PI) / 180 };

/** The preview is renewed this often while nothing is moved, since the robot may move [ms]. */
const RENEW = 500;

/** An older estimate is not where the robot is now [ms]: it has none any more. */
const PRESENT = 1000;

const BROWSER_CLOCK: PreviewClock = {
  now: () => performance.now(),
  after: (delay, callback) => {
    const id = setTimeout(callback, delay);
    return () => { clearTimeout(id); };
  },
};

export class HintTool {
  private readonly current = signal<HintState>(NO_HINT);
  private readonly placed = signal(false);
  private readonly previews: HintPreviews;
  private readonly ends: (() => void)[] = [];

  /**
   * @param surface The picture's element; it is pressed, and takes keys while it has the focus.
   */
  constructor(
    private readonly surface: HTMLElement,
    private readonly scene: HintScene,
    private readonly commands: RobotCommands,
    private readonly state: RobotState,
    private readonly clock: PreviewClock = BROWSER_CLOCK,
  ) {
    this.previews = new HintPreviews(
      (pose) => commands.previewHint(pose),
      (preview) => { this.dispatch({ type: "preview", preview }); },
      clock,
    );
    this.ends.push(
      watchPointer(surface, (x, y) => scene.floorPoint(x, y), () => this.placing, this.dispatch),
      watchKeys(surface.ownerDocument.defaultView, () => this.placing, (key, shift) => this.key(key, shift)),
      effect(() => {
        const hint = this.current.value;
        untracked(() => { this.show(hint); });
      }),
      effect(() => {
        const verdict = state.verdict.value;
        if (verdict !== undefined) {
          this.placed.value = verdict.verdict === "accepted" || this.placed.peek();
          untracked(() => { this.dispatch({ type: "verdict", verdict }); });
        }
      }),
      this.watchSearch(),
      this.watchRun(),
      this.repeat(),
    );
  }

  /** The hint as it stands. */
  get view(): ReadonlySignal<HintState> {
    return this.current;
  }

  /** Whether there is a placement to be undone. */
  get undoable(): ReadonlySignal<boolean> {
    return this.placed;
  }

  /** Whether presses and keys place a hint now. */
  get placing(): boolean {
    return this.current.peek().phase === "placing";
  }

  /** Begin to place a hint, from the present pose if there is one. */
  begin(): void {
    const pose = this.state.mapFromBase.peek();
    const present = pose !== undefined && this.clock.now() - pose.receivedAt < PRESENT ? planar(pose) : undefined;
    this.dispatch({ type: "begin", present });
    this.surface.focus({ preventScroll: true });
    if (present !== undefined) {
      this.ask(present);
    }
  }

  cancel(): void {
    this.dispatch({ type: "cancel" });
  }

  /**
   * End the placing of a hint, for Esc. False if none was being placed, or if the robot moves: then Esc is to stop it as
   * well.
   */
  escape(): boolean {
    const placing = this.placing;
    this.cancel();
    return placing && !this.moving;
  }

  /** Send the hint, if it is complete. */
  confirm(): void {
    const state = this.current.peek();
    if (canConfirm(state) && state.pose !== undefined) {
      this.send(state.pose, DRAGGED);
    }
  }

  /** Say that the robot is at one of the places that it has found itself. */
  pick(candidate: Pose): void {
    this.send(planar(candidate), PICKED);
  }

  /** Undo the last placement. */
  async undo(): Promise<void> {
    const answer = await this.commands.request("undo");
    this.placed.value = false;
    this.dispatch({ type: "undone", answer });
  }

  /** Have the whole map searched. */
  async find(): Promise<void> {
    this.dispatch({ type: "searched", answer: await this.commands.request("find") });
  }

  /** Move or turn the ghost, for buttons; or press and drag on the floor, for what points at it. */
  readonly nudge = (event: Extract<HintEvent, { type: "move" | "turn" | "press" | "drag" | "release" }>): void => {
    this.dispatch(event);
  };

  /** Do what a key does; false if it is none of the hint's. */
  key(key: string, shift: boolean): boolean {
    const event = hintKey(key, shift, this.scene.upward?.());
    if (event === undefined) {
      return false;
    }
    if (event.type === "cancel") {
      return this.escape();
    }
    if (event.type === "confirm") {
      this.confirm();
    } else {
      this.dispatch(event);
    }
    return true;
  }

  dispose(): void {
    this.previews.stop();
    for (const end of this.ends.splice(0)) {
      end();
    }
    this.scene.showGhost(undefined, "unknown");
    this.scene.setInteraction("camera");
  }

  private get moving(): boolean {
    const control = this.state.control.peek();
    return control !== undefined && (control.linear !== 0 || control.angular !== 0);
  }

  private readonly dispatch = (event: HintEvent): void => {
    const before = this.current.peek();
    const after = reduceHint(before, event);
    this.current.value = after;
    if (after.phase !== "placing") {
      this.previews.stop();
    } else if (after.pose !== undefined && after.pose !== before.pose) {
      this.ask(after.pose);
    }
  };

  private ask(pose: PlanarPose): void {
    if (this.state.dialect.peek() !== "plain") {
      this.previews.request(pose);
    }
  }

  private send(pose: PlanarPose, { sigma, headingSigma }: typeof DRAGGED): void {
    if (!this.commands.hint(pose, sigma, headingSigma)) {
      this.dispatch({ type: "notSent" });
      return;
    }
    this.dispatch({ type: "sent", pose, at: this.clock.now() });
    if (this.state.dialect.peek() === "plain") {
      this.dispatch({ type: "unanswered" });
    }
  }

  private show(state: HintState): void {
    const placing = state.phase === "placing";
    const quality = qualityOf(state.preview, previewIsOld(state));
    this.scene.setInteraction(placing ? "hint" : "camera");
    this.scene.showGhost(placing || state.phase === "waiting" ? state.pose : undefined, quality);
  }

  /** A search is over once the robot, which doubts its place while it searches, knows it again. */
  private watchSearch(): () => void {
    let doubted = false;
    return effect(() => {
      const health = this.state.status.value?.health;
      const searching = isSearching(this.current.value);
      const knows = health === "tracking" || health === "degraded";
      doubted = searching && (doubted || !knows);
      if (doubted && knows) {
        this.placed.value = true;
        untracked(() => { this.dispatch({ type: "found" }); });
      }
    });
  }

  private watchRun(): () => void {
    let run = this.state.run.peek();
    return effect(() => {
      const now = this.state.run.value;
      const another = now !== run && run !== "";
      run = now;
      if (another) {
        this.placed.value = false;
        untracked(() => { this.dispatch({ type: "forget" }); });
      }
    });
  }

  private repeat(): () => void {
    let cancel = (): void => undefined;
    const again = (): void => {
      this.dispatch({ type: "tick", now: this.clock.now() });
      const { phase, pose } = this.current.peek();
      if (phase === "placing" && pose !== undefined) {
        this.ask(pose);
      }
      cancel = this.clock.after(RENEW, again);
    };
    cancel = this.clock.after(RENEW, again);
    return () => { cancel(); };
  }
}
