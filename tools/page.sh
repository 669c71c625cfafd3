#!/bin/sh
# Work on the console's page, out of sight of other tools: sources and libraries lie in .page, which is not checked in.
#     tools/page.sh build FOLDER   make what is served
#     tools/page.sh check          eslint, the type checker, tests of what needs no browser
# The libraries are those of package-lock.json, installed once.
set -eu
cd "$(dirname "$0")/.."
command -v npm >/dev/null || { echo "npm is missing: the page is built with node 20 or newer" >&2; exit 1; }
place=.page
mkdir -p "$place"
if ! cmp -s console/page/package-lock.json "$place/installed.json" || [ ! -d "$place/node_modules" ]; then
    rm -f "$place/installed.json"
    cp console/page/package.json console/page/package-lock.json "$place/"
    npm --prefix "$place" ci --prefer-offline --ignore-scripts --no-audit --no-fund --loglevel=error >&2
    cp console/page/package-lock.json "$place/installed.json"
fi
rm -rf "$place/src" "$place/test"
cp -R console/page/. "$place/"
case "${1:-}" in
build)
    out=$(mkdir -p "${2:?the folder to write to}" && cd "$2" && pwd)
    cd "$place"
    node build.mjs "$out"
    ;;
check)
    cd "$place"
    node_modules/.bin/eslint src build.mjs
    node_modules/.bin/tsc
    node --test --test-reporter=dot test/*.test.mjs
    ;;
*)
    echo "tools/page.sh build FOLDER, or tools/page.sh check" >&2
    exit 2
    ;;
esac
