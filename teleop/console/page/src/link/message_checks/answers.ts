/** Answers of services. */

import type { LinkAnswer } from "../hops";
import type { Answer, HintPreview, PlanarPose, Session } from "../../values";
import type { Field } from "./field";

/** `std_srvs/Trigger`. */
export function readAnswer(values: Field): Answer {
  return { success: values.at("success").boolean(), message: values.at("message").text(1000) };
}

/** `farsteer_msgs/Session`. */
export function readSession(values: Field): Session {
  const may = (what: string): boolean => values.at(`may_${what}`).boolean();
  return {
    client: values.at("client").count(0xffffffff),
    name: values.at("name").text(),
    role: values.at("role").text(),
    tokens: values.at("tokens").boolean(),
    mayDrive: may("drive"),
    mayStop: may("stop"),
    mayReset: may("reset"),
    mayHint: may("hint"),
    maySearch: may("search"),
    mayTakeOver: may("take_over"),
    mayShare: may("share"),
    link: values.at("link").boolean(),
    mayPlay: may("play"),
  };
}

/** `farsteer_msgs/PreviewHint` for a pose; undefined if the robot gave no score. */
export function readPreview(values: Field, of: PlanarPose): HintPreview | undefined {
  if (!readAnswer(values).success) {
    return undefined;
  }
  const present = values.at("present").within(-1, 1);
  return { pose: of, explained: values.at("explained").within(0, 1), present: present < 0 ? undefined : present };
}

/** `farsteer_msgs/LinkStatistics`: what the robot left out for this connection, and what of the way it knows. */
export function readLinkAnswer(values: Field): LinkAnswer {
  const topics = values.at("topics").list(1000).map((topic) => topic.text());
  const [dropped, made, queued] = (["dropped", "made", "queued"] as const).map((name) => {
    const numbers = values.at(name).numbers64(1000);
    return numbers.length === topics.length ? numbers : values.at(name).fail("does not have a number for each topic");
  });
  return {
    now: values.at("now").number(),
    stamp: values.at("stamp").number(),
    taken: values.at("taken").number(),
    topics: new Map(topics.map((topic, i) => {
      return [topic, { dropped: dropped?.[i] ?? 0, made: made?.[i] ?? -1, queued: queued?.[i] ?? -1 }];
    })),
  };
}

/** Types by topic, of `rosapi/Topics`. */
export function readTopics(values: Field): ReadonlyMap<string, string> {
  const names = values.at("topics").list(10_000).map((name) => name.text());
  const types = values.at("types").list(10_000).map((type) => type.text());
  return new Map(names.map((name, i) => [name, types[i] ?? ""]));
}

/** A type's name as in ROS 1, in which `pkg/msg/Type` is `pkg/Type`. */
export function canonicalType(type: string): string {
  return type.replace("/msg/", "/");
}
