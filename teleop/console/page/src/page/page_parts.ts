/** The long-lived parts of the page, made once and joined: link, picture, driving, hint, alarms, events. */

import { effect, signal, type ReadonlySignal } from "@preact/signals";
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
import type { RobotWire } from "../link/robot_wire";
import { closeTopDialog } from "../panels/dialog";
import { EventLog } from "../panels/events/event_log";
import { Sharing } from "../panels/session/sharing";
import { drawPathAhead } from "../prediction";
import type { Foresight } from "../prediction/foresight";
import type { RobotCommands } from "../robot/robot_commands";
import { Runs } from "../runs/runs";
import { unknownState, type LinkStatisticsSignal, type RobotState } from "../robot/robot_state";
import { browserKeeper, remembered, rememberedSwitch } from "../scene/stored_signals";
import { Scene } from "../scene/scene";
import { sceneSettings, type SceneSettings } from "../scene/settings";
import { friendlyName, validName } from "../session/person_name";
import { keepToken, takeToken, type TokenPlaces } from "../session/token";
import { DriveThere } from "../steps/drive_there";
import { StepControl } from "../steps/step_control";
import { drawWay } from "../steps/there_layer";
import { bothMotions, loadArm, type LoadedArm } from "./arm_loader";
import { loadHeadset, type HeadsetPart } from "./headset_loader";
import { openDropped, replayLoader, type Replay } from "./replay_loader";
import { asksForWall, loadWall, type WallPart } from "./wall_loader";
import { viewHintsFromAbove } from "./hint_view";
import { keepAwake, rememberedGear, thumbsOnly } from "./hands";
import { watchSurroundings } from "./surroundings";
import { watchAges, type LayerAges } from "./layer_ages";
import { takeOwnToken } from "./own_token";

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
  readonly there: DriveThere;
  /** What moves the arm, once it has been loaded for a robot that has one. */
  readonly arm: ReadonlySignal<LoadedArm | undefined>;
  /** The headset, once there is one. */
  readonly headset: HeadsetPart;
  readonly wall: WallPart;
  /** Where the robot will go, as it is drawn; undefined while it is not. */
  readonly way: ReadonlySignal<Foresight | undefined>;
  readonly camera: CameraFeed;
  readonly photo: PhotoControl;
  readonly alarms: Alarms;
  readonly events: EventLog;
  /** How old each layer of the picture is. */
  readonly ages: ReadonlySignal<LayerAges>;
  readonly lean: ReadonlySignal<boolean>;
  readonly setLean: (lean: boolean) => void;
  /** The person's name, which this browser keeps. */
  readonly name: ReadonlySignal<string>;
  readonly rename: (name: string) => void;
  readonly sharing: Sharing;
  /** The robot by the names of its services. */
  readonly wire: RobotWire;
  /** Log in with a token, which this tab keeps. */
  readonly logIn: (token: string) => void;
  /** Forget the token, and begin anew without one. */
  readonly logOut: () => void;
}

const PLACES: TokenPlaces = { location, history, storage: () => sessionStorage, lasting: () => localStorage };

/** Make all parts and connect to the robot. */
export function startParts(address: string, version: string, canvas: HTMLCanvasElement): PageParts {
  const state = unknownState();
  const events = new EventLog();
  const settings = sceneSettings();
  const lean = rememberedSwitch("farsteer.lean", false, browserKeeper());
  const token = takeToken(PLACES);
  const name = remembered("farsteer.name", "", validName, browserKeeper());
  name.value ||= friendlyName();
  const options = { ...(token === "" ? {} : { token }), lean: lean.peek(), name: () => name.peek(), pictures: !asksForWall(location.search) };
  const link = new RobotLink(address, options, state, events.add);
  const { commands } = link;
  effect(() => {
    if (settings.layers.value.map) {
      link.wantPoints();
    }
  });
  const scene = new Scene(canvas, state, settings);
  const driving = new Driving(commands, state, {
    window, document, navigator, now: () => performance.now(), gear: rememberedGear(), thumbs: thumbsOnly(),
  });
  scene.givesWay = () => driving.held;
  const hint = new HintTool(canvas, scene, commands, state);
  const guideClosed = rememberedSwitch("farsteer.guide-closed", false, browserKeeper());
  const guide = new FirstDrive(state, new Carrier(link.wire, state), guideClosed);
  const steps = new StepControl(commands);
  steps.stopWhenHidden(document);
  const there = new DriveThere({
    surface: canvas, state, steps, join: (source) => driving.join(source, false), floorPoint: (x, y) => scene.floorPoint(x, y),
    holdView: (held) => {
      if (!hint.placing) {
        scene.setInteraction(held ? "hint" : "camera");
      }
    },
  });
  drawWay(there, state, scene.workshop, settings.theme);
  const arm = loadArm({ wire: link.wire, state, scene, settings, driving, lean, events: events.add });
  driving.steps = bothMotions(steps, () => arm.peek()?.arm);
  const robot = httpAddress(address);
  const camera = new CameraFeed(state, {
    fetch: (url, init) => fetch(url, init), now: () => performance.now(), document, keeper: browserKeeper(),
    page: location.href, robot, token: () => takeToken(PLACES), lateness: () => link.statistics.peek().pageLag,
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
  effect(() => { there.choosing.value &&= hint.view.value.phase !== "placing"; });
  viewHintsFromAbove(hint.view, settings.view);
  effect(() => { camera.large.value = camera.large.peek() && hint.view.value.phase !== "placing"; });
  const wall = loadWall(location.search, {
    immersion: scene.immersion, state, wire: link.wire, events: events.add,
  }, document.documentElement);
  // A wall shows, and moves nothing: what a robot does, and why not, is told elsewhere.
  effect(() => { if (wall.shown.value !== undefined) { driving.dispose(); } });
  effect(() => { driving.keysElsewhere.value = hint.view.value.phase === "placing" || arm.value?.arm.chosen.value === true; });
  effect(() => { document.documentElement.dataset["theme"] = settings.theme.value; });
  const alarms = new Alarms(
    state, link.statistics,
    (alarm, ended) => { events.alarm(alarm, ended); },
    browserAlarmEnvironment(),
  );
  const way = drawPathAhead({ scene, state, driving, statistics: link.statistics, settings });
  const ages = watchAges(state, link.statistics, scene);
  const headset = loadHeadset(navigator.xr, {
    immersion: scene.immersion, state, statistics: link.statistics, driving, steps, there, hint, camera, photo, alarms, arm,
    theme: settings.theme, now: () => performance.now(), events: events.add,
  });
  watchSurroundings(state, () => scene.body);
  keepAwake(state, navigator, document);
  takeOwnToken(link.wire, state, () => name.peek(), (own) => { keepToken(PLACES, own, "lasting"); commands.authenticate(own); });
  link.start();
  return {
    address, version, state, commands, statistics: link.statistics, scene, settings, driving, hint, guide, runs, replay, steps, there, arm, camera, photo,
    alarms, headset, wall, way, events, lean, ages, wire: link.wire, name, sharing: new Sharing(link.wire),
    rename: (wanted) => { name.value = wanted; commands.authenticate(takeToken(PLACES)); },
    setLean: (wanted) => { lean.value = wanted; link.setLean(wanted); },
    logIn: (given) => { keepToken(PLACES, given); commands.authenticate(given); },
    logOut: () => { keepToken(PLACES, ""); location.reload(); },
  };
}

/** Whether the browser withholds what it gives to safe pages only: gamepads, clipboard, digests. */
export const insecure = signal(!window.isSecureContext);
