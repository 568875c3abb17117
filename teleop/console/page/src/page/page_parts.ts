/** The long-lived parts of the page, made once and joined: link, picture, driving, hint, alarms, events. */

import { effect, signal, type ReadonlySignal, type Signal } from "@preact/signals";
import { Alarms } from "../alarms/alarms";
import { browserAlarmEnvironment } from "../alarms/browser_environment";
import { CameraFeed } from "../camera/camera_feed";
import { PhotoControl } from "../camera/photo_control";
import { Driving } from "../driving/driving";
import { Carrier } from "../guide/carrier";
import { FirstDrive } from "../guide/first_drive";
import { HintTool } from "../hint/hint_tool";
import { httpAddress } from "../link/diagnosis";
import { RobotLink } from "../link/robot_link";
import { closeTopDialog } from "../panels/dialog";
import { EventLog } from "../panels/events/event_log";
import type { RobotCommands } from "../robot/robot_commands";
import { Runs } from "../runs/runs";
import { unknownState, type LinkStatisticsSignal, type RobotState } from "../robot/robot_state";
import { browserKeeper, remembered } from "../scene/stored_signals";
import { Scene } from "../scene/scene";
import { sceneSettings, type SceneSettings } from "../scene/settings";
import { keepToken, takeToken, type TokenPlaces } from "../session/token";
import { StepControl } from "../steps/step_control";
import { alarmTexts } from "../texts/alarms";
import { bothMotions, loadArm, type LoadedArm } from "./arm_loader";
import { openDropped, replayLoader, type Replay } from "./replay_loader";
import { viewHintsFromAbove } from "./hint_view";
import { watchSurroundings } from "./surroundings";
import { watchStaleness } from "./stale_picture";

/** What the components show and use. */
export interface PageParts {
  readonly address: string;
  readonly version: string;
  readonly state: RobotState;
  readonly commands: RobotCommands;
  readonly statistics: LinkStatisticsSignal;
  readonly scene: Scene;
  readonly settings: SceneSettings;
  readonly driving: Driving;
  readonly hint: HintTool;
  readonly guide: FirstDrive;
  readonly runs: Runs;
  readonly replay: Replay;
  readonly steps: StepControl;
  /** What moves the arm, once it has been loaded for a robot that has one. */
  readonly arm: ReadonlySignal<LoadedArm | undefined>;
  readonly camera: CameraFeed;
  readonly photo: PhotoControl;
  readonly alarms: Alarms;
  readonly events: EventLog;
  readonly lean: ReadonlySignal<boolean>;
  readonly setLean: (lean: boolean) => void;
  /** Log in with a token, which this tab keeps. */
  readonly logIn: (token: string) => void;
  /** Forget the token, and begin anew without one. */
  readonly logOut: () => void;
}

const PLACES: TokenPlaces = { location, history, storage: () => sessionStorage };

/** Make all parts and connect to the robot. */
export function startParts(address: string, version: string, canvas: HTMLCanvasElement): PageParts {
  const state = unknownState();
  const events = new EventLog();
  const settings = sceneSettings();
  const lean: Signal<boolean> = remembered(
    "farsteer.lean", false, (kept) => (typeof kept === "boolean" ? kept : undefined), browserKeeper(),
  );
  const token = takeToken(PLACES);
  const link = new RobotLink(address, { ...(token === "" ? {} : { token }), lean: lean.peek() }, state, events.add);
  const { commands } = link;
  effect(() => {
    if (settings.layers.value.map) {
      link.wantPoints();
    }
  });
  const scene = new Scene(canvas, state, settings);
  const driving = new Driving(commands, state, { window, document, navigator, now: () => performance.now() });
  const hint = new HintTool(canvas, scene, commands, state);
  const guide = new FirstDrive(state, new Carrier(link.wire, state), remembered(
    "farsteer.guide-closed", false, (kept) => (typeof kept === "boolean" ? kept : undefined), browserKeeper(),
  ));
  const steps = new StepControl(commands);
  steps.stopWhenHidden(document);
  const arm = loadArm({ wire: link.wire, state, scene, settings, driving, lean, events: events.add });
  driving.steps = bothMotions(steps, () => arm.peek()?.arm);
  const robot = httpAddress(address);
  const camera = new CameraFeed(state, {
    fetch: (url, init) => fetch(url, init), now: () => performance.now(), document, keeper: browserKeeper(),
    page: location.href, robot, token: () => takeToken(PLACES),
  });
  const runs = new Runs({
    wire: link.wire, state, robot, token: () => takeToken(PLACES), fetch: (url, init) => fetch(url, init), events: events.add,
  });
  const replay = replayLoader({
    state, scene, settings, events: events.add, leave: () => { driving.stop(); link.stop(); },
  });
  openDropped(document, (file) => replay.open(file));
  const photo = new PhotoControl(commands, robot);
  driving.onEscape = () => closeTopDialog() || hint.escape();
  canvas.addEventListener("click", ({ clientX, clientY }) => {
    const number = hint.placing ? undefined : scene.hypothesisAt(clientX, clientY);
    const candidate = number === undefined ? undefined : state.candidates.peek()[number];
    if (candidate !== undefined && state.session.peek()?.mayHint !== false) {
      hint.pick(candidate);
    }
  });
  viewHintsFromAbove(hint.view, settings.view);
  effect(() => { driving.keysElsewhere.value = hint.view.value.phase === "placing" || arm.value?.arm.chosen.value === true; });
  effect(() => { document.documentElement.dataset["theme"] = settings.theme.value; });
  const alarms = new Alarms(
    state, link.statistics,
    (alarm, ended) => { events.add(ended ? "info" : alarm.severity, ended ? alarmTexts.over(alarm.words) : alarm.words); },
    browserAlarmEnvironment(),
  );
  watchStaleness(state, scene.stale);
  watchSurroundings(state, () => scene.body);
  link.start();
  return {
    address, version, state, commands, statistics: link.statistics, scene, settings, driving, hint, guide, runs, replay, steps, arm, camera, photo, alarms,
    events, lean,
    setLean: (wanted) => { lean.value = wanted; link.setLean(wanted); },
    logIn: (given) => { keepToken(PLACES, given); commands.authenticate(given); },
    logOut: () => { keepToken(PLACES, ""); location.reload(); },
  };
}

/** Whether the browser withholds what it gives to safe pages only: gamepads, clipboard, digests. */
export const insecure = signal(!window.isSecureContext);
