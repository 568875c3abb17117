import { afterEach, beforeEach, expect, it } from "vitest";
import { HintTool } from "../../../src/hint/hint_tool";
import { HintPanel, wordsOf } from "../../../src/panels/hint/hint_panel";
import { unknownState, type RobotState } from "../../../src/robot/robot_state";
import type { StampedPose } from "../../../src/values";
import { SESSION } from "../../driving/harness";
import { RecordingCommands } from "../../hint/recording_commands";
import { mount, type Mounted } from "../mounted";

const POSE: StampedPose = {
  position: { x: 1, y: 2, z: 0 }, orientation: { x: 0, y: 0, z: 0, w: 1 }, stamp: 1, receivedAt: 0,
};

let state: RobotState;
let commands: RecordingCommands;
let tool: HintTool;
let page: Mounted;

beforeEach(async () => {
  state = unknownState();
  state.dialect.value = "farsteer";
  commands = new RecordingCommands();
  const scene = { floorPoint: () => undefined, showGhost: () => undefined, setInteraction: () => undefined };
  tool = new HintTool(document.createElement("div"), scene, commands, state);
  page = await mount(<HintPanel tool={tool} state={state} />);
});

afterEach(() => {
  tool.dispose();
  page.unmount();
});

it("leads from the first press to the verdict", async () => {
  await page.act(() => { page.button("Show where it is").click(); });
  expect(page.text()).toContain("Press on the map where the robot is");
  expect(page.button("It is here").disabled).toBe(true);
  await page.act(() => {
    tool.cancel();
    state.mapFromBase.value = { ...POSE, receivedAt: performance.now() };
    tool.begin();
  });
  expect(page.text()).toContain("x 1.00 m, y 2.00 m, heading 0°");
  expect(page.text()).toContain("explains 93 % of what the scanner sees; the present pose 41 %");
  expect(page.root.querySelector("[data-quality]")?.getAttribute("data-quality")).toBe("good");
  await page.act(() => { page.button("turn left by 5°").click(); });
  expect(page.text()).toContain("heading 5°");
  expect(page.text()).toContain("the place before explains");
  await page.act(() => { page.button("It is here").click(); });
  expect(page.text()).toContain("Sent;");
  const [sent] = commands.hints;
  await page.act(() => {
    const yaw = sent?.pose.yaw ?? 0;
    const hint = { position: POSE.position, orientation: { x: 0, y: 0, z: Math.sin(yaw / 2), w: Math.cos(yaw / 2) } };
    state.verdict.value = { stamp: 1, verdict: "rejected", reason: "only 12 % explained", hint, candidates: [], scores: [] };
  });
  expect(page.text()).toContain("Rejected: the robot is not there. Only 12 % explained.");
});

it("offers the numbered places of a search", async () => {
  await page.act(() => { state.candidates.value = [POSE, { ...POSE, position: { x: 8, y: 9, z: 0 } }]; });
  expect(page.text()).toContain("2 places explain what is seen");
  await page.act(() => { page.button("2: at 8.0, 9.0 m").click(); });
  expect(commands.hints[0]?.pose).toMatchObject({ x: 8, y: 9 });
});

it("names the places of a search, with the share that each explains and how far it is", async () => {
  await page.act(() => { state.candidates.value = [{ ...POSE, name: "kitchen", share: 0.914, away: 12.04 }]; });
  expect(page.text()).toContain("1: kitchen, 91 %, 12.0 m away");
});

it("offers to undo only what was placed", async () => {
  expect(page.text()).not.toContain("Undo");
  await page.act(() => {
    state.verdict.value = { stamp: 1, verdict: "accepted", reason: "", hint: POSE, candidates: [], scores: [] };
  });
  expect(page.text()).toContain("Undo");
});

it("does not offer what the role may not use, nor what a plain rosbridge has not", async () => {
  await page.act(() => { state.session.value = { ...SESSION, mayHint: false, maySearch: false }; });
  expect(page.text()).toBe("");
  await page.act(() => { state.session.value = { ...SESSION, maySearch: false }; });
  expect(page.text()).not.toContain("Find it");
  await page.act(() => {
    state.session.value = undefined;
    state.dialect.value = "plain";
  });
  expect(page.text()).toContain("Show where it is");
  expect(page.text()).not.toContain("Find it");
  expect(page.text()).not.toContain("Undo");
});

it("has words for every end", () => {
  expect(wordsOf({ phase: "answered", result: { kind: "silent" } })).toContain("3 s");
  expect(wordsOf({ phase: "answered", result: { kind: "unanswered" } })).toContain("does not answer hints");
  expect(wordsOf({ phase: "placing", result: { kind: "notSent" } })).toContain("no connection");
  expect(wordsOf({ phase: "off", result: undefined })).toBe("");
  const answer = { success: false, message: "nothing to undo" };
  expect(wordsOf({ phase: "answered", result: { kind: "undo", answer } })).toBe("Not undone: nothing to undo");
});
