/** Below the picture while a run is shown: play, scrub, and the quality of localisation over time. */

import { useMemo } from "preact/hooks";
import type { Player } from "../../replay/player";
import { gradeOf, type Quality } from "../../replay/quality";
import { replayTexts as texts } from "../../texts/replay";

/** Uncertainty that fills the strip [m]: a tenth of a metre is as much as a doorway leaves. */
const SIGMA_FULL = 0.1;
/** Moments that are drawn: as many as a wide strip has pixels. */
const MOST_MOMENTS = 600;

interface ReplayProps {
  readonly player: Player;
  readonly moments: readonly Quality[];
  readonly onBack: () => void;
}

export function ReplayBar({ player, moments, onBack }: ReplayProps) {
  const { run } = player;
  const at = player.at.value;
  return (
    <section class="panel replay" aria-label={texts.bar}>
      <p>
        {player.playing.value
          ? <button type="button" onClick={() => { player.pause(); }}>{texts.pause}</button>
          : <button type="button" onClick={() => { player.play(); }}>{texts.play}</button>}
        <span class="replay-time">{texts.time(at, run.length)}</span>
        <span class="replay-words">{texts.watching(run.name)}{!run.whole && <strong> {texts.damaged(run.length)}</strong>}</span>
        <button type="button" onClick={onBack}>{texts.back}</button>
      </p>
      <Strip moments={moments} length={run.length} />
      <input
        type="range" aria-label={texts.position} min={0} max={Math.ceil(run.length)} step={100} value={at}
        onInput={({ currentTarget }) => { player.seek(currentTarget.valueAsNumber); }}
      />
    </section>
  );
}

function Strip({ moments, length }: { readonly moments: readonly Quality[]; readonly length: number }) {
  const bars = useMemo(() => barsOf(moments, length), [moments, length]);
  return (
    <svg class="replay-strip" viewBox="0 0 1000 40" preserveAspectRatio="none" role="img" aria-label={texts.strip}>
      {bars.map(({ x, width, fit, sigma, grade }) => (
        <g key={x} class={`replay-${grade}`}>
          <rect x={x} y={20 - 20 * fit} width={width} height={20 * fit} />
          <rect x={x} y={21} width={width} height={19 * sigma} opacity={0.6} />
        </g>
      ))}
    </svg>
  );
}

function barsOf(moments: readonly Quality[], length: number) {
  const step = Math.max(1, Math.ceil(moments.length / MOST_MOMENTS));
  const chosen = moments.filter((_, index) => index % step === 0);
  const scale = 1000 / Math.max(length, 1);
  return chosen.map(({ at, fit, sigma, health }, index) => ({
    x: at * scale,
    width: ((chosen[index + 1]?.at ?? length) - at) * scale + 0.5,
    fit,
    sigma: Math.min(sigma / SIGMA_FULL, 1),
    grade: gradeOf(health),
  }));
}
