/** The arm: why it does not move and the way out, what moves it, and how to pick something up. */

import type { Signal } from "@preact/signals";
import { useMemo } from "preact/hooks";
import type { Arm, KnownArm } from "../../arm/arm";
import { Guide, GUIDE_STEPS } from "../../arm/guide";
import { TIP_FRAMES } from "../../arm/inputs/tip_motion";
import { armTexts as texts } from "../../texts/arm";
import { press } from "../driving/press";
import { Panel } from "../panel";
import { GripperPart } from "./gripper_part";
import { JointRows } from "./joint_rows";
import { MovesPart } from "./moves_part";
import { TaughtPart } from "./taught_part";

/** The panel; nothing for those who may only watch but what the arm does. */
export function ArmPanel({ arm, mayDrive }: { readonly arm: Arm; readonly mayDrive: boolean }) {
  const known = arm.known.value;
  return (
    <Panel title={texts.title} name="arm">
      {known === undefined || arm.feed.state.value === undefined ? <p>{texts.loading}</p> : (
        <>
          <Reason arm={arm} known={known} mayDrive={mayDrive} />
          {mayDrive && <Controls arm={arm} known={known} />}
        </>
      )}
    </Panel>
  );
}

function Controls({ arm, known }: { readonly arm: Arm; readonly known: KnownArm }) {
  return (
    <>
      <Choice
        name={texts.moves} value={arm.chosen} of={[false, true]} words={(chosen) => (chosen ? texts.armName : texts.wheelsName)}
      />
      <GuideList arm={arm} known={known} />
      <GripperPart arm={arm} />
      <MovesPart arm={arm} known={known} />
      {arm.chosen.value && (
        <>
          <Choice name={texts.ghost} value={arm.follows} of={[true, false]} words={(follows) => (follows ? texts.follows : texts.stays)} />
          <Choice name={texts.frames} value={arm.frame} of={TIP_FRAMES} words={(frame) => texts.frame[frame]} />
        </>
      )}
      <details>
        <summary>{texts.joints}</summary>
        <JointRows arm={arm} />
      </details>
      <details>
        <summary>{texts.teaching}</summary>
        <TaughtPart arm={arm} known={known} />
      </details>
      <details>
        <summary>{texts.keys}</summary>
        {texts.keyHelp.map((line) => <p key={line} class="panel-quiet">{line}</p>)}
      </details>
    </>
  );
}

interface ReasonProps {
  readonly arm: Arm;
  readonly known: KnownArm;
  readonly mayDrive: boolean;
}

/** Why it does what it does, where its tip is, and the way out of where it is stuck; its height is kept. */
function Reason({ arm, known: { info }, mayDrive }: ReasonProps) {
  const state = arm.feed.state.value;
  const [stopped, going, failed] = [arm.hold.stopped.value, arm.wayOut.going.value, arm.wayOut.failed.value];
  if (state === undefined) {
    return null;
  }
  const pending = state.mode === "plan" ? arm.moved.pending.value : undefined;
  const reason = texts.sentence((pending === undefined ? undefined : texts.plan[pending.state]) ?? texts.reasons[state.reason] ?? state.reason);
  const hindered = texts.smooth[state.mode] !== undefined && texts.smooth[state.mode] !== state.reason;
  const troubled = hindered || stopped !== "" || failed !== "" || state.wayOut !== "" || state.mode === "held";
  return (
    <div class="arm-reason" data-grade={troubled ? "amber" : "green"}>
      <p role="status"><strong>{reason}</strong> {stopped} {failed}</p>
      {mayDrive && state.wayOut !== "" && (
        <button type="button" class="panel-primary" disabled={going} {...press(() => { void arm.wayOut.go(); })}>
          {texts.capital(state.wayOutText)}
        </button>
      )}
      {going && <p>{texts.gettingOut}</p>}
      <p class="panel-quiet arm-tip">{texts.tip(state.tip.position, info.mount.position.z)}</p>
    </div>
  );
}

function GuideList({ arm, known }: { readonly arm: Arm; readonly known: KnownArm }) {
  const guide = useMemo(() => new Guide(), []);
  const state = arm.feed.state.value;
  const next = state === undefined ? "open" : guide.next(known.info, state);
  return (
    <details open class="arm-guide">
      <summary>{texts.guide}</summary>
      <ol>
        {GUIDE_STEPS.map((step) => <li key={step} aria-current={step === next ? "step" : undefined}>{texts.steps[step]}</li>)}
      </ol>
      {next === "done" && <p data-grade="green">{texts.done}</p>}
    </details>
  );
}

interface ChoiceProps<T> {
  readonly name: string;
  readonly value: Signal<T>;
  readonly of: readonly T[];
  readonly words: (value: T) => string;
}

/** Buttons of which one is pressed; radio buttons would keep the keys for themselves. */
function Choice<T>({ name, value, of, words }: ChoiceProps<T>) {
  return (
    <div class="arm-choice" role="group" aria-label={name}>
      <span>{name}</span>
      {of.map((each) => (
        <button key={String(each)} type="button" aria-pressed={value.value === each} {...press(() => { value.value = each; })}>
          {words(each)}
        </button>
      ))}
    </div>
  );
}
