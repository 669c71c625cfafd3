// Makes what is served out of the sources: `node build.mjs FOLDER`. The same versions make the same bytes.

import { build } from "esbuild";
import { copyFileSync, mkdirSync, readFileSync, writeFileSync } from "node:fs";

const [folder] = process.argv.slice(2);
if (!folder) throw new Error("node build.mjs FOLDER: where to write");
mkdirSync(folder, { recursive: true });

await build({
  entryPoints: [
    { in: "src/main.js", out: "console" },
    { in: "src/console.css", out: "console" },
    { in: "src/report.js", out: "report" },
  ],
  bundle: true,
  minify: true,
  format: "iife",
  target: ["es2022", "chrome111", "firefox113", "safari16.4"],
  charset: "utf8",
  legalComments: "none",
  outdir: folder,
  logLevel: "warning",
});

for (const name of ["index.html", "favicon.svg"]) copyFileSync(name, `${folder}/${name}`);
const licences = ["three", "uplot"].map((name) => {
  const { version, homepage } = JSON.parse(readFileSync(`node_modules/${name}/package.json`, "utf8"));
  return `${name} ${version} (${homepage})\n\n${readFileSync(`node_modules/${name}/LICENSE`, "utf8").trim()}\n`;
});
writeFileSync(`${folder}/licences.txt`, `console.js, console.css and report.js contain code of these libraries.\n\n${licences.join("\n\n")}`);
