#!/bin/sh
# Sets up the tools that a machine with Rust, a C and C++ compiler, make and Python 3.10 or later may still lack.
#
#     sh cmake/bootstrap.sh [render] [pictures] [bench] [python] [blender] [cloth] [farm] [files] [portable] [docs]
#
#   always   cmake 3.20 or later: the system's own, or a pinned one in .venv/
#   render   the packages of host_examples/render, in .venv/
#   pictures the same without the renderer, for make pictures, in .venv/
#   bench    scipy and numpy for tests/bench, in .venv/
#   python   numpy, cffi and mypy for host_examples/python, in .venv/
#   blender  Blender as a Python module, 1 GB, in .venv/blender/: it wants an older numpy. Python 3.11 only
#   cloth    the solvers that tests/report and tests/bench set beside the library, in .venv/
#   farm     Dask, USD and what else host_examples/farm needs, in .venv/: Python 3.11 or later
#   files    USD and a reader of glTF, which judge what the command line writes, in .venv/
#   portable a linker for old Linux systems, 450 MB, for make wheel, in .venv/
#   docs     what makes the pages of make docs, in .venv/
#
# Everything lands in .venv/ and build/ below the project. What is set up is noted in .venv/installed-*, so that a
# later run does nothing and needs no network. build/tools.sh then names the tools: CMAKE, CTEST, PYTHON.
set -eu

root=$(CDPATH='' cd -- "$(dirname -- "$0")/.." && pwd)
cd "$root"
venv=$root/.venv

say() { printf 'bootstrap: %s\n' "$*"; }

fail() {
    printf 'bootstrap: %s\n' "$@" >&2
    exit 1
}

# What a set consists of: pip requirements, one a line.
pins() {
    case $1 in
    cmake) echo 'cmake==3.31.10' ;;
    render) grep -v '^#' host_examples/render/requirements.txt ;;
    pictures) grep -v "^#\|^mitsuba" host_examples/render/requirements.txt ;;
    bench)
        echo 'scipy==1.17.1; python_version >= "3.11"'
        echo 'scipy==1.15.3; python_version < "3.11"'
        grep '^numpy' host_examples/render/requirements.txt
        ;;
    python)
        echo 'cffi==2.1.1'
        echo 'mypy==2.4.1'
        grep '^numpy' host_examples/render/requirements.txt
        ;;
    blender) echo 'bpy==5.0.1' ;;
    cloth)
        echo 'mujoco-core==4.0.0'
        echo 'newton==1.8.0'
        echo 'warp-lang==1.19.0'
        grep '^numpy' host_examples/render/requirements.txt
        ;;
    farm) grep -v '^#' host_examples/farm/requirements.txt && grep -v '^#\|^mitsuba' host_examples/render/requirements.txt ;;
    files)
        echo 'pygltflib==1.16.5'
        grep '^usd-core' host_examples/farm/requirements.txt
        grep '^numpy' host_examples/render/requirements.txt
        ;;
    docs) echo 'mkdocs-material==9.8.1' ;;
    portable) printf '%s\n' 'cargo-zigbuild==0.24.0' 'ziglang==0.17.1' ;;
    *) fail "unknown argument '$1'; known: render, pictures, bench, python, blender, cloth, farm, files, portable, docs" ;;
    esac
}

have_cmake() {
    version=$("$1" --version 2>/dev/null | sed -n 's/^cmake version //p') || return 1
    major=${version%%.*}
    rest=${version#*.}
    minor=${rest%%.*}
    [ "${major:-0}" -gt 3 ] || { [ "${major:-0}" -eq 3 ] && [ "${minor:-0}" -ge 20 ]; }
}

# A virtual environment works only where it was made and with the Python it was made by; .venv/made-for names both.
make_venv() {
    command -v python3 >/dev/null ||
        fail "python3 is missing; install Python 3.10 or later" "(Debian, Ubuntu: apt install python3 python3-venv)"
    place=$(python3 -c 'import sys; print(*sys.version_info[:2], sep=".")')\ $root
    if [ "$(cat "$venv/made-for" 2>/dev/null)" = "$place" ] && "$venv/bin/python" -c '' 2>/dev/null; then
        return
    fi
    python3 -c 'import sys; sys.exit(sys.version_info < (3, 10))' ||
        fail "python3 is $(python3 -V 2>&1); 3.10 or later is needed"
    python3 -c 'import venv, ensurepip' 2>/dev/null ||
        fail "python3 cannot make virtual environments; install the package for that" \
            "(Debian, Ubuntu: apt install python3-venv)"
    say "making the Python environment .venv/"
    rm -rf "$venv"
    python3 -m venv "$venv" || fail "python3 -m venv failed (Debian, Ubuntu: apt install python3-venv)"
    printf '%s\n' "$place" >"$venv/made-for"
}

# A set that cannot share .venv/ has an environment of its own inside it.
place_for() {
    into=$venv
    if [ "$1" = blender ]; then
        python3 -c 'import sys; sys.exit(sys.version_info[:2] != (3, 11))' ||
            fail "blender: bpy needs Python 3.11, python3 is $(python3 -V 2>&1)"
        into=$venv/blender
        [ -x "$into/bin/python" ] || python3 -m venv "$into"
    fi
}

install() {
    make_venv
    if pins "$1" | cmp -s - "$venv/installed-$1"; then
        say "$1: already in .venv/"
        return
    fi
    say "$1: installing into .venv/, needs the network this once:"
    place_for "$1"
    pins "$1" | tee "$venv/requirements-$1" | sed 's/^/bootstrap:   /'
    "$into/bin/python" -m pip install -qq --disable-pip-version-check --retries 2 --only-binary :all: \
        -r "$venv/requirements-$1" || fail "$1: pip could not install it (see above); is the network reachable?"
    mv "$venv/requirements-$1" "$venv/installed-$1"
}

check_compilers() {
    command -v cargo >/dev/null || fail "cargo is missing; install Rust 1.89 or later with rustup"
    { command -v cc && command -v c++; } >/dev/null ||
        fail "a C and a C++ compiler are needed as cc and c++ (Debian, Ubuntu: apt install build-essential)"
}

for set in "$@"; do
    pins "$set" >/dev/null
done
check_compilers
if have_cmake cmake; then
    cmake=$(command -v cmake)
    say "cmake: the system's own $cmake, $version"
else
    install cmake
    cmake=$venv/bin/cmake
    have_cmake "$cmake" || fail "$cmake does not run; remove .venv/ and try again"
fi
for set in "$@"; do
    install "$set"
done

mkdir -p build
printf "CMAKE='%s'\nCTEST='%s'\nPYTHON='%s'\n" "$cmake" "${cmake%cmake}ctest" "$venv/bin/python" >build/tools.sh
