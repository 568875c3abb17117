/** Goals of actions that always come to an end: a result, a rejection, or the connection's end. */

import { linkTexts } from "../texts/link";
import type { RosbridgeClient } from "./rosbridge_client";

/** How a goal ended: with the fields of its result, or rejected in words. */
export type GoalEnd =
  | { readonly ok: true; readonly values: unknown }
  | { readonly ok: false; readonly words: string };

export interface GoalListener {
  readonly feedback: (values: unknown) => void;
  readonly ended: (end: GoalEnd) => void;
}

export class ActionGoals {
  #client: RosbridgeClient | undefined;
  readonly #active = new Set<(end: GoalEnd) => void>();

  attach(client: RosbridgeClient): void {
    this.#client = client;
  }

  /** End all goals: the robot cancels those of a client that has left. */
  detach(): void {
    this.#client = undefined;
    for (const end of [...this.#active]) {
      end({ ok: false, words: linkTexts.answers.lostMeanwhile });
    }
  }

  /** Send a goal; returns what cancels it, or undefined without a connection. */
  send(action: string, type: string, goal: object, listener: GoalListener): (() => void) | undefined {
    const client = this.#client;
    const id = client?.ask({ op: "send_action_goal", action, action_type: type, args: goal, feedback: true }, (message) => {
      const { op, result, values } = message;
      if (op === "action_feedback") {
        listener.feedback(values);
      } else if (op === "action_result") {
        end(result === true ? { ok: true, values } : { ok: false, words: typeof values === "string" ? values.slice(0, 1000) : "" });
      }
    });
    if (client === undefined || id === undefined) {
      return undefined;
    }
    const end = (how: GoalEnd): void => {
      client.forget(id);
      if (this.#active.delete(end)) {
        listener.ended(how);
      }
    };
    this.#active.add(end);
    return () => {
      if (this.#active.has(end)) {
        client.send({ op: "cancel_action_goal", id, action });
      }
    };
  }
}
