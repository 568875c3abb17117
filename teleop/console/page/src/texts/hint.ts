/** Words about hints: where the robot is said to be, and what the robot makes of it. */

import { VERDICTS } from "../operating_data";
import type { HintVerdict, PlaceInQuestion, Pose } from "../values";
import { sentence } from "./filled";

const percent = (share: number): string => `${Math.round(100 * share)} %`;

export const hintTexts = {
  title: "Where is the robot?",
  begin: "Show where it is",
  find: "Find it in the whole map",
  undo: "Undo the last placement",
  confirm: "It is here",
  cancel: "Leave it",
  press: "Press on the map where the robot is, and drag to where it looks.",
  heading: "Drag to where the robot looks, or turn it with Q and E.",
  ready: "Compare the points with the map, then confirm.",
  keys: "Keys: arrows move it by 0.1 m (with Shift by 0.5 m), Q and E turn it by 5°, Enter confirms, Esc leaves it.",
  waiting: "Sent; the robot compares the place with what it sees.",
  silent: "The robot has not answered for 3 s. See whether the link is good, then send the hint again.",
  notSent: "The hint could not be sent: there is no connection. Confirm again when it is back.",
  unanswered: "Sent. This robot does not answer hints: see whether the points now lie on the map.",
  noPreview: "Not yet compared with what the scanner sees.",
  preview: (explained: number, present: number | undefined): string =>
    `explains ${percent(explained)} of what the scanner sees; `
    + (present === undefined ? "there is no present pose" : `the present pose ${percent(present)}`),
  previewOld: (preview: string): string => `the place before ${preview}`,
  quality: { good: "fits", bad: "does not fit", unknown: "not known" },
  verdict: ({ verdict, reason }: Pick<HintVerdict, "verdict" | "reason">): string =>
    `${sentence(VERDICTS[verdict])} ${sentence(reason)}`.trim(),
  undone: (success: boolean, message: string): string =>
    success ? "The last placement is undone." : `Not undone: ${message}`,
  searched: (success: boolean, message: string): string =>
    success ? (message === "" ? "The whole map is searched." : sentence(message)) : `Not searched: ${message}`,
  found: "The robot has found its place.",
  candidates: (count: number): string =>
    count === 1
      ? "One place explains what is seen. Choose it if it is right, or drive on to make sure."
      : `${count} places explain what is seen. Pick the right one, or drive on to tell them apart.`,
  pick: (number: number, { name = "", share, away }: Omit<PlaceInQuestion, keyof Pose>, x: number, y: number): string =>
    [
      `${number}: ${name === "" ? `at ${x.toFixed(1)}, ${y.toFixed(1)} m` : name}`,
      ...(share === undefined ? [] : [percent(share)]), ...(away === undefined ? [] : [`${away.toFixed(1)} m away`]),
    ].join(", "),
  pose: (x: number, y: number, degrees: number): string =>
    `x ${x.toFixed(2)} m, y ${y.toFixed(2)} m, heading ${degrees.toFixed(0).replace(/^-(0|180)$/, "$1")}°`,
  nudge: {
    title: "Move it",
    forward: "up",
    back: "down",
    left: "left",
    right: "right",
    turnLeft: "turn left by 5°",
    turnRight: "turn right by 5°",
  },
} as const;
