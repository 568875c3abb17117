import { afterEach, beforeEach, describe, expect, it, vi } from "vitest";
import { HintPreviews, PREVIEW_PERIOD, PREVIEW_TIMEOUT } from "../../src/hint/hint_previews";
import type { HintPreview, PlanarPose } from "../../src/values";

const at = (x: number): PlanarPose => ({ x, y: 0, yaw: 0 });

class Robot {
  readonly asked: { pose: PlanarPose; answer: (preview: HintPreview | undefined) => void; fail: () => void }[] = [];
  readonly ask = (pose: PlanarPose): Promise<HintPreview | undefined> =>
    new Promise((resolve, reject) => {
      this.asked.push({ pose, answer: resolve, fail: () => { reject(new Error("no")); } });
    });

  async answer(index: number): Promise<void> {
    const request = this.asked[index];
    request?.answer({ pose: request.pose, explained: 0.5, present: undefined });
    await vi.advanceTimersByTimeAsync(0);
  }
}

let robot: Robot;
let shown: number[];
let previews: HintPreviews;

beforeEach(() => {
  vi.useFakeTimers();
  robot = new Robot();
  shown = [];
  previews = new HintPreviews(robot.ask, (preview) => { shown.push(preview.pose.x); }, {
    now: () => Date.now(),
    after: (delay, callback) => {
      const id = setTimeout(callback, delay);
      return () => { clearTimeout(id); };
    },
  });
});

afterEach(() => { vi.useRealTimers(); });

describe("previews", () => {
  it("are asked for at once, then the newest pose as soon as the answer is there", async () => {
    previews.request(at(1));
    previews.request(at(2));
    previews.request(at(3));
    expect(robot.asked.map(({ pose }) => pose.x)).toEqual([1]);
    await vi.advanceTimersByTimeAsync(PREVIEW_PERIOD);
    await robot.answer(0);
    expect(shown).toEqual([1]);
    expect(robot.asked.map(({ pose }) => pose.x)).toEqual([1, 3]);
  });

  it("are asked for at most 10 times a second by a pose that never rests", async () => {
    for (let millisecond = 0; millisecond < 1000; millisecond += 5) {
      previews.request(at(millisecond));
      await robot.answer(robot.asked.length - 1);
      await vi.advanceTimersByTimeAsync(5);
    }
    expect(robot.asked.length).toBeLessThanOrEqual(11);
    expect(robot.asked.length).toBeGreaterThanOrEqual(9);
  });

  it("go on after a request that was never answered, whose late answer is ignored", async () => {
    previews.request(at(1));
    previews.request(at(2));
    await vi.advanceTimersByTimeAsync(PREVIEW_TIMEOUT);
    expect(robot.asked.map(({ pose }) => pose.x)).toEqual([1, 2]);
    await robot.answer(0);
    expect(shown).toEqual([]);
    await robot.answer(1);
    expect(shown).toEqual([2]);
  });

  it("go on after a request that failed or was overtaken", async () => {
    previews.request(at(1));
    previews.request(at(2));
    robot.asked[0]?.fail();
    await vi.advanceTimersByTimeAsync(PREVIEW_PERIOD);
    robot.asked[1]?.answer(undefined);
    await vi.advanceTimersByTimeAsync(PREVIEW_PERIOD);
    previews.request(at(3));
    expect(robot.asked.map(({ pose }) => pose.x)).toEqual([1, 2, 3]);
    expect(shown).toEqual([]);
  });

  it("end with the placing", async () => {
    previews.request(at(1));
    previews.request(at(2));
    previews.stop();
    await robot.answer(0);
    await vi.advanceTimersByTimeAsync(10 * PREVIEW_TIMEOUT);
    expect(robot.asked).toHaveLength(1);
    expect(shown).toEqual([]);
  });
});
