/** Positions that a person has taught, kept by the browser for each arm, and how they are gone through again. */

import { signal, type ReadonlySignal, type Signal } from "@preact/signals";
import type { ArmInfo, ArmState } from "../../robot/arm";
import { remembered, type Keeper } from "../../scene/stored_signals";
import { armTexts as texts } from "../../texts/arm";
import type { GripperControl } from "./gripper_control";
import type { MoveControl } from "./move_control";

export interface TaughtPosition {
  /** Of the joints [rad]. */
  readonly angles: readonly number[];
  /** Of the gripper [m]; 0 where it held something. */
  readonly opening: number;
}

/** More are no list that a person looks through. */
const MOST = 50;
/** Difference of openings from which the gripper is moved [m]. */
const SAME = 0.003;

export class Taught {
  readonly positions: Signal<readonly TaughtPosition[]>;
  /** Number of the position that is gone to, from 0; undefined if they are not gone through. */
  readonly running: ReadonlySignal<number | undefined>;
  readonly #running = signal<number | undefined>(undefined);

  constructor(
    info: ArmInfo, private readonly moves: MoveControl, private readonly gripper: GripperControl, keeper: Keeper | undefined,
  ) {
    const { name, joints } = info;
    this.running = this.#running;
    this.positions = remembered(`farsteer.arm.taught.${name}`, [], (kept) => positionsFrom(kept, joints.length), keeper);
  }

  /** Add where the arm is. */
  teach({ angles, opening, holding }: ArmState): void {
    const position = { angles: [...angles], opening: holding ? 0 : Math.max(0, opening) };
    this.positions.value = [...this.positions.peek(), position].slice(-MOST);
  }

  forget(number: number): void {
    this.positions.value = this.positions.peek().filter((_, at) => at !== number);
  }

  /** Go through them from one on; each way is shown and confirmed as that of any move. */
  replay(from = 0): void {
    const position = this.positions.peek()[from];
    this.#running.value = position === undefined ? undefined : from;
    if (position === undefined) {
      return;
    }
    this.moves.ask(texts.position(from + 1), { angles: position.angles }, (well) => {
      if (!well || this.#running.peek() !== from) {
        this.#running.value = undefined;
        return;
      }
      const before = this.positions.peek()[from - 1];
      if (before !== undefined && Math.abs(before.opening - position.opening) <= SAME) {
        this.replay(from + 1);
        return;
      }
      this.gripper.to(position.opening, (gripped) => {
        if (gripped && this.#running.peek() === from) {
          this.replay(from + 1);
        } else {
          this.#running.value = undefined;
        }
      });
    });
  }

  stop(): void {
    this.#running.value = undefined;
  }
}

/** Read kept positions; those that do not fit the arm are left out. */
export function positionsFrom(kept: unknown, joints: number): readonly TaughtPosition[] | undefined {
  return Array.isArray(kept) ? kept.slice(0, MOST).flatMap((one: unknown) => positionFrom(one, joints)) : undefined;
}

function positionFrom(kept: unknown, joints: number): readonly TaughtPosition[] {
  if (typeof kept !== "object" || kept === null) {
    return [];
  }
  const { angles, opening }: { angles?: unknown; opening?: unknown } = kept;
  const numbers = Array.isArray(angles) ? angles.filter((angle) => Number.isFinite(angle)) as number[] : [];
  return numbers.length === joints && typeof opening === "number" && Number.isFinite(opening)
    ? [{ angles: numbers, opening }] : [];
}
