/** The arm goes on as long as a person holds it, and no longer. */

import { afterEach, beforeEach, describe, expect, it } from "vitest";
import { ME, OTHER } from "../../driving/harness";
import { ArmBench } from "../arm_bench";

let bench: ArmBench;

beforeEach(() => {
  bench = new ArmBench();
  bench.arm.chosen.value = true;
});

afterEach(() => { bench.dispose(); });

const TWIST = "/servo_node/delta_twist_cmds";
const JOG = "/servo_node/delta_joint_cmds";
const linear = (): readonly unknown[] => bench.on(TWIST).map(({ message }) => (message["twist"] as { linear: unknown }).linear);
const rates = (): readonly unknown[] => bench.on(JOG).map(({ message }) => message["velocities"]);

describe("keys", () => {
  it("move the tip while they are held: at rest first, then motion, at rest three times, then nothing", () => {
    bench.page.key("keydown", "KeyI");
    bench.page.wait(300);
    bench.page.key("keyup", "KeyI");
    bench.page.wait(1000);
    const sent = linear();
    const zero = { x: 0, y: 0, z: 0 };
    expect(sent[0]).toEqual(zero);
    expect(sent.slice(1, -3).length).toBeGreaterThan(3);
    expect(sent.slice(1, -3).every((one) => JSON.stringify(one) === JSON.stringify({ x: 0.08, y: 0, z: 0 }))).toBe(true);
    expect(sent.slice(-3)).toEqual([zero, zero, zero]);
    expect(bench.on(TWIST)[0]?.frame).toBe("arm_base");
  });

  it("move the chosen joint, and shift no gear of the wheels", () => {
    const gear = bench.page.driving.gear.value;
    bench.page.key("keydown", "Digit2");
    bench.page.key("keydown", "Comma");
    bench.page.wait(200);
    bench.page.key("keyup", "Comma");
    expect(rates()).toContainEqual([0, -0.5]);
    expect(bench.arm.keys.joint.value).toBe(1);
    bench.page.key("keydown", "Digit9");
    expect(bench.arm.keys.joint.value).toBe(1);
    expect(bench.page.driving.gear.value).toBe(gear);
  });

  it("turn the gripper about its own axes with Shift", () => {
    bench.page.key("keydown", "KeyJ", { shiftKey: true });
    bench.page.wait(200);
    const last = bench.on(TWIST).at(-1);
    expect(last?.frame).toBe("tool0");
    expect(last?.message["twist"]).toEqual({ linear: { x: 0, y: 0, z: 0 }, angular: { x: 0, y: 0, z: 0.5 } });
  });

  it("are the wheels' until the arm is chosen", () => {
    bench.arm.chosen.value = false;
    bench.page.key("keydown", "KeyI");
    bench.page.wait(200);
    expect(bench.sent).toEqual([]);
  });

  it("are letters in a field", () => {
    const field = document.body.appendChild(document.createElement("input"));
    bench.page.key("keydown", "KeyI", {}, field);
    bench.page.wait(200);
    expect(bench.sent).toEqual([]);
  });

  it("close and open the gripper", () => {
    bench.page.key("keydown", "KeyG");
    bench.state({ opening: 0.06 });
    bench.page.key("keydown", "KeyG");
    bench.state({ opening: 0.03, holding: true });
    bench.page.key("keydown", "KeyG");
    expect(bench.goals.map(({ goal }) => (goal["command"] as { position: number }).position)).toEqual([0.06, 0, 0.06]);
  });
});

/** Each way of losing the person, and the words that say so. */
const LOSSES: readonly (readonly [name: string, lose: (bench: ArmBench) => void, words: RegExp])[] = [
  ["the tab is hidden", ({ page }) => { page.hide(); }, /tab was hidden/],
  ["another window takes the keys", () => { window.dispatchEvent(new Event("blur")); }, /another window/],
  ["the page is left", () => { window.dispatchEvent(new Event("pagehide")); }, /was left/],
  ["the computer slept", ({ page }) => { page.wallSkew += 5000; page.wait(50); }, /slept/],
  ["the connection is lost", ({ page }) => { page.state.connection.value = { phase: "lost", words: "", sinceAt: 0 }; page.wait(50); }, /connection/],
  ["nothing can be sent", (one) => { one.reachable = false; one.page.wait(100); }, /took no command/],
  ["somebody else drives", ({ page }) => { page.says({ controller: OTHER }); page.wait(50); }, /drives/],
  ["the e-stop is latched", ({ page }) => { page.says({ estop: true, state: "estop" }); page.wait(50); }, /./],
  ["the robot says nothing", ({ page }) => { page.reporting = false; page.wait(2000); }, /./],
  ["the robot stops the arm", (one) => { one.follows = false; one.state({ mode: "held", reason: "elbow bears too much" }); one.page.wait(100); }, /elbow bears too much/],
];

describe.each(LOSSES)("when %s", (_name, lose, words) => {
  it("the arm is let go, and moves on only after a new press", () => {
    bench.page.key("keydown", "KeyU");
    bench.page.wait(300);
    expect(linear().at(-1)).toEqual({ x: 0, y: 0, z: 0.08 });
    lose(bench);
    expect(bench.arm.hold.input.value).toBeUndefined();
    expect(bench.arm.hold.stopped.value).toMatch(words);
    bench.reachable = true;
    bench.page.wait(500);
    const count = bench.sent.length;
    bench.page.reveal();
    bench.page.reporting = true;
    bench.page.state.connection.value = { phase: "open", words: "", sinceAt: 0 };
    bench.page.says({ controller: ME, estop: false, state: "idle" });
    bench.follows = true;
    bench.page.wait(500);
    bench.page.key("keydown", "KeyU", { repeat: true });
    bench.page.wait(500);
    expect(bench.sent.length, "it went on by itself").toBe(count);
    bench.page.key("keyup", "KeyU");
    bench.page.wait(600);
    bench.page.key("keydown", "KeyU");
    bench.page.wait(300);
    expect(linear().at(-1)).toEqual({ x: 0, y: 0, z: 0.08 });
    expect(bench.arm.hold.stopped.value).toBe("");
  });
});

it("never moves arm and wheels at once", () => {
  bench.arm.hold.begin("button", () => ({ kind: "plan", confirmed: true }));
  bench.page.wait(200);
  bench.page.key("keydown", "ArrowUp");
  bench.page.wait(300);
  expect(bench.page.moving).toBe(true);
  expect(bench.arm.hold.input.value).toBeUndefined();
  expect(bench.on("/arm/confirm").at(-1)?.message).toEqual({ data: false });
  expect(bench.arm.hold.begin("button", () => ({ kind: "plan", confirmed: true }))).toBe(false);
  expect(bench.arm.hold.stopped.value).toMatch(/wheels/);
});

it("is stopped by the space bar and the emergency stop, with all that the robot does by itself", async () => {
  bench.page.driving.steps = bench.arm;
  bench.arm.moved.ask("Pose", { name: "ready" });
  bench.page.key("keydown", "Space");
  expect(bench.goals[0]?.cancelled).toBe(true);
  void bench.arm.wayOut.go();
  expect(bench.arm.moves).toBe(true);
  bench.page.driving.emergencyStop();
  await bench.page.settle();
  expect(bench.calls.map(({ service }) => service)).toEqual(["/arm/way_out", "/servo_node/pause_servo", "/servo_node/pause_servo"]);
});

it("shows the robot a wish at rest again, if the first one was lost, and gives up after a while", () => {
  bench.follows = false;
  bench.page.key("keydown", "KeyI");
  bench.page.wait(2500);
  expect(linear().filter((one) => JSON.stringify(one) === JSON.stringify({ x: 0, y: 0, z: 0 })).length).toBe(3);
  bench.page.wait(2500);
  expect(bench.arm.hold.input.value).toBeUndefined();
  expect(bench.arm.hold.stopped.value).toMatch(/no longer listened/);
});

it("lets one input move the arm at a time", () => {
  bench.page.key("keydown", "KeyI");
  expect(bench.arm.hold.begin("button", () => ({ kind: "plan", confirmed: true }))).toBe(false);
  bench.arm.hold.end("button");
  expect(bench.arm.hold.input.value).toBe("keys");
});

it("listens to nothing of an arm while the robot has none", () => {
  expect(bench.listened).toEqual(["/arm/info", "/arm/state", "/arm/feedback"]);
  bench.page.state.arm.value = false;
  expect(bench.listened).toEqual([]);
});

it("hears of the arm less often where bandwidth is saved", () => {
  expect(Math.max(...bench.throttles)).toBe(50);
  bench.lean.value = true;
  expect(Math.max(...bench.throttles)).toBe(200);
  expect(bench.listened).toHaveLength(3);
});
