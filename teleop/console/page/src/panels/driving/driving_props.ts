/** What the panels of driving are given. */

import type { Driving } from "../../driving/driving";
import type { RobotState } from "../../robot/robot_state";

export interface DrivingProps {
  readonly driving: Driving;
  readonly state: RobotState;
}
