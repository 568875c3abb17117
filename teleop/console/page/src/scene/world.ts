/** All that is in the picture, layer by layer, without any signal: how it is painted, shown and freed. */

import { Group } from "three";
import type { GuardZone, NearestObstacle, PlanarPose, Renewed } from "../values";
import type { Bounds } from "./geometry";
import { Ghost, type GhostQuality } from "./ghost";
import { BuildingLayer } from "./building_layer";
import type { CloudLook } from "./cloud_layer";
import { GridLayer } from "./grid_layer";
import { Hypotheses } from "./hypotheses";
import { LivePoints } from "./live_points";
import { MapLayer, type MapLook } from "./map_layer";
import { GuardZoneLayer } from "./guard_zone";
import { NearestArc } from "./nearest_arc";
import type { SceneColours } from "./palette";
import { PlaceNames } from "./place_names";
import { RobotLayer } from "./robot_layer";
import type { Layers, View } from "./settings";
import type { SmoothPose } from "./smooth_pose";
import type { Viewport } from "./viewport";
import { NotLocatedRing } from "./not_located_ring";

/** What is higher above the robot's top is cut away, so that ceilings hide nothing [m]. */
const HEADROOM = 1.5;
/** Walls end so high above the floor, seen from outside, that what stands behind them can be seen [m]. */
const WALLS = 1.2;
/** From above, walls are as thin as their points: these are drawn larger. */
const LARGER_FROM_ABOVE = 1.3;
/** Distances of the focus from which the map fades, at least [m]. */
const CLEAR = { inside: 12, outside: 22 };
const NEVER = 1e5;

/** What is painted in which way. */
export interface Paint {
  readonly colours: SceneColours;
  /** Everything alive is older than it should be. */
  readonly stale: boolean;
  /** What the scanners see is. */
  readonly late: boolean;
  /** The robot's place is not known, or doubted by the robot itself. */
  readonly doubtful: boolean;
}

/** From where and how the world is looked at. */
export interface Look {
  readonly viewport: Viewport;
  /** From the camera to its target [m]. */
  readonly distance: number;
  /** With the robot's eyes. */
  readonly inside: boolean;
  readonly view: View;
  readonly located: boolean;
  readonly floor: number;
  /** Factor on the size of points. */
  readonly size: number;
  /** Of old sweeps [s]. */
  readonly decay: number;
  /** Distance of the eye from which on the map's points are thinned [m]; undefined: nowhere. */
  readonly thin?: number;
}

export class World {
  readonly object = new Group();
  readonly map: MapLayer;
  readonly building = new BuildingLayer();
  readonly grid = new GridLayer();
  readonly live = new LivePoints();
  readonly robot = new RobotLayer();
  readonly nearest = new NearestArc();
  readonly guard = new GuardZoneLayer();
  readonly hypotheses = new Hypotheses();
  readonly waiting = new NotLocatedRing();
  readonly names = new PlaceNames();
  readonly #ghost = new Ghost(this.live.cloud);
  #proposed: { readonly pose: PlanarPose; readonly quality: GhostQuality } | undefined;
  #paint: Paint | undefined;
  /** One object for good, renewed each frame. */
  readonly #points: Renewed<MapLook & CloudLook> = {
    cut: undefined, pixelsPerMetre: 1, ratio: 1, now: 0, focus: { x: 0, y: 0 }, fadeFrom: NEVER, thin: undefined, size: 1,
  };

  /** `changed` is called when something is there to be drawn that was not there before. */
  constructor(changed: () => void) {
    this.map = new MapLayer(changed);
    const layers = [
      this.grid, this.map, this.building, this.live, this.robot, this.hypotheses, this.#ghost, this.waiting,
      this.names,
    ];
    this.object.add(...layers.map((layer) => layer.object));
    this.robot.body.add(this.nearest.line.object, this.guard.line.object);
  }

  /** Bounds of what is known of the place [m]. */
  get bounds(): Bounds | undefined {
    return this.building.bounds ?? this.map.bounds;
  }

  paint(paint: Paint): void {
    const { colours, stale, late, doubtful } = paint;
    this.#paint = paint;
    this.map.setColours(colours);
    this.building.setColours(colours);
    this.grid.setColours(colours);
    // Beside the ghost of the sweep, the sweep itself steps back.
    this.live.setColours(colours, stale || late || this.#proposed !== undefined);
    this.robot.setColours(colours, doubtful ? colours.doubtful : colours.robot, stale);
    this.#ghost.setColours(colours, this.#proposed?.quality ?? "unknown");
    this.waiting.setColours(colours);
    this.nearest.setColours(colours);
    this.guard.setColours(colours);
  }

  /** Show the layers that are wanted, as far as there is something to be shown. */
  show(layers: Layers, has: { readonly place: boolean; readonly cloud: boolean; readonly truth: boolean }, view: View): void {
    const outside = view !== "first";
    const withCloud = has.place && has.cloud;
    this.building.object.visible = layers.building;
    this.map.object.visible = layers.map || (layers.building && !this.building.isKnown);
    this.grid.object.visible = layers.grid;
    this.hypotheses.object.visible = layers.hypotheses;
    this.names.object.visible = layers.names;
    this.live.show(layers.cloud && withCloud, layers.cloud && !withCloud, layers.oldSweeps && has.place);
    this.robot.show({ ...layers, covariance: layers.covariance && outside }, outside && has.truth);
  }

  /** Show what is near, and what the guard keeps free. */
  warn({ nearest, guard }: { readonly nearest?: NearestObstacle | undefined; readonly guard?: GuardZone | undefined }): void {
    this.nearest.set(nearest, this.robot.box);
    this.guard.set(guard);
  }

  /** Propose a pose, or none. */
  propose(pose: PlanarPose | undefined, quality: GhostQuality, floor: number): void {
    const [before, after] = [this.#proposed, pose && { pose, quality }];
    this.#proposed = after;
    this.placeGhost(floor);
    if (this.#paint !== undefined && before?.quality !== after?.quality) {
      this.live.setColours(this.#paint.colours, this.#paint.stale || this.#paint.late || after !== undefined);
      this.#ghost.setColours(this.#paint.colours, quality);
    }
  }

  /** Put the ghost on the floor [m], with the newest sweep. */
  placeGhost(floor: number): void {
    if (this.#proposed === undefined) {
      this.#ghost.hide();
      return;
    }
    const { cloudPose } = this.live;
    const withCloud = this.live.hasCloud && cloudPose !== undefined;
    const buffer = withCloud ? this.live.cloud : this.live.scan;
    this.#ghost.show(this.#proposed.pose, floor, this.robot.box, buffer, withCloud ? cloudPose : undefined);
  }

  /** Draw floors, or leave them out, where the floor of the operator's room is seen. */
  setGround(shown: boolean): void {
    this.building.setGround(shown);
    this.map.setPlate(shown);
  }

  look(look: Look, pose: SmoothPose, now: number): void {
    const { viewport, inside, size } = look;
    const { x, y } = pose.position;
    const points = this.#points;
    points.cut = inside ? undefined : look.floor + this.robot.box.max.z + HEADROOM;
    points.pixelsPerMetre = viewport.pixelsPerMetre;
    points.ratio = viewport.ratio;
    points.now = now / 1000;
    points.focus = pose.position;
    const near = Math.max(inside ? CLEAR.inside : CLEAR.outside, 3 * look.distance);
    points.fadeFrom = look.located && look.view !== "top" ? near : NEVER;
    points.thin = look.thin;
    points.size = look.view === "top" ? LARGER_FROM_ABOVE * size : size;
    this.map.setLook(points);
    points.size = size;
    this.building.setCut(inside ? undefined : look.floor + WALLS, look.floor);
    this.live.placeScan(pose.position, pose.orientation);
    this.live.setLook(points, look.decay);
    this.grid.setMetres(this.bounds === undefined, x, y, look.floor);
    this.robot.setPose(pose.known ? pose : undefined);
    this.robot.setBodyVisible(!inside);
    this.names.look(look.view, x, y, viewport);
    this.#ghost.setViewport(viewport, points);
    this.robot.setViewport(viewport);
    this.hypotheses.setViewport(viewport);
    this.waiting.setViewport(viewport);
  }

  dispose(): void {
    this.hypotheses.clear();
    for (const part of [this.map, this.building, this.grid, this.live, this.robot, this.#ghost, this.waiting, this.nearest.line, this.guard.line, this.names]) {
      part.dispose();
    }
  }
}
