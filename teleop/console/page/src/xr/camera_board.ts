/** The camera's picture in the operator's room, above a board with its name and age, by which it is moved. */

import { Mesh, MeshBasicMaterial, PlaneGeometry, SRGBColorSpace, Texture, Vector3 } from "three";
import type { CameraFeed } from "../camera/camera_feed";
import { Board } from "./board";

const WIDTH = 0.8;

export class CameraBoard {
  readonly caption = new Board(WIDTH);
  readonly object = new Mesh(
    new PlaneGeometry(1, 1), new MeshBasicMaterial({ depthTest: false, depthWrite: false, transparent: true, toneMapped: false }),
  );
  #texture: Texture | undefined;
  #shown = "";
  readonly #above = new Vector3();

  constructor() {
    this.object.renderOrder = 19;
    this.object.visible = this.caption.object.visible = false;
  }

  /** Show the newest picture of a feed, or nothing. */
  async show(feed: CameraFeed): Promise<void> {
    const url = feed.picture.peek()?.url ?? "";
    if (url === this.#shown) {
      return;
    }
    this.#shown = url;
    this.object.visible = this.caption.object.visible = url !== "";
    if (url !== "") {
      const image = new Image();
      image.src = url;
      const loaded = await image.decode().then(() => true, () => false); // a newer one has taken its address
      if (loaded && this.#shown === url) {
        this.#take(image);
      }
    }
  }

  /** Hang above the caption. */
  update(): void {
    const { position, quaternion, scale } = this.caption.object;
    this.object.quaternion.copy(quaternion);
    this.object.position.copy(this.#above.set(0, (scale.y + this.object.scale.y) / 2, 0).applyQuaternion(quaternion).add(position));
  }

  #take(image: HTMLImageElement): void {
    const before = this.#texture?.image as HTMLImageElement | undefined;
    if (this.#texture === undefined || before?.width !== image.width || before.height !== image.height) {
      this.#texture?.dispose();
      this.#texture = new Texture();
      this.#texture.colorSpace = SRGBColorSpace;
      this.object.material.map = this.#texture;
      this.object.material.needsUpdate = true;
      this.object.scale.set(WIDTH, (WIDTH * image.height) / Math.max(image.width, 1), 1);
    }
    this.#texture.image = image;
    this.#texture.needsUpdate = true;
  }
}
