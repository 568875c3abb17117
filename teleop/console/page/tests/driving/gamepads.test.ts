import fc from "fast-check";
import { afterEach, beforeEach, describe, expect, it } from "vitest";
import { withoutDeadZone } from "../../src/driving/drive_source";
import { MappingStore, STANDARD_MAPPING, mappingFrom, type GamepadMapping } from "../../src/driving/gamepad_mapping";
import { completed, pressedButton, pushedAxis, withUse } from "../../src/driving/mapping_capture";
import { Harness, type FakePad } from "./harness";

let page: Harness;
let pad: FakePad;

beforeEach(() => {
  page = new Harness();
  pad = page.plug();
  page.wait(50);
});
afterEach(() => { page.dispose(); });

function press(button: number, pressed = true): void {
  pad.buttons[button] = { pressed, value: Number(pressed) };
  page.wait(20);
}

const ODD: GamepadMapping = {
  forward: { axis: 3, sign: 1 }, turn: { axis: 2, sign: 1 }, deadman: 0, turbo: undefined, estop: undefined,
  takeOver: undefined, deadZone: 0.2,
};

describe("a gamepad", () => {
  it("drives by its left stick while LB is held; forward and left are positive", () => {
    press(4);
    pad.axes = [-1, -1, 0, 0];
    page.wait(200);
    expect(page.last).toMatchObject({ forward: 1, turn: 1, deadman: true, turbo: false });
    press(5);
    page.wait(100);
    expect(page.last?.turbo).toBe(true);
    press(4, false);
    expect(page.last).toMatchObject({ forward: 0, turn: 0, deadman: false, turbo: false });
  });

  it("does not drive without its deadman, and the page says so", () => {
    pad.axes[1] = -1;
    page.wait(500);
    expect(page.joys).toEqual([]);
    expect(page.driving.status.value.words).toMatch(/deadman/);
  });

  it("holds the robot still while its stick was pushed before its deadman", () => {
    pad.axes[1] = -1;
    press(4);
    page.wait(500);
    expect(page.movedSince(0)).toBe(false);
    expect(page.last?.deadman).toBe(true);
    expect(page.driving.status.value.remedy).toMatch(/Let go of the stick first/);
    pad.axes[1] = 0;
    page.wait(50);
    pad.axes[1] = -1;
    page.wait(100);
    expect(page.moving).toBe(true);
  });

  it("that is plugged in with its deadman held must be released first", () => {
    const second = page.plug("second");
    second.buttons[4] = { pressed: true, value: 1 };
    page.wait(100);
    second.axes[1] = -1;
    page.wait(500);
    expect(page.joys).toEqual([]);
    expect(page.driving.status.value.remedy).toMatch(/Let go/);
  });

  it("of an unknown kind needs a mapping, which the page remembers", () => {
    page.pads = [];
    pad = page.plug("odd", "");
    page.wait(50);
    expect(page.driving.status.value.words).toMatch(/unknown kind/);
    press(0);
    pad.axes[3] = 1;
    page.wait(200);
    expect(page.joys).toEqual([]);
    press(0, false);
    pad.axes[3] = 0;
    page.driving.pads.store.save("odd", ODD);
    page.wait(50);
    press(0);
    pad.axes[3] = 0.6;
    page.wait(200);
    expect(page.last?.forward).toBeCloseTo(0.5);
    expect(new MappingStore(() => localStorage).of(pad as unknown as Gamepad)).toEqual(ODD);
  });

  it("does nothing while it is mapped, and nothing that is held then counts afterwards", () => {
    page.driving.pads.mapping.value = true;
    press(1);
    press(4);
    pad.axes[1] = -1;
    page.wait(100);
    page.driving.pads.mapping.value = false;
    page.wait(300);
    expect([page.joys, page.calls]).toEqual([[], []]);
  });

  it("that is digital drives on for as long as its key is held", () => {
    pad.timestamp = 5;
    page.wait(20);
    press(4);
    pad.timestamp = 6;
    pad.axes[1] = -1;
    pad.timestamp = 7;
    page.wait(10000);
    expect(page.moving).toBe(true);
  });

  it("may send anything: the page does not drive by what is no number", () => {
    pad.axes = [Number.NaN, Number.POSITIVE_INFINITY];
    press(4);
    page.wait(200);
    expect(page.movedSince(0)).toBe(false);
    pad.axes = [];
    pad.buttons = [];
    page.wait(200);
    expect(page.last?.deadman).toBe(false);
  });

  it("is not there for a browser that lists none", () => {
    Object.defineProperty(navigator, "getGamepads", { configurable: true, value: () => { throw new Error("forbidden"); } });
    page.wait(100);
    expect(page.driving.pads.pads.value).toEqual([]);
  });

  it("works for a browser that keeps nothing", () => {
    const store = new MappingStore(() => { throw new Error("forbidden"); });
    expect(store.of({ id: "odd", mapping: "" })).toBeUndefined();
    expect(store.save("odd", ODD)).toBe(false);
    expect(store.of({ id: "odd", mapping: "" })).toEqual(ODD);
    store.forget("odd");
    expect(store.of({ id: "odd", mapping: "standard" })).toEqual(STANDARD_MAPPING);
  });
});

describe("a stored mapping", () => {
  it("is read back as it was written", () => {
    expect(mappingFrom(JSON.parse(JSON.stringify(ODD)))).toEqual(ODD);
  });

  it("may be anything: it is a whole mapping, or none", () => {
    const field = fc.oneof(fc.anything(), fc.constantFrom(0, 1, -1, 1e9, Number.NaN, null), fc.record({ axis: fc.anything(), sign: fc.anything() }));
    const fields = fc.record({ forward: field, turn: field, deadman: field, turbo: field, deadZone: field }, { requiredKeys: [] });
    fc.assert(fc.property(fc.oneof(fc.anything(), fields), (value) => {
      const mapping = mappingFrom(value);
      if (mapping !== undefined) {
        expect(mapping.deadZone).toBeGreaterThan(0);
        expect(mapping.deadZone).toBeLessThanOrEqual(0.5);
        expect(Number.isInteger(mapping.deadman)).toBe(true);
        expect(mapping.forward.axis).not.toBe(mapping.turn.axis);
      }
    }));
  });
});

describe("learning a mapping", () => {
  const rest = { axes: [0, 0.1, -1], buttons: [false, true, false] };

  it("takes the axis that is pushed most, not a trigger that rests at its end", () => {
    expect(pushedAxis(rest, { ...rest, axes: [0.6, -0.9, 1] })).toEqual({ axis: 1, sign: -1 });
    expect(pushedAxis(rest, { ...rest, axes: [0.3, 0.1, 1] })).toBeUndefined();
  });

  it("takes the button that was not pressed before", () => {
    expect(pressedButton(rest, { ...rest, buttons: [false, true, true] })).toBe(2);
    expect(pressedButton(rest, rest)).toBeUndefined();
  });

  it("gives each axis and button one use only", () => {
    const draft = withUse(withUse(withUse({ deadZone: 0.1 }, "deadman", 4), "turbo", 4), "forward", { axis: 1, sign: 1 });
    expect(withUse(draft, "turn", { axis: 1, sign: -1 })).toEqual({ deadZone: 0.1, turbo: 4, turn: { axis: 1, sign: -1 } });
  });

  it("is done once both axes and the deadman are set", () => {
    expect(completed({ forward: { axis: 1, sign: 1 }, deadman: 0 }, 0.1)).toBeUndefined();
    expect(completed({ forward: { axis: 1, sign: 1 }, turn: { axis: 0, sign: 1 }, deadman: 0 }, 0.1)?.deadZone).toBe(0.1);
  });
});

describe("the dead zone", () => {
  it("is zero inside, rises steadily from its edge to full deflection, and is odd", () => {
    fc.assert(fc.property(fc.double({ min: -2, max: 2, noNaN: true }), fc.double({ min: 0.05, max: 0.5, noNaN: true }), (value, zone) => {
      const out = withoutDeadZone(value, zone);
      expect(Math.abs(out)).toBeLessThanOrEqual(1);
      expect(out + withoutDeadZone(-value, zone)).toBe(0);
      expect(out === 0).toBe(Math.abs(value) <= zone || out === 0);
      expect(withoutDeadZone(value * 0.9, zone) * Math.sign(value)).toBeLessThanOrEqual(out * Math.sign(value) || 0);
    }));
  });
});
