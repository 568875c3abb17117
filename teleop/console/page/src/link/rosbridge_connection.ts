/** A connection that comes back by itself; each time with a client of its own, so that nothing old is sent again. */

import type { Connection } from "../robot/robot_state";
import { linkTexts } from "../texts/link";
import { asksForToken, consequenceOf } from "./closing_words";
import { type Operation, RosbridgeClient } from "./rosbridge_client";
import { type Closing, type Socket, SocketTransport } from "./socket_transport";

/** Before the first attempt to come back, and before each further one [ms]. */
export const FIRST_RETRY = 500;
export const NEXT_RETRY = 1000;
/** An attempt that has not opened by then is given up [ms]. */
export const OPEN_TIMEOUT = 3000;
/** Without a frame for so long the network counts as gone [ms]. The link asks the robot something each second. */
export const SILENCE_LIMIT = 5000;
/** A timer that is this late says that the machine slept, not that the robot is silent [ms]. */
const SLEPT = 2500;
const WATCH_PERIOD = 1000;
const HUNG = "no answer to the handshake";

/** Operations that this page sends and none sends to it: what sends them back is an echo, no rosbridge. */
const OWN_OPERATIONS = new Set(["subscribe", "unsubscribe", "advertise", "call_service", "auth"]);

/** What the connection needs of its surroundings. */
export interface ConnectionParts {
  readonly openSocket: (address: string) => Socket;
  /** Say in a sentence why an attempt failed. */
  readonly diagnose: (hung: boolean) => Promise<string>;
  readonly now: () => number;
}

/** What the connection reports. */
export interface ConnectionListener {
  readonly opened: (client: RosbridgeClient) => void;
  readonly closed: () => void;
  readonly changed: (connection: Connection) => void;
  readonly received: (bytes: number) => void;
  /** A status of the server: its level and its words. */
  readonly status: (level: string, words: string) => void;
  /** A frame that cannot be read. */
  readonly unreadable: () => void;
}

export class RosbridgeConnection {
  readonly #address: string;
  readonly #parts: ConnectionParts;
  readonly #listener: ConnectionListener;
  #token: string;
  #transport: SocketTransport | undefined;
  #retry: ReturnType<typeof setTimeout> | undefined;
  #deadline: ReturnType<typeof setTimeout> | undefined;
  #watch: ReturnType<typeof setInterval> | undefined;
  #connection: Connection = { phase: "connecting", words: "", sinceAt: 0 };
  #failures = 0;
  #heardAt = 0;
  #watchedAt = 0;
  #understood = false;
  #stopped = false;

  constructor(address: string, token: string, parts: ConnectionParts, listener: ConnectionListener) {
    this.#address = address;
    this.#token = token;
    this.#parts = parts;
    this.#listener = listener;
  }

  start(): void {
    this.#watch = setInterval(() => {
      this.#watchSilence();
    }, WATCH_PERIOD);
    this.#attempt();
  }

  stop(): void {
    this.#stopped = true;
    clearInterval(this.#watch);
    this.#clearTimers();
    this.#transport?.abandon("");
  }

  /** Connect anew with a token. */
  authenticate(token: string): void {
    this.#token = token;
    this.#failures = 0;
    const transport = this.#transport;
    this.#transport = undefined;
    if (transport?.isOpen === true) {
      this.#listener.closed();
    }
    transport?.abandon("");
    this.#change("connecting", "");
    this.#attempt();
  }

  /** Try at once: the network is back, or somebody looks. */
  hurry(): void {
    if (this.#retry !== undefined) {
      this.#attempt();
    }
  }

  /** Whether a command that is sent now leaves now. */
  get flows(): boolean {
    return this.#transport?.flows === true && this.#connection.phase === "open";
  }

  /** Since the last frame [ms]. */
  get silence(): number {
    return this.#parts.now() - this.#heardAt;
  }

  #attempt(): void {
    this.#clearTimers();
    if (this.#stopped) {
      return;
    }
    this.#understood = false;
    let socket: Socket;
    try {
      socket = this.#parts.openSocket(this.#address);
    } catch (error) {
      const mixed = error instanceof DOMException && error.name === "SecurityError";
      const words = mixed ? linkTexts.mixedContent : linkTexts.badAddress;
      this.#change("refused", words(this.#address));
      return;
    }
    const transport = new SocketTransport(socket, this.#token, {
      opened: () => {
        this.#opened(client);
      },
      received: (bytes) => {
        this.#heardAt = this.#parts.now();
        this.#listener.received(bytes);
      },
      took: (operation) => {
        this.#take(transport, operation);
        client.take(operation);
      },
      unreadable: () => {
        if (this.#understood) {
          this.#listener.unreadable();
        } else {
          this.#refuse(transport, linkTexts.notRosbridge(this.#address));
        }
      },
      ended: (closing) => {
        this.#ended(transport, closing);
      },
    });
    const client = new RosbridgeClient((operation) => transport.send(operation));
    this.#transport = transport;
    this.#deadline = setTimeout(() => {
      transport.abandon(HUNG);
    }, OPEN_TIMEOUT);
  }

  #opened(client: RosbridgeClient): void {
    clearTimeout(this.#deadline);
    this.#heardAt = this.#watchedAt = this.#parts.now();
    // Whether it is a robot that talks to us shows with its first answer; the listener asks for one.
    this.#listener.opened(client);
  }

  #take(transport: SocketTransport, { op, msg, level }: Operation): void {
    if (OWN_OPERATIONS.has(op)) {
      this.#refuse(transport, linkTexts.notRosbridge(this.#address));
      return;
    }
    if (op === "status") {
      const words = typeof msg === "string" ? msg.slice(0, 1000) : "";
      if (asksForToken(words)) {
        this.#refuse(transport, this.#token === "" ? linkTexts.tokenMissing : linkTexts.tokenRefused);
        return;
      }
      this.#understand();
      this.#listener.status(typeof level === "string" ? level : "", words);
    } else {
      this.#understand();
    }
  }

  #understand(): void {
    if (!this.#understood) {
      this.#understood = true;
      this.#failures = 0;
      this.#change("open", "");
    }
  }

  /** End a connection that no further attempt can mend without a person. */
  #refuse(transport: SocketTransport, words: string): void {
    if (this.#transport !== transport) {
      return;
    }
    this.#transport = undefined;
    this.#clearTimers();
    transport.abandon("");
    this.#listener.closed();
    this.#change("refused", words);
  }

  #ended(transport: SocketTransport, closing: Closing): void {
    if (this.#transport !== transport) {
      return;
    }
    this.#transport = undefined;
    clearTimeout(this.#deadline);
    if (closing.wasOpen) {
      this.#listener.closed();
    }
    if (this.#stopped) {
      return;
    }
    if (closing.wasOpen) {
      const { phase, words, retry } = consequenceOf(closing, this.#token !== "", this.#address);
      this.#change(phase, words);
      if (!retry) {
        return;
      }
    } else {
      this.#explain(closing);
    }
    this.#retry = setTimeout(() => {
      this.#attempt();
    }, this.#failures === 0 ? FIRST_RETRY : NEXT_RETRY);
    this.#failures += 1;
  }

  /** Find out why an attempt failed; the first time at once, then now and then. */
  #explain(closing: Closing): void {
    if (this.#failures % 5 === 0) {
      void this.#parts.diagnose(closing.reason === HUNG).then((words) => {
        if (this.#transport?.isOpen !== true && this.#connection.phase !== "open" && !this.#stopped) {
          this.#change(this.#connection.phase === "refused" ? "refused" : "lost", words);
        }
      });
    }
  }

  #watchSilence(): void {
    const now = this.#parts.now();
    if (now - this.#watchedAt > SLEPT) {
      this.#heardAt = now;
    }
    this.#watchedAt = now;
    const transport = this.#transport;
    if (transport?.isOpen !== true || now - this.#heardAt <= SILENCE_LIMIT) {
      return;
    }
    if (this.#understood) {
      transport.abandon(linkTexts.fellSilent);
    } else {
      this.#change(this.#connection.phase, linkTexts.silentServer(this.#address));
    }
  }

  #change(phase: Connection["phase"], words: string): void {
    const { phase: before, words: said, sinceAt } = this.#connection;
    if (phase !== before || words !== said) {
      this.#connection = { phase, words, sinceAt: phase === before ? sinceAt : this.#parts.now() };
      this.#listener.changed(this.#connection);
    }
  }

  #clearTimers(): void {
    clearTimeout(this.#retry);
    clearTimeout(this.#deadline);
    this.#retry = this.#deadline = undefined;
  }
}
