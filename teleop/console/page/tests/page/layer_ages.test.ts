import { signal } from "@preact/signals";
import { afterEach, beforeEach, describe, expect, it, vi } from "vitest";
import { isSilent, watchAges } from "../../src/page/layer_ages";
import { unknownState, type LinkStatistics } from "../../src/robot/robot_state";
import type { CloudPoints, StampedPose } from "../../src/values";

const POINTS = { frame: "map", positions: new Float32Array(), distances: new Float32Array() };

beforeEach(() => { vi.useFakeTimers(); });
afterEach(() => { vi.useRealTimers(); });

/** A picture whose poses and sweeps come so often [ms] and so late [ms], over a link with this round trip [ms]. */
function bench(roundTrip = 0) {
  const state = unknownState();
  const [stale, late] = [signal(false), signal(false)];
  const link = signal({ roundTrip } as LinkStatistics);
  const ages = watchAges(state, link, { stale, late });
  const now = (): number => performance.now();
  const begun = now();
  const stampAt = (delay: number): number => 100 + (now() - begun - delay) / 1000;
  const pose = (delay: number): StampedPose =>
    ({ position: { x: 0, y: 0, z: 0 }, orientation: { x: 0, y: 0, z: 0, w: 1 }, stamp: stampAt(delay), receivedAt: now() });
  const sweep = (delay: number): CloudPoints => ({ ...POINTS, stamp: stampAt(delay), receivedAt: now() });
  const run = (time: number, { every, cloudLate = 0, clockLate = 0 }: { every: number; cloudLate?: number; clockLate?: number }): void => {
    for (let at = 0; at < time; at += 100) {
      state.time.value = { stamp: stampAt(clockLate), receivedAt: now() };
      state.mapFromBase.value = pose(clockLate);
      state.cloud.value = at % every === 0 ? sweep(clockLate + cloudLate) : state.cloud.value;
      vi.advanceTimersByTime(100);
    }
  };
  return { state, stale, late, ages, run };
}

describe("the picture", () => {
  it("is not old while nothing was ever heard", () => {
    expect(isSilent(unknownState(), 1e6)).toBe(false);
  });

  it("is old half a second after the last thing that moves, and new again with the next", () => {
    const { state, stale, run } = bench();
    run(300, { every: 100 });
    expect(stale.value).toBe(false);
    vi.advanceTimersByTime(400);
    expect(stale.value).toBe(true);
    run(200, { every: 100 });
    expect(stale.value).toBe(false);
    expect(isSilent(state, performance.now())).toBe(false);
  });

  it.each([["ten", 100], ["two", 500]])("has live points that are live, %s sweeps a second", (_, every) => {
    const { late, stale, run } = bench(60);
    run(5000, { every });
    expect([late.value, stale.value]).toEqual([false, false]);
  });

  it("has grey points, and a robot that is live, while sweeps alone come 1.2 s late", () => {
    const { late, stale, ages, run } = bench();
    run(5000, { every: 100, cloudLate: 1200 });
    expect([late.value, stale.value]).toEqual([true, false]);
    expect(ages.value.cloud?.age).toBeGreaterThan(1150);
    expect(ages.value.path?.stale).toBe(false);
  });

  it("is grey all of it behind a link of 1.2 s each way, by the round trip: the robot's clock comes as late", () => {
    const { late, stale, run } = bench(2400);
    run(5000, { every: 100, clockLate: 1200 });
    expect([late.value, stale.value]).toEqual([true, true]);
  });

  it("says how long each layer is there that does not move, and nothing of those that are not there", () => {
    const { state, ages, run } = bench();
    state.surfaces.value = new ArrayBuffer(1);
    run(3000, { every: 100 });
    expect(ages.value.building).toEqual({ age: expect.closeTo(3000, -3) as number, stale: false });
    expect(ages.value.map).toBeUndefined();
    expect(ages.value.truth).toBeUndefined();
  });
});
