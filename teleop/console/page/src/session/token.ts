/** The token by which the page logs in: it comes in the address's fragment, leaves it at once, and lives in this tab. */

const KEY = "farsteer.token";

/** What of the browser a token touches. */
export interface TokenPlaces {
  readonly location: Pick<Location, "hash" | "pathname" | "search">;
  readonly history: Pick<History, "replaceState">;
  readonly storage: () => Storage;
}

/** Return the tab's token: that of the address, which is removed from there, or the one kept before. */
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
  try {
    return places.storage().getItem(KEY) ?? "";
  } catch {
    return ""; // a browser that keeps nothing: the person logs in again
  }
}

/** Keep a token for this tab; an empty one is forgotten. */
export function keepToken({ storage }: Pick<TokenPlaces, "storage">, token: string): void {
  try {
    if (token === "") {
      storage().removeItem(KEY);
    } else {
      storage().setItem(KEY, token);
    }
  } catch {
    // A browser that keeps nothing: the token holds until the page is left.
  }
}
