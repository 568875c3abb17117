/** A robot that records what it is sent, a page to press keys on, and a clock to move on. */

import { vi } from "vitest";
import { Driving } from "../../src/driving/driving";
import type { RobotCommands } from "../../src/robot/robot_commands";
import { unknownState, type RobotState } from "../../src/robot/robot_state";
import type { Answer, ControlState, Session } from "../../src/values";

export interface SentJoy {
  readonly at: number;
  readonly forward: number;
  readonly turn: number;
  readonly deadman: boolean;
  readonly turbo: boolean;
}

export const ME = "client 2 (127.0.0.1:40000)";
export const OTHER = "client 3 (127.0.0.1:50000)";

export const SESSION: Session = {
  client: 2, name: ME, role: "operate", tokens: true,
  mayDrive: true, mayStop: true, mayReset: true, mayHint: true, maySearch: true, mayTakeOver: true, mayShare: false, link: false, mayPlay: false,
};

export const CONTROL: ControlState = {
  stamp: 1, state: "idle", reason: "no driver yet", controller: "", armed: false, estop: false,
  commandAge: 0, linear: 0, angular: 0, linkAge: 0, slowAbove: 0.5, refuseAbove: 1, asking: 0, askingName: "", guard: "free", guardReason: "", guardOffBy: "",
};

export interface FakePad {
  id: string;
  index: number;
  connected: boolean;
  mapping: string;
  timestamp: number;
  axes: number[];
  buttons: { pressed: boolean; value: number }[];
}

/** Everything that a test of driving needs; the clock is its own until it is disposed of. */
export class Harness {
  readonly state: RobotState = unknownState();
  readonly joys: SentJoy[] = [];
  readonly velocities: { linear: number; angular: number }[] = [];
  readonly calls: string[] = [];
  /** Whether commands can be sent. */
  reachable = true;
  answer: () => Promise<Answer> = () => Promise.resolve({ success: true, message: "" });
  pads: (FakePad | null)[] = [];
  visibility: DocumentVisibilityState = "visible";
  /** Added to the wall clock, as if the computer had slept without its monotonic clock. */
  wallSkew = 0;
  /** Whether the robot reports its state ten times a second, and follows what is sent. */
  reporting = true;
  control: ControlState = CONTROL;
  readonly driving: Driving;
  readonly pad: HTMLElement;
  private readonly timer: ReturnType<typeof setInterval>;

  constructor(dialect: "farsteer" | "plain" = "farsteer") {
    vi.useFakeTimers();
    document.body.replaceChildren();
    localStorage.clear();
    Object.defineProperty(document, "visibilityState", { configurable: true, get: () => this.visibility });
    Object.defineProperty(navigator, "getGamepads", { configurable: true, value: () => this.pads });
    this.state.connection.value = { phase: "open", words: "", sinceAt: 0 };
    this.state.dialect.value = dialect;
    this.state.session.value = dialect === "farsteer" ? SESSION : undefined;
    this.state.control.value = dialect === "farsteer" ? this.control : undefined;
    this.driving = new Driving(this.commands(), this.state, {
      window, document, navigator, now: () => performance.now(), wallNow: () => Date.now() + this.wallSkew,
    });
    this.pad = document.createElement("div");
    this.pad.setPointerCapture = () => undefined;
    document.body.append(this.pad);
    this.driving.stick.attach(this.pad);
    this.timer = setInterval(() => { this.report(); }, 100);
  }

  dispose(): void {
    clearInterval(this.timer);
    this.driving.dispose();
    vi.useRealTimers();
  }

  /** Let time pass [ms]. */
  wait(time: number): void {
    vi.advanceTimersByTime(time);
  }

  async settle(): Promise<void> {
    await vi.advanceTimersByTimeAsync(0);
  }

  /** Say something else about the control state, as the robot would. */
  says(change: Partial<ControlState>): void {
    this.control = { ...this.control, ...change };
    this.state.control.value = { ...this.control };
  }

  key(type: "keydown" | "keyup", code: string, init: KeyboardEventInit = {}, target: EventTarget = document.body): KeyboardEvent {
    const event = new KeyboardEvent(type, { code, bubbles: true, cancelable: true, ...init });
    target.dispatchEvent(event);
    return event;
  }

  pointer(type: string, x = 0, y = 0, pointerId = 1): void {
    this.pad.dispatchEvent(new PointerEvent(type, {
      pointerId, clientX: x, clientY: y, button: 0, buttons: 1, pointerType: "touch", bubbles: true, cancelable: true,
    }));
  }

  plug(id = "pad", mapping = "standard"): FakePad {
    const pad: FakePad = {
      id, index: this.pads.length, connected: true, mapping, timestamp: 1,
      axes: [0, 0, 0, 0],
      buttons: Array.from({ length: 17 }, () => ({ pressed: false, value: 0 })),
    };
    this.pads = [...this.pads, pad];
    return pad;
  }

  hide(): void {
    this.visibility = "hidden";
    document.dispatchEvent(new Event("visibilitychange"));
  }

  reveal(): void {
    this.visibility = "visible";
    document.dispatchEvent(new Event("visibilitychange"));
  }

  get last(): SentJoy | undefined {
    return this.joys.at(-1);
  }

  /** Whether the last command moves the robot. */
  get moving(): boolean {
    return moves(this.last);
  }

  /** Whether anything that moves was sent since the call with this count of commands. */
  movedSince(count: number): boolean {
    return this.joys.slice(count).some(moves);
  }

  /** The robot's state as of its own rules, in short: who holds the deadman drives once a neutral command was seen. */
  private report(): void {
    if (!this.reporting || this.state.dialect.value !== "farsteer") {
      return;
    }
    const { control, last } = this;
    const free = control.controller === "" || control.controller === ME;
    if (!control.estop && free && last?.deadman === true && control.state === "idle") {
      this.control = { ...control, state: "armed", armed: true, controller: ME, reason: "neutral" };
    }
    this.state.control.value = { ...this.control };
  }

  private commands(): RobotCommands {
    return {
      joy: (forward, turn, deadman, turbo) => {
        if (this.reachable) {
          this.joys.push({ at: performance.now(), forward, turn, deadman, turbo });
        }
        return this.reachable;
      },
      velocity: (linear, angular) => {
        if (this.reachable) {
          this.velocities.push({ linear, angular });
        }
        return this.reachable;
      },
      request: (wish) => {
        this.calls.push(wish);
        return this.answer();
      },
      hint: () => false,
      previewHint: () => Promise.resolve(undefined),
      authenticate: () => undefined,
    };
  }
}

export function moves(joy: SentJoy | undefined): boolean {
  return joy !== undefined && joy.deadman && (joy.forward !== 0 || joy.turn !== 0);
}
