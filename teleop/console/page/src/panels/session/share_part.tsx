/** Who is here, links for others, and the devices that have one; the robot is asked when the part is opened. */

import { useSignal } from "@preact/signals";
import { useId } from "preact/hooks";
import type { RobotState } from "../../robot/robot_state";
import { sharingTexts as texts } from "../../texts/session";
import type { Session } from "../../values";
import type { Sharing } from "./sharing";

export function SharePart({ sharing, session, state }: { readonly sharing: Sharing; readonly session: Session; readonly state: RobotState }) {
  const look = (): void => { void sharing.look(session.mayShare); };
  return (
    <details onToggle={(event) => { if (event.currentTarget.open) { look(); } }}>
      <summary>{texts.title}</summary>
      <h3>{texts.here}</h3>
      <ul class="session-list">
        {sharing.people.value.map(({ number, name, role }) => (
          <li key={number}>
            {number === session.client ? texts.me(name) : name}: {texts.role(role)}
            {name === state.control.value?.controller && `, ${texts.driving}`}
          </li>
        ))}
      </ul>
      <button type="button" onClick={look}>{texts.look}</button>
      {session.mayShare ? <LinkMaker sharing={sharing} role={session.role} /> : !["view", "recording"].includes(session.role) && <p class="panel-quiet">{texts.notHere}</p>}
      <p role="status">{sharing.outcome.value}</p>
      {session.mayShare && <Tokens sharing={sharing} />}
    </details>
  );
}

function LinkMaker({ sharing, role }: { readonly sharing: Sharing; readonly role: string }) {
  const id = useId();
  const wanted = useSignal<"view" | "operate">("view");
  const seconds = useSignal<number>(texts.times[0][1]);
  const shared = sharing.shared.value;
  const choices = role === "view" ? (["view"] as const) : (["view", "operate"] as const);
  return (
    <fieldset>
      <legend>{texts.make}</legend>
      <div class="panel-choice">
        {choices.map((choice) => (
          <label key={choice}>
            <input type="radio" name={id} checked={wanted.value === choice} onChange={() => { wanted.value = choice; }} />
            {choice === "view" ? texts.watch : texts.drive}
          </label>
        ))}
      </div>
      <label>
        {texts.ends}{" "}
        <select onChange={({ currentTarget }) => { seconds.value = Number(currentTarget.value); }}>
          {texts.times.map(([words, value]) => <option key={value} value={value}>{words}</option>)}
        </select>
      </label>
      <button type="button" class="panel-primary" onClick={() => { void sharing.share(wanted.value, seconds.value); }}>{texts.share}</button>
      {shared !== undefined && (
        <>
          <p>{texts.open}</p>
          {shared.picture !== "" && <img class="session-code" src={shared.picture} alt={texts.code} />}
          <label>{texts.copy} <input type="text" readOnly value={shared.link} onFocus={({ currentTarget }) => { currentTarget.select(); }} /></label>
        </>
      )}
    </fieldset>
  );
}

function Tokens({ sharing }: { readonly sharing: Sharing }) {
  return (
    <>
      <h3>{texts.tokens}</h3>
      <ul class="session-list">
        {sharing.tokens.value.map(({ name, role, seconds, link }) => (
          <li key={name}>
            {texts.token(name, role, seconds, link)}
            <button type="button" aria-label={texts.revokeNamed(name)} onClick={() => { void sharing.revoke(name); }}>{texts.revoke}</button>
          </li>
        ))}
      </ul>
    </>
  );
}
