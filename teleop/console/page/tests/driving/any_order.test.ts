import fc from "fast-check";
import { expect, it } from "vitest";
import { Harness, OTHER, moves, type SentJoy } from "./harness";

const KEYS = ["KeyW", "KeyA", "ArrowDown", "ArrowRight"] as const;

/** What hands do, and what happens meanwhile. */
type Step = readonly [kind: string, detail: number];

const HANDS = ["keydown", "repeat", "keyup", "space", "gear", "touch", "drag", "lift", "cancel", "deadman", "push", "turbo", "wait"] as const;
const WORLD = ["blur", "focus", "hide", "reveal", "plug", "unplug", "lost", "open", "estop", "reset", "other", "free", "unsent", "sent", "sleep"] as const;

const step = fc.tuple(fc.constantFrom(...HANDS, ...HANDS, ...WORLD), fc.nat(99));

function perform(page: Harness, [kind, detail]: Step): void {
  const code = KEYS[detail % KEYS.length] ?? "KeyW";
  const pad = page.pads[0];
  const does: Record<string, () => void> = {
    keydown: () => { page.key("keydown", code); },
    repeat: () => { page.key("keydown", code, { repeat: true }); },
    keyup: () => { page.key("keyup", code); },
    space: () => { page.key("keydown", "Space"); page.key("keyup", "Space"); },
    gear: () => { page.key("keydown", `Digit${1 + (detail % 3)}`); },
    touch: () => { page.pointer("pointerdown", 0, 0, 1 + (detail % 2)); },
    drag: () => { page.pointer("pointermove", detail - 50, detail % 7, 1 + (detail % 2)); },
    lift: () => { page.pointer("pointerup", 0, 0, 1 + (detail % 2)); },
    cancel: () => { page.pointer("pointercancel", 0, 0, 1 + (detail % 2)); },
    deadman: () => { if (pad) { pad.buttons[4] = { pressed: detail % 2 === 0, value: 0 }; pad.timestamp += 1; } },
    push: () => { if (pad) { pad.axes[1] = (detail - 50) / 50; pad.timestamp += 1; } },
    turbo: () => { if (pad) { pad.buttons[5] = { pressed: detail % 2 === 0, value: 0 }; } },
    wait: () => { page.wait(detail * 3); },
    blur: () => { window.dispatchEvent(new Event("blur")); },
    focus: () => { window.dispatchEvent(new Event("focus")); },
    hide: () => { page.hide(); },
    reveal: () => { page.reveal(); },
    plug: () => { if (page.pads.length === 0) { page.plug(); } },
    unplug: () => { page.pads = []; },
    lost: () => { page.state.connection.value = { phase: "lost", words: "", sinceAt: 0 }; },
    open: () => { page.state.connection.value = { phase: "open", words: "", sinceAt: 0 }; },
    estop: () => { page.says({ estop: true, state: "estop", armed: false, controller: "" }); },
    reset: () => { page.says({ estop: false, state: "idle", armed: false, controller: "" }); },
    other: () => { page.says({ controller: OTHER, state: "armed", armed: true }); },
    free: () => { page.says({ controller: "", state: "idle", armed: false }); },
    unsent: () => { page.reachable = false; },
    sent: () => { page.reachable = true; },
    sleep: () => { page.wallSkew += 1000 + detail; page.wait(16); },
  };
  does[kind]?.();
}

/** Whether any input is held, as its owner's hand would know. */
function handsHold(held: ReadonlySet<string>): boolean {
  return held.size > 0;
}

/** Follow which inputs hands hold, however the page counts them. */
function follow(held: Set<string>, [kind, detail]: Step, page: Harness): void {
  const code = KEYS[detail % KEYS.length] ?? "KeyW";
  const pointer = `pointer ${1 + (detail % 2)}`;
  if (kind === "keydown") {
    held.add(code);
  } else if (kind === "keyup") {
    held.delete(code);
  } else if (kind === "touch") {
    held.add(pointer);
  } else if (kind === "lift" || kind === "cancel") {
    held.delete(pointer);
  } else if ((kind === "deadman" || kind === "unplug") && page.pads.length > 0) {
    if (kind === "deadman" && detail % 2 === 0) {
      held.add("deadman");
    } else {
      held.delete("deadman");
    }
  }
}

/** Check that each run of commands begins with a neutral one, and that none of them is too large. */
function checkStream(joys: readonly SentJoy[]): void {
  joys.forEach((joy, at) => {
    const before = joys[at - 1];
    if (moves(joy)) {
      expect(before?.deadman).toBe(true);
    }
    expect(Math.max(Math.abs(joy.forward), Math.abs(joy.turn))).toBeLessThanOrEqual(1);
    if (!joy.deadman) {
      expect([joy.forward, joy.turn, joy.turbo]).toEqual([0, 0, false]);
    }
  });
}

it("never moves without a held input, and begins each run of commands with a neutral one, whatever the order", () => {
  fc.assert(fc.property(fc.array(step, { maxLength: 60 }), (steps) => {
    const page = new Harness();
    const held = new Set<string>();
    try {
      for (const one of steps) {
        const count = page.joys.length;
        const before = handsHold(held);
        follow(held, one, page);
        perform(page, one);
        if (!before && !handsHold(held)) {
          expect(page.movedSince(count)).toBe(false);
        }
        page.wait(80);
        if (!handsHold(held) && page.reachable) {
          expect(page.last?.deadman ?? false).toBe(false);
        }
      }
      checkStream(page.joys);
    } finally {
      page.dispose();
    }
  }), { numRuns: 300 });
});

it.each(["blur", "hide", "lost", "estop", "other", "sleep", "space"])(
  "ends with a neutral command without deadman after %s, and sends no motion until a new press, whatever came before",
  (kind) => {
    fc.assert(fc.property(fc.array(step, { maxLength: 40 }), fc.nat(99), (steps, detail) => {
      const page = new Harness();
      try {
        for (const one of steps) {
          perform(page, one);
        }
        page.reachable = true;
        page.wait(80);
        const count = page.joys.length;
        perform(page, [kind, detail]);
        for (const after of ["wait", "focus", "reveal", "open", "reset", "free", "drag", "repeat", "wait", "push", "wait"]) {
          expect(page.last?.deadman ?? false).toBe(false);
          perform(page, [after, detail]);
        }
        expect(page.movedSince(count)).toBe(false);
        expect(page.last?.deadman ?? false).toBe(false);
      } finally {
        page.dispose();
      }
    }), { numRuns: 100 });
  },
);
