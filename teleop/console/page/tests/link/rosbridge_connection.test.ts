import { afterEach, beforeEach, describe, expect, it, vi } from "vitest";
import {
  FIRST_RETRY, NEXT_RETRY, OPEN_TIMEOUT, RosbridgeConnection, SILENCE_LIMIT,
} from "../../src/link/rosbridge_connection";
import type { Connection } from "../../src/robot/robot_state";
import { linkTexts } from "../../src/texts/link";
import { ADDRESS, Bench, PUBLISHED } from "./connection_bench";

describe("a connection", () => {
  let bench: Bench;

  beforeEach(() => {
    vi.useFakeTimers();
    bench = new Bench();
    bench.connection.start();
  });

  afterEach(() => {
    bench.connection.stop();
    vi.useRealTimers();
  });

  it("is open once the server has said something that a rosbridge says", async () => {
    const socket = await bench.handshake();
    expect(bench.changes).toEqual([]);
    expect(bench.connection.flows).toBe(false);
    socket.deliver(PUBLISHED);
    expect(bench.last).toMatchObject({ phase: "open", words: "" });
    expect(bench.clients).toHaveLength(1);
    expect(bench.connection.flows).toBe(true);
  });

  it("comes back by itself: after half a second, then every second, with a client of its own", async () => {
    (await bench.open()).drop();
    expect(bench.closed).toBe(1);
    expect(bench.last).toMatchObject({ phase: "lost", words: linkTexts.lost });
    await vi.advanceTimersByTimeAsync(FIRST_RETRY);
    expect(bench.sockets).toHaveLength(2);
    for (let attempt = 3; attempt < 8; attempt++) {
      bench.socket.drop();
      await vi.advanceTimersByTimeAsync(NEXT_RETRY);
      expect(bench.sockets).toHaveLength(attempt);
    }
    await bench.open();
    expect(bench.last?.phase).toBe("open");
    expect(new Set(bench.clients).size).toBe(2);
  });

  it("never sends again what could not leave", async () => {
    await bench.open();
    const [first] = bench.clients;
    bench.socket.drop();
    expect(first?.publish("/joy", "sensor_msgs/Joy", {})).toBe(false);
    await vi.advanceTimersByTimeAsync(FIRST_RETRY);
    const socket = await bench.open();
    expect(socket.sent).toEqual([]);
  });

  it("does not take commands while bytes wait", async () => {
    const socket = await bench.open();
    socket.bufferedAmount = 100_000;
    expect(bench.connection.flows).toBe(false);
  });

  it("says why no handshake succeeds", async () => {
    bench.socket.drop();
    await vi.advanceTimersByTimeAsync(0);
    expect(bench.last).toMatchObject({ phase: "lost", words: "diagnosed" });
    expect(bench.closed).toBe(0);
  });

  it("gives up an attempt that hangs", async () => {
    await vi.advanceTimersByTimeAsync(OPEN_TIMEOUT);
    expect(bench.hung).toEqual([true]);
    await vi.advanceTimersByTimeAsync(FIRST_RETRY);
    expect(bench.sockets).toHaveLength(2);
  });

  it("leaves a socket from which nothing comes any more", async () => {
    await bench.open();
    await vi.advanceTimersByTimeAsync(SILENCE_LIMIT + 1500);
    expect(bench.closed).toBe(1);
    expect(bench.changes.map(({ words }) => words)).toContain(linkTexts.fellSilent);
    expect(bench.sockets.length).toBeGreaterThan(1);
  });

  it("does not take sleep for silence", async () => {
    await bench.open();
    const asleep = performance.now() + 60_000;
    vi.spyOn(performance, "now").mockImplementation(() => asleep);
    await vi.advanceTimersByTimeAsync(1000);
    expect(bench.closed).toBe(0);
    vi.restoreAllMocks();
  });

  it("says of a server that is silent from the start that it may be no rosbridge", async () => {
    await bench.handshake();
    await vi.advanceTimersByTimeAsync(SILENCE_LIMIT + 1500);
    expect(bench.last).toMatchObject({ phase: "connecting", words: linkTexts.silentServer(ADDRESS) });
    bench.socket.deliver(PUBLISHED);
    expect(bench.last).toMatchObject({ phase: "open", words: "" });
  });

  it("does not say that it was lost before it has ever been", async () => {
    bench.socket.drop();
    expect(bench.changes).toEqual([]);
    await vi.advanceTimersByTimeAsync(0);
    expect(bench.changes.map(({ words }) => words)).toEqual(["diagnosed"]);
  });

  it.each(["hello", "{}", "[1]", new ArrayBuffer(3), { op: "subscribe", topic: "/tf" }, { op: "call_service", service: "/rosapi/topics" }])(
    "is refused by what is no rosbridge and sends %o", async (frame) => {
      const socket = await bench.handshake();
      socket.deliver(frame);
      expect(bench.last).toMatchObject({ phase: "refused", words: linkTexts.notRosbridge(ADDRESS) });
      await vi.advanceTimersByTimeAsync(10_000);
      expect(bench.sockets).toHaveLength(1);
    },
  );

  it("outlives frames that cannot be read, once it has understood one", async () => {
    const socket = await bench.open();
    for (const frame of ["{", new ArrayBuffer(5), { op: "service_response", service: "/t" }, { op: 3 }]) {
      socket.deliver(frame);
    }
    expect(bench.last?.phase).toBe("open");
    expect(bench.unreadable).toBe(3);
  });

  it("passes on what the server complains of", async () => {
    const socket = await bench.open();
    socket.deliver({ op: "status", level: "error", msg: "subscribe: no such type" });
    socket.deliver({ op: "status", level: 3, msg: { x: 1 } });
    expect(bench.statuses).toEqual(["error: subscribe: no such type", ": "]);
  });

  it("asks for a token if the robot wants one, and does not knock on", async () => {
    const socket = await bench.handshake();
    socket.deliver({ op: "status", level: "error", msg: "call_service: authentication with a token is required" });
    expect(bench.last).toMatchObject({ phase: "refused", words: linkTexts.tokenMissing });
    await vi.advanceTimersByTimeAsync(10_000);
    expect(bench.sockets).toHaveLength(1);
    bench.connection.authenticate("secret");
    const next = await bench.open();
    expect(next.sent[0]).toEqual({ op: "auth", token: "secret" });
    expect(bench.last?.phase).toBe("open");
  });

  it("logs in anew while it is open", async () => {
    await bench.open();
    bench.connection.authenticate("secret");
    expect(bench.closed).toBe(1);
    const next = await bench.open();
    expect(next.sent[0]).toEqual({ op: "auth", token: "secret" });
  });

  it.each([
    [1008, "auth: rejected", linkTexts.tokenMissing, "refused", false],
    [1008, "auth: too many wrong tokens from your address, try again later", linkTexts.tokenLater, "refused", false],
    [1008, "your access has changed", linkTexts.accessChanged, "lost", true],
    [1013, "too many clients", linkTexts.full(ADDRESS), "refused", true],
    [1013, "an operator needs the place", linkTexts.evicted, "refused", true],
    [1013, "8 MB of answers wait", linkTexts.overloaded("8 MB of answers wait"), "lost", true],
    [1011, "bye", linkTexts.closedBecause("bye"), "lost", true],
  ])("that ends with %d (%s) says what to do", async (code, reason, words, phase, retries) => {
    (await bench.open()).drop(code, reason);
    expect(bench.last).toMatchObject({ phase, words });
    await vi.advanceTimersByTimeAsync(FIRST_RETRY);
    expect(bench.sockets).toHaveLength(retries ? 2 : 1);
  });

  it("tries at once when the network is back", async () => {
    (await bench.open()).drop();
    bench.connection.hurry();
    expect(bench.sockets).toHaveLength(2);
    bench.connection.hurry();
    expect(bench.sockets).toHaveLength(2);
  });

  it("does nothing after it was stopped", async () => {
    const socket = await bench.open();
    bench.connection.stop();
    expect(socket.readyState).toBe(3);
    await vi.advanceTimersByTimeAsync(10_000);
    expect(bench.sockets).toHaveLength(1);
  });
});

describe("a connection with a token", () => {
  it("sends it as the first frame each time, and says if it is refused", async () => {
    vi.useFakeTimers();
    const bench = new Bench("secret");
    bench.connection.start();
    (await bench.open()).drop();
    await vi.advanceTimersByTimeAsync(FIRST_RETRY);
    const socket = await bench.open();
    expect(socket.sent[0]).toEqual({ op: "auth", token: "secret" });
    socket.drop(1008, "auth: rejected");
    expect(bench.last).toMatchObject({ phase: "refused", words: linkTexts.tokenRefused });
    bench.connection.stop();
    vi.useRealTimers();
  });
});

describe("an address that is none", () => {
  it("is refused with what one looks like", () => {
    const changes: Connection[] = [];
    const connection = new RosbridgeConnection(
      "nonsense", "",
      {
        openSocket: () => {
          throw new DOMException("bad", "SyntaxError");
        },
        diagnose: () => Promise.resolve(""),
        now: () => 0,
      },
      {
        opened: () => undefined, closed: () => undefined, received: () => undefined, status: () => undefined,
        unreadable: () => undefined,
        changed: (change) => {
          changes.push(change);
        },
      },
    );
    connection.start();
    expect(changes).toEqual([{ phase: "refused", words: linkTexts.badAddress("nonsense"), sinceAt: 0 }]);
    connection.stop();
  });
});
