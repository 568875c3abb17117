/** Driving by a headset's controller: its grip is the deadman, its stick drives. A gamepad like others to the page. */

import type { SourceName, SourceReading } from "../driving/drive_source";
import { type GamepadMapping, MappingStore, STANDARD_MAPPING } from "../driving/gamepad_mapping";
import { GamepadSource } from "../driving/gamepad_source";
import { BUTTONS, stickAxis, type Side } from "./inputs";

/**
 * Without a frame for so long everything counts as released [ms]: a headset that sleeps sends none and says nothing. Half of
 * the robot's watchdog (500 ms), and 18 frames of the slowest headset.
 */
export const FRAMES_MISSING = 250;

/** A controller as the browser lists gamepads. */
type Pad = Pick<Gamepad, "id" | "index" | "connected" | "mapping" | "timestamp" | "axes" | "buttons">;

export class HeadsetSource extends GamepadSource {
  override readonly name: SourceName = "headset";
  /** Share of the gear's speed that the stick asks for at most. */
  cap = 1;
  readonly #shown: { pad: Pad | undefined; at: number };

  /**
   * @param now The page's clock [ms].
   * @param lost Is called when the controller that drives is there no more.
   */
  constructor(private readonly now: () => number, lost: () => void) {
    const shown: { pad: Pad | undefined; at: number } = { pad: undefined, at: -Infinity };
    const list = (): Pad[] => (shown.pad !== undefined && now() - shown.at < FRAMES_MISSING ? [shown.pad] : []);
    super({ getGamepads: list } as unknown as Navigator, new ControllerMapping(() => localStorage), {
      lost, estop: () => undefined, takeOver: () => undefined,
    });
    this.#shown = shown;
  }

  /** Take over what the driving hand does in a frame. */
  frame(side: Side): void {
    this.#shown.at = this.now();
    const { pad } = side;
    this.#shown.pad = pad && {
      id: `headset ${side.hand}`, index: 0, connected: true, mapping: pad.mapping, timestamp: this.#shown.at,
      axes: pad.axes, buttons: pad.buttons,
    };
  }

  /** Count the controller as gone until the next frame. */
  clear(): void {
    this.#shown.pad = undefined;
  }

  override read(): SourceReading {
    const reading = super.read();
    return { ...reading, forward: reading.forward * this.cap, turn: reading.turn * this.cap };
  }
}

class ControllerMapping extends MappingStore {
  override of(pad: Pick<Gamepad, "id" | "mapping"> & Partial<Pick<Gamepad, "axes">>): GamepadMapping {
    const first = stickAxis(pad.axes ?? [0, 0, 0, 0]);
    return {
      forward: { axis: first + 1, sign: -1 }, turn: { axis: first, sign: -1 }, deadman: BUTTONS.squeeze,
      turbo: undefined, estop: undefined, takeOver: undefined, deadZone: STANDARD_MAPPING.deadZone,
    };
  }
}
