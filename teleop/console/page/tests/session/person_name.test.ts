import { expect, it } from "vitest";
import { friendlyName, validName } from "../../src/session/person_name";

it("is friendly for whoever has not said one", () => {
  expect(friendlyName(() => 0.99)).toBe("Violet Swift");
  expect(friendlyName(() => 0)).toBe("Amber Crane");
});

it("is what was kept, if that is a name", () => {
  expect(validName("  Anna ")).toBe("Anna");
  expect(validName("n".repeat(100))).toHaveLength(24);
  for (const bad of ["  ", 7, undefined]) {
    expect(validName(bad)).toBeUndefined();
  }
});
