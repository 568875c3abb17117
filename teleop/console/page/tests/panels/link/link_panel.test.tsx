import { signal } from "@preact/signals";
import { afterEach, expect, it } from "vitest";
import { LinkPanel } from "../../../src/panels/link/link_panel";
import { unknownState, type LinkStatistics } from "../../../src/robot/robot_state";
import { mount, type Mounted } from "../mounted";

const LINK: LinkStatistics = {
  roundTrip: 23.4, roundTripP95: 260, jitter: 4, pageLag: 0, bytesPerSecond: 250_000, silence: 40,
  streams: [
    { topic: "/tf", age: 2000, rate: 10, dropped: 3 },
    { topic: "/map_info", age: 900_000, rate: 0, dropped: 0 },
  ],
  hops: [
    { name: "robot", took: 40, grows: false },
    { name: "queue", took: 150, grows: true },
    { name: "wireUp", took: 12, grows: false },
  ],
};

let page: Mounted;
afterEach(() => { page.unmount(); });

it("shows figures with colours, the worst as one word, and the streams", async () => {
  const state = unknownState();
  const link = signal(LINK);
  page = await mount(<LinkPanel link={link} state={state} />);
  expect(page.root.querySelector(".panel-lamp")?.textContent).toBe("Link: lost");
  await page.act(() => { state.connection.value = { phase: "open", words: "", sinceAt: 0 }; });
  expect(page.root.querySelector(".panel-lamp")?.textContent).toBe("Link: slow");
  expect(page.root.querySelector(".panel-lamp")?.getAttribute("data-grade")).toBe("amber");
  expect(page.text()).toContain("23 ms");
  expect(page.text()).toContain("2.0 Mbit/s");
  const rows = [...page.root.querySelectorAll("tbody tr")].map((row) => row.getAttribute("data-grade"));
  expect(rows).toEqual(["red", "unknown"]);
  const ways = [...page.root.querySelectorAll(".panel-way")].map((way) => way.textContent);
  expect(ways[0]).toContain("What you see: 190 ms");
  expect(ways[0]).toContain("waiting to be sent 150 ms, growing");
  expect(ways[1]).toContain("What you command: 12 ms");
  await page.act(() => { link.value = { ...LINK, roundTrip: undefined, silence: Infinity, streams: [] }; });
  expect(page.text()).toContain("unknown");
  expect(page.text()).toContain("never");
});

it("shows the thresholds when the question mark gets the focus, until Esc", async () => {
  page = await mount(<LinkPanel link={signal(LINK)} state={unknownState()} />);
  const help = page.button("What the colours mean");
  const text = page.root.querySelector<HTMLElement>("[role='note']");
  expect(text?.hidden).toBe(true);
  await page.act(() => { help.focus(); });
  expect(text?.hidden).toBe(false);
  expect(text?.textContent).toContain("Round trip: green up to 200 ms, amber up to 500 ms, red above.");
  await page.act(() => { help.dispatchEvent(new KeyboardEvent("keydown", { key: "Escape", bubbles: true })); });
  expect(text?.hidden).toBe(true);
});
