import js from "@eslint/js";

const BROWSER = [
  "ArrayBuffer", "HTMLElement", "Node", "ResizeObserver", "URLSearchParams", "WebSocket", "atob", "document", "getComputedStyle",
  "localStorage", "navigator", "performance", "queueMicrotask", "window",
];

export default [
  js.configs.recommended,
  {
    files: ["src/**/*.js"],
    languageOptions: { globals: Object.fromEntries(BROWSER.map((name) => [name, "readonly"])) },
    rules: {
      eqeqeq: "error",
      "max-lines": ["error", 500],
      "max-lines-per-function": ["error", 70],
      "no-console": "error",
      "no-eval": "error",
      "no-implied-eval": "error",
      "no-var": "error",
      "prefer-const": "error",
    },
  },
  { files: ["build.mjs"], languageOptions: { globals: { process: "readonly" } } },
];
