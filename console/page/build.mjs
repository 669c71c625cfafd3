// Makes what is served out of the sources: `node build.mjs FOLDER`. The same versions make the same bytes.

import { build } from "esbuild";
import { copyFileSync, mkdirSync, readFileSync, writeFileSync } from "node:fs";

const [folder] = process.argv.slice(2);
if (!folder) throw new Error("node build.mjs FOLDER: where to write");
mkdirSync(folder, { recursive: true });

const licence = (name) => {
  const { version, homepage } = JSON.parse(readFileSync(`node_modules/${name}/package.json`, "utf8"));
  return { head: `${name} ${version}`, homepage, text: readFileSync(`node_modules/${name}/LICENSE`, "utf8").trim() };
};
const uplot = licence("uplot");
const common = {
  bundle: true,
  minify: true,
  format: "iife",
  target: ["es2022", "chrome111", "firefox113", "safari16.4"],
  charset: "utf8",
  legalComments: "none",
  outdir: folder,
  logLevel: "warning",
};

await build({
  ...common,
  entryPoints: [
    { in: "src/main.js", out: "console" },
    { in: "src/console.css", out: "console" },
  ],
});
// A report is a file of its own that travels alone: the licence of what is in it goes with it.
await build({
  ...common,
  entryPoints: [
    { in: "src/report.js", out: "report" },
    { in: "src/report.css", out: "report" },
  ],
  banner: { js: `/* contains code of ${uplot.head}\n\n${uplot.text}\n*/` },
});

for (const name of ["index.html", "favicon.svg"]) copyFileSync(name, `${folder}/${name}`);
const licences = ["three", "uplot"].map((name) => {
  const { head, homepage, text } = licence(name);
  return `${head} (${homepage})\n\n${text}\n`;
});
writeFileSync(`${folder}/licences.txt`, `console.js, console.css, report.js and report.css contain code of these libraries.\n\n${licences.join("\n\n")}`);
