/** Words with figures: what stands in braces is a fact, and what stands in brackets is left out without its facts. */

import { AGES } from "../operating_data";

/** What is known at one moment; times in seconds, angles in degrees. */
export type Facts = Readonly<Record<string, boolean | number | string | undefined>>;

/** Whether a fact is known; an empty text is not. */
export function known(value: Facts[string]): boolean {
  return value !== undefined && value !== "";
}

/**
 * Return words with their facts: `{name}` as it is, `{name:1}` with one decimal, `{name:age}` as an age,
 * `{name:sentence}` as a sentence.
 */
export function filled(words: string, facts: Facts): string {
  const fact = /\{(\w+)(?::(\w+))?\}/g;
  return words
    .replace(/\[([^\]]*)\]/g, (_, part: string) =>
      [...part.matchAll(fact)].every(([, name = ""]) => known(facts[name])) ? part : "")
    .replace(fact, (_, name: string, form: string | undefined) => shown(facts[name], form));
}

function shown(value: Facts[string], form: string | undefined): string {
  if (value === undefined) {
    return "unknown";
  }
  if (form === "age") {
    return ageWords(Number(value));
  }
  if (form === "sentence") {
    return sentence(String(value));
  }
  return form === undefined ? String(value) : Number(value).toFixed(Number(form));
}

/** Return a time [s] as a person says it: `0.6 s`, `12 s`, `3 min`, `2 h`. */
export function ageWords(age: number): string {
  const { seconds, decimals, unit } = AGES.find(({ below }) => age < below) ?? { seconds: 1, decimals: 0, unit: "s" };
  return `${(age / seconds).toFixed(decimals)} ${unit}`;
}

/** Return words as a sentence of their own. */
export function sentence(words: string): string {
  return words === "" ? "" : `${words.charAt(0).toUpperCase()}${words.slice(1)}${/[.!?]$/.test(words) ? "" : "."}`;
}
