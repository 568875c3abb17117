import fc from "fast-check";
import { expect, it } from "vitest";
import { MultipartReader, type StreamPart } from "../../src/camera/multipart_reader";

const BOUNDARY = "--boundarydonotcross\r\n";

function stream(...pictures: readonly string[]): Uint8Array {
  const parts = pictures.map((data, i) =>
    `Content-type: image/jpeg\r\nX-Timestamp: ${i}.500000000\r\nContent-Length: ${data.length}\r\n\r\n${data}\r\n${BOUNDARY}`);
  return new TextEncoder().encode(BOUNDARY + parts.join(""));
}

const read = (parts: readonly StreamPart[]) => parts.map(({ data, stamp }) => [new TextDecoder().decode(data), stamp]);

it("finds the same pictures however the stream is cut", () => {
  const whole = stream("first", "", "--boundarydonotcross\r\n\r\n", "last");
  fc.assert(fc.property(fc.array(fc.nat(whole.length)), (cuts) => {
    const reader = new MultipartReader();
    const ends = [...cuts.sort((a, b) => a - b), whole.length];
    const found = ends.flatMap((end, i) => reader.push(whole.subarray(ends[i - 1] ?? 0, end)));
    expect(read(found)).toEqual([["first", 0.5], ["", 1.5], ["--boundarydonotcross\r\n\r\n", 2.5], ["last", 3.5]]);
  }));
});

it("shows a picture before the next one comes", () => {
  const text = "Content-Length: 2\r\n\r\nab";
  expect(read(new MultipartReader().push(new TextEncoder().encode(BOUNDARY + text)))).toEqual([["ab", undefined]]);
});

it("refuses what is no stream of pictures", () => {
  const reading = (text: string) => () => new MultipartReader().push(new TextEncoder().encode(text));
  expect(reading("<!doctype html>\r\n\r\n")).toThrow("without its length");
  expect(reading(`Content-Length: 99999999999\r\n\r\n`)).toThrow("without its length");
  expect(reading("x".repeat(20_000))).toThrow("no header");
});
