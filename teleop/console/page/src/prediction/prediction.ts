/** Keeps what will be of the robot: what it follows, what is on its way to it, and the path that this makes. */

import { computed, effect, signal, untracked, type ReadonlySignal } from "@preact/signals";
import { velocityOf, type Wanted } from "../driving/gears";
import { robotTimeNow, type LinkStatisticsSignal, type RobotState } from "../robot/robot_state";
import { depend } from "../scene/depend";
import type { PathAhead } from "../scene/settings";
import { CommandHistory } from "./command_history";
import { foreseen, type Foresight } from "./foresight";

/**
 * Round trips [ms] above which the path is shown by itself, and below which it is not any more.
 *
 * Driving becomes worse from 200 to 300 ms on (Chen et al., arXiv 2508.18074, 10 people).
 */
const LATE = { above: 200, below: 160 } as const;
/** What is older than this is no picture of the present [s]; the page itself shows it as old by then. */
const OLDEST = 1.5;
/** A path that is shorter and turns less than this says nothing [m, rad]. */
const LEAST = 0.03;

interface PredictionParts {
  readonly state: RobotState;
  /** What the page sends; undefined while nothing is held. */
  readonly sending: ReadonlySignal<Wanted | undefined>;
  readonly statistics: LinkStatisticsSignal;
  readonly when: ReadonlySignal<PathAhead>;
  /** The page's clock [ms]. */
  readonly now: () => number;
}

/** Return where the robot will go, from its newest pose on; undefined while that is not to be shown. */
export function prediction({ state, sending, statistics, when, now }: PredictionParts): ReadonlySignal<Foresight | undefined> {
  const [history, shown] = [new CommandHistory(), signal<Foresight | undefined>(undefined)];
  const late = signal(false);
  effect(() => {
    const trip = statistics.value.roundTrip ?? 0;
    late.value = trip > (late.peek() ? LATE.below : LATE.above);
  });
  const wanted = computed(() => when.value === "always" || (when.value === "late" && late.value));
  const effectAt = (): number | undefined => {
    const time = robotTimeNow(state, now());
    return time === undefined ? undefined : time + (statistics.peek().roundTrip ?? 0) / 1000;
  };
  effect(() => {
    depend(state.run);
    history.clear();
  });
  effect(() => {
    const control = state.control.value;
    if (control !== undefined) {
      history.followed(control);
    }
  });
  let held = false;
  effect(() => {
    const sent = sending.value;
    const at = untracked(effectAt);
    if (at !== undefined && (sent !== undefined || held)) {
      history.sent({ at, ...(sent === undefined ? { forward: 0, turn: 0 } : velocityOf(sent)) });
    }
    held = sent !== undefined;
  });
  effect(() => {
    const [pose, limits] = [state.mapFromBase.value ?? state.odomFromBase.value, state.driveLimits.value];
    depend(sending);
    const at = untracked(effectAt);
    const trip = (statistics.peek().roundTrip ?? 0) / 1000;
    const known = wanted.value && pose !== undefined && limits !== undefined && at !== undefined && at - pose.stamp < trip + OLDEST;
    shown.value = known ? somewhere(foreseen(history, pose.stamp, at, limits)) : undefined;
  });
  return shown;
}

/** Return a foresight that leads somewhere. */
function somewhere(foresight: Foresight): Foresight | undefined {
  const goes = foresight.motions.some(({ x, y, yaw }) => Math.hypot(x, y) > LEAST || Math.abs(yaw) > LEAST);
  return goes ? foresight : undefined;
}
