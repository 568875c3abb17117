/** The chosen stream of the robot's camera: open while it is looked at, and closed otherwise. */

import { computed, effect, signal, type ReadonlySignal, type Signal } from "@preact/signals";
import { CameraPictures } from "../link/camera_pictures";
import { tokenHeaders } from "../link/token_headers";
import type { Dated } from "../robot/data_age";
import type { RobotState } from "../robot/robot_state";
import { remembered, rememberedSwitch, type Keeper } from "../scene/stored_signals";
import { cameraTexts as texts } from "../texts/camera";
import { FULL, paced, SLOW_RATE, type Pace } from "./camera_pace";
import { cameraStreams, type CameraStream } from "./camera_streams";
import { MultipartReader } from "./multipart_reader";

/** Before a stream that ended is opened again [ms]. */
export const REOPEN = 1000;
/** How often the page's lateness is looked at [ms]. */
const LOOK = 500;

/** A picture that is shown. */
export interface CameraPicture extends Dated {
  /** A blob's address, which holds until two newer pictures have come. */
  readonly url: string;
}

/** What the feed needs of its surroundings. */
export interface FeedParts {
  readonly fetch: (url: string, init: RequestInit) => Promise<Response>;
  readonly now: () => number;
  readonly document: Pick<Document, "visibilityState" | "addEventListener" | "removeEventListener">;
  readonly keeper: Keeper | undefined;
  /** Address of the page, and of the robot over HTTP. */
  readonly page: string;
  readonly robot: string;
  readonly token: () => string;
  /** How late the page comes to what is due [ms]; pictures are given up before it suffers. */
  readonly lateness?: () => number;
}

export class CameraFeed {
  /** Name of the chosen stream; empty: off; undefined: nobody chose, so that it is the first one. */
  readonly choice: Signal<string | undefined>;
  /** Whether the picture takes the whole place of the scene. */
  readonly large: Signal<boolean>;
  readonly streams: ReadonlySignal<readonly CameraStream[]>;
  /** The stream that is chosen and there. */
  readonly chosen: ReadonlySignal<CameraStream | undefined>;
  /** How many of the pictures this browser bears. */
  readonly pace: ReadonlySignal<Pace>;
  readonly picture: ReadonlySignal<CameraPicture | undefined>;
  /** Why no picture comes, in a line; empty while one does. */
  readonly trouble: ReadonlySignal<string>;
  readonly #parts: FeedParts;
  readonly #pictures = new CameraPictures();
  readonly #paced = signal<Pace>("full");
  readonly #shown = signal<CameraPicture | undefined>(undefined);
  readonly #said = signal("");
  readonly #watchers = signal(0);
  readonly #visible: Signal<boolean>;
  readonly #stop: () => void;
  readonly #looked = (): void => {
    this.#visible.value = this.#parts.document.visibilityState !== "hidden";
  };

  constructor(state: RobotState, parts: FeedParts) {
    this.#parts = parts;
    this.choice = remembered<string | undefined>("farsteer.camera", undefined, (kept) => (typeof kept === "string" ? kept : undefined), parts.keeper);
    this.large = rememberedSwitch("farsteer.cameraLarge", false, parts.keeper);
    this.pace = this.#paced;
    this.picture = this.#shown;
    this.trouble = this.#said;
    this.#visible = signal(parts.document.visibilityState !== "hidden");
    parts.document.addEventListener("visibilitychange", this.#looked);
    this.streams = computed(() => cameraStreams(state.videoSources.value ?? new Map(), parts.page, parts.robot));
    this.chosen = computed(() => this.streams.value.find(({ name, path }) =>
      this.choice.value === undefined ? path !== undefined : name === this.choice.value));
    const path = computed(() => {
      const open = state.connection.value.phase === "open" && this.#visible.value && this.#watchers.value > 0;
      const [stream, pace] = [this.chosen.value?.path, this.#paced.value];
      return !open || stream === undefined || pace === "off" ? undefined : pace === "slow" ? `${stream}&rate=${SLOW_RATE}` : stream;
    });
    const watching = this.#watchPace();
    // A new run of the robot has a clock of its own: its pictures are another stream.
    const reading = effect(() => {
      const [wanted] = [path.value, state.run.value];
      this.#clear();
      return wanted === undefined ? undefined : this.#open(wanted);
    });
    this.#stop = () => { watching(); reading(); };
  }

  /** Show the pictures from now on; the returned function ends that. They are fetched while anybody does. */
  watch(): () => void {
    this.#watchers.value += 1;
    return () => { this.#watchers.value -= 1; };
  }

  dispose(): void {
    this.#stop();
    this.#clear();
    this.#parts.document.removeEventListener("visibilitychange", this.#looked);
  }

  /** Show the pictures after all, at the pace that the page bears. */
  showAllTheSame(): void {
    this.choice.value = this.chosen.peek()?.name;
    this.#paced.value = "slow";
  }

  /** Follow how late the page is while pictures come. */
  #watchPace(): () => void {
    let state = FULL;
    const timer = setInterval(() => {
      const reads = this.#shown.peek() !== undefined;
      state = reads ? paced({ ...state, pace: this.#paced.peek() }, this.#parts.lateness?.() ?? 0, this.#parts.now(), Boolean(this.choice.peek())) : { ...FULL, pace: this.#paced.peek() };
      this.#paced.value = state.pace;
    }, LOOK);
    return () => { clearInterval(timer); };
  }

  #clear(): void {
    this.#shown.value = undefined;
    this.#said.value = "";
    this.#pictures.clear();
  }

  /** Read a stream, again and again; the returned function ends that. */
  #open(path: string): () => void {
    const closing = new AbortController();
    void this.#readOn(path, closing.signal);
    return () => { closing.abort(); };
  }

  async #readOn(path: string, closed: AbortSignal): Promise<void> {
    while (isOpen(closed)) {
      const words = await this.#read(path, closed);
      if (isOpen(closed)) {
        this.#said.value = words;
        await new Promise((resolve) => {
          setTimeout(resolve, REOPEN);
          closed.addEventListener("abort", resolve, { once: true });
        });
      }
    }
  }

  /** Read a stream to its end; return why it ended. */
  async #read(path: string, closed: AbortSignal): Promise<string> {
    const token = this.#parts.token();
    const headers = tokenHeaders(token);
    try {
      const answer = await this.#parts.fetch(path, { headers, signal: closed, cache: "no-store", credentials: "omit" });
      if (!answer.ok || answer.body === null) {
        return texts.refused((await answer.text()).slice(0, 300));
      }
      const [body, parts] = [answer.body.getReader(), new MultipartReader()];
      for (;;) {
        const { done, value } = await body.read();
        if (done) {
          return texts.ended;
        }
        const newest = parts.push(value).at(-1);
        if (newest !== undefined && isOpen(closed)) {
          const now = this.#parts.now();
          const { url } = this.#pictures.show(path, "image/jpeg", newest.data, now);
          this.#shown.value = { url, stamp: newest.stamp, receivedAt: now };
          this.#said.value = "";
        }
      }
    } catch (error) {
      return texts.failed(error instanceof Error ? error.message : String(error));
    }
  }
}

/** A function, since what it says changes while something is awaited. */
function isOpen(closed: AbortSignal): boolean {
  return !closed.aborted;
}
