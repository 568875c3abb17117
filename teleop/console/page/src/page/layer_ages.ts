/** How old each layer of the picture is, and whether that is too old to be taken for the present. */

import { effect, signal, type ReadonlySignal, type Signal } from "@preact/signals";
import { STALE_AFTER } from "../operating_data";
import { dataAge, type Dated } from "../robot/data_age";
import type { LinkStatisticsSignal, RobotState } from "../robot/robot_state";
import type { Layer } from "../scene/settings";

/** How often ages are looked at [ms]: old data must look old within half a second. */
const PERIOD = 100;
/** How often their words are renewed [ms]: figures that change faster cannot be read. */
const SAID = 500;
/** The longest pause between two sweeps that counts as their rate [ms]; the leanest link has one a second. */
const SLOWEST = 1000;

/** Age of a layer's data [ms], and whether it is shown as old. */
export interface LayerAge {
  readonly age: number;
  readonly stale: boolean;
}
export type LayerAges = Readonly<Partial<Record<Layer, LayerAge>>>;

/** What of the picture turns grey: all that is alive, or what the scanners see alone. */
export interface Greyed {
  readonly stale: Signal<boolean>;
  readonly late: Signal<boolean>;
}

/** Keep what is grey true to the ages of poses and sweeps; return the ages of all layers. */
export function watchAges(
  state: RobotState, link: LinkStatisticsSignal, { stale, late }: Greyed, now: () => number = () => performance.now(),
): ReadonlySignal<LayerAges> {
  const ages = signal<LayerAges>({});
  const arrivals = { building: arrival(state.surfaces, now), map: arrival(state.mapPoints, now), hypotheses: arrival(state.candidates, now) };
  const [poses, sweeps] = [interval(state.mapFromBase), interval(state.cloud)];
  let saidAt = -Infinity;
  setInterval(() => {
    const at = now();
    const aged = (data: Dated | undefined, between = 0): LayerAge | undefined => {
      const age = data && dataAge(data, state, link.peek().roundTrip, at).age;
      return age === undefined ? undefined : { age, stale: age > STALE_AFTER + Math.min(between, SLOWEST) };
    };
    const place = aged(state.mapFromBase.peek(), poses());
    const cloud = aged(state.cloud.peek() ?? state.scan.peek(), sweeps());
    stale.value = isSilent(state, at) || place?.stale === true;
    late.value = cloud?.stale === true;
    if (at - saidAt >= SAID) {
      saidAt = at;
      const still = (came: number | undefined): LayerAge | undefined => came === undefined ? undefined : { age: at - came, stale: false };
      ages.value = Object.fromEntries(Object.entries({
        building: still(arrivals.building()), map: still(arrivals.map()), hypotheses: still(arrivals.hypotheses()),
        cloud, path: place, covariance: place, truth: aged(state.truth.peek()),
      }).filter(([, age]) => age !== undefined));
    }
  }, PERIOD);
  return ages;
}

/** Return whether nothing that moves has arrived lately; a robot that was never heard is not silent. */
export function isSilent(state: RobotState, now: number): boolean {
  const latest = [state.mapFromBase, state.odomFromBase, state.scan, state.cloud, state.attitude]
    .map((part) => part.peek()?.receivedAt)
    .filter((at) => at !== undefined);
  return latest.length > 0 && now - Math.max(...latest) > STALE_AFTER;
}

/** Return a function that tells when what a signal holds came [ms]; undefined while it holds nothing. */
function arrival(part: ReadonlySignal<unknown>, now: () => number): () => number | undefined {
  let came: number | undefined;
  effect(() => {
    const known = Array.isArray(part.value) ? part.value.length > 0 : part.value !== undefined;
    came = known ? now() : undefined;
  });
  return () => came;
}

/** Return a function that tells the time between the last two values of a signal [ms]. */
function interval(part: ReadonlySignal<{ readonly receivedAt: number } | undefined>): () => number {
  let [before, last] = [NaN, NaN];
  effect(() => { [before, last] = [last, part.value?.receivedAt ?? NaN]; });
  return () => (Number.isFinite(last - before) ? last - before : 0);
}
