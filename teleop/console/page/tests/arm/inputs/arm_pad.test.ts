/** Gamepads: they move the wheels or the arm, never both, and buzz. */

import { afterEach, beforeEach, expect, it, vi } from "vitest";
import { ME, type FakePad } from "../../driving/harness";
import { ArmBench } from "../arm_bench";

let bench: ArmBench;
let pad: FakePad;

beforeEach(() => {
  bench = new ArmBench();
  pad = bench.page.plug();
  bench.page.wait(100);
});

afterEach(() => { bench.dispose(); });

function press(button: number, pressed = true): void {
  pad.buttons[button] = { pressed, value: Number(pressed) };
  bench.page.wait(60);
}

const twist = (): unknown => bench.on("/servo_node/delta_twist_cmds").at(-1)?.message["twist"];

it("moves the tip while LB is held, and no wheel", () => {
  bench.arm.chosen.value = true;
  bench.page.wait(50);
  press(4);
  pad.axes = [-1, -1, 0, 0];
  bench.page.wait(300);
  expect(twist()).toMatchObject({ linear: { x: 0.08, y: 0.08, z: 0 } });
  pad.axes = [0, 0, 0, -1];
  bench.page.wait(300);
  expect(twist()).toMatchObject({ linear: { x: 0, y: 0, z: 0.08 } });
  press(5);
  pad.axes = [0, -1, 0, 0];
  bench.page.wait(300);
  expect(twist()).toMatchObject({ linear: { x: 0, y: 0, z: 0 }, angular: { y: -0.5, z: 0 } });
  press(4, false);
  bench.page.wait(200);
  expect(twist()).toMatchObject({ linear: { x: 0, y: 0, z: 0 }, angular: { x: 0, y: 0, z: 0 } });
  expect(bench.page.joys).toEqual([]);
});

it("chooses a joint by the cross, and moves it while LB is held", () => {
  bench.arm.chosen.value = true;
  bench.page.wait(50);
  for (const button of [13, 13, 12, 13]) {
    press(button);
    press(button, false);
  }
  expect(bench.arm.keys.joint.value).toBe(1);
  press(15);
  bench.page.wait(200);
  expect(bench.sent, "without LB").toEqual([]);
  press(15, false);
  press(4);
  press(14);
  bench.page.wait(200);
  expect(bench.on("/servo_node/delta_joint_cmds").at(-1)?.message["velocities"]).toEqual([0, -0.5]);
  press(14, false);
  bench.page.wait(200);
  expect(bench.on("/servo_node/delta_joint_cmds").at(-1)?.message["velocities"]).toEqual([0, 0]);
});

it("wants the stick at rest and LB pressed anew, after the switch and after a loss", () => {
  press(4);
  pad.axes[1] = -1;
  bench.page.wait(300);
  expect(bench.page.moving).toBe(true);
  bench.arm.chosen.value = true;
  bench.page.wait(300);
  expect(bench.page.moving).toBe(false);
  expect(bench.sent).toEqual([]);
  press(4, false);
  press(4);
  bench.page.wait(300);
  expect(bench.sent, "the stick was pushed before LB").toEqual([]);
  pad.axes[1] = 0;
  bench.page.wait(50);
  pad.axes[1] = -1;
  bench.page.wait(300);
  expect(twist()).toMatchObject({ linear: { x: 0.08 } });
  window.dispatchEvent(new Event("blur"));
  bench.page.wait(300);
  expect(twist()).toMatchObject({ linear: { x: 0 } });
  bench.arm.chosen.value = false;
  bench.page.wait(300);
  expect(bench.page.moving, "LB is held since it moved the arm").toBe(false);
});

it("stops the robot by B, switches by Back, and opens and closes the jaws by its triggers", () => {
  press(8);
  press(8, false);
  expect(bench.arm.chosen.value).toBe(true);
  press(4);
  press(7);
  press(7, false);
  press(6);
  expect(bench.goals.map(({ goal }) => (goal["command"] as { position: number }).position)).toEqual([0, 0.06]);
  press(1);
  expect(bench.page.calls).toContain("estop");
  press(8);
  expect(bench.arm.chosen.value).toBe(false);
});

it("buzzes for the one who moves the arm, and for nobody else", () => {
  const playEffect = vi.fn(() => Promise.resolve("complete"));
  Object.assign(pad, { vibrationActuator: { playEffect } });
  bench.says("/arm/feedback", { array: [{ type: 1, id: 0, intensity: 0.6 }] });
  expect(playEffect).not.toHaveBeenCalled();
  bench.page.says({ controller: ME });
  bench.says("/arm/feedback", { array: [{ type: 1, id: 0, intensity: 0.6 }] });
  bench.says("/arm/feedback", { array: [{ type: 1, id: 0, intensity: 0 }] });
  expect(playEffect.mock.calls).toEqual([
    ["dual-rumble", { duration: 120, strongMagnitude: 0.6, weakMagnitude: 0.6 }],
    ["dual-rumble", { duration: 0, strongMagnitude: 0, weakMagnitude: 0 }],
  ]);
});
