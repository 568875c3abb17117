/** Reads what came over the wire, of which nothing is known: each part is checked before it is used. */

/** What is wrong with a message, in words; caught by `check`, so that it never leaves this folder. */
class Complaint extends Error {}

/** A message that is as it should be, or what is wrong with it. */
export type Checked<T> =
  | { readonly ok: true; readonly value: T }
  | { readonly ok: false; readonly complaint: string };

/** A type's reader: takes the message as a field without a name. */
export type Reader<T> = (message: Field) => T;

/** Coordinates beyond this are no place on Earth that a robot drives to [m]; they would overflow in float32. */
const FARTHEST = 1e7;
const LONGEST_NAME = 256;

/** Read a message; a field that is missing or wrong becomes a complaint that names it. */
export function check<T>(reader: Reader<T>, message: unknown): Checked<T> {
  try {
    return { ok: true, value: reader(new Field(message, "")) };
  } catch (error) {
    if (error instanceof Complaint) {
      return { ok: false, complaint: error.message };
    }
    throw error;
  }
}

/** One value of a message, and where it stands. */
export class Field {
  readonly #value: unknown;
  readonly path: string;

  constructor(value: unknown, path: string) {
    this.#value = value;
    this.path = path;
  }

  /** Give up on the message: `words` follow the field's name. */
  fail(words: string): never {
    throw new Complaint(`${this.path === "" ? "the message" : this.path} ${words}`);
  }

  /** A field of an object; it may be missing, which is noticed when it is read. */
  at(name: string): Field {
    const path = this.path === "" ? name : `${this.path}.${name}`;
    if (typeof this.#value !== "object" || this.#value === null) {
      return this.#value === undefined ? this.fail("is missing") : this.fail("is not an object");
    }
    if (!Object.hasOwn(this.#value, name)) {
      return new Field(undefined, path);
    }
    const value: unknown = Reflect.get(this.#value, name);
    return new Field(value, path);
  }

  get missing(): boolean {
    return this.#value === undefined || this.#value === null;
  }

  /** A finite number. */
  number(): number {
    const value = asNumber(this.#value);
    if (value === undefined) {
      return this.missing ? this.fail("is missing") : this.fail("is not a number");
    }
    return Number.isFinite(value) ? value : this.fail("is not finite");
  }

  /** A number from `least` to `most`. */
  within(least: number, most: number): number {
    const value = this.number();
    return value >= least && value <= most ? value : this.fail(`is not within ${least} and ${most}`);
  }

  /** A coordinate [m]. */
  coordinate(): number {
    return this.within(-FARTHEST, FARTHEST);
  }

  /** A whole number from 0 to `most`. */
  count(most: number): number {
    const value = this.within(0, most);
    return Number.isInteger(value) ? value : this.fail("is not a whole number");
  }

  boolean(): boolean {
    if (typeof this.#value === "boolean") {
      return this.#value;
    }
    // Servers in Python 2 and some in C++ send 0 and 1.
    return this.#value === 0 || this.#value === 1 ? this.#value === 1 : this.fail("is neither true nor false");
  }

  /** Text of at most `longest` characters; a longer one is cut where it may be. */
  text(longest = LONGEST_NAME, cut = true): string {
    if (typeof this.#value !== "string") {
      return this.missing ? this.fail("is missing") : this.fail("is not a text");
    }
    if (this.#value.length <= longest) {
      return this.#value;
    }
    return cut ? `${this.#value.slice(0, longest)}…` : this.fail(`is longer than ${longest} characters`);
  }

  /** One of these words. */
  word<W extends string>(words: readonly W[]): W {
    const text = this.text();
    return words.find((word) => word === text) ?? this.fail("is a word that this page does not know");
  }

  /** The items of a list of at most `longest`. */
  list(longest: number): readonly Field[] {
    if (!Array.isArray(this.#value)) {
      return this.missing ? this.fail("is missing") : this.fail("is not a list");
    }
    const items: readonly unknown[] = this.#value;
    if (items.length > longest) {
      return this.fail(`has more than ${longest} items`);
    }
    return Array.from(items, (item, index) => new Field(item, `${this.path}[${index}]`));
  }

  /** Numbers, of which some may be NaN (JSON gives null for them, CBOR typed arrays). */
  numbers(longest: number): ArrayLike<number> {
    const value = this.#value;
    if (isTypedArray(value)) {
      return value.length > longest ? this.fail(`has more than ${longest} items`) : value;
    }
    if (!Array.isArray(value)) {
      return this.missing ? this.fail("is missing") : this.fail("is not a list of numbers");
    }
    const items: readonly unknown[] = value;
    if (items.length > longest) {
      return this.fail(`has more than ${longest} items`);
    }
    return Float64Array.from(items, (item) => asNumber(item) ?? NaN);
  }

  /** Whole numbers of 64 bits, as CBOR's typed arrays of bigint or as lists. */
  numbers64(longest: number): readonly number[] {
    const value = this.#value;
    if (value instanceof BigUint64Array || value instanceof BigInt64Array) {
      return value.length > longest ? this.fail(`has more than ${longest} items`) : Array.from(value, Number);
    }
    return Array.from(this.numbers(longest), (item) => (Number.isFinite(item) ? item : 0));
  }

  /** Bytes: binary in CBOR, base64 or a list of numbers in JSON; at most `longest`. */
  bytes(longest: number): Uint8Array {
    const value = this.#value;
    if (value instanceof Uint8Array || value instanceof Int8Array) {
      return value.length > longest
        ? this.fail(`has more than ${longest} bytes`)
        : new Uint8Array(value.buffer, value.byteOffset, value.byteLength);
    }
    if (typeof value === "string") {
      return value.length > (longest * 4) / 3 + 4
        ? this.fail(`has more than ${longest} bytes`)
        : (fromBase64(value) ?? this.fail("is not base64"));
    }
    return Uint8Array.from(Array.from(this.numbers(longest)));
  }
}

type NumberArray =
  | Float64Array | Float32Array | Int8Array | Uint8Array | Uint8ClampedArray | Int16Array | Uint16Array | Int32Array
  | Uint32Array;

function isTypedArray(value: unknown): value is NumberArray {
  return ArrayBuffer.isView(value) && "length" in value &&
    !(value instanceof BigInt64Array) && !(value instanceof BigUint64Array);
}

/** The number that a value is; undefined if it is none. CBOR gives a bigint for large whole numbers. */
function asNumber(value: unknown): number | undefined {
  if (typeof value === "bigint") {
    return Number(value);
  }
  return typeof value === "number" ? value : undefined;
}

function fromBase64(text: string): Uint8Array | undefined {
  try {
    const decoded = atob(text);
    const bytes = new Uint8Array(decoded.length);
    for (let i = 0; i < decoded.length; i++) {
      bytes[i] = decoded.charCodeAt(i);
    }
    return bytes;
  } catch {
    return undefined;
  }
}
