/** Steps by buttons: how far, how fast, in which direction, and what became of them. */

import { signal, type Signal } from "@preact/signals";
import { useMemo } from "preact/hooks";
import type { Driving } from "../../driving/driving";
import type { RobotState } from "../../robot/robot_state";
import { browserKeeper, remembered, type Keeper } from "../../scene/stored_signals";
import type { EndedStep, StepControl } from "../../steps/step_control";
import {
  ANGLE, DISTANCE, PACES, readSize, shareDriven, stepGoal, type Pace, type Size, type StepDirection,
} from "../../steps/step_size";
import { stepWords } from "../../steps/step_words";
import { stepTexts as texts } from "../../texts/steps";
import { press } from "../driving/press";
import { Panel } from "../panel";

interface StepsProps {
  readonly steps: StepControl;
  readonly driving: Driving;
  readonly state: RobotState;
  readonly keeper?: Keeper | undefined;
}

const MARKS: Readonly<Record<StepDirection, string>> = { forward: "↑", back: "↓", left: "↺", right: "↻" };

/** What is entered, as text, so that a half-written number stays as it is. */
interface Entered {
  readonly distance: Signal<string>;
  readonly angle: Signal<string>;
  readonly pace: Signal<Pace>;
  /** Whether the last step could not be sent. */
  readonly unsent: Signal<boolean>;
}

/** The panel; nothing on robots that take no steps, and for those who may only watch. */
export function StepsPanel({ steps, driving, state, keeper = browserKeeper() }: StepsProps) {
  const entered = useMemo(() => enteredOf(keeper), [keeper]);
  if (state.dialect.value !== "farsteer" || state.session.value?.mayDrive === false) {
    return null;
  }
  const distance = readSize(texts.distance, entered.distance.value, DISTANCE);
  const angle = readSize(texts.angle, entered.angle.value, ANGLE);
  const wrong = [distance, angle].filter((size) => !size.ok).map((size) => size.words).join(" ");
  return (
    <Panel title={texts.title} name="steps">
      <Cross steps={steps} entered={entered} distance={distance} angle={angle} may={driving.status.value} />
      <SizeField name={texts.distance} group={texts.ofDistance} entered={entered.distance} size={distance} range={DISTANCE} />
      <SizeField name={texts.angle} group={texts.ofAngle} entered={entered.angle} size={angle} range={ANGLE} />
      <label class="steps-speed">
        <span>{texts.speed}</span>
        <select
          value={entered.pace.value}
          onChange={({ currentTarget: { value } }) => { entered.pace.value = PACES.find((pace) => pace === value) ?? "own"; }}
        >
          {PACES.map((pace) => <option key={pace} value={pace}>{texts.paces[pace]}</option>)}
        </select>
      </label>
      <div class="steps-status">
        <p role="status" data-grade={wrong !== "" || entered.unsent.value ? "red" : gradeOf(steps.last.value)}>
          {wrong !== "" ? wrong : entered.unsent.value ? texts.notSent : stepWords(steps.present.value, steps.last.value)}
        </p>
        <Progress steps={steps} />
      </div>
    </Panel>
  );
}

function enteredOf(keeper: Keeper | undefined): Entered {
  const text = (kept: unknown): string | undefined => (typeof kept === "string" ? kept.slice(0, 20) : undefined);
  return {
    distance: remembered("farsteer.stepDistance", String(DISTANCE.initial), text, keeper),
    angle: remembered("farsteer.stepAngle", String(ANGLE.initial), text, keeper),
    pace: remembered<Pace>("farsteer.stepPace", "own", (kept) => PACES.find((pace) => pace === kept), keeper),
    unsent: signal(false),
  };
}

interface CrossProps {
  readonly steps: StepControl;
  readonly entered: Entered;
  readonly distance: Size;
  readonly angle: Size;
  /** Whether what is pressed next moves the robot, and why not. */
  readonly may: { readonly will: boolean; readonly words: string };
}

/** Four arrows about the button that cancels. */
function Cross({ steps, entered, distance, angle, may }: CrossProps) {
  const arrow = (direction: StepDirection) => {
    const size = direction === "forward" || direction === "back" ? distance : angle;
    return (
      <button
        type="button"
        class={`steps-${direction}`}
        aria-label={texts.button[direction]}
        title={may.will ? texts.button[direction] : may.words}
        disabled={!may.will || !size.ok}
        {...press(() => {
          if (size.ok) {
            entered.unsent.value = !steps.ask(stepGoal(direction, size.value, entered.pace.peek()));
          }
        })}
      >
        <span aria-hidden="true">{MARKS[direction]}</span>
      </button>
    );
  };
  return (
    <div class="steps-cross" role="group" aria-label={texts.title}>
      {arrow("forward")}
      {arrow("left")}
      <button
        type="button" class="steps-cancel" aria-label={texts.cancelAll}
        disabled={steps.pending.value.length === 0} {...press(() => { steps.stop(); })}
      >
        {texts.cancel}
      </button>
      {arrow("right")}
      {arrow("back")}
    </div>
  );
}

interface SizeFieldProps {
  readonly name: string;
  readonly group: string;
  readonly entered: Signal<string>;
  readonly size: Size;
  readonly range: { readonly presets: readonly number[]; readonly unit: string };
}

function SizeField({ name, group, entered, size, range: { presets, unit } }: SizeFieldProps) {
  return (
    <div class="steps-size">
      <label>
        <span>{name}</span>
        <input
          type="text" inputMode="decimal" size={5} value={entered.value} aria-invalid={!size.ok}
          onInput={(event) => { entered.value = event.currentTarget.value; }}
        />
        <span>{unit}</span>
      </label>
      <div class="steps-presets" role="group" aria-label={group}>
        {presets.map((preset) => (
          <button
            key={preset} type="button" aria-label={`${preset} ${unit}`}
            aria-pressed={size.ok && size.value === preset}
            onClick={() => { entered.value = String(preset); }}
          >
            {preset}
          </button>
        ))}
      </div>
    </div>
  );
}

/** How much of the present step is driven, and how many wait behind it; its place is kept while there is none. */
function Progress({ steps }: { readonly steps: StepControl }) {
  const present = steps.present.value;
  const { goal, progress } = present ?? {};
  const share = goal === undefined || progress === undefined ? 0 : shareDriven(goal, progress);
  const waiting = Math.max(0, steps.pending.value.length - 1);
  return (
    <>
      <progress max={1} value={share} data-idle={present === undefined} aria-label={texts.title} />
      <p class="steps-queue panel-quiet">{texts.queue(waiting)}</p>
    </>
  );
}

function gradeOf(last: EndedStep | undefined): "unknown" | "green" | "amber" | "red" {
  return last === undefined ? "unknown" : last.end.outcome === "done" ? "green" : last.end.outcome === "cancelled" ? "amber" : "red";
}
