/** Reads a building's surfaces from a glTF file; loaded when there is one. */

import { TextureLoader, type Object3D } from "three";
import { GLTFLoader } from "three/addons/loaders/GLTFLoader.js";

/**
 * Return the surfaces in the map's frame.
 *
 * @throws if the file is damaged.
 */
export async function readBuilding(file: ArrayBuffer): Promise<Object3D> {
  const loader = new GLTFLoader();
  loader.register((parser) => {
    // Its usual loader fetches the floor's picture from the file, which the page's policy allows to images only.
    parser.textureLoader = new TextureLoader(parser.options.manager);
    return { name: "picture" };
  });
  const { scene } = await loader.parseAsync(file, "");
  // The file's node turns the map's z axis to glTF's y; the picture has the map's own axes.
  const map = scene.getObjectByName("map") ?? scene;
  map.removeFromParent();
  map.quaternion.identity();
  return map;
}
