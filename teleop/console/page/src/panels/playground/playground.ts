/** What the playground asks of the simulation. */

import { signal } from "@preact/signals";
import type { Field } from "../../link/message_checks/field";
import type { RobotWire } from "../../link/robot_wire";
import { readReply } from "../../link/service_calls";
import { upright } from "../../scene/geometry";
import { playgroundTexts as texts } from "../../texts/playground";
import type { PlanarPose } from "../../values";

/** `simulation_interfaces`: codes of results, states and scopes. */
const OK = 1;
const PLAYING = 1;
const PAUSED = 2;
const SPAWNED = 4;
const STATE_AND_SPAWNED = 6;
/** Wheels that spin at twice their speed for a second, as `farsteer serve --slip` has them. */
const SLIP = { seconds: 1, factor: 2 };

export class Playground {
  readonly scenes = signal<readonly string[]>([]);
  readonly present = signal("");
  readonly paused = signal(false);
  /** What came of the last request, in words. */
  readonly outcome = signal("");
  private moved = 0;

  constructor(private readonly wire: Pick<RobotWire, "call">) {}

  /** Learn what there is, and whether the world stands still. */
  async look(): Promise<void> {
    this.scenes.value = (await this.ask("get_available_worlds", {}, (values) =>
      values.at("worlds").list(100).map((world) => world.at("name").text()))) ?? [];
    this.present.value = (await this.ask("get_current_world", {}, (values) => values.at("world").at("name").text())) ?? "";
    this.paused.value = (await this.ask("get_simulation_state", {}, (values) => values.at("state").at("state").count(255))) === PAUSED;
  }

  async carry(pose: PlanarPose): Promise<void> {
    await this.do("set_entity_state", { entity: "robot", set_pose: true, state: { pose: upright(pose, 0) } });
  }

  /** Put a person or a box down. */
  async put(what: "person" | "box", pose: PlanarPose): Promise<void> {
    const uri = what === "person" ? "person" : "box_0.6x0.6x1";
    await this.do("spawn_entity", { allow_renaming: true, entity_resource: { uri }, initial_pose: { pose: upright(pose, 0) } });
  }

  async clear(): Promise<void> {
    await this.do("reset_simulation", { scope: SPAWNED });
  }

  async reset(): Promise<void> {
    await this.do("reset_simulation", { scope: STATE_AND_SPAWNED });
  }

  async pause(paused: boolean): Promise<void> {
    if (await this.do("set_simulation_state", { state: { state: paused ? PAUSED : PLAYING } })) {
      this.paused.value = paused;
    }
  }

  async slip(): Promise<void> {
    await this.do("slip", SLIP);
  }

  async link(settings: readonly string[]): Promise<void> {
    await this.do("link", { settings });
  }

  /** Have the robot start anew; furniture that has moved stands elsewhere each time. */
  async start(scene: string, people: boolean, moved: boolean): Promise<void> {
    this.moved += 1;
    if (await this.do("world", { scene, people, rearranged: moved ? this.moved : -1 })) {
      this.outcome.value = texts.starting;
    }
  }

  private async do(service: string, request: object): Promise<boolean> {
    this.outcome.value = "";
    const why = await this.ask(service, request, reasonOf);
    if (why !== undefined) {
      this.outcome.value = why === "" ? texts.done : texts.refused(why);
    }
    return why === "";
  }

  private async ask<T>(service: string, request: object, read: (values: Field) => T): Promise<T | undefined> {
    const answer = readReply(await this.wire.call(`/playground/${service}`, request), read);
    if (answer.ok) {
      return answer.value;
    }
    this.outcome.value = texts.refused(answer.words);
    return undefined;
  }
}

/** Return why something was not done; empty if it was. Our own services say `success`, those of the standard a `result`. */
function reasonOf(values: Field): string {
  const result = values.at("result");
  if (result.missing) {
    return values.at("success").boolean() ? "" : values.at("message").text(1000);
  }
  return result.at("result").count(255) === OK ? "" : result.at("error_message").text(1000);
}
