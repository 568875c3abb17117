/** Which of the camera's streams is shown, and photographs. */

import type { CameraFeed } from "../../camera/camera_feed";
import type { PhotoControl } from "../../camera/photo_control";
import type { RobotState } from "../../robot/robot_state";
import { cameraTexts as texts } from "../../texts/camera";
import { Panel } from "../panel";

interface CameraPanelProps {
  readonly feed: CameraFeed;
  readonly photo: PhotoControl;
  readonly state: RobotState;
}

/** The panel of a robot that has a camera; of others nothing. */
export function CameraPanel({ feed, photo, state }: CameraPanelProps) {
  const streams = feed.streams.value;
  if (streams.length === 0) {
    return null;
  }
  const shown = streams.filter(({ path }) => path !== undefined);
  return (
    <Panel title={texts.title} name="camera">
      <label class="camera-choice">
        <span>{texts.stream}</span>
        <select
          value={feed.chosen.value?.path === undefined ? "" : feed.chosen.value.name}
          onChange={(event) => { feed.choice.value = event.currentTarget.value; }}
        >
          <option value="">{texts.off}</option>
          {shown.map(({ name }) => <option key={name} value={name}>{name}</option>)}
        </select>
      </label>
      {streams.filter(({ path }) => path === undefined).map(({ name, address }) => (
        <p key={name} class="panel-quiet">{name} {texts.elsewhere} {address}</p>
      ))}
      {state.session.value?.mayDrive !== false && <Photo photo={photo} state={state} />}
    </Panel>
  );
}

function Photo({ photo, state }: Pick<CameraPanelProps, "photo" | "state">) {
  const answer = photo.answer.value;
  const away = state.connection.value.phase !== "open";
  return (
    <>
      <button type="button" class="camera-photo" disabled={away || photo.busy.value} onClick={() => { void photo.take(); }}>
        {texts.photo}
      </button>
      <p class="camera-result" role="status">
        {photo.busy.value && texts.taking}
        {!photo.busy.value && answer !== undefined && (answer.success
          ? <>{texts.stored} <PhotoLink photo={photo} name={answer.name} tokens={state.session.value?.tokens === true} /></>
          : texts.noPhoto(answer.message))}
        {photo.trouble.value !== "" && ` ${photo.trouble.value}`}
      </p>
    </>
  );
}

function PhotoLink({ photo, name, tokens }: { photo: PhotoControl; name: string; tokens: boolean }) {
  return (
    <a
      href={photo.address(name)}
      target="_blank"
      rel="noopener"
      onClick={(event) => {
        if (tokens) {
          event.preventDefault();
          void photo.open(name, () => window.open("", "_blank"));
        }
      }}
    >
      {name}
    </a>
  );
}
