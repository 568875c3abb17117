/** What a person wants of the arm at a moment, and its message; each kind has one that stands still. */

import type { RobotWire } from "../../link/robot_wire";
import type { Vector3 } from "../../values";
import type { Hand } from "./hand";

export type ArmWish =
  | { readonly kind: "hand"; readonly hand: Hand }
  /** Rates of the joints [rad/s]. */
  | { readonly kind: "jog"; readonly names: readonly string[]; readonly rates: readonly number[] }
  /** Velocity of the tip [m/s, rad/s] along the axes of a frame. */
  | { readonly kind: "twist"; readonly linear: Vector3; readonly angular: Vector3; readonly frame: "arm_base" | "tool0" }
  /** That a planned motion goes on. */
  | { readonly kind: "plan"; readonly confirmed: boolean };

const ZERO: Vector3 = { x: 0, y: 0, z: 0 };

/** Return the wish of the same kind that asks for no motion. */
export function atRest(wish: ArmWish): ArmWish {
  switch (wish.kind) {
    case "hand":
      return { kind: "hand", hand: { ...wish.hand, engaged: false } };
    case "jog":
      return { ...wish, rates: wish.rates.map(() => 0) };
    case "twist":
      return { ...wish, linear: ZERO, angular: ZERO };
    case "plan":
      return { kind: "plan", confirmed: false };
  }
}

/** Return whether it asks for motion. */
export function asksForMotion(wish: ArmWish): boolean {
  const moves = ({ x, y, z }: Vector3): boolean => x !== 0 || y !== 0 || z !== 0;
  switch (wish.kind) {
    case "hand":
      return wish.hand.engaged;
    case "jog":
      return wish.rates.some((rate) => rate !== 0);
    case "twist":
      return moves(wish.linear) || moves(wish.angular);
    case "plan":
      return wish.confirmed;
  }
}

/** Send a wish; false if it cannot be sent now. */
export function sendWish(wire: Pick<RobotWire, "publish" | "publishPlain">, wish: ArmWish): boolean {
  switch (wish.kind) {
    case "hand": {
      const { frame, ...hand } = wish.hand;
      return wire.publish("/arm/hand", "farsteer_msgs/Hand", frame, hand);
    }
    case "jog":
      return wire.publish("/servo_node/delta_joint_cmds", "control_msgs/JointJog", "", {
        joint_names: wish.names, displacements: [], velocities: wish.rates, duration: 0,
      });
    case "twist":
      return wire.publish("/servo_node/delta_twist_cmds", "geometry_msgs/TwistStamped", wish.frame, {
        twist: { linear: wish.linear, angular: wish.angular },
      });
    case "plan":
      return wire.publishPlain("/arm/confirm", "std_msgs/Bool", { data: wish.confirmed });
  }
}
