/** The photograph that was taken last, and the way to see it. */

import { signal, type ReadonlySignal } from "@preact/signals";
import type { CameraCommands, PhotoAnswer } from "../robot/robot_actions";
import { cameraTexts as texts } from "../texts/camera";

/** A window that was opened for a photograph. */
type PhotoWindow = Pick<Window, "close"> & { readonly location: Pick<Location, "replace"> };

export class PhotoControl {
  /** Whether the robot is taking one. */
  readonly busy: ReadonlySignal<boolean>;
  readonly answer: ReadonlySignal<PhotoAnswer | undefined>;
  /** Why the photograph cannot be opened; empty if nothing is wrong. */
  readonly trouble: ReadonlySignal<string>;
  readonly #busy = signal(false);
  readonly #answer = signal<PhotoAnswer | undefined>(undefined);
  readonly #trouble = signal("");

  /** @param http Address of the robot over HTTP. */
  constructor(private readonly commands: CameraCommands, private readonly http: string) {
    [this.busy, this.answer, this.trouble] = [this.#busy, this.#answer, this.#trouble];
  }

  async take(): Promise<void> {
    if (this.#busy.peek()) {
      return;
    }
    this.#busy.value = true;
    this.#trouble.value = "";
    this.#answer.value = await this.commands.takePhoto();
    this.#busy.value = false;
  }

  /** Address of a photograph. */
  address(name: string): string {
    return `${this.http}/photos/${encodeURIComponent(name)}`;
  }

  /**
   * Open a photograph of a robot that asks for tokens: by a ticket, since a link carries no token.
   *
   * @param open Opens an empty window; at once, for browsers allow it only while a person presses.
   */
  async open(name: string, open: () => PhotoWindow | null): Promise<void> {
    const window = open();
    const ticket = await this.commands.videoTicket();
    this.#trouble.value = ticket.success ? "" : texts.noTicket(ticket.message);
    if (ticket.success) {
      window?.location.replace(`${this.address(name)}?ticket=${encodeURIComponent(ticket.message)}`);
    } else {
      window?.close();
    }
  }
}
