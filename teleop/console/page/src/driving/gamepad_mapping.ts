/** What the axes and buttons of a gamepad do: the standard mapping, and mappings that a person made for others. */

import { GAMEPAD, type AxisUse } from "../operating_data";
import { withoutDeadZone } from "./drive_source";

export interface GamepadMapping {
  readonly forward: AxisUse;
  readonly turn: AxisUse;
  /** Indices of buttons; only the deadman is indispensable. */
  readonly deadman: number;
  readonly turbo: number | undefined;
  readonly estop: number | undefined;
  readonly takeOver: number | undefined;
  /** Deflection that counts as none, as a share of the whole. */
  readonly deadZone: number;
}

export const STANDARD_MAPPING: GamepadMapping = {
  forward: GAMEPAD.forward,
  turn: GAMEPAD.turn,
  deadman: GAMEPAD.buttons.deadman.button,
  turbo: GAMEPAD.buttons.turbo.button,
  estop: GAMEPAD.buttons.estop.button,
  takeOver: GAMEPAD.buttons.take_over.button,
  deadZone: GAMEPAD.dead_zone,
};

export const DEAD_ZONES = { least: 0.05, most: 0.5 } as const;

/** What a mapping makes of a gamepad at one moment. */
export interface GamepadReading {
  readonly forward: number;
  readonly turn: number;
  readonly deadman: boolean;
  readonly turbo: boolean;
  readonly estop: boolean;
  readonly takeOver: boolean;
}

export function readGamepad(pad: Gamepad, mapping: GamepadMapping): GamepadReading {
  const axis = ({ axis, sign }: AxisUse) => sign * withoutDeadZone(pad.axes[axis] ?? 0, mapping.deadZone) || 0;
  const button = (index: number | undefined) => index !== undefined && pad.buttons[index]?.pressed === true;
  return {
    forward: axis(mapping.forward),
    turn: axis(mapping.turn),
    deadman: button(mapping.deadman),
    turbo: button(mapping.turbo),
    estop: button(mapping.estop),
    takeOver: button(mapping.takeOver),
  };
}

/** The stored mappings, by the name that the browser gives to the kind of gamepad. */
export class MappingStore {
  /** @param storage Returns the browser's store; it may throw, where the browser forbids it: then nothing is remembered. */
  constructor(private readonly storage: () => Storage) {}

  /** The mapping for a gamepad: a person's own, else the standard one if it fits; undefined if it needs one. */
  of(pad: Pick<Gamepad, "id" | "mapping">): GamepadMapping | undefined {
    return this.load(pad.id) ?? (pad.mapping === "standard" ? STANDARD_MAPPING : undefined);
  }

  /** Remember a mapping; false if the browser keeps nothing, so that it holds until the page is closed. */
  save(id: string, mapping: GamepadMapping): boolean {
    this.held.set(id, mapping);
    try {
      this.storage().setItem(key(id), JSON.stringify(mapping));
      return true;
    } catch {
      return false;
    }
  }

  forget(id: string): void {
    this.held.set(id, undefined);
    try {
      this.storage().removeItem(key(id));
    } catch {
      // Nothing was kept.
    }
  }

  private load(id: string): GamepadMapping | undefined {
    if (!this.held.has(id)) {
      this.held.set(id, this.stored(id));
    }
    return this.held.get(id);
  }

  private stored(id: string): GamepadMapping | undefined {
    try {
      return mappingFrom(JSON.parse(this.storage().getItem(key(id)) ?? "null"));
    } catch {
      return undefined;
    }
  }

  private readonly held = new Map<string, GamepadMapping | undefined>();
}

/** Read a stored mapping; undefined if it is none. */
export function mappingFrom(value: unknown): GamepadMapping | undefined {
  const fields = record(value);
  const forward = axisUse(fields["forward"]);
  const turn = axisUse(fields["turn"]);
  const deadman = index(fields["deadman"]);
  const deadZone = fields["deadZone"];
  if (forward === undefined || turn === undefined || deadman === undefined || forward.axis === turn.axis) {
    return undefined;
  }
  return {
    forward,
    turn,
    deadman,
    turbo: index(fields["turbo"]),
    estop: index(fields["estop"]),
    takeOver: index(fields["takeOver"]),
    deadZone: typeof deadZone === "number" && deadZone >= DEAD_ZONES.least && deadZone <= DEAD_ZONES.most
      ? deadZone : STANDARD_MAPPING.deadZone,
  };
}

function key(id: string): string {
  return `farsteer.gamepad.${id}`;
}

function record(value: unknown): Readonly<Record<string, unknown>> {
  return typeof value === "object" && value !== null ? { ...value } : {};
}

function index(value: unknown): number | undefined {
  return typeof value === "number" && Number.isInteger(value) && value >= 0 && value < 256 ? value : undefined;
}

function axisUse(value: unknown): AxisUse | undefined {
  const { axis, sign } = record(value);
  const at = index(axis);
  return at !== undefined && (sign === 1 || sign === -1) ? { axis: at, sign } : undefined;
}
