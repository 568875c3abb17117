/** What the page hears of the arm, as signals; nothing is asked of a robot that has none. */

import { effect, signal, type ReadonlySignal } from "@preact/signals";
import { setIfChanged } from "../driving/set_if_changed";
import { readArmInfo, readArmState, readRumble } from "../link/message_checks/arm_messages";
import type { RobotWire } from "../link/robot_wire";
import type { ArmInfo, ArmState } from "../robot/arm";
import type { RobotState } from "../robot/robot_state";
import { depend } from "../scene/depend";

/** Shortest time between two states [ms], and where bandwidth is saved. */
const STATE_PERIOD = 50;
const STATE_PERIOD_LEAN = 200;

export class ArmFeed {
  readonly info: ReadonlySignal<ArmInfo | undefined>;
  readonly state: ReadonlySignal<ArmState | undefined>;
  /** Called with the strength of the vibration that the operator shall feel, 0 to 1. */
  onRumble: (strength: number) => void = () => undefined;
  readonly #stop: () => void;

  constructor(wire: Pick<RobotWire, "stream" | "listen">, robot: RobotState, lean: ReadonlySignal<boolean>) {
    const info = signal<ArmInfo | undefined>(undefined);
    const state = signal<ArmState | undefined>(undefined);
    [this.info, this.state] = [info, state];
    const streams = (throttle: number) => [
      wire.stream({ topic: "/arm/info", type: "farsteer_msgs/ArmInfo", latched: true, cbor: true }, {
        read: readArmInfo, use: (value) => { setIfChanged(info, value); },
      }),
      wire.stream({ topic: "/arm/state", type: "farsteer_msgs/ArmState", throttle, cbor: true }, {
        read: readArmState, stampOf: ({ stamp }) => stamp, use: (value) => { state.value = value; },
      }),
      wire.stream({ topic: "/arm/feedback", type: "sensor_msgs/JoyFeedbackArray", cbor: true }, {
        read: readRumble, use: (strength) => { this.onRumble(strength); },
      }),
    ];
    const stops = [
      effect(() => (robot.arm.value ? wire.listen(streams(lean.value ? STATE_PERIOD_LEAN : STATE_PERIOD)) : undefined)),
      effect(() => {
        depend(robot.run);
        state.value = undefined; // another run stands elsewhere
      }),
    ];
    this.#stop = () => { stops.forEach((stop) => { stop(); }); };
  }

  dispose(): void {
    this.#stop();
  }
}
