/** How a hint comes about: a pure function from state and event to state. */

import { planar } from "../scene/geometry";
import { headingOfDrag, isFinitePose, moved, samePose, turned } from "./hint_geometry";
import { NO_HINT, VERDICT_TIMEOUT, type HintEvent, type HintState } from "./hint_state";

/** Return the state after an event; the same object if the event changes nothing. */
export function reduceHint(state: HintState, event: HintEvent): HintState {
  switch (event.type) {
    case "begin":
      return begun(state, event);
    case "cancel":
      return state.phase === "off" ? state : { ...NO_HINT, sent: state.sent };
    case "forget":
      return NO_HINT;
    case "press":
    case "drag":
    case "release":
      return pointed(state, event);
    case "move":
      return placed(state, state.pose && moved(state.pose, event.dx, event.dy), state.headingKnown);
    case "turn":
      return placed(state, state.pose && turned(state.pose, event.angle), true);
    case "preview":
      return state.phase === "placing" ? { ...state, preview: event.preview } : state;
    case "sent":
      return {
        ...state, phase: "waiting", pressedAt: undefined, result: undefined,
        pose: event.pose, sent: { pose: event.pose, at: event.at },
      };
    case "notSent":
      return { ...state, result: { kind: "notSent" } };
    case "unanswered":
      return { ...state, phase: "answered", result: { kind: "unanswered" } };
    case "verdict":
      return judged(state, event);
    case "tick":
      return timedOut(state, event.now);
    case "undone":
      return answered(state, { kind: "undo", answer: event.answer });
    case "searched":
      return answered(state, { kind: "search", answer: event.answer });
    case "found":
      return isSearching(state) ? { ...state, result: { kind: "found" } } : state;
  }
}

/** Return whether the whole map is searched on request, and nothing has come of it yet. */
export function isSearching({ result }: Pick<HintState, "result">): boolean {
  return result?.kind === "search" && result.answer.success;
}

/** Return whether the hint can be confirmed. */
export function canConfirm(state: HintState): boolean {
  return state.phase === "placing" && state.pressedAt === undefined && state.headingKnown
    && state.pose !== undefined && isFinitePose(state.pose);
}

/** Return whether the preview is of a pose that the ghost has left. */
export function previewIsOld(state: HintState): boolean {
  return state.preview !== undefined
    && (state.pose === undefined || !samePose(state.preview.pose, state.pose, 1e-6, 1e-6));
}

type Of<T extends HintEvent["type"]> = Extract<HintEvent, { type: T }>;

function begun(state: HintState, { present }: Of<"begin">): HintState {
  const pose = present !== undefined && isFinitePose(present) ? present : undefined;
  return { ...NO_HINT, phase: "placing", pose, headingKnown: pose !== undefined, sent: state.sent };
}

function pointed(state: HintState, event: Of<"press"> | Of<"drag"> | Of<"release">): HintState {
  if (state.phase !== "placing") {
    return state;
  }
  if (event.type === "release") {
    return state.pressedAt === undefined ? state : { ...state, pressedAt: undefined };
  }
  const { x, y } = event.point;
  if (!Number.isFinite(x) || !Number.isFinite(y)) {
    return state;
  }
  const yaw = state.pose?.yaw ?? 0;
  if (event.type === "press") {
    return { ...state, pressedAt: { x, y }, pose: { x, y, yaw }, result: undefined };
  }
  const from = state.pressedAt;
  const heading = from && headingOfDrag(from, event.point);
  return from === undefined || heading === undefined
    ? state
    : { ...state, pose: { x: from.x, y: from.y, yaw: heading }, headingKnown: true };
}

function placed(state: HintState, pose: HintState["pose"], headingKnown: boolean): HintState {
  return state.phase !== "placing" || pose === undefined || !isFinitePose(pose)
    ? state
    : { ...state, pose, headingKnown, result: undefined };
}

/** A verdict counts if it is about the hint that was sent; one that comes after the time-out still does. */
function judged(state: HintState, { verdict }: Of<"verdict">): HintState {
  const awaited = state.phase === "waiting" || (state.phase === "answered" && state.result?.kind === "silent");
  return awaited && state.sent !== undefined && samePose(planar(verdict.hint), state.sent.pose)
    ? { ...state, phase: "answered", result: { kind: "verdict", verdict } }
    : state;
}

function timedOut(state: HintState, now: number): HintState {
  return state.phase === "waiting" && state.sent !== undefined && now - state.sent.at >= VERDICT_TIMEOUT
    ? { ...state, phase: "answered", result: { kind: "silent" } }
    : state;
}

function answered(state: HintState, result: NonNullable<HintState["result"]>): HintState {
  return { ...state, phase: state.phase === "placing" ? "placing" : "answered", pressedAt: undefined, result };
}
