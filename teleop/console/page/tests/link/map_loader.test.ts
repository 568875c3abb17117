import { afterEach, describe, expect, it, vi } from "vitest";
import { MapLoader } from "../../src/link/map_loader";
import { unknownState } from "../../src/robot/robot_state";
import { linkTexts } from "../../src/texts/link";

describe("a map's loader", () => {
  afterEach(() => {
    vi.useRealTimers();
  });

  it("says once what is wrong, tries again, and shows the map when it comes", async () => {
    vi.useFakeTimers();
    const state = unknownState();
    const events: string[] = [];
    let status = 500;
    const loader = new MapLoader({
      http: "http://robot", token: () => "", state, caches: undefined,
      fetch: () => Promise.resolve(new Response("abcd", { status })),
      read: () => Promise.resolve({ kind: "map", positions: new Float32Array(3), verified: false }),
      events: (_severity, words) => {
        events.push(words);
      },
    });
    const corner = { x: 0, y: 0, z: 0 };
    loader.load({ name: "office", frame: "map", sha256: "abc", points: 1, min: corner, max: corner, run: "" });
    await vi.advanceTimersByTimeAsync(20_000);
    expect(events).toEqual([linkTexts.events.mapFailed("the robot answers 500")]);
    status = 200;
    await vi.advanceTimersByTimeAsync(60_000);
    expect(state.mapPoints.value?.sha256).toBe("abc");
    expect(state.mapProgress.value).toBeUndefined();
    expect(events.at(-1)).toBe(linkTexts.events.mapUnverified);
  });

  it("shows no map that is another than the robot's", async () => {
    const state = unknownState();
    const events: string[] = [];
    const loader = new MapLoader({
      http: "http://robot", token: () => "", state, caches: undefined,
      fetch: () => Promise.resolve(new Response("abcd")),
      read: () => Promise.resolve({ kind: "wrong" }),
      events: (_severity, words) => {
        events.push(words);
      },
    });
    const corner = { x: 0, y: 0, z: 0 };
    loader.load({ name: "office", frame: "map", sha256: "abc", points: 1, min: corner, max: corner, run: "" });
    await vi.waitFor(() => {
      expect(events).toEqual([linkTexts.events.mapWrong]);
    });
    expect(state.mapPoints.value).toBeUndefined();
    loader.stop();
  });
});
