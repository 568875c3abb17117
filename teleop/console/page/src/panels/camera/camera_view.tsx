/** The camera's picture over the scene, with its age. */

import { useEffect } from "preact/hooks";
import type { CameraFeed } from "../../camera/camera_feed";
import { STALE_AFTER } from "../../operating_data";
import { dataAge } from "../../robot/data_age";
import type { LinkStatisticsSignal, RobotState } from "../../robot/robot_state";
import { cameraTexts as texts } from "../../texts/camera";
import { linkPanelTexts } from "../../texts/panels";
import { useNow } from "../use_now";

interface CameraViewProps {
  readonly feed: CameraFeed;
  readonly state: RobotState;
  readonly link: LinkStatisticsSignal;
}

/** The picture of the chosen stream; nothing if there is none. */
export function CameraView(props: CameraViewProps) {
  useEffect(() => props.feed.watch(), [props.feed]);
  const chosen = props.feed.chosen.value;
  if (chosen?.path === undefined) {
    return null;
  }
  return props.feed.pace.value === "off"
    ? (
      <p class="camera-view camera-off" data-size="small" role="status">
        {texts.given} <button type="button" onClick={() => { props.feed.showAllTheSame(); }}>{texts.allTheSame}</button>
      </p>
    )
    : <Picture {...props} name={chosen.name} />;
}

function Picture({ feed, state, link, name }: CameraViewProps & { readonly name: string }) {
  const now = useNow(100);
  const picture = feed.picture.value;
  const age = picture === undefined ? undefined : dataAge(picture, state, link.peek().roundTrip, now);
  const stale = age === undefined || age.age > STALE_AFTER;
  const trouble = feed.trouble.value;
  return (
    <figure class="camera-view" data-size={feed.large.value ? "large" : "small"} data-stale={stale}>
      <div class="camera-frame" onClick={() => { feed.large.value = true; }}>
        {picture === undefined
          ? <p role="status">{trouble === "" ? texts.waiting : trouble}</p>
          : <img src={picture.url} alt={texts.picture(name)} />}
      </div>
      <figcaption>
        <span class="camera-name">{name}</span>
        <span class="camera-age">{age !== undefined && texts.age(linkPanelTexts.ageWords(age.age), age.lowerBound)}{feed.pace.value === "slow" && ` · ${texts.few}`}</span>
        <button type="button" aria-pressed={feed.large.value} onClick={() => { feed.large.value = !feed.large.value; }}>
          {feed.large.value ? texts.shrink : texts.enlarge}
        </button>
      </figcaption>
    </figure>
  );
}
