import { beforeAll } from "vitest";

/** Leaves nothing of one file's tests to the next, which has the same document and storage. */
beforeAll(() => {
  localStorage.clear();
  sessionStorage.clear();
  document.body.replaceChildren();
});
