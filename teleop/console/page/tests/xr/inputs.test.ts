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
  readonly profiles?: readonly string[];
  /** Places of the buttons that are pressed, and how many there are. */
  readonly pressed?: readonly number[];
  readonly buttons?: number;
}

function inputs(
  { transform = HERE, emulated = false, axes = [0, 0, 0.3, -0.8], hand, mapping = "xr-standard", profiles = ["acme-wand"], pressed = [1], buttons = 2 }: Given,
  none = false,
): Inputs {
  const source = {
    handedness: "right", gripSpace: GRIP, targetRaySpace: RAY, hand, targetRayMode: "tracked-pointer", profiles,
    gamepad: { mapping, axes, buttons: Array.from({ length: buttons }, (_, at) => ({ pressed: pressed.includes(at), value: at === 0 ? 0.4 : 0 })) },
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
    expect(right.pressed("squeeze")).toBe(true);
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
    expect([right.present, right.pressed("squeeze"), right.trigger, right.axis(0), right.axis(1)]).toEqual([false, false, 0, 0, 0]);
  });

  it("without a pose holds nothing, and one whose place is guessed is not tracked", () => {
    expect(inputs({}, true).right.pressed("squeeze")).toBe(false);
    const guessed = inputs({ emulated: true }).right;
    expect([guessed.present, guessed.tracked]).toEqual([true, false]);
  });

  it("whose pad lies before a stick that it lacks is driven by the pad, as its profile says", () => {
    const vive = { profiles: ["htc-vive", "generic-trigger-squeeze-touchpad"], axes: [0.5, -0.25, 0, 0], buttons: 4 };
    const { right } = inputs(vive);
    expect([right.axis(0), right.axis(1), right.pressed("squeeze"), right.unusable]).toEqual([0.5, -0.25, true, undefined]);
  });

  it("whose profile is known is read by it, also where the browser gives no common mapping", () => {
    const { right } = inputs({ mapping: "", profiles: ["meta-quest-touch-plus", "generic-trigger-squeeze-thumbstick"], buttons: 7, pressed: [1, 5] });
    expect([right.pressed("squeeze"), right.pressed("upper"), right.pressed("lower"), right.axis(1), right.unusable]).toEqual([true, true, false, -0.8, undefined]);
  });

  it("of an unknown model is read by the general profile that the browser names", () => {
    const { right } = inputs({ mapping: "", profiles: ["acme-wand", "generic-trigger-squeeze-touchpad"], axes: [0.1, 0.2] });
    expect([right.pressed("squeeze"), right.axis(0), right.axis(1), right.unusable]).toEqual([true, 0.1, 0.2, undefined]);
  });

  it("takes no other sensor for a button: the pressed tip of a pen is no emergency stop", () => {
    const { right } = inputs({ profiles: ["logitech-mx-ink", "generic-trigger"], axes: [], buttons: 7, pressed: [4, 5] });
    expect([right.pressed("lower"), right.pressed("upper"), right.unusable]).toEqual([false, false, "logitech-mx-ink"]);
  });

  it.each([
    ["gives no common mapping", { mapping: "" }, "acme-wand"], ["has no grip", { buttons: 1 }, "acme-wand"], ["has no stick", { axes: [] }, "acme-wand"],
    ["is known to have no grip", { profiles: ["oculus-go", "generic-trigger-touchpad"], buttons: 4 }, "oculus-go"], ["has the name of no profile", { mapping: "", profiles: ["constructor"] }, "constructor"],
   
    ["is none, but a hand", { hand: {}, mapping: "" }, undefined], ["has all that drives", {}, undefined],
  ])("that %s is named if it cannot drive", (_, given, name) => {
    expect(inputs(given).right.unusable).toBe(name);
  });

  it("without the common mapping presses nothing", () => {
    const { right } = inputs({ mapping: "" });
    expect([right.pad, right.pressed("squeeze"), right.axis(1)]).toEqual([undefined, false, 0]);
  });

  it("is no empty hand: a pinch is no deadman", () => {
    const { right } = inputs({ hand: {} });
    expect([right.present, right.pressed("squeeze"), right.trigger]).toEqual([true, false, 0.4]);
  });
});
