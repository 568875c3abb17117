import { afterEach, beforeEach, describe, expect, it } from "vitest";
import { Harness, OTHER, type FakePad } from "./harness";

let page: Harness;

beforeEach(() => { page = new Harness(); });
afterEach(() => { page.dispose(); });

/** Each way to drive at full speed, and how to let go of it. */
const INPUTS: Record<string, { press: () => void; letGo: () => void }> = {
  keyboard: {
    press: () => { page.key("keydown", "ArrowUp"); },
    letGo: () => { page.key("keyup", "ArrowUp"); },
  },
  stick: {
    press: () => { page.pointer("pointerdown"); page.pointer("pointermove", 0, -100); },
    letGo: () => { page.pointer("pointerup"); },
  },
  gamepad: {
    press: () => { hold(page.pads[0] ?? page.plug()); },
    letGo: () => { rest(page.pads[0] ?? page.plug()); },
  },
};

function hold(pad: FakePad): void {
  page.wait(20);
  pad.buttons[4] = { pressed: true, value: 1 };
  page.wait(20);
  pad.axes[1] = -1;
}

function rest(pad: FakePad): void {
  pad.buttons[4] = { pressed: false, value: 0 };
  pad.axes[1] = 0;
  page.wait(20);
}

const LOSSES: Record<string, { lose: () => void; back: () => void; words: RegExp }> = {
  "a hidden tab": { lose: () => { page.hide(); }, back: () => { page.reveal(); }, words: /tab was hidden/ },
  "a window without focus": {
    lose: () => { window.dispatchEvent(new Event("blur")); },
    back: () => { window.dispatchEvent(new Event("focus")); },
    words: /another window/,
  },
  "a page that is left": { lose: () => { window.dispatchEvent(new Event("pagehide")); }, back: () => undefined, words: /page was left/ },
  "a page that is frozen": { lose: () => { document.dispatchEvent(new Event("freeze")); }, back: () => undefined, words: /suspended/ },
  "a computer that slept": {
    lose: () => { page.wallSkew += 5000; page.wait(16); }, back: () => undefined, words: /slept/,
  },
  "a lost connection": {
    lose: () => { page.state.connection.value = { phase: "lost", words: "", sinceAt: 0 }; },
    back: () => { page.state.connection.value = { phase: "open", words: "", sinceAt: 0 }; page.says({}); },
    words: /connection was lost/,
  },
  "a robot that says nothing": {
    lose: () => { page.reporting = false; page.wait(1200); },
    back: () => { page.reporting = true; page.says({}); },
    words: /said nothing/,
  },
  "a robot that stopped listening": {
    lose: () => { page.says({ state: "disarmed", armed: false, reason: "no command for 0.500 s" }); page.wait(20); },
    back: () => { page.says({ state: "idle", controller: "" }); },
    words: /watchdog: no command for 0.5 s/,
  },
};

describe.each(Object.entries(INPUTS))("driving by %s", (_, input) => {
  it.each(Object.entries(LOSSES))("stops at once by a neutral command, and says why: %s", (_, loss) => {
    input.press();
    page.wait(600);
    expect(page.moving).toBe(true);
    loss.lose();
    expect(page.last).toMatchObject({ forward: 0, turn: 0, deadman: false });
    expect(page.driving.stoppedBecause.value?.words).toMatch(loss.words);
    const count = page.joys.length;
    page.wait(1000);
    expect(page.joys.length - count).toBeLessThanOrEqual(3);
    loss.back();
    page.wait(1000);
    expect(page.movedSince(count)).toBe(false);
    input.letGo();
    page.wait(1000);
    input.press();
    page.wait(200);
    expect(page.moving).toBe(true);
    expect(page.driving.stoppedBecause.value).toBeUndefined();
  });

  it("stops when a command cannot be sent, and waits for a new press", () => {
    input.press();
    page.wait(500);
    page.reachable = false;
    page.wait(100);
    expect(page.driving.stoppedBecause.value?.words).toMatch(/took no command/);
    page.reachable = true;
    const count = page.joys.length;
    page.wait(1000);
    expect(page.movedSince(count)).toBe(false);
  });

  it("does not drive when another client takes the robot over, nor when it is free again", () => {
    input.press();
    page.wait(500);
    page.says({ controller: OTHER, state: "armed", armed: true, reason: "taken over" });
    expect(page.last).toMatchObject({ forward: 0, deadman: false });
    expect(page.driving.stoppedBecause.value?.words).toMatch(/somebody else/);
    const count = page.joys.length;
    page.wait(500);
    page.says({ controller: "", state: "idle", armed: false });
    page.wait(1000);
    expect(page.movedSince(count)).toBe(false);
  });

  it("does not drive on after an e-stop and its reset", () => {
    input.press();
    page.wait(500);
    page.says({ estop: true, state: "estop", armed: false, controller: "", reason: `e-stop by ${OTHER}` });
    expect(page.moving).toBe(false);
    const count = page.joys.length;
    page.wait(500);
    page.says({ estop: false, state: "idle", reason: `e-stop reset by ${OTHER}` });
    page.wait(1000);
    expect(page.movedSince(count)).toBe(false);
  });
});

describe("the stick on the screen", () => {
  it.each(["pointercancel", "lostpointercapture"])("stops on %s, and drives only by a new touch", (type) => {
    page.pointer("pointerdown");
    page.pointer("pointermove", 0, -100);
    page.wait(300);
    expect(page.moving).toBe(true);
    page.pointer(type);
    expect(page.last).toMatchObject({ forward: 0, deadman: false });
    expect(page.driving.stoppedBecause.value?.words).toMatch(/touch/);
    const count = page.joys.length;
    page.pointer("pointermove", 0, -100);
    page.wait(500);
    expect(page.movedSince(count)).toBe(false);
  });

  it("stops when it is taken off the page", () => {
    const other = document.createElement("div");
    other.setPointerCapture = () => undefined;
    const detach = page.driving.stick.attach(other);
    other.dispatchEvent(new PointerEvent("pointerdown", { pointerId: 7, button: 0 }));
    other.dispatchEvent(new PointerEvent("pointermove", { pointerId: 7, clientX: -80 }));
    page.wait(300);
    expect(page.moving).toBe(true);
    detach();
    expect(page.last?.deadman).toBe(false);
  });
});

describe("a gamepad", () => {
  it("stops when it is unplugged, and must be let go of when it is back", () => {
    const pad = page.plug();
    hold(pad);
    page.wait(300);
    expect(page.moving).toBe(true);
    page.pads = [null];
    page.wait(20);
    expect(page.last).toMatchObject({ forward: 0, deadman: false });
    expect(page.driving.stoppedBecause.value?.words).toMatch(/unplugged/);
    const count = page.joys.length;
    page.pads = [pad];
    page.wait(1000);
    expect(page.movedSince(count)).toBe(false);
    rest(pad);
    hold(pad);
    page.wait(200);
    expect(page.moving).toBe(true);
  });

  it("stops when its reports freeze", () => {
    const pad = page.plug();
    hold(pad);
    for (let step = 0; step < 50; step++) {
      pad.axes[1] = -0.5 - (step % 5) / 100;
      pad.timestamp += 16;
      page.wait(16);
    }
    expect(page.moving).toBe(true);
    page.wait(1100);
    expect(page.last).toMatchObject({ forward: 0, deadman: false });
    expect(page.driving.stoppedBecause.value?.words).toMatch(/no longer reports/);
  });
});

describe("keys", () => {
  it("that never came up do not drive on by their repetition after the focus is back", () => {
    page.key("keydown", "KeyW");
    page.wait(300);
    window.dispatchEvent(new Event("blur"));
    page.wait(2000);
    window.dispatchEvent(new Event("focus"));
    const count = page.joys.length;
    page.key("keydown", "KeyW"); // some systems do not mark the first one as a repetition
    for (let step = 0; step < 40; step++) {
      page.wait(33);
      page.key("keydown", "KeyW", { repeat: true });
    }
    expect(page.movedSince(count)).toBe(false);
    page.key("keyup", "KeyW");
    page.key("keydown", "KeyW");
    page.wait(100);
    expect(page.moving).toBe(true);
  });

  it("pressed with Control, Meta or Alt stop and do not drive", () => {
    page.key("keydown", "KeyW");
    page.wait(200);
    page.key("keydown", "MetaLeft", { metaKey: true });
    expect(page.last).toMatchObject({ forward: 0, deadman: false });
    const count = page.joys.length;
    page.key("keydown", "KeyD", { ctrlKey: true });
    page.wait(500);
    expect(page.movedSince(count)).toBe(false);
  });

  it("stop when a menu opens, which swallows their key-up", () => {
    page.key("keydown", "KeyW");
    page.wait(200);
    window.dispatchEvent(new Event("contextmenu"));
    expect(page.last?.deadman).toBe(false);
    expect(page.driving.stoppedBecause.value?.words).toMatch(/menu/);
  });

  it("drive on when the right button turns the picture, where no menu opens", () => {
    page.key("keydown", "KeyW");
    page.wait(200);
    const prevented = new Event("contextmenu", { cancelable: true });
    prevented.preventDefault();
    window.dispatchEvent(prevented);
    page.wait(100);
    expect(page.moving).toBe(true);
  });

  it("drive on for as long as they are held, with repetition or without", () => {
    page.key("keydown", "KeyW");
    page.wait(20000);
    expect(page.moving).toBe(true);
  });
});
