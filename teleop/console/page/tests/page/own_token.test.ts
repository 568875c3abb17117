import { signal } from "@preact/signals";
import { expect, it } from "vitest";
import type { Reply } from "../../src/link/service_calls";
import { takeOwnToken } from "../../src/page/own_token";
import type { Session } from "../../src/values";

const BY_LINK = { client: 4, link: true } as Session;

it("takes a token of its own once for each connection that a link opened", async () => {
  const session = signal<Session | undefined>(undefined);
  const asked: object[] = [];
  const taken: string[] = [];
  const replies: Reply[] = [{ ok: false, words: "the list is full", refused: true }, { ok: true, values: { token: "own" } }];
  const call = (service: string, request: object): Promise<Reply> => {
    asked.push([service, request]);
    return Promise.resolve(replies[asked.length - 1] ?? { ok: false, words: "", refused: true });
  };
  takeOwnToken({ call }, { session }, () => "Anna", (token) => { taken.push(token); });
  session.value = { ...BY_LINK, link: false };
  expect(asked).toEqual([]);
  session.value = BY_LINK;
  session.value = { ...BY_LINK, name: "Anna" };
  await Promise.resolve();
  expect(asked).toEqual([["/teleop/own_token", { device: "Anna" }]]);
  session.value = { ...BY_LINK, client: 5 };
  await new Promise((resolve) => { setTimeout(resolve); });
  expect(taken).toEqual(["own"]);
});
