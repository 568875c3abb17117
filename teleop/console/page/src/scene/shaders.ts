/** The shaders of points. Colours are those of the screen (sRGB), so nothing is converted. */

/** Puts a vertex outside of the picture. */
const NOWHERE = "gl_Position = vec4(2.0, 2.0, 2.0, 1.0); gl_PointSize = 0.0; return;";

/** Size of a point in pixels, from its size in metres and its distance. */
const POINT_PIXELS = `
uniform float uPixelsPerMetre; // of what is 1 m away
uniform vec2 uPixels; // least and most
float pixels(float metres, float depth) {
  return clamp(metres * uPixelsPerMetre / max(depth, 0.01), uPixels.x, uPixels.y);
}`;

export const MAP_VERTEX = `
${POINT_PIXELS}
uniform float uSize;
uniform float uFloor;
uniform float uCut;
uniform float uCount; // points that are drawn
uniform float uThin; // distance from which on they are thinned [m]
uniform vec2 uFade; // distance from the focus at which points begin to fade, and to be faint
uniform vec3 uFocus;
uniform vec3 uFloorColour;
uniform vec3 uLow;
uniform vec3 uHigh;
uniform vec3 uBackground;
attribute vec4 aLook; // how much it faces up, and its shade by where it faces
varying vec3 vColour;
void main() {
  if (position.z > uCut) { ${NOWHERE} }
  vec4 view = modelViewMatrix * vec4(position, 1.0);
  // Any first part of the points shows all of the map: as many as before are left for each degree of view.
  float kept = min(uThin * uThin / dot(view.xyz, view.xyz), 1.0);
  if (float(gl_VertexID) > uCount * kept) { ${NOWHERE} }
  float above = position.z - uFloor;
  float share = clamp(above / 1.9, 0.0, 1.0);
  vec3 colour = mix(uLow, uHigh, share) ;
  colour = mix(uBackground, colour, 0.62 + 0.38 * aLook.y);
  float lying = max(1.0 - smoothstep(0.04, 0.10, abs(above)), smoothstep(0.75, 0.95, aLook.x) * (1.0 - 0.7 * share));
  colour = mix(colour, uFloorColour, lying);
  // Ceilings, which only first person shows, step back.
  colour = mix(colour, uBackground, 0.45 * smoothstep(2.0, 2.5, above));
  float faded = 0.8 * smoothstep(uFade.x, uFade.y, distance(position.xy, uFocus.xy));
  vColour = mix(colour, uBackground, faded);
  gl_Position = projectionMatrix * view;
  gl_PointSize = pixels(uSize * inversesqrt(kept), -view.z);
}`;

export const MAP_FRAGMENT = `
varying vec3 vColour;
void main() { gl_FragColor = vec4(vColour, 1.0); }`;

export const CLOUD_VERTEX = `
${POINT_PIXELS}
uniform float uSize;
uniform float uCut;
uniform float uFull; // distance at which the scale ends [m]
uniform vec3 uScale[3];
uniform vec3 uUnknown;
uniform vec3 uTint;
uniform float uTinted; // share of the tint
uniform float uNow; // [s]
uniform float uDecay; // [s]; negative: points do not age
uniform vec3 uBackground;
attribute float aDistance; // negative: unknown
attribute float aBirth; // [s]
varying vec3 vColour;
varying float vHalo;
void main() {
  float age = uDecay < 0.0 ? 0.0 : (uNow - aBirth) / max(uDecay, 0.001);
  vec4 world = modelMatrix * vec4(position, 1.0);
  if (age > 1.0 || age < -0.5 || world.z > uCut) { ${NOWHERE} }
  float share = clamp(aDistance / uFull, 0.0, 1.0);
  vec3 known = share < 0.5 ? mix(uScale[0], uScale[1], 2.0 * share) : mix(uScale[1], uScale[2], 2.0 * share - 1.0);
  vec3 colour = aDistance < 0.0 ? uUnknown : known;
  colour = mix(colour, uTint, uTinted);
  vColour = uDecay < 0.0 ? colour : mix(colour, uBackground, 0.35 + 0.5 * age);
  vec4 view = viewMatrix * world;
  gl_Position = projectionMatrix * view;
  // Drawn a little nearer than it is: the points lie in the map's surfaces and are to be seen before them.
  vec4 nearer = projectionMatrix * (view + vec4(0.0, 0.0, min(0.12, -0.5 * view.z), 0.0));
  gl_Position.z = nearer.z / nearer.w * gl_Position.w;
  gl_PointSize = pixels(uSize * (uDecay < 0.0 ? 1.0 : 0.8), -view.z);
  vHalo = uDecay < 0.0 && gl_PointSize > 4.5 ? 0.74 : 2.0;
}`;

export const CLOUD_FRAGMENT = `
uniform vec3 uHalo;
varying vec3 vColour;
varying float vHalo;
void main() {
  float radius = 2.0 * length(gl_PointCoord - 0.5);
  if (radius > 1.0) discard;
  gl_FragColor = vec4(radius > vHalo ? uHalo : vColour, 1.0);
}`;
