/** A WebSocket whose other end is the test. */

import type { Socket } from "../../src/link/socket_transport";

export interface Sent {
  readonly op: string;
  readonly [field: string]: unknown;
}

function isSent(value: unknown): value is Sent {
  return typeof value === "object" && value !== null && "op" in value;
}

export class FakeSocket implements Socket {
  readyState: Socket["readyState"] = 0;
  bufferedAmount = 0;
  binaryType: BinaryType = "blob";
  onopen: Socket["onopen"] = null;
  onclose: Socket["onclose"] = null;
  onmessage: Socket["onmessage"] = null;
  onerror: Socket["onerror"] = null;
  readonly sent: Sent[] = [];
  /** Called with each operation that the page sends. */
  receive: (operation: Sent) => void = () => undefined;

  send(data: unknown): void {
    const operation: unknown = JSON.parse(String(data));
    if (isSent(operation)) {
      this.sent.push(operation);
      this.receive(operation);
    }
  }

  close(): void {
    this.readyState = 3;
  }

  /** The handshake succeeds. */
  accept(): void {
    this.readyState = 1;
    this.onopen?.call(this.#self(), new Event("open"));
  }

  /** A frame comes from the server. */
  deliver(frame: unknown): void {
    const data = typeof frame === "string" || frame instanceof ArrayBuffer ? frame : JSON.stringify(frame);
    this.onmessage?.call(this.#self(), new MessageEvent("message", { data }));
  }

  /** The connection ends; 1006 without a closing frame. */
  drop(code = 1006, reason = ""): void {
    this.readyState = 3;
    this.onclose?.call(this.#self(), Object.assign(new Event("close"), { code, reason, wasClean: code !== 1006 }));
  }

  /** Operations of a kind that the page has sent. */
  operations(op: string): Sent[] {
    return this.sent.filter((operation) => operation.op === op);
  }

  #self(): WebSocket {
    // Handlers are declared with a whole WebSocket as `this`, which none of the page's uses.
    return this as unknown as WebSocket;
  }
}
