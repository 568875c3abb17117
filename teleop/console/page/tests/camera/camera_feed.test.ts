import { afterEach, beforeEach, expect, it, vi } from "vitest";
import { CameraFeed, REOPEN } from "../../src/camera/camera_feed";
import { dataAge } from "../../src/robot/data_age";
import { betterReading, unknownState, type RobotState } from "../../src/robot/robot_state";

const PATH = "/stream?topic=/camera/rgb/image_rect_color&type=mjpeg&quality=30";

class Stream {
  readonly signal: AbortSignal | null | undefined;
  controller: ReadableStreamDefaultController<Uint8Array> | undefined;
  readonly response: Response;

  constructor(readonly url: string, readonly init: RequestInit, status: number) {
    this.signal = init.signal;
    const body = new ReadableStream<Uint8Array>({ start: (controller) => { this.controller = controller; } });
    this.response = status === 200 ? new Response(body) : new Response("no more than 10 viewers", { status });
  }

  show(stamp: number): void {
    this.controller?.enqueue(new TextEncoder().encode(
      `--boundarydonotcross\r\nX-Timestamp: ${stamp}\r\nContent-Length: 2\r\n\r\nab\r\n--boundarydonotcross\r\n`));
  }
}

let state: RobotState;
let feed: CameraFeed;
let look: () => void;
let streams: Stream[];
let status: number;
let now: number;
let lateness: number;
class Tab extends EventTarget {
  visibilityState: DocumentVisibilityState = "visible";
}
const tab = new Tab();

beforeEach(() => {
  vi.useFakeTimers();
  [streams, status, now, lateness] = [[], 200, 1000, 0];
  tab.visibilityState = "visible";
  state = unknownState();
  state.connection.value = { phase: "open", words: "", sinceAt: 0 };
  state.videoSources.value = new Map([["p3at", `http://robot:9090${PATH}`], ["other", `http://elsewhere:8080${PATH}`]]);
  feed = new CameraFeed(state, {
    fetch: (url, init) => {
      const stream = new Stream(url, init, status);
      streams.push(stream);
      return Promise.resolve(stream.response);
    },
    now: () => now, document: tab, keeper: undefined, page: "http://robot:9090/", robot: "http://robot:9090", token: () => "secret",
    lateness: () => lateness,
  });
  look = feed.watch();
});

afterEach(() => {
  feed.dispose();
  vi.useRealTimers();
});

const settled = () => vi.advanceTimersByTimeAsync(1);

function see(visibility: DocumentVisibilityState): void {
  tab.visibilityState = visibility;
  tab.dispatchEvent(new Event("visibilitychange"));
}

it("opens the first stream that it may until a person chooses, and closes it when it is off", async () => {
  await settled();
  feed.choice.value = "p3at";
  await settled();
  expect(streams.map(({ url }) => url)).toEqual([PATH]);
  expect(new Headers(streams[0]?.init.headers).get("Authorization")).toBe("Bearer secret");
  streams[0]?.show(4.5);
  await settled();
  expect(feed.picture.value).toMatchObject({ stamp: 4.5, receivedAt: 1000 });
  feed.choice.value = "";
  expect(streams[0]?.signal?.aborted).toBe(true);
  expect(feed.picture.value).toBeUndefined();
  await vi.advanceTimersByTimeAsync(5 * REOPEN);
  expect(streams.length).toBe(1);
});

it("is closed while nobody shows it, and open as long as one of several does", async () => {
  await settled();
  const headset = feed.watch();
  look();
  expect(streams.map(({ signal }) => signal?.aborted)).toEqual([false]);
  headset();
  expect(streams[0]?.signal?.aborted).toBe(true);
  await vi.advanceTimersByTimeAsync(5 * REOPEN);
  expect(streams).toHaveLength(1);
  look = feed.watch();
  expect(streams).toHaveLength(2);
});

it("is closed while the tab is hidden or the robot away, and comes back", async () => {
  feed.choice.value = "p3at";
  see("hidden");
  expect(streams[0]?.signal?.aborted).toBe(true);
  await vi.advanceTimersByTimeAsync(5 * REOPEN);
  expect(streams.length).toBe(1);
  see("visible");
  state.connection.value = { phase: "lost", words: "", sinceAt: 0 };
  expect(streams.map(({ signal }) => signal?.aborted)).toEqual([true, true]);
  state.connection.value = { phase: "open", words: "", sinceAt: 0 };
  expect(streams.length).toBe(3);
});

it("says why there is no picture, and asks again", async () => {
  feed.choice.value = "";
  status = 503;
  feed.choice.value = "p3at";
  await settled();
  expect(feed.trouble.value).toBe("No picture: no more than 10 viewers");
  status = 200;
  await vi.advanceTimersByTimeAsync(REOPEN);
  streams[2]?.show(1);
  await settled();
  expect(feed.trouble.value).toBe("");
  streams[2]?.controller?.close();
  await settled();
  expect(feed.trouble.value).toContain("ended the stream");
});

it("does not open a stream of another host, or one that is gone", async () => {
  feed.choice.value = "other";
  await settled();
  feed.choice.value = "nothing";
  await settled();
  expect(streams.map(({ url, signal }) => [url, signal?.aborted])).toEqual([[PATH, true]]);
});

it("asks for five pictures a second, and then for none, where the page does not keep up, until a person wants them", async () => {
  const show = async (seconds: number): Promise<void> => {
    for (let at = 0; at < seconds; at += 0.5) {
      streams.at(-1)?.show(at);
      now += 500;
      await vi.advanceTimersByTimeAsync(500);
    }
  };
  await settled();
  lateness = 90;
  await show(5);
  expect(streams.map(({ url, signal }) => [url, signal?.aborted])).toEqual([[PATH, true], [`${PATH}&rate=5`, false]]);
  await show(5);
  expect([feed.pace.value, streams.at(-1)?.signal?.aborted]).toEqual(["off", true]);
  await vi.advanceTimersByTimeAsync(60_000);
  expect(streams).toHaveLength(2);
  feed.showAllTheSame();
  await settled();
  await show(60);
  expect([feed.pace.value, streams.at(-1)?.signal?.aborted, streams]).toMatchObject(["slow", false, { length: 3 }]);
});

it("tells a picture's age by the robot's clock", () => {
  const picture = { url: "", stamp: 9, receivedAt: 1000 };
  expect(dataAge(picture, state, undefined, 1250), "without that clock").toEqual({ age: 250, lowerBound: true });
  state.time.value = { stamp: 9.3, receivedAt: 1000 };
  expect(dataAge(picture, state, undefined, 1000).age).toBeCloseTo(300);
  expect(dataAge(picture, state, 80, 1500).age, "with half the round trip").toBeCloseTo(840);
  expect(dataAge(picture, state, 80, 1500).lowerBound).toBe(false);
  state.time.value = { stamp: 8, receivedAt: 1000 };
  expect(dataAge(picture, state, undefined, 1100), "dated ahead").toEqual({ age: 100, lowerBound: true });
});

it("is not misled by words of the robot's time that a busy machine held up", () => {
  const quick = { stamp: 9, receivedAt: 1000 };
  expect(betterReading(undefined, quick)).toBe(quick);
  const late = { stamp: 9.1, receivedAt: 1400 };
  expect(betterReading(quick, late), "300 ms later than the one before").toBe(quick);
  const quicker = { stamp: 9.5, receivedAt: 1480 };
  expect(betterReading(quick, quicker)).toBe(quicker);
  const slowed = { stamp: 10, receivedAt: 3100 };
  expect(betterReading(quick, slowed), "readings hold for 2 s").toBe(slowed);
  state.time.value = betterReading(quick, late);
  const picture = { url: "", stamp: 9.2, receivedAt: 1400 };
  expect(dataAge(picture, state, undefined, 1400).age, "not 0 by the late word").toBeCloseTo(200);
});
