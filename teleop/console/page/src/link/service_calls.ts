/** Calls of services that always come to an end: an answer, a refusal, a time-out, or the connection's end. */

import { linkTexts } from "../texts/link";
import type { Answer } from "../values";
import type { GoalEnd } from "./action_goals";
import { readAnswer } from "./message_checks/answers";
import { check, type Reader } from "./message_checks/field";
import type { RosbridgeClient } from "./rosbridge_client";

/** What a service answered; or in words why there is no answer. */
export type Reply =
  | { readonly ok: true; readonly values: unknown }
  | {
    readonly ok: false;
    readonly words: string;
    /** Whether the server itself said so. */
    readonly refused: boolean;
  };

/** A reply as it was read; or in words why there is none, or none that can be read. */
export type ReadReply<T> =
  | { readonly ok: true; readonly value: T }
  | { readonly ok: false; readonly words: string };

const PATIENCE = 5;

export class ServiceCalls {
  #client: RosbridgeClient | undefined;
  readonly #waiting = new Set<(reply: Reply) => void>();

  attach(client: RosbridgeClient): void {
    this.#client = client;
  }

  /** End all calls: none is made again on the next connection. */
  detach(): void {
    this.#client = undefined;
    for (const end of [...this.#waiting]) {
      end({ ok: false, words: linkTexts.answers.lostMeanwhile, refused: false });
    }
  }

  get connected(): boolean {
    return this.#client !== undefined;
  }

  /** Call a service; the promise is never rejected. */
  call(name: string, request: object = {}, seconds = PATIENCE): Promise<Reply> {
    const client = this.#client;
    return new Promise((resolve) => {
      const end = (reply: Reply): void => {
        clearTimeout(timer);
        client?.forget(id ?? "");
        if (this.#waiting.delete(end)) {
          resolve(reply);
        }
      };
      const id = client?.ask({ op: "call_service", service: name, args: request, timeout: seconds }, ({ result, values }) => {
        end(result === true ? { ok: true, values } : { ok: false, words: reasonOf(values), refused: true });
      });
      const timer = setTimeout(() => {
        end({ ok: false, words: linkTexts.answers.noAnswer(seconds), refused: false });
      }, seconds * 1000);
      this.#waiting.add(end);
      if (id === undefined) {
        end({ ok: false, words: linkTexts.answers.notConnected, refused: false });
      }
    });
  }

  /** Call a service that answers as `std_srvs/Trigger` does: whether it was done, and a message. */
  async trigger(name: string, request: object = {}, seconds = PATIENCE): Promise<Answer> {
    const answer = readReply(await this.call(name, request, seconds), readAnswer);
    return answer.ok ? answer.value : { success: false, message: answer.words };
  }
}

/** Read the reply to a call, or the end of a goal. */
export function readReply<T>(reply: GoalEnd, reader: Reader<T>): ReadReply<T> {
  if (!reply.ok) {
    return reply;
  }
  const read = check(reader, reply.values);
  return read.ok ? read : { ok: false, words: linkTexts.answers.unreadable(read.complaint) };
}

function reasonOf(reason: unknown): string {
  return linkTexts.answers.failed(typeof reason === "string" ? reason.slice(0, 1000) : "");
}
