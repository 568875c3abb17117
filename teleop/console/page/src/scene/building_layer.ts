/** The building as surfaces: walls with their openings, the floor that was seen, furniture; the same on every machine. */

import { Box3, DoubleSide, Group, Mesh, MeshBasicMaterial, SRGBColorSpace, type Object3D, type Texture } from "three";
import type { Bounds } from "./geometry";
import type { SceneColours } from "./palette";

/** Height [m] above which nothing is cut. */
const NO_CUT = 1e6;

/**
 * Lowers what is higher than the cut to it, so that cut walls still have tops, and leaves out faces that begin above:
 * a lintel would close its doorway. All corners of such a face are put into one place. `_bottom` is where a vertex's face begins above the floor [m].
 */
const CUT = "vec3 transformed = _bottom >= uCut - uFloor ? vec3(0.0) : vec3(position.xy, min(position.z, uCut));";

export class BuildingLayer {
  readonly object = new Group();
  bounds: Bounds | undefined;
  /** Height of the floor [m], of most of it where it is not level. */
  floor = 0;
  readonly #cut = { value: NO_CUT };
  readonly #floor = { value: 0 };
  readonly #surfaces: MeshBasicMaterial;
  readonly #ground = new MeshBasicMaterial({ alphaTest: 0.5, polygonOffset: true, polygonOffsetFactor: 1, polygonOffsetUnits: 1 });

  constructor() {
    // Colours are in the file, shaded by the direction of each face: no light is needed, and software draws it quickly.
    this.#surfaces = new MeshBasicMaterial({ vertexColors: true, side: DoubleSide });
    this.#surfaces.onBeforeCompile = (shader) => {
      Object.assign(shader.uniforms, { uCut: this.#cut, uFloor: this.#floor });
      shader.vertexShader = `uniform float uCut;\nuniform float uFloor;\nattribute float _bottom;\n${
        shader.vertexShader.replace("#include <begin_vertex>", CUT)}`;
    };
  }

  get isKnown(): boolean {
    return this.bounds !== undefined;
  }

  /** Show another building, given in the map's frame, or none; what the last one held is freed. */
  set(building: Object3D | undefined): void {
    this.#free();
    if (building === undefined) {
      return;
    }
    for (const mesh of meshesOf(building)) {
      if (mesh.name === "floor") {
        this.#ground.map = (mesh.material as MeshBasicMaterial).map;
        this.#ground.needsUpdate = true;
        this.floor = middleHeight(mesh);
      }
      mesh.material = mesh.name === "floor" ? this.#ground : this.#surfaces;
      this.object.add(mesh);
    }
    this.object.updateMatrixWorld();
    const box = new Box3().setFromObject(this.object);
    this.bounds = box.isEmpty() ? undefined : { min: box.min.clone(), max: box.max.clone() };
  }

  setColours(colours: SceneColours): void {
    this.#surfaces.color.setRGB(...colours.surfaces, SRGBColorSpace);
    this.#ground.color.setRGB(...colours.ground, SRGBColorSpace);
  }

  /** Cut what is higher [m in the map], above a floor [m]; undefined cuts nothing. */
  setCut(cut: number | undefined, floor: number): void {
    this.#cut.value = cut ?? NO_CUT;
    this.#floor.value = cut === undefined ? 0 : floor;
  }

  /** Draw the floor, or leave it out. */
  setGround(shown: boolean): void {
    this.#ground.visible = shown;
  }

  dispose(): void {
    this.#free();
    this.#surfaces.dispose();
    this.#ground.dispose();
  }

  #free(): void {
    for (const mesh of meshesOf(this.object)) {
      mesh.geometry.dispose();
    }
    this.object.clear();
    const map: Texture | null = this.#ground.map;
    map?.dispose();
    this.#ground.map = null;
    this.bounds = undefined;
    this.floor = 0;
  }
}

function middleHeight({ geometry }: Mesh): number {
  const position = geometry.getAttribute("position");
  const heights = Array.from({ length: position.count }, (_, index) => position.getZ(index)).sort((a, b) => a - b);
  return heights[Math.floor(heights.length / 2)] ?? 0;
}

function meshesOf(object: Object3D): Mesh[] {
  const found: Mesh[] = [];
  object.traverse((part) => {
    if (part instanceof Mesh) {
      found.push(part as Mesh);
    }
  });
  return found;
}
