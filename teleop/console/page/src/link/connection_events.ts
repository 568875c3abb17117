/** Lines for the event list as the connection comes and goes. */

import type { Connection } from "../robot/robot_state";
import { linkTexts } from "../texts/link";
import type { Severity } from "../values";

/** Return what takes each change of the connection and says what is new to a person. */
export function connectionReporter(
  address: string, events: (severity: Severity, words: string) => void,
): (connection: Connection) => void {
  let before: Connection = { phase: "connecting", words: "", sinceAt: 0 };
  let lostAt: number | undefined;
  return (connection) => {
    const { phase, words, sinceAt } = connection;
    const wasOpen = before.phase === "open";
    if (phase === "open" && !wasOpen) {
      const { connected, back } = linkTexts.events;
      events("info", lostAt === undefined ? connected(address) : back((sinceAt - lostAt) / 1000));
      lostAt = undefined;
    } else if (words !== "" && words !== before.words) {
      events(wasOpen ? "alarm" : "warning", words);
    }
    if (wasOpen && phase !== "open") {
      lostAt = sinceAt;
    }
    before = connection;
  };
}
