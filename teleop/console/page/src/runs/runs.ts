/** The robot's runs: begin and end one, list and fetch them; pictures of the page's own. */

import { signal, type ReadonlySignal } from "@preact/signals";
import { check, type Field } from "../link/message_checks/field";
import type { RobotWire } from "../link/robot_wire";
import { tokenHeaders } from "../link/token_headers";
import type { RobotState } from "../robot/robot_state";
import { replayTexts as texts } from "../texts/replay";
import type { Severity } from "../values";

export interface RunFacts {
  readonly name: string;
  readonly url: string;
  readonly start: string;
  /** Length [s]; undefined of a run that was cut off. */
  readonly seconds: number | undefined;
  readonly bytes: number;
  /** Whether it stays when room is made for others. */
  readonly kept: boolean;
}

export interface RunsParts {
  readonly wire: Pick<RobotWire, "stream" | "listen" | "trigger">;
  readonly state: RobotState;
  /** Address of the robot's files, such as `http://192.168.1.7:9090`. */
  readonly robot: string;
  readonly token: () => string;
  readonly fetch: (url: string, init: RequestInit) => Promise<Response>;
  readonly events: (severity: Severity, words: string) => void;
}

export class Runs {
  readonly #parts: RunsParts;
  readonly #recording = signal("");
  readonly #list = signal<readonly RunFacts[] | undefined>(undefined);

  constructor(parts: RunsParts) {
    this.#parts = parts;
    const { wire, events } = parts;
    wire.listen([wire.stream({ topic: "/runs/state", type: "std_msgs/String", latched: true, cbor: true }, {
      read: (message) => readState(message),
      use: ({ recording, ended, removed }) => {
        this.#recording.value = recording;
        if (ended !== "") {
          events("warning", ended);
        }
        if (removed.length > 0) {
          events("warning", texts.removed(removed));
          void this.#again();
        }
      },
    })]);
  }

  /** Name of the run that the robot records; empty while it records none. */
  get recording(): ReadonlySignal<string> {
    return this.#recording;
  }

  /** The runs, newest first; undefined until they have been asked for. */
  get list(): ReadonlySignal<readonly RunFacts[] | undefined> {
    return this.#list;
  }

  /** Begin to record, or end it. */
  async toggle(): Promise<void> {
    const { wire, events } = this.#parts;
    const ending = this.#recording.peek() !== "";
    const { success, message } = await wire.trigger(ending ? "/runs/stop" : "/runs/start");
    events(success ? "info" : "warning", success && ending ? texts.ended(message) : success ? texts.begun(message) : message);
    if (success && ending) {
      await this.refresh();
    }
  }

  /** Delete a run for good. */
  async remove({ name }: RunFacts): Promise<void> {
    await this.#change("/runs/delete", { name });
  }

  /** Have a run stay when room is made for others, or no longer. */
  async keep({ name, kept }: RunFacts): Promise<void> {
    await this.#change("/runs/keep", { name, keep: !kept });
  }

  async refresh(): Promise<void> {
    const listed = await this.#get<unknown>("/runs", (answer) => answer.json());
    const runs = listed === undefined ? undefined : check(readRuns, listed);
    if (runs?.ok === true) {
      this.#list.value = runs.value;
    } else if (runs !== undefined) {
      this.#parts.events("warning", texts.failed(runs.complaint));
    }
  }

  /** Fetch a run; undefined if that failed, which the events say. */
  async fetch(run: RunFacts): Promise<File | undefined> {
    const blob = await this.#get(run.url, (answer) => answer.blob());
    return blob === undefined ? undefined : new File([blob], run.name);
  }

  async #change(service: string, request: object): Promise<void> {
    const { success, message } = await this.#parts.wire.trigger(service, request);
    this.#parts.events(success ? "info" : "warning", success ? message : texts.notChanged(message));
    await this.refresh();
  }

  /** List them anew, if somebody has listed them. */
  async #again(): Promise<void> {
    if (this.#list.peek() !== undefined) {
      await this.refresh();
    }
  }

  /** Return the whole of a file, read as it shall be; undefined if that failed, which the events say. */
  async #get<T>(path: string, read: (answer: Response) => Promise<T>): Promise<T | undefined> {
    const { robot, token, fetch, events } = this.#parts;
    const headers = tokenHeaders(token());
    try {
      const answer = await fetch(`${robot}${path}`, { headers });
      if (answer.ok) {
        return await read(answer);
      }
      events("warning", texts.failed(`${answer.status} ${answer.statusText}`));
    } catch (error) {
      events("warning", texts.failed(String(error)));
    }
    return undefined;
  }
}

interface RunsState {
  readonly recording: string;
  readonly ended: string;
  readonly removed: readonly string[];
}

function readState(message: Field): RunsState {
  const text = message.at("data").text(10_000);
  try {
    const { recording = "", ended = "", removed = [] } = JSON.parse(text) as { recording?: unknown; ended?: unknown; removed?: unknown };
    return { recording: String(recording), ended: String(ended), removed: Array.isArray(removed) ? removed.map(String) : [] };
  } catch {
    return message.at("data").fail("is no JSON");
  }
}

function readRuns(values: Field): readonly RunFacts[] {
  return values.at("runs").list(1000).map((run) => ({
    name: run.at("name").text(),
    url: run.at("url").text(),
    start: run.at("start").text(),
    seconds: run.at("seconds").missing ? undefined : run.at("seconds").within(0, 1e9),
    bytes: run.at("bytes").within(0, 1e15),
    kept: run.at("kept").boolean(),
  }));
}

/** Give the person a file to keep. */
export function saveFile(name: string, content: Blob): void {
  const link = document.createElement("a");
  link.href = URL.createObjectURL(content);
  link.download = name;
  link.click();
  setTimeout(() => { URL.revokeObjectURL(link.href); }, 60_000);
}

/** Save the picture as it is drawn next: a canvas keeps none for longer than its frame. */
export function savePicture(canvas: HTMLCanvasElement, draw: () => void): void {
  draw();
  requestAnimationFrame(() => {
    canvas.toBlob((png) => {
      if (png !== null) {
        saveFile(`farsteer-${new Date().toISOString().slice(0, 19).replace(/[-:]/g, "").replace("T", "-")}.png`, png);
      }
    }, "image/png");
  });
}
