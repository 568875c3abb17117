/** Cuts a stream of motion JPEG into its pictures, by the lengths that their headers give. */

/** One picture of a stream. */
export interface StreamPart {
  readonly data: Uint8Array;
  /** Robot time at which the camera saw it [s]; undefined if the stream does not say. */
  readonly stamp: number | undefined;
}

/** A header that is longer, or a picture that is larger, is none [bytes]. */
const LONGEST_HEADER = 8192;
const LARGEST_PICTURE = 16 * 1024 * 1024;

const [CR, LF] = [13, 10];

export class MultipartReader {
  #waiting: Uint8Array = new Uint8Array(0);

  /**
   * Take bytes of the stream; return the pictures that they complete.
   *
   * Throws an error if the stream is none of pictures with a `Content-Length`.
   */
  push(bytes: Uint8Array): StreamPart[] {
    this.#waiting = joined(this.#waiting, bytes);
    const parts: StreamPart[] = [];
    for (;;) {
      const begin = headerEnd(this.#waiting);
      if (begin === undefined) {
        if (this.#waiting.length > LONGEST_HEADER) {
          throw new Error("no header of a picture");
        }
        return parts;
      }
      const header = new TextDecoder("latin1").decode(this.#waiting.subarray(0, begin));
      const length = numberOf(header, "content-length");
      if (length === undefined || length > LARGEST_PICTURE) {
        throw new Error("a picture without its length");
      }
      if (this.#waiting.length < begin + length) {
        return parts;
      }
      parts.push({ data: this.#waiting.slice(begin, begin + length), stamp: numberOf(header, "x-timestamp") });
      this.#waiting = this.#waiting.slice(begin + length);
    }
  }
}

/** Where a picture begins: behind the empty line that ends its header. */
function headerEnd(bytes: Uint8Array): number | undefined {
  // The line that separates parts comes after an empty line of its own, which ends no header.
  let start = 0;
  while (bytes[start] === CR || bytes[start] === LF) {
    start += 1;
  }
  for (let i = start; i + 3 < Math.min(bytes.length, start + LONGEST_HEADER); i += 1) {
    if (bytes[i] === CR && bytes[i + 1] === LF && bytes[i + 2] === CR && bytes[i + 3] === LF) {
      return i + 4;
    }
  }
  return undefined;
}

function numberOf(header: string, name: string): number | undefined {
  const line = header.split("\r\n").find((each) => each.toLowerCase().startsWith(`${name}:`));
  const value = line === undefined ? NaN : Number(line.slice(name.length + 1).trim() || NaN);
  return Number.isFinite(value) && value >= 0 ? value : undefined;
}

function joined(a: Uint8Array, b: Uint8Array): Uint8Array {
  if (a.length === 0) {
    return b;
  }
  const both = new Uint8Array(a.length + b.length);
  both.set(a);
  both.set(b, a.length);
  return both;
}
