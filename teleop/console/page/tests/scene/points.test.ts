import { describe, expect, fc, points, test } from "./tools";
import { PointBuffer } from "../../src/scene/cloud_layer";
import { Detail } from "../../src/scene/detail";
import { FrameTimes } from "../../src/scene/frame_times";
import { MapLayer } from "../../src/scene/map_layer";
import { evenStep, MapGeometry, spreadIndex } from "../../src/scene/map_points";
import { OldSweeps, thinned } from "../../src/scene/old_sweeps";
import { COLOURS, css, distanceColour, distanceLegend, DISTANCE_FULL, rgb } from "../../src/scene/palette";
import { WideLine } from "../../src/scene/wide_line";

const sweep = (count: number): [Float32Array, Float32Array] => [new Float32Array(3 * count).fill(1), new Float32Array(count)];

describe("old sweeps", () => {
  test("never hold more points than the ring has room for", () => {
    fc.assert(fc.property(fc.array(fc.nat(150), { maxLength: 40 }), (counts) => {
      const buffer = new PointBuffer(100);
      const old = new OldSweeps(buffer);
      counts.forEach((count, index) => { old.push(...sweep(count), { x: index, y: 0, yaw: 0 }, index, 4, 1); });
      expect(old.count).toBeLessThanOrEqual(100);
      expect(buffer.geometry.drawRange.count).toBe(old.count);
    }));
  });

  test("are thinned so that the ring spans the time of decay", () => {
    const buffer = new PointBuffer(8000);
    const old = new OldSweeps(buffer);
    for (let index = 0; index < 50; index += 1) {
      old.push(...sweep(1100), { x: index, y: 0, yaw: 0 }, index / 10, 5, 10);
    }
    const births = [...new Set(buffer.births.array)];
    expect(Math.min(...births)).toBeCloseTo(0, 6);
    expect(Math.max(...births)).toBeCloseTo(4.9, 5);
  });

  test("of a robot that stands are not news", () => {
    const old = new OldSweeps(new PointBuffer(100));
    const place = { x: 1, y: 2, yaw: 3.1 };
    expect(old.isNews(place)).toBe(true);
    old.push(...sweep(10), place, 0, 4, 10);
    expect(old.isNews({ ...place, x: 1.01 })).toBe(false);
    expect(old.isNews({ ...place, x: 1.2 })).toBe(true);
    expect(old.isNews({ ...place, yaw: 3.1 - 2 * Math.PI })).toBe(false);
    expect(old.isNews({ ...place, yaw: 2.9 })).toBe(true);
    old.clear();
    expect(old.isNews(place)).toBe(true);
  });

  test("are thinned evenly", () => {
    const positions = Float32Array.from({ length: 30 }, (_, at) => Math.floor(at / 3));
    const kept = thinned(positions, new Float32Array(10), 5);
    expect([...kept.positions].filter((_, at) => at % 3 === 0)).toEqual([0, 2, 4, 6, 8]);
  });
});

describe("the buffer of points", () => {
  test("takes no more than it has room for, and marks unknown distances", () => {
    const buffer = new PointBuffer(2);
    buffer.write(0, points([1, 2, 3], [4, 5, 6], [7, 8, 9]), Float32Array.of(NaN, -0.25, 3), 7);
    expect([...buffer.positions.array]).toEqual([1, 2, 3, 4, 5, 6]);
    expect([...buffer.distances.array]).toEqual([-1, 0.25]);
    expect([...buffer.births.array]).toEqual([7, 7]);
  });

  test("does not pile up changes while nothing is drawn", () => {
    const buffer = new PointBuffer(100);
    for (let index = 0; index < 1000; index += 1) {
      buffer.write(index % 90, points([1, 2, 3]), Float32Array.of(0), 0);
    }
    expect(buffer.positions.updateRanges.length).toBeLessThan(30);
    const [first] = buffer.positions.updateRanges;
    expect(first).toEqual({ start: 0, count: 3 * 90 });
  });
});

const spread = (count: number): Uint32Array => {
  const step = evenStep(count);
  return Uint32Array.from({ length: count }, (_, index) => spreadIndex(index, step, count));
};

describe("the map's points", () => {
  test("are taken in part by part, with nothing lost", () => {
    const positions = Float32Array.from({ length: 3000 }, (_, at) => at);
    const content = new MapGeometry({ sha256: "a", positions });
    content.fill(300);
    expect(content.filled).toBe(300);
    content.fill(300);
    content.fill(3000);
    expect(content.filled).toBe(1000);
    expect([...content.geometry.getAttribute("position").array].sort((a, b) => a - b)).toEqual([...positions]);
  });

  test("are all drawn once", () => {
    fc.assert(fc.property(fc.integer({ min: 0, max: 3000 }), (count) => {
      expect(new Set(spread(count)).size).toBe(count);
    }));
  });

  test("are evenly spread in any first part of their order", () => {
    for (const count of [20_000, 25_167, 99_295]) {
      const part = spread(count).subarray(0, Math.floor(count / 8)).sort();
      const gap = part.reduce((most, at, index) => Math.max(most, at - (part[index - 1] ?? at)), 0);
      expect(gap).toBeLessThan(24);
    }
  });

  test("give way to another map, and to none", () => {
    const map = new MapLayer();
    map.set({ sha256: "a", positions: points([0, 0, 0], [1, 1, 0], [2, 2, 2]) });
    expect(map.bounds?.max).toEqual({ x: 2, y: 2, z: 2 });
    map.set({ sha256: "b", positions: points([5, 5, 5]), normals: Int8Array.of(0, 0, 127) });
    expect(map.bounds?.min).toEqual({ x: 5, y: 5, z: 5 });
    map.set(undefined);
    expect(map.bounds).toBeUndefined();
    map.dispose();
  });
});

describe("the share of the map that is drawn in motion", () => {
  test("falls with slow frames and rises again with fast ones", () => {
    const detail = new Detail();
    for (let frame = 0; frame < 30; frame += 1) { detail.frame(120); }
    const low = detail.share;
    expect(low).toBeLessThan(0.3);
    expect(detail.sharpness).toBe(0.5);
    for (let frame = 0; frame < 600; frame += 1) { detail.frame(16); }
    expect([detail.share, detail.sharpness]).toEqual([1, 1]);
  });

  test("does not fall for a single hiccup", () => {
    const detail = new Detail();
    detail.frame(70);
    detail.frame(16);
    expect(detail.share).toBe(1);
  });
});

describe("lines", () => {
  const segments = (line: WideLine): number[][] => {
    const [start, end] = ["instanceStart", "instanceEnd"].map((name) => line.object.geometry.getAttribute(name));
    return Array.from({ length: line.object.geometry.instanceCount }, (_, at) => [start?.getX(at) ?? NaN, end?.getX(at) ?? NaN]);
  };

  test("drop their oldest quarter when they are full, and are joined as before", () => {
    const line = new WideLine(8, { width: 1 });
    for (let at = 0; at < 10; at += 1) { line.append(at, 0, 0); }
    expect(segments(line)).toEqual([[2, 3], [3, 4], [4, 5], [5, 6], [6, 7], [7, 8], [8, 9]]);
    line.clear();
    expect(segments(line)).toEqual([]);
    line.append(5, 0, 0);
    expect(segments(line)).toEqual([]);
  });

  test("have gaps between them", () => {
    const line = new WideLine(8, { width: 1 });
    line.set([[0, 0, 0, 1, 0, 0], [], [2, 0, 0, 3, 0, 0, 4, 0, 0]]);
    line.append(5, 0, 0);
    line.gap();
    line.append(7, 0, 0);
    line.append(8, 0, 0);
    expect(segments(line)).toEqual([[0, 1], [2, 3], [3, 4], [4, 5], [7, 8]]);
  });
});

describe("colours by distance", () => {
  test("run from blue to orange and are grey where nothing is known", () => {
    for (const colours of [COLOURS.day, COLOURS.night]) {
      const [near, far] = [distanceColour(0, colours), distanceColour(DISTANCE_FULL, colours)];
      expect(near[2]).toBeGreaterThan(near[0]);
      expect(far[0]).toBeGreaterThan(far[2]);
      expect(distanceColour(99, colours)).toEqual(far);
      expect(distanceColour(NaN, colours)).toEqual(colours.unknown);
    }
  });

  test("have a legend that ends with what is unknown", () => {
    const legend = distanceLegend("night");
    expect(legend.map(({ distance }) => distance)).toEqual([0, 0.05, 0.1, expect.closeTo(0.15), 0.2, undefined]);
    expect(legend[0]?.colour).toBe(css(COLOURS.night.distances[0]));
    expect(css(rgb(0xff8000))).toBe("rgb(255, 128, 0)");
  });
});

describe("frame times", () => {
  test("keep the newest, oldest first", () => {
    const times = new FrameTimes(3);
    [1, 2, 3, 4].forEach((time) => { times.add(time); });
    expect(times.values()).toEqual([2, 3, 4]);
    times.clear();
    expect(times.values()).toEqual([]);
  });
});
