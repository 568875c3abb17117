/** A board in the operator's room: lines of words and keys that are pressed by pointing at them. */

import { CanvasTexture, LinearFilter, Mesh, MeshBasicMaterial, PlaneGeometry, Quaternion, SRGBColorSpace, Vector3 } from "three";
import { css, type SceneColours } from "../scene/palette";

export interface Key {
  readonly label: string;
  readonly press: () => void;
  /** If it is to be held, by a controller's trigger: is called when that ends, or its hand is gone. */
  readonly release?: () => void;
  readonly on?: boolean;
  readonly bad?: boolean;
}

/** A line of words, or of keys side by side. */
export interface Row {
  readonly words?: string;
  readonly bad?: boolean;
  readonly keys?: readonly Key[];
}

/** Units across a board and of a line, in which it is drawn: letters of 1.5 degrees on a board at arm's length. */
const ACROSS = 1024;
const LINE = 74;
const EDGE = 18;

interface Place {
  readonly key: Key;
  readonly x: number;
  readonly y: number;
  readonly width: number;
}

export class Board {
  readonly object: Mesh<PlaneGeometry, MeshBasicMaterial>;
  readonly #canvas = document.createElement("canvas");
  #texture: CanvasTexture;
  #rows: readonly Row[] = [];
  #drawn = "";
  #places: Place[] = [];
  #height = 0;
  readonly #local = new Vector3();
  readonly #back = new Quaternion();
  /** How far along the last ray it was met [m]: a number that is returned would be an object each time. */
  met = Infinity;

  /** @param width Of the board [m]. @param across Pixels of its texture; what is drawn often has few. */
  constructor(readonly width: number, private readonly across = ACROSS) {
    this.#texture = new CanvasTexture(this.#canvas);
    // Seen through everything: one who rides along stands in walls at times.
    this.object = new Mesh(new PlaneGeometry(1, 1), new MeshBasicMaterial({ depthTest: false, depthWrite: false, transparent: true, toneMapped: false }));
    this.object.renderOrder = 20;
  }

  /** Words and keys that are on it now. */
  get rows(): readonly Row[] {
    return this.#rows;
  }

  /** Show rows; drawn again only if they look different. */
  show(rows: readonly Row[], colours: SceneColours): void {
    this.#rows = rows;
    const looks = JSON.stringify([rows, colours.background]);
    if (looks !== this.#drawn) {
      this.#drawn = looks;
      this.#draw(colours);
    } else {
      // The same picture, but what the keys do may be new.
      const keys = rows.flatMap((row) => row.keys ?? []);
      this.#places = this.#places.map((place, at) => ({ ...place, key: keys[at] ?? place.key }));
    }
  }

  /** Put it before a head, facing it. */
  face(head: Vector3, turn: Quaternion, distance: number, aside: number, down: number): void {
    const ahead = this.#local.set(0, 0, -1).applyQuaternion(turn).setY(0).normalize();
    this.object.position.set(
      head.x + distance * ahead.x - aside * ahead.z, head.y - down, head.z + distance * ahead.z + aside * ahead.x,
    );
    this.look(head);
  }

  /** Turn it to a head. */
  look(head: Vector3): void {
    const { x, y, z } = this.#local.copy(head).sub(this.object.position);
    this.object.rotation.set(-Math.atan2(y, Math.hypot(x, z)), Math.atan2(x, z), 0, "YXZ");
  }

  /** Return whether a ray of the room meets it, and note how far along. */
  meets(from: Vector3, direction: Vector3): boolean {
    const { position, quaternion, visible } = this.object;
    const normal = this.#local.set(0, 0, 1).applyQuaternion(quaternion);
    const distance = (normal.dot(position) - normal.dot(from)) / normal.dot(direction);
    if (!visible || !(distance > 0 && distance < 10)) {
      return false;
    }
    this.met = distance;
    this.#local.copy(direction).multiplyScalar(distance).add(from);
    this.#toBoard();
    return Math.abs(this.#local.x) <= 0.5 && Math.abs(this.#local.y) <= 0.5;
  }

  /** Return the key at a point of the room. */
  keyAt(point: Vector3): Key | undefined {
    this.#local.copy(point);
    this.#toBoard();
    const x = (this.#local.x + 0.5) * ACROSS;
    const y = (0.5 - this.#local.y) * this.#height;
    for (const place of this.#places) {
      if (x >= place.x && x <= place.x + place.width && y >= place.y && y <= place.y + LINE - 8) {
        return place.key;
      }
    }
    return undefined;
  }

  /** Return where a key is in the room, by its label. */
  placeOf(label: string): Vector3 | undefined {
    const place = this.#places.find(({ key }) => key.label === label);
    const { position, quaternion, scale } = this.object;
    return place && new Vector3((place.x + place.width / 2) / ACROSS - 0.5, 0.5 - (place.y + LINE / 2) / this.#height, 0)
      .multiply(scale).applyQuaternion(quaternion).add(position);
  }

  #toBoard(): void {
    const { position, quaternion, scale } = this.object;
    this.#local.sub(position).applyQuaternion(this.#back.copy(quaternion).conjugate()).divide(scale);
  }

  #draw(colours: SceneColours): void {
    const pen = this.#canvas.getContext("2d");
    if (pen === null) {
      return;
    }
    pen.font = font(false);
    const lines = this.#rows.flatMap((row): Row[] =>
      row.words === undefined ? [row] : wrapped(row.words, pen).map((words) => ({ ...row, words })));
    this.#resize(2 * EDGE + lines.length * LINE);
    pen.fillStyle = css(colours.background);
    pen.fillRect(0, 0, ACROSS, this.#height);
    pen.strokeStyle = css(colours.stale);
    pen.lineWidth = 6;
    pen.strokeRect(3, 3, ACROSS - 6, this.#height - 6);
    pen.textBaseline = "middle";
    this.#places = [];
    lines.forEach((row, at) => {
      const y = EDGE + at * LINE;
      if (row.words !== undefined) {
        pen.font = font(row.bad === true);
        pen.textAlign = "left";
        pen.fillStyle = css(row.bad === true ? colours.bad : colours.ink);
        pen.fillText(row.words, EDGE, y + LINE / 2);
      }
      this.#keys(pen, row.keys ?? [], y, colours);
    });
    this.#texture.needsUpdate = true;
  }

  #keys(pen: CanvasRenderingContext2D, keys: readonly Key[], y: number, colours: SceneColours): void {
    const width = (ACROSS - 2 * EDGE) / Math.max(keys.length, 1);
    keys.forEach((key, at) => {
      const place = { key, x: EDGE + at * width + 4, y: y + 4, width: width - 8 };
      this.#places.push(place);
      pen.fillStyle = css(key.bad === true ? colours.bad : key.on === true ? colours.robot : colours.floor);
      pen.beginPath();
      pen.roundRect(place.x, place.y, place.width, LINE - 12, 14);
      pen.fill();
      pen.font = font(key.bad === true);
      pen.textAlign = "center";
      pen.fillStyle = css(key.bad === true || key.on === true ? colours.background : colours.ink);
      pen.fillText(key.label, place.x + place.width / 2, y + LINE / 2, place.width - 12);
    });
  }

  /** A texture keeps its size for good, so another size is another texture. */
  #resize(height: number): void {
    if (height === this.#height) {
      return;
    }
    this.#height = height;
    const scale = this.across / ACROSS;
    [this.#canvas.width, this.#canvas.height] = [this.across, Math.round(height * scale)];
    this.#canvas.getContext("2d")?.scale(scale, scale);
    this.#texture.dispose();
    this.#texture = new CanvasTexture(this.#canvas);
    this.#texture.colorSpace = SRGBColorSpace;
    // About a pixel of the texture for one of the headset: smaller ones of it would only cost time.
    this.#texture.generateMipmaps = false;
    this.#texture.minFilter = LinearFilter;
    this.object.material.map = this.#texture;
    this.object.material.needsUpdate = true;
    this.object.scale.set(this.width, (this.width * height) / ACROSS, 1);
  }
}

function font(bold: boolean): string {
  return `${bold ? 700 : 500} 38px system-ui, sans-serif`;
}

/** Cut words into lines that fit. */
function wrapped(words: string, pen: CanvasRenderingContext2D): string[] {
  const lines: string[] = [];
  for (const word of words.split(" ")) {
    const longer = `${lines.at(-1) ?? ""} ${word}`.trim();
    if (lines.length > 0 && pen.measureText(longer).width <= ACROSS - 2 * EDGE) {
      lines[lines.length - 1] = longer;
    } else {
      lines.push(word);
    }
  }
  return lines;
}
