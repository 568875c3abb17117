/** The small map in a corner: the robot in the middle, north up, with rings, a scale bar and names of places. */

import { withoutOverlap, type Words } from "./labels";
import { css, type SceneColours } from "./palette";
import { headingOf } from "./geometry";
import type { PlanImage } from "./plan_image";
import type { CloudPoints, NamedPlace, Pose } from "../values";

/** Radii of the rings about the robot [m]. */
const RINGS = [1, 2] as const;
/** Half of what is shown about the robot [m]. */
const REACH = 8;
/** Pixels of a place's name, and between the map's edge and what lies on it. */
const LETTERS = 10;
/** Half the size of the robot's mark [px]. */
const MARK = 9;
const EDGE = 7;
/** Most live points that are drawn. */
const MOST_POINTS = 600;

export interface MinimapContent {
  readonly plan: PlanImage | undefined;
  readonly robot: Pose | undefined;
  readonly points: CloudPoints | undefined;
  readonly places: readonly NamedPlace[];
  readonly colours: SceneColours;
  readonly stale: boolean;
  readonly late: boolean;
  readonly doubtful: boolean;
}

/** Which part of the world is shown: its middle [m], and pixels for a metre. */
export interface MinimapView {
  readonly x: number;
  readonly y: number;
  readonly scale: number;
}

/** Return the part that is shown in a square of this size [px]: the robot's surroundings, or the whole map. */
export function minimapView({ plan, robot }: Pick<MinimapContent, "plan" | "robot">, size: number, whole: boolean): MinimapView {
  if (plan !== undefined && (whole || robot === undefined)) {
    const { min, max } = plan.bounds;
    const scale = size / (1.05 * Math.max(max.x - min.x, max.y - min.y, 1));
    return { x: (min.x + max.x) / 2, y: (min.y + max.y) / 2, scale };
  }
  return { x: robot?.position.x ?? 0, y: robot?.position.y ?? 0, scale: size / (2 * REACH) };
}

/** Return the length of a scale bar [m], a round number that fills at most a third of the size [px]. */
export function scaleBar(scale: number, size: number): number {
  const most = size / 3 / scale;
  const power = 10 ** Math.floor(Math.log10(most));
  return power * ([5, 2, 1].find((step) => step * power <= most) ?? 1);
}

/** Return the words that lie wholly in a square of this size [px], none over another; those nearest to its middle first. */
export function apart<T extends Words>(words: readonly T[], size: number): readonly T[] {
  const near = ({ at: [x, y] }: Words): number => Math.hypot(x - size / 2, y - size / 2);
  const inside = words.filter(({ at: [x, y], width }) => x > width / 2 && x < size - width / 2 && y > LETTERS && y < size);
  return withoutOverlap(inside.sort((a, b) => near(a) - near(b)), 1.2 * LETTERS);
}

/** Return words that would lie under the robot's mark [px] below it: that is the room that it is in. */
export function clear<T extends Words>(word: T, mark: readonly [number, number] | undefined): T {
  const { at: [x, y], width } = word;
  const hidden = mark !== undefined && Math.abs(x - mark[0]) < width / 2 + MARK && Math.abs(y - LETTERS / 2 - mark[1]) < LETTERS / 2 + MARK;
  return hidden ? { ...word, at: [x, mark[1] + MARK + LETTERS + 2] } : word;
}

/** Draw all of it into a square of this size [px of the page]. */
export function drawMinimap(pen: CanvasRenderingContext2D, content: MinimapContent, size: number, whole: boolean): void {
  const { plan, robot, points, places, colours } = content;
  const view = minimapView(content, size, whole);
  const at = (x: number, y: number): [number, number] => [size / 2 + (x - view.x) * view.scale, size / 2 - (y - view.y) * view.scale];
  pen.fillStyle = css(colours.plate);
  pen.fillRect(0, 0, size, size);
  if (plan !== undefined) {
    const [left, top] = at(plan.bounds.min.x, plan.bounds.max.y);
    const factor = view.scale / plan.perMetre;
    pen.drawImage(plan.image, left, top, plan.image.width * factor, plan.image.height * factor);
  }
  if (points !== undefined && points.frame === "map") {
    pen.fillStyle = css(content.late || content.stale ? colours.stale : colours.distances[0]);
    const step = 3 * Math.max(1, Math.ceil(points.positions.length / 3 / MOST_POINTS));
    for (let index = 0; index + 1 < points.positions.length; index += step) {
      const [x, y] = at(points.positions[index] ?? NaN, points.positions[index + 1] ?? NaN);
      pen.fillRect(x - 0.75, y - 0.75, 1.5, 1.5);
    }
  }
  write(pen, colours);
  pen.textAlign = "center";
  const rooms = places.map(({ name, pose }) => ({ name, at: at(pose.position.x, pose.position.y), width: pen.measureText(name).width }));
  const mark = robot && at(robot.position.x, robot.position.y);
  for (const { name, at: [x, y] } of apart(rooms.map((room) => clear(room, mark)), size)) {
    letters(pen, name, x, y);
  }
  if (robot !== undefined && mark !== undefined) {
    drawRobot(pen, mark, view.scale, content, headingOf(robot.orientation));
  }
  drawScale(pen, size, view.scale, colours);
}

function drawRobot(pen: CanvasRenderingContext2D, [x, y]: [number, number], scale: number, { colours, stale, doubtful }: MinimapContent, heading: number): void {
  pen.strokeStyle = css(colours.stale);
  pen.lineWidth = 1;
  for (const radius of RINGS) {
    pen.beginPath();
    pen.arc(x, y, radius * scale, 0, 2 * Math.PI);
    pen.stroke();
  }
  pen.save();
  pen.translate(x, y);
  pen.rotate(-heading);
  pen.beginPath();
  pen.moveTo(9, 0);
  pen.lineTo(-6, -6);
  pen.lineTo(-3, 0);
  pen.lineTo(-6, 6);
  pen.closePath();
  pen.fillStyle = css(stale ? colours.stale : doubtful ? colours.doubtful : colours.robot);
  pen.strokeStyle = css(colours.background);
  pen.lineWidth = 2;
  pen.stroke();
  pen.fill();
  pen.restore();
}

/** The scale bar below on the left, and north above on the right. */
function drawScale(pen: CanvasRenderingContext2D, size: number, scale: number, colours: SceneColours): void {
  const length = scaleBar(scale, size);
  pen.fillStyle = css(colours.ink);
  pen.fillRect(EDGE, size - EDGE - 2, length * scale, 2);
  write(pen, colours);
  pen.textAlign = "left";
  letters(pen, `${length} m`, EDGE, size - EDGE - 5);
  pen.textAlign = "center";
  letters(pen, "N", size - EDGE - 4, EDGE + 18);
  pen.beginPath();
  pen.moveTo(size - EDGE - 4, EDGE - 3);
  pen.lineTo(size - EDGE, EDGE + 7);
  pen.lineTo(size - EDGE - 8, EDGE + 7);
  pen.fill();
}

function write(pen: CanvasRenderingContext2D, colours: SceneColours): void {
  pen.font = `600 ${LETTERS}px system-ui, sans-serif`;
  pen.fillStyle = css(colours.ink);
  pen.strokeStyle = css(colours.background);
  pen.lineWidth = 3;
  pen.lineJoin = "round";
}

function letters(pen: CanvasRenderingContext2D, words: string, x: number, y: number): void {
  pen.strokeText(words, x, y);
  pen.fillText(words, x, y);
}
