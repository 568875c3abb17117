/** The board of keys: for all hands, also those that hold nothing. */

import type { ReadonlySignal, Signal } from "@preact/signals";
import type { CameraFeed } from "../camera/camera_feed";
import type { PhotoControl } from "../camera/photo_control";
import type { Driving } from "../driving/driving";
import { canConfirm } from "../hint/hint_reducer";
import type { HintTool } from "../hint/hint_tool";
import type { Gear } from "../operating_data";
import type { RobotState } from "../robot/robot_state";
import type { DriveThere } from "../steps/drive_there";
import type { StepControl } from "../steps/step_control";
import { ANGLE, DIRECTIONS, DISTANCE, stepGoal } from "../steps/step_size";
import { stepWords } from "../steps/step_words";
import { cameraTexts } from "../texts/camera";
import { drivingTexts } from "../texts/driving";
import { hintTexts } from "../texts/hint";
import { stepTexts } from "../texts/steps";
import { xrTexts as texts } from "../texts/xr";
import type { Key, Row } from "./board";
import { CHOICES, nextChoice, type ComfortSettings } from "./comfort";
import { STANDS, type Stand } from "./place";

/** Sizes of the steps: numbers of the presets. */
export interface StepSizes {
  readonly distance: number;
  readonly angle: number;
}

export interface ControlParts {
  readonly state: RobotState;
  readonly driving: Driving;
  readonly steps: StepControl;
  readonly there: DriveThere;
  readonly hint: HintTool;
  readonly camera: CameraFeed;
  readonly photo: PhotoControl;
  readonly comfort: Signal<ComfortSettings>;
  readonly sizes: Signal<StepSizes>;
  readonly stand: Signal<Stand>;
  /** The hand that drives. */
  readonly hand: Signal<"left" | "right">;
  /** Whether it holds a controller. */
  readonly controller: ReadonlySignal<boolean>;
  /** Name of its controller, if that cannot drive. */
  readonly unusable: ReadonlySignal<string | undefined>;
  readonly turn: (sense: 1 | -1) => void;
  readonly leave: () => void;
}

/** Return the rows of the board; read in an effect, they are shown anew when anything of them changes. */
export function controlRows(parts: ControlParts): Row[] {
  const { hand, stand } = parts;
  const other = hand.value === "right" ? "left" : "right";
  const unusable = parts.unusable.value;
  return [
    ...(unusable === undefined ? [] : [{ words: texts.unusable(unusable), bad: true }]),
    { keys: STANDS.map((each) => ({ label: texts.stands[each], on: stand.value === each, press: () => { stand.value = each; } })) },
    {
      keys: [
        { label: texts.turn.left, press: () => { parts.turn(1); } },
        { label: texts.turn.right, press: () => { parts.turn(-1); } },
        { label: texts.hands[hand.value], press: () => { hand.value = other; } },
      ],
    },
    { keys: (["precision", "normal", "turbo"] as const).map((gear) => gearKey(parts.driving, gear)) },
    ...stepRows(parts),
    ...thereRows(parts),
    { keys: cameraKeys(parts) },
    ...hintRows(parts.hint, parts.state),
    { keys: comfortKeys(parts.comfort) },
    { keys: lastKeys(parts) },
  ];
}

function gearKey({ gear }: Driving, each: Gear): Key {
  return { label: drivingTexts.gear(each), on: gear.value === each, press: () => { gear.value = each; } };
}

function stepRows({ state, driving, steps, sizes }: ControlParts): Row[] {
  if (state.dialect.value !== "farsteer" || state.session.value?.mayDrive === false) {
    return [];
  }
  const { distance, angle } = sizes.value;
  const [metres, degrees] = [DISTANCE.presets[distance] ?? DISTANCE.initial, ANGLE.presets[angle] ?? ANGLE.initial];
  const to = (next: Partial<StepSizes>): void => { sizes.value = { ...sizes.peek(), ...next }; };
  const last = DISTANCE.presets.length - 1;
  return [
    { words: texts.steps(metres, degrees) },
    {
      keys: [
        { label: texts.shorter, press: () => { to({ distance: Math.max(0, distance - 1) }); } },
        { label: texts.longer, press: () => { to({ distance: Math.min(last, distance + 1) }); } },
        { label: texts.smaller, press: () => { to({ angle: Math.max(0, angle - 1) }); } },
        { label: texts.larger, press: () => { to({ angle: Math.min(last, angle + 1) }); } },
      ],
    },
    {
      keys: DIRECTIONS.map((direction) => ({
        label: texts.arrows[direction],
        press: () => {
          if (driving.status.peek().blocked === undefined) {
            steps.ask(stepGoal(direction, direction === "forward" || direction === "back" ? metres : degrees, "own"));
          }
        },
      })),
    },
  ];
}

function thereRows({ state, driving, steps, there, hint, controller }: ControlParts): Row[] {
  const may = state.dialect.value === "farsteer" && state.session.value?.mayDrive !== false;
  if (!may || !controller.value || hint.view.value.phase === "placing") {
    return [];
  }
  const choosing = there.choosing.value;
  const why = choosing ? there.refusal(driving.status.value) : undefined;
  return [
    ...(choosing ? [{ words: why ?? stepWords(steps.present.value, steps.last.value) }] : []),
    {
      keys: [
        { label: stepTexts.there, on: choosing, press: () => { there.choosing.value = !choosing; } },
        ...(choosing && why === undefined
          ? [{ label: stepTexts.thereHold, press: () => { there.hold(); }, release: () => { there.letGo(); } }] : []),
      ],
    },
  ];
}

function cameraKeys({ camera, photo }: ControlParts): Key[] {
  const names = ["", ...camera.streams.value.filter(({ path }) => path !== undefined).map(({ name }) => name)];
  const [present, answer] = [camera.chosen.value?.name ?? "", photo.answer.value];
  const said = answer === undefined ? texts.photo : answer.success ? `${cameraTexts.stored} ${answer.name}` : cameraTexts.noPhoto(answer.message);
  return names.length === 1 ? [] : [
    { label: texts.stream(present), press: () => { camera.choice.value = names[(names.indexOf(present) + 1) % names.length] ?? ""; } },
    { label: photo.busy.value ? cameraTexts.taking : said, press: () => { void photo.take(); } },
  ];
}

function hintRows(hint: HintTool, state: RobotState): Row[] {
  if (state.session.value?.mayHint === false) {
    return [];
  }
  const at = hint.view.value;
  if (at.phase !== "placing") {
    const { result } = at;
    const said = result?.kind === "verdict" ? [{ words: hintTexts.verdict(result.verdict) }] : [];
    return [
      ...said,
      { keys: [{ label: hintTexts.begin, press: () => { hint.begin(); } }, { label: hintTexts.undo, press: () => { void hint.undo(); } }] },
    ];
  }
  const words = at.preview !== undefined ? hintTexts.preview(at.preview.explained, at.preview.present)
    : at.headingKnown ? hintTexts.ready : at.pose === undefined ? hintTexts.press : hintTexts.heading;
  return [
    { words },
    {
      keys: [
        ...(canConfirm(at) ? [{ label: hintTexts.confirm, on: true, press: () => { hint.confirm(); } }] : []),
        { label: hintTexts.cancel, press: () => { hint.cancel(); } },
      ],
    },
  ];
}

function comfortKeys(comfort: Signal<ComfortSettings>): Key[] {
  const now = comfort.value;
  const to = (next: Partial<ComfortSettings>): (() => void) => () => { comfort.value = { ...now, ...next }; };
  const words = texts.comfort;
  return [
    { label: words.vignette(now.vignette), press: to({ vignette: nextChoice(CHOICES.vignette, now.vignette) }) },
    { label: words.turning(now.turning), press: to({ turning: nextChoice(CHOICES.turning, now.turning) }) },
    { label: words.horizon(now.tilts), press: to({ tilts: !now.tilts }) },
    { label: words.heading(now.turns), press: to({ turns: !now.turns }) },
    { label: words.cap(now.cap), press: to({ cap: nextChoice(CHOICES.cap, now.cap) }) },
  ];
}

function lastKeys({ driving, state, leave }: ControlParts): Key[] {
  const { estop, turns } = driving;
  const latched = state.control.value?.estop === true;
  const release = estop.resetAsked.value
    ? [
      { label: drivingTexts.releaseYes, bad: true, press: () => { void estop.confirmReset(); } },
      { label: drivingTexts.releaseNo, press: () => { estop.cancelReset(); } },
    ]
    : [{ label: drivingTexts.release, press: () => { estop.askReset(); } }];
  const others = turns.turns.value.mayTakeOver && turns.turns.value.driver === "other"
    ? [{ label: drivingTexts.takeOver, press: () => { void turns.request("takeOver"); } }] : [];
  return [
    ...(latched ? release : [{ label: drivingTexts.estop, bad: true, press: () => { driving.emergencyStop(); } }]),
    ...others,
    { label: texts.leave, press: leave },
  ];
}
