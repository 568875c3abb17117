/** Has a simulated robot carried off, by the services of its playground. */

import { effect, signal, type ReadonlySignal } from "@preact/signals";
import type { Field } from "../link/message_checks/field";
import { pose } from "../link/message_checks/geometry";
import type { RobotWire } from "../link/robot_wire";
import { readReply } from "../link/service_calls";
import type { RobotState } from "../robot/robot_state";
import type { Pose } from "../values";

/** How far off the robot is carried at least [m]: more than any localiser takes for slipping wheels; chosen. */
const FAR = 3;

export class Carrier {
  readonly #wire: Pick<RobotWire, "call">;
  readonly #state: RobotState;
  readonly #there = signal(false);
  #places: readonly Pose[] = [];

  constructor(wire: Pick<RobotWire, "call">, state: RobotState) {
    this.#wire = wire;
    this.#state = state;
    effect(() => {
      if (state.run.value !== "" && state.session.value?.mayDrive === true) {
        void this.#look();
      }
    });
  }

  /** Whether the robot has a playground that lets this client carry it. */
  get there(): ReadonlySignal<boolean> {
    return this.#there;
  }

  /** Put the robot down at the first of the scene's places that is far from where it takes itself to be. */
  async carry(): Promise<string> {
    const here = this.#state.mapFromBase.peek()?.position ?? { x: 0, y: 0 };
    const far = this.#places.find(({ position }) => Math.hypot(position.x - here.x, position.y - here.y) > FAR);
    const reply = await this.#wire.call("/playground/set_entity_state", {
      entity: "robot", set_pose: true, state: { pose: far ?? this.#places[0] },
    });
    const failed = readReply(reply, readFailure);
    return failed.ok ? failed.value : failed.words;
  }

  async #look(): Promise<void> {
    const places = readReply(await this.#wire.call("/playground/get_named_poses", {}), readPlaces);
    this.#places = places.ok ? places.value : [];
    this.#there.value = this.#places.length > 0;
  }
}

/** `simulation_interfaces/GetNamedPoses`. */
function readPlaces(values: Field): readonly Pose[] {
  return values.at("poses").list(1000).map((each) => pose(each.at("pose")));
}

/** `simulation_interfaces/Result`: why it failed; an empty text if it did not. */
function readFailure(values: Field): string {
  const result = values.at("result");
  return result.at("result").count(255) === 1 ? "" : result.at("error_message").text(1000);
}
