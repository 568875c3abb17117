/** Positions of a binary little-endian PLY, whatever other properties its vertices have. */

/** Why a file cannot be read, in words. */
export class PlyError extends Error {}

interface Property {
  readonly name: string;
  readonly type: string;
  readonly offset: number;
}

interface Header {
  /** Where the vertices begin in the file [bytes]. */
  readonly start: number;
  readonly count: number;
  readonly stride: number;
  readonly properties: readonly Property[];
}

const LONGEST_HEADER = 64 * 1024;
const MOST_POINTS = 50_000_000;

const SIZES: ReadonlyMap<string, number> = new Map([
  ["char", 1], ["int8", 1], ["uchar", 1], ["uint8", 1], ["short", 2], ["int16", 2], ["ushort", 2], ["uint16", 2],
  ["int", 4], ["int32", 4], ["uint", 4], ["uint32", 4], ["float", 4], ["float32", 4], ["double", 8], ["float64", 8],
]);

/**
 * Return x, y, z of all vertices in turn [m]; vertices that are not finite are left out.
 *
 * @throws PlyError with the reason if the file is no such PLY.
 */
export function readPly(file: ArrayBuffer): Float32Array<ArrayBuffer> {
  const header = readHeader(file);
  const { start, count, stride, properties } = header;
  if (start + count * stride > file.byteLength) {
    throw new PlyError(`it ends before its ${count} vertices do`);
  }
  const view = new DataView(file, start, count * stride);
  const [x, y, z] = ["x", "y", "z"].map((name) => reader(view, properties, name));
  const positions = new Float32Array(3 * count);
  let kept = 0;
  if (x === undefined || y === undefined || z === undefined) {
    throw new PlyError("its vertices have no x, y and z");
  }
  for (let i = 0, at = 0; i < count; i++, at += stride) {
    const px = x(at);
    const py = y(at);
    const pz = z(at);
    if (isPlace(px, py, pz)) {
      positions[kept] = px;
      positions[kept + 1] = py;
      positions[kept + 2] = pz;
      kept += 3;
    }
  }
  return kept === positions.length ? positions : positions.slice(0, kept);
}

/**
 * Return the unit normals of the vertices that `readPly` returns, times 127, or undefined if there are none.
 *
 * @throws PlyError as `readPly` does.
 */
export function readPlyNormals(file: ArrayBuffer): Int8Array<ArrayBuffer> | undefined {
  const { start, count, stride, properties } = readHeader(file);
  const view = new DataView(file, start, count * stride);
  const [x, y, z, nx, ny, nz] = ["x", "y", "z", "nx", "ny", "nz"].map((name) => reader(view, properties, name));
  if (x === undefined || y === undefined || z === undefined || nx === undefined || ny === undefined || nz === undefined) {
    return undefined;
  }
  const normals = new Int8Array(3 * count);
  let kept = 0;
  for (let i = 0, at = 0; i < count; i++, at += stride) {
    if (isPlace(x(at), y(at), z(at))) {
      normals[kept] = asByte(nx(at));
      normals[kept + 1] = asByte(ny(at));
      normals[kept + 2] = asByte(nz(at));
      kept += 3;
    }
  }
  return kept === normals.length ? normals : normals.slice(0, kept);
}

function isPlace(x: number, y: number, z: number): boolean {
  return Math.abs(x) < 1e7 && Math.abs(y) < 1e7 && Math.abs(z) < 1e7;
}

/** A part of a unit vector; what is none, or not finite, becomes the nearest that can be. */
function asByte(part: number): number {
  return Math.round(127 * Math.min(Math.max(part || 0, -1), 1));
}

function reader(view: DataView, properties: readonly Property[], name: string): ((at: number) => number) | undefined {
  const property = properties.find((one) => one.name === name);
  if (property === undefined) {
    return undefined;
  }
  const { offset, type } = property;
  switch (SIZES.get(type)) {
    case 8:
      return (at) => view.getFloat64(at + offset, true);
    case 4:
      return type.startsWith("float")
        ? (at) => view.getFloat32(at + offset, true)
        : type.startsWith("u") ? (at) => view.getUint32(at + offset, true) : (at) => view.getInt32(at + offset, true);
    case 2:
      return type.startsWith("u") ? (at) => view.getUint16(at + offset, true) : (at) => view.getInt16(at + offset, true);
    default:
      return type.startsWith("u") ? (at) => view.getUint8(at + offset) : (at) => view.getInt8(at + offset);
  }
}

function readHeader(file: ArrayBuffer): Header {
  const text = new TextDecoder("latin1").decode(new Uint8Array(file, 0, Math.min(LONGEST_HEADER, file.byteLength)));
  if (!/^ply\r?\n/.test(text)) {
    throw new PlyError("it is no PLY file");
  }
  const end = /\nend_header\r?\n/.exec(text);
  if (end === null) {
    throw new PlyError("its header has no end");
  }
  const lines = text.slice(0, end.index).split(/\r?\n/).map((line) => line.trim().split(/\s+/));
  const format = lines.find(([word]) => word === "format");
  if (format?.[1] !== "binary_little_endian") {
    throw new PlyError("it is not binary and little-endian");
  }
  return { ...readElements(lines, end.index + end[0].length) };
}

/** The vertex element; elements before it are passed over, those behind it ignored. */
function readElements(lines: readonly (readonly string[])[], bodyStart: number): Header {
  let start = bodyStart;
  let element: { readonly name: string; readonly count: number } | undefined;
  let properties: Property[] = [];
  let stride = 0;
  for (const [word, first = "", second = ""] of [...lines, ["element", "", "0"]]) {
    if (word === "element") {
      if (element?.name === "vertex") {
        return { start, count: element.count, stride, properties };
      }
      start += (element?.count ?? 0) * stride;
      element = { name: first, count: readCount(second) };
      properties = [];
      stride = 0;
    } else if (word === "property") {
      const size = SIZES.get(first);
      if (size === undefined) {
        throw new PlyError(`a property of its ${element?.name ?? "header"} has the type ${first}, of no fixed size`);
      }
      properties.push({ name: second, type: first, offset: stride });
      stride += size;
    }
  }
  throw new PlyError("it has no vertices");
}

function readCount(word: string): number {
  const count = Number(word);
  if (!Number.isInteger(count) || count < 0 || count > MOST_POINTS) {
    throw new PlyError(`it has ${word} of an element, which is no number of at most ${MOST_POINTS}`);
  }
  return count;
}
