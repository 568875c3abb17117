/** How fast the robot moves, as measured; up to what the gear goes; and what is near. Large, in the picture. */

import type { Gear } from "../../operating_data";
import { topSpeed } from "../../driving/gears";
import { drivingTexts as texts } from "../../texts/driving";
import type { RobotState } from "../../robot/robot_state";
import { staleness } from "../staleness";
import { useNow } from "../use_now";

/** What is farther away is not said [m]. */
const NEAR = 2;

export function SpeedFigure({ state, gear }: { readonly state: RobotState; readonly gear: Gear }) {
  const now = useNow(200);
  const { motion, nearest } = state;
  const old = staleness(motion.value?.receivedAt, now).stale;
  const speed = motion.value?.linear;
  const near = nearest.value !== undefined && !staleness(nearest.value.receivedAt, now).stale && nearest.value.distance < NEAR
    ? texts.near(nearest.value.distance, nearest.value.bearing)
    : "";
  return (
    <div class={`driving-speed ${old ? "panel-stale" : "panel-fresh"}`} role="img" aria-label={texts.speedLabel(old ? undefined : speed, near)}>
      <strong>{texts.speedFigure(speed)}</strong> m/s
      <span class="driving-speed-limit">{texts.gearLimit(topSpeed(gear))}</span>
      <span class="driving-speed-near" data-close={near !== "" && (nearest.value?.distance ?? NEAR) < 0.5}>{near}</span>
    </div>
  );
}
