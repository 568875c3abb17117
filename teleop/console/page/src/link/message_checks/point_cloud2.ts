/** `sensor_msgs/PointCloud2`: points with fields of any layout, and the distance to the map if it has one. */

import type { CloudPoints } from "../../values";
import type { Field } from "./field";
import { headerFrame, headerStamp } from "./geometry";

/** Points that the page shows of one cloud; of larger ones it takes every second, third, ... point. */
export const MOST_POINTS = 200_000;

const MOST_BYTES = 64 * 1024 * 1024;
const MOST_IN_A_ROW = 1 << 26;

interface Column {
  readonly offset: number;
  readonly read: (view: DataView, at: number, little: boolean) => number;
  readonly size: number;
  readonly float32: boolean;
}

/** Size and reader of each of PointField's datatypes. */
const DATATYPES: ReadonlyMap<number, Omit<Column, "offset">> = new Map([
  [1, { size: 1, float32: false, read: (view, at) => view.getInt8(at) }],
  [2, { size: 1, float32: false, read: (view, at) => view.getUint8(at) }],
  [3, { size: 2, float32: false, read: (view, at, little) => view.getInt16(at, little) }],
  [4, { size: 2, float32: false, read: (view, at, little) => view.getUint16(at, little) }],
  [5, { size: 4, float32: false, read: (view, at, little) => view.getInt32(at, little) }],
  [6, { size: 4, float32: false, read: (view, at, little) => view.getUint32(at, little) }],
  [7, { size: 4, float32: true, read: (view, at, little) => view.getFloat32(at, little) }],
  [8, { size: 8, float32: false, read: (view, at, little) => view.getFloat64(at, little) }],
] satisfies [number, Omit<Column, "offset">][]);

/** Read a cloud; points without finite coordinates are left out. */
export function readPointCloud2(message: Field, receivedAt: number): CloudPoints {
  const width = message.at("width").count(MOST_IN_A_ROW);
  const height = message.at("height").count(MOST_IN_A_ROW);
  const pointStep = message.at("point_step").count(1 << 16);
  const rowStep = message.at("row_step").count(MOST_BYTES);
  const columns = readColumns(message.at("fields"), pointStep);
  const data = message.at("data").bytes(MOST_BYTES);
  const points = width * height;
  if (points > 0) {
    if (height > 1 && rowStep < width * pointStep) {
      message.at("row_step").fail("is shorter than a row of points");
    }
    if (data.length < (height - 1) * rowStep + width * pointStep) {
      message.at("data").fail("is shorter than its points");
    }
  }
  const little = !message.at("is_bigendian").boolean();
  const { positions, distances } = copyPoints(data, columns, { width, points, pointStep, rowStep, little });
  return { stamp: headerStamp(message), receivedAt, frame: headerFrame(message), positions, distances };
}

interface Layout {
  readonly width: number;
  readonly points: number;
  readonly pointStep: number;
  readonly rowStep: number;
  readonly little: boolean;
}

interface Columns {
  readonly x: Column;
  readonly y: Column;
  readonly z: Column;
  readonly distance: Column | undefined;
}

function readColumns(fields: Field, pointStep: number): Columns {
  const found = new Map<string, Column>();
  for (const field of fields.list(64)) {
    const name = field.at("name").text();
    const datatype = DATATYPES.get(field.at("datatype").count(255));
    const offset = field.at("offset").count(1 << 16);
    if (datatype === undefined) {
      field.at("datatype").fail("is not a type of point fields");
    } else if (offset + datatype.size > pointStep) {
      field.at("offset").fail("is beyond the point");
    } else {
      found.set(name, { offset, ...datatype });
    }
  }
  const column = (name: string): Column => found.get(name) ?? fields.fail(`have no ${name}`);
  return { x: column("x"), y: column("y"), z: column("z"), distance: found.get("distance") };
}

function copyPoints(
  data: Uint8Array, columns: Columns, layout: Layout,
): { positions: Float32Array; distances: Float32Array } {
  const view = new DataView(data.buffer, data.byteOffset, data.byteLength);
  const { little } = layout;
  const every = Math.max(1, Math.ceil(layout.points / MOST_POINTS));
  const capacity = Math.ceil(layout.points / every);
  const positions = new Float32Array(3 * capacity);
  const distances = new Float32Array(capacity);
  const { x, y, z, distance } = columns;
  // The usual layout without a call through a table: a million points would cost twice as much.
  const plain = x.float32 && y.float32 && z.float32;
  let kept = 0;
  for (let i = 0; i < layout.points; i += every) {
    const row = Math.floor(i / layout.width);
    const at = row * layout.rowStep + (i - row * layout.width) * layout.pointStep;
    const px = plain ? view.getFloat32(at + x.offset, little) : x.read(view, at + x.offset, little);
    const py = plain ? view.getFloat32(at + y.offset, little) : y.read(view, at + y.offset, little);
    const pz = plain ? view.getFloat32(at + z.offset, little) : z.read(view, at + z.offset, little);
    if (!(Math.abs(px) < 1e7 && Math.abs(py) < 1e7 && Math.abs(pz) < 1e7)) {
      continue;
    }
    positions[3 * kept] = px;
    positions[3 * kept + 1] = py;
    positions[3 * kept + 2] = pz;
    const off = distance === undefined ? NaN : distance.read(view, at + distance.offset, little);
    // Behind a mapped surface it is negative.
    distances[kept] = Math.abs(off) < 1e7 ? off : NaN;
    kept += 1;
  }
  return kept === capacity
    ? { positions, distances }
    : { positions: positions.slice(0, 3 * kept), distances: distances.slice(0, kept) };
}
