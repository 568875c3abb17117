import fc from "fast-check";
import { describe, expect, it } from "vitest";
import { LinkRecorder, percentile } from "../../src/link/link_statistics";

it("says how late the page itself is, of the last seconds only", () => {
  const recorder = new LinkRecorder(0);
  for (let at = 0; at <= 2000; at += 100) {
    recorder.ticked(100, at);
  }
  expect(recorder.snapshot([], 0, 2000).pageLag).toBe(0);
  for (let at = 2250; at <= 5000; at += 250) {
    recorder.ticked(100, at);
  }
  expect(recorder.snapshot([], 0, 5000).pageLag).toBe(150);
  for (let at = 5100; at <= 12_000; at += 100) {
    recorder.ticked(100, at);
  }
  expect(recorder.snapshot([], 0, 12_000).pageLag).toBe(0);
});

describe("link statistics", () => {
  it("know nothing at first", () => {
    expect(new LinkRecorder(0).snapshot(["/tf"], 0, 1000)).toEqual({
      roundTrip: undefined, roundTripP95: undefined, jitter: undefined, pageLag: 0, bytesPerSecond: 0, silence: 0,
      streams: [{ topic: "/tf", age: undefined, rate: 0, dropped: 0 }], hops: [],
    });
  });

  it("give the round trip now, its p95 and its jitter", () => {
    const recorder = new LinkRecorder(0);
    for (const [i, took] of [10, 20, 10, 50].entries()) {
      recorder.asked(1000 * i);
      recorder.answered(1000 * i, 1000 * i + took);
    }
    const statistics = recorder.snapshot([], 0, 4000);
    expect(statistics.roundTrip).toBe(50);
    expect(statistics.roundTripP95).toBe(50);
    expect(statistics.jitter).toBeCloseTo((10 + 10 + 40) / 3);
  });

  it("count a question that waits with its age", () => {
    const recorder = new LinkRecorder(0);
    recorder.asked(0);
    recorder.answered(0, 10);
    recorder.asked(1000);
    expect(recorder.snapshot([], 0, 1800).roundTrip).toBe(800);
    recorder.answered(1000, 1900);
    expect(recorder.snapshot([], 0, 2000).roundTrip).toBe(900);
  });

  it("forget round trips after a minute", () => {
    const recorder = new LinkRecorder(0);
    recorder.answered(0, 500);
    expect(recorder.snapshot([], 0, 61_000).roundTripP95).toBeUndefined();
  });

  it("give bytes and messages per second over the last five seconds, and a stream's age", () => {
    const recorder = new LinkRecorder(0);
    for (let now = 0; now <= 20_000; now += 100) {
      recorder.frame(200, now);
      recorder.message("/tf", now);
    }
    const { bytesPerSecond, streams } = recorder.snapshot(["/tf"], 0, 20_050);
    expect(bytesPerSecond).toBeCloseTo(2000, -2);
    expect(streams[0]).toMatchObject({ age: 50 });
    expect(streams[0]?.rate).toBeCloseTo(10, 0);
    expect(recorder.snapshot(["/tf"], 0, 30_000).streams[0]).toMatchObject({ age: 10_000, rate: 0 });
  });

  it("begin rates anew with a connection", () => {
    const recorder = new LinkRecorder(0);
    recorder.asked(0);
    recorder.frame(1000, 0);
    recorder.message("/tf", 0);
    const topics = new Map([["/tf", { dropped: 3, made: 0, queued: 0 }]]);
    recorder.counted({ now: 1, stamp: 1, taken: -1, topics }, 0, 10);
    recorder.reset(1000);
    recorder.frame(1000, 1500);
    expect(recorder.snapshot(["/tf"], 0, 2000)).toMatchObject({
      roundTrip: undefined, bytesPerSecond: 1000, streams: [{ age: undefined, dropped: 0 }], hops: [],
    });
  });

  it("cost as little at a thousand frames a second", () => {
    const recorder = new LinkRecorder(0);
    for (let now = 0; now < 100_000; now++) {
      recorder.frame(1, now);
      recorder.message("/tf", now);
    }
    const { bytesPerSecond, streams } = recorder.snapshot(["/tf"], 0, 100_000);
    expect(bytesPerSecond).toBeCloseTo(1000, -2);
    expect(streams[0]?.rate).toBeCloseTo(1000, -2);
  });
});

describe("a percentile", () => {
  it("is one of the values, with its share of them not above it", () => {
    const values = fc.array(fc.double({ noNaN: true }), { minLength: 1 });
    fc.assert(fc.property(values, fc.double({ min: 0.01, max: 1, noNaN: true }), (all, share) => {
      const found = percentile(all, share) ?? NaN;
      expect(all).toContain(found);
      expect(all.filter((value) => value <= found).length).toBeGreaterThanOrEqual(share * all.length - 1e-9);
    }));
  });
});
