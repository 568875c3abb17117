import { describe, expect, it } from "vitest";
import { Inputs } from "../../src/xr/inputs";

const SPACE = {} as unknown as XRReferenceSpace;
const GRIP = {};
const RAY = {};
const HERE = { position: { x: 1, y: 1, z: 1 }, orientation: { x: 0, y: 0, z: 0, w: 1 } };

interface Given {
  readonly transform?: typeof HERE | undefined;
  readonly emulated?: boolean;
  readonly axes?: readonly number[];
  readonly hand?: object;
  readonly mapping?: string;
  readonly buttons?: number;
}

function inputs({ transform = HERE, emulated = false, axes = [0, 0, 0.3, -0.8], hand, mapping = "xr-standard", buttons = 2 }: Given, none = false): Inputs {
  const source = {
    handedness: "right", gripSpace: GRIP, targetRaySpace: RAY, hand, targetRayMode: "tracked-pointer", profiles: ["acme-wand"],
    gamepad: { mapping, axes, buttons: [{ pressed: false, value: 0.4 }, { pressed: true, value: 1 }].slice(0, buttons) },
  };
  const frame = {
    session: { inputSources: [source] },
    getPose: () => (none ? null : { transform, emulatedPosition: emulated }),
  };
  const made = new Inputs();
  made.update(frame as unknown as XRFrame, SPACE);
  return made;
}

describe("a controller", () => {
  it("is read by the mapping that all headsets share", () => {
    const { right, left } = inputs({});
    expect([right.present, right.tracked, left.present]).toEqual([true, true, false]);
    expect([right.axis(0), right.axis(1)]).toEqual([0.3, -0.8]);
    expect(right.trigger).toBe(0.4);
    expect(right.pressed(1)).toBe(true);
  });

  it("without a stick is read by its pad", () => {
    const { right } = inputs({ axes: [0.5, -0.25] });
    expect([right.axis(0), right.axis(1)]).toEqual([0.5, -0.25]);
  });

  it.each([
    ["lies on the table, all zero", { x: 0, y: 0, z: 0, w: 0 }], ["has a pose that is no number", { x: NaN, y: 0, z: 0, w: 1 }],
    ["has a rotation that is none", { x: 3, y: 0, z: 0, w: 1 }],
  ])("that %s holds nothing", (_, orientation) => {
    const { right } = inputs({ transform: { ...HERE, orientation } });
    expect([right.present, right.pressed(1), right.trigger, right.axis(0), right.axis(1)]).toEqual([false, false, 0, 0, 0]);
  });

  it("without a pose holds nothing, and one whose place is guessed is not tracked", () => {
    expect(inputs({}, true).right.pressed(1)).toBe(false);
    const guessed = inputs({ emulated: true }).right;
    expect([guessed.present, guessed.tracked]).toEqual([true, false]);
  });

  it.each([
    ["gives no common mapping", { mapping: "" }, "acme-wand"], ["has no grip", { buttons: 1 }, "acme-wand"], ["has no stick", { axes: [] }, "acme-wand"],
    ["is none, but a hand", { hand: {}, mapping: "" }, undefined], ["has all that drives", {}, undefined],
  ])("that %s is named if it cannot drive", (_, given, name) => {
    expect(inputs(given).right.unusable).toBe(name);
  });

  it("without the common mapping presses nothing", () => {
    const { right } = inputs({ mapping: "" });
    expect([right.pad, right.pressed(1), right.axis(1)]).toEqual([undefined, false, 0]);
  });

  it("is no empty hand: a pinch is no deadman", () => {
    const { right } = inputs({ hand: {} });
    expect([right.present, right.pressed(1), right.trigger]).toEqual([true, false, 0.4]);
  });
});
