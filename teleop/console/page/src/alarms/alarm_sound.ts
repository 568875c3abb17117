/** The alarms' tones, made by the browser: no file is fetched. */

import type { Severity } from "../values";

/** One tone: frequency [Hz], begin and length [s]. */
export interface Tone {
  readonly frequency: number;
  readonly begin: number;
  readonly length: number;
}

/** Alarms rise three times in a hurry, warnings fall once, notes are one soft tone: told apart without looking. */
export const TONES: Readonly<Record<Severity, readonly Tone[]>> = {
  alarm: [
    { frequency: 740, begin: 0, length: 0.1 },
    { frequency: 988, begin: 0.12, length: 0.1 },
    { frequency: 740, begin: 0.28, length: 0.1 },
    { frequency: 988, begin: 0.4, length: 0.1 },
    { frequency: 740, begin: 0.56, length: 0.1 },
    { frequency: 988, begin: 0.68, length: 0.16 },
  ],
  warning: [
    { frequency: 660, begin: 0, length: 0.16 },
    { frequency: 495, begin: 0.2, length: 0.24 },
  ],
  info: [{ frequency: 523, begin: 0, length: 0.2 }],
};

/** Lengths of vibration and pauses [ms], as `navigator.vibrate` takes them. */
export const VIBRATIONS: Readonly<Record<Severity, readonly number[]>> = {
  alarm: [150, 80, 150, 80, 300],
  warning: [120],
  info: [],
};

/** `locked` until the first gesture on the page: browsers keep pages silent until then. */
export type SoundState = "unavailable" | "locked" | "ready";

export class AlarmSound {
  private context: AudioContext | undefined;

  /** @param makeContext Makes the browser's audio context; undefined where there is none. */
  constructor(private readonly makeContext: (() => AudioContext) | undefined) {}

  get state(): SoundState {
    if (this.makeContext === undefined) {
      return "unavailable";
    }
    return this.context?.state === "running" ? "ready" : "locked";
  }

  /** Allow sound; to be called from a gesture. */
  async unlock(): Promise<SoundState> {
    try {
      this.context ??= this.makeContext?.();
      await this.context?.resume();
    } catch {
      // The browser refuses sound for now; the next gesture tries again.
    }
    return this.state;
  }

  /** Sound a severity; false if there is no sound now. */
  play(severity: Severity): boolean {
    const context = this.context;
    if (context?.state !== "running") {
      return false;
    }
    for (const { frequency, begin, length } of TONES[severity]) {
      const at = context.currentTime + begin;
      const oscillator = context.createOscillator();
      const gain = context.createGain();
      oscillator.type = severity === "alarm" ? "square" : "sine";
      oscillator.frequency.value = frequency;
      gain.gain.setValueAtTime(0, at);
      gain.gain.linearRampToValueAtTime(severity === "info" ? 0.08 : 0.16, at + 0.01);
      gain.gain.linearRampToValueAtTime(0, at + length);
      oscillator.connect(gain).connect(context.destination);
      oscillator.start(at);
      oscillator.stop(at + length);
    }
    return true;
  }

  async close(): Promise<void> {
    await this.context?.close();
    this.context = undefined;
  }
}
