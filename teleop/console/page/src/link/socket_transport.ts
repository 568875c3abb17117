/** Operations over a WebSocket, which counts what passes and says who it is first. */

import { decode } from "cbor2";
import type { Operation, Take } from "./rosbridge_client";

/** The part of a WebSocket that the link uses; tests give their own. */
export type Socket = Pick<
  WebSocket, "send" | "close" | "readyState" | "bufferedAmount" | "binaryType" | "onopen" | "onclose" | "onmessage" | "onerror"
>;

/** Why a connection ended. */
export interface Closing {
  readonly code: number;
  readonly reason: string;
  /** Whether it had been open. */
  readonly wasOpen: boolean;
}

/** The code of a connection that ended without a closing frame. */
export const ABNORMAL = 1006;

/** Bytes that may wait in the browser; beyond, a command would arrive too late to be true. */
const MOST_WAITING = 16 * 1024;

const OPEN = 1;

/** What happens to a socket. */
export interface SocketListener {
  readonly opened: () => void;
  /** The size of each frame that arrives [B]. */
  readonly received: (bytes: number) => void;
  readonly took: Take;
  /** A frame is no operation. */
  readonly unreadable: () => void;
  /** Called once, however the connection ends. */
  readonly ended: (closing: Closing) => void;
}

export class SocketTransport {
  readonly #socket: Socket;
  readonly #listener: SocketListener;
  #closed = false;
  #opened = false;

  /**
   * @param socket A socket that is about to open.
   * @param token What to log in with; empty without.
   * @param listener Hears what happens.
   */
  constructor(socket: Socket, token: string, listener: SocketListener) {
    this.#socket = socket;
    this.#listener = listener;
    socket.binaryType = "arraybuffer";
    socket.onopen = () => {
      if (this.#closed) {
        return;
      }
      this.#opened = true;
      if (token !== "") {
        socket.send(JSON.stringify({ op: "auth", token }));
      }
      listener.opened();
    };
    socket.onmessage = (event) => {
      this.#take(event.data);
    };
    socket.onclose = (event) => {
      this.#end(event.code, event.reason);
    };
    // A close follows, and says more.
    socket.onerror = null;
  }

  /** End at once, without waiting for a network that may be gone. */
  abandon(reason: string): void {
    this.#end(ABNORMAL, reason);
  }

  #take(data: unknown): void {
    if (this.#closed) {
      return;
    }
    this.#listener.received(typeof data === "string" ? data.length : data instanceof ArrayBuffer ? data.byteLength : 0);
    const operation = operationOf(data);
    if (operation === undefined) {
      this.#listener.unreadable();
    } else {
      this.#listener.took(operation);
    }
  }

  #end(code: number, reason: string): void {
    if (this.#closed) {
      return;
    }
    this.#closed = true;
    this.#socket.onopen = this.#socket.onmessage = this.#socket.onclose = null;
    this.#socket.close();
    this.#listener.ended({ code, reason, wasOpen: this.#opened });
  }

  /** Whether what is sent now leaves now. */
  get flows(): boolean {
    return this.isOpen && this.#socket.bufferedAmount <= MOST_WAITING;
  }

  /** Send an operation; false if the socket is not open. */
  send(operation: Operation): boolean {
    if (this.isOpen) {
      this.#socket.send(JSON.stringify(operation));
    }
    return this.isOpen;
  }

  get isOpen(): boolean {
    return !this.#closed && this.#socket.readyState === OPEN;
  }
}

/** The operation that a frame holds, as JSON or as CBOR; undefined if it holds none. */
function operationOf(data: unknown): Operation | undefined {
  try {
    const operation: unknown = data instanceof ArrayBuffer ? decode(new Uint8Array(data)) : JSON.parse(String(data));
    return isOperation(operation) ? operation : undefined;
  } catch {
    return undefined;
  }
}

function isOperation(value: unknown): value is Operation {
  return typeof value === "object" && value !== null && "op" in value && typeof value.op === "string";
}
