/** Reads a recorded run: a file of ROS 2 messages (MCAP), whole or cut off where a disk was full. */

import { parse } from "@foxglove/rosmsg";
import { MessageReader } from "@foxglove/rosmsg2-serialization";
import { McapStreamReader, type McapTypes } from "@mcap/core";
import { decompress } from "fzstd";
import { replayTexts } from "../texts/replay";

/** One message of a run, which is decoded when it is wanted. */
export interface Recorded {
  readonly topic: string;
  /** Time of the robot's clock since the run's beginning [ms]. */
  readonly at: number;
  decode(): unknown;
}

export interface Run {
  readonly name: string;
  /** Length [ms]. */
  readonly length: number;
  /** All messages in the order of their times. */
  readonly messages: readonly Recorded[];
  /** The map's surfaces (glTF), if the run holds them. */
  readonly surfaces: ArrayBuffer | undefined;
  /** Whether the file ends as it should; else it was cut off or is damaged, and this is what comes before. */
  readonly whole: boolean;
}

/** Name of the attachment with the surfaces, as the robot's recorder calls it. */
const SURFACES = "map.glb";

/** Read a run; what makes no sense is an Error of one sentence. */
export function readRun(name: string, file: Uint8Array): Run {
  const found = { messages: [] as Recorded[], surfaces: undefined as ArrayBuffer | undefined, whole: false };
  const channels = new Map<number, (message: McapTypes.TypedMcapRecords["Message"], first: bigint) => Recorded>();
  const schemas = new Map<number, McapTypes.TypedMcapRecords["Schema"]>();
  const reader = new McapStreamReader({
    validateCrcs: true,
    decompressHandlers: { zstd: (chunk, size) => decompress(chunk, new Uint8Array(Number(size))) },
  });
  let first: bigint | undefined;
  try {
    reader.append(file);
    for (let record = reader.nextRecord(); record !== undefined; record = reader.nextRecord()) {
      if (record.type === "Schema") {
        schemas.set(record.id, record);
      } else if (record.type === "Channel" && !channels.has(record.id)) {
        channels.set(record.id, channelOf(record, schemas.get(record.schemaId)));
      } else if (record.type === "Attachment" && record.name === SURFACES) {
        found.surfaces = Uint8Array.from(record.data).buffer;
      } else if (record.type === "Footer") {
        found.whole = true;
      } else if (record.type === "Message") {
        first ??= record.logTime;
        const message = channels.get(record.channelId)?.(record, first);
        if (message !== undefined) {
          found.messages.push(message);
        }
      }
    }
  } catch (error) {
    if (found.messages.length === 0) {
      throw new Error(replayTexts.unreadable(name, error instanceof Error ? error.message : String(error)), { cause: error });
    }
    found.whole = false;
  }
  if (found.messages.length === 0) {
    throw new Error(replayTexts.unreadable(name, replayTexts.empty));
  }
  const messages = found.messages.sort((a, b) => a.at - b.at);
  return { name, length: messages.at(-1)?.at ?? 0, messages, surfaces: found.surfaces, whole: found.whole };
}

function channelOf(
  { topic, messageEncoding }: McapTypes.TypedMcapRecords["Channel"], schema: McapTypes.TypedMcapRecords["Schema"] | undefined,
): (message: McapTypes.TypedMcapRecords["Message"], first: bigint) => Recorded {
  let decoder: MessageReader | undefined;
  const decode = (data: Uint8Array): unknown => {
    if (messageEncoding !== "cdr" || schema?.encoding !== "ros2msg") {
      return undefined;
    }
    try {
      decoder ??= new MessageReader(parse(new TextDecoder().decode(schema.data), { ros2: true }));
      return decoder.readMessage(data);
    } catch {
      return undefined; // which no reader of messages takes: they say what is wrong
    }
  };
  return ({ data, logTime }, first) => {
    const kept = Uint8Array.from(data); // the reader's own buffer is used again
    return { topic, at: Number(logTime - first) / 1e6, decode: () => decode(kept) };
  };
}
