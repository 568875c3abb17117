/** Whether the robot follows the page and why it does not, in words that a newcomer understands. */

import { drivingTexts as texts } from "../texts/driving";
import { blockage, type Blockage, type RobotView } from "./blockage";
import type { SourceReading } from "./drive_source";
import { inOurWords, stoppedBy } from "./robot_reasons";
import { turnsOf } from "./turn_taking";

/** What the page itself knows of the person's hands. */
export interface OwnInput {
  /** Whether a held input counts: the page sends commands. */
  readonly driving: boolean;
  /** Whether something is held that does not count. */
  readonly held: boolean;
  readonly centring: boolean;
  readonly noDeadman: boolean;
  /** Whether the only gamepads there are need a mapping. */
  readonly unmapped: boolean;
  readonly focused: boolean;
  /** Whether the hands have a touch screen and nothing else. */
  readonly thumbs: boolean;
  /** Whether the robot drives a step, or its arm moves, as the person told it. */
  readonly moving: boolean;
  /** Whether something else on the page uses the keys. */
  readonly elsewhere: boolean;
  /** Why everything counts as released; undefined if it was not so since the last drive. */
  readonly stopped: string | undefined;
}

/** Return what of the hands the readings of all inputs show. */
export function handsIn(readings: readonly SourceReading[]): Pick<OwnInput, "held" | "centring" | "noDeadman"> {
  return {
    held: readings.some(({ held, active }) => held && !active),
    centring: readings.some(({ centring }) => centring),
    noDeadman: readings.some(({ noDeadman }) => noDeadman),
  };
}

export interface DrivingStatus {
  /** Whether what the person holds, or presses next, moves the robot. */
  readonly will: boolean;
  readonly words: string;
  /** What to do about it; empty if there is nothing to be done. */
  readonly remedy: string;
  readonly tone: "good" | "warn" | "bad";
  /** What keeps the page from moving anything of the robot, whatever the person holds. */
  readonly blocked?: Blockage;
}

type Words = readonly [words: string, remedy: string];

export function drivingStatus(view: RobotView, own: OwnInput): DrivingStatus {
  const found = statusOf(view, own);
  return own.thumbs ? { ...found, remedy: texts.forThumbs(found.remedy) } : found;
}

function statusOf(view: RobotView, own: OwnInput): DrivingStatus {
  const blocked = blockage(view);
  if (blocked === "unguarded" && own.stopped !== undefined) {
    return { ...status(false, [own.stopped, texts.status.unguarded[1]], "bad"), blocked };
  }
  if (blocked !== undefined) {
    const tone = blocked === "connecting" || blocked === "noState" ? "warn" : "bad";
    return { ...status(false, blockageWords(blocked, view), tone), blocked };
  }
  if (!own.focused) {
    return status(false, own.stopped === undefined ? texts.status.unfocused : [own.stopped, texts.status.unfocused[1]], "warn");
  }
  if (own.held && !own.driving) {
    return status(false, texts.letGo(own.stopped ?? texts.heldBack), "warn");
  }
  if (own.centring) {
    return status(false, texts.status.centring, "warn");
  }
  if (own.noDeadman && !own.driving) {
    return status(false, texts.status.noDeadman, "warn");
  }
  if (view.dialect === "plain") {
    return own.driving ? status(true, texts.status.plainDriving, "warn") : resting(own, texts.status.plainReady, "warn");
  }
  return guarded(view, own);
}

/** The status of a robot that guards itself and may be driven. */
function guarded(view: RobotView, own: OwnInput): DrivingStatus {
  const { control, session } = view;
  if (control === undefined) {
    return status(false, texts.status.noState, "warn");
  }
  const mine = turnsOf(control, session).driver === "me";
  const { linkAge, slowAbove, refuseAbove } = control;
  if (mine && refuseAbove > 0 && linkAge > refuseAbove) {
    return status(false, texts.late(linkAge), "bad");
  }
  if (mine && slowAbove > 0 && linkAge > slowAbove) {
    return status(true, texts.slower(linkAge), "warn");
  }
  if (own.driving && (control.guard === "slowed" || control.guard === "stopped")) {
    return status(true, [texts.guarded(control.guardReason), ""], "warn");
  }
  if (own.driving) {
    return status(true, control.armed ? texts.status.driving : texts.status.starting, "good");
  }
  if (own.moving) {
    return status(true, texts.status.moving, "good");
  }
  // The watchdog ends each drive, and a step or the arm takes the robot: that is no news to whoever did it.
  const known = control.reason.startsWith("no command for") || control.reason.endsWith("took the free lease");
  if (own.stopped === undefined && mine && control.state === "disarmed" && !known) {
    const [, remedy] = texts.status.readyMine;
    return status(true, [texts.because(inOurWords(control.reason, session?.name)), remedy], "good");
  }
  return resting(own, mine ? texts.status.readyMine : texts.status.ready, "good");
}

function resting(own: OwnInput, ready: Words, tone: DrivingStatus["tone"]): DrivingStatus {
  if (own.stopped !== undefined) {
    return status(true, texts.stopped(own.stopped), "warn");
  }
  if (own.elsewhere) {
    return status(true, texts.status.elsewhere, tone);
  }
  return own.unmapped ? status(true, texts.status.unmapped, "warn") : status(true, ready, tone);
}

function blockageWords(blocked: Blockage, view: RobotView): Words {
  const { control, session, connection } = view;
  switch (blocked) {
    case "connecting":
    case "refusedConnection": {
      const [words, remedy] = texts.status[blocked];
      return connection.words === "" ? [words, remedy] : [words, connection.words];
    }
    case "estop": {
      const who = stoppedBy(control?.reason ?? "");
      const named = who === undefined ? texts.unknown : who === session?.name ? texts.you : who;
      return texts.estopBy(named, session?.mayReset !== false);
    }
    case "others": {
      const turns = turnsOf(control, session);
      return texts.othersDrive(turns.name, turns.mayAsk || turns.waiting, turns.mayTakeOver);
    }
    case "silent":
      return texts.silent(view.controlAge / 1000);
    default:
      return texts.status[blocked];
  }
}

function status(will: boolean, [words, remedy]: Words, tone: DrivingStatus["tone"]): DrivingStatus {
  return { will, words, remedy, tone };
}
