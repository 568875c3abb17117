/** What keeps the page from driving at all, whatever the person holds. */

import type { Connection, Dialect } from "../robot/robot_state";
import type { ControlState, Session } from "../values";

export type Blockage =
  | "connecting" | "lost" | "refusedConnection" | "unknownDialect" | "unguarded" | "noState" | "silent" | "estop" | "recording" | "watching"
  | "others";

/** What is known of the robot that bears upon driving. */
export interface RobotView {
  readonly connection: Connection;
  readonly dialect: Dialect;
  readonly session: Session | undefined;
  readonly control: ControlState | undefined;
  /** Time since the control state arrived [ms]. */
  readonly controlAge: number;
  /** Whether the person has confirmed that nothing guards this robot. */
  readonly plainConfirmed: boolean;
}

/** A control state older than this is none [ms]; it comes ten times a second. */
export const SILENT = 1000;

/** Return what blocks driving, the most important first; undefined if nothing does. */
export function blockage(view: RobotView): Blockage | undefined {
  const { connection, dialect, session, control } = view;
  if (connection.phase !== "open") {
    const kinds = { connecting: "connecting", lost: "lost", refused: "refusedConnection" } as const;
    return kinds[connection.phase];
  }
  if (dialect === "unknown") {
    return "unknownDialect";
  }
  if (dialect === "plain") {
    return view.plainConfirmed ? undefined : "unguarded";
  }
  if (session?.role === "recording") {
    return "recording";
  }
  if (control?.estop === true) {
    return "estop";
  }
  if (session?.mayDrive === false) {
    return "watching";
  }
  if (control === undefined) {
    return "noState";
  }
  if (view.controlAge > SILENT) {
    return "silent";
  }
  // Without a session the page does not know its own name: then the robot's answer decides.
  return control.controller !== "" && session !== undefined && control.controller !== session.name ? "others" : undefined;
}
