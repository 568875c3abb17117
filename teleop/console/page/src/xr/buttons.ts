/** Buttons and sticks that do not drive: e-stop, where to stand, the board, turning, and going elsewhere. */

import { withoutDeadZone } from "../driving/drive_source";
import { SMOOTH_TURN } from "./comfort";
import type { Side } from "./inputs";

/** Deflections from which on a stick turns or aims, and at which it counts as let go. */
const PUSHED = 0.7;
const LET_GO = 0.3;

export interface ButtonHooks {
  readonly estop: () => void;
  /** Stand at the next place. */
  readonly next: () => void;
  /** Have the board here. */
  readonly board: () => void;
  /** Turn to the left [rad]. */
  readonly turn: (angle: number) => void;
  /** Go where the other hand aims. */
  readonly go: () => void;
}

export class Buttons {
  /** Whether the other hand aims at a place to go to. */
  aiming = false;
  #estop = false;
  #next = false;
  #board = false;
  #turned = false;

  constructor(private readonly hooks: ButtonHooks) {}

  /** @param turning Degrees of a turn; 0 turns smoothly. */
  frame(interval: number, driving: Side, other: Side, turning: number): void {
    const estop = driving.pressed("upper") || other.pressed("upper");
    const next = driving.pressed("lower");
    const board = other.pressed("lower");
    if (estop && !this.#estop) {
      this.hooks.estop();
    }
    if (next && !this.#next) {
      this.hooks.next();
    }
    if (board && !this.#board) {
      this.hooks.board();
    }
    this.#estop = estop;
    this.#next = next;
    this.#board = board;
    const ahead = -other.axis(1);
    this.#turn(interval, other.axis(0), turning);
    if (this.aiming && ahead < LET_GO && other.present) {
      this.hooks.go();
    }
    this.aiming = other.present && (ahead > PUSHED || (this.aiming && ahead >= LET_GO));
  }

  #turn(interval: number, right: number, turning: number): void {
    if (turning === 0) {
      const rate = -withoutDeadZone(right, LET_GO) * SMOOTH_TURN;
      if (rate !== 0) {
        this.hooks.turn((rate * Math.min(interval, 100)) / 1000);
      }
    } else if (Math.abs(right) > PUSHED && !this.#turned) {
      this.#turned = true;
      this.hooks.turn((-Math.sign(right) * turning * Math.PI) / 180);
    } else if (Math.abs(right) < LET_GO) {
      this.#turned = false;
    }
  }
}
