/** PLY files of any layout. */

type Write = (view: DataView, at: number, value: number) => void;

export const TYPES: Readonly<Record<string, readonly [number, Write]>> = {
  char: [1, (view, at, value) => { view.setInt8(at, value); }],
  uint8: [1, (view, at, value) => { view.setUint8(at, value); }],
  short: [2, (view, at, value) => { view.setInt16(at, value, true); }],
  ushort: [2, (view, at, value) => { view.setUint16(at, value, true); }],
  int: [4, (view, at, value) => { view.setInt32(at, value, true); }],
  uint32: [4, (view, at, value) => { view.setUint32(at, value, true); }],
  float: [4, (view, at, value) => { view.setFloat32(at, value, true); }],
  double: [8, (view, at, value) => { view.setFloat64(at, value, true); }],
};

export type Property = readonly [name: string, type: string];

/** A PLY with these properties, whose values are the row plus ten times the column. */
export function ply(properties: readonly Property[], count: number, before = ""): ArrayBuffer {
  const lines = properties.map(([name, type]) => `property ${type} ${name}`);
  const text = ["ply", "format binary_little_endian 1.0", "comment x", ...(before === "" ? [] : [before]),
    `element vertex ${count}`, ...lines, "end_header", ""].join("\n");
  const head = new TextEncoder().encode(text);
  const skipped = before === "" ? 0 : 3;
  const stride = properties.reduce((sum, [, type]) => sum + (TYPES[type]?.[0] ?? 0), 0);
  const file = new Uint8Array(head.length + skipped + count * stride);
  file.set(head);
  const view = new DataView(file.buffer, head.length + skipped);
  let at = 0;
  for (let row = 0; row < count; row++) {
    for (const [column, [, type]] of properties.entries()) {
      const [size, write] = TYPES[type] ?? [0, () => undefined];
      write(view, at, row + 10 * column);
      at += size;
    }
  }
  return file.buffer;
}

export const XYZ: readonly Property[] = [["x", "float"], ["y", "float"], ["z", "float"]];
