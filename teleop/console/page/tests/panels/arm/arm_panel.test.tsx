/** The arm's panel. */

import { afterEach, beforeEach, expect, it } from "vitest";
import { ArmPanel } from "../../../src/panels/arm";
import { ArmBench } from "../../arm/arm_bench";
import { OTHER } from "../../driving/harness";
import { mount, type Mounted } from "../mounted";

let bench: ArmBench;
let panel: Mounted;

beforeEach(async () => {
  bench = new ArmBench();
  panel = await mount(<ArmPanel arm={bench.arm} mayDrive />);
});

afterEach(() => {
  panel.unmount();
  bench.dispose();
});

const reason = (): string | null | undefined => panel.root.querySelector(".arm-reason")?.textContent;

function pointer(target: Element, type: string): void {
  Object.assign(target, { setPointerCapture: () => undefined });
  target.dispatchEvent(new PointerEvent(type, { pointerId: 1, button: 0, bubbles: true, cancelable: true }));
}

it("says why the arm does not move, where its tip is, and offers the way out", async () => {
  expect(reason()).toContain("Nobody moves the arm.");
  expect(reason()).toContain("Tip: 20.0 cm ahead, 0.0 cm left, 10.0 cm above the floor");
  await panel.act(() => { bench.state({ mode: "idle", reason: "let go" }); });
  expect(reason()).toContain("It stands: nothing is held.");
  await panel.act(() => { bench.state({ mode: "hand", reason: "arm_jaw_right is 5 mm from floor" }); });
  expect(reason()).toContain("Arm jaw right is 5 mm from floor.");
  await panel.act(() => { bench.state({ mode: "hand", reason: "wrist roll is at its limit of 90 degrees", way_out: "turn_over", way_out_text: "turn the wrist over" }); });
  expect(reason()).toContain("Wrist roll is at its limit of 90 degrees.");
  await panel.act(() => { panel.button("Turn the wrist over").click(); });
  expect(bench.calls).toEqual([{ service: "/arm/way_out", request: {} }]);
});

it("goes to a named pose while its button is held, with the way shown first", async () => {
  expect(panel.button("Hold to move").disabled).toBe(true);
  await panel.act(() => { panel.button("Pose “ready”").click(); });
  expect(panel.text()).toContain("the robot looks for a way");
  await panel.act(() => { bench.goals[0]?.listener.feedback({ state: "waiting", share: 0, path: { points: [{ positions: [0, 0] }, { positions: [1, 1] }] } }); });
  const hold = panel.button("Hold to move");
  await panel.act(() => { pointer(hold, "pointerdown"); bench.page.wait(200); });
  expect(bench.on("/arm/confirm").at(-1)?.message).toEqual({ data: true });
  await panel.act(() => { pointer(hold, "pointercancel"); bench.page.wait(200); });
  expect(bench.on("/arm/confirm").at(-1)?.message).toEqual({ data: false });
  await panel.act(() => { bench.goals[0]?.listener.ended({ ok: true, values: { outcome: "unreachable", message: "2 cm out of reach", path: { points: [] } } }); });
  expect(panel.text()).toContain("Pose “ready”: not reached; it does not reach there: 2 cm out of reach.");
});

it("moves a joint while a button or its slider is held, by Enter too", async () => {
  const forward = panel.button("Move shoulder forward");
  forward.dispatchEvent(new KeyboardEvent("keydown", { key: "Enter", bubbles: true, cancelable: true }));
  bench.page.wait(200);
  const rates = (): unknown => bench.on("/servo_node/delta_joint_cmds").at(-1)?.message["velocities"];
  expect(rates()).toEqual([0, 0.5]);
  forward.dispatchEvent(new KeyboardEvent("keyup", { key: "Enter", bubbles: true }));
  bench.page.wait(200);
  expect(rates()).toEqual([0, 0]);
  const slider = panel.root.querySelector<HTMLInputElement>("input[aria-label='yaw']");
  if (slider === null) {
    throw new Error("no slider");
  }
  const slide = (): Promise<void> => panel.act(() => {
    slider.value = "1";
    slider.dispatchEvent(new Event("input", { bubbles: true }));
    bench.page.wait(200);
  });
  await slide();
  expect(rates(), "set by assistive technology, which holds nothing").toEqual([0, 0]);
  expect(slider.value).toBe("0");
  await panel.act(() => { pointer(slider, "pointerdown"); });
  await slide();
  expect(rates()).toEqual([0.5, 0]);
  await panel.act(() => { pointer(slider, "pointerup"); bench.page.wait(200); });
  expect(rates()).toEqual([0, 0]);
  expect(panel.root.querySelector("meter")?.value).toBe(0);
});

it("lets go of a joint at a key that hides the release of Enter", async () => {
  const forward = panel.button("Move shoulder forward");
  const down = (key: string, metaKey = false): void => {
    forward.dispatchEvent(new KeyboardEvent("keydown", { key, metaKey, bubbles: true, cancelable: true }));
    bench.page.wait(200);
  };
  down("Enter");
  expect(bench.arm.hold.input.value).toBe("button");
  down("Meta", true);
  expect(bench.arm.hold.input.value).toBeUndefined();
  down("Enter", true);
  expect(bench.arm.hold.input.value).toBeUndefined();
  await panel.act(() => undefined);
});

it("keeps positions and goes through them", async () => {
  await panel.act(() => { panel.button("Keep this position").click(); });
  expect(panel.text()).toContain("Position 1, jaws at 0 mm");
  await panel.act(() => { panel.button("Go through them").click(); });
  expect(bench.goals.at(-1)?.goal["angles"]).toEqual([0, 0.5]);
  const hold = panel.button("Hold to move");
  expect(hold.disabled, "before the first way is shown").toBe(true);
  const way = { points: [{ positions: [0, 0] }, { positions: [0, 0.5] }] };
  await panel.act(() => { bench.goals.at(-1)?.listener.feedback({ state: "waiting", share: 0, path: way }); });
  await panel.act(() => { pointer(hold, "pointerdown"); });
  await panel.act(() => { bench.goals.at(-1)?.listener.ended({ ok: true, values: { outcome: "done", message: "", path: { points: [] } } }); });
  expect(bench.goals.at(-1)?.goal["command"]).toMatchObject({ position: 0 });
  expect(hold.disabled, "while the jaws move").toBe(false);
  expect(bench.arm.hold.input.value).toBe("button");
  await panel.act(() => { pointer(hold, "pointerup"); });
  await panel.act(() => { panel.button("Forget position 1").click(); });
  expect(panel.text()).toContain("None kept.");
});

it("offers nothing while somebody else drives, and only words to those who may only watch", async () => {
  await panel.act(() => { bench.page.says({ controller: OTHER }); bench.page.wait(50); });
  for (const name of ["Open", "Close", "Pose “stow”", "Go through them"]) {
    expect(panel.button(name).disabled).toBe(true);
  }
  await panel.act(() => { pointer(panel.button("Move yaw back"), "pointerdown"); bench.page.wait(100); });
  expect(bench.sent).toEqual([]);
  expect(reason()).toContain("drives");
  panel.unmount();
  panel = await mount(<ArmPanel arm={bench.arm} mayDrive={false} />);
  expect(panel.root.querySelector("button")).toBeNull();
  expect(reason()).toContain("Nobody moves the arm.");
});

it("says what the gripper holds, and that it did not move", async () => {
  await panel.act(() => { bench.state({ opening: 0.03, holding: true, grip_force: 4 }); });
  expect(panel.text()).toContain("Holds something 30 mm wide with 4.0 N.");
  await panel.act(() => { panel.button("Open").click(); });
  await panel.act(() => { bench.goals.at(-1)?.listener.ended({ ok: false, words: "the e-stop is latched" }); });
  expect(panel.text()).toContain("The gripper did not move: the e-stop is latched.");
});
