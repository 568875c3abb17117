/** Record a run, save the picture, and look at runs: the robot's, or one of a file. */

import { useSignal } from "@preact/signals";
import { replayTexts as texts } from "../../texts/replay";
import { saveFile, type RunFacts, type Runs } from "../../runs/runs";
import { Panel } from "../panel";

interface RunsProps {
  readonly runs: Runs;
  readonly mayRecord: boolean;
  readonly onLook: (file: File) => void;
  readonly onPicture: () => void;
}

export function RunsPanel({ runs, mayRecord, onLook, onPicture }: RunsProps) {
  const [list, recording] = [runs.list.value, runs.recording.value !== ""];
  const take = (run: RunFacts, use: (file: File) => void): void => {
    void runs.fetch(run).then((file) => { if (file !== undefined) { use(file); } });
  };
  return (
    <Panel title={texts.title} name="runs">
      <p class="runs-buttons">
        {mayRecord && <button type="button" class="runs-record" aria-pressed={recording} onClick={() => { void runs.toggle(); }}>{recording ? texts.recording : texts.record}</button>}
        <button type="button" onClick={onPicture}>{texts.screenshot}</button>
        <button type="button" onClick={() => { void runs.refresh(); }}>{texts.refresh}</button>
      </p>
      {list?.length === 0 && <p>{texts.none}</p>}
      <ul class="runs-list">
        {list?.map((run) => (
          <li key={run.name}>
            <span>{texts.facts(run.start, run.seconds, run.bytes)}</span>
            <span class="runs-buttons">
              <button type="button" aria-label={texts.open(run.name)} onClick={() => { take(run, onLook); }}>{texts.look}</button>
              <button type="button" aria-label={texts.save(run.name)} onClick={() => { take(run, (file) => { saveFile(run.name, file); }); }}>{texts.keep}</button>
              {mayRecord && <Upkeep runs={runs} run={run} />}
            </span>
          </li>
        ))}
      </ul>
      <label class="runs-file">
        {texts.file} <input type="file" accept=".mcap" onChange={({ currentTarget: { files } }) => { const file = files?.[0]; if (file !== undefined) { onLook(file); } }} />
      </label>
      <p>{texts.drop}</p>
    </Panel>
  );
}

/** Keep a run or delete it, which asks once. */
function Upkeep({ runs, run }: { readonly runs: Runs; readonly run: RunFacts }) {
  const asking = useSignal(false);
  return asking.value
    ? (
      <>
        <button type="button" class="runs-sure" onClick={() => { asking.value = false; void runs.remove(run); }}>{texts.sure}</button>
        <button type="button" onClick={() => { asking.value = false; }}>{texts.leave}</button>
      </>
    )
    : (
      <>
        <button type="button" aria-pressed={run.kept} aria-label={texts.stays(run.name)} onClick={() => { void runs.keep(run); }}>{texts.stay}</button>
        <button type="button" aria-label={texts.remove(run.name)} onClick={() => { asking.value = true; }}>{texts.removeShort}</button>
      </>
    );
}
