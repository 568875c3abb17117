/** Asks the robot small things regularly, to know the round trip, who this connection is, and what was left out for it. */

import type { RobotState } from "../robot/robot_state";
import { readLinkAnswer, readSession } from "./message_checks/answers";
import { check } from "./message_checks/field";
import type { LinkRecorder } from "./link_statistics";
import type { ServiceCalls } from "./service_calls";

/** Every server answers a call, be it by saying that there is no such service. */
const ASK_EVERY = 1000;
const COUNTS_EVERY = 1000;
/** Timers come a little early or late [ms]. */
const SLACK = 50;

export class LinkProbe {
  readonly #calls: ServiceCalls;
  readonly #recorder: LinkRecorder;
  readonly #state: RobotState;
  readonly #now: () => number;
  readonly #complain: (source: string, complaint: string) => void;
  #askedAt = -Infinity;
  #countedAt = -Infinity;
  #hasSession = true;
  #hasCounts = true;
  #generation = 0;
  #introduced = false;

  constructor(
    calls: ServiceCalls, recorder: LinkRecorder, state: RobotState, now: () => number,
    complain: (source: string, complaint: string) => void,
    /** Name of the person at this page; empty for none. */
    private readonly name: () => string = () => "",
  ) {
    this.#calls = calls;
    this.#recorder = recorder;
    this.#state = state;
    this.#now = now;
    this.#complain = complain;
  }

  /** A new connection may be to another robot. */
  reset(): void {
    this.#generation += 1;
    this.#askedAt = this.#countedAt = -Infinity;
    this.#hasSession = this.#hasCounts = true;
    this.#introduced = false;
  }

  /** Ask what is due. */
  tick(now: number): void {
    if (now - this.#askedAt >= ASK_EVERY - SLACK) {
      this.#askedAt = now;
      void this.#askSession();
    }
    if (this.#hasCounts && this.#state.dialect.peek() === "farsteer" && now - this.#countedAt >= COUNTS_EVERY - SLACK) {
      this.#countedAt = now;
      void this.#askCounts();
    }
  }

  async #askSession(): Promise<void> {
    const generation = this.#generation;
    const askedAt = this.#now();
    const farsteer = this.#hasSession && this.#state.dialect.peek() !== "plain";
    if (farsteer && this.name() !== "" && !this.#introduced) {
      this.#introduced = true;
      void this.#calls.call("/teleop/introduce", { name: this.name() });
    }
    this.#recorder.asked(askedAt);
    const reply = farsteer
      ? await this.#calls.call("/teleop/session")
      : await this.#calls.call("/rosapi/get_time");
    if (generation !== this.#generation) {
      return;
    }
    if (reply.ok || reply.refused) {
      this.#recorder.answered(askedAt, this.#now());
    }
    if (!farsteer) {
      return;
    }
    if (!reply.ok) {
      this.#hasSession = !reply.refused;
      return;
    }
    const session = check(readSession, reply.values);
    if (!session.ok) {
      this.#complain("/teleop/session", session.complaint);
    } else if (JSON.stringify(session.value) !== JSON.stringify(this.#state.session.peek())) {
      this.#state.session.value = session.value;
    }
  }

  async #askCounts(): Promise<void> {
    const generation = this.#generation;
    const askedAt = this.#now();
    const reply = await this.#calls.call("/teleop/link");
    const cameAt = this.#now();
    if (generation !== this.#generation) {
      return;
    }
    if (!reply.ok) {
      this.#hasCounts = !reply.refused;
      return;
    }
    const answer = check(readLinkAnswer, reply.values);
    if (answer.ok) {
      this.#recorder.counted(answer.value, askedAt, cameAt);
    } else {
      this.#complain("/teleop/link", answer.complaint);
    }
  }
}
