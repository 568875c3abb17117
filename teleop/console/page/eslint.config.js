import js from "@eslint/js";
import tseslint from "typescript-eslint";

import { folders } from "./lint/folders.js";

/** From the top floor down; folders on the same floor do not import each other. A folder that is missing is an error. */
const FLOORS = {
  "": [
    "page",
    "panels | wall | xr",
    "alarms | arm | camera | guide | hint | prediction | replay | runs | steps",
    "driving | link | scene | session",
    "robot | texts",
  ],
  "arm": ["picture", "goals | inputs"],
  "link": ["message_checks"],
  "panels": [
    "arm | playground | steps",
    "alarms | attitude | camera | driving | events | guide | hint | layers | link | replay | runs | session",
  ],
};

export default tseslint.config(
  { ignores: ["dist", "node_modules", "*.mjs", "*.config.*", "lint", "tests/lint"] },
  js.configs.recommended,
  ...tseslint.configs.strictTypeChecked,
  { languageOptions: { parserOptions: { projectService: true, tsconfigRootDir: import.meta.dirname } } },
  {
    plugins: { farsteer: { rules: { folders } } },
    rules: {
      "farsteer/folders": ["error", { root: "src", floors: FLOORS }],
      "@typescript-eslint/no-unused-vars": ["error", { varsIgnorePattern: "^_", argsIgnorePattern: "^_", ignoreRestSiblings: true }],
      "max-lines": ["error", 300],
      "no-restricted-properties": [
        "error",
        { property: "innerHTML", message: "Text from the wire is text: use textContent." },
        { property: "outerHTML", message: "Text from the wire is text: use textContent." },
        { property: "dangerouslySetInnerHTML", message: "Text from the wire is text." },
      ],
      "@typescript-eslint/restrict-template-expressions": ["error", { allowNumber: true }],
    },
  },
);
