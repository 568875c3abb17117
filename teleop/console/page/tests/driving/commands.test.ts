import { afterEach, beforeEach, describe, expect, it } from "vitest";
import { geared } from "../../src/driving/gears";
import { CONTROL, Harness, ME, OTHER, moves } from "./harness";

let page: Harness;

beforeEach(() => { page = new Harness(); });
afterEach(() => { page.dispose(); });

describe("the stream of commands", () => {
  it("is silent while nothing is held", () => {
    page.wait(5000);
    expect(page.joys).toEqual([]);
  });

  it("begins at once with a neutral command, goes on at 20 Hz, and ends with zeros and silence", () => {
    page.key("keydown", "ArrowUp");
    expect(page.joys).toEqual([{ at: expect.any(Number) as number, forward: 0, turn: 0, deadman: true, turbo: false }]);
    page.wait(1000);
    const times = page.joys.map(({ at }) => at);
    const gaps = times.slice(1).map((at, index) => at - (times[index] ?? 0));
    expect(Math.min(...gaps)).toBeGreaterThanOrEqual(20);
    expect(Math.max(...gaps)).toBeLessThanOrEqual(50);
    expect(times.length).toBeGreaterThanOrEqual(20);
    expect(page.joys.slice(1).every(moves)).toBe(true);
    const count = page.joys.length;
    page.key("keyup", "ArrowUp");
    expect(page.joys.length).toBe(count + 1);
    page.wait(5000);
    const end = page.joys.slice(count);
    expect(end.length).toBeLessThanOrEqual(3);
    expect(end.every(({ deadman, forward, turn }) => !deadman && forward === 0 && turn === 0)).toBe(true);
  });

  it.each([0, 10, 20, 30, 40])("sends a change at once, %s ms after whatever command that repeats the last", (later) => {
    page.key("keydown", "ArrowUp");
    page.wait(300 + later);
    const count = page.joys.length;
    page.key("keydown", "ArrowLeft");
    expect(page.joys.slice(count).map(({ turn }) => turn)).toEqual([1]);
  });

  it("sends changes no oftener than the robot's tick takes one, and the last of them", () => {
    page.key("keydown", "ArrowUp");
    page.wait(300);
    const count = page.joys.length;
    for (let change = 0; change < 101; change += 1) {
      page.key(change % 2 ? "keyup" : "keydown", "ArrowLeft");
      page.wait(4);
    }
    page.wait(36);
    const sent = page.joys.slice(count);
    expect(sent.length).toBeGreaterThan(10);
    expect(sent.length).toBeLessThan(440 / 20 + 440 / 50 + 2);
    expect(sent.at(-1)?.turn).toBe(1);
  });

  it("sends its neutral command again if the robot did not arm by it, for a fresh press only", () => {
    page.reporting = false;
    const control = { ...CONTROL, controller: ME, state: "disarmed", reason: "you took the free lease" } as const;
    page.key("keydown", "KeyW");
    for (let step = 0; step < 20; step++) {
      page.wait(100);
      page.state.control.value = { ...control };
    }
    const neutral = page.joys.filter(({ deadman, forward }) => deadman && forward === 0);
    expect(neutral).toHaveLength(4);
    expect(page.last?.deadman).toBe(false);
    expect(page.driving.stoppedBecause.value?.words).toMatch(/no longer listened/);
  });

  it("is not begun where another client drives, not even when that one leaves", () => {
    page.says({ controller: OTHER, state: "armed", armed: true });
    page.key("keydown", "KeyW");
    page.wait(500);
    page.says({ controller: "", state: "idle", armed: false });
    page.wait(500);
    page.key("keydown", "KeyW", { repeat: true });
    page.wait(20);
    expect(page.joys).toEqual([]);
    expect(page.driving.status.value.remedy).toMatch(/Let go/);
  });

  it("is not begun before the robot has said who drives", () => {
    page.reporting = false;
    page.state.control.value = undefined;
    page.key("keydown", "KeyW");
    page.wait(500);
    expect(page.joys).toEqual([]);
  });
});

describe("gears", () => {
  it("follow the keys 1 2 3, and turbo presses the robot's turbo button", () => {
    page.key("keydown", "Digit1");
    expect(page.driving.gear.value).toBe("precision");
    page.key("keydown", "KeyW");
    page.wait(200);
    expect(page.last?.forward).toBeCloseTo(0.35);
    page.key("keydown", "Digit3");
    page.wait(100);
    expect(page.last).toMatchObject({ forward: 1, turbo: true });
    page.key("keydown", "Digit2");
    page.wait(100);
    expect(page.last).toMatchObject({ forward: 1, turbo: false });
  });

  it("are lifted by the input's own turbo button", () => {
    expect(geared(1, 0, "precision", true)).toEqual({ forward: 1, turn: 0, turbo: true });
  });
});

describe("one input at a time", () => {
  it("drives until it is released; then the other one goes on, beginning with a neutral command", () => {
    page.key("keydown", "KeyW");
    page.wait(300);
    page.pointer("pointerdown");
    page.pointer("pointermove", 100, 0);
    page.wait(300);
    expect(page.last).toMatchObject({ forward: 1, turn: 0 });
    const count = page.joys.length;
    page.key("keyup", "KeyW");
    expect(page.joys[count]).toMatchObject({ forward: 0, turn: 0, deadman: true });
    page.wait(300);
    expect(page.last?.turn).toBeCloseTo(-1);
    expect(page.driving.sending.value?.source).toBe("stick");
  });
});

describe("the stick on the screen", () => {
  it("drives by raw moves, which do not wait for a picture", () => {
    page.pointer("pointerdown");
    page.wait(300);
    page.pointer("pointerrawupdate", 100, 0);
    page.wait(20);
    expect(page.last?.turn).toBeCloseTo(-1);
  });
});

describe("keys", () => {
  it("stop everything by the space bar, until they are pressed anew", () => {
    page.key("keydown", "KeyW");
    page.wait(300);
    const space = page.key("keydown", "Space");
    expect(space.defaultPrevented).toBe(true);
    expect(page.last).toMatchObject({ forward: 0, deadman: false });
    const count = page.joys.length;
    page.key("keyup", "Space");
    page.wait(1000);
    expect(page.movedSince(count)).toBe(false);
    page.key("keyup", "KeyW");
    page.key("keydown", "KeyW");
    page.wait(200);
    expect(page.moving).toBe(true);
  });

  it("leave the space bar to a focused button while nothing drives", () => {
    const button = document.createElement("button");
    document.body.append(button);
    expect(page.key("keydown", "Space", {}, button).defaultPrevented).toBe(false);
    page.key("keydown", "KeyW");
    expect(page.key("keydown", "Space", {}, button).defaultPrevented).toBe(true);
  });

  it.each(["input", "textarea", "select", "dialog"])("are not ours in an element %s", (name) => {
    const element = document.createElement(name);
    document.body.append(element);
    page.key("keydown", "KeyW", {}, element);
    page.key("keydown", "Digit3", {}, element);
    page.wait(200);
    expect(page.joys).toEqual([]);
    expect(page.driving.gear.value).toBe("normal");
  });

  it("are not ours in an element that asks for them, nor while something else uses them", () => {
    const element = document.createElement("div");
    element.dataset["ownKeys"] = "";
    document.body.append(element);
    page.key("keydown", "KeyW", {}, element);
    page.driving.keysElsewhere.value = true;
    page.key("keydown", "KeyW");
    page.wait(200);
    expect(page.movedSince(0)).toBe(false);
  });

  it("stop when a text field takes the focus while they are held", () => {
    page.key("keydown", "KeyW");
    page.wait(200);
    const field = document.createElement("input");
    document.body.append(field);
    field.focus();
    page.wait(20);
    expect(page.last?.deadman).toBe(false);
  });

  it("stop when a dialog opens while they are held", () => {
    page.key("keydown", "KeyW");
    page.wait(200);
    const dialog = document.createElement("dialog");
    dialog.setAttribute("open", "");
    document.body.append(dialog);
    page.wait(20);
    expect(page.last?.deadman).toBe(false);
  });

  it("that oppose each other stand still", () => {
    page.key("keydown", "KeyW");
    page.key("keydown", "KeyS");
    page.wait(200);
    expect(page.last).toMatchObject({ forward: 0, turn: 0, deadman: true });
  });
});

describe("a robot that nothing guards", () => {
  it("is driven by velocities within the page's limits, after a confirmation, with zeros at the end", () => {
    page.dispose();
    page = new Harness("plain");
    page.key("keydown", "KeyW");
    page.wait(500);
    expect([page.joys, page.velocities]).toEqual([[], []]);
    page.key("keyup", "KeyW");
    page.driving.confirmPlain();
    page.key("keydown", "KeyW");
    page.wait(500);
    expect(page.velocities[0]).toEqual({ linear: 0, angular: 0 });
    expect(page.velocities.at(-1)).toEqual({ linear: 0.35, angular: 0 });
    page.key("keyup", "KeyW");
    page.wait(1000);
    expect(page.velocities.slice(-3)).toEqual(Array(3).fill({ linear: 0, angular: 0 }));
    expect(page.joys).toEqual([]);
  });

  it("is let go by the e-stop, until it is confirmed again; and may be driven by Joy", () => {
    page.dispose();
    page = new Harness("plain");
    page.driving.confirmPlain("joy");
    page.key("keydown", "KeyW");
    page.wait(200);
    expect(page.moving).toBe(true);
    page.key("keydown", "Escape");
    expect(page.last?.deadman).toBe(false);
    expect(page.calls).toEqual([]);
    expect(page.driving.plainConfirmed.value).toBe(false);
    expect(page.driving.stoppedBecause.value?.words).toMatch(/no e-stop/);
  });

  it("has to be confirmed again for another run, and a guarded robot is never driven by velocities", () => {
    page.dispose();
    page = new Harness("plain");
    page.driving.confirmPlain();
    page.state.run.value = "another";
    expect(page.driving.plainConfirmed.value).toBe(false);
    page.driving.confirmPlain();
    page.state.dialect.value = "farsteer";
    expect(page.driving.plainConfirmed.value).toBe(false);
  });
});
