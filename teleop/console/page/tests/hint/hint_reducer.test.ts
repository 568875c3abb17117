import fc from "fast-check";
import { describe, expect, it } from "vitest";
import { canConfirm, previewIsOld, reduceHint } from "../../src/hint/hint_reducer";
import { NO_HINT, VERDICT_TIMEOUT, type HintEvent, type HintState } from "../../src/hint/hint_state";
import type { HintVerdict, PlanarPose } from "../../src/values";

function after(...events: readonly HintEvent[]): HintState {
  return events.reduce(reduceHint, NO_HINT);
}

function verdict(pose: PlanarPose, what: HintVerdict["verdict"] = "accepted"): HintEvent {
  const orientation = { x: 0, y: 0, z: Math.sin(pose.yaw / 2), w: Math.cos(pose.yaw / 2) };
  const hint = { position: { x: pose.x, y: pose.y, z: 0 }, orientation };
  return { type: "verdict", verdict: { stamp: 1, verdict: what, reason: "", hint, candidates: [], scores: [] } };
}

const begin: HintEvent = { type: "begin", present: undefined };
const press = (x: number, y: number): HintEvent => ({ type: "press", point: { x, y } });
const drag = (x: number, y: number): HintEvent => ({ type: "drag", point: { x, y } });
const release: HintEvent = { type: "release" };
const pose: PlanarPose = { x: 3, y: 4, yaw: 1 };
const sent: HintEvent = { type: "sent", pose, at: 1000 };

describe("placing a hint", () => {
  it("takes place and heading from a press and a drag, and can be confirmed once the pointer is up", () => {
    const held = after(begin, press(1, 2), drag(1, 4));
    expect(held.pose?.yaw).toBeCloseTo(Math.PI / 2);
    expect(held.pose).toMatchObject({ x: 1, y: 2 });
    expect(canConfirm(held)).toBe(false);
    expect(canConfirm(reduceHint(held, release))).toBe(true);
  });

  it("asks for the heading after a press alone, if the robot's is not known", () => {
    const state = after(begin, press(1, 2), drag(1.1, 2.1), release);
    expect(state.pose).toMatchObject({ x: 1, y: 2 });
    expect(state.headingKnown).toBe(false);
    expect(canConfirm(state)).toBe(false);
    expect(canConfirm(reduceHint(state, { type: "turn", angle: 0.1 }))).toBe(true);
  });

  it("keeps the present heading for a press alone, if there is one", () => {
    const state = after({ type: "begin", present: { x: 0, y: 0, yaw: 2 } }, press(1, 2), release);
    expect(state.pose).toEqual({ x: 1, y: 2, yaw: 2 });
    expect(canConfirm(state)).toBe(true);
  });

  it("ignores presses, keys and previews while nothing is being placed", () => {
    expect(after(press(1, 2))).toEqual(NO_HINT);
    expect(after({ type: "move", dx: 1, dy: 0 })).toEqual(NO_HINT);
    expect(after({ type: "preview", preview: { pose, explained: 1, present: undefined } })).toEqual(NO_HINT);
  });

  it("does not begin at a pose that is not finite", () => {
    const state = after({ type: "begin", present: { x: NaN, y: 0, yaw: 0 } });
    expect(state.pose).toBeUndefined();
    expect(after(begin, press(Infinity, 0)).pose).toBeUndefined();
  });

  it("marks a preview of a pose that the ghost has left", () => {
    const state = after(begin, press(1, 2), drag(2, 2), release);
    const preview = { pose: state.pose ?? pose, explained: 0.9, present: undefined };
    const compared = reduceHint(state, { type: "preview", preview });
    expect(previewIsOld(compared)).toBe(false);
    expect(previewIsOld(reduceHint(compared, { type: "move", dx: 0.1, dy: 0 }))).toBe(true);
  });

  it("leaves nothing after a cancel", () => {
    expect(after(begin, press(1, 2), drag(2, 2), { type: "cancel" })).toEqual(NO_HINT);
  });
});

describe("the verdict", () => {
  it("of another hint is not ours", () => {
    const state = after({ type: "begin", present: pose }, sent, verdict({ ...pose, x: 9 }));
    expect(state.phase).toBe("waiting");
  });

  it("that does not come is said after 3 s, and still counts when it comes later", () => {
    const waiting = after({ type: "begin", present: pose }, sent, { type: "tick", now: 1000 + VERDICT_TIMEOUT - 1 });
    expect(waiting.phase).toBe("waiting");
    const silent = reduceHint(waiting, { type: "tick", now: 1000 + VERDICT_TIMEOUT });
    expect(silent.result).toEqual({ kind: "silent" });
    expect(reduceHint(silent, verdict(pose, "rejected")).result).toMatchObject({ kind: "verdict" });
  });

  it("of before the page was opened is ignored", () => {
    expect(after(verdict(pose))).toEqual(NO_HINT);
  });
});

const anyNumber = fc.oneof(fc.double(), fc.constantFrom(NaN, Infinity, -Infinity, 0));
const point = fc.record({ x: anyNumber, y: anyNumber });
const anyPose = fc.record({ x: anyNumber, y: anyNumber, yaw: anyNumber });
const anyEvent: fc.Arbitrary<HintEvent> = fc.oneof(
  fc.record({ type: fc.constant("begin" as const), present: fc.option(anyPose, { nil: undefined }) }),
  fc.record({ type: fc.constantFrom("cancel" as const, "forget" as const, "release" as const) }),
  fc.record({ type: fc.constantFrom("press" as const, "drag" as const), point }),
  fc.record({ type: fc.constant("move" as const), dx: anyNumber, dy: anyNumber }),
  fc.record({ type: fc.constant("turn" as const), angle: anyNumber }),
  fc.record({ type: fc.constant("tick" as const), now: anyNumber }),
);

describe("whatever happens", () => {
  it("only a finite pose with a known heading can be confirmed", () => {
    fc.assert(fc.property(fc.array(anyEvent, { maxLength: 30 }), (events) => {
      const state = after(...events);
      if (canConfirm(state)) {
        expect(state.headingKnown).toBe(true);
        expect(Number.isFinite(state.pose?.x) && Number.isFinite(state.pose?.y) && Number.isFinite(state.pose?.yaw)).toBe(true);
      }
      expect(state.phase === "off" ? state.pose : undefined).toBeUndefined();
    }));
  });
});
