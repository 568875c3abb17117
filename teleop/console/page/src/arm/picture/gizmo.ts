/** Three arrows and two rings by which the ghost is dragged: none for its roll, which the arm does not have. */

import { Group, type Object3D } from "three";
import type { TransformControls } from "three/examples/jsm/controls/TransformControls.js";
import type { Workshop } from "../../scene/workshop";

export interface GizmoHooks {
  /** The person takes hold of a handle. */
  begin(): void;
  /** The ghost was moved. */
  moved(): void;
  /** The person lets go, or the system took the pointer away. */
  end(): void;
}

/** Size of the arrows and rings as shares of the usual one: small beside the arm, so that both are seen. */
const ARROWS = 0.75;
const RINGS = 0.5;

export class Gizmo {
  /** Carries the arrows, whose axes are its own. */
  readonly #arrows = new Group();
  readonly #controls: readonly [move: TransformControls, turn: TransformControls];
  readonly #ended = new AbortController();
  #dragging = false;
  #shown = false;

  /** Load what it needs, and return it, hidden. */
  static async load(workshop: Workshop, hand: Object3D, hooks: GizmoHooks): Promise<Gizmo> {
    const { TransformControls: Controls } = await import("three/examples/jsm/controls/TransformControls.js");
    const make = (): TransformControls => new Controls(workshop.camera, workshop.canvas);
    return new Gizmo(workshop, hand, hooks, make(), make());
  }

  private constructor(
    private readonly workshop: Workshop, private readonly hand: Object3D, private readonly hooks: GizmoHooks,
    move: TransformControls, turn: TransformControls,
  ) {
    this.#controls = [move, turn];
    move.setMode("translate");
    move.setSize(ARROWS);
    [move.showXY, move.showYZ, move.showXZ] = [false, false, false];
    turn.setMode("rotate");
    turn.setSize(RINGS);
    turn.showX = false;
    for (const control of this.#controls) {
      control.setSpace("local");
      control.enabled = false;
    }
    move.addEventListener("objectChange", () => {
      this.hand.position.copy(this.#arrows.position);
      this.hooks.moved();
    });
    turn.addEventListener("objectChange", () => { this.hooks.moved(); });
    this.#watch(move, turn);
    this.#watch(turn, move);
    const { signal } = this.#ended;
    for (const lost of ["pointercancel", "lostpointercapture"] as const) {
      workshop.canvas.addEventListener(lost, () => { this.#end(); }, { signal });
    }
  }

  /** Show it, or hide it. */
  show(shown: boolean): void {
    if (shown === this.#shown) {
      return;
    }
    this.#shown = shown;
    const [move, turn] = this.#controls;
    this.hand.parent?.add(this.#arrows);
    if (shown) {
      move.attach(this.#arrows);
      turn.attach(this.hand);
    }
    for (const control of this.#controls) {
      control.enabled = shown;
      if (shown) {
        this.workshop.world.add(control.getHelper());
      } else {
        this.#end();
        control.detach();
        control.getHelper().removeFromParent();
      }
    }
    this.workshop.draw();
  }

  /** Follow the ghost, with the axes of a frame: those of the gripper, or turned by an angle about the base's vertical [rad]. */
  align(axes: "tool" | number): void {
    if (this.#dragging) {
      return;
    }
    this.#arrows.position.copy(this.hand.position);
    if (axes === "tool") {
      this.#arrows.quaternion.copy(this.hand.quaternion);
    } else {
      this.#arrows.rotation.set(0, 0, axes);
    }
  }

  dispose(): void {
    this.show(false);
    this.#ended.abort();
    for (const control of this.#controls) {
      control.dispose();
    }
  }

  #watch(control: TransformControls, other: TransformControls): void {
    control.addEventListener("change", () => { this.workshop.draw(); });
    control.addEventListener("axis-changed", () => {
      // Where handles of both lie over each other, one of them is taken.
      other.enabled = this.#shown && control.axis === null;
      this.workshop.holdView(this.#dragging || control.axis !== null);
    });
    control.addEventListener("mouseDown", () => {
      this.#dragging = true;
      this.hooks.begin();
    });
    control.addEventListener("mouseUp", () => { this.#end(); });
  }

  #end(): void {
    if (this.#dragging) {
      this.#dragging = false;
      this.workshop.holdView(false);
      this.hooks.end();
    }
  }
}
