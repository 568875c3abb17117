import axe from "axe-core";
import { render, type ComponentChild } from "preact";
import { afterEach, beforeEach, describe, expect, it, vi } from "vitest";
import { DrivingPanel, EstopButton, GearSwitch, MappingPage, StickPad, TurnTaking } from "../../../src/panels/driving";
import { Harness, ME, OTHER } from "../../driving/harness";

let page: Harness;
let root: HTMLElement;

beforeEach(() => {
  page = new Harness();
  root = document.createElement("main");
  document.body.append(root);
});
afterEach(() => {
  render(null, root);
  page.dispose();
});

/** Show a component, with its effects done. */
async function show(child: ComponentChild): Promise<void> {
  render(child, root);
  await settle();
}

async function settle(): Promise<void> {
  await vi.advanceTimersByTimeAsync(150);
}

async function press(name: RegExp): Promise<void> {
  const button = [...root.querySelectorAll("button")].find((one) => name.test(one.getAttribute("aria-label") ?? one.textContent));
  expect(button, `a button ${name.source}`).toBeDefined();
  button?.click();
  await settle();
}

describe("the driving panel", () => {
  it("shows what is sent, what the robot does, and why it does not", async () => {
    await show(<DrivingPanel driving={page.driving} state={page.state} />);
    expect(root.textContent).toMatch(/Ready.*You ask fornothing.*stands still \(nobody has driven yet\)/);
    page.key("keydown", "KeyW");
    page.wait(300);
    page.says({ linear: 0.5, angular: -0.1 });
    await settle();
    expect(root.textContent).toMatch(/You drive.*100 % ahead · Normal · by keys.*0\.50 m\/s ahead, 6°\/s right/);
    page.hide();
    await settle();
    expect(root.querySelector("[role=status]")?.textContent).toMatch(/tab was hidden/);
  });

  it("shows text of the robot as text", async () => {
    page.says({ reason: "<img src=x onerror=alert(1)>" });
    await show(<DrivingPanel driving={page.driving} state={page.state} />);
    expect(root.querySelector("img")).toBeNull();
    expect(root.textContent).toContain("<img src=x");
  });

  it("asks before it drives a robot that nothing guards", async () => {
    page.dispose();
    page = new Harness("plain");
    document.body.append(root);
    await show(<DrivingPanel driving={page.driving} state={page.state} />);
    await press(/cmd_vel/);
    expect(page.driving.plainConfirmed.value).toBe(true);
    expect(root.querySelector("[role=group]")).toBeNull();
  });
});

describe("the gear switch", () => {
  it("shows the gear as pressed, and changes it", async () => {
    await show(<GearSwitch driving={page.driving} />);
    await press(/Precision/);
    expect(page.driving.gear.value).toBe("precision");
    expect([...root.querySelectorAll("button")].map((one) => one.getAttribute("aria-pressed"))).toEqual(["true", "false", "false"]);
  });
});

describe("a second finger", () => {
  it("presses buttons while the first one holds the stick, of which browsers make no click", async () => {
    await show(<GearSwitch driving={page.driving} />);
    const turbo = [...root.querySelectorAll("button")].at(-1);
    turbo?.dispatchEvent(new PointerEvent("pointerup", { pointerType: "touch", isPrimary: true, bubbles: true }));
    expect(page.driving.gear.value).toBe("normal");
    turbo?.dispatchEvent(new PointerEvent("pointerup", { pointerType: "touch", isPrimary: false, bubbles: true }));
    expect(page.driving.gear.value).toBe("turbo");
  });
});

describe("the stick", () => {
  it("takes pointers while it is shown, and shows whether they count", async () => {
    await show(<StickPad driving={page.driving} />);
    const pad = root.querySelector<HTMLElement>(".driving-stick");
    expect(pad).not.toBeNull();
    if (pad === null) {
      return;
    }
    pad.setPointerCapture = () => undefined;
    pad.dispatchEvent(new PointerEvent("pointerdown", { pointerId: 5, button: 0, clientX: 50, clientY: 50 }));
    pad.dispatchEvent(new PointerEvent("pointermove", { pointerId: 5, clientX: 50, clientY: -50 }));
    await settle();
    expect(pad.className).toContain("driving-held");
    expect(page.moving).toBe(true);
    render(null, root);
    expect(page.last?.deadman).toBe(false);
    await show(<StickPad driving={page.driving} />);
    const next = root.querySelector<HTMLElement>(".driving-stick") ?? pad;
    next.setPointerCapture = () => undefined;
    next.dispatchEvent(new PointerEvent("pointerdown", { pointerId: 6, button: 0 }));
    page.driving.stop();
    await settle();
    expect(next.className).toContain("driving-void");
    expect(page.last?.deadman).toBe(false);
  });
});

describe("the e-stop's button", () => {
  it("stops at the touch, shows what is pending, and asks once before the release", async () => {
    page.answer = () => new Promise(() => undefined);
    await show(<EstopButton driving={page.driving} state={page.state} />);
    root.querySelector("button")?.dispatchEvent(new PointerEvent("pointerdown"));
    expect(page.calls).toEqual(["estop"]);
    await settle();
    expect(root.querySelector("[role=alert]")?.textContent).toMatch(/not confirmed yet/);
    page.says({ estop: true, state: "estop", reason: `e-stop by ${ME}` });
    await settle();
    expect(root.querySelector("button")?.getAttribute("aria-pressed")).toBe("true");
    page.answer = () => Promise.resolve({ success: false, message: "only an admin resets it" });
    await press(/Release e-stop/);
    expect(document.activeElement?.textContent).toBe("Keep it stopped");
    await press(/^Release it/);
    expect(page.calls.at(-1)).toBe("resetEstop");
    expect(root.querySelector("[role=alert]")?.textContent).toMatch(/only an admin resets it/);
  });

  it("offers no release to whoever may not reset", async () => {
    page.says({ estop: true, state: "estop" });
    page.state.session.value = page.state.session.value && { ...page.state.session.value, mayReset: false };
    await show(<EstopButton driving={page.driving} state={page.state} />);
    expect(root.querySelectorAll("button")).toHaveLength(1);
  });
});

describe("taking turns", () => {
  it("offers to ask and to take over, and to give or refuse", async () => {
    page.says({ controller: OTHER, state: "armed", armed: true });
    await show(<TurnTaking driving={page.driving} />);
    expect(root.textContent).toMatch(/client 3 .* drives/);
    await press(/Ask/);
    await press(/Take over/);
    page.says({ controller: ME, asking: 3, askingName: OTHER });
    await settle();
    await press(/Refuse/);
    await press(/Give/);
    expect(page.calls).toEqual(["ask", "takeOver", "refuse", "give"]);
  });
});

describe("the mapping page", () => {
  it("learns a mapping from what is pushed and pressed, and keeps gamepads from driving meanwhile", async () => {
    const pad = page.plug("odd", "");
    let closed = 0;
    await show(<MappingPage driving={page.driving} secure onClose={() => { closed += 1; }} />);
    expect(page.driving.pads.mapping.value).toBe(true);
    for (const [name, axis, value] of [[/Set: Stick forward/, 3, -1], [/Set: Stick to the left/, 2, 1]] as const) {
      await press(name);
      pad.axes[axis] = value;
      await settle();
      pad.axes[axis] = 0;
      await settle();
    }
    await press(/^Save/);
    expect(root.textContent).toMatch(/at least/);
    await press(/Set: Deadman/);
    pad.buttons[6] = { pressed: true, value: 1 };
    await settle();
    await press(/^Save/);
    expect(root.textContent).toMatch(/axis 3 −.*axis 2 \+.*button 6.*Saved/s);
    expect(page.driving.pads.store.of({ id: "odd", mapping: "" })).toMatchObject({ forward: { axis: 3, sign: -1 }, deadman: 6 });
    await press(/^Close/);
    expect(closed).toBe(1);
    render(null, root);
    await settle();
    expect(page.driving.pads.mapping.value).toBe(false);
  });

  it("says what to do without a gamepad, and without a secure page", async () => {
    await show(<MappingPage driving={page.driving} secure onClose={() => undefined} />);
    expect(root.textContent).toMatch(/Plug one in/);
    await show(<MappingPage driving={page.driving} secure={false} onClose={() => undefined} />);
    expect(root.textContent).toMatch(/https/);
  });
});

it("is accessible in all its parts", async () => {
  vi.useRealTimers();
  page.says({ controller: OTHER, estop: true, state: "estop", asking: 4 });
  page.plug("odd", "");
  page.driving.estop.askReset();
  render(
    <>
      <DrivingPanel driving={page.driving} state={page.state} />
      <GearSwitch driving={page.driving} />
      <StickPad driving={page.driving} />
      <EstopButton driving={page.driving} state={page.state} />
      <TurnTaking driving={page.driving} />
      <MappingPage driving={page.driving} secure onClose={() => undefined} />
    </>,
    root,
  );
  const { violations } = await axe.run(root, { rules: { "color-contrast": { enabled: false }, region: { enabled: false } } });
  expect(violations.map(({ id, nodes }) => [id, nodes.map(({ html }) => html)])).toEqual([]);
});
