/** Scans, grids and pictures. */

import type { CloudPoints, GridMap } from "../../values";
import type { Field } from "./field";
import { headerFrame, headerStamp, pose } from "./geometry";

const MOST_BEAMS = 100_000;
const MOST_CELLS = 64 * 1024 * 1024;
const LONGEST_PICTURE = 16 * 1024 * 1024;
const MOST_JOINTS = 1000;

/** `sensor_msgs/LaserScan` as points in the scanner's frame; beams without a return are left out. */
export function readLaserScan(message: Field, receivedAt: number): CloudPoints {
  const first = message.at("angle_min").within(-1e3, 1e3);
  const step = message.at("angle_increment").within(-1e3, 1e3);
  const nearest = message.at("range_min").within(0, 1e6);
  const farthest = message.at("range_max").within(0, 1e6);
  const ranges = message.at("ranges").numbers(MOST_BEAMS);
  const points: number[] = [];
  for (let i = 0; i < ranges.length; i++) {
    const range = ranges[i] ?? NaN;
    if (range >= nearest && range <= farthest) {
      points.push(range * Math.cos(first + i * step), range * Math.sin(first + i * step), 0);
    }
  }
  return {
    stamp: headerStamp(message),
    receivedAt,
    frame: headerFrame(message),
    positions: Float32Array.from(points),
    distances: new Float32Array(points.length / 3).fill(NaN),
  };
}

/** `nav_msgs/OccupancyGrid`: 0 free to 100 occupied, -1 unknown. */
export function readOccupancyGrid(message: Field): GridMap {
  const info = message.at("info");
  const width = info.at("width").count(MOST_CELLS);
  const height = info.at("height").count(MOST_CELLS);
  const part = message.at("data");
  const cells = part.numbers(MOST_CELLS);
  if (cells.length !== width * height) {
    part.fail("does not have width times height cells");
  }
  return {
    frame: headerFrame(message),
    origin: pose(info.at("origin")),
    resolution: info.at("resolution").within(1e-4, 1e3),
    width,
    height,
    cells: cells instanceof Int8Array ? cells : Int8Array.from(Array.from(cells), knownCell),
  };
}

function knownCell(value: number): number {
  return value >= 0 && value <= 100 ? value : -1;
}

/** `sensor_msgs/CompressedImage`, if it is of a kind that browsers show. */
export function readCompressedImage(message: Field): { readonly type: string; readonly data: Uint8Array } {
  const format = message.at("format").text().toLowerCase();
  const data = message.at("data").bytes(LONGEST_PICTURE);
  // Formats are "jpeg", "png" or, of image_transport, "rgb8; jpeg compressed bgr8".
  const type = format.includes("png") ? "image/png" : /jpe?g/.test(format) ? "image/jpeg" : undefined;
  return type === undefined ? message.at("format").fail("is neither JPEG nor PNG") : { type, data };
}

/** `sensor_msgs/JointState`: positions by the joints' names; a joint without a position is left out. */
export function readJoints(message: Field): ReadonlyMap<string, number> {
  const names = message.at("name").list(MOST_JOINTS).map((name) => name.text());
  const positions = message.at("position").numbers(MOST_JOINTS);
  if (positions.length !== names.length && positions.length > 0) {
    message.at("position").fail("does not have a number for each name");
  }
  return new Map(names.map((name, at) => [name, positions[at] ?? NaN] as const).filter(([, position]) => Number.isFinite(position)));
}
