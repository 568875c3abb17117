import { McapWriter, TempBuffer } from "@mcap/core";
import { expect, it } from "vitest";
import { readRun } from "../../src/replay/run_reader";

const TEXT = new TextEncoder();

/** Return where a word stands in a file. */
function placeOf(word: string, file: Uint8Array): number {
  return file.findIndex((_, from) => TEXT.encode(word).every((byte, to) => file[from + to] === byte));
}

/** Return a file of a message each second, in chunks of their own. @param length Of their words, as they claim. */
async function recorded(messages: number, length = 6): Promise<Uint8Array> {
  const file = new TempBuffer();
  const writer = new McapWriter({ writable: file, chunkSize: 1 });
  await writer.start({ profile: "ros2", library: "" });
  const schemaId = await writer.registerSchema({ name: "std_msgs/msg/String", encoding: "ros2msg", data: TEXT.encode("string data") });
  const channelId = await writer.registerChannel({ topic: "/words", schemaId, messageEncoding: "cdr", metadata: new Map() });
  for (let at = 0; at < messages; at += 1) {
    const time = BigInt(at) * 1_000_000_000n;
    // CDR, little endian: length with the final zero, and the text.
    const data = Uint8Array.from([0, 1, 0, 0, length, 0, 0, 0, ...TEXT.encode("word"), 48 + at, 0]);
    await writer.addMessage({ channelId, sequence: at, logTime: time, publishTime: time, data });
  }
  await writer.end();
  return file.get();
}

it("reads a whole run", async () => {
  const run = readRun("whole.mcap", await recorded(4));
  expect([run.whole, run.length, run.messages.map((message) => message.decode())]).toEqual([
    true, 3000, ["word0", "word1", "word2", "word3"].map((data) => ({ data })),
  ]);
});

it("reads what comes before the place where a run was cut off, and knows that it was", async () => {
  const file = await recorded(4);
  const run = readRun("cut.mcap", file.subarray(0, placeOf("word2", file)));
  expect([run.whole, run.messages.length]).toEqual([false, 2]);
});

it("reads what comes before a byte that has changed", async () => {
  const file = await recorded(4);
  file[placeOf("word2", file)] = 0;
  const run = readRun("changed.mcap", file);
  expect([run.whole, run.messages.length]).toEqual([false, 2]);
});

it("says of what is no run, or holds nothing, that it cannot be read", async () => {
  expect(() => readRun("notes.txt", TEXT.encode("hello, this is no run at all"))).toThrow(/^notes.txt is no run that can be read/);
  const empty = await recorded(0);
  expect(() => readRun("empty.mcap", empty)).toThrow("it holds no messages");
});

it("makes nothing of a message that is not as its description says", async () => {
  const run = readRun("odd.mcap", await recorded(2, 200));
  expect(run.messages.map((message) => message.decode())).toEqual([undefined, undefined]);
});
