/** A WebSocket as roslib wants it, which counts what passes and says who it is first. */

import { AbstractTransport } from "roslib";

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

const CONNECTING = 0;
const OPEN = 1;
const CLOSING = 2;
const CLOSED = 3;

type OutgoingMessage = Parameters<AbstractTransport["send"]>[0];

export class SocketTransport extends AbstractTransport {
  readonly #socket: Socket;
  readonly #received: (bytes: number) => void;
  #closed = false;
  #opened = false;

  /**
   * @param socket A socket that is about to open.
   * @param token What to log in with; empty without.
   * @param received Called with the size of each frame that arrives.
   * @param ended Called once, however the connection ends.
   */
  constructor(socket: Socket, token: string, received: (bytes: number) => void, ended: (closing: Closing) => void) {
    super();
    this.#socket = socket;
    this.#received = received;
    socket.binaryType = "arraybuffer";
    socket.onopen = (event) => {
      if (this.#closed) {
        return;
      }
      this.#opened = true;
      if (token !== "") {
        socket.send(JSON.stringify({ op: "auth", token }));
      }
      this.emit("open", event);
    };
    socket.onmessage = (event) => {
      this.#take(event.data);
    };
    socket.onclose = (event) => {
      this.#end({ code: event.code, reason: event.reason, wasOpen: this.#opened }, ended);
    };
    // A close follows, and says more.
    socket.onerror = null;
    this.abandon = (reason) => {
      this.#end({ code: ABNORMAL, reason, wasOpen: this.#opened }, ended);
    };
  }

  /** End at once, without waiting for a network that may be gone. */
  readonly abandon: (reason: string) => void;

  #take(data: unknown): void {
    if (this.#closed) {
      return;
    }
    this.#received(typeof data === "string" ? data.length : data instanceof ArrayBuffer ? data.byteLength : 0);
    this.handleRawMessage(data);
  }

  #end(closing: Closing, ended: (closing: Closing) => void): void {
    if (this.#closed) {
      return;
    }
    this.#closed = true;
    this.#socket.onopen = this.#socket.onmessage = this.#socket.onclose = null;
    this.#socket.close();
    this.emit("close", closing);
    ended(closing);
  }

  /** Whether what is sent now leaves now. */
  get flows(): boolean {
    return this.isOpen() && this.#socket.bufferedAmount <= MOST_WAITING;
  }

  override send(message: OutgoingMessage): void {
    if (this.isOpen()) {
      this.#socket.send(JSON.stringify(message));
    }
  }

  override close(): void {
    this.abandon("");
  }

  override isConnecting(): boolean {
    return !this.#closed && this.#socket.readyState === CONNECTING;
  }

  override isOpen(): boolean {
    return !this.#closed && this.#socket.readyState === OPEN;
  }

  override isClosing(): boolean {
    return !this.#closed && this.#socket.readyState === CLOSING;
  }

  override isClosed(): boolean {
    return this.#closed || this.#socket.readyState === CLOSED;
  }
}
