/** What the server has, and by it whether it is our robot; where it does not say, by trying. */

import type { Dialect } from "../robot/robot_state";
import { canonicalType, readTopics } from "./message_checks/answers";
import { check } from "./message_checks/field";
import { CONTROL_TOPIC, CONTROL_TYPE } from "./robot_streams";
import type { ServiceCalls } from "./service_calls";

/** On a plain rosbridge topics come and go: how often to look [ms]. */
const LOOK_EVERY = 5000;
/** A server that has not answered by then is taken as one that does not say [s]. */
const PATIENCE = 3;

export class TopicList {
  readonly #calls: ServiceCalls;
  readonly #complain: (source: string, complaint: string) => void;
  readonly #changed: () => void;
  #dialect: Dialect = "unknown";
  #types: ReadonlyMap<string, string> | undefined;
  #askedAt = -Infinity;

  /** @param changed Called when dialect or topics may have changed. */
  constructor(calls: ServiceCalls, complain: (source: string, complaint: string) => void, changed: () => void) {
    this.#calls = calls;
    this.#complain = complain;
    this.#changed = changed;
  }

  get dialect(): Dialect {
    return this.#dialect;
  }

  /** Types by topic, as the server calls them; undefined if it does not say. */
  get types(): ReadonlyMap<string, string> | undefined {
    return this.#types;
  }

  /** A message came that only our robot sends. */
  isRobot(): void {
    if (this.#dialect !== "farsteer") {
      this.#dialect = "farsteer";
      // Not within the message that says so, whose subscription may end by it.
      queueMicrotask(this.#changed);
    }
  }

  /** Look now and then at a server whose topics may change. */
  tick(now: number): void {
    if (this.#askedAt === -Infinity) {
      this.#askedAt = now;
    }
    if (this.#dialect === "plain" && now - this.#askedAt >= LOOK_EVERY) {
      this.#askedAt = now;
      void this.ask();
    }
  }

  /** Ask the server what it has. */
  async ask(): Promise<void> {
    const reply = await this.#calls.call("/rosapi/topics", {}, PATIENCE);
    if (reply.ok) {
      const topics = check(readTopics, reply.values);
      if (topics.ok) {
        this.#types = topics.value;
        const type = canonicalType(topics.value.get(CONTROL_TOPIC) ?? "");
        this.#dialect = type === CONTROL_TYPE ? "farsteer" : "plain";
        this.#changed();
        return;
      }
      this.#complain("/rosapi/topics", topics.complaint);
    } else if (!this.#calls.connected) {
      return;
    }
    if (this.#dialect === "unknown") {
      this.#dialect = "plain";
    }
    this.#changed();
  }
}
