/** The robot's own reasons, which are written for a log, in the words of this page. */

import { drivingTexts } from "../texts/driving";

const texts = drivingTexts.reasons;

const FIXED: ReadonlyMap<string, string> = new Map([
  ["no driver yet", texts.neverDriven],
  ["neutral", texts.neutral],
  ["driving", texts.driving],
  ["driving a step", texts.step],
  ["at rest after a step", texts.afterStep],
  ["driving slowly, for commands arrive late", texts.slowly],
  ["send a neutral stick first", texts.neutralFirst],
  ["send a zero velocity first", texts.zeroFirst],
  ["no command for too long: send a zero velocity, or pause for a second, before driving on", texts.zeroFirst],
  ["the server does not answer", texts.serverGone],
  ["the server has ended", texts.serverGone],
]);

type Rule = readonly [RegExp, (first: string, second: string) => string];

const RULES: readonly Rule[] = [
  [/^e-stop by (.+) is latched; reset it first$/, texts.estop],
  [/^e-stop reset by (.+)$/, texts.reset],
  [/^e-stop by (.+)$/, texts.estop],
  [/^no command for ([\d.]+) s$/, (time) => texts.watchdog(Number(time).toFixed(1))],
  [/^(.+) was silent for ([\d.]+) s$/, texts.silent],
  [/^commands arrive ([\d.]+) s late, /, texts.late],
  [/^(.+) taken over from (.+)$/, texts.takenOver],
  [/^(.+) took the free lease$/, texts.took],
  [/^(.+) disconnected$/, texts.left],
  [/^(.+) drives; call \/teleop\/take_over$/, texts.othersDrive],
];

/** Longest reason that is shown [characters]. */
const LONGEST = 200;

/**
 * Return a reason of the robot in the words of this page; an unknown one as it is, but not endless.
 *
 * @param reason The robot's words.
 * @param me Name of this page's client, which becomes "you"; undefined if it is unknown.
 */
export function inOurWords(reason: string, me: string | undefined): string {
  const name = (text: string) => (me !== undefined && text === me ? drivingTexts.you : text);
  const fixed = FIXED.get(reason);
  if (fixed !== undefined) {
    return fixed;
  }
  for (const [pattern, words] of RULES) {
    const found = pattern.exec(reason.slice(0, LONGEST));
    if (found !== null) {
      return words(name(found[1] ?? ""), name(found[2] ?? ""));
    }
  }
  return reason.slice(0, LONGEST);
}

/** Return who pressed the e-stop, from the robot's reason; undefined if it does not say. */
export function stoppedBy(reason: string): string | undefined {
  return /^e-stop by (.{1,100})$/.exec(reason)?.[1];
}
