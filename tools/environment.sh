#!/bin/sh
# Makes the environment that everything in this repository runs in: .venv, with Python 3.11 and the packages that
# pyproject.toml names. `make` calls it before each of its targets; it returns at once when .venv is up to date.
#
# Python 3.11 is the one found on PATH, or among pyenv's versions. Where there is none, any other Python 3 installs uv
# into .venv-uv, and uv fetches a Python 3.11 into the same folder. Nothing outside the repository is touched.
set -eu
cd "$(dirname "$0")/.."
. tools/python_where.sh

# Both would mix other installations into ours.
unset PYTHONPATH PYTHONHOME
export PIP_DISABLE_PIP_VERSION_CHECK=1 PIP_NO_INPUT=1

# What an environment depends on: pyproject.toml, and the place, because the scripts in it begin with its path.
key() {
    pwd
    cat pyproject.toml
}

# The kernels are compiled anew when their source changes, where a C compiler is.
kernels() {
    cat setup.py kernels/*.c | cksum | cmp -s - .venv/kernels && return
    .venv/bin/python setup.py --quiet build_ext --inplace
    cat setup.py kernels/*.c | cksum >.venv/kernels
}

# A Python 3.11 that uv fetches; its path is the output, all else goes to standard error.
python_from_uv() {
    any=$(python_where 'v >= (3, 9)') || {
        echo "There is no other Python 3 (3.9 or later, with its venv module) either, which could install uv." >&2
        return 1
    }
    echo "There is no Python 3.11 on PATH: $any installs uv, which fetches one (into .venv-uv)." >&2
    if [ ! -x .venv-uv/bin/uv ]; then
        rm -rf .venv-uv
        "$any" -m venv .venv-uv >&2 && .venv-uv/bin/python -m pip install --quiet uv >&2 || return 1
    fi
    export UV_PYTHON_INSTALL_DIR="$PWD/.venv-uv/python" UV_CACHE_DIR="$PWD/.venv-uv/cache"
    .venv-uv/bin/uv python install --no-bin 3.11 >&2 || return 1
    .venv-uv/bin/uv python find --managed-python 3.11
}

if [ -x .venv/bin/python ] && [ "$(key)" = "$(cat .venv/key 2>/dev/null)" ]; then
    kernels
    exit 0
fi

python=$(python_where 'v == (3, 11)') || python=$(python_from_uv) || {
    cat >&2 <<'MESSAGE'

make needs Python 3.11: pybullet, the engine of football tables, is published ready to use for Python up to 3.11 only.
(pip install . works with Python 3.11 to 3.14; after 3.11 a table needs engine: pure.)
None was found on PATH, and uv could not fetch one (see above). Install it, then run make again:
    Debian 12:  sudo apt-get install python3.11 python3.11-venv
    Ubuntu:     sudo add-apt-repository ppa:deadsnakes/ppa && sudo apt-get install python3.11 python3.11-venv
    Fedora:     sudo dnf install python3.11
    macOS:      brew install python@3.11
    pyenv:      pyenv install 3.11 && pyenv local 3.11
Python 3.11 in another place is found if its folder is on PATH:  PATH=/opt/python3.11/bin:$PATH make
MESSAGE
    exit 1
}

begun=$(date +%s)
step() {
    echo "    [$(($(date +%s) - begun)) s] $1"
}

echo "Setting up .venv with $("$python" --version) ($python); this takes one to three minutes, once."
rm -rf .venv
step "making the environment"
"$python" -m venv .venv
# What pip is at, with or without a terminal; all that it says is in .venv/setup.log.
# Here setuptools builds foosim: pip would else install mypy once more, for that alone. What no test imports stays
# uncompiled, which is most of what is installed.
step "finding out which packages are needed"
(
    .venv/bin/python -m pip install --quiet 'setuptools>=77' 2>&1 &&
        .venv/bin/python -m pip install --progress-bar off --no-compile --no-build-isolation --editable '.[dev]' 2>&1 &&
        touch .venv/installed
) | tee .venv/setup.log | {
    found=0
    while IFS= read -r line; do
        case $line in
        Collecting*)
            found=$((found + 1))
            [ $((found % 5)) -ne 0 ] || step "$found packages found, the last one is ${line#Collecting }"
            ;;
        "Installing collected packages"*) step "installing them" ;;
        *"Building editable for foosim (pyproject.toml): started"*) step "building foosim" ;;
        ERROR*) echo "    $line" >&2 ;;
        esac
    done
}
if [ ! -e .venv/installed ]; then
    tail -n 20 .venv/setup.log >&2
    exit 1
fi
rm .venv/installed
cat setup.py kernels/*.c | cksum >.venv/kernels
step "done"
# Last, so that an environment that was interrupted half-way is made anew.
key >.venv/key
