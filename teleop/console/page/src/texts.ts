/** All words that the page shows, by part of the page; functions where values are filled in. */

export const texts = {
  title: "Farsteer console",
} as const;
