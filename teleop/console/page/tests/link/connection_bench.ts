/** A connection with sockets of its own, for tests. */

import { vi } from "vitest";
import type { RosbridgeClient } from "../../src/link/rosbridge_client";
import { RosbridgeConnection } from "../../src/link/rosbridge_connection";
import type { Connection } from "../../src/robot/robot_state";
import { FakeSocket } from "./fake_socket";

export const ADDRESS = "ws://robot:9090";
export const PUBLISHED = { op: "publish", topic: "/t", msg: {} };

export class Bench {
  readonly sockets: FakeSocket[] = [];
  readonly changes: Connection[] = [];
  readonly clients: RosbridgeClient[] = [];
  readonly statuses: string[] = [];
  closed = 0;
  unreadable = 0;
  hung: boolean[] = [];
  readonly connection: RosbridgeConnection;

  constructor(token = "") {
    this.connection = new RosbridgeConnection(
      ADDRESS, token,
      {
        openSocket: () => {
          const socket = new FakeSocket();
          this.sockets.push(socket);
          return socket;
        },
        diagnose: (hung) => {
          this.hung.push(hung);
          return Promise.resolve("diagnosed");
        },
        now: () => performance.now(),
      },
      {
        opened: (client) => {
          this.clients.push(client);
        },
        closed: () => {
          this.closed += 1;
        },
        changed: (connection) => {
          this.changes.push(connection);
        },
        received: () => undefined,
        status: (level, words) => {
          this.statuses.push(`${level}: ${words}`);
        },
        unreadable: () => {
          this.unreadable += 1;
        },
      },
    );
  }

  get socket(): FakeSocket {
    const socket = this.sockets.at(-1);
    if (socket === undefined) {
      throw new Error("no socket was opened");
    }
    return socket;
  }

  get last(): Connection | undefined {
    return this.changes.at(-1);
  }

  /** The handshake succeeds, and nothing is said yet. */
  async handshake(): Promise<FakeSocket> {
    await vi.advanceTimersByTimeAsync(0);
    this.socket.accept();
    return this.socket;
  }

  async open(): Promise<FakeSocket> {
    const socket = await this.handshake();
    socket.deliver(PUBLISHED);
    return socket;
  }
}
