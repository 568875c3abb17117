/** Brings the building's surfaces into the state, where the robot has them; the map's points stand in where not. */

import type { MapInfo } from "../values";
import { MapLoader, type LoaderParts } from "./map_loader";
import { tokenHeaders } from "./token_headers";

/** A file larger than this is none of a building [bytes]. */
const LARGEST = 32 * 1024 * 1024;

export class PlaceLoader {
  readonly #parts: LoaderParts;
  readonly #points: MapLoader;
  #pointsWanted = false;
  #abort = new AbortController();
  #asked = "";
  #file: ArrayBuffer | undefined;
  /** Whether the robot was found to have no surfaces of this map. */
  #isAbsent = false;

  constructor(parts: LoaderParts) {
    this.#parts = parts;
    this.#points = new MapLoader(parts);
  }

  /** Load what shows the map that the robot names, unless it is here or on its way. */
  load(info: MapInfo): void {
    if (this.#asked !== info.sha256) {
      this.#giveUp();
      this.#asked = info.sha256;
      void this.#bring(info, this.#abort.signal);
    }
    // A new run of the robot forgets what was shown, though the place is the same.
    this.#parts.state.surfaces.value = this.#file;
    if (this.#pointsWanted || this.#isAbsent) {
      this.#points.load(info);
    }
  }

  /** Load the points from now on as well: the surfaces say the same in a fiftieth of the bytes. */
  wantPoints(): void {
    this.#pointsWanted = true;
    const info = this.#parts.state.mapInfo.peek();
    if (info !== undefined) {
      this.#points.load(info);
    }
  }

  /** Try again at once what could not be had, such as with a new token. */
  again(): void {
    const info = this.#parts.state.mapInfo.peek();
    if (info !== undefined && this.#parts.state.surfaces.peek() === undefined) {
      this.#giveUp();
      this.load(info);
    }
    this.#points.again();
  }

  stop(): void {
    this.#giveUp();
    this.#points.stop();
  }

  #giveUp(): void {
    this.#abort.abort();
    this.#abort = new AbortController();
    this.#asked = "";
    this.#file = undefined;
    this.#isAbsent = false;
  }

  async #bring(info: MapInfo, signal: AbortSignal): Promise<void> {
    const { http, token, state } = this.#parts;
    const headers = tokenHeaders(token());
    try {
      const response = await this.#parts.fetch(`${http}/map.glb`, { headers, signal, credentials: "omit" });
      const file = response.ok ? await response.arrayBuffer() : new ArrayBuffer(0);
      if (file.byteLength > 0 && file.byteLength < LARGEST && mapOf(file) === info.sha256) {
        if (!signal.aborted) {
          this.#file = file;
          state.surfaces.value = file;
        }
        return;
      }
    } catch {
      // As if there were none; the link says what is wrong with itself.
    }
    if (!signal.aborted) {
      this.#isAbsent = true;
      this.#points.load(info);
    }
  }
}

/** Return the hash of the map that a GLB file's surfaces are of; undefined if it does not say. */
function mapOf(file: ArrayBuffer): string | undefined {
  const view = new DataView(file);
  const table = new Uint8Array(file, 20, view.getUint32(12, true));
  const { asset } = JSON.parse(new TextDecoder().decode(table)) as { asset?: { extras?: { sha256?: unknown } } };
  const sha256 = asset?.extras?.sha256;
  return typeof sha256 === "string" ? sha256 : undefined;
}
