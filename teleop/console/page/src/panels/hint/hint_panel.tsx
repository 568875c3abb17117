/** Tells the robot where it is: place, compare, confirm, undo; or has it find itself. */

import { qualityOf } from "../../hint/hint_quality";
import { canConfirm, previewIsOld } from "../../hint/hint_reducer";
import type { HintResult, HintState } from "../../hint/hint_state";
import type { HintTool } from "../../hint/hint_tool";
import type { RobotState } from "../../robot/robot_state";
import { planar } from "../../scene/geometry";
import { hintTexts as texts } from "../../texts/hint";
import { Panel } from "../panel";

export function HintPanel({ tool, state }: { tool: HintTool; state: RobotState }) {
  const hint = tool.view.value;
  const session = state.session.value;
  const plain = state.dialect.value === "plain";
  const mayHint = session?.mayHint ?? true;
  const maySearch = !plain && (session?.maySearch ?? true);
  if (!mayHint && !maySearch) {
    return null;
  }
  return (
    <Panel title={texts.title} name="hint">
      {hint.phase === "placing"
        ? <Placing tool={tool} hint={hint} plain={plain} />
        : (
          <div class="panel-buttons">
            {mayHint && (
              <button type="button" class="panel-primary" onClick={() => { tool.begin(); }}>{texts.begin}</button>
            )}
            {maySearch && <button type="button" onClick={() => { void tool.find(); }}>{texts.find}</button>}
            {mayHint && !plain && tool.undoable.value && <button type="button" onClick={() => { void tool.undo(); }}>{texts.undo}</button>}
          </div>
        )}
      <p class="panel-hint-result" role="status" data-grade={gradeOf(hint.result)}>{wordsOf(hint)}</p>
      {mayHint && <Candidates tool={tool} state={state} />}
    </Panel>
  );
}

/** Return what the page says about a hint that was sent, an undo or a search; empty if there is nothing to say. */
export function wordsOf({ phase, result }: Pick<HintState, "phase" | "result">): string {
  if (phase === "waiting") {
    return texts.waiting;
  }
  if (result === undefined) {
    return "";
  }
  switch (result.kind) {
    case "verdict":
      return texts.verdict(result.verdict);
    case "undo":
      return texts.undone(result.answer.success, result.answer.message);
    case "search":
      return texts.searched(result.answer.success, result.answer.message);
    default:
      return texts[result.kind];
  }
}

function gradeOf(result: HintResult | undefined): "unknown" | "green" | "amber" | "red" {
  switch (result?.kind) {
    case "verdict":
      return ({ accepted: "green", kept: "green", ambiguous: "amber", rejected: "red" } as const)[result.verdict.verdict];
    case "undo":
    case "search":
      return result.answer.success ? "green" : "red";
    case "found":
      return "green";
    case "silent":
    case "notSent":
      return "red";
    default:
      return "unknown";
  }
}

function Placing({ tool, hint, plain }: { tool: HintTool; hint: HintState; plain: boolean }) {
  const instruction = hint.pose === undefined ? texts.press : hint.headingKnown ? texts.ready : texts.heading;
  return (
    <div class="panel-placing">
      <p role="status">{instruction}</p>
      {hint.pose !== undefined && (
        <p class="panel-quiet">{texts.pose(hint.pose.x, hint.pose.y, (hint.pose.yaw * 180) / Math.PI)}</p>
      )}
      {!plain && hint.pose !== undefined && <Preview hint={hint} />}
      <div class="panel-buttons">
        <button type="button" class="panel-primary" disabled={!canConfirm(hint)} onClick={() => { tool.confirm(); }}>
          {texts.confirm}
        </button>
        <button type="button" onClick={() => { tool.cancel(); }}>{texts.cancel}</button>
      </div>
      {hint.pose !== undefined && <Nudges tool={tool} />}
      <p class="panel-quiet">{texts.keys}</p>
    </div>
  );
}

/** The share that the proposed pose explains, beside that of the present one. */
function Preview({ hint }: { hint: HintState }) {
  const old = previewIsOld(hint);
  const quality = qualityOf(hint.preview, old);
  const { preview } = hint;
  const words = preview === undefined ? texts.noPreview : texts.preview(preview.explained, preview.present);
  return (
    <p class="panel-preview" data-quality={quality} data-old={old}>
      <strong>{texts.quality[quality]}</strong>: {old ? texts.previewOld(words) : words}
      {preview !== undefined && (
        <meter class="panel-meter" min={0} max={1} value={preview.explained} aria-hidden="true" />
      )}
    </p>
  );
}

/** The keys' steps as buttons, for fingers. */
function Nudges({ tool }: { tool: HintTool }) {
  const { nudge } = texts;
  const buttons = [
    { key: "q", mark: "↺", name: nudge.turnLeft },
    { key: "ArrowUp", mark: "↑", name: nudge.forward },
    { key: "e", mark: "↻", name: nudge.turnRight },
    { key: "ArrowLeft", mark: "←", name: nudge.left },
    { key: "ArrowDown", mark: "↓", name: nudge.back },
    { key: "ArrowRight", mark: "→", name: nudge.right },
  ];
  return (
    <div class="panel-nudges" role="group" aria-label={nudge.title}>
      {buttons.map(({ key, mark, name }) => (
        <button key={key} type="button" aria-label={name} title={name} onClick={() => { tool.key(key, false); }}>
          {mark}
        </button>
      ))}
    </div>
  );
}

/** The places that a search has not yet told apart; the numbers are those in the picture. */
function Candidates({ tool, state }: { tool: HintTool; state: RobotState }) {
  const candidates = state.candidates.value;
  if (candidates.length === 0) {
    return null;
  }
  return (
    <div class="panel-candidates" role="group" aria-label={texts.candidates(candidates.length)}>
      <p>{texts.candidates(candidates.length)}</p>
      <div class="panel-buttons">
        {candidates.map((candidate, i) => {
          const { x, y } = planar(candidate);
          return (
            <button key={i} type="button" onClick={() => { tool.pick(candidate); }}>{texts.pick(i + 1, candidate, x, y)}</button>
          );
        })}
      </div>
    </div>
  );
}
