/** How good the link is: as a whole in one word, its figures, and each stream. */

import { colourOf, LINK_THRESHOLDS, linkWord, LOST_AFTER } from "../../alarms/link_grade";
import { LINK_WORDS, type LinkWord } from "../../operating_data";
import type { Hop, HopName, LinkStatistics, LinkStatisticsSignal, RobotState, StreamStatistics } from "../../robot/robot_state";
import { linkPanelTexts as texts } from "../../texts/panels";
import { Panel, Row } from "../panel";
import { Tooltip } from "../tooltip";

const WAYS: Readonly<Record<"view" | "command", readonly HopName[]>> = {
  view: ["robot", "queue", "wireDown", "page", "drawn"],
  command: ["hand", "wireUp", "gateway", "control"],
};

/** The link in one word with its colour, for the page's bar. */
export function LinkLamp({ link, state }: { link: LinkStatisticsSignal; state: RobotState }) {
  const word = linkWord(state.connection.value.phase === "open", link.value);
  return <Lamp word={word} />;
}

function Lamp({ word }: { word: LinkWord }) {
  return (
    <span class="panel-lamp" data-grade={LINK_WORDS[word].colour}>
      <span class="panel-lamp-mark" aria-hidden="true" />
      {texts.title}: {LINK_WORDS[word].words}
    </span>
  );
}

export function LinkPanel({ link, state }: { link: LinkStatisticsSignal; state: RobotState }) {
  const now = link.value;
  const word = linkWord(state.connection.value.phase === "open", now);
  const { roundTrip, jitter, silence } = LINK_THRESHOLDS;
  return (
    <Panel title={texts.title} name="link" aside={<><Lamp word={word} /><Thresholds /></>}>
      <dl class="panel-rows">
        <Row name={texts.roundTrip} grade={colourOf(now.roundTrip, roundTrip)}>{texts.milliseconds(now.roundTrip)}</Row>
        <Row name={texts.roundTripP95} grade={colourOf(now.roundTripP95, roundTrip)}>
          {texts.milliseconds(now.roundTripP95)}
        </Row>
        <Row name={texts.jitter} grade={colourOf(now.jitter, jitter)}>{texts.milliseconds(now.jitter)}</Row>
        <Row name={texts.received}>{texts.bitRate(now.bytesPerSecond)}</Row>
        <Row name={texts.silence} grade={colourOf(now.silence, silence)}>
          {Number.isFinite(now.silence) ? texts.ago(now.silence) : texts.never}
        </Row>
      </dl>
      {Object.entries(WAYS).map(([way, names]) => (
        <Way key={way} name={way === "view" ? texts.ways.view : texts.ways.command} hops={now.hops.filter(({ name }) => names.includes(name))} />
      ))}
      <Streams link={now} />
    </Panel>
  );
}

/** A way as a bar, a piece for each part, and in words. */
function Way({ name, hops }: { name: string; hops: readonly Hop[] }) {
  const total = hops.reduce((sum, { took }) => sum + took, 0);
  return (
    <div class="panel-way" hidden={hops.length === 0}>
      {texts.way(name, total)}
      <span class="panel-way-bar" aria-hidden="true">
        {hops.map((hop) => <span key={hop.name} data-hop={hop.name} data-grows={hop.grows} style={{ flexGrow: hop.took }} />)}
      </span>
      <small>
        {hops.map((hop) => (
          <span key={hop.name} data-hop={hop.name} data-grows={hop.grows}>{texts.hop(texts.hops[hop.name], hop.took, hop.grows)}</span>
        ))}
      </small>
    </div>
  );
}

function Thresholds() {
  const { roundTrip, jitter, silence } = LINK_THRESHOLDS;
  const lines = [
    texts.threshold(texts.roundTrip, roundTrip.green, roundTrip.amber),
    texts.threshold(texts.jitter, jitter.green, jitter.amber),
    texts.threshold(texts.silence, silence.green, silence.amber),
    texts.lostAfter(LOST_AFTER),
  ];
  return (
    <Tooltip label={texts.about}>
      {lines.map((line) => <span class="panel-line" key={line}>{line}</span>)}
    </Tooltip>
  );
}

function Streams({ link }: { link: LinkStatistics }) {
  return (
    <details class="panel-streams">
      <summary>{texts.streams} ({link.streams.length})</summary>
      <table>
        <thead>
          <tr>
            <th scope="col">{texts.topic}</th>
            <th scope="col">{texts.age}</th>
            <th scope="col">{texts.rate}</th>
            <th scope="col" title={texts.droppedHint}>{texts.dropped}</th>
          </tr>
        </thead>
        <tbody>{link.streams.map((stream) => <Stream key={stream.topic} stream={stream} />)}</tbody>
      </table>
    </details>
  );
}

/** Streams that come rarely (maps, models) are not late: only those that flow are judged by their age. */
function Stream({ stream }: { stream: StreamStatistics }) {
  const flows = stream.rate >= 1;
  const grade = flows ? colourOf(stream.age, LINK_THRESHOLDS.age) : "unknown";
  return (
    <tr data-grade={grade}>
      <th scope="row">{stream.topic}</th>
      <td>{stream.age === undefined ? texts.never : texts.ageWords(stream.age)}</td>
      <td>{stream.rate.toFixed(1)}</td>
      <td>{stream.dropped}</td>
    </tr>
  );
}
