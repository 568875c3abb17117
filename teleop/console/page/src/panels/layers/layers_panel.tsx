/** What the picture shows and how. */

import type { ReadonlySignal, Signal } from "@preact/signals";
import { useId } from "preact/hooks";
import {
  DECAY_RANGE, LAYERS, PATH_AHEAD, POINT_SIZE_RANGE, THEMES, viewsOf, withLayer, type Layer, type SceneSettings, type View,
} from "../../scene/settings";
import { layerTexts as texts, panelTexts } from "../../texts/panels";
import { Panel } from "../panel";

/** The setting that saves bandwidth, which belongs to the link. */
export interface LeanSetting {
  readonly lean: ReadonlySignal<boolean>;
  readonly setLean: (lean: boolean) => void;
}

export interface LayersPanelProps {
  readonly settings: SceneSettings;
  /** Views that are offered; those of a robot without an arm by default. */
  readonly views?: readonly View[];
  readonly lean?: LeanSetting | undefined;
  /** Layers that the robot has nothing for, such as the truth of a real one; they are not offered. */
  readonly absent?: readonly Layer[];
  /** How old each layer is [ms], and whether it is shown as old, where that is known. */
  readonly ages?: ReadonlySignal<Readonly<Partial<Record<Layer, { readonly age: number; readonly stale: boolean }>>>>;
}

export function LayersPanel({ settings, views, lean, absent = [], ages }: LayersPanelProps) {
  return (
    <Panel title={texts.title} name="layers">
      <ViewSwitch view={settings.view} {...(views && { views })} />
      <Choice title={texts.theme} options={THEMES} names={texts.themes} chosen={settings.theme} />
      <Slider title={texts.pointSize} value={settings.pointSize} range={POINT_SIZE_RANGE} step={0.1} words={texts.factor} />
      <Slider title={texts.decay} value={settings.decay} range={DECAY_RANGE} step={1} words={texts.seconds} />
      <Choice title={texts.pathAhead} options={PATH_AHEAD} names={texts.pathsAhead} chosen={settings.pathAhead} />
      <fieldset>
        <legend>{texts.layers}</legend>
        {LAYERS.filter((layer) => !absent.includes(layer)).map((layer) => (
          <label key={layer} class="panel-check">
            <input
              type="checkbox"
              checked={settings.layers.value[layer]}
              onChange={({ currentTarget }) => {
                settings.layers.value = withLayer(settings.layers.peek(), layer, currentTarget.checked);
              }}
            />
            {texts.names[layer]}
            <Age {...ages?.value[layer]} />
          </label>
        ))}
      </fieldset>
      {lean !== undefined && (
        <label class="panel-check" title={texts.leanMeaning}>
          <input
            type="checkbox"
            checked={lean.lean.value}
            onChange={({ currentTarget }) => { lean.setLean(currentTarget.checked); }}
          />
          {texts.lean}: <span class="panel-quiet">{texts.leanMeaning}</span>
        </label>
      )}
    </Panel>
  );
}

function Age({ age, stale = false }: { age?: number; stale?: boolean }) {
  return age === undefined ? null : <span class={`panel-layer-age ${stale ? "panel-stale" : "panel-quiet"}`}>{panelTexts.old(age)}</span>;
}

/** The views of the picture, also for the page's bar. */
export function ViewSwitch({ view, views = viewsOf(false) }: { view: SceneSettings["view"]; views?: readonly View[] }) {
  return <Choice title={texts.view} options={views} names={texts.views} chosen={view} />;
}

function Choice<T extends string>(
  { title, options, names, chosen }:
  { title: string; options: readonly T[]; names: Readonly<Record<T, string>>; chosen: Signal<T> },
) {
  const group = useId();
  return (
    <fieldset class="panel-choice">
      <legend>{title}</legend>
      {options.map((option) => (
        <label key={option}>
          <input
            type="radio"
            name={group}
            checked={chosen.value === option}
            onChange={() => { chosen.value = option; }}
          />
          <span>{names[option]}</span>
        </label>
      ))}
    </fieldset>
  );
}

function Slider(
  { title, value, range, step, words }:
  {
    title: string; value: Signal<number>; range: { readonly min: number; readonly max: number }; step: number;
    words: (value: number) => string;
  },
) {
  const id = useId();
  return (
    <div class="panel-slider">
      <label for={id}>{title}</label>
      <input
        id={id}
        type="range"
        min={range.min}
        max={range.max}
        step={step}
        value={value.value}
        aria-valuetext={words(value.value)}
        onInput={({ currentTarget }) => { value.value = currentTarget.valueAsNumber; }}
      />
      <output for={id}>{words(value.value)}</output>
    </div>
  );
}
