/** What a step does, or how it ended, in words. */

import { stepTexts as texts } from "../texts/steps";
import type { EndedStep, PendingStep } from "./step_control";

/** Return what is said of the present step, else of the last one. */
export function stepWords(present: PendingStep | undefined, last: EndedStep | undefined): string {
  if (present !== undefined) {
    const { goal, progress } = present;
    if (progress === undefined) {
      return texts.asked(goal);
    }
    return progress.moving ? texts.moving(goal, progress) : texts.waiting(goal, progress.ahead);
  }
  if (last === undefined) {
    return texts.idle;
  }
  const { goal, end } = last;
  if (end.outcome === "done") {
    return texts.done(goal, end);
  }
  const known: Readonly<Record<string, string>> = texts.why;
  const why = texts.because(known[end.outcome] ?? end.outcome, end.message);
  return end.distance === 0 && end.angle === 0 ? texts.notBegun(goal, why) : texts.ended(goal, end, why);
}
