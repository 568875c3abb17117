import { describe, expect, it } from "vitest";
import { HopRecorder, type LinkAnswer } from "../../src/link/hops";
import type { HopName } from "../../src/robot/robot_state";

/** What the robot's clock shows when the page's shows 0, and how far its stamps are behind [ms]. */
const OFFSET = 1_000_000;
const LAG = 400;
const QUIET = { robot: 30, queue: 1, wireDown: 20, page: 4, drawn: 9, hand: 4, wireUp: 20, gateway: 10, control: 20 };

type Way = Record<keyof typeof QUIET, number>;

/** Have the robot answer at a time of the page [ms]. */
function answer(recorder: HopRecorder, at: number, way: Way): ReadonlyMap<HopName, number> {
  const now = at + OFFSET;
  const told: LinkAnswer = {
    now: now / 1000, stamp: (now - LAG) / 1000, taken: way.gateway / 1000,
    topics: new Map([["/pose", { dropped: 0, made: way.robot / 1000, queued: way.queue / 1000 }]]),
  };
  const stamp = (now - LAG - way.robot - way.queue) / 1000;
  const cameAt = at + way.wireDown + way.page;
  recorder.answered(told, at - way.wireUp - way.hand, cameAt, "/pose", { stamp, cameAt, drawn: way.drawn }, way.page);
  return new Map(recorder.hops.map(({ name, took }) => [name, took]));
}

function growing(recorder: HopRecorder): string[] {
  return recorder.hops.filter(({ grows }) => grows).map(({ name }) => name);
}

describe("the parts of the way", () => {
  it.each(["robot", "queue", "wireDown", "drawn", "wireUp", "gateway"] as const)(
    "get what is added to each: %s", (part) => {
      const recorder = new HopRecorder();
      const before = answer(recorder, 1000, QUIET);
      const after = answer(recorder, 2000, { ...QUIET, [part]: QUIET[part] + 200 });
      for (const [name, took] of after) {
        expect(took - (before.get(name) ?? 0)).toBeCloseTo(name === part ? 200 : 0, 3);
      }
      const seen = ["robot", "queue", "wireDown", "page"] as const;
      const added = seen.some((name) => name === part) ? 200 : 0;
      expect(seen.reduce((sum, name) => sum + (after.get(name) ?? 0), 0)).toBeCloseTo(55 + added, 3);
    },
  );

  it("name what grows within two seconds, and no longer once it is steady", () => {
    const recorder = new HopRecorder();
    for (let at = 0; at < 10_000; at += 1000) {
      answer(recorder, at, QUIET);
      expect(growing(recorder)).toEqual([]);
    }
    answer(recorder, 10_000, { ...QUIET, wireDown: 300 });
    expect(growing(recorder)).toEqual([]);
    answer(recorder, 11_000, { ...QUIET, queue: 101 });
    answer(recorder, 12_000, { ...QUIET, queue: 201 });
    expect(growing(recorder)).toEqual(["queue"]);
    for (let at = 13_000; at < 17_000; at += 1000) {
      answer(recorder, at, { ...QUIET, queue: 201 });
    }
    expect(growing(recorder)).toEqual([]);
  });

  it("leave out what is unknown", () => {
    const recorder = new HopRecorder();
    const told = { now: 1, stamp: 1, taken: -1, topics: new Map() };
    recorder.answered(told, 0, 10, "/pose", undefined, 3);
    expect(recorder.hops.map(({ name }) => name)).toEqual(["hand", "wireUp"]);
  });
});
