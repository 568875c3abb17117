/** The small map over the picture; a tap shows the whole map in it, or the robot's surroundings again. */

import { useComputed, useSignalEffect } from "@preact/signals";
import { useEffect, useMemo, useRef } from "preact/hooks";
import { depend } from "../scene/depend";
import { drawMinimap } from "../scene/minimap";
import { COLOURS } from "../scene/palette";
import { browserKeeper, rememberedSwitch } from "../scene/stored_signals";
import { pageTexts as texts } from "../texts/page";
import type { PageParts } from "./page_parts";

/** How often it is drawn at most [ms]: a robot at 1 m/s moves two of its pixels in this time. */
const PERIOD = 200;

export function MinimapView({ parts: { scene, settings, state } }: { readonly parts: PageParts }) {
  const canvas = useRef<HTMLCanvasElement>(null);
  const whole = useMemo(
    () => rememberedSwitch("farsteer.wholeMap", false, browserKeeper()), [],
  );
  const shown = useComputed(() => settings.layers.value.minimap && settings.view.value !== "top"
    && (scene.plan.value !== undefined || state.mapFromBase.value !== undefined));
  const draw = useRef((): void => undefined);
  draw.current = () => {
    const place = canvas.current;
    const pen = place?.getContext("2d");
    if (place === null || pen === null || pen === undefined || place.clientWidth === 0) {
      return;
    }
    const size = place.clientWidth;
    const ratio = Math.min(window.devicePixelRatio || 1, 2);
    if (place.width !== Math.round(size * ratio)) {
      place.width = place.height = Math.round(size * ratio);
    }
    pen.setTransform(ratio, 0, 0, ratio, 0, 0);
    drawMinimap(pen, {
      plan: scene.plan.peek(), robot: state.mapFromBase.peek(), points: state.cloud.peek(),
      places: settings.layers.peek().names ? state.mapInfo.peek()?.places ?? [] : [], colours: COLOURS[settings.theme.peek()],
      stale: scene.stale.peek(), late: scene.late.peek(), doubtful: scene.doubtful.peek(),
    }, size, whole.peek());
  };
  useEffect(() => {
    const timer = setInterval(() => { draw.current(); }, PERIOD);
    return () => { clearInterval(timer); };
  }, []);
  useSignalEffect(() => {
    for (const part of [whole, scene.plan, shown]) {
      depend(part);
    }
    draw.current();
  });
  return shown.value
    ? (
      <button type="button" class="page-minimap" aria-label={texts.minimap(whole.value)} title={texts.minimap(whole.value)} onClick={() => { whole.value = !whole.value; }}>
        <canvas ref={canvas} aria-hidden="true" />
      </button>
    )
    : null;
}
