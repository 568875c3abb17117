/** The rays of both hands: what they meet, and what a press there does. */

import { BufferGeometry, Float32BufferAttribute, Group, Line, LineBasicMaterial, Mesh, MeshBasicMaterial, SphereGeometry, Vector3 } from "three";
import type { Board, Key } from "./board";
import type { Side } from "./inputs";
import type { Placed } from "./webxr_pose";

/** Length of a ray that meets nothing [m], and where the floor ends for it. */
const LONG = 4;
const FARTHEST = 30;

/** What a hand points at. */
export interface Target {
  readonly board: Board | undefined;
  readonly key: Key | undefined;
}

export class Ray {
  /** Line and dot, in the operator's room. */
  readonly object = new Group();
  target: Target = { board: undefined, key: undefined };
  /** Whether it points at the floor, and where in the map. */
  onFloor = false;
  readonly floor = new Vector3();
  readonly #line: Line<BufferGeometry, LineBasicMaterial>;
  readonly #dot = new Mesh(new SphereGeometry(0.008, 12, 8), new MeshBasicMaterial({ depthTest: false, transparent: true }));
  readonly #direction = new Vector3();
  readonly #point = new Vector3();
  readonly #from = new Vector3();
  #length = LONG;
  #held: { board: Board; distance: number } | undefined;
  #pressed: Key | undefined;

  constructor(readonly side: Side) {
    const geometry = new BufferGeometry().setAttribute("position", new Float32BufferAttribute([0, 0, 0, 0, 0, -1], 3));
    this.#line = new Line(geometry, new LineBasicMaterial({ depthTest: false, transparent: true, opacity: 0.6 }));
    this.#line.frustumCulled = false;
    this.#line.renderOrder = this.#dot.renderOrder = 21;
    this.object.add(this.#line, this.#dot);
  }

  setColour(colour: number): void {
    this.#line.material.color.setHex(colour);
    this.#dot.material.color.setHex(colour);
  }

  /**
   * Look where it points.
   *
   * @param room The operator's room in the map; `floor` is the floor's height there [m].
   */
  update(boards: readonly Board[], room: Group, floor: number, head: Vector3): void {
    const { present, ray } = this.side;
    this.object.visible = present;
    this.onFloor = false;
    if (!present) {
      this.target = NOTHING;
      this.release();
      return;
    }
    this.#direction.set(0, 0, -1).applyQuaternion(ray.turn);
    this.#carry(ray, head);
    const board = this.#nearest(boards);
    let length = this.#length;
    this.#point.copy(this.#direction).multiplyScalar(length).add(ray.position);
    const key = board?.keyAt(this.#point);
    if (board !== this.target.board || key !== this.target.key) {
      this.target = { board, key };
    }
    if (board === undefined) {
      length = this.#meetFloor(room, floor);
    }
    this.#line.position.copy(ray.position);
    this.#line.quaternion.copy(ray.turn);
    this.#line.scale.set(1, 1, length);
    this.#dot.visible = board !== undefined || this.onFloor;
    this.#dot.position.copy(this.#point);
  }

  /** Press a key, or take hold of the board; false if no board is met. */
  press(): boolean {
    const { board, key } = this.target;
    if (board !== undefined && key === undefined) {
      this.#held = { board, distance: this.#point.distanceTo(this.side.ray.position) };
    }
    // A pinch is no deadman.
    if (key?.release === undefined || this.side.layout !== undefined) {
      this.#pressed = key;
      key?.press();
    }
    return board !== undefined;
  }

  /** Let go of what is held; a hand that is gone does so as well. */
  release(): void {
    this.#pressed?.release?.();
    this.#held = this.#pressed = undefined;
  }

  /** Carry a board that is held along. */
  #carry(ray: Placed, head: Vector3): void {
    if (this.#held !== undefined) {
      const { board, distance } = this.#held;
      board.object.position.copy(this.#direction).multiplyScalar(distance).add(ray.position);
      board.look(head);
    }
  }

  /** Return the nearest board that is met, and note how far it is. */
  #nearest(boards: readonly Board[]): Board | undefined {
    let nearest: Board | undefined;
    this.#length = LONG;
    for (let at = 0; at < boards.length; at += 1) { // an iterator would be an object for each
      const board = boards[at];
      if (board?.meets(this.side.ray.position, this.#direction) === true && board.met < this.#length) {
        nearest = board;
        this.#length = board.met;
      }
    }
    return nearest;
  }

  /** Look where on the floor it points; return how far that is. */
  #meetFloor(room: Group, floor: number): number {
    const from = room.localToWorld(this.#from.copy(this.side.ray.position));
    const to = room.localToWorld(this.#point.copy(this.side.ray.position).add(this.#direction));
    const length = (floor - from.z) / (to.z - from.z);
    this.onFloor = Number.isFinite(length) && length > 0 && length < FARTHEST;
    if (this.onFloor) {
      this.floor.lerpVectors(from, to, length).setZ(floor);
      room.worldToLocal(this.#point.copy(this.floor));
    }
    return this.onFloor ? this.#point.distanceTo(this.side.ray.position) : LONG;
  }
}

const NOTHING: Target = { board: undefined, key: undefined };
