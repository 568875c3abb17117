/** Who this page is to the robot, and what it may do. */

import { useSignal } from "@preact/signals";
import { useId, useRef } from "preact/hooks";
import type { RobotCommands } from "../../robot/robot_commands";
import type { RobotState } from "../../robot/robot_state";
import { LONGEST_NAME } from "../../session/person_name";
import { sessionTexts as texts } from "../../texts/panels";
import type { Session } from "../../values";
import { Panel } from "../panel";
import { SharePart } from "./share_part";
import type { Sharing } from "./sharing";

export interface SessionPanelProps {
  readonly state: RobotState;
  readonly commands: Pick<RobotCommands, "authenticate">;
  /** Forgets the token and connects anew; undefined if there is none to forget. */
  readonly onLogout?: (() => void) | undefined;
  /** The person's name, and what takes another one. */
  readonly name: string;
  readonly onRename: (name: string) => void;
  /** Shares the robot with others. */
  readonly sharing: Sharing;
}

export function SessionPanel({ state, commands, onLogout, name, onRename, sharing }: SessionPanelProps) {
  const session = state.session.value;
  const logIn = (token: string): void => { commands.authenticate(token); };
  return (
    <Panel title={texts.title} name="session">
      {session === undefined
        ? <Stranger state={state} onToken={logIn} />
        : <Identity session={session} onToken={logIn} onLogout={onLogout} />}
      {session !== undefined && <SharePart sharing={sharing} session={session} state={state} />}
      {state.dialect.value !== "plain" && <NameField name={name} onRename={onRename} />}
    </Panel>
  );
}

/** Nobody yet: refused, not yet recognised, or at a robot that knows no sessions. */
function Stranger({ state, onToken }: { state: RobotState; onToken: (token: string) => void }) {
  const { phase, words } = state.connection.value;
  if (phase === "refused") {
    return <Login words={words} onToken={onToken} />;
  }
  if (phase !== "open") {
    return <p>{words === "" ? texts.unknown : words}</p>;
  }
  return state.dialect.value === "plain"
    ? <p>{texts.plain}</p>
    : (
      <details>
        <summary>{texts.another}</summary>
        <Login words={words} onToken={onToken} />
      </details>
    );
}

function Identity(
  { session, onToken, onLogout }:
  { session: Session; onToken: (token: string) => void; onLogout: (() => void) | undefined },
) {
  return (
    <div>
      <p>{texts.who(session.name)} {session.role !== "" && texts.role(session.role)}</p>
      <p>{texts.may}: {rightsOf(session)}</p>
      {!session.tokens && <p class="panel-quiet">{texts.noTokens}</p>}
      {session.tokens && (
        <details>
          <summary>{texts.another}</summary>
          <Login words="" onToken={onToken} />
        </details>
      )}
      {session.tokens && onLogout !== undefined && (
        <button type="button" onClick={onLogout}>{texts.logout}</button>
      )}
    </div>
  );
}

/** The name can be changed at any time; the page connects anew with it. */
function NameField({ name, onRename }: Pick<SessionPanelProps, "name" | "onRename">) {
  const id = useId();
  const field = useRef<HTMLInputElement>(null);
  const submit = (event: Event): void => {
    event.preventDefault();
    const wanted = field.current?.value.trim() ?? "";
    if (wanted !== "" && wanted !== name) {
      onRename(wanted);
    }
  };
  return (
    <form class="panel-login" onSubmit={submit}>
      <label for={id}>{texts.name}</label>
      <input ref={field} id={id} type="text" defaultValue={name} maxLength={LONGEST_NAME} autoComplete="nickname" spellcheck={false} />
      <button type="submit">{texts.rename}</button>
    </form>
  );
}

/** Return what a session may do, in words. */
export function rightsOf(session: Session): string {
  const keys = ["mayDrive", "mayStop", "mayReset", "mayHint", "maySearch", "mayTakeOver"] as const;
  const may = keys.filter((right) => session[right]).map((right) => texts.rights[right]);
  return may.length === 0 ? texts.nothing : may.join(", ");
}

/** The token goes from the field to the link, and is kept nowhere here. */
function Login({ words, onToken }: { words: string; onToken: (token: string) => void }) {
  const id = useId();
  const field = useRef<HTMLInputElement>(null);
  const says = useSignal("");
  const submit = (event: Event): void => {
    event.preventDefault();
    const input = field.current;
    const token = input?.value.trim() ?? "";
    if (input === null || token === "") {
      says.value = texts.empty;
      return;
    }
    input.value = "";
    says.value = texts.loggingIn;
    onToken(token);
  };
  return (
    <form class="panel-login" onSubmit={submit}>
      {words !== "" && <p role="status">{words}</p>}
      <label for={id}>{texts.token}</label>
      <input ref={field} id={id} type="password" autoComplete="off" autoCapitalize="off" spellcheck={false} />
      <button type="submit" class="panel-primary">{texts.login}</button>
      <p role="status" class="panel-quiet">{says.value}</p>
    </form>
  );
}
