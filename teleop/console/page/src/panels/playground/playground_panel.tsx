/** The panel of the playground: only of a simulated robot that was served with one, and loaded when it is opened. */

import { useSignal } from "@preact/signals";
import { useEffect, useMemo } from "preact/hooks";
import type { HintTool } from "../../hint/hint_tool";
import type { RobotWire } from "../../link/robot_wire";
import { playgroundTexts as texts } from "../../texts/playground";
import type { PlanarPose } from "../../values";
import { Panel } from "../panel";
import { Playground } from "./playground";

interface PlaygroundProps {
  readonly wire: Pick<RobotWire, "call">;
  /** Places the ghost in the picture, as for a hint. */
  readonly tool: Pick<HintTool, "begin" | "cancel" | "view">;
  /** Identity of the robot's run: it begins anew with another world. */
  readonly run: string;
}

export function PlaygroundPanel({ wire, tool, run }: PlaygroundProps) {
  const play = useMemo(() => new Playground(wire), [wire]);
  useEffect(() => { void play.look(); }, [play, run]);
  const paused = play.paused.value;
  return (
    <Panel title={texts.title} name="playground">
      <p class="panel-quiet">{texts.simulation}</p>
      <Placing play={play} tool={tool} />
      <div class="panel-buttons">
        <button type="button" aria-pressed={paused} onClick={() => { void play.pause(!paused); }}>{paused ? texts.goOn : texts.pause}</button>
        <button type="button" onClick={() => { void play.slip(); }}>{texts.slip}</button>
        <button type="button" onClick={() => { void play.clear(); }}>{texts.clear}</button>
        <button type="button" onClick={() => { void play.reset(); }}>{texts.reset}</button>
      </div>
      <label>
        {texts.link}{" "}
        <select onChange={({ currentTarget }) => { void play.link(texts.links[currentTarget.selectedIndex]?.[1] ?? []); }}>
          {texts.links.map(([name]) => <option key={name}>{name}</option>)}
        </select>
      </label>
      <World play={play} />
      <p role="status">{paused ? texts.paused : ""} {play.outcome.value}</p>
    </Panel>
  );
}

/** The ghost of a hint says where; nothing of it is sent to the localiser. */
function Placing({ play, tool }: { readonly play: Playground; readonly tool: PlaygroundProps["tool"] }) {
  const { phase, pose } = tool.view.value;
  if (phase !== "placing") {
    return <button type="button" class="panel-primary" onClick={() => { tool.begin(); }}>{texts.place}</button>;
  }
  const put = (what: (pose: PlanarPose) => Promise<void>) => (): void => {
    if (pose !== undefined) {
      tool.cancel();
      void what(pose);
    }
  };
  return (
    <>
      <p>{texts.placeNow}</p>
      <div class="panel-buttons">
        <button type="button" class="panel-primary" disabled={pose === undefined} onClick={put((at) => play.carry(at))}>{texts.robot}</button>
        <button type="button" disabled={pose === undefined} onClick={put((at) => play.put("person", at))}>{texts.person}</button>
        <button type="button" disabled={pose === undefined} onClick={put((at) => play.put("box", at))}>{texts.box}</button>
      </div>
    </>
  );
}

function World({ play }: { readonly play: Playground }) {
  const scene = useSignal("");
  const people = useSignal(false);
  const moved = useSignal(false);
  return (
    <fieldset>
      <legend>{texts.world}</legend>
      <label>
        {texts.scene}{" "}
        <select value={scene.value === "" ? play.present.value : scene.value} onChange={({ currentTarget }) => { scene.value = currentTarget.value; }}>
          {play.scenes.value.map((name) => <option key={name} value={name}>{name}</option>)}
        </select>
      </label>
      <label class="panel-check">
        <input type="checkbox" checked={people.value} onChange={() => { people.value = !people.value; }} /> {texts.people}
      </label>
      <label class="panel-check">
        <input type="checkbox" checked={moved.value} onChange={() => { moved.value = !moved.value; }} /> {texts.moved}
      </label>
      <button type="button" onClick={() => { void play.start(scene.value, people.value, moved.value); }}>{texts.start}</button>
    </fieldset>
  );
}
