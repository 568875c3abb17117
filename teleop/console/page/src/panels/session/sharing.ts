/** Who is at the robot, links for others, and the tokens of devices: asked of the robot when a person looks. */

import { signal } from "@preact/signals";
import { readAnswer } from "../../link/message_checks/answers";
import { check, type Field } from "../../link/message_checks/field";
import type { RobotWire } from "../../link/robot_wire";
import { sharingTexts as texts } from "../../texts/session";

export interface Person {
  readonly number: number;
  readonly name: string;
  readonly role: string;
}

export interface DeviceToken {
  readonly name: string;
  readonly role: string;
  /** Time left [s]; negative if it does not end. */
  readonly seconds: number;
  readonly link: boolean;
}

export interface SharedLink {
  readonly name: string;
  readonly link: string;
  /** Address of the picture of its QR code. */
  readonly picture: string;
}

const MANY = 1000;

export class Sharing {
  readonly people = signal<readonly Person[]>([]);
  readonly tokens = signal<readonly DeviceToken[]>([]);
  readonly shared = signal<SharedLink | undefined>(undefined);
  /** What came of the last request, in words. */
  readonly outcome = signal("");

  constructor(private readonly wire: Pick<RobotWire, "call">) {}

  /** Ask anew who is there and, if this page may, which tokens there are. */
  async look(mayShare: boolean): Promise<void> {
    this.people.value = (await this.ask("/teleop/clients", {}, readPeople)) ?? [];
    this.tokens.value = mayShare ? (await this.ask("/teleop/tokens", {}, readTokens)) ?? [] : [];
  }

  /** Make a link, to watch or to drive, that ends after a time [s]. */
  async share(role: "view" | "operate", seconds: number): Promise<void> {
    const made = await this.ask("/teleop/share", { role, seconds, name: "" }, readShared);
    this.shared.value = made?.link === "" ? undefined : made;
    await this.look(true);
  }

  /** End a token for good. */
  async revoke(name: string): Promise<void> {
    await this.ask("/teleop/revoke_token", { name }, (values) => { this.said(values); });
    if (this.shared.peek()?.name === name) {
      this.shared.value = undefined;
    }
    await this.look(true);
  }

  private async ask<T>(service: string, request: object, read: (values: Field) => T): Promise<T | undefined> {
    const reply = await this.wire.call(service, request);
    if (!reply.ok) {
      this.outcome.value = texts.refused(reply.words);
      return undefined;
    }
    const answer = check((values) => {
      if (service === "/teleop/share") {
        this.said(values);
      }
      return read(values);
    }, reply.values);
    return answer.ok ? answer.value : undefined;
  }

  private said(values: Field): void {
    const { success, message } = readAnswer(values);
    this.outcome.value = success ? message : texts.refused(message);
  }
}

function readPeople(values: Field): readonly Person[] {
  const numbers = values.at("numbers").list(MANY).map((number) => number.count(0xffffffff));
  const [names, roles] = (["names", "roles"] as const).map((field) => values.at(field).list(MANY).map((one) => one.text()));
  return numbers.map((number, i) => ({ number, name: names?.[i] ?? "", role: roles?.[i] ?? "" }));
}

function readTokens(values: Field): readonly DeviceToken[] {
  const [names, roles] = (["names", "roles"] as const).map((field) => values.at(field).list(MANY).map((one) => one.text()));
  const seconds = values.at("seconds").numbers64(MANY);
  const links = values.at("links").list(MANY).map((link) => link.boolean());
  return (names ?? []).map((name, i) => ({ name, role: roles?.[i] ?? "", seconds: seconds[i] ?? -1, link: links[i] ?? false }));
}

function readShared(values: Field): SharedLink {
  const picture = values.at("qr").text(100_000, false);
  return {
    name: values.at("name").text(),
    link: values.at("link").text(2000, false),
    picture: picture.startsWith("data:image/svg+xml") ? picture : "",
  };
}
