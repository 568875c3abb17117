/** What the operator is about to tell the robot of its place, as one value, and the events that change it. */

import type { Answer, HintPreview, HintVerdict, PlanarPose } from "../values";
import type { FloorPoint } from "../scene/floor_pointer";

/**
 * `off`: the picture is for looking; `placing`: presses and keys move the ghost; `waiting`: a hint was sent and
 * the robot has not answered yet; `answered`: it has, or nothing came.
 */
export type HintPhase = "off" | "placing" | "waiting" | "answered";

/** What came of a hint, an undo or a search. */
export type HintResult =
  | { readonly kind: "verdict"; readonly verdict: HintVerdict }
  | { readonly kind: "silent" }
  | { readonly kind: "notSent" }
  | { readonly kind: "unanswered" }
  | { readonly kind: "undo"; readonly answer: Answer }
  | { readonly kind: "search"; readonly answer: Answer }
  | { readonly kind: "found" };

export interface HintState {
  readonly phase: HintPhase;
  /** Where the robot is said to be; undefined before the first press. */
  readonly pose: PlanarPose | undefined;
  /** Whether somebody said where the robot looks; without it the hint cannot be confirmed. */
  readonly headingKnown: boolean;
  /** Where the pointer went down; undefined if it is up. */
  readonly pressedAt: FloorPoint | undefined;
  /** Newest preview; of an earlier pose if it differs from `pose`. */
  readonly preview: HintPreview | undefined;
  /** The hint that was sent last, and when [ms of the page's clock]. */
  readonly sent: { readonly pose: PlanarPose; readonly at: number } | undefined;
  readonly result: HintResult | undefined;
}

export type HintEvent =
  /** Begin; the ghost starts at the present estimate if there is one. */
  | { readonly type: "begin"; readonly present: PlanarPose | undefined }
  | { readonly type: "cancel" }
  /** The robot began anew: nothing of before holds. */
  | { readonly type: "forget" }
  | { readonly type: "press"; readonly point: FloorPoint }
  | { readonly type: "drag"; readonly point: FloorPoint }
  | { readonly type: "release" }
  /** Move the ghost by this much in the map [m]. */
  | { readonly type: "move"; readonly dx: number; readonly dy: number }
  /** Turn the ghost [rad]. */
  | { readonly type: "turn"; readonly angle: number }
  | { readonly type: "preview"; readonly preview: HintPreview }
  | { readonly type: "sent"; readonly pose: PlanarPose; readonly at: number }
  | { readonly type: "notSent" }
  /** The robot takes hints but never answers them: a plain rosbridge. */
  | { readonly type: "unanswered" }
  | { readonly type: "verdict"; readonly verdict: HintVerdict }
  | { readonly type: "tick"; readonly now: number }
  | { readonly type: "undone"; readonly answer: Answer }
  | { readonly type: "searched"; readonly answer: Answer }
  /** The robot knows its place again. */
  | { readonly type: "found" };

/** After this long without a verdict the page says that none came [ms]. */
export const VERDICT_TIMEOUT = 3000;

export const NO_HINT: HintState = {
  phase: "off",
  pose: undefined,
  headingKnown: false,
  pressedAt: undefined,
  preview: undefined,
  sent: undefined,
  result: undefined,
};
