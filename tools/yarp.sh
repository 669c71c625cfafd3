#!/bin/sh
# Builds YARP's programs `yarp` and `yarpserver` into .yarp, once, for the tests of the gateway to YARP: some four minutes of
# one core. Their sources come from PyPI (BSD-3-Clause), as do CMake and its modules. `make yarp` calls it.
set -eu
cd "$(dirname "$0")/.."
version=3.5.0
[ ! -x .yarp/build/bin/yarp ] || exit 0
mkdir -p .yarp
cd .yarp
{
    ../.venv/bin/python -m venv env
    env/bin/python -m pip install --quiet --disable-pip-version-check 'cmake<4' ycm-cmake-modules
    env/bin/python -m pip download --quiet --disable-pip-version-check --no-deps --no-binary yarp-middleware "yarp-middleware==$version"
    mkdir -p src
    tar -xzf "yarp_middleware-$version.tar.gz" -C src --strip-components 1
    # Its sources leave out headers that other compilers include by themselves.
    env/bin/cmake -S src -B build -DCMAKE_BUILD_TYPE=Release -DSKIP_ACE=ON -DYARP_COMPILE_GUIS=OFF \
        -DYARP_COMPILE_BINDINGS=OFF -DYARP_COMPILE_DEVICE_PLUGINS=OFF -DYARP_COMPILE_CARRIER_PLUGINS=OFF \
        -DCMAKE_CXX_FLAGS='-include iterator -include utility -include memory' \
        -DYCM_DIR="$(env/bin/python -c 'import pathlib, ycm_cmake_modules as m; print(pathlib.Path(m.__path__[0], "share/cmake/YCM"))')"
    nice env/bin/cmake --build build --target yarp yarpserver
} >setup.log 2>&1 || {
    tail -n 20 setup.log >&2
    exit 1
}
