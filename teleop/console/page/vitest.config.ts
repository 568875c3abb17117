import { defineConfig } from "vitest/config";

import { forVite } from "./input_profiles.mjs";

export default defineConfig({
  plugins: [forVite],
  oxc: { jsx: { runtime: "automatic", importSource: "preact" } },
  test: {
    include: ["tests/**/*.test.{js,ts,tsx}"],
    environment: "happy-dom",
    setupFiles: ["tests/new_document.ts"],
    // One document for all files instead of one each, whose making took most of the time.
    isolate: false,
    fileParallelism: false,
    pool: "threads",
  },
});
