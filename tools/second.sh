#!/bin/sh
# Runs the tests that are given, in one process, with the newest Python after 3.11 that is found on PATH or among pyenv's
# versions: in .venv-second, with the packages of .venv at their versions and without pybullet. `make second` calls it; where
# there is no such Python, it says so and is done.
set -eu
cd "$(dirname "$0")/.."
. tools/python_where.sh
unset PYTHONPATH PYTHONHOME
export PIP_DISABLE_PIP_VERSION_CHECK=1 PIP_NO_INPUT=1

python=$(python_where 'v == (3, 14)') || python=$(python_where 'v == (3, 13)') || python=$(python_where 'v == (3, 12)') || {
    echo "No tests on a second Python: there is none of 3.12 to 3.14."
    exit 0
}

key() {
    pwd
    echo "$python"
    cat pyproject.toml tools/second.sh
}

if [ "$(key)" != "$(cat .venv-second/key 2>/dev/null)" ]; then
    echo "Setting up .venv-second with $("$python" --version) ($python)."
    rm -rf .venv-second
    "$python" -m venv .venv-second
    pip() {
        .venv-second/bin/python -m pip "$@"
    }
    .venv/bin/python -m pip freeze --exclude-editable --all | grep -v '^pybullet==' >.venv-second/versions
    {
        pip install --no-compile --constraint .venv-second/versions 'setuptools>=77' &&
            pip install --no-compile --constraint .venv-second/versions --no-build-isolation --editable . \
                hypothesis msgpack pytest pytest-timeout pytest-xdist
    } >.venv-second/setup.log 2>&1 || {
        tail -n 20 .venv-second/setup.log >&2
        exit 1
    }
    key >.venv-second/key
fi

.venv-second/bin/python -m pytest -p no:cacheprovider --quiet "$@"
