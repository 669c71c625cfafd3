# The search for a Python, for the scripts beside it that source this. They work in the folder of the repository.

# The first Python that satisfies a condition over `v`, its version: of PATH, then of pyenv, whose commands on PATH run
# only the versions that are chosen there and print an error for others. It must really run and be able to make
# environments (Debian packs ensurepip apart from Python). The environment that is replaced is none: it may be the one
# that is active.
python_where() {
    (
        IFS=:
        for folder in $PATH $(printf '%s:' "${PYENV_ROOT:-$HOME/.pyenv}"/versions/*/bin); do
            case $folder in "$PWD"/.venv*/*) continue ;; esac
            for name in python3.11 python3 python3.14 python3.13 python3.12 python3.10 python3.9 python; do
                if [ -x "$folder/$name" ] && "$folder/$name" -c "
import sys, ensurepip, venv
v = sys.version_info[:2]
sys.exit(not ($1 and sys.implementation.name == 'cpython'))" >/dev/null 2>&1; then
                    echo "$folder/$name"
                    exit 0
                fi
            done
        done
        exit 1
    )
}
