/** A device that came by a link asks for a token of its own, and goes on with that: the link is not its key. */

import { effect } from "@preact/signals";
import type { RobotWire } from "../link/robot_wire";
import { readReply } from "../link/service_calls";
import type { RobotState } from "../robot/robot_state";

/** Ask once for each connection that a link's token opened; `take` is given the device's own. */
export function takeOwnToken(
  wire: Pick<RobotWire, "call">, state: Pick<RobotState, "session">, name: () => string, take: (token: string) => void,
): void {
  let askedBy: number | undefined;
  effect(() => {
    const session = state.session.value;
    if (session?.link === true && session.client !== askedBy) {
      askedBy = session.client;
      void wire.call("/teleop/own_token", { device: name() }).then((reply) => {
        const answer = readReply(reply, (values) => values.at("token").text(256, false));
        if (answer.ok && answer.value !== "") {
          take(answer.value);
        }
      });
    }
  });
}
