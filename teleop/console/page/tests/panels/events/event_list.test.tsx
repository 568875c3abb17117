import { afterEach, expect, it } from "vitest";
import { EventList } from "../../../src/panels/events/event_list";
import { EventLog } from "../../../src/panels/events/event_log";
import { mount, type Mounted } from "../mounted";

let page: Mounted;
afterEach(() => { page.unmount(); });

it("shows words from the wire as text, newest first", async () => {
  const log = new EventLog();
  page = await mount(<EventList log={log} copy={() => Promise.resolve(true)} />);
  await page.act(() => {
    log.add("warning", "<img src=x onerror=alert(1)>");
    log.add("info", "second");
    log.add("info", "second");
  });
  const lines = [...page.root.querySelectorAll("li")].map((line) => line.textContent);
  expect(lines[0]).toContain("second · 2 times");
  expect(lines[1]).toContain("<img src=x onerror=alert(1)>");
  expect(page.root.querySelector("img")).toBeNull();
});

it("leaves out notes while only warnings and alarms are wanted, which the browser keeps", async () => {
  const [log, kept] = [new EventLog(), new Map<string, string>()];
  const keeper = { getItem: (key: string) => kept.get(key) ?? null, setItem: (key: string, text: string) => { kept.set(key, text); } };
  log.add("info", "a note");
  log.add("warning", "a warning");
  page = await mount(<EventList log={log} keeper={keeper} />);
  await page.act(() => { page.root.querySelector("input")?.click(); });
  expect([...page.root.querySelectorAll("li")].map((line) => line.textContent).join()).not.toContain("a note");
  page.unmount();
  page = await mount(<EventList log={log} keeper={keeper} />);
  expect(page.text()).toContain("a warning");
  expect(page.text()).not.toContain("a note");
});

it("copies the events, or shows them to be copied by hand where there is no clipboard", async () => {
  const log = new EventLog();
  log.add("info", "an event");
  let clipboard: string | undefined;
  page = await mount(<EventList log={log} copy={(text) => { clipboard = text; return Promise.resolve(true); }} />);
  await page.act(() => { page.button("Copy").click(); });
  expect(clipboard).toContain("an event");
  expect(page.button("Copied")).toBeDefined();
  page.unmount();
  page = await mount(<EventList log={log} copy={() => Promise.resolve(false)} />);
  await page.act(() => { page.button("Copy").click(); });
  expect(page.root.querySelector("textarea")?.value).toContain("an event");
});
