import { beforeEach, expect, it } from "vitest";
import { StepControl } from "../../src/steps/step_control";
import { stepGoal } from "../../src/steps/step_size";
import { RecordingSteps } from "./recording_steps";

let robot: RecordingSteps;
let steps: StepControl;

beforeEach(() => {
  robot = new RecordingSteps();
  steps = new StepControl(robot);
});

it("keeps the steps in their order until each has ended", () => {
  steps.ask(stepGoal("forward", 1, "own"));
  steps.ask(stepGoal("left", 90, "own"));
  robot.sent[1]?.listener.progress({ moving: false, ahead: 1, distance: 0, angle: 0 });
  robot.sent[0]?.listener.progress({ moving: true, ahead: 0, distance: 0.4, angle: 0 });
  expect(steps.present.value).toMatchObject({ goal: { distance: 1 }, progress: { distance: 0.4 } });
  robot.sent[0]?.listener.ended({ outcome: "done", message: "", distance: 1, angle: 0, duration: 4 });
  expect(steps.pending.value.length).toBe(1);
  expect(steps.last.value).toMatchObject({ goal: { distance: 1 }, end: { outcome: "done" } });
  expect(steps.moves).toBe(true);
});

it("cancels the last one first, so that none begins meanwhile", () => {
  steps.ask(stepGoal("forward", 1, "own"));
  steps.ask(stepGoal("back", 1, "own"));
  steps.stop();
  expect(robot.cancelled).toEqual([1, 0]);
});

it("cancels them when the page is hidden", () => {
  const tab = Object.assign(new EventTarget(), { visibilityState: "visible" });
  const stop = steps.stopWhenHidden(tab as unknown as Document);
  steps.ask(stepGoal("forward", 1, "own"));
  tab.dispatchEvent(new Event("visibilitychange"));
  expect(robot.cancelled).toEqual([]);
  tab.visibilityState = "hidden";
  tab.dispatchEvent(new Event("visibilitychange"));
  expect(robot.cancelled).toEqual([0]);
  stop();
});

it("says that a step was not sent", () => {
  robot.connected = false;
  expect(steps.ask(stepGoal("forward", 1, "own"))).toBe(false);
  expect(steps.moves).toBe(false);
});
