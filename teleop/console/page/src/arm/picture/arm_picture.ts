/** What the picture shows of moving the arm: the ghost of the gripper with its handles, and the way of a planned move. */

import { effect, signal, type ReadonlySignal, type Signal } from "@preact/signals";
import { Color, Group, LineBasicMaterial, MeshBasicMaterial, SRGBColorSpace, Vector3 } from "three";
import type { ArmInfo, ArmPath, ArmState } from "../../robot/arm";
import { COLOURS } from "../../scene/palette";
import { place } from "../../scene/robot_layer";
import type { Theme } from "../../scene/settings";
import type { Workshop } from "../../scene/workshop";
import type { Pose } from "../../values";
import type { TipFrame } from "../inputs/tip_motion";
import { ArmFigure } from "./arm_figure";
import { GhostGripper } from "./ghost_gripper";
import { Gizmo } from "./gizmo";
import { SweptPath } from "./swept_path";

export interface ArmPictureParts {
  readonly workshop: Workshop;
  readonly info: ArmInfo;
  readonly state: ReadonlySignal<ArmState | undefined>;
  /** The way of a planned move; empty if there is none. */
  readonly path: ReadonlySignal<ArmPath>;
  /** Whether the handles are shown. */
  readonly active: ReadonlySignal<boolean>;
  /** Whether the ghost stays where it was dragged. */
  readonly stays: ReadonlySignal<boolean>;
  readonly frame: ReadonlySignal<TipFrame>;
  readonly theme: ReadonlySignal<Theme>;
  /** The person begins to drag the ghost, and has let go of it. */
  readonly begin: () => void;
  readonly end: () => void;
}

export class ArmPicture {
  /** Where the ghost was dragged to, in the arm's base; undefined while it is where the gripper is. */
  readonly placed: Signal<Pose | undefined> = signal(undefined);
  readonly #mounted = new Group();
  readonly #fill = new MeshBasicMaterial({ transparent: true, opacity: 0.5, depthWrite: false });
  readonly #sweep = new MeshBasicMaterial({ transparent: true, opacity: 0.16, depthWrite: false });
  readonly #line = new LineBasicMaterial({ transparent: true, depthTest: false });
  readonly #ghost: GhostGripper;
  readonly #path: SweptPath;
  readonly #stops: (() => void)[] = [];
  #gizmo: Gizmo | undefined;
  #loading = false;
  #dragging = false;

  constructor(private readonly parts: ArmPictureParts) {
    const { workshop, info } = parts;
    this.#ghost = new GhostGripper(this.#line, this.#fill, info);
    this.#path = new SweptPath(this.#line);
    place(this.#mounted, info.mount);
    this.#mounted.add(this.#ghost.object, this.#path.object);
    workshop.base.add(this.#mounted);
    const on = (reaction: () => void): void => {
      this.#stops.push(effect(() => {
        reaction();
        workshop.draw();
      }));
    };
    on(() => { this.#paint(); });
    on(() => { this.#setModel(); });
    on(() => { this.#follow(); });
    on(() => { this.#path.show(parts.path.value); });
    on(() => { this.#showGizmo(parts.active.value); });
  }

  /** Direction in which the picture is looked at, in the arm's base [rad]. */
  heading(): number {
    const { camera } = this.parts.workshop;
    const ahead = camera.getWorldDirection(new Vector3());
    const from = this.#mounted.getWorldPosition(new Vector3());
    const { x, y } = this.#mounted.worldToLocal(from.add(ahead));
    return Math.atan2(y, x);
  }

  /** Where the ghost is now, in the arm's base. */
  get ghost(): Pose {
    return this.#ghost.pose;
  }

  /** Bring the ghost back to the gripper. */
  forget(): void {
    this.placed.value = undefined;
    this.parts.workshop.draw();
  }

  dispose(): void {
    for (const stop of this.#stops) {
      stop();
    }
    this.#gizmo?.dispose();
    this.#mounted.removeFromParent();
    this.#ghost.dispose();
    this.#path.dispose();
    this.#sweep.dispose();
    this.#line.dispose();
  }

  #paint(): void {
    const { path, hypothesis } = COLOURS[this.parts.theme.value];
    this.#fill.color.copy(new Color().setRGB(...hypothesis, SRGBColorSpace));
    this.#sweep.color.copy(new Color().setRGB(...path, SRGBColorSpace));
    this.#line.color.copy(this.#fill.color);
  }

  #setModel(): void {
    const model = this.parts.workshop.model.value;
    const gripper = ArmFigure.of(model, this.parts.info, this.#fill)?.gripper();
    if (gripper !== undefined) {
      this.#ghost.setGripper(gripper);
    }
    this.#path.setModel(model, this.parts.info, this.#sweep);
  }

  /** Put the ghost where the gripper is, unless the person has it elsewhere. */
  #follow(): void {
    const { state, active, frame } = this.parts;
    const [now, placed] = [state.value, this.placed.value];
    this.#ghost.object.visible = active.value && now !== undefined;
    if (now === undefined) {
      return;
    }
    this.#ghost.setOpening(now.opening);
    // A ghost in the same place as the gripper would only flicker.
    for (const part of this.#ghost.hand.children) {
      part.visible = this.#dragging || placed !== undefined;
    }
    if (!this.#dragging) {
      this.#ghost.pose = placed ?? now.tip;
    }
    this.#gizmo?.align(frame.value === "view" ? this.heading() : frame.value === "tool" ? "tool" : 0);
  }

  #showGizmo(active: boolean): void {
    if (this.#gizmo !== undefined) {
      this.#gizmo.show(active);
    } else if (active && !this.#loading) {
      this.#loading = true;
      void Gizmo.load(this.parts.workshop, this.#ghost.hand, {
        begin: () => {
          this.#dragging = true;
          this.parts.begin();
          this.#follow();
        },
        moved: () => { this.#ghost.shown(); },
        end: () => {
          this.#dragging = false;
          this.placed.value = this.parts.stays.peek() ? this.#ghost.pose : undefined;
          this.parts.end();
          this.#follow();
        },
      }).then((gizmo) => {
        this.#gizmo = gizmo;
        gizmo.show(this.parts.active.peek());
        this.#follow();
      });
    }
  }
}
