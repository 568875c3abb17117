/** What a lost connection means, and what a person can do about it. */

import type { ConnectionPhase } from "../robot/robot_state";
import { linkTexts } from "../texts/link";
import { ABNORMAL, type Closing } from "./socket_transport";

/** What follows from the end of a connection. */
export interface Consequence {
  readonly phase: ConnectionPhase;
  readonly words: string;
  /** Whether trying again can help without a person. */
  readonly retry: boolean;
}

const POLICY_VIOLATION = 1008;
const TRY_AGAIN_LATER = 1013;

/** What the end of an open connection means. */
export function consequenceOf(closing: Closing, hasToken: boolean, address: string): Consequence {
  const { code, reason } = closing;
  if (code === POLICY_VIOLATION) {
    if (reason.includes("too many wrong tokens")) {
      return { phase: "refused", words: linkTexts.tokenLater, retry: false };
    }
    if (reason.includes("access has changed")) {
      return { phase: "lost", words: linkTexts.accessChanged, retry: true };
    }
    if (/\bauth|token/.test(reason)) {
      const words = hasToken ? linkTexts.tokenRefused : linkTexts.tokenMissing;
      return { phase: "refused", words, retry: false };
    }
  }
  if (code === TRY_AGAIN_LATER) {
    if (reason.includes("operator needs")) {
      return { phase: "refused", words: linkTexts.evicted, retry: true };
    }
    if (/too many/.test(reason)) {
      return { phase: "refused", words: linkTexts.full(address), retry: true };
    }
    return { phase: "lost", words: linkTexts.overloaded(reason), retry: true };
  }
  if (reason === "") {
    return { phase: "lost", words: linkTexts.lost, retry: true };
  }
  // A reason without a closing frame is the page's own.
  return { phase: "lost", words: code === ABNORMAL ? reason : linkTexts.closedBecause(reason), retry: true };
}

/** Whether a status of the robot says that it wants a token before anything else. */
export function asksForToken(words: string): boolean {
  return words.includes("authentication with a token is required");
}
