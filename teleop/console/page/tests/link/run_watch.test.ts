import { describe, expect, it } from "vitest";
import { RunWatch } from "../../src/link/run_watch";
import type { MapInfo } from "../../src/values";

const corner = { x: 0, y: 0, z: 0 };
const INFO: MapInfo = { name: "office", frame: "map", sha256: "a", points: 1, min: corner, max: corner, run: "one" };

describe("a run", () => {
  it("is another with another identity or another map", () => {
    const watch = new RunWatch();
    expect(watch.mapInfo(INFO)).toBe("first");
    expect(watch.mapInfo(INFO)).toBeUndefined();
    expect(watch.mapInfo({ ...INFO, run: "two" })).toBe("run");
    expect(watch.mapInfo({ ...INFO, run: "three", sha256: "b" })).toBe("map");
    expect(watch.mapInfo({ ...INFO, run: "three" })).toBe("map");
  });

  it("is another when a clock goes back by more than messages overtake each other", () => {
    const watch = new RunWatch();
    expect(watch.stamp("/odom", 100)).toBeUndefined();
    expect(watch.stamp("/scan", 3)).toBeUndefined();
    expect(watch.stamp("/odom", 98.5)).toBeUndefined();
    expect(watch.stamp("/odom", 5)).toBe("clock");
    expect(watch.stamp("/scan", 0)).toBeUndefined();
    expect(watch.stamp("/odom", 6)).toBeUndefined();
  });

  it("is not another each time two publishers of a topic take turns", () => {
    const watch = new RunWatch();
    const news = Array.from({ length: 100 }, (_, i) => watch.stamp("/scan", i % 2 === 0 ? 1000 + i : i));
    expect(news.filter((one) => one === "clock")).toHaveLength(3);
  });

  it("of another robot is known of nothing before", () => {
    const watch = new RunWatch();
    watch.mapInfo(INFO);
    watch.stamp("/odom", 100);
    watch.clear();
    expect(watch.stamp("/odom", 1)).toBeUndefined();
    expect(watch.mapInfo({ ...INFO, run: "two" })).toBe("first");
  });
});
