/** Driving by a headset's controller: its grip is the deadman, its stick drives. A gamepad like others to the page. */

import type { SourceName, SourceReading } from "../driving/drive_source";
import { type GamepadMapping, MappingStore, STANDARD_MAPPING } from "../driving/gamepad_mapping";
import { GamepadSource } from "../driving/gamepad_source";
import type { Renewed } from "../values";
import type { ControllerLayout } from "./controller_layout";
import type { Side } from "./inputs";

/**
 * Without a frame for so long everything counts as released [ms]: a headset that sleeps sends none and says nothing. Half of
 * the robot's watchdog (500 ms), and 18 frames of the slowest headset.
 */
export const FRAMES_MISSING = 250;

/** A controller as the browser lists gamepads. */
type Pad = Pick<Gamepad, "id" | "index" | "connected" | "mapping" | "timestamp" | "axes" | "buttons">;

const NAMES = { left: "headset left", right: "headset right" } as const;

/** The controller of the newest frame, when that was [ms], and whether it was there; one object for good. */
interface Shown {
  there: boolean;
  at: number;
  readonly pads: readonly [Renewed<Pad>];
}

export class HeadsetSource extends GamepadSource {
  override readonly name: SourceName = "headset";
  /** Share of the gear's speed that the stick asks for at most. */
  cap = 1;
  readonly #shown: Shown;
  readonly #mapping: ControllerMapping;

  /**
   * @param now The page's clock [ms].
   * @param lost Is called when the controller that drives is there no more.
   */
  constructor(private readonly now: () => number, lost: () => void) {
    const shown: Shown = {
      there: false, at: -Infinity, pads: [{ id: "", index: 0, connected: true, mapping: "", timestamp: 0, axes: [], buttons: [] }],
    };
    const list = (): readonly Pad[] => (shown.there && now() - shown.at < FRAMES_MISSING ? shown.pads : []);
    const mapping = new ControllerMapping(() => localStorage);
    super({ getGamepads: list } as unknown as Navigator, mapping, { lost, estop: () => undefined, takeOver: () => undefined });
    this.#shown = shown;
    this.#mapping = mapping;
  }

  /** Take over what the driving hand does in a frame. */
  frame(side: Side): void {
    const { pad } = side;
    const shown = this.#shown;
    this.#mapping.take(side.layout);
    shown.at = this.now();
    shown.there = pad !== undefined;
    if (pad !== undefined) {
      const kept = shown.pads[0];
      kept.id = NAMES[side.hand];
      kept.mapping = pad.mapping;
      kept.timestamp = shown.at;
      kept.axes = pad.axes;
      kept.buttons = pad.buttons;
    }
  }

  /** Count the controller as gone until the next frame. */
  clear(): void {
    this.#shown.there = false;
  }

  override read(): SourceReading {
    const reading = super.read();
    return { ...reading, forward: reading.forward * this.cap, turn: reading.turn * this.cap };
  }
}

/** One mapping, that of the controller which drives. */
class ControllerMapping extends MappingStore {
  #layout: ControllerLayout | undefined;
  #mapping: GamepadMapping | undefined;

  take(layout: ControllerLayout | undefined): void {
    if (layout !== this.#layout) {
      this.#layout = layout;
      this.#mapping = layout && mappingOf(layout);
    }
  }

  override of(): GamepadMapping | undefined {
    return this.#mapping;
  }
}

/** Return what a layout's grip and stick do; undefined if it lacks one of them. */
function mappingOf({ squeeze, stick }: ControllerLayout): GamepadMapping | undefined {
  return squeeze === undefined || stick === undefined ? undefined : {
    forward: { axis: stick[1], sign: -1 }, turn: { axis: stick[0], sign: -1 }, deadman: squeeze,
    turbo: undefined, estop: undefined, takeOver: undefined, deadZone: STANDARD_MAPPING.deadZone,
  };
}
