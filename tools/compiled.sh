#!/bin/sh
# Makes .venv-compiled: foosim as pip installs it, with its hot path compiled (setup.py), beside the packages of .venv.
# Needs a C compiler. `make compiled` calls it with the packages; it returns at once when nothing that goes into the wheel has changed.
set -eu
cd "$(dirname "$0")/.."
unset PYTHONPATH PYTHONHOME
python=$PWD/.venv/bin/python
folders=$*
files="setup.py pyproject.toml README.md LICENSE"

key() {
    pwd
    # shellcheck disable=SC2086  # several words are meant
    find $folders $files -type f ! -name '*.pyc' ! -path '*/node_modules/*' | LC_ALL=C sort | xargs cksum
}

if [ -x .venv-compiled/bin/python ] && [ "$(key)" = "$(cat .venv-compiled/key 2>/dev/null)" ]; then
    exit 0
fi

echo "Compiling the hot path into .venv-compiled; this takes two minutes of processor time or some, once for each change."
rm -rf .venv-compiled
"$python" -m venv --without-pip .venv-compiled
# In a copy: what an earlier build left would be shipped, and nothing is left in this folder. Not the packages of npm that
# an editor needs beside the page's sources: they are many, and nothing of them is shipped.
mkdir .venv-compiled/source
# Links are followed: a package has its deployment from deploy/ by one.
# shellcheck disable=SC2086
tar -chf - --exclude=node_modules --exclude=__pycache__ $folders $files | tar -xf - -C .venv-compiled/source
# How far it is goes to the terminal, all else to the log.
(
    cd .venv-compiled/source
    FOOSIM_COMPILE=always "$python" -m build --no-isolation --wheel --outdir .. 2>&1 && touch ../built
) | tee .venv-compiled/build.log | while IFS= read -r line; do
    case $line in
    "foosim: "*) echo "    ${line#foosim: }" ;;
    esac
done
if [ ! -e .venv-compiled/built ]; then
    tail -n 20 .venv-compiled/build.log >&2
    exit 1
fi
"$python" -m pip --python .venv-compiled/bin/python install --quiet --no-deps --no-index .venv-compiled/*.whl
# Our dependencies, by a path file: it adds a folder without running what the folder's own path files ask for, so the
# editable install beside them stays out of sight.
packages=$("$python" -c 'import sysconfig; print(sysconfig.get_path("purelib"))')
echo "$packages" >"$(.venv-compiled/bin/python -c 'import sysconfig; print(sysconfig.get_path("purelib"))')/dependencies.pth"
rm -rf .venv-compiled/source .venv-compiled/built .venv-compiled/*.whl
# Last, so that an environment that was interrupted half-way is made anew.
key >.venv-compiled/key
