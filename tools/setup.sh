#!/bin/sh
# make setup: a .venv in the repository's root with everything poolcal needs. Run again, it does nothing until
# pyproject.toml, constraints.txt or this file change. PYTHON=/path/to/python3 chooses the interpreter, EXTRAS=dev,docs
# the optional packages: by default those of the tests; EXTRAS= installs the program alone.
set -eu
EXTRAS=${EXTRAS-dev}
cd "$(dirname "$0")/.."
root=$(pwd -P)
stamp=.venv/.setup

fail() { echo "setup: $1" >&2; exit 2; }

# Install system packages where we may; otherwise print the one command and stop.
apt_install() { # reason, packages...
    reason=$1; shift
    command -v apt-get >/dev/null 2>&1 || fail "$reason; install what your system calls: $*"
    if [ "$(id -u)" = 0 ]; then as=""
    elif command -v sudo >/dev/null 2>&1 && sudo -n true 2>/dev/null; then as="sudo"
    else fail "$reason; run: sudo apt-get install -y $*"
    fi
    echo "setup: $reason: installing $*"
    $as apt-get -o DPkg::Lock::Timeout=120 update -qq </dev/null || true
    $as env DEBIAN_FRONTEND=noninteractive apt-get -o DPkg::Lock::Timeout=120 install -y -qq --no-install-recommends "$@" </dev/null >/dev/null ||
        fail "$reason; run: sudo apt-get install -y $*"
}

new_enough() { "$1" -c 'import sys; sys.exit(sys.version_info < (3, 11))' 2>/dev/null; }

# --- a Python ---------------------------------------------------------------------------------------------------------
python=""
for candidate in ${PYTHON:-python3.13 python3.12 python3.11 python3}; do
    command -v "$candidate" >/dev/null 2>&1 && new_enough "$candidate" || continue
    [ -n "$python" ] || python=$candidate
    if "$candidate" -c 'import ensurepip, venv; ensurepip.version()' 2>/dev/null; then python=$candidate; break; fi
done
[ -n "$python" ] || [ -z "${PYTHON:-}" ] || fail "PYTHON=$PYTHON is no Python 3.11 or newer; name another, or none"
[ -n "$python" ] || fail "no Python 3.11 or newer (found: $(python3 --version 2>&1 || true)); install one, or name it: make setup PYTHON=/path/to/python3"

# --- nothing to do? -----------------------------------------------------------------------------------------------------
wanted="$root [$EXTRAS] $(cat pyproject.toml constraints.txt tools/setup.sh | cksum)"
if [ -f "$stamp" ] && [ "$(cat "$stamp")" = "$wanted" ] && [ -x .venv/bin/poolcal ]; then
    touch "$stamp"
    exit 0
fi

# --- the system -----------------------------------------------------------------------------------------------------
"$python" - <<'PYTHON' || exit 2
import platform, sys
name, version = platform.libc_ver()
if name != "glibc" or tuple(int(n) for n in version.split(".")[:2]) < (2, 35):
    sys.exit(f"setup: open3d needs glibc 2.35 or newer, here is {name or 'no glibc'} {version}; use Debian 12, Ubuntu 22.04 or newer")
PYTHON
"$python" -c 'import ensurepip, venv; ensurepip.version()' 2>/dev/null || {
    version=$("$python" -c 'import sys; print("%d.%d" % sys.version_info[:2])')
    apt_install "$python lacks venv" "python$version-venv"
    "$python" -c 'import ensurepip, venv; ensurepip.version()' 2>/dev/null || fail "$python still lacks venv; name another: make setup PYTHON=/path/to/python3"
}
missing_libraries() {
    "$python" - <<'PYTHON'
import ctypes
for library, package in {
    "libusb-1.0.so.0": "libusb-1.0-0", "libX11.so.6": "libx11-6", "libGL.so.1": "libgl1",
    "libEGL.so.1": "libegl1", "libgomp.so.1": "libgomp1",
}.items():
    try:
        ctypes.CDLL(library)
    except OSError:
        print(package)
PYTHON
}
packages=$(missing_libraries | tr '\n' ' ')
if [ -n "$packages" ]; then
    apt_install "open3d needs system libraries" $packages
    packages=$(missing_libraries | tr '\n' ' ')
    [ -z "$packages" ] || fail "libraries of $packages still do not load"
fi

# --- the packages -----------------------------------------------------------------------------------------------------
rm -f "$stamp"
if [ -d .venv ] && ! { [ -x .venv/bin/python ] && new_enough .venv/bin/python && .venv/bin/python -m pip --version >/dev/null 2>&1 &&
    [ "$(.venv/bin/python -c 'import sys; print(sys.prefix)')" = "$root/.venv" ]; }; then
    echo "setup: .venv does not work here any more: making it anew"
    rm -rf .venv
fi
[ -x .venv/bin/python ] || "$python" -m venv .venv || { rm -rf .venv; fail "$python could not make .venv"; }
echo "setup: installing packages into .venv (some minutes the first time)"
# Python compiles a module when it is first imported: most of the packages' modules never are. Those of a run are
# imported below, for users of a .venv that they may not write.
install() { .venv/bin/python -m pip --disable-pip-version-check install -q --no-compile -c constraints.txt "$@" </dev/null; }
install setuptools && install --no-build-isolation -e ".${EXTRAS:+[$EXTRAS]}" ||
    fail "packages could not be installed (see above); correct this and run make setup again"
loops='import sys, stages.adjust, stages.cli
from pipeline.maths.kernels.compiled import compile_all
compile_all(int(sys.argv[1]), 2)'
.venv/bin/python -c "$loops" 0 & half=$! # the other processor compiles the other half
run='import jinja2, matplotlib.figure, open3d, pyarrow, rerun, stages
stages.load()'
{ .venv/bin/python -c "$run
$loops" 1 && wait "$half"; } ||
    fail "the packages do not load, or the loops of pipeline/maths/kernels do not compile (see above)"
echo "$wanted" >"$stamp"
echo "setup: ready; the command is .venv/bin/poolcal"
