/** What of the robot is in the picture. */

import { RobotLayer } from "../../src/scene/robot_layer";
import { describe, expect, test } from "./tools";

const POSE = { position: { x: 1, y: 2, z: 0 }, orientation: { x: 0, y: 0, z: 0, w: 1 } };
const ALL = { path: true, covariance: true, truth: true };

/** The truth is the last thing that is added to the picture. */
const truthIsShown = (layer: RobotLayer): boolean => layer.object.children.at(-1)?.visible === true;

describe("the outline of the true pose", () => {
  test("stays hidden, as in the view with the robot's eyes, also when a new true pose comes", () => {
    const layer = new RobotLayer();
    layer.show(ALL, true);
    layer.setTruth(POSE);
    expect(truthIsShown(layer)).toBe(true);
    layer.show(ALL, false);
    layer.setTruth(POSE);
    expect(truthIsShown(layer)).toBe(false);
    layer.show({ ...ALL, truth: false }, true);
    layer.setTruth(POSE);
    expect(truthIsShown(layer)).toBe(false);
    layer.show(ALL, true);
    expect(truthIsShown(layer)).toBe(true);
    layer.setTruth(undefined);
    expect(truthIsShown(layer)).toBe(false);
  });
});
