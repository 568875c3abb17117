/** Calls of services that always come to an end: an answer, a refusal, a time-out, or the connection's end. */

import { type Ros, Service } from "roslib";
import { linkTexts } from "../texts/link";
import type { Answer } from "../values";
import { readAnswer } from "./message_checks/answers";
import { check } from "./message_checks/field";

/** What a service answered; or in words why there is no answer. */
export type Reply =
  | { readonly ok: true; readonly values: unknown }
  | {
    readonly ok: false;
    readonly words: string;
    /** Whether the server itself said so. */
    readonly refused: boolean;
  };

const PATIENCE = 5;

export class ServiceCalls {
  #ros: Ros | undefined;
  readonly #waiting = new Set<(reply: Reply) => void>();

  attach(ros: Ros): void {
    this.#ros = ros;
  }

  /** End all calls: none is made again on the next connection. */
  detach(): void {
    this.#ros = undefined;
    for (const end of [...this.#waiting]) {
      end({ ok: false, words: linkTexts.answers.lostMeanwhile, refused: false });
    }
  }

  get connected(): boolean {
    return this.#ros !== undefined;
  }

  /** Call a service; the promise is never rejected. */
  call(name: string, type: string, request: object = {}, seconds = PATIENCE): Promise<Reply> {
    const ros = this.#ros;
    if (ros?.isConnected !== true) {
      return Promise.resolve({ ok: false, words: linkTexts.answers.notConnected, refused: false });
    }
    return new Promise((resolve) => {
      const end = (reply: Reply): void => {
        clearTimeout(timer);
        if (this.#waiting.delete(end)) {
          resolve(reply);
        }
      };
      const timer = setTimeout(() => {
        end({ ok: false, words: linkTexts.answers.noAnswer(seconds), refused: false });
      }, seconds * 1000);
      this.#waiting.add(end);
      const service = new Service<object, unknown>({ ros, name, serviceType: type });
      service.callService(
        request,
        (values) => {
          end({ ok: true, values });
        },
        (reason: unknown) => {
          end({ ok: false, words: reasonOf(reason), refused: true });
        },
        seconds,
      );
    });
  }

  /** Call a `std_srvs/Trigger`. */
  async trigger(name: string): Promise<Answer> {
    const reply = await this.call(name, "std_srvs/Trigger");
    if (!reply.ok) {
      return { success: false, message: reply.words };
    }
    const answer = check(readAnswer, reply.values);
    return answer.ok ? answer.value : { success: false, message: linkTexts.answers.unreadable(answer.complaint) };
  }
}

function reasonOf(reason: unknown): string {
  return linkTexts.answers.failed(typeof reason === "string" ? reason.slice(0, 1000) : "");
}
