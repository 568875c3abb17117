/** The page on which a person shows what the axes and buttons of a gamepad shall do. */

import { useEffect, useRef, useState } from "preact/hooks";
import type { Driving } from "../../driving/driving";
import { DEAD_ZONES, STANDARD_MAPPING } from "../../driving/gamepad_mapping";
import {
  AXIS_USES, BUTTON_USES, completed, pressedButton, pushedAxis, snapshot, withUse,
  type AxisUseName, type ButtonUseName, type MappingDraft, type PadSnapshot,
} from "../../driving/mapping_capture";
import type { AxisUse } from "../../operating_data";
import { drivingTexts as texts } from "../../texts/driving";
import { PadView } from "./pad_view";

type Use = AxisUseName | ButtonUseName;

/** Period at which the gamepad is shown [ms]. */
const SHOWN = 50;

export interface MappingPageProps {
  readonly driving: Driving;
  /** Whether the browser gives gamepads to this page at all. */
  readonly secure: boolean;
  readonly onClose: () => void;
}

export function MappingPage({ driving, secure, onClose }: MappingPageProps) {
  const { pads } = driving;
  const infos = pads.pads.value;
  const [chosen, choose] = useState<number>();
  useEffect(() => {
    pads.mapping.value = true;
    return () => { pads.mapping.value = false; };
  }, [pads]);
  const info = infos.find(({ index }) => index === chosen) ?? infos[0];
  return (
    <section class="driving-mapping" aria-label={texts.mapping} data-own-keys="">
      <p>{texts.mappingPaused}</p>
      {info === undefined && <p role="status">{secure ? texts.mappingNone : texts.mappingInsecure}</p>}
      {infos.length > 1 && (
        <label>
          {texts.mappingWhich}{" "}
          <select value={info?.index} onChange={(event) => { choose(Number(event.currentTarget.value)); }}>
            {infos.map(({ index, id }) => <option key={index} value={index}>{id}</option>)}
          </select>
        </label>
      )}
      {info !== undefined && <PadMapping key={`${info.index} ${info.id}`} driving={driving} index={info.index} id={info.id} />}
      <button type="button" onClick={onClose}>{texts.mappingClose}</button>
    </section>
  );
}

interface PadMappingProps {
  readonly driving: Driving;
  readonly index: number;
  readonly id: string;
}

function PadMapping({ driving, index, id }: PadMappingProps) {
  const { store } = driving.pads;
  const find = () => driving.pads.connected().find((pad) => pad.index === index);
  const [draft, setDraft] = useState<MappingDraft>(() => {
    const pad = find();
    return (pad && store.of(pad)) ?? {};
  });
  const [now, setNow] = useState<PadSnapshot>({ axes: [], buttons: [] });
  const [learning, setLearning] = useState<Use>();
  const [outcome, setOutcome] = useState("");
  const rest = useRef<PadSnapshot>(now);

  useEffect(() => {
    const timer = setInterval(() => {
      const pad = find();
      if (pad === undefined) {
        return;
      }
      const seen = snapshot(pad);
      setNow(seen);
      const value = learning === undefined ? undefined : learned(learning, rest.current, seen);
      if (learning !== undefined && value !== undefined) {
        setDraft((before) => withUse(before, learning, value));
        setLearning(undefined);
      }
    }, SHOWN);
    return () => { clearInterval(timer); };
  }, [learning, index]);

  const learn = (use: Use) => {
    rest.current = now;
    setOutcome("");
    setLearning(use);
  };
  const save = () => {
    const mapping = completed(draft, STANDARD_MAPPING.deadZone);
    if (mapping === undefined) {
      setOutcome(texts.mappingIncomplete);
    } else {
      setOutcome(store.save(id, mapping) ? texts.mappingSaved : texts.mappingNotKept);
    }
  };
  const standard = () => {
    store.forget(id);
    const pad = find();
    setDraft((pad && store.of(pad)) ?? {});
    setOutcome("");
  };
  const zone = draft.deadZone ?? STANDARD_MAPPING.deadZone;
  return (
    <div>
      <p class="driving-pad-name">{id}</p>
      <table>
        <tbody>
          {[...AXIS_USES, ...BUTTON_USES].map((use) => (
            <tr key={use}>
              <th scope="row">{texts.mappingUse[use]}</th>
              <td aria-live="polite">{learning === use ? learningWords(use) : useWords(draft[use])}</td>
              <td class="driving-mapping-buttons">
                <button type="button" aria-label={texts.mappingSet(texts.mappingUse[use])} onClick={() => { learn(use); }}>
                  {texts.mappingSetButton}
                </button>
                {use !== "forward" && use !== "turn" && use !== "deadman" && draft[use] !== undefined && (
                  <button
                    type="button"
                    aria-label={texts.mappingClear(texts.mappingUse[use])}
                    onClick={() => { setDraft({ ...draft, [use]: undefined }); }}
                  >
                    {texts.mappingClearButton}
                  </button>
                )}
              </td>
            </tr>
          ))}
        </tbody>
      </table>
      <label class="driving-dead-zone">
        {texts.mappingDeadZone} {Math.round(100 * zone)} %
        <input
          type="range" min={DEAD_ZONES.least} max={DEAD_ZONES.most} step="0.01" value={zone}
          onInput={(event) => { setDraft({ ...draft, deadZone: Number(event.currentTarget.value) }); }}
        />
      </label>
      <PadView now={now} />
      <p role="status">{outcome}</p>
      <div class="driving-mapping-buttons">
        <button type="button" onClick={save}>{texts.mappingSave}</button>
        <button type="button" onClick={standard}>{texts.mappingStandard}</button>
      </div>
    </div>
  );
}

function learned(use: Use, rest: PadSnapshot, now: PadSnapshot): AxisUse | number | undefined {
  return use === "forward" || use === "turn" ? pushedAxis(rest, now) : pressedButton(rest, now);
}

function learningWords(use: Use): string {
  return use === "forward" || use === "turn" ? texts.mappingPush : texts.mappingPress;
}

function useWords(value: AxisUse | number | undefined): string {
  if (value === undefined) {
    return texts.mappingUnset;
  }
  return typeof value === "number" ? texts.mappingButton(value) : texts.mappingAxis(value.axis, value.sign);
}
