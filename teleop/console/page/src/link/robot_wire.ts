/** The robot by the names of its topics, services and actions: for parts of the page that are loaded when they are asked for. */

import type { Answer } from "../values";
import type { GoalListener } from "./action_goals";
import type { Kind, MessageIntake, Request } from "./message_intake";
import type { RobotCommander } from "./robot_commander";
import type { Reply, ServiceCalls } from "./service_calls";
import type { Stream, Subscriptions } from "./subscriptions";

export interface RobotWire {
  /** A topic whose messages are checked and used as those of the page's own are. */
  stream<T>(request: Request, kind: Kind<T>): Stream;
  /** Listen to these topics too, on each connection anew; the returned function ends it. */
  listen(streams: readonly Stream[]): () => void;
  /** Publish a message with the time of sending in its header; false if it cannot be sent now. */
  publish(topic: string, type: string, frame: string, message: object): boolean;
  /** Publish a message that has no header. */
  publishPlain(topic: string, type: string, message: object): boolean;
  /** Call a service that answers within some seconds, or within these. */
  call(service: string, request: object, seconds?: number): Promise<Reply>;
  /** Call a service that answers whether it was done, and why not. */
  trigger(service: string, request?: object, seconds?: number): Promise<Answer>;
  /** Send a goal; returns what cancels it, or undefined if it cannot be sent now. */
  goal(action: string, type: string, goal: object, listener: GoalListener): (() => void) | undefined;
}

export function robotWire(
  intake: MessageIntake, subscriptions: Subscriptions, calls: ServiceCalls, commander: RobotCommander,
): RobotWire {
  return {
    stream: (request, kind) => intake.stream(request, kind),
    listen: (streams) => subscriptions.also(streams),
    publish: (topic, type, frame, message) => commander.publish(topic, type, { ...commander.header(frame), ...message }),
    publishPlain: (topic, type, message) => commander.publish(topic, type, message),
    call: (service, request, seconds) => calls.call(service, request, seconds),
    trigger: (service, request, seconds) => calls.trigger(service, request, seconds),
    goal: (action, type, goal, listener) => commander.goal(action, type, goal, listener),
  };
}
