import { signal, type Signal } from "@preact/signals";
import { afterEach, beforeEach, expect, it } from "vitest";
import { closeTopDialog, Dialog } from "../../src/panels/dialog";
import { mount, type Mounted } from "./mounted";

let page: Mounted;
let open: Signal<boolean>;

function Page() {
  return (
    <>
      <button type="button" onClick={() => { open.value = true; }}>open it</button>
      <Dialog title="A dialog" open={open.value} onClose={() => { open.value = false; }}>
        <button type="button">inside</button>
      </Dialog>
    </>
  );
}

beforeEach(async () => {
  open = signal(false);
  page = await mount(<Page />);
});

afterEach(() => { page.unmount(); });

const dialog = (): HTMLDialogElement | null => page.root.querySelector("dialog");

it("opens, is named, and gives the focus back when it is closed", async () => {
  page.button("open it").focus();
  await page.act(() => { page.button("open it").click(); });
  expect(dialog()?.open).toBe(true);
  const name = dialog()?.getAttribute("aria-labelledby") ?? "";
  expect(document.getElementById(name)?.textContent).toBe("A dialog");
  await page.act(() => { page.button("Close").click(); });
  expect(dialog()?.open).toBe(false);
  expect(document.activeElement).toBe(page.button("open it"));
});

it("keeps the focus inside at both ends", async () => {
  await page.act(() => { page.button("open it").click(); });
  const tab = (shiftKey: boolean): void => {
    document.activeElement?.dispatchEvent(new KeyboardEvent("keydown", { key: "Tab", shiftKey, bubbles: true, cancelable: true }));
  };
  page.button("inside").focus();
  tab(false);
  expect(document.activeElement).toBe(page.button("Close"));
  tab(true);
  expect(document.activeElement).toBe(page.button("inside"));
});

it("is closed by Esc before Esc means anything else", async () => {
  expect(closeTopDialog()).toBe(false);
  await page.act(() => { open.value = true; });
  await page.act(() => { expect(closeTopDialog()).toBe(true); });
  expect(open.value).toBe(false);
  expect(dialog()?.open).toBe(false);
});
