/** The stick on the screen. It is for pointers; keyboards have their own keys. */

import { useLayoutEffect, useRef } from "preact/hooks";
import type { Driving } from "../../driving/driving";
import { drivingTexts as texts } from "../../texts/driving";

export function StickPad({ driving }: { readonly driving: Driving }) {
  const pad = useRef<HTMLDivElement>(null);
  // Before anything is drawn, and undone at once: a stick that is gone must not drive.
  useLayoutEffect(() => (pad.current === null ? undefined : driving.stick.attach(pad.current)), [driving]);
  const knob = driving.stick.knob.value;
  const held = knob === undefined ? "" : knob.counts ? " driving-held" : " driving-void";
  return (
    <div ref={pad} class={`driving-stick${held}`} role="img" aria-label={texts.stickHelp}>
      <svg viewBox="-100 -100 200 200" aria-hidden="true">
        <circle class="driving-stick-ring" r="92" />
        <path class="driving-stick-arrow" d="M0-84 10-68H-10ZM0 84 10 68H-10ZM-84 0-68 10V-10ZM84 0 68 10V-10Z" />
        <circle class="driving-stick-knob" r="38" cx={58 * (knob?.x ?? 0)} cy={58 * (knob?.y ?? 0)} />
        {knob === undefined && (
          <text class="driving-stick-hint" text-anchor="middle">
            {texts.stickHint.map((word, line) => <tspan key={word} x="0" y={-4 + 19 * line}>{word}</tspan>)}
          </text>
        )}
      </svg>
    </div>
  );
}
