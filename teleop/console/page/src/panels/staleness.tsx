/** What is old is grey and says its age. */

import type { ComponentChildren } from "preact";
import { STALE_AFTER } from "../operating_data";
import { panelTexts } from "../texts/panels";

/** Return the age [ms] of what arrived at a time, and whether it is shown as old. */
export function staleness(receivedAt: number | undefined, now: number): { readonly age: number; readonly stale: boolean } {
  const age = receivedAt === undefined ? Infinity : Math.max(0, now - receivedAt);
  return { age, stale: age > STALE_AFTER };
}

/** Content that turns grey and says its age when it is old; undefined: it never came. */
export function MaybeStale(
  { receivedAt, now, children }: { receivedAt: number | undefined; now: number; children: ComponentChildren },
) {
  const { age, stale } = staleness(receivedAt, now);
  return (
    <div class={stale ? "panel-stale" : "panel-fresh"} data-stale={stale}>
      {children}
      {stale && <p class="panel-age">{receivedAt === undefined ? panelTexts.unknown : panelTexts.old(age)}</p>}
    </div>
  );
}
