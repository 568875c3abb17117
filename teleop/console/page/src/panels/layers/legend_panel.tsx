/** What the colours of the live points mean. */

import type { LegendEntry } from "../../scene/palette";
import { layerTexts as texts } from "../../texts/panels";

/** @param entries Distances in ascending order, then "unknown". */
export function LegendPanel({ entries }: { entries: readonly LegendEntry[] }) {
  const last = entries.filter((entry) => entry.distance !== undefined).length - 1;
  return (
    <figure class="panel-legend">
      <figcaption>{texts.legend}</figcaption>
      <ul>
        {entries.map(({ distance, colour }, i) => (
          <li key={distance ?? "unknown"}>
            <span class="panel-swatch" aria-hidden="true" style={{ backgroundColor: colour }} />
            {texts.legendValue(distance, i === last)}
          </li>
        ))}
      </ul>
    </figure>
  );
}
