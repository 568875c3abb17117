/** Steps and photographs. */

import type { PhotoAnswer, StepEnd, StepProgress } from "../../robot/robot_actions";
import { readAnswer } from "./answers";
import type { Field } from "./field";

/** Longer ways than any step's [m, rad]: what a robot reports beyond is no measure. */
const FARTHEST = 1e4;
const MOST_STEPS = 1e6;

function driven(values: Field): { readonly distance: number; readonly angle: number } {
  const part = (name: string): number => values.at(name).within(-FARTHEST, FARTHEST);
  return { distance: part("distance"), angle: part("angle") };
}

/** Feedback of `farsteer_msgs/Move`. */
export function readStepProgress(values: Field): StepProgress {
  const moving = values.at("state").text() === "moving";
  return { moving, ahead: values.at("ahead").count(MOST_STEPS), ...driven(values) };
}

/** Result of `farsteer_msgs/Move`. */
export function readStepEnd(values: Field): StepEnd {
  return {
    outcome: values.at("outcome").text(),
    message: values.at("message").text(1000),
    ...driven(values),
    duration: values.at("duration").within(0, 1e9),
  };
}

/** `farsteer_msgs/TakePhoto`. */
export function readPhoto(values: Field): PhotoAnswer {
  return { ...readAnswer(values), name: values.at("name").text() };
}
