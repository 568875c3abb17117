/** What the robot does by itself: planned moves, the gripper, positions one after the other, ways out. */

import { afterEach, beforeEach, describe, expect, it, vi } from "vitest";
import { Guide } from "../../../src/arm/guide";
import { positionsFrom } from "../../../src/arm/goals/taught";
import { readArmInfo, readArmState } from "../../../src/link/message_checks/arm_messages";
import { Field } from "../../../src/link/message_checks/field";
import { ArmBench, INFO, STATE, type SentGoal } from "../arm_bench";

let bench: ArmBench;

beforeEach(() => { bench = new ArmBench(); });
afterEach(() => { bench.dispose(); });

const last = (): SentGoal | undefined => bench.goals.at(-1);
const corners = [[0, 0.5], [0, 1], [0.2, 1]].map((positions) => ({ positions }));

function end(outcome: string, message = ""): void {
  last()?.listener.ended({ ok: true, values: { outcome, message, path: { points: [] } } });
}

function gripped(position: number): void {
  last()?.listener.ended({ ok: true, values: { position, effort: 4, stalled: false, reached_goal: true } });
}

describe("a planned move", () => {
  it("is asked for once, keeps the way that is told once, and ends with the robot's words", () => {
    bench.arm.moved.ask("Pose", { name: "ready" });
    expect(last()).toMatchObject({ action: "/arm/move", goal: { name: "ready", preview: false, hold_to_run: true } });
    expect(bench.arm.moved.pending.value).toMatchObject({ state: "planning", path: [] });
    last()?.listener.feedback({ state: "waiting", share: 0, path: { points: corners } });
    last()?.listener.feedback({ state: "moving", share: 0.5, path: { points: [] } });
    expect(bench.arm.moved.pending.value).toEqual({ title: "Pose", state: "moving", share: 0.5, path: corners.map(({ positions }) => positions) });
    end("blocked", "person 1 is in the way");
    expect(bench.arm.moved.pending.value).toBeUndefined();
    expect(bench.arm.moved.last.value).toEqual({ title: "Pose", end: { outcome: "blocked", message: "person 1 is in the way" } });
  });

  it("gives way to a newer one, whose end counts", () => {
    const ended = vi.fn();
    bench.arm.moved.ask("First", { angles: [0, 1] }, ended);
    bench.arm.moved.ask("Second", { pose: { position: { x: 0.2, y: 0, z: 0 }, orientation: { x: 0, y: 0, z: 0, w: 1 } } });
    expect(last()?.goal["pose"]).toMatchObject({ header: { frame_id: "arm_base" }, pose: { position: { x: 0.2 } } });
    bench.goals[0]?.listener.ended({ ok: true, values: { outcome: "cancelled", message: "", path: { points: [] } } });
    expect(ended).toHaveBeenCalledWith(false);
    expect(bench.arm.moved.pending.value?.title).toBe("Second");
    bench.arm.moved.stop();
    expect(last()?.cancelled).toBe(true);
  });

  it("says that it was refused, could not be sent, or was answered with nonsense", () => {
    bench.arm.moved.ask("Pose", { name: "ready" });
    last()?.listener.ended({ ok: false, words: "somebody drives" });
    expect(bench.arm.moved.last.value?.end).toEqual({ outcome: "", message: "somebody drives" });
    bench.arm.moved.ask("Pose", { name: "ready" });
    last()?.listener.ended({ ok: true, values: 7 });
    expect(bench.arm.moved.last.value?.end.message).toMatch(/not an object/);
    bench.reachable = false;
    bench.arm.moved.ask("Pose", { name: "ready" });
    expect(bench.arm.moved.pending.value).toBeUndefined();
    expect(bench.arm.moved.last.value?.end.message).not.toBe("");
  });

  it("runs while the confirmation is held", () => {
    bench.arm.hold.begin("button", () => ({ kind: "plan", confirmed: true }));
    bench.page.wait(500);
    bench.arm.hold.end("button");
    bench.page.wait(300);
    const said = bench.on("/arm/confirm").map(({ message }) => message["data"]);
    expect(said.slice(1, -3)).toEqual(said.slice(1, -3).map(() => true));
    expect(said.slice(-3)).toEqual([false, false, false]);
    expect(said.length).toBeGreaterThan(7);
  });
});

describe("positions that were taught", () => {
  it("are gone through one after the other, with the jaws as they were", () => {
    const taught = bench.arm.known.value?.taught;
    const state = bench.arm.feed.state.value;
    if (taught === undefined || state === undefined) {
      throw new Error("no arm");
    }
    taught.teach({ ...state, angles: [0, 1], opening: 0.06 });
    taught.teach({ ...state, angles: [0, 2], opening: 0.06 });
    taught.teach({ ...state, angles: [0, 2], opening: 0.03, holding: true });
    taught.replay();
    expect(last()?.goal["angles"]).toEqual([0, 1]);
    end("done");
    expect(last()?.goal["command"]).toMatchObject({ position: 0.06 });
    gripped(0.06);
    expect(last()?.goal["angles"]).toEqual([0, 2]);
    end("done");
    expect(last()?.goal["angles"], "the jaws are as they were").toEqual([0, 2]);
    end("done");
    expect(last()?.goal["command"]).toMatchObject({ position: 0 });
    expect(taught.running.value).toBe(2);
    gripped(0.03);
    expect(taught.running.value).toBeUndefined();
    expect(JSON.parse(localStorage.getItem("farsteer.arm.taught.s2") ?? "")).toHaveLength(3);
    taught.forget(1);
    expect(taught.positions.value.map(({ opening }) => opening)).toEqual([0.06, 0]);
    taught.replay();
    end("no_path");
    expect(taught.running.value).toBeUndefined();
    taught.replay();
    bench.arm.stop();
    end("cancelled");
    expect(taught.running.value).toBeUndefined();
  });

  it("are read as far as they fit the arm", () => {
    const good = { angles: [0, 1], opening: 0.01 };
    expect(positionsFrom([good, { angles: [0], opening: 0 }, { angles: [0, "1"], opening: 0 }, null, 5, { angles: [0, 1] }], 2)).toEqual([good]);
    expect(positionsFrom("x", 2)).toBeUndefined();
  });
});

it("opens and closes the gripper with the force that was chosen, and says what came of it", () => {
  bench.arm.gripper.effort.value = 0.5;
  bench.arm.gripper.close();
  expect(last()).toMatchObject({ action: "/gripper_controller/gripper_cmd", goal: { command: { position: 0, max_effort: 3 } } });
  expect(bench.arm.moves).toBe(true);
  gripped(0);
  expect(bench.arm.gripper.doing.value).toMatchObject({ moving: false, end: { opening: 0, reached: true } });
  expect(bench.arm.moves).toBe(false);
  bench.arm.gripper.open();
  last()?.listener.ended({ ok: false, words: "e-stop by you" });
  expect(bench.arm.gripper.doing.value).toEqual({ moving: false, failed: "e-stop by you" });
  bench.reachable = false;
  bench.arm.gripper.open();
  expect(bench.arm.gripper.doing.value).toMatchObject({ moving: false });
});

it("gets out by the robot's service, and says why it did not", async () => {
  void bench.arm.wayOut.go();
  expect(bench.arm.wayOut.going.value).toBe(true);
  await bench.page.settle();
  expect(bench.arm.wayOut.going.value).toBe(false);
  expect(bench.arm.wayOut.failed.value).toBe("");
  for (const [reply, words] of [
    [{ ok: true, values: { success: false, message: "there is nothing to get out of" } }, /nothing to get out of/],
    [{ ok: true, values: 3 }, /not an object/], [{ ok: false, words: "no answer", refused: false }, /no answer/],
  ] as const) {
    bench.reply = reply;
    void bench.arm.wayOut.go();
    await bench.page.settle();
    expect(bench.arm.wayOut.failed.value).toMatch(words);
  }
});

it("leads through picking something up", () => {
  const info = readArmInfo(new Field(INFO, ""));
  const at = (z: number, opening: number, holding: boolean) =>
    readArmState(new Field({ ...STATE, opening, holding, tip: { ...STATE.tip, position: { x: 0.2, y: 0, z } } }, ""));
  const guide = new Guide();
  expect(guide.next(info, at(0, 0, false))).toBe("open");
  expect(guide.next(info, at(0, 0.06, false))).toBe("reach");
  expect(guide.next(info, at(-0.18, 0.03, true))).toBe("lift");
  expect(guide.next(info, at(-0.1, 0.03, true))).toBe("done");
  expect(guide.next(info, at(-0.1, 0.03, false))).toBe("open");
});
