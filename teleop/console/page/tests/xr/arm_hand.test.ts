import { beforeEach, expect, it, vi } from "vitest";
import type { Arm } from "../../src/arm/arm";
import { ArmHand } from "../../src/xr/arm_hand";
import { Side } from "../../src/xr/inputs";

const pulse = vi.fn(() => Promise.resolve(true));
const hold = { begin: vi.fn(() => true), end: vi.fn() };
const arm = { hold } as unknown as Arm;
let hand: ArmHand;
let side: Side;

/** A frame in which the grip is held or not, and the controller there or gone. */
function frame(held: boolean, there = true): void {
  const buttons = Array.from({ length: 6 }, (_, at) => ({ pressed: held && at === 1, value: 0 }));
  side.become({ handedness: "left", profiles: ["acme-wand"], gamepad: { mapping: "xr-standard", axes: [0, 0, 0, 0], buttons, hapticActuators: [{ pulse }] } } as unknown as XRInputSource);
  side.present = there;
  hand.frame(side, arm);
}

beforeEach(() => {
  hold.begin.mockReturnValue(true);
  [hand, side] = [new ArmHand(), new Side("left")];
  frame(false);
  vi.clearAllMocks();
});

it("leads the arm while its grip is held", () => {
  frame(true);
  frame(true);
  expect(hold.begin).toHaveBeenCalledTimes(1);
  expect(hand.closed).toBe(true);
  frame(false);
  expect(hold.end).toHaveBeenCalledTimes(1);
});

it("that is gone ends it, and opens the grip before it leads again", () => {
  frame(true);
  frame(true, false);
  expect(hold.end).toHaveBeenCalledWith("headset");
  expect(hand.closed).toBe(false);
  frame(true);
  frame(true);
  expect(hold.begin).toHaveBeenCalledTimes(1);
  frame(false);
  frame(true);
  expect(hold.begin).toHaveBeenCalledTimes(2);
});

it("feels a refusal, and what the robot tells of contacts and limits, at no more than full strength", () => {
  hold.begin.mockReturnValue(false);
  frame(true);
  expect(pulse.mock.lastCall).toEqual([0.8, 60]);
  hand.feel(0.4);
  hand.feel(3);
  expect(pulse.mock.calls.slice(1)).toEqual([[0.4, 120], [1, 120]]);
});
