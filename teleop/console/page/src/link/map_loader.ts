/** Brings the map's points into the state whenever the robot names a map. */

import type { RobotState } from "../robot/robot_state";
import { linkTexts } from "../texts/link";
import type { MapInfo, MapPoints, Severity } from "../values";
import { DownloadError, downloadMap, type DownloadParts, dropMap, keepMap } from "./map_download";
import type { MapJob, MapResult } from "./map_file";

/** Until a map that could not be had is tried again, longer each time [ms]. */
const RETRIES = [2000, 5000, 15_000, 60_000] as const;

export interface LoaderParts extends DownloadParts {
  readonly http: string;
  readonly read: (job: MapJob) => Promise<MapResult>;
  readonly token: () => string;
  readonly state: RobotState;
  readonly events: (severity: Severity, words: string) => void;
}

export class MapLoader {
  readonly #parts: LoaderParts;
  #abort = new AbortController();
  #retry: ReturnType<typeof setTimeout> | undefined;
  #points: MapPoints | undefined;
  #loading = "";
  #saidUnverified = false;

  constructor(parts: LoaderParts) {
    this.#parts = parts;
  }

  /** Load the map that the robot names, unless it is here already. */
  load(info: MapInfo): void {
    if (this.#points?.sha256 === info.sha256) {
      this.#parts.state.mapPoints.value = this.#points;
      return;
    }
    if (this.#loading !== info.sha256) {
      this.stop();
      this.#loading = info.sha256;
      void this.#attempt(info.sha256, 0, this.#abort);
    }
  }

  /** Try again at once, such as with a new token. */
  again(): void {
    const info = this.#parts.state.mapInfo.peek();
    if (info !== undefined && this.#retry !== undefined) {
      this.stop();
      this.load(info);
    }
  }

  stop(): void {
    clearTimeout(this.#retry);
    this.#retry = undefined;
    this.#abort.abort();
    this.#abort = new AbortController();
    this.#loading = "";
    this.#parts.state.mapProgress.value = undefined;
  }

  async #attempt(sha256: string, tries: number, abort: AbortController): Promise<void> {
    const { state, events, caches } = this.#parts;
    this.#retry = undefined;
    state.mapProgress.value = 0;
    const problem = await this.#bring(sha256, abort);
    if (abort.signal.aborted) {
      return;
    }
    state.mapProgress.value = undefined;
    if (problem === undefined) {
      this.#loading = "";
      return;
    }
    await dropMap(caches, sha256);
    if (tries === 0) {
      events("warning", problem);
    }
    this.#retry = setTimeout(() => {
      void this.#attempt(sha256, tries + 1, abort);
    }, RETRIES[Math.min(tries, RETRIES.length - 1)]);
  }

  /** Fetch, verify, read and show; return what went wrong. */
  async #bring(sha256: string, abort: AbortController): Promise<string | undefined> {
    const { http, token, state, events, read, caches } = this.#parts;
    let file: ArrayBuffer;
    try {
      const progress = (share: number): void => {
        if (!abort.signal.aborted) {
          state.mapProgress.value = share;
        }
      };
      file = await downloadMap({ http, sha256, token: token(), signal: abort.signal, progress }, this.#parts);
    } catch (error) {
      return linkTexts.events.mapFailed(error instanceof DownloadError ? error.message : "the download failed");
    }
    const result = await read({ file, sha256 });
    if (abort.signal.aborted) {
      return undefined;
    }
    if (result.kind === "wrong") {
      return linkTexts.events.mapWrong;
    }
    if (result.kind === "bad") {
      return linkTexts.events.mapBad(result.reason);
    }
    const { positions, normals } = result;
    this.#points = normals === undefined ? { sha256, positions } : { sha256, positions, normals };
    state.mapPoints.value = this.#points;
    if (result.verified) {
      void keepMap(caches, sha256, file);
    } else if (!this.#saidUnverified) {
      this.#saidUnverified = true;
      events("info", linkTexts.events.mapUnverified);
    }
    return undefined;
  }
}
