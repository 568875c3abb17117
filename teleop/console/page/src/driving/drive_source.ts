/** What the inputs of the driver have in common: keyboard, on-screen stick, gamepad, headset and a deadman alone. */

export type SourceName = "keyboard" | "stick" | "gamepad" | "headset" | "hold";

/** What an input asks for at one moment. */
export interface SourceReading {
  /** Whether the person holds it, counted or not. */
  readonly held: boolean;
  /** Whether it counts: held, and pressed anew since everything last counted as released. It is the deadman. */
  readonly active: boolean;
  /** Deflection forward, -1 to 1. */
  readonly forward: number;
  /** Deflection to the left, -1 to 1. */
  readonly turn: number;
  /** Whether the input's own turbo button is held. */
  readonly turbo: boolean;
  /** Whether its stick was pushed before its deadman, and has to be let go first. */
  readonly centring: boolean;
  /** Whether its stick is pushed without its deadman. */
  readonly noDeadman: boolean;
}

export interface DriveSource {
  readonly name: SourceName;
  /** Look at what reports nothing by itself, before it is read. */
  poll?(now: number): void;
  read(): SourceReading;
  /** Count everything as released until the person lets go of it and presses it again. */
  release(): void;
}

export const RESTING: SourceReading = {
  held: false, active: false, forward: 0, turn: 0, turbo: false, centring: false, noDeadman: false,
};

/** Remove the dead zone of an axis and rescale the rest to begin at zero; what is not a number is 0. */
export function withoutDeadZone(value: number, zone: number): number {
  if (!Number.isFinite(value)) {
    return 0;
  }
  const size = Math.min(1, Math.abs(value));
  return size <= zone ? 0 : (Math.sign(value) * (size - zone)) / (1 - zone);
}
