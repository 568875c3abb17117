import { afterEach, beforeEach, expect, it, vi } from "vitest";
import { render } from "preact";
import { StepsPanel } from "../../../src/panels/steps/steps_panel";
import { StepControl } from "../../../src/steps/step_control";
import { Harness } from "../../driving/harness";
import { RecordingSteps } from "../../steps/recording_steps";

let page: Harness;
let root: HTMLElement;
let robot: RecordingSteps;
let steps: StepControl;

beforeEach(async () => {
  page = new Harness();
  root = document.body.appendChild(document.createElement("main"));
  robot = new RecordingSteps();
  steps = new StepControl(robot);
  page.driving.steps = steps;
  page.wait(100);
  render(<StepsPanel steps={steps} driving={page.driving} state={page.state} keeper={undefined} />, root);
  await settle();
});

afterEach(() => {
  render(null, root);
  root.remove();
  page.dispose();
});

async function settle(): Promise<void> {
  await vi.advanceTimersByTimeAsync(150);
}

function button(name: string): HTMLButtonElement {
  const found = [...root.querySelectorAll("button")].find((one) => (one.getAttribute("aria-label") ?? one.textContent) === name);
  if (found === undefined) {
    throw new Error(`no button ${name}`);
  }
  return found;
}

async function press(name: string): Promise<void> {
  button(name).click();
  await settle();
}

async function enter(index: number, text: string): Promise<void> {
  const field = root.querySelectorAll("input")[index];
  if (field !== undefined) {
    field.value = text;
    field.dispatchEvent(new Event("input", { bubbles: true }));
  }
  await settle();
}

const words = () => root.querySelector("[role=status]")?.textContent;

it("sends steps of the chosen size and shows how they go on and end", async () => {
  await press("2 m");
  await press("Step forward");
  await press("45 °");
  await press("Turn right by a step");
  expect(robot.sent.map(({ goal }) => goal)).toEqual([
    { distance: 2, angle: 0, speed: 0 }, { distance: 0, angle: -Math.PI / 4, speed: 0 },
  ]);
  robot.sent[0]?.listener.progress({ moving: true, ahead: 0, distance: 0.5, angle: 0 });
  await settle();
  expect(words()).toBe("Forward 2.00 m: 0.50 m done");
  expect(root.textContent).toContain("1 more waits.");
  expect(root.querySelector("progress")?.value).toBe(0.25);
  robot.sent[0]?.listener.ended({ outcome: "contact", message: "front bumper", distance: 0.7, angle: 0, duration: 3 });
  robot.sent[1]?.listener.ended({ outcome: "contact", message: "not begun", distance: 0, angle: 0, duration: 0 });
  await settle();
  expect(words()).toBe("Right 45.0°: not driven; the bumper touched something (not begun).");
});

it("says what is wrong with a size, and sends nothing of it", async () => {
  await enter(0, "1000");
  expect(words()).toBe("Distance: a number from 0.01 to 100 m, not “1000”.");
  expect(button("Step back").disabled).toBe(true);
  expect(button("Turn left by a step").disabled).toBe(false);
  await enter(0, "0,3");
  await press("Step back");
  expect(robot.sent[0]?.goal.distance).toBe(-0.3);
});

it("cancels all by its button, by the space bar and with the emergency stop", async () => {
  expect(button("Cancel all steps").disabled).toBe(true);
  await press("Step forward");
  await press("Cancel all steps");
  expect(robot.cancelled).toEqual([0]);
  const space = new KeyboardEvent("keydown", { code: "Space", bubbles: true, cancelable: true });
  button("Step forward").dispatchEvent(space);
  expect(space.defaultPrevented, "the button is not pressed").toBe(true);
  expect(robot.cancelled).toEqual([0, 0]);
  page.driving.emergencyStop();
  expect(robot.cancelled).toEqual([0, 0, 0]);
});

it("offers no step while the robot would refuse it, and none to who may only watch", async () => {
  page.says({ estop: true, state: "estop", reason: "e-stop by client 9" });
  await settle();
  expect(button("Step forward").disabled).toBe(true);
  const session = page.state.session.value;
  if (session !== undefined) {
    page.state.session.value = { ...session, mayDrive: false };
  }
  await settle();
  expect(root.textContent).toBe("");
});

it("says that a step could not be sent", async () => {
  robot.connected = false;
  await press("Step forward");
  expect(words()).toBe("Not sent: there is no connection.");
});
