/** `farsteer_msgs/LeanCloud`: a thinned cloud of 7 bytes a point. */

import type { CloudPoints } from "../../values";
import type { Field } from "./field";
import { headerFrame, headerStamp, vector } from "./geometry";

const POINT_BYTES = 7;
const MOST_BYTES = POINT_BYTES * 100_000;
const UNKNOWN = 255;

/** Read x, y, z as int16 in steps of the resolution from the origin, and the distance to the map as uint8 [cm]. */
export function readLeanCloud(message: Field, receivedAt: number): CloudPoints {
  const origin = vector(message.at("origin"));
  const step = message.at("resolution").within(1e-6, 100);
  const part = message.at("data");
  const data = part.bytes(MOST_BYTES);
  if (data.length % POINT_BYTES !== 0) {
    part.fail(`is not a multiple of ${POINT_BYTES} bytes`);
  }
  const count = data.length / POINT_BYTES;
  const view = new DataView(data.buffer, data.byteOffset, data.byteLength);
  const positions = new Float32Array(3 * count);
  const distances = new Float32Array(count);
  for (let i = 0; i < count; i++) {
    const at = POINT_BYTES * i;
    positions[3 * i] = origin.x + step * view.getInt16(at, true);
    positions[3 * i + 1] = origin.y + step * view.getInt16(at + 2, true);
    positions[3 * i + 2] = origin.z + step * view.getInt16(at + 4, true);
    const centimetres = view.getUint8(at + 6);
    distances[i] = centimetres === UNKNOWN ? NaN : centimetres / 100;
  }
  return { stamp: headerStamp(message), receivedAt, frame: headerFrame(message), positions, distances };
}
