/** The picture: map, robot and what it sees, in three views. Reads the robot's state; asks for nothing. */

import { effect, signal, type ReadonlySignal, type Signal } from "@preact/signals";
import { Color, SRGBColorSpace } from "three";
import type { RobotState } from "../robot/robot_state";
import { sceneTexts } from "../texts/scene";
import type { PlanarPose } from "../values";
import { CameraControl } from "./camera_control";
import { Detail } from "./detail";
import { Ghost, type GhostQuality } from "./ghost";
import type { Bounds } from "./geometry";
import { GridLayer } from "./grid_layer";
import { Hypotheses } from "./hypotheses";
import { LivePoints } from "./live_points";
import { isDoubtful, WAITING_RADIUS, waitingPose, worldBounds, worldFromBase } from "./located";
import { MapLayer } from "./map_layer";
import { placeCamera } from "./orbit";
import { COLOURS, type SceneColours } from "./palette";
import { floorHit, nearest } from "./picking";
import { RobotLayer } from "./robot_layer";
import type { SceneSettings } from "./settings";
import { depend, onReducedMotion } from "./reactions";
import { SmoothPose } from "./smooth_pose";
import { Stage } from "./stage";
import { ViewRig } from "./view_rig";
import type { Viewport } from "./viewport";
import { WaitingPlace } from "./waiting_place";

/** What is higher above the robot's top is cut away, so that ceilings hide nothing [m]. */
const HEADROOM = 1.5;
/** Radians that a pixel of dragging turns the view. */
const TURN_PER_PIXEL = 0.006;
/** Wait before the whole map is drawn again after motion that was too much for the graphics [ms]. */
const REST = 250;
/** How often fading points are drawn anew while nothing else happens [ms]. */
const FADING = 200;

export class Scene {
  /** Set by whoever knows that what is shown is older than it should be: everything alive turns grey. */
  readonly stale: Signal<boolean> = signal(false);
  /** Whether the view goes with the robot; false once a person has moved it aside, until `recentre`. */
  readonly following: ReadonlySignal<boolean>;
  /** One sentence on what is wrong with the picture, with the way out; empty while all is well. */
  readonly trouble: ReadonlySignal<string>;
  readonly #following = signal(true);
  readonly #state: RobotState;
  readonly #settings: SceneSettings;
  readonly #canvas: HTMLCanvasElement;
  readonly #stage: Stage;
  readonly #control: CameraControl;
  readonly #rig = new ViewRig();
  readonly #map = new MapLayer();
  readonly #grid = new GridLayer();
  readonly #live = new LivePoints();
  readonly #robot = new RobotLayer();
  readonly #hypotheses = new Hypotheses();
  readonly #ghost = new Ghost(this.#live.cloud);
  readonly #waiting = new WaitingPlace();
  readonly #plan = signal<{ readonly bounds: Bounds | undefined; readonly floor: number }>({ bounds: undefined, floor: 0 });
  readonly #pose = new SmoothPose();
  readonly #detail = new Detail();
  readonly #stops: (() => void)[] = [];
  #colours: SceneColours;
  #located = false;
  #ghostShown: { readonly pose: PlanarPose; readonly quality: GhostQuality } | undefined;
  #timer: ReturnType<typeof setTimeout> | undefined;

  constructor(canvas: HTMLCanvasElement, state: RobotState, settings: SceneSettings) {
    this.#canvas = canvas;
    this.#state = state;
    this.#settings = settings;
    this.following = this.#following;
    this.#colours = COLOURS[settings.theme.value];
    canvas.setAttribute("aria-label", sceneTexts.canvas);
    canvas.setAttribute("role", "application");
    canvas.tabIndex = 0;
    this.#stage = new Stage(canvas, (elapsed, atOnce) => this.#update(elapsed, atOnce));
    this.trouble = this.#stage.trouble;
    const layers = [this.#grid, this.#map, this.#live, this.#robot, this.#hypotheses, this.#ghost, this.#waiting];
    this.#stage.scene.add(...layers.map((layer) => layer.object));
    this.#control = new CameraControl(canvas, {
      dragMoves: () => this.#rig.view === "top",
      turn: (right, down) => { this.#moved(() => { this.#rig.turn(right * TURN_PER_PIXEL, down * TURN_PER_PIXEL); }); },
      pan: (right, down) => { this.#moved(() => { this.#rig.pan(right, down, this.#stage.size.height); }); },
      zoom: (factor, x, y) => { this.#moved(() => { this.#rig.zoom(factor, this.floorPoint(x, y)); }); },
      recentre: () => { this.recentre(); },
    });
    this.#watch();
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
    return nearest(this.#hypotheses.centres(), this.#stage.camera, clientX - left, clientY - top, within, this.#stage.size);
  }

  /** Leave pointers to the hint, with the view held still, or take them back for the camera. */
  setInteraction(interaction: "camera" | "hint"): void {
    this.#control.enabled = interaction === "camera";
    this.#rig.mayFollow = interaction === "camera";
    this.#stage.invalidate();
  }

  /** Show the robot's outline and what it sees now at a proposed pose; undefined hides it. */
  showGhost(pose: PlanarPose | undefined, quality: GhostQuality = "unknown"): void {
    this.#ghostShown = pose && { pose, quality };
    this.#placeGhost();
  }

  /** Go back to the robot, and to the view's own angle and distance. */
  recentre(): void {
    this.#moved(() => { this.#rig.recentre(); });
  }

  /** Script time of the last frames [ms], oldest first. */
  frameTimes(): number[] {
    return this.#stage.frameTimes.values();
  }

  dispose(): void {
    for (const stop of this.#stops) {
      stop();
    }
    clearTimeout(this.#timer);
    this.#control.dispose();
    this.#hypotheses.clear();
    for (const part of [this.#map, this.#grid, this.#live, this.#robot, this.#ghost, this.#waiting]) {
      part.dispose();
    }
    this.#stage.dispose();
  }

  /** Let each change of the state or the settings reach its layer, and have a frame drawn. */
  #watch(): void {
    const [state, settings] = [this.#state, this.#settings];
    const on = (reaction: () => void): void => {
      this.#stops.push(effect(() => {
        reaction();
        this.#stage.invalidate();
      }));
    };
    this.#stops.push(onReducedMotion((reduced) => { this.#rig.reducedMotion = reduced; }));
    on(() => {
      this.#map.set(state.mapPoints.value);
      this.#grid.set(state.gridMap.value, this.#colours);
      const bounds = this.#map.bounds ?? this.#grid.bounds;
      this.#plan.value = { bounds, floor: this.#map.bounds === undefined ? bounds?.min.z ?? 0 : this.#map.floor };
    });
    on(() => { this.#robot.setModel(state.description.value); });
    on(() => {
      // A new run: nothing of the last one stays.
      depend(state.run);
      this.#robot.clearPath();
      this.#live.clear();
      this.showGhost(undefined);
    });
    on(() => { this.#rig.setView(settings.view.value); this.#following.value = this.#rig.following; });
    on(() => { this.#setPose(); });
    on(() => {
      const pose = state.mapFromBase.peek() ?? worldFromBase(state);
      this.#live.setCloud(state.cloud.value, pose, performance.now(), settings.decay.peek());
      this.#placeGhost();
    });
    on(() => {
      this.#live.setScan(state.scan.value, worldFromBase(state) === undefined ? WAITING_RADIUS : Infinity);
      this.#placeGhost();
    });
    on(() => { this.#robot.setCovariance(state.covariance.value, worldFromBase(state)); });
    on(() => { this.#robot.setTruth(state.truth.value); });
    on(() => { this.#paint(); });
    on(() => { this.#showLayers(); });
    on(() => { depend(settings.pointSize, settings.decay); });
  }

  /** Put the robot where it is, or beside the map while that is not known. */
  #setPose(): void {
    const pose = worldFromBase(this.#state);
    const { bounds, floor } = this.#plan.value;
    const waiting = pose === undefined ? waitingPose(bounds, floor) : undefined;
    const atOnce = waiting !== undefined || !this.#located || this.#rig.reducedMotion;
    this.#located = pose !== undefined;
    this.#pose.set(pose ?? waiting, atOnce);
    this.#rig.setWorld(worldBounds(bounds, floor, waiting));
    if (pose !== undefined) {
      this.#robot.extendPath(pose);
    }
    this.#waiting.set(waiting !== undefined && bounds !== undefined ? waiting : undefined);
  }

  #placeGhost(): void {
    const shown = this.#ghostShown;
    if (shown === undefined) {
      this.#ghost.hide();
    } else {
      const withCloud = this.#live.hasCloud && this.#live.cloudPose !== undefined;
      const buffer = withCloud ? this.#live.cloud : this.#live.scan;
      this.#ghost.show(shown.pose, this.#floor(), this.#robot.box, buffer, withCloud ? this.#live.cloudPose : undefined);
      this.#ghost.setColours(this.#colours, shown.quality);
    }
    this.#stage.invalidate();
  }

  /** Height of the floor on which the robot stands [m]. */
  #floor(): number {
    return this.#pose.known ? this.#pose.position.z : this.#plan.peek().floor;
  }

  #paint(): void {
    const [state, stale] = [this.#state, this.stale.value];
    this.#colours = COLOURS[this.#settings.theme.value];
    const colours = this.#colours;
    this.#stage.scene.background = new Color().setRGB(...colours.background, SRGBColorSpace);
    depend(state.description);
    const ring = isDoubtful(state.status.value?.health) ? colours.doubtful : colours.robot;
    this.#map.setColours(colours);
    this.#grid.setColours(colours);
    this.#live.setColours(colours, stale);
    this.#robot.setColours(colours, this.#located ? ring : colours.doubtful, stale);
    this.#ghost.setColours(colours, this.#ghostShown?.quality ?? "unknown");
    this.#hypotheses.set(state.candidates.value, this.#robot.box, colours);
    this.#waiting.setColours(colours);
  }

  #showLayers(): void {
    const [state, layers] = [this.#state, this.#settings.layers.value];
    const located = worldFromBase(state) !== undefined;
    const withCloud = located && state.cloud.value !== undefined;
    this.#map.object.visible = layers.map;
    this.#grid.object.visible = layers.grid;
    this.#hypotheses.object.visible = layers.hypotheses;
    this.#live.show(layers.cloud && withCloud, layers.cloud && !withCloud, layers.oldSweeps && located);
    this.#robot.show(layers, state.truth.value !== undefined);
  }

  #moved(move: () => void): void {
    move();
    this.#following.value = this.#rig.following;
    this.#stage.invalidate();
  }

  /** Bring everything to this moment; true while something still moves. */
  #update(elapsed: number, followsAtOnce: boolean): boolean {
    const gliding = this.#pose.advance(elapsed);
    const pose = this.#pose.value();
    const { x, y, z } = pose.position;
    this.#robot.setPose(this.#pose.known ? pose : undefined);
    this.#live.placeScan(this.#pose.position, this.#pose.orientation);
    this.#rig.setAnchor(this.#located ? { x, y, z, yaw: this.#pose.heading } : undefined);
    const { width, height, ratio } = this.#stage.size;
    this.#rig.setAspect(width / height);
    const moving = this.#rig.advance(elapsed) || gliding;
    const orbit = this.#rig.orbit();
    placeCamera(this.#stage.camera, orbit, width / height);
    const tangent = Math.tan(orbit.fieldOfView / 2);
    this.#look({
      width: width * ratio, height: height * ratio, ratio, tangent,
      pixelsPerMetre: (height * ratio) / (2 * tangent), metresPerPixel: this.#rig.metresPerPixel(height),
    }, orbit.distance);
    this.#rest(moving, followsAtOnce, elapsed);
    return moving;
  }

  #look(viewport: Viewport, distance: number): void {
    const [size, decay, inside] = [this.#settings.pointSize.peek(), this.#settings.decay.peek(), this.#rig.isInside];
    const cut = inside ? undefined : this.#floor() + this.#robot.box.max.z + HEADROOM;
    const { pixelsPerMetre, ratio } = viewport;
    const { x, y } = this.#pose.position;
    const near = Math.max(inside ? 12 : 22, 3 * distance);
    const fade: readonly [number, number] = this.#located && this.#rig.view !== "top" ? [near, 3 * near] : [1e5, 2e5];
    this.#map.setLook({ cut, focus: { x, y }, fade, pixelsPerMetre, size, ratio });
    const look = { cut, pixelsPerMetre, size, ratio, now: performance.now() / 1000 };
    this.#live.setLook(look, decay);
    this.#grid.setMetres(this.#map.bounds === undefined, x, y, this.#floor());
    this.#robot.setBodyVisible(!inside);
    this.#robot.setViewport(viewport);
    this.#hypotheses.setViewport(viewport);
    this.#ghost.setViewport(viewport, look);
    this.#waiting.setViewport(viewport);
  }

  /** Draw less of the map while the view moves too slowly, all of it at rest, and go on while points fade. */
  #rest(moving: boolean, followsAtOnce: boolean, elapsed: number): void {
    if (followsAtOnce) {
      this.#detail.frame(elapsed);
    }
    const resting = !moving && !followsAtOnce;
    this.#map.setShare(resting ? 1 : this.#detail.share);
    const fading = this.#live.isFading(performance.now(), this.#settings.decay.peek());
    const wait = !resting && this.#detail.share < 1 ? REST : fading ? FADING : undefined;
    clearTimeout(this.#timer);
    this.#timer = wait === undefined ? undefined : setTimeout(() => { this.#stage.invalidate(); }, wait);
  }
}
