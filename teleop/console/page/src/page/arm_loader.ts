/** Loads what moves an arm, once the robot turns out to have one: all others never fetch it. */

import { effect, signal, type ReadonlySignal } from "@preact/signals";
import type { Driving } from "../driving/driving";
import type { StepMotion } from "../driving/step_motion";
import type { RobotWire } from "../link/robot_wire";
import type { RobotState } from "../robot/robot_state";
import type { Scene } from "../scene/scene";
import type { SceneSettings } from "../scene/settings";
import { pageTexts as texts } from "../texts/page";
import type { Severity } from "../values";

type ArmModule = typeof import("../panels/arm");

/** The arm's part of the page. */
export interface LoadedArm {
  readonly arm: InstanceType<ArmModule["Arm"]>;
  readonly Panel: ArmModule["ArmPanel"];
}

interface LoaderParts {
  readonly wire: RobotWire;
  readonly state: RobotState;
  readonly scene: Scene;
  readonly settings: SceneSettings;
  readonly driving: Driving;
  readonly lean: ReadonlySignal<boolean>;
  readonly events: (severity: Severity, words: string) => void;
}

/** Return the arm's part, which is undefined until the robot has an arm and the part has been loaded. */
export function loadArm(parts: LoaderParts, load: () => Promise<ArmModule> = () => import("../panels/arm")): ReadonlySignal<LoadedArm | undefined> {
  const loaded = signal<LoadedArm | undefined>(undefined);
  let asked = false;
  effect(() => {
    if (parts.state.arm.value && !asked) {
      asked = true;
      load().then(({ Arm, ArmPanel }) => {
        const { wire, state, scene, settings, driving, lean } = parts;
        const arm = new Arm({
          wire, driving, lean, robot: state, workshop: scene.workshop, theme: settings.theme,
          environment: { window, document, now: () => performance.now(), wallNow: () => Date.now() },
        });
        viewAtArm(arm.chosen, settings);
        loaded.value = { arm, Panel: ArmPanel };
      }, () => {
        asked = false; // it is tried again when the robot comes back
        parts.events("warning", texts.armNotLoaded);
      });
    }
  });
  return loaded;
}

/** Look at the arm when it is chosen, and as before when the wheels are, unless the person has looked elsewhere since. */
function viewAtArm(chosen: ReadonlySignal<boolean>, { view }: SceneSettings): void {
  let before: SceneSettings["view"]["value"] | undefined;
  effect(() => {
    if (chosen.value) {
      before = view.peek();
      view.value = "arm";
    } else if (before !== undefined) {
      view.value = view.peek() === "arm" ? before : view.peek();
      before = undefined;
    }
  });
}

/** Return both motions as one. */
export function bothMotions(first: StepMotion, second: () => StepMotion | undefined): StepMotion {
  return {
    get moves() {
      return first.moves || second()?.moves === true;
    },
    stop: () => {
      first.stop();
      second()?.stop();
    },
  };
}
