/** The hand that a mouse fills, and velocities of the tip. */

import fc from "fast-check";
import { expect, it } from "vitest";
import { LedHand } from "../../../src/arm/inputs/hand";
import { jointTowards, tipWish, TIP_AT_REST } from "../../../src/arm/inputs/tip_motion";
import { readArmInfo } from "../../../src/link/message_checks/arm_messages";
import { Field } from "../../../src/link/message_checks/field";
import type { Pose } from "../../../src/values";
import { INFO } from "../arm_bench";

const at = (x: number, angle = 0): Pose => ({
  position: { x, y: 0, z: 0 }, orientation: { x: 0, y: 0, z: Math.sin(angle / 2), w: Math.cos(angle / 2) },
});

it("follows a place no faster than a careful person, and arrives", () => {
  fc.assert(fc.property(fc.double({ min: -2, max: 2, noNaN: true }), fc.array(fc.integer({ min: 1, max: 300 }), { minLength: 1 }), (goal, steps) => {
    const hand = new LedHand();
    hand.begin(at(0), 0);
    let [now, before] = [0, 0];
    for (const step of steps) {
      now += step;
      const { x } = hand.follow(at(goal), now).position;
      expect(Math.abs(x - before)).toBeLessThanOrEqual(0.25 * Math.min(step, 80) / 1000 + 1e-9);
      before = x;
    }
  }));
  const hand = new LedHand();
  hand.begin(at(0), 0);
  for (let now = 20; now < 3000; now += 20) { hand.follow(at(0.1, 1), now); }
  const { position, orientation } = hand.follow(at(0.1, 1), 3000);
  expect(position.x).toBeCloseTo(0.1, 6);
  expect(orientation.z).toBeCloseTo(Math.sin(0.5), 6);
});

it("stays where it is over a pause, since the robot does not catch up over one", () => {
  const hand = new LedHand();
  hand.begin(at(0), 0);
  hand.follow(at(1), 20);
  expect(hand.follow(at(1), 500).position.x).toBeCloseTo(0.005, 9);
});

it("moves the tip as the picture is looked at, or along the axes of arm or gripper", () => {
  const ahead = { ...TIP_AT_REST, ahead: 1 };
  expect(tipWish(ahead, "base", 1, "normal")).toMatchObject({ frame: "arm_base", linear: { x: 0.08, y: 0 } });
  expect(tipWish(ahead, "tool", 1, "precision")).toMatchObject({ frame: "tool0", linear: { x: 0.02, y: 0 } });
  const view = tipWish(ahead, "view", Math.PI / 2, "normal");
  expect(view.kind === "twist" ? [view.frame, view.linear.x.toFixed(3), view.linear.y.toFixed(3)] : []).toEqual(["arm_base", "0.000", "0.080"]);
});

it("brings a joint to an angle, slower as it comes near, and rests there", () => {
  const info = readArmInfo(new Field(INFO, ""));
  const rate = (wanted: number): unknown => jointTowards(info, 1, wanted, 0, "normal");
  expect(rate(2)).toMatchObject({ names: ["arm_joint_1", "arm_joint_2"], rates: [0, 0.5] });
  expect(rate(-0.06)).toMatchObject({ rates: [0, -0.25] });
  expect(rate(0.003)).toMatchObject({ rates: [0, 0] });
});
