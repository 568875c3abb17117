/**
 * What keeps people well in a headset: settings with their sources, and the dark rim while the room moves.
 *
 * Sources: the rim's strength of 0.4 to 0.6 and its fading at about 10 per second are those of Meta's IWSDK; turns by 30 to
 * 45 degrees are the steps of its snap turn; Oculus' guide advises walking pace (1.4 m/s) at most, short and rare
 * accelerations, and a view that nothing but the head turns.
 */

import type { Signal } from "@preact/signals";
import { Mesh, PlaneGeometry, ShaderMaterial } from "three";
import { approach } from "../scene/geometry";
import { browserKeeper, remembered, type Keeper } from "../scene/stored_signals";
import type { Carrying } from "./place";

export const CHOICES = {
  vignette: [0.5, 0.6, 0, 0.4],
  /** Degrees; 0 turns smoothly. */
  turning: [30, 45, 0],
  /** Metres per second; 0 is no cap. */
  cap: [0.75, 0.35, 0],
} as const;

/** Rate of a smooth turn [rad/s]; chosen, slower than heads turn. */
export const SMOOTH_TURN = Math.PI / 4;
/** Time of fading [ms]: ten per second. */
const FADE = 100;
/** Motion at which the rim is as strong as it is set [m/s, rad/s]; chosen: a slow walk, a slow turn. */
const FULL_FROM = { speed: 0.3, turn: 0.3 };

export interface ComfortSettings extends Carrying {
  readonly vignette: number;
  readonly turning: number;
  readonly cap: number;
}

const FIRST: ComfortSettings = { vignette: 0.5, turning: 30, cap: 0.75, turns: false, tilts: false };

/** Return the settings as this browser kept them. */
export function comfortSettings(keeper: Keeper | undefined = browserKeeper()): Signal<ComfortSettings> {
  return remembered("farsteer.comfort", FIRST, (kept) => {
    const fields = { ...FIRST, ...(typeof kept === "object" ? kept : {}) };
    const known = Object.entries(CHOICES).every(([name, choices]) => (choices as readonly number[]).includes(fields[name as keyof typeof CHOICES]));
    return known && typeof fields.turns === "boolean" && typeof fields.tilts === "boolean" ? fields : undefined;
  }, keeper);
}

/** Return the choice after the present one. */
export function nextChoice(choices: readonly number[], present: number): number {
  return choices[(choices.indexOf(present) + 1) % choices.length] ?? present;
}

/** Angles from the optical axis decide, so that the rim is round in both eyes, whose pictures are cut unevenly. */
const VERTEX = `
varying vec2 vTangent;
void main() {
  vTangent = vec2((position.x + projectionMatrix[2][0]) / projectionMatrix[0][0], (position.y + projectionMatrix[2][1]) / projectionMatrix[1][1]);
  gl_Position = vec4(position.xy, 0.0, 1.0);
}`;
const FRAGMENT = `
uniform float uCovered; // share of the view, from its edge inwards
varying vec2 vTangent;
void main() {
  float open = 1.3 * (1.0 - uCovered);
  gl_FragColor = vec4(0.0, 0.0, 0.0, smoothstep(open, open + 0.25, length(vTangent)));
}`;

/** A dark rim that leaves the middle of the view clear. */
export class Vignette {
  readonly object: Mesh<PlaneGeometry, ShaderMaterial>;
  readonly #covered = { value: 0 };

  constructor() {
    this.object = new Mesh(new PlaneGeometry(2, 2), new ShaderMaterial({
      vertexShader: VERTEX, fragmentShader: FRAGMENT, uniforms: { uCovered: this.#covered },
      transparent: true, depthTest: false, depthWrite: false,
    }));
    this.object.frustumCulled = this.object.visible = false;
    this.object.renderOrder = 15;
  }

  /** Share of the view that is covered now. */
  get covered(): number {
    return this.#covered.value;
  }

  /** Fade to what a motion asks for. */
  update(elapsed: number, strength: number, speed: number, turnRate: number): void {
    const motion = Math.min(1, Math.max(speed / FULL_FROM.speed, turnRate / FULL_FROM.turn));
    this.#covered.value += (strength * motion - this.#covered.value) * approach(elapsed, FADE);
    this.object.visible = this.#covered.value > 0.01;
  }
}
