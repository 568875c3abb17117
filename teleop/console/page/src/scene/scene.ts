/** The picture: map, robot and what it sees, in three views. Reads the robot's state; asks for nothing. */

import { computed, effect, signal, untracked, type ReadonlySignal, type Signal } from "@preact/signals";
import { type Box3, Color, SRGBColorSpace, type Object3D } from "three";
import type { RobotState } from "../robot/robot_state";
import { sceneTexts } from "../texts/scene";
import type { PlanarPose, Pose } from "../values";
import { CameraControl } from "./camera_control";
import type { Bounds } from "./geometry";
import type { GhostQuality } from "./ghost";
import { isDoubtful, WAITING_RADIUS, waitingPose, worldBounds, worldFromBase } from "./located";
import { Immersion } from "./immersion";
import { placeCamera } from "./orbit";
import { COLOURS } from "./palette";
import { floorHit, nearest } from "./picking";
import { shownView, type SceneSettings } from "./settings";
import { depend } from "./depend";
import { planOf, type PlanImage } from "./plan";
import { onReducedMotion } from "./reduced_motion";
import { SmoothPose } from "./smooth_pose";
import { Stage } from "./stage";
import { ViewRig } from "./view_rig";
import { covered } from "./viewport";
import type { Workshop } from "./workshop";
import { World } from "./world";

/** Radians that a pixel of dragging turns the view. */
const TURN_PER_PIXEL = 0.006;
/** Wait before all is drawn again after motion that was too much for the graphics [ms]. */
const REST = 250;
/** How often fading points are drawn anew while nothing else happens [ms]. */
const FADING = 200;

export class Scene {
  /** Set by whoever knows that what is shown is older than it should be: everything alive turns grey. */
  readonly stale: Signal<boolean> = signal(false);
  /** The same of what the scanners see. */
  readonly late: Signal<boolean> = signal(false);
  /** Set by whoever drives: whether the picture gives way to a hand that commands. */
  givesWay: () => boolean = () => false;
  /** Whether the view goes with the robot; false once a person has moved it aside, until `recentre`. */
  readonly following: ReadonlySignal<boolean>;
  /** One sentence on what is wrong with the picture, with the way out; empty while all is well. */
  readonly trouble: ReadonlySignal<string>;
  /** Whether the building's surfaces are in the picture. */
  readonly built: Signal<boolean> = signal(false);
  /** The building from above; undefined where there is none. */
  readonly plan: Signal<PlanImage | undefined> = signal(undefined);
  /** For parts that are loaded later and draw into the picture. */
  readonly workshop: Workshop;
  /** The picture for a headset. */
  readonly immersion: Immersion;
  readonly #following = signal(true);
  readonly #state: RobotState;
  readonly #settings: SceneSettings;
  readonly #canvas: HTMLCanvasElement;
  readonly #stage: Stage;
  readonly #control: CameraControl;
  readonly #rig = new ViewRig();
  readonly #world = new World(() => { this.#stage.invalidate(); });
  readonly #extent = signal<{ readonly bounds: Bounds | undefined; readonly floor: number }>({ bounds: undefined, floor: 0 });
  readonly #place: ReadonlySignal<Pose | undefined>;
  /** Whether there is a place: it changes seldom, and the place many times a second. */
  readonly #isPlaced: ReadonlySignal<boolean>;
  /** Whether the robot's place is not known, or doubted by the robot itself. */
  readonly doubtful: ReadonlySignal<boolean>;
  readonly #pose = new SmoothPose();
  readonly #stops: (() => void)[] = [];
  /** Show the layers that are wanted, as far as there is something to be shown. */
  #show: () => void = () => undefined;
  #located = false;
  #timer: ReturnType<typeof setTimeout> | undefined;

  constructor(canvas: HTMLCanvasElement, state: RobotState, settings: SceneSettings) {
    this.#canvas = canvas;
    this.#state = state;
    this.#settings = settings;
    this.following = this.#following;
    this.#place = computed(() => worldFromBase(state));
    this.#isPlaced = computed(() => this.#place.value !== undefined);
    this.doubtful = computed(() => !this.#isPlaced.value || isDoubtful(state.status.value?.health));
    canvas.setAttribute("aria-label", sceneTexts.canvas);
    canvas.setAttribute("role", "application");
    canvas.tabIndex = 0;
    this.#stage = new Stage(canvas, (interval, atOnce) => this.#update(interval, atOnce));
    this.trouble = this.#stage.trouble;
    this.#stage.scene.add(this.#world.object);
    this.#control = new CameraControl(canvas, {
      dragMoves: () => this.#rig.view === "top",
      turn: (right, down) => { this.#moved(() => { this.#rig.turn(right * TURN_PER_PIXEL, down * TURN_PER_PIXEL); }); },
      pan: (right, down) => { this.#moved(() => { this.#rig.pan(right, down, this.#stage.size.height); }); },
      zoom: (factor, x, y) => { this.#moved(() => { this.#rig.zoom(factor, this.floorPoint(x, y)); }); },
      recentre: () => { this.recentre(); },
    });
    const model = signal<Object3D>(this.#world.robot.model);
    this.workshop = {
      canvas, camera: this.#stage.camera, world: this.#stage.scene, base: this.#world.robot.body, model,
      draw: (whole) => { this.#stage.invalidate(whole); }, holdView: (held) => { this.setInteraction(held ? "hint" : "camera"); },
    };
    this.immersion = new Immersion(this.#stage, this.#world, this.#pose, {
      located: () => this.#located, floor: () => this.#floor(), pointSize: settings.pointSize, decay: settings.decay });
    this.#watch(model);
  }

  /** Return the place in the map [m] on the robot's floor that is drawn here, or undefined above the horizon. */
  floorPoint(clientX: number, clientY: number): { readonly x: number; readonly y: number } | undefined {
    const { left, top, width, height } = this.#canvas.getBoundingClientRect();
    const [right, up] = [(2 * (clientX - left)) / width - 1, 1 - (2 * (clientY - top)) / height];
    return floorHit(this.#stage.camera, right, up, this.#floor());
  }

  /** Return the index of the hypothesis that is drawn within so many pixels of this place of the page. */
  hypothesisAt(clientX: number, clientY: number, within = 28): number | undefined {
    const { left, top } = this.#canvas.getBoundingClientRect();
    return nearest(this.#world.hypotheses.centres(), this.#stage.camera, clientX - left, clientY - top, within, this.#stage.size);
  }

  /** Leave pointers to a hint or a hand, with the view held still, or take them back for the camera. */
  setInteraction(interaction: "camera" | "hint"): void {
    this.#control.enabled = interaction === "camera";
    this.#rig.mayFollow = interaction === "camera";
    this.#stage.invalidate();
  }

  /** Show the robot's outline and what it sees now at a proposed pose; undefined hides it. */
  showGhost(pose: PlanarPose | undefined, quality: GhostQuality = "unknown"): void {
    this.#world.propose(pose, quality, this.#floor());
    this.#stage.invalidate();
  }

  /** Go back to the robot, and to the view's own angle and distance. */
  recentre(): void {
    this.#moved(() => { this.#rig.recentre(); });
  }

  /** The robot's body in its own frame [m]. */
  get body(): Box3 {
    return this.#world.robot.box;
  }

  /** Script time of the last frames [ms], oldest first. */
  frameTimes(): number[] {
    return this.#stage.frameTimes.values();
  }

  dispose(): void {
    this.#stops.forEach((stop) => { stop(); });
    clearTimeout(this.#timer);
    this.#control.dispose();
    this.#world.dispose();
    this.#stage.dispose();
  }

  /** Let each change of the state or the settings reach its layer, and have a frame drawn. */
  #watch(model: Signal<Object3D>): void {
    const [state, settings] = [this.#state, this.#settings];
    const on = (reaction: () => void): void => {
      this.#stops.push(effect(() => {
        reaction();
        this.#stage.invalidate();
      }));
    };
    this.#stops.push(onReducedMotion((reduced) => { this.#rig.reducedMotion = reduced; }));
    on(() => {
      this.#world.map.set(state.mapPoints.value);
      this.#world.grid.set(state.gridMap.value, COLOURS[settings.theme.peek()]);
      this.#planned();
    });
    on(() => { void this.#build(state.surfaces.value); });
    on(() => {
      this.#world.robot.setModel(state.description.value);
      untracked(() => { this.#paint(); });
      model.value = this.#world.robot.model;
    });
    on(() => { this.#world.robot.setJoints(state.joints.value ?? new Map()); depend(model); });
    on(() => {
      // A new run: nothing of the last one stays.
      depend(state.run);
      this.#world.robot.clearPath();
      this.#world.live.clear();
      this.showGhost(undefined);
    });
    on(() => { this.#rig.setView(shownView(settings.view.value, state.arm.value)); this.#following.value = this.#rig.following; });
    on(() => { this.#setPose(); });
    on(() => {
      this.#world.live.setCloud(state.cloud.value, this.#place.peek(), performance.now(), settings.decay.peek());
      this.#world.placeGhost(this.#floor());
    });
    on(() => {
      this.#world.live.setScan(state.scan.value, this.#isPlaced.value ? Infinity : WAITING_RADIUS);
      this.#world.placeGhost(this.#floor());
    });
    on(() => { this.#world.robot.setCovariance(state.covariance.value, this.#place.value); });
    on(() => { this.#world.robot.setTruth(state.truth.value); });
    on(() => { this.#world.names.set(state.mapInfo.value?.places ?? [], COLOURS[settings.theme.value]); });
    on(() => { this.plan.value = planOf(this.#world, { surfaces: this.built.value, points: state.mapPoints.value, grid: state.gridMap.value }, COLOURS[settings.theme.value]); });
    on(() => { this.#world.warn(this.stale.value || this.late.value ? {} : { nearest: state.nearest.value, guard: state.guard.value }); });
    on(() => { this.#paint(); });
    on(() => { depend(state.description); this.#world.hypotheses.set(state.candidates.value, this.#world.robot.box, COLOURS[settings.theme.value]); });
    const [hasCloud, hasTruth] = [computed(() => state.cloud.value !== undefined), computed(() => state.truth.value !== undefined)];
    this.#show = () => {
      const has = { place: this.#isPlaced.value, cloud: hasCloud.value, truth: hasTruth.value };
      this.#world.show(settings.layers.value, has, settings.view.value);
    };
    on(() => { this.#show(); });
    on(() => { depend(settings.pointSize, settings.decay); });
  }

  /** Show the building of a glTF file; the part of the page that reads it is fetched when there is one. */
  async #build(file: ArrayBuffer | undefined): Promise<void> {
    const building = file && await import("./read_building").then(({ readBuilding }) => readBuilding(file)).catch(() => undefined);
    if (this.#state.surfaces.peek() === file) {
      this.#world.building.set(building);
      this.#planned();
      this.built.value = false; // whoever keeps something of the last one begins anew
      this.built.value = building !== undefined;
      this.#show();
      this.#stage.invalidate();
    }
  }

  /** Take over how large the place is, and where its floor lies. */
  #planned(): void {
    const { building, map, grid } = this.#world;
    const bounds = this.#world.bounds ?? grid.bounds;
    const floor = building.bounds === undefined ? map.floor : building.floor;
    this.#extent.value = { bounds, floor: this.#world.bounds === undefined ? bounds?.min.z ?? 0 : floor };
  }

  /** Put the robot where it is, or beside the map while that is not known. */
  #setPose(): void {
    const pose = this.#place.value;
    const { bounds, floor } = this.#extent.value;
    const { width, height } = this.#stage.size;
    const waiting = pose === undefined ? waitingPose(bounds, floor, width < height) : undefined;
    const atOnce = waiting !== undefined || !this.#located || this.#rig.reducedMotion;
    this.#located = pose !== undefined;
    this.#pose.set(pose ?? waiting, atOnce);
    this.#rig.setWorld(worldBounds(bounds, floor, waiting));
    if (pose !== undefined) {
      this.#world.robot.extendPath(pose);
    }
    this.#world.waiting.set(waiting !== undefined && bounds !== undefined ? waiting : undefined);
  }

  /** Height of the floor on which the robot stands [m]. */
  #floor(): number {
    return this.#pose.known ? this.#pose.position.z : this.#extent.peek().floor;
  }

  #paint(): void {
    const colours = COLOURS[this.#settings.theme.value];
    this.#stage.scene.background = new Color().setRGB(...colours.background, SRGBColorSpace);
    this.#world.paint({ colours, stale: this.stale.value, late: this.late.value, doubtful: this.doubtful.value });
  }

  #moved(move: () => void): void {
    move();
    this.#following.value = this.#rig.following;
    this.#stage.invalidate();
  }

  /** Bring everything to this moment; true while something still moves. */
  #update(interval: number, followsAtOnce: boolean): boolean {
    // After a pause, time begins anew: nothing leaps because nothing was drawn for a while.
    const elapsed = Math.min(interval, followsAtOnce ? 100 : 17);
    const gliding = this.#pose.advance(elapsed);
    const { x, y, z } = this.#pose.position;
    this.#rig.setAnchor(this.#located ? { x, y, z, yaw: this.#pose.heading } : undefined);
    const { width, height } = this.#stage.size;
    this.#rig.setAspect(width / height, covered(height));
    const moving = this.#rig.advance(elapsed) || gliding;
    this.#rest(moving, followsAtOnce);
    const { ratio } = this.#stage.size;
    const orbit = this.#rig.orbit();
    placeCamera(this.#stage.camera, orbit, width / height);
    const tangent = Math.tan(orbit.fieldOfView / 2);
    const viewport = {
      width: width * ratio, height: height * ratio, ratio, tangent,
      pixelsPerMetre: (height * ratio) / (2 * tangent), metresPerPixel: this.#rig.metresPerPixel(height),
    };
    this.#world.look({
      viewport, distance: orbit.distance, inside: this.#rig.isInside, view: this.#rig.view, located: this.#located,
      floor: this.#floor(), size: this.#settings.pointSize.peek(), decay: this.#settings.decay.peek(),
    }, this.#pose, performance.now());
    return moving;
  }

  /** Draw fewer points and pixels while frames are too slow for what moves or is commanded, all at rest, and go on while points fade. */
  #rest(moving: boolean, followsAtOnce: boolean): void {
    const { detail } = this.#stage;
    const resting = !moving && !followsAtOnce && !this.givesWay();
    this.#world.map.setShare(resting ? 1 : detail.share);
    this.#stage.setSharpness(resting ? 1 : detail.sharpness);
    const fading = this.#world.live.isFading(performance.now(), this.#settings.decay.peek());
    const wait = !resting && detail.share < 1 ? REST : fading ? FADING : undefined;
    clearTimeout(this.#timer);
    this.#timer = wait === undefined ? undefined : setTimeout(() => { this.#stage.invalidate(); }, wait);
  }
}
