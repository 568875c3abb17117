import { afterEach, beforeEach, expect, it } from "vitest";
import { DriveThere } from "../../src/steps/drive_there";
import { StepControl } from "../../src/steps/step_control";
import { Harness } from "../driving/harness";
import { RecordingSteps } from "./recording_steps";

let page: Harness;
let robot: RecordingSteps;
let there: DriveThere;
let views: boolean[];
let surface: HTMLElement;

beforeEach(() => {
  page = new Harness();
  robot = new RecordingSteps();
  views = [];
  surface = document.createElement("div");
  surface.setPointerCapture = () => undefined;
  const steps = new StepControl(robot);
  there = new DriveThere({
    surface, state: page.state, steps, join: (source) => page.driving.join(source, false),
    floorPoint: (x, y) => ({ x, y }), holdView: (held) => { views.push(held); },
  });
  page.state.mapFromBase.value = {
    position: { x: 10, y: 10, z: 0 }, orientation: { x: 0, y: 0, z: 0, w: 1 }, stamp: 1, receivedAt: 0,
  };
  page.wait(100);
});

afterEach(() => { page.dispose(); });

function pressAt(x: number, y: number): void {
  surface.dispatchEvent(new PointerEvent("pointerdown", { clientX: x, clientY: y, button: 0, pointerId: 1 }));
  surface.dispatchEvent(new PointerEvent("pointerup", { pointerId: 1 }));
}

it("sends the way under the deadman while the button is held, with the stick at rest, and no longer", () => {
  there.choosing.value = true;
  pressAt(13, 10);
  expect(there.target.value).toEqual({ x: 13, y: 10 });
  expect(robot.sent).toEqual([]);
  there.hold();
  page.wait(300);
  expect(robot.sent.map(({ goal }) => goal)).toEqual([{ distance: 3, angle: 0, speed: 0, held: true }]);
  const held = [...page.joys];
  expect(held.length).toBeGreaterThan(3);
  expect(held.every(({ forward, turn, deadman }) => forward === 0 && turn === 0 && deadman)).toBe(true);
  there.letGo();
  page.wait(300);
  expect(page.last).toMatchObject({ deadman: false });
});

it("lets go when everything on the page counts as released, and does not go on by itself", () => {
  there.choosing.value = true;
  pressAt(13, 10);
  there.hold();
  page.wait(300);
  page.driving.stop();
  page.wait(500);
  expect(page.last).toMatchObject({ deadman: false });
});

it("takes presses only while a place is chosen, and keeps the view still until the robot drives", () => {
  pressAt(13, 10);
  expect(there.target.value).toBeUndefined();
  there.choosing.value = true;
  pressAt(13, 10);
  there.hold();
  pressAt(15, 15);
  expect(there.target.value).toEqual({ x: 13, y: 10 });
  there.letGo();
  there.choosing.value = false;
  expect(there.target.value).toBeUndefined();
  expect(views).toEqual([false, true, false, true, false]);
});

it("takes a place from elsewhere, as from a headset's ray, while one is chosen and nothing is driven, and says what is missing", () => {
  const ready = { will: true, words: "" };
  there.aim({ x: 12, y: 10 });
  expect(there.target.value).toBeUndefined();
  there.choosing.value = true;
  expect(there.refusal(ready)).toMatch(/Press where/);
  there.aim({ x: 12, y: 10 });
  there.aim({ x: 13, y: 11 });
  expect(there.target.value).toEqual({ x: 13, y: 11 });
  expect(there.refusal(ready)).toBeUndefined();
  expect(there.refusal({ will: false, words: "Ann drives." })).toBe("Ann drives.");
  there.hold();
  there.aim({ x: 20, y: 20 });
  expect(there.target.value).toEqual({ x: 13, y: 11 });
});

it("waits until the step before has ended, for one that is asked for while it brakes ends with it", () => {
  there.choosing.value = true;
  pressAt(13, 10);
  there.hold();
  page.wait(300);
  there.letGo();
  there.hold();
  page.wait(300);
  expect(robot.sent.length).toBe(1);
  robot.sent[0]?.listener.ended({ outcome: "released", message: "", distance: 0.5, angle: 0, duration: 2 });
  expect(robot.sent.length).toBe(2);
  there.letGo();
  robot.sent[1]?.listener.ended({ outcome: "released", message: "", distance: 0, angle: 0, duration: 0 });
  page.wait(300);
  expect(robot.sent.length).toBe(2);
});
