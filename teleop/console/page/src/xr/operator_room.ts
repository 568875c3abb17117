/** What is around an operator who wears a headset, and what both hands do in it, frame by frame. */

import { effect, signal } from "@preact/signals";
import { Mesh, MeshBasicMaterial, Quaternion, RingGeometry, Vector3 } from "three";
import type { Arm } from "../arm/arm";
import { browserKeeper, remembered } from "../scene/stored_signals";
import type { Immersion, Standing } from "../scene/immersion";
import { COLOURS } from "../scene/palette";
import type { Theme } from "../scene/settings";
import { ANGLE, DISTANCE } from "../steps/step_size";
import { topSpeed } from "../driving/gears";
import { xrTexts as texts } from "../texts/xr";
import type { Alarms } from "../alarms/alarms";
import type { LinkStatisticsSignal } from "../robot/robot_state";
import { ArmHand } from "./arm_hand";
import { Board } from "./board";
import { Buttons } from "./buttons";
import { CameraBoard } from "./camera_board";
import { comfortSettings, Vignette } from "./comfort";
import { controlRows, type ControlParts, type StepSizes } from "./controls";
import { FloorChoice } from "./floor_choice";
import type { HeadsetSource } from "./headset_source";
import { Inputs, type Side } from "./inputs";
import { Place, STANDS, type Stand } from "./place";
import { Ray } from "./pointing";
import { takePose, type Placed } from "./webxr_pose";
import { captionRows, wristRows } from "./wrist";

/** How often what is told on the wrist is renewed [ms]. */
const TOLD = 200;
export interface RoomParts extends Omit<ControlParts, "comfort" | "sizes" | "stand" | "hand" | "turn" | "controller" | "unusable"> {
  readonly immersion: Immersion;
  readonly statistics: LinkStatisticsSignal;
  readonly alarms: Pick<Alarms, "active">;
  readonly theme: { readonly value: Theme; peek(): Theme };
  now(): number;
}

export class OperatorRoom {
  readonly inputs = new Inputs();
  readonly arm = new ArmHand();
  readonly stand = signal<Stand>("free");
  readonly controls = new Board(0.7);
  readonly wrist = new Board(0.26, 640);
  readonly camera = new CameraBoard();
  readonly vignette = new Vignette();
  readonly #comfort = comfortSettings();
  readonly #buttons = new Buttons({
    estop: () => { this.parts.driving.emergencyStop(); },
    next: () => { this.#next(); },
    board: () => { this.#facing = true; },
    turn: (angle) => { this.#place.turn(angle); },
    go: () => { this.#go(); },
  });
  readonly #hand = remembered<"left" | "right">("farsteer.headset.drives", "right", (kept) => (kept === "left" || kept === "right" ? kept : undefined), browserKeeper());
  readonly #sizes = signal<StepSizes>({
    distance: DISTANCE.presets.indexOf(DISTANCE.initial), angle: ANGLE.presets.indexOf(ANGLE.initial),
  });
  readonly #controller = signal(false);
  readonly #unusable = signal<string | undefined>(undefined);
  readonly #place: Place;
  readonly #rays: readonly [Ray, Ray];
  readonly #landing = new Mesh(new RingGeometry(0.18, 0.25, 32), new MeshBasicMaterial({ depthTest: false, transparent: true }));
  readonly #head = new Vector3();
  readonly #turn = new Quaternion();
  readonly #placed: Placed = { position: this.#head, turn: this.#turn };
  readonly #undo: (() => void)[] = [];
  #boards: Board[] = [];
  #ground = true;
  #begins = true;
  #recentre = false;
  #facing = true;
  readonly #choice: FloorChoice;
  /** From one frame to the next, and from a head's pose to its picture [ms]. */
  readonly #clock = { interval: 0, display: NaN };
  readonly #standing = { scale: 1, ground: true };

  constructor(private readonly parts: RoomParts) {
    const { immersion } = parts;
    this.#choice = new FloorChoice(parts.hint, parts.there);
    this.#place = new Place(immersion.room, immersion.robot);
    this.#rays = [new Ray(this.inputs.left), new Ray(this.inputs.right)];
    immersion.room.add(
      this.controls.object, this.wrist.object, this.camera.object, this.camera.caption.object,
      this.#rays[0].object, this.#rays[1].object, this.vignette.object,
    );
    this.#landing.renderOrder = 4;
    this.#landing.visible = false;
    this.#boards = [this.controls, this.wrist, this.camera.caption];
  }

  /**
   * The hands: the one that drives, and the other one, which turns, teleports and leads the arm. Here as in all of the frame
   * loop signals are read by their value: `peek` makes a function each time, and no effect is running that would take part.
   */
  get driving(): Side {
    return this.inputs.side(this.#hand.value);
  }

  get other(): Side {
    return this.inputs.side(this.#hand.value === "right" ? "left" : "right");
  }

  /** Begin, where the ground is drawn or the room's own is seen. */
  begin(ground: boolean): void {
    this.#ground = ground;
    this.#begins = this.#facing = true;
    this.stand.value = ground ? "free" : "table";
    this.parts.immersion.room.parent?.add(this.#landing);
    this.#undo.push(
      this.parts.camera.watch(),
      effect(() => {
        const colours = COLOURS[this.parts.theme.value];
        this.controls.show(controlRows({
          ...this.parts, comfort: this.#comfort, sizes: this.#sizes, stand: this.stand, hand: this.#hand, controller: this.#controller, unusable: this.#unusable,
          turn: (sense) => { this.#snap(sense); },
        }), colours);
      }),
      effect(() => { this.#stand(this.stand.value); }),
    );
    this.#tell();
    const telling = setInterval(() => { this.#tell(); }, TOLD);
    this.#undo.push(() => { clearInterval(telling); });
  }

  end(): void {
    for (const undo of this.#undo.splice(0)) {
      undo();
    }
    this.#landing.removeFromParent();
    this.lose();
  }

  /** The person may be gone: let go of everything that is held. */
  lose(): void {
    this.inputs.clear();
    this.selectEnd();
    this.parts.there.letGo();
  }

  /** The room's origin has moved: stand where one stood, in a frame in which the head's place is known again. */
  recentre(): void {
    this.#recentre = true;
  }

  /** Bring everything to a frame. @param source Is driven by the driving hand. @param display When it is seen, if known. */
  frame(interval: number, xr: XRFrame, space: XRReferenceSpace, source: HeadsetSource, arm: Arm | undefined): Standing {
    const now = this.parts.now();
    const seenAt = (xr as { readonly predictedDisplayTime?: number }).predictedDisplayTime;
    this.#clock.interval += (interval - this.#clock.interval) * 0.1;
    this.#clock.display = seenAt === undefined ? NaN : seenAt - now;
    const head = xr.getViewerPose(space)?.transform;
    if (head !== undefined) {
      takePose(this.#placed, head);
      this.#place.seeHead(this.#head, this.#turn);
      this.#settle();
    }
    this.inputs.update(xr, space);
    const { driving, other } = this;
    source.cap = this.#cap();
    source.frame(driving);
    this.#controller.value = driving.layout !== undefined;
    this.#unusable.value = driving.unusable;
    this.arm.frame(other, arm);
    const comfort = this.#comfort.value;
    this.#buttons.frame(interval, driving, other, comfort.turning);
    this.#place.update(interval, comfort);
    this.#point();
    const { speed, turnRate } = this.#place;
    this.vignette.update(interval, this.#ground ? comfort.vignette : 0, speed, turnRate);
    this.#standing.scale = this.#place.scale;
    this.#standing.ground = this.#ground;
    return this.#standing;
  }

  /** A trigger is pulled, or a pinch begins. */
  selectStart(hand: XRHandedness): void {
    const ray = this.#rays.find(({ side }) => side === this.inputs.side(hand));
    if (ray === undefined || (this.arm.closed && ray.side === this.other)) {
      return;
    }
    this.#point();
    if (ray.press() || !ray.onFloor) {
      return;
    }
    this.#choice.begin(ray);
  }

  selectEnd(): void {
    this.#rays.forEach((ray) => { ray.release(); });
    this.#choice.end();
  }

  /** Whether a hand points at a board, rather than into the room. */
  get pointsAtBoard(): boolean {
    return this.#rays.some(({ target }) => target.board !== undefined);
  }

  /** Put the model of the building on a place of the room, as a hit test found it. */
  putTable(at: DOMPointReadOnly): void {
    this.#place.putTable(new Vector3(at.x, at.y, at.z));
  }

  /** What a test or a measurement asks for. */
  figures() {
    const { x, y, z } = this.parts.immersion.room.localToWorld(this.#head.clone());
    const keyAt = (label: string): { x: number; y: number; z: number } | undefined =>
      this.#boards.map((board) => board.placeOf(label)).find((place) => place !== undefined);
    const toRoom = (x: number, y: number, z: number): Vector3 => this.parts.immersion.room.worldToLocal(new Vector3(x, y, z));
    const words = this.#boards.flatMap(({ rows }) => rows.flatMap((row) => row.words ?? row.keys?.map(({ label }) => label) ?? []));
    return { stand: this.stand.peek(), head: { x, y, z }, heading: this.#place.heading, covered: this.vignette.covered, words, keyAt, toRoom, plan: this.#middleOf() };
  }

  #cap(): number {
    const { cap } = this.#comfort.value;
    const speed = topSpeed(this.parts.driving.gear.value);
    return cap === 0 || speed <= cap ? 1 : cap / speed;
  }

  /** Stand where one shall, and hang the boards, as soon as it is known where the head is. */
  #settle(): void {
    if (this.#begins) {
      this.#begins = false;
      this.#stand(this.stand.peek());
    }
    if (this.#recentre) {
      this.#recentre = false;
      this.#place.recentre();
    }
    if (this.#facing) {
      this.#facing = false;
      this.controls.face(this.#head, this.#turn, 0.8, 0.6, 0.4);
      this.camera.caption.face(this.#head, this.#turn, 1.3, -0.5, 0.1);
    }
  }

  #stand(stand: Stand): void {
    this.#place.take(stand, this.#middleOf());
  }

  /** Return the middle of the building, on its floor. */
  #middleOf(): Vector3 {
    const { bounds, floor } = this.parts.immersion;
    const { min, max } = bounds ?? { min: { x: 0, y: 0 }, max: { x: 0, y: 0 } };
    return new Vector3((min.x + max.x) / 2, (min.y + max.y) / 2, floor);
  }

  #snap(sense: 1 | -1): void {
    const degrees = this.#comfort.peek().turning;
    this.#place.turn((sense * (degrees === 0 ? 30 : degrees) * Math.PI) / 180);
  }

  #next(): void {
    this.stand.value = STANDS[(STANDS.indexOf(this.stand.peek()) + 1) % STANDS.length] ?? "free";
  }

  /** Go where the other hand aims. */
  #go(): void {
    const ray = this.#rays.find(({ side }) => side === this.other);
    if (ray?.onFloor === true) {
      this.stand.value = "free";
      this.#place.teleport(ray.floor);
    }
  }

  #point(): void {
    const { room, floor } = this.parts.immersion;
    const { other } = this;
    const left = this.#rays[0];
    const right = this.#rays[1];
    left.update(this.#boards, room, floor, this.#head);
    right.update(this.#boards, room, floor, this.#head);
    const aims = left.side === other ? left : right;
    this.#landing.visible = this.#buttons.aiming && aims.onFloor;
    this.#landing.position.copy(aims.floor);
    this.camera.update();
    this.#choice.follow();
    this.wrist.object.visible = other.present;
    if (other.present) {
      this.wrist.object.position.copy(other.position).y += 0.12;
      this.wrist.look(this.#head);
    }
  }

  /** Renew what is told: between the frames, for drawing words takes longer than all else. */
  #tell(): void {
    const { parts } = this;
    const now = parts.now();
    const colours = COLOURS[parts.theme.peek()];
    const told = { ...parts, alarms: parts.alarms.active.peek() };
    this.wrist.show([...wristRows(told, this.#clock, now), ...(this.#ground ? [] : [{ words: texts.putTable }])], colours);
    void this.camera.show(parts.camera);
    this.camera.caption.show(captionRows(parts.camera, told, now), colours);
    const ray = parts.theme.peek() === "day" ? 0x16202c : 0xe8edf4;
    for (const each of this.#rays) {
      each.setColour(ray);
    }
  }
}
