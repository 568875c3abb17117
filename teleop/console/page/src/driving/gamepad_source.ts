/** Driving by gamepads, read by polling: plugged in and out at any time. */

import { signal } from "@preact/signals";
import { RESTING, type DriveSource, type SourceName, type SourceReading } from "./drive_source";
import { GamepadFreshness } from "./gamepad_freshness";
import { readGamepad, type GamepadReading, type MappingStore } from "./gamepad_mapping";

/** A gamepad as the page names it. */
export interface PadInfo {
  readonly index: number;
  readonly id: string;
  /** Whether it can drive; else it needs a mapping first. */
  readonly mapped: boolean;
}

export interface GamepadHooks {
  /** The pad that drove is unplugged, or reports nothing any more. */
  lost(why: "unplugged" | "frozen"): void;
  estop(): void;
  takeOver(): void;
}

interface PadState {
  readonly freshness: GamepadFreshness;
  /** Whether the deadman was seen up since everything counted as released. */
  released: boolean;
  /** Whether the deadman was pressed with the stick pushed. */
  centring: boolean;
  before: GamepadReading;
}

const REST: GamepadReading = {
  forward: 0, turn: 0, deadman: false, turbo: false, estop: false, takeOver: false,
};

export class GamepadSource implements DriveSource {
  readonly name: SourceName = "gamepad";
  readonly pads = signal<readonly PadInfo[]>([]);
  /** Whether the pads only show what they do, while a person maps them. */
  readonly mapping = signal(false);
  /** Whether the pads move something else than the wheels; their other buttons go on working. */
  readonly elsewhere = signal(false);
  private readonly states = new Map<string, PadState>();
  private owner: string | undefined;
  private reading = RESTING;

  /**
   * @param navigator Where the browser lists gamepads; without a secure context it lists none.
   * @param store The mappings.
   */
  constructor(
    private readonly navigator: Navigator,
    readonly store: MappingStore,
    private readonly hooks: GamepadHooks,
  ) {}

  /** The gamepads that are plugged in and were used once, so that the browser shows them. */
  connected(): readonly Gamepad[] {
    try {
      return this.navigator.getGamepads().filter((pad): pad is Gamepad => pad?.connected === true);
    } catch {
      return []; // not in a secure context, or forbidden
    }
  }

  /** Look at all gamepads. */
  poll(now: number): void {
    const present = new Map(this.connected().map((pad) => [`${pad.index} ${pad.id}`, pad]));
    for (const key of [...this.states.keys()].filter((key) => !present.has(key))) {
      this.states.delete(key);
      if (key === this.owner) {
        this.hooks.lost("unplugged");
        this.owner = undefined;
      }
    }
    const readings = new Map<string, SourceReading>();
    for (const [key, pad] of present) {
      readings.set(key, this.look(key, pad, now));
    }
    if (this.owner === undefined || readings.get(this.owner)?.active !== true) {
      this.owner = [...readings].find(([, reading]) => reading.active)?.[0];
    }
    const any = [...readings.values()];
    this.reading = (this.owner === undefined ? undefined : readings.get(this.owner)) ?? any.find((r) => r.held || r.noDeadman) ?? RESTING;
    this.list([...present.values()]);
  }

  read(): SourceReading {
    return this.reading;
  }

  release(): void {
    for (const state of this.states.values()) {
      state.released = false;
    }
    this.owner = undefined;
    this.reading = this.reading.held ? { ...RESTING, held: true } : RESTING;
  }

  private look(key: string, pad: Gamepad, now: number): SourceReading {
    const mapping = this.store.of(pad);
    const at = mapping === undefined || this.mapping.value ? REST : readGamepad(pad, mapping);
    const state = this.states.get(key) ?? { freshness: new GamepadFreshness(), released: false, centring: false, before: at };
    this.states.set(key, state);
    const { before } = state;
    // What is pressed to be mapped is no order, not even if it is held until the mapping is done.
    state.before = this.mapping.value ? { ...at, estop: true, takeOver: true } : at;
    const pushed = at.forward !== 0 || at.turn !== 0;
    if (at.estop && !before.estop) {
      this.hooks.estop();
    }
    if (at.takeOver && !before.takeOver) {
      this.hooks.takeOver();
    }
    if (this.elsewhere.value) {
      state.released = state.centring = false;
      return RESTING;
    }
    if (!at.deadman) {
      state.released = mapping !== undefined && !this.mapping.value;
      state.centring = false;
      state.freshness.rested(now);
      return { ...RESTING, noDeadman: pushed };
    }
    state.centring = pushed && (state.centring || !before.deadman);
    if (state.freshness.frozen(pad, now) && pushed && state.released) {
      this.hooks.lost("frozen");
      state.released = false;
    }
    const active = state.released;
    const moving = active && !state.centring;
    return {
      ...RESTING,
      held: true,
      active,
      forward: moving ? at.forward : 0,
      turn: moving ? at.turn : 0,
      turbo: at.turbo,
      centring: state.centring,
    };
  }

  private list(present: readonly Gamepad[]): void {
    const infos = present.map((pad) => ({ index: pad.index, id: pad.id, mapped: this.store.of(pad) !== undefined }));
    if (JSON.stringify(infos) !== JSON.stringify(this.pads.value)) {
      this.pads.value = infos;
    }
  }
}
