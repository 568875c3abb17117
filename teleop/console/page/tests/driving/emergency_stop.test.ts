import { afterEach, beforeEach, describe, expect, it } from "vitest";
import { turnsOf } from "../../src/driving/turn_taking";
import { CONTROL, Harness, ME, OTHER, SESSION } from "./harness";

let page: Harness;

beforeEach(() => { page = new Harness(); });
afterEach(() => { page.dispose(); });

const LATCHED = { estop: true, state: "estop", armed: false, controller: "", reason: `e-stop by ${ME}` } as const;

describe("the emergency stop", () => {
  it("stops by a zero at once, and calls the robot until its state says that it is latched", () => {
    page.key("keydown", "KeyW");
    page.wait(300);
    page.answer = () => new Promise(() => undefined);
    page.key("keydown", "Escape");
    expect(page.last).toMatchObject({ forward: 0, deadman: false });
    expect(page.calls).toEqual(["estop"]);
    const count = page.joys.length;
    page.wait(2100);
    expect(page.joys.length, "a robot that is stopped complains of commands").toBe(count);
    expect(page.calls.length).toBeGreaterThanOrEqual(4);
    expect(page.driving.estop.pending.value?.attempts).toBe(page.calls.length);
    page.says(LATCHED);
    expect(page.driving.estop.pending.value).toBeUndefined();
    const calls = page.calls.length;
    page.wait(5000);
    expect(page.calls.length).toBe(calls);
  });

  it("goes on while the connection is lost, and shows why it is refused", async () => {
    page.state.connection.value = { phase: "lost", words: "", sinceAt: 0 };
    page.answer = () => Promise.resolve({ success: false, message: "not connected" });
    page.driving.emergencyStop();
    await page.settle();
    expect(page.driving.estop.pending.value?.refusal).toBe("not connected");
    page.wait(10000);
    expect(page.calls.length).toBeGreaterThan(8);
    page.answer = () => Promise.resolve({ success: true, message: "stopped" });
    page.wait(1000);
    page.says(LATCHED);
    expect(page.driving.estop.pending.value).toBeUndefined();
  });

  it("does not take a state from before the press for its own", () => {
    page.says(LATCHED);
    page.reporting = false;
    page.answer = () => new Promise(() => undefined);
    page.driving.emergencyStop();
    expect(page.driving.estop.pending.value).toBeDefined();
    page.says(LATCHED);
    expect(page.driving.estop.pending.value).toBeUndefined();
  });

  it("is pressed by Escape once, however long it is held, unless that closes something", () => {
    page.driving.onEscape = () => true;
    page.key("keydown", "Escape");
    expect(page.calls).toEqual([]);
    page.driving.onEscape = () => false;
    page.key("keydown", "Escape", { repeat: true });
    expect(page.calls).toEqual([]);
    const dialog = document.createElement("dialog");
    dialog.setAttribute("open", "");
    document.body.append(dialog);
    page.key("keydown", "Escape");
    expect(page.calls).toEqual([]);
    dialog.remove();
    page.key("keydown", "Escape");
    expect(page.calls).toEqual(["estop"]);
  });

  it("is pressed by the gamepad's B, and by no B that was held when it was plugged in", () => {
    const pad = page.plug();
    pad.buttons[1] = { pressed: true, value: 1 };
    page.wait(100);
    expect(page.calls).toEqual([]);
    pad.buttons[1] = { pressed: false, value: 0 };
    page.wait(20);
    pad.buttons[1] = { pressed: true, value: 1 };
    page.wait(20);
    expect(page.calls).toEqual(["estop"]);
  });

  it("is released after one confirmation, and a refusal is shown", async () => {
    page.says(LATCHED);
    await page.driving.estop.confirmReset();
    expect(page.calls).toEqual([]);
    page.driving.estop.askReset();
    page.answer = () => Promise.resolve({ success: false, message: `${OTHER} stopped the robot` });
    await page.driving.estop.confirmReset();
    expect(page.calls).toEqual(["resetEstop"]);
    expect(page.driving.estop.resetRefused.value).toMatch(/client 3 .* stopped/);
    page.says({ estop: false, state: "idle" });
    expect(page.driving.estop.resetRefused.value).toBeUndefined();
  });

  it("keeps the robot stopped if Escape answers the question", () => {
    page.says(LATCHED);
    page.driving.estop.askReset();
    page.key("keydown", "Escape");
    expect(page.driving.estop.resetAsked.value).toBe(false);
    expect(page.calls).toEqual([]);
  });
});

describe("taking turns", () => {
  it.each([
    ["nobody drives", {}, { driver: "nobody", mayAsk: false, mayTakeOver: true }],
    ["I drive", { controller: ME }, { driver: "me", mayAsk: false, mayTakeOver: false }],
    ["another drives", { controller: OTHER }, { driver: "other", name: OTHER, mayAsk: true, mayTakeOver: true }],
    ["I have asked", { controller: OTHER, asking: 2 }, { waiting: true, mayAsk: false, askedBy: "" }],
    ["somebody else has asked", { controller: OTHER, asking: 4 }, { waiting: false, mayAsk: false, askedBy: "" }],
    ["I am asked", { controller: ME, asking: 3, askingName: OTHER }, { askedBy: OTHER }],
    ["I am asked by somebody without a name", { controller: ME, asking: 3 }, { askedBy: "client 3" }],
  ])("shows what may be done: %s", (_, control, turns) => {
    expect(turnsOf({ ...CONTROL, ...control }, SESSION)).toMatchObject(turns);
  });

  it("offers an observer nothing, but says who drives", () => {
    const watching = { ...SESSION, mayDrive: false, mayTakeOver: false };
    expect(turnsOf({ ...CONTROL, controller: OTHER }, watching))
      .toMatchObject({ driver: "other", name: OTHER, mayAsk: false, mayTakeOver: false });
  });

  it("says what came of a request", async () => {
    await page.driving.turns.request("ask");
    expect(page.driving.turns.outcome.value).toBe("Asked.");
    page.answer = () => Promise.resolve({ success: false, message: "nobody drives" });
    await page.driving.turns.request("give");
    expect(page.driving.turns.outcome.value).toMatch(/nobody drives/);
    page.answer = () => Promise.resolve({ success: false, message: "not connected" });
    await page.driving.turns.request("refuse");
    expect(page.driving.turns.outcome.value).toMatch(/not connected/);
    expect(page.calls).toEqual(["ask", "give", "refuse"]);
  });

  it("takes over by the gamepad's Start, unless the robot is mine", () => {
    const pad = page.plug();
    page.wait(20);
    pad.buttons[9] = { pressed: true, value: 1 };
    page.wait(100);
    expect(page.calls).toEqual(["takeOver"]);
    pad.buttons[9] = { pressed: false, value: 0 };
    page.says({ controller: ME, state: "disarmed" });
    page.wait(20);
    pad.buttons[9] = { pressed: true, value: 1 };
    page.wait(100);
    expect(page.calls).toEqual(["takeOver"]);
  });
});
