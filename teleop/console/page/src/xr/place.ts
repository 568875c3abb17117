/** Where the operator stands in the map: beside the robot, on it, behind it, or before a table with the building on it. */

import { Matrix4, Quaternion, Vector3, type Group } from "three";
import { headingOf, wrap } from "../scene/geometry";
import type { SmoothPose } from "../scene/smooth_pose";

export const STANDS = ["free", "ride", "chase", "table"] as const;
/** At a place of one's own, on the robot, behind it, or as a giant before a model of the building. */
export type Stand = (typeof STANDS)[number];

/** Scale of the model on the table, and its height and distance before the operator [m]. */
export const TABLE = { scale: 20, height: 0.8, ahead: 0.7 } as const;
/** Distance to the robot of one who follows it, or begins beside it [m]. */
const BEHIND = 1.8;
/**
 * How quickly the operator is carried after the robot [1/s], as by a critically damped spring: commands that jump come as
 * accelerations that grow for a fifth of a second. Chosen; the lag at 0.7 m/s is 0.23 m.
 */
const CARRY = 6;
/** A robot that jumps farther than this was found elsewhere, and the operator is put there [m]. */
const LEAP = 1;

/** The room's axes in the map for a heading of 0: x right, y up, z back. */
export const UPRIGHT = new Quaternion().setFromRotationMatrix(
  new Matrix4().makeBasis(new Vector3(0, -1, 0), new Vector3(0, 0, 1), new Vector3(-1, 0, 0)),
);
const UP = new Vector3(0, 0, 1);

/** What may move the operator against the operator's own body; both off at first. */
export interface Carrying {
  /** Whether the room turns with the robot. */
  readonly turns: boolean;
  /** Whether the room tilts with the robot. */
  readonly tilts: boolean;
}

export class Place {
  stand: Stand = "free";
  /** Direction in the map in which the room looks [rad]. */
  heading = 0;
  /** Artificial motion in this frame, as the operator sees it: [m/s], [rad/s]. */
  speed = 0;
  turnRate = 0;
  /** The point of the map that lies on the point `fixed` of the room. */
  readonly #spot = new Vector3();
  readonly #fixed = new Vector3();
  readonly #carried = new Vector3();
  readonly #velocity = new Vector3();
  #robotHeading: number | undefined;
  readonly #head = new Vector3();
  /** Direction of the head in the room, left of ahead, and as it was when the operator came to stand here [rad]. */
  #looks = 0;
  #looked = 0;
  readonly #offset = new Vector3();
  readonly #turn = new Quaternion();
  readonly #yaw = new Quaternion();

  /** @param room Is placed in the map. */
  constructor(private readonly room: Group, private readonly robot: SmoothPose) {}

  get scale(): number {
    return this.stand === "table" ? TABLE.scale : 1;
  }

  /** Stand elsewhere, looking where one looks. @param middle Of the building, on its floor. */
  take(stand: Stand, middle: Vector3): void {
    this.stand = stand;
    this.#looked = this.#looks;
    this.#leap();
    this.recentre();
    if (stand === "table") {
      this.#spot.copy(middle);
      const [aside, ahead] = [TABLE.ahead * Math.sin(this.#looks), TABLE.ahead * Math.cos(this.#looks)];
      this.#fixed.set(this.#head.x - aside, TABLE.height, this.#head.z - ahead);
    } else if (stand === "free" && this.robot.known) {
      this.heading = wrap(this.robot.heading - this.#looks);
      this.#spot.copy(this.#behind(this.robot.position));
    }
  }

  /** Put the middle of the model at a place of the room, as on a table that was found there. */
  putTable(at: Vector3): void {
    this.#fixed.copy(at);
  }

  /** Stand at a place of the map's floor. */
  teleport(to: Vector3): void {
    this.stand = "free";
    this.recentre();
    this.#spot.copy(to);
  }

  /** Turn about oneself to the left [rad]. */
  turn(angle: number): void {
    if (this.stand === "free") {
      // About the head, wherever it is in the room.
      this.#spot.copy(this.room.localToWorld(this.#offset.copy(this.#fixed).setX(this.#head.x).setZ(this.#head.z)));
      this.recentre();
    }
    this.heading = wrap(this.heading + angle);
    this.#place();
  }

  /** Stand where the head is now: the room's origin may have moved. */
  recentre(): void {
    if (this.stand !== "table") {
      this.#fixed.set(this.#head.x, 0, this.#head.z);
    }
  }

  /** Note where the head is in the room, and where it looks. */
  seeHead({ x, y, z }: Vector3, turn: Quaternion): void {
    this.#head.set(x, y, z);
    const ahead = this.#offset.set(0, 0, -1).applyQuaternion(turn);
    this.#looks = Math.atan2(-ahead.x, -ahead.z);
  }

  /** Bring the room to where it belongs, so many ms later. */
  update(elapsed: number, carrying: Carrying): void {
    const seconds = Math.min(Math.max(elapsed, 1), 100) / 1000;
    this.turnRate = 0;
    const rides = this.stand === "ride" || this.stand === "chase";
    if (rides && this.robot.known) {
      this.#carry(seconds);
      const heading = headingOf(this.robot.orientation);
      const turned = wrap(heading - (this.#robotHeading ?? heading));
      this.#robotHeading = heading;
      if (carrying.turns && Math.abs(turned) < 1) {
        this.heading = wrap(this.heading + turned);
        this.turnRate = Math.abs(turned) / seconds;
      }
      this.#spot.copy(this.stand === "ride" ? this.#carried : this.#behind(this.#carried));
    } else {
      this.#robotHeading = undefined;
    }
    this.speed = rides ? this.#velocity.length() : 0;
    this.#place(carrying.tilts && this.stand === "ride");
  }

  #place(tilts = false): void {
    this.#yaw.setFromAxisAngle(UP, this.heading);
    this.#turn.copy(this.#yaw).multiply(UPRIGHT);
    if (tilts && this.robot.known) {
      // The robot's own tilt: what is left of its orientation without its heading.
      this.#yaw.setFromAxisAngle(UP, -this.robot.heading).premultiply(this.robot.orientation);
      this.#turn.premultiply(this.#yaw);
    }
    this.room.quaternion.copy(this.#turn);
    this.room.scale.setScalar(this.scale);
    this.#offset.copy(this.#fixed).multiplyScalar(this.scale).applyQuaternion(this.#turn);
    this.room.position.copy(this.#spot).sub(this.#offset);
    this.room.updateMatrixWorld();
  }

  /** Go after the robot as on a damped spring. */
  #carry(seconds: number): void {
    const goal = this.robot.position;
    if (this.#carried.distanceTo(goal) > LEAP) {
      this.#leap();
      return;
    }
    this.#offset.copy(goal).sub(this.#carried).multiplyScalar(CARRY * CARRY);
    this.#velocity.addScaledVector(this.#velocity, -2 * CARRY * seconds).addScaledVector(this.#offset, seconds);
    this.#carried.addScaledVector(this.#velocity, seconds);
  }

  #leap(): void {
    this.#carried.copy(this.robot.position);
    this.#velocity.set(0, 0, 0);
    this.#robotHeading = undefined;
  }

  #behind(spot: Vector3): Vector3 {
    const direction = this.heading + this.#looked;
    return this.#offset.set(spot.x - BEHIND * Math.cos(direction), spot.y - BEHIND * Math.sin(direction), spot.z);
  }
}
