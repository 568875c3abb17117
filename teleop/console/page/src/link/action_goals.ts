/**
 * Goals of actions that always come to an end: a result, a rejection, or the connection's end.
 *
 * roslib's own client of actions gives only a text for goals that were not reached, in which the result's fields are lost,
 * and queues goals for the next connection; so the operations are sent here.
 */

import type { Ros } from "roslib";
import { linkTexts } from "../texts/link";

/** How a goal ended: with the fields of its result, or rejected in words. */
export type GoalEnd =
  | { readonly ok: true; readonly values: unknown }
  | { readonly ok: false; readonly words: string };

export interface GoalListener {
  readonly feedback: (values: unknown) => void;
  readonly ended: (end: GoalEnd) => void;
}

export class ActionGoals {
  #ros: Ros | undefined;
  #number = 0;
  readonly #active = new Set<(end: GoalEnd) => void>();

  attach(ros: Ros): void {
    this.#ros = ros;
  }

  /** End all goals: the robot cancels those of a client that has left. */
  detach(): void {
    this.#ros = undefined;
    for (const end of [...this.#active]) {
      end({ ok: false, words: linkTexts.answers.lostMeanwhile });
    }
  }

  /** Send a goal; returns what cancels it, or undefined without a connection. */
  send(action: string, type: string, goal: object, listener: GoalListener): (() => void) | undefined {
    const ros = this.#ros;
    if (ros?.isConnected !== true) {
      return undefined;
    }
    this.#number += 1;
    const id = `goal:${action}:${this.#number}`;
    const end = (how: GoalEnd): void => {
      ros.off(id, take);
      if (this.#active.delete(end)) {
        listener.ended(how);
      }
    };
    const take = (message: object): void => {
      const operation: unknown = Reflect.get(message, "op");
      const values: unknown = Reflect.get(message, "values");
      if (operation === "action_feedback") {
        listener.feedback(values);
      } else if (operation === "action_result") {
        const reached = Reflect.get(message, "result") === true;
        end(reached ? { ok: true, values } : { ok: false, words: typeof values === "string" ? values.slice(0, 1000) : "" });
      }
    };
    this.#active.add(end);
    ros.on(id, take);
    ros.callOnConnection({ op: "send_action_goal", id, action, action_type: type, args: goal, feedback: true });
    return () => {
      if (this.#active.has(end) && ros.isConnected) {
        ros.callOnConnection({ op: "cancel_action_goal", id, action });
      }
    };
  }
}
