/** What every message passes on its way in: counted, checked, its stamp compared, then used. */

import { batch } from "@preact/signals";
import type { Complaints } from "./complaints";
import { check, type Field } from "./message_checks/field";
import type { Stream } from "./subscriptions";

/** What the intake needs of the link. */
export interface IntakeParts {
  readonly now: () => number;
  readonly complaints: Complaints;
  /** A message of a topic came, good or bad. */
  readonly counted: (topic: string, now: number) => void;
  /** A good message has this stamp [s]. */
  readonly stamped: (topic: string, stamp: number) => void;
}

/** A kind of message: how it is read and what is done with it. */
export interface Kind<T> {
  read(message: Field, receivedAt: number): T;
  use(value: T, receivedAt: number, topic: string): void;
  stampOf?(value: T): number;
}

/** How a topic is asked for. */
export interface Request {
  readonly topic: string;
  readonly type: string;
  readonly throttle?: number;
  readonly latched?: boolean;
  readonly cbor: boolean;
}

export class MessageIntake {
  readonly #parts: IntakeParts;

  constructor(parts: IntakeParts) {
    this.#parts = parts;
  }

  /** A topic whose messages are of a kind. */
  stream<T>(request: Request, kind: Kind<T>): Stream {
    const { topic, type, throttle = 0, latched = false, cbor } = request;
    const take = (message: unknown): void => {
      const now = this.#parts.now();
      this.#parts.counted(topic, now);
      const checked = check((field) => kind.read(field, now), message);
      if (!checked.ok) {
        this.#parts.complaints.add(topic, checked.complaint);
        return;
      }
      if (kind.stampOf !== undefined && !latched) {
        this.#parts.stamped(topic, kind.stampOf(checked.value));
      }
      batch(() => {
        kind.use(checked.value, now, topic);
      });
    };
    return { topic, type, throttle, latched, cbor, take };
  }
}
