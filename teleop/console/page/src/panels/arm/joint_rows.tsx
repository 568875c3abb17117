/** The joints: where they are between their limits, what their servos bear, and two ways of moving one of them. */

import { useSignal } from "@preact/signals";
import { useRef } from "preact/hooks";
import type { Arm } from "../../arm/arm";
import type { ArmJoint } from "../../robot/arm";
import { armTexts as texts } from "../../texts/arm";
import { HoldButton } from "../hold_button";

/** Shares of the stall torque that a servo stands for long, and for a second. */
const LONG = 0.5;
const SHORT = 0.8;

export function JointRows({ arm }: { readonly arm: Arm }) {
  const joints = arm.feed.info.value?.joints ?? [];
  return <div class="arm-joints">{joints.map((joint, at) => <JointRow key={joint.name} arm={arm} joint={joint} number={at} />)}</div>;
}

interface RowProps {
  readonly arm: Arm;
  readonly joint: ArmJoint;
  readonly number: number;
}

function JointRow({ arm, joint, number }: RowProps) {
  const state = arm.feed.state.value;
  const chosen = arm.keys.joint.value === number;
  const [angle, load] = [state?.angles[number] ?? 0, Math.abs(state?.load[number] ?? 0)];
  const { turns, lower, upper } = joint;
  const jog = (sign: number): { begin: () => void; end: () => void } => ({
    begin: () => {
      arm.keys.joint.value = number;
      arm.hold.begin("button", () => arm.jog(number, sign) ?? { kind: "plan", confirmed: false });
    },
    end: () => { arm.hold.end("button"); },
  });
  return (
    <div class="arm-joint" data-chosen={chosen}>
      <button type="button" class="arm-joint-name" aria-pressed={chosen} onClick={() => { arm.keys.joint.value = number; }}>
        {texts.joint(number + 1, turns)}
      </button>
      <output>{texts.angle(angle)}</output>
      <HoldButton name={texts.back(turns)} {...jog(-1)}>−</HoldButton>
      <JointSlider arm={arm} joint={joint} number={number} angle={angle} />
      <HoldButton name={texts.forward(turns)} {...jog(1)}>+</HoldButton>
      <small class="panel-quiet">{texts.limits(lower, upper)}</small>
      <small class="panel-quiet arm-load">
        {texts.loadShare(load)}
        <meter min={0} max={1} low={LONG} high={SHORT} optimum={0} value={Math.min(1, load)} aria-label={texts.load(turns)} />
      </small>
    </div>
  );
}

/** A slider that shows where the joint is, and while it is held where it shall go. */
function JointSlider({ arm, joint, number, angle }: RowProps & { readonly angle: number }) {
  const wanted = useSignal<number | undefined>(undefined);
  /** Assistive technology sets a value without anything that is held, of which nothing would tell the end. */
  const touched = useRef(false);
  const touch = (): void => { touched.current = true; };
  const end = (): void => {
    touched.current = false;
    wanted.value = undefined;
    arm.hold.end("slider");
  };
  return (
    <input
      type="range" min={joint.lower} max={joint.upper} step={0.01} value={wanted.value ?? angle} aria-label={joint.turns}
      aria-valuetext={texts.angle(angle)}
      onPointerDown={touch} onKeyDown={touch}
      onInput={({ currentTarget }) => {
        if (!touched.current) {
          currentTarget.value = String(angle);
          return;
        }
        const begins = wanted.value === undefined;
        wanted.value = Number(currentTarget.value);
        if (begins) {
          arm.keys.joint.value = number;
          arm.hold.begin("slider", () => arm.towards(number, wanted.peek() ?? angle) ?? { kind: "plan", confirmed: false });
        }
      }}
      onPointerUp={end} onPointerCancel={end} onLostPointerCapture={end} onKeyUp={end} onBlur={end}
    />
  );
}
