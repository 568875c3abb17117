import { signal } from "@preact/signals";
import { afterEach, describe, expect, it, vi } from "vitest";
import { isStale, watchStaleness } from "../../src/page/stale_picture";
import { unknownState } from "../../src/robot/robot_state";
import type { StampedPose } from "../../src/values";

function poseAt(receivedAt: number): StampedPose {
  return { position: { x: 0, y: 0, z: 0 }, orientation: { x: 0, y: 0, z: 0, w: 1 }, stamp: 0, receivedAt };
}

afterEach(() => { vi.useRealTimers(); });

describe("the picture", () => {
  it("is not old while nothing was ever heard", () => {
    expect(isStale(unknownState(), 1e6)).toBe(false);
  });

  it("is old half a second after the last thing that moves, and new again with the next", () => {
    vi.useFakeTimers();
    const state = unknownState();
    const stale = signal(false);
    const stop = watchStaleness(state, stale, () => performance.now());
    state.mapFromBase.value = poseAt(performance.now());
    vi.advanceTimersByTime(300);
    expect(stale.value).toBe(false);
    vi.advanceTimersByTime(200);
    expect(stale.value).toBe(true);
    state.odomFromBase.value = poseAt(performance.now());
    vi.advanceTimersByTime(100);
    expect(stale.value).toBe(false);
    stop();
  });
});
