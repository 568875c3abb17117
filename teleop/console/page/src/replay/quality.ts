/** How good the localisation of a run was, over time and over the map. */

import { readEstimate } from "../link/message_checks/pose_messages";
import { readStatus } from "../link/message_checks/robot_messages";
import { check } from "../link/message_checks/field";
import type { Health, Vector3 } from "../values";
import type { Run } from "./run_reader";

/** One moment of a run. */
export interface Quality {
  /** Since the run's beginning [ms]. */
  readonly at: number;
  readonly health: Health;
  /** Share of the sweep that the map explains, 0 to 1. */
  readonly fit: number;
  /** Standard deviation of the position [m]. */
  readonly sigma: number;
  /** Where the robot took itself to be; undefined before the first estimate. */
  readonly position: Vector3 | undefined;
}

/** Return the quality at each status of a run. */
export function qualityOf(run: Run): readonly Quality[] {
  const found: Quality[] = [];
  let position: Vector3 | undefined;
  for (const message of run.messages) {
    if (message.topic === "/amcl_pose") {
      const estimate = check((field) => readEstimate(field, 0), message.decode());
      position = estimate.ok ? estimate.value.pose.position : position;
    } else if (message.topic === "/localization/status") {
      const status = check(readStatus, message.decode());
      if (status.ok) {
        const { health, fit, positionSigma } = status.value;
        found.push({ at: message.at, health, fit, sigma: positionSigma, position });
      }
    }
  }
  return found;
}

/** How a state is judged, which chooses its colour. */
export function gradeOf(health: Health): "good" | "warn" | "bad" | "stale" {
  if (health === "tracking") {
    return "good";
  }
  if (health === "waiting") {
    return "stale";
  }
  return health === "suspect" || health === "lost" ? "bad" : "warn";
}
