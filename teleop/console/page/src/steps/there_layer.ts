/** The way to the place that was chosen, on the floor, with a ring about the place. */

import { effect } from "@preact/signals";
import { circle } from "../scene/outline";
import { COLOURS } from "../scene/palette";
import type { SceneSettings } from "../scene/settings";
import { WideLine } from "../scene/wide_line";
import type { Workshop } from "../scene/workshop";
import type { RobotState } from "../robot/robot_state";
import type { DriveThere } from "./drive_there";

/** Height of the lines over the robot's floor [m], and the ring's radius [m]. */
const LIFT = 0.05;
const RING = 0.3;

/** Draw the way for as long as there is one. */
export function drawWay(there: DriveThere, state: RobotState, workshop: Workshop, theme: SceneSettings["theme"]): void {
  const line = new WideLine(2000, { width: 3, overlaid: true });
  workshop.world.add(line.object);
  effect(() => {
    line.setColour(COLOURS[theme.value].hypothesis);
    workshop.draw();
  });
  effect(() => {
    const [way, target] = [there.way.value, there.target.value];
    const z = (state.mapFromBase.peek()?.position.z ?? 0) + LIFT;
    const ring = target === undefined ? [] : circle(RING, z).map((value, index) => value + (index % 3 === 0 ? target.x : index % 3 === 1 ? target.y : 0));
    line.set([way.flatMap(({ x, y }) => [x, y, z]), ring]);
    workshop.draw();
  });
}
