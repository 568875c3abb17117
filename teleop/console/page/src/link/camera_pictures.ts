/** Pictures of a camera as addresses that an image element shows. */

import type { CameraImage } from "../values";

/** The element may still be loading the picture before. */
const KEPT = 3;

export class CameraPictures {
  #urls: string[] = [];

  /** Give a picture an address; the oldest one loses its own. */
  show(topic: string, type: string, data: Uint8Array, receivedAt: number): CameraImage {
    const url = URL.createObjectURL(new Blob([new Uint8Array(data)], { type }));
    this.#urls.push(url);
    if (this.#urls.length > KEPT) {
      const oldest = this.#urls.shift();
      if (oldest !== undefined) {
        URL.revokeObjectURL(oldest);
      }
    }
    return { topic, url, receivedAt };
  }

  clear(): void {
    for (const url of this.#urls) {
      URL.revokeObjectURL(url);
    }
    this.#urls = [];
  }
}
