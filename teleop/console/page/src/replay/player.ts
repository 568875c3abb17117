/** Plays a recorded run into the robot's state, by the same readers as a live robot's messages. */

import { batch, signal, type ReadonlySignal } from "@preact/signals";
import { CameraPictures } from "../link/camera_pictures";
import { Complaints } from "../link/complaints";
import { MessageIntake } from "../link/message_intake";
import { messageKinds } from "../link/message_kinds";
import { RobotPicture } from "../link/robot_picture";
import { robotStreams } from "../link/robot_streams";
import { forgetRun, type RobotState } from "../robot/robot_state";
import type { Session, Severity } from "../values";
import type { Recorded, Run } from "./run_reader";

const CAMERA = "/camera/rgb/image_rect_color/compressed";

/** What a person may do to a recorded robot. */
const NOBODY: Session = {
  client: 0, name: "", role: "recording", tokens: false, mayDrive: false, mayStop: false, mayReset: false, mayHint: false,
  maySearch: false, mayTakeOver: false, mayShare: false, link: false, mayPlay: false,
};

/** By then each stream of a run has been heard once [ms]: before it there is nothing to show. */
const BEGUN = 300;
/** A moment that is looked at is repeated so often [ms], so that nothing of it counts as old. */
const REPEAT = 200;

export class Player {
  readonly run: Run;
  readonly #state: RobotState;
  readonly #picture: RobotPicture;
  readonly #takers: ReadonlyMap<string, (message: unknown) => void>;
  readonly #at = signal(0);
  readonly #playing = signal(false);
  readonly #now: () => number;
  readonly #timer: ReturnType<typeof setInterval>;
  /** The next message that is to be played. */
  #next = 0;
  #tickedAt: number;
  #shownAt = -Infinity;

  /** The link to the robot must have been stopped: two sources at once would make no sense. */
  constructor(
    run: Run, state: RobotState, events: (severity: Severity, words: string) => void, now: () => number = () => performance.now(),
  ) {
    this.run = run;
    this.#state = state;
    this.#now = now;
    this.#tickedAt = now();
    this.#picture = new RobotPicture(state);
    const complaints = new Complaints((source, complaint) => { events("warning", `${source}: ${complaint}`); }, now);
    const intake = new MessageIntake({
      now, complaints, counted: () => undefined,
      stamped: (_topic, stamp) => { state.time.value = { stamp, receivedAt: now() }; },
    });
    const kinds = messageKinds({
      state, picture: this.#picture, pictures: new CameraPictures(),
      mapInfo: (info) => { state.mapInfo.value = info; },
      control: () => undefined,
      complain: (source, words) => { complaints.add(source, words); },
    });
    const streams = [
      ...robotStreams(intake, kinds, { lean: false, scan: true, topics: undefined }),
      intake.stream({ topic: CAMERA, type: "sensor_msgs/CompressedImage", cbor: true }, kinds.image),
    ];
    this.#takers = new Map(streams.map(({ topic, take }) => [topic, take]));
    batch(() => {
      forgetRun(state);
      state.dialect.value = "farsteer";
      state.session.value = NOBODY;
      state.arm.value = false;
      state.run.value = `replay:${run.name}`;
      state.connection.value = { phase: "open", words: "", sinceAt: now() };
      state.surfaces.value = run.surfaces;
    });
    this.seek(0);
    this.#timer = setInterval(() => { this.#tick(); }, 20);
  }

  /** The moment that is shown [ms since the run's beginning]. */
  get at(): ReadonlySignal<number> {
    return this.#at;
  }

  get playing(): ReadonlySignal<boolean> {
    return this.#playing;
  }

  play(): void {
    if (this.#at.peek() >= this.run.length) {
      this.seek(0);
    }
    this.#playing.value = true;
  }

  pause(): void {
    this.#playing.value = false;
  }

  /** Show a moment [ms]: of each topic the last message before it. */
  seek(at: number): void {
    this.#at.value = Math.min(Math.max(at, BEGUN), this.run.length);
    this.#next = this.run.messages.findIndex((message) => message.at > this.#at.peek());
    this.#next = this.#next < 0 ? this.run.messages.length : this.#next;
    this.#show();
  }

  stop(): void {
    clearInterval(this.#timer);
  }

  #tick(): void {
    const now = this.#now();
    const passed = now - this.#tickedAt;
    this.#tickedAt = now;
    if (this.#playing.peek()) {
      const at = Math.min(this.#at.peek() + passed, this.run.length);
      for (let message = this.run.messages[this.#next]; message !== undefined && message.at <= at; message = this.run.messages[this.#next]) {
        this.#take(message);
        this.#next += 1;
      }
      this.#at.value = at;
      this.#playing.value = at < this.run.length;
    } else if (now - this.#shownAt >= REPEAT) {
      this.#show();
    }
  }

  /** Show what was known at the present moment, and nothing of another. */
  #show(): void {
    this.#shownAt = this.#now();
    const last = new Map<string, Recorded>();
    for (const message of this.run.messages.slice(0, this.#next)) {
      last.set(message.topic, message);
    }
    batch(() => {
      for (const message of [...last.values()].sort((a, b) => a.at - b.at)) {
        this.#take(message);
      }
      this.#state.bumpers.value = last.has("/bumper_state") ? this.#state.bumpers.peek() : undefined;
      this.#state.guard.value = last.has("/teleop/guard") ? this.#state.guard.peek() : undefined;
    });
  }

  #take(message: Recorded): void {
    this.#takers.get(message.topic)?.(message.decode());
  }
}
