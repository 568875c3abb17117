/** Loads what shows a recorded run, once somebody opens one, and puts the run in the place of the robot. */

import { signal, type ReadonlySignal } from "@preact/signals";
import type { Scene } from "../scene/scene";
import type { SceneSettings } from "../scene/settings";
import type { RobotState } from "../robot/robot_state";
import { pageTexts as texts } from "../texts/page";
import type { Severity } from "../values";

type ReplayModule = typeof import("../panels/replay");

export interface LoadedRun {
  readonly player: InstanceType<ReplayModule["Player"]>;
  readonly moments: ReturnType<ReplayModule["qualityOf"]>;
  readonly Bar: ReplayModule["ReplayBar"];
}

interface LoaderParts {
  readonly state: RobotState;
  readonly scene: Scene;
  readonly settings: SceneSettings;
  readonly events: (severity: Severity, words: string) => void;
  /** End the link to the robot: its watchdog stops it. */
  readonly leave: () => void;
}

/** What looks at runs. */
export interface Replay {
  /** The run that is shown in the place of the robot; undefined while the robot is. */
  readonly shown: ReadonlySignal<LoadedRun | undefined>;
  /** Show a run; what is no run is said in the events, and changes nothing. */
  readonly open: (file: File) => Promise<void>;
}

export function replayLoader(parts: LoaderParts, load: () => Promise<ReplayModule> = () => import("../panels/replay")): Replay {
  const { state, scene, settings, events } = parts;
  const shown = signal<LoadedRun | undefined>(undefined);
  let line: { removeFromParent(): void } | undefined;
  const open = async (file: File): Promise<void> => {
    try {
      const { Player, readRun, qualityOf, qualityPath, ReplayBar } = await load();
      const run = readRun(file.name, new Uint8Array(await file.arrayBuffer()));
      shown.peek()?.player.stop();
      line?.removeFromParent();
      parts.leave();
      const moments = qualityOf(run);
      const path = qualityPath(moments, settings.theme.peek());
      scene.workshop.world.add(path);
      line = path;
      shown.value = { player: new Player(run, state, events), moments, Bar: ReplayBar };
      scene.workshop.draw();
    } catch (error) {
      events("warning", error instanceof Error ? error.message : texts.replayNotLoaded);
    }
  };
  return { shown, open };
}

/** Open a run that is dropped on the page. */
export function openDropped(page: Document, open: (file: File) => Promise<void>): void {
  page.addEventListener("dragover", (event) => { event.preventDefault(); });
  page.addEventListener("drop", (event) => {
    event.preventDefault();
    const file = event.dataTransfer?.files[0];
    if (file !== undefined) {
      void open(file);
    }
  });
}
