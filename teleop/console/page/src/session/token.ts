/**
 * The token by which the page logs in: it comes in the address's fragment and leaves it at once.
 *
 * One that a person typed, or that of a link, lives in this tab; that of the device, which can be revoked alone, lasts.
 */

const KEY = "farsteer.token";

/** What of the browser a token touches. */
export interface TokenPlaces {
  readonly location: Pick<Location, "hash" | "pathname" | "search">;
  readonly history: Pick<History, "replaceState">;
  readonly storage: () => Storage;
  readonly lasting: () => Storage;
}

/** Return the page's token: that of the address, which is removed from there, or the one kept before. */
export function takeToken(places: TokenPlaces): string {
  const { location, history } = places;
  const given = new URLSearchParams(location.hash.replace(/^#/, "")).get("token");
  if (location.hash.includes("token=")) {
    history.replaceState(null, "", location.pathname + location.search);
  }
  if (given !== null && given !== "") {
    keepToken(places, given);
    return given;
  }
  return kept(places.storage) || kept(places.lasting);
}

function kept(storage: () => Storage): string {
  try {
    return storage().getItem(KEY) ?? "";
  } catch {
    return ""; // a browser that keeps nothing: the person logs in again
  }
}

type Kept = Pick<TokenPlaces, "storage" | "lasting">;

/** Keep a token in the place of any other, for this tab or until it ends; an empty one is forgotten. */
export function keepToken({ storage, lasting }: Kept, token: string, where: keyof Kept = "storage"): void {
  for (const [name, place] of [["storage", storage], ["lasting", lasting]] as const) {
    try {
      if (name === where && token !== "") {
        place().setItem(KEY, token);
      } else if (where === "lasting" || token === "") {
        place().removeItem(KEY);
      }
    } catch {
      // A browser that keeps nothing: the token holds until the page is left.
    }
  }
}
