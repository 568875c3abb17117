import { expect, it } from "vitest";
import { Complaints, REPEAT_AFTER } from "../../src/link/complaints";

it("reports each kind of complaint at once, then counts it", () => {
  let now = 0;
  const reports: string[] = [];
  const complaints = new Complaints((source, complaint, repeated) => {
    reports.push(`${source}: ${complaint} ${repeated}`);
  }, () => now);
  for (let i = 0; i < 100; i++) {
    complaints.add("/tf", `transforms[${i}].x is missing`);
  }
  complaints.add("/odom", "x is missing");
  expect(reports).toEqual(["/tf: transforms[0].x is missing 0", "/odom: x is missing 0"]);
  now = REPEAT_AFTER;
  complaints.add("/tf", "transforms[7].x is missing");
  expect(reports.at(-1)).toBe("/tf: transforms[7].x is missing 100");
});

it("is not flooded by ever other complaints", () => {
  let reports = 0;
  const complaints = new Complaints(() => {
    reports += 1;
  }, () => 0);
  for (let i = 0; i < 10_000; i++) {
    complaints.add("robot", `complaint ${i}`);
  }
  expect(reports).toBe(200);
});
