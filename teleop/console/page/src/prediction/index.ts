/** Where the robot will go, in the picture. */

import { effect, type ReadonlySignal } from "@preact/signals";
import type { Driving } from "../driving/driving";
import type { LinkStatisticsSignal, RobotState } from "../robot/robot_state";
import { COLOURS } from "../scene/palette";
import { worldFromBase } from "../scene/located";
import type { Scene } from "../scene/scene";
import type { SceneSettings } from "../scene/settings";
import type { Foresight } from "./foresight";
import { PathLayer } from "./path_layer";
import { prediction } from "./prediction";

interface PathParts {
  readonly scene: Scene;
  readonly state: RobotState;
  readonly driving: Driving;
  readonly statistics: LinkStatisticsSignal;
  readonly settings: SceneSettings;
}

/** Draw where the robot will go, on the screen and in a headset; returns what is drawn. */
export function drawPathAhead({ scene, state, driving, statistics, settings }: PathParts): ReadonlySignal<Foresight | undefined> {
  const { workshop } = scene;
  const layer = new PathLayer();
  workshop.world.add(layer.object);
  const shown = prediction({ state, statistics, sending: driving.sending, when: settings.pathAhead, now: () => driving.now() });
  effect(() => {
    layer.setColours(COLOURS[settings.theme.value]);
    workshop.draw();
  });
  effect(() => {
    const [path, pose] = [shown.value, worldFromBase(state)];
    if (path === undefined || pose === undefined) {
      layer.clear();
    } else {
      layer.set(path, pose, scene.body);
    }
    workshop.draw();
  });
  return shown;
}
