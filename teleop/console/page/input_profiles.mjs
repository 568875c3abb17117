// Which button and axes of a headset's controller are what, by the names of its profiles: the part that the page needs of
// W3C's registry of WebXR input profiles, taken from it while the page is bundled. Plugins for esbuild and for Vite.
import { readFileSync } from "node:fs";
import { dirname, join } from "node:path";
import { fileURLToPath } from "node:url";

/** What the page imports. */
const NAME = "farsteer:input-profiles";
const LIST = fileURLToPath(import.meta.resolve("@webxr-input-profiles/registry"));
/** The registry's names of the two face buttons below the thumb, from near to far, on both hands. */
const FACE = { lower: ["a-button", "x-button"], upper: ["b-button", "y-button"] };

/** Return for each profile and hand what lies where: `{"htc-vive": {"left": {"trigger": 0, "squeeze": 1, "stick": [0, 1]}, ...}}`. */
export function inputProfiles() {
  const profiles = Object.entries(JSON.parse(readFileSync(LIST, "utf8")));
  return Object.fromEntries(profiles.map(([name, { path }]) => {
    const { layouts } = JSON.parse(readFileSync(join(dirname(LIST), "profiles", path), "utf8"));
    const hands = Object.entries(layouts).flatMap(([key, layout]) => key.split("-").map((hand) => [hand, placesOf(layout)]));
    return [name, Object.fromEntries(hands)];
  }));
}

function placesOf({ components, gamepad = { buttons: [], axes: [] } }) {
  const ofType = (type) => Object.keys(components).find((id) => components[id].type === type);
  const button = (...ids) => {
    const at = gamepad.buttons.findIndex((id) => id !== null && ids.includes(id));
    return at < 0 ? undefined : at;
  };
  const stick = ["thumbstick", "touchpad"].map((type) => ["x-axis", "y-axis"].map((axis) =>
    gamepad.axes.findIndex((place) => place?.axis === axis && components[place.componentId].type === type))).find((axes) => !axes.includes(-1));
  return {
    trigger: button(ofType("trigger")), squeeze: button(ofType("squeeze")), stick, lower: button(...FACE.lower), upper: button(...FACE.upper),
  };
}

/** For esbuild; what is bundled counts as the registry's list, so that its licence is among those of the page. */
export const forEsbuild = {
  name: NAME,
  setup(build) {
    build.onResolve({ filter: new RegExp(`^${NAME}$`) }, () => ({ path: LIST }));
    build.onLoad({ filter: /webxr-input-profiles[\\/]registry[\\/]dist[\\/]profilesList\.json$/ }, () => ({
      contents: JSON.stringify(inputProfiles()), loader: "json",
    }));
  },
};

/** For Vite, by which the page's tests run. */
export const forVite = {
  name: NAME,
  resolveId: (id) => (id === NAME ? `\0${NAME}` : undefined),
  load: (id) => (id === `\0${NAME}` ? `export default ${JSON.stringify(inputProfiles())}` : undefined),
};
