/** Which topics the page listens to: brought in line with what is wanted, on each connection anew. */

import type { RosbridgeClient } from "./rosbridge_client";

/** A topic that the page wants, and what to do with its messages. */
export interface Stream {
  readonly topic: string;
  /** Its type as the server calls it. */
  readonly type: string;
  /** Shortest time between two messages [ms]. */
  readonly throttle: number;
  /** Whether the server keeps the last message for newcomers. */
  readonly latched: boolean;
  /** Whether to ask for CBOR. */
  readonly cbor: boolean;
  readonly take: (message: unknown) => void;
}

export class Subscriptions {
  readonly #active = new Map<string, Stream>();
  #client: RosbridgeClient | undefined;
  #wanted: readonly Stream[] = [];
  readonly #also = new Set<readonly Stream[]>();

  /** Listen on a new connection; none of the last one is left. */
  attach(client: RosbridgeClient): void {
    this.#active.clear();
    this.#client = client;
    this.#update();
  }

  detach(): void {
    this.#active.clear();
    this.#client = undefined;
  }

  /** Listen to these topics and no others. */
  want(streams: readonly Stream[]): void {
    this.#wanted = streams;
    this.#update();
  }

  /** Listen to these topics as well, until the returned function is called. */
  also(streams: readonly Stream[]): () => void {
    this.#also.add(streams);
    this.#update();
    return () => {
      this.#also.delete(streams);
      this.#update();
    };
  }

  /** Have the latched messages sent again. */
  renewLatched(): void {
    for (const { latched, topic } of [...this.#active.values()]) {
      if (latched) {
        this.#end(topic);
      }
    }
    this.#update();
  }

  /** Topics whose messages should keep coming. */
  get topics(): readonly string[] {
    return [...this.#active.values()].filter(({ latched }) => !latched).map(({ topic }) => topic);
  }

  #update(): void {
    const client = this.#client;
    if (client === undefined) {
      return;
    }
    const wanted = new Map([...this.#wanted, ...[...this.#also].flat()].map((stream) => [stream.topic, stream]));
    for (const stream of [...this.#active.values()]) {
      const now = wanted.get(stream.topic);
      if (now === undefined || !alike(now, stream)) {
        this.#end(stream.topic);
      }
    }
    for (const stream of wanted.values()) {
      if (!this.#active.has(stream.topic)) {
        this.#active.set(stream.topic, stream);
        subscribe(client, stream);
      }
    }
  }

  #end(topic: string): void {
    this.#client?.unsubscribe(topic);
    this.#active.delete(topic);
  }
}

function alike(a: Stream, b: Stream): boolean {
  return a.type === b.type && a.throttle === b.throttle && a.cbor === b.cbor;
}

function subscribe(client: RosbridgeClient, { topic, type, cbor, throttle, latched, take }: Stream): void {
  const wishes = {
    type,
    compression: cbor ? "cbor" : "none",
    throttle_rate: throttle,
    // Of what a slow link cannot take, only the newest matters, unless each message tells of other frames.
    queue_length: latched || topic === "/tf" ? 0 : 1,
  };
  client.subscribe(topic, wishes, take);
}
