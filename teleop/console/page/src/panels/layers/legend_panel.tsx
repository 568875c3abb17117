/** What the colours of the live points mean. */

import type { LegendEntry } from "../../scene/palette";
import { layerTexts as texts } from "../../texts/panels";

export interface LegendPanelProps {
  /** Distances in ascending order, then "unknown". */
  readonly entries: readonly LegendEntry[];
  /** Other things in the picture, with their colours in the notation of CSS. */
  readonly marks?: readonly { readonly name: string; readonly colour: string }[];
}

export function LegendPanel({ entries, marks = [] }: LegendPanelProps) {
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
        {marks.map(({ name, colour }) => (
          <li key={name}>
            <span class="panel-swatch panel-swatch-line" aria-hidden="true" style={{ backgroundColor: colour }} />
            {name}
          </li>
        ))}
      </ul>
    </figure>
  );
}
