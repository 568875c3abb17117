/** Which topics the page listens to: brought in line with what is wanted, on each connection anew. */

import { type Ros, Topic } from "roslib";

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

interface Active {
  readonly stream: Stream;
  readonly topic: Topic;
}

export class Subscriptions {
  readonly #active = new Map<string, Active>();
  #ros: Ros | undefined;
  #wanted: readonly Stream[] = [];
  readonly #also = new Set<readonly Stream[]>();

  /** Listen on a new connection; none of the last one is left. */
  attach(ros: Ros): void {
    this.#active.clear();
    this.#ros = ros;
    this.#update();
  }

  detach(): void {
    this.#active.clear();
    this.#ros = undefined;
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
    for (const [name, { stream, topic }] of [...this.#active]) {
      if (stream.latched) {
        topic.unsubscribe();
        this.#active.delete(name);
      }
    }
    this.#update();
  }

  /** Topics whose messages should keep coming. */
  get topics(): readonly string[] {
    return [...this.#active.values()].filter(({ stream }) => !stream.latched).map(({ stream }) => stream.topic);
  }

  #update(): void {
    const ros = this.#ros;
    if (ros === undefined) {
      return;
    }
    const wanted = new Map([...this.#wanted, ...[...this.#also].flat()].map((stream) => [stream.topic, stream]));
    for (const [name, { stream, topic }] of [...this.#active]) {
      const now = wanted.get(name);
      if (now === undefined || !alike(now, stream)) {
        topic.unsubscribe();
        this.#active.delete(name);
      }
    }
    for (const stream of wanted.values()) {
      if (!this.#active.has(stream.topic)) {
        this.#active.set(stream.topic, { stream, topic: subscribe(ros, stream) });
      }
    }
  }
}

function alike(a: Stream, b: Stream): boolean {
  return a.type === b.type && a.throttle === b.throttle && a.cbor === b.cbor;
}

function subscribe(ros: Ros, stream: Stream): Topic {
  const topic = new Topic({
    ros,
    name: stream.topic,
    messageType: stream.type,
    compression: stream.cbor ? "cbor" : "none",
    throttle_rate: stream.throttle,
    // Of what a slow link cannot take, only the newest matters, unless each message tells of other frames.
    queue_length: stream.latched || stream.topic === "/tf" ? 0 : 1,
    // Each connection has a client of its own, which is told again what is wanted.
    reconnect_on_close: false,
  });
  topic.subscribe((message) => {
    stream.take(message);
  });
  return topic;
}
