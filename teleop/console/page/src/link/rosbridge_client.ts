/** The operations of one connection, each answer at the one who asked; nothing is kept for the next connection. */

/** An operation of the rosbridge protocol; its other fields may be anything. */
export interface Operation {
  readonly op: string;
  readonly [field: string]: unknown;
}

export type Take = (operation: Operation) => void;

export class RosbridgeClient {
  readonly #leave: (operation: Operation) => boolean;
  readonly #topics = new Map<string, (message: unknown) => void>();
  readonly #asked = new Map<string, Take>();
  readonly #advertised = new Set<string>();
  #number = 0;

  /** @param leave Sends an operation; false if it cannot leave, as after the connection's end. */
  constructor(leave: (operation: Operation) => boolean) {
    this.#leave = leave;
  }

  /** Send an operation; false if it cannot leave. */
  send(operation: Operation): boolean {
    return this.#leave(operation);
  }

  /** Publish a message; a topic is advertised before its first one. */
  publish(topic: string, type: string, msg: object): boolean {
    if (!this.#advertised.has(topic)) {
      if (!this.#leave({ op: "advertise", topic, type })) {
        return false;
      }
      this.#advertised.add(topic);
    }
    return this.#leave({ op: "publish", topic, msg });
  }

  /** Listen to a topic; `wishes` are further fields of the operation. */
  subscribe(topic: string, wishes: object, take: (message: unknown) => void): void {
    this.#topics.set(topic, take);
    this.#leave({ op: "subscribe", topic, ...wishes });
  }

  unsubscribe(topic: string): void {
    this.#topics.delete(topic);
    this.#leave({ op: "unsubscribe", topic });
  }

  /** Send an operation with an id of its own, and take what bears that id until it is forgotten; undefined if it cannot leave. */
  ask(operation: Operation, take: Take): string | undefined {
    this.#number += 1;
    const id = `${operation.op}:${this.#number}`;
    this.#asked.set(id, take);
    if (this.#leave({ ...operation, id })) {
      return id;
    }
    this.#asked.delete(id);
    return undefined;
  }

  forget(id: string): void {
    this.#asked.delete(id);
  }

  /** Give an operation that has arrived to the one who waits for it. */
  take(operation: Operation): void {
    if (operation.op === "publish") {
      this.#topics.get(String(operation["topic"]))?.(operation["msg"]);
    } else if (typeof operation["id"] === "string") {
      this.#asked.get(operation["id"])?.(operation);
    }
  }
}
