/** Says when the picture is older than it should be. */

import type { Signal } from "@preact/signals";
import { STALE_AFTER } from "../operating_data";
import type { RobotState } from "../robot/robot_state";

/** How often that is looked at [ms]: stale data must look stale within half a second. */
const PERIOD = 100;

/** Keep `stale` true while the robot's pose is old or the connection is not open; the returned function ends it. */
export function watchStaleness(
  state: RobotState, stale: Signal<boolean>, now: () => number = () => performance.now(),
): () => void {
  const timer = setInterval(() => { stale.value = isStale(state, now()); }, PERIOD);
  return () => { clearInterval(timer); };
}

/** Return whether nothing that moves has arrived lately; a robot that was never heard is not stale. */
export function isStale(state: RobotState, now: number): boolean {
  const latest = [state.mapFromBase, state.odomFromBase, state.scan, state.cloud, state.attitude]
    .map((part) => part.peek()?.receivedAt)
    .filter((at) => at !== undefined);
  return latest.length > 0 && now - Math.max(...latest) > STALE_AFTER;
}
