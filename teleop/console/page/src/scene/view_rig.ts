/** The views: where the camera should be, given the robot, the map and what the person turned and moved. */

import type { PlanarPose, Vector3 } from "../values";
import { approach, wrap, type Bounds } from "./geometry";
import { blend, fittingDistance, metresPerPixel, panned, zoomedDistance, type Orbit } from "./orbit";
import type { View } from "./settings";

/** The robot as the camera follows it: its place on the floor and the floor's height there [m]. */
export interface Anchor extends PlanarPose {
  readonly z: number;
}

const DEGREE = Math.PI / 180;
/** Times in which the camera makes 63 % of the way to the robot [ms]; turning is slower, which is calmer. */
const FOLLOW = { position: 120, heading: 350 };
const TRANSITION = 450;
/** A robot that jumps farther than this [m] was found elsewhere: the camera flies there. */
const JUMP = 1.5;
const EYE_HEIGHT = 0.55;
/** A map that would be seen from farther than this [m] is not shown whole from above while the robot is in it. */
const WHOLE_FROM = 190;
/** What is to be seen while there is no map [m]. */
const NO_WORLD: Bounds = { min: { x: -4, y: -4, z: 0 }, max: { x: 4, y: 4, z: 1 } };
/** Room around the whole map. */
const MARGIN = 1.06;

/** The place that the view of the arm looks at, in the robot's frame: where a gripper before the bumper works [m]. */
const WORKPLACE = { ahead: 0.5, up: 0.15 };

interface Habit {
  /** Direction of view less the robot's heading [rad]. */
  readonly turn: number;
  readonly elevation: number;
  readonly elevations: readonly [number, number];
  readonly distance: number;
  readonly fieldOfView: number;
}

const HABITS: Readonly<Record<View, Habit>> = {
  chase: { turn: 0, elevation: 33 * DEGREE, elevations: [4 * DEGREE, 89 * DEGREE], distance: 4.9, fieldOfView: 50 * DEGREE },
  top: { turn: 0, elevation: 90 * DEGREE, elevations: [90 * DEGREE, 90 * DEGREE], distance: 62, fieldOfView: 18 * DEGREE },
  first: { turn: 0, elevation: 6 * DEGREE, elevations: [-60 * DEGREE, 60 * DEGREE], distance: 0.001, fieldOfView: 75 * DEGREE },
  arm: { turn: -55 * DEGREE, elevation: 28 * DEGREE, elevations: [2 * DEGREE, 89 * DEGREE], distance: 1.15, fieldOfView: 42 * DEGREE },
};

/** What the person changed about a view. */
interface Wish {
  turn: number;
  elevation: number;
  distance: number;
}

export class ViewRig {
  /** True while the camera moves with the robot; moving the view aside ends it, `recentre` begins it again. */
  following = true;
  /** While false the camera stays where it is, as under the finger that places a hint. */
  mayFollow = true;
  reducedMotion = false;
  #view: View = "chase";
  #aspect = 1.5;
  #covered = { top: 0, bottom: 0 };
  #world: Bounds | undefined;
  #anchor: Anchor | undefined;
  #camera: Anchor | undefined;
  #free: Vector3 = { x: 0, y: 0, z: 0 };
  #freeAzimuth = Math.PI / 2;
  readonly #wishes: Record<View, Wish> = { chase: wishOf("chase"), top: wishOf("top"), first: wishOf("first"), arm: wishOf("arm") };
  #from: Orbit | undefined;
  #progress = 1;

  get view(): View {
    return this.#view;
  }

  /** Whether the camera looks with the robot's eyes. */
  get isInside(): boolean {
    return this.#seen() === "first";
  }

  setView(view: View): void {
    if (view !== this.#view) {
      this.#depart();
      this.#view = view;
      this.following = true;
    }
  }

  /**
   * @param covered Shares of the height that alarms and controls cover, above and below: the whole map is shown between
   *   them when it is seen from above.
   */
  setAspect(aspect: number, covered: { readonly top: number; readonly bottom: number } = { top: 0, bottom: 0 }): void {
    this.#aspect = aspect;
    this.#covered = covered;
  }

  /** Set what is to be seen as long as no robot is in it. */
  setWorld(world: Bounds | undefined): void {
    if (JSON.stringify(world) === JSON.stringify(this.#world)) {
      return;
    }
    if (this.#anchor === undefined) {
      this.#depart();
    }
    this.#world = world;
  }

  /** Follow the robot, or show the whole map if its place is not known. */
  setAnchor(anchor: Anchor | undefined): void {
    const before = this.#anchor;
    const far = before !== undefined && anchor !== undefined && Math.hypot(anchor.x - before.x, anchor.y - before.y) > JUMP;
    if ((before === undefined) !== (anchor === undefined) || far) {
      this.#depart();
      this.#camera = anchor;
    }
    this.#anchor = anchor;
  }

  /** Go back to the robot and to the view's own angle and distance. */
  recentre(): void {
    this.#depart();
    this.following = true;
    this.#wishes[this.#view] = wishOf(this.#view);
  }

  /** Turn the view [rad]: to the right and down. */
  turn(right: number, down: number): void {
    const wish = this.#wishes[this.#seen()];
    const [least, most] = HABITS[this.#seen()].elevations;
    wish.turn = wrap(wish.turn - right);
    this.#freeAzimuth = wrap(this.#freeAzimuth - right);
    wish.elevation = Math.min(Math.max(wish.elevation + down, least), most);
  }

  /** Zoom by a factor (above 1: farther), about a point of the floor if there is one. */
  zoom(factor: number, about?: { readonly x: number; readonly y: number }): void {
    const before = this.#wanted();
    const wish = this.#wishes[this.#seen()];
    wish.distance = zoomedDistance(before.distance, factor) / (this.#fits() ? this.#fitted() : 1);
    if (!this.#follows() && about !== undefined) {
      const share = 1 - this.#wanted().distance / before.distance;
      const { x, y, z } = before.target;
      this.#free = { x: x + (about.x - x) * share, y: y + (about.y - y) * share, z };
      this.following = false;
    }
  }

  /** Move the view with a pointer that went so many pixels right and down in a picture of this height. */
  pan(right: number, down: number, height: number): void {
    if (this.#view === "first") {
      this.turn(-right * 0.003, -down * 0.003);
      return;
    }
    const before = this.#wanted();
    if (this.following) {
      this.#wishes[this.#view].distance = before.distance;
      this.#freeAzimuth = before.azimuth;
      this.following = false;
    }
    this.#free = panned(before, right, down, height);
  }

  /** Move on by so many ms; true while there is something left to move. */
  advance(elapsed: number): boolean {
    const moving = this.#progress < 1;
    this.#progress = this.reducedMotion ? 1 : Math.min(this.#progress + elapsed / TRANSITION, 1);
    return this.#follow(elapsed) || moving;
  }

  /** Return where the camera is now. */
  orbit(): Orbit {
    const wanted = this.#wanted();
    if (this.#from === undefined || this.#progress >= 1) {
      return wanted;
    }
    const share = this.#progress * this.#progress * (3 - 2 * this.#progress);
    return blend(this.#from, wanted, share);
  }

  /** Return the size of a pixel at the target [m]. */
  metresPerPixel(height: number): number {
    return metresPerPixel(this.orbit(), height);
  }

  #follow(elapsed: number): boolean {
    const [goal, at] = [this.#anchor, this.#camera];
    if (goal === undefined || at === undefined || !this.mayFollow) {
      return false;
    }
    const stiff = this.reducedMotion || this.#view === "first";
    const [near, round] = stiff ? [1, 1] : [approach(elapsed, FOLLOW.position), approach(elapsed, FOLLOW.heading)];
    const [dx, dy, dz, turn] = [goal.x - at.x, goal.y - at.y, goal.z - at.z, wrap(goal.yaw - at.yaw)];
    if (Math.abs(dx) + Math.abs(dy) + Math.abs(dz) < 1e-3 && Math.abs(turn) < 1e-3) {
      return false;
    }
    this.#camera = { x: at.x + dx * near, y: at.y + dy * near, z: at.z + dz * near, yaw: wrap(at.yaw + turn * round) };
    return this.following;
  }

  #depart(): void {
    this.#from = this.orbit();
    this.#progress = 0;
  }

  /** Return the target at which this place is in the middle of what is not covered, seen from above. */
  #uncovered(place: Vector3, distance: number): Vector3 {
    const down = (this.#covered.bottom - this.#covered.top) * distance * Math.tan(HABITS.top.fieldOfView / 2);
    const azimuth = Math.PI / 2 + this.#wishes.top.turn;
    return { x: place.x - down * Math.cos(azimuth), y: place.y - down * Math.sin(azimuth), z: place.z };
  }

  #follows(): boolean {
    return this.following && this.#camera !== undefined;
  }

  /** Whether the whole map is shown, in which the wished distance is a factor on the one that fits. */
  #fits(): boolean {
    return this.following && this.#camera === undefined;
  }

  #fitted(): number {
    const habit = HABITS[this.#seen()];
    const world = this.#world ?? NO_WORLD;
    const free = this.#seen() === "top" ? 1 - this.#covered.top - this.#covered.bottom : 1;
    const fieldOfView = 2 * Math.atan(free * Math.tan(habit.fieldOfView / 2));
    const whole = { ...this.#whole(), fieldOfView, distance: 1 };
    return (MARGIN * Math.max(fittingDistance(whole, world, this.#aspect / free), 3)) / habit.distance;
  }

  /** The view of the whole map, but for its distance. */
  #whole(): Omit<Orbit, "distance"> {
    const view = this.#seen();
    const wish = this.#wishes[view];
    return {
      target: middle(this.#world ?? NO_WORLD),
      azimuth: Math.PI / 2 + wish.turn,
      elevation: Math.max(wish.elevation, 42 * DEGREE),
      fieldOfView: HABITS[view].fieldOfView,
    };
  }

  /** First person and the arm without a place are the chase view of the whole map. */
  #seen(): View {
    return (this.#view === "first" || this.#view === "arm") && this.#camera === undefined ? "chase" : this.#view;
  }

  #wanted(): Orbit {
    const view = this.#seen();
    const [habit, wish, robot] = [HABITS[view], this.#wishes[view], this.#camera];
    const { elevation } = wish;
    const shared = { elevation, fieldOfView: habit.fieldOfView };
    if (!this.following && view !== "first") {
      return { ...shared, target: this.#free, azimuth: this.#freeAzimuth, distance: wish.distance };
    }
    if (robot === undefined) {
      const distance = wish.distance * this.#fitted();
      const whole = { ...this.#whole(), distance };
      return view === "top" ? { ...whole, target: this.#uncovered(whole.target, distance) } : whole;
    }
    if (view === "first") {
      return { ...shared, target: ahead(robot, 0.1, EYE_HEIGHT), azimuth: robot.yaw + wish.turn, distance: habit.distance };
    }
    if (view === "top") {
      return { ...shared, ...this.#fromAbove(robot, wish.distance), azimuth: Math.PI / 2 + wish.turn };
    }
    if (view === "arm") {
      return { ...shared, target: ahead(robot, WORKPLACE.ahead, WORKPLACE.up), azimuth: robot.yaw + wish.turn, distance: wish.distance };
    }
    // Looking a little ahead of the robot leaves more of the picture to where it is going.
    return { ...shared, target: ahead(robot, 0.8, 0.2), azimuth: robot.yaw + wish.turn, distance: wish.distance };
  }

  /** The whole map until a person zooms in on the robot; of a map that is too large, the robot's surroundings. */
  #fromAbove(robot: Anchor, wished: number): Pick<Orbit, "target" | "distance"> {
    const habit = HABITS.top.distance;
    const fitted = this.#world === undefined ? Infinity : this.#fitted() * habit;
    const near = { x: robot.x, y: robot.y, z: robot.z + 0.2 };
    if (fitted > WHOLE_FROM) {
      return { target: near, distance: wished };
    }
    const distance = wished === habit ? fitted : Math.min(wished, fitted);
    const share = Math.min((1 - distance / fitted) / 0.3, 1);
    const { x, y } = this.#uncovered(middle(this.#world ?? NO_WORLD), distance);
    return { target: { x: x + (near.x - x) * share, y: y + (near.y - y) * share, z: near.z }, distance };
  }
}

function wishOf(view: View): Wish {
  return { turn: HABITS[view].turn, elevation: HABITS[view].elevation, distance: HABITS[view].distance };
}

/** Return a place before the robot. */
function ahead({ x, y, z, yaw }: Anchor, distance: number, up: number): Vector3 {
  return { x: x + distance * Math.cos(yaw), y: y + distance * Math.sin(yaw), z: z + up };
}

function middle({ min, max }: Bounds): Vector3 {
  return { x: (min.x + max.x) / 2, y: (min.y + max.y) / 2, z: min.z };
}
