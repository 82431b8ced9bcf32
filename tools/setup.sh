#!/bin/sh
# Sets up the virtual environment $VENV with pinned dependencies, and a usable libLLVM where the
# package manager can give one. Can be repeated; called by make.
set -eu

PYTHON=${PYTHON:-python3}
VENV=${VENV:-.venv}

fail() { printf 'setup: %s\n' "$1" >&2; exit 1; }

"$PYTHON" -c 'import sys; sys.exit(sys.version_info < (3, 11))' 2>/dev/null ||
    fail "$PYTHON is not Python 3.11 or newer; install one and run: make PYTHON=/path/to/python3.11"

if [ ! -x "$VENV/bin/python" ] || ! "$VENV/bin/python" -m pip --version >/dev/null 2>&1; then
    echo "setup: virtual environment in $VENV"
    "$PYTHON" -m venv --clear "$VENV" ||
        fail "could not make a virtual environment; on Debian: apt-get install python3-venv"
fi

echo "setup: dependencies (a minute or two)"
"$VENV/bin/python" -m pip install --quiet --disable-pip-version-check \
    --constraint constraints.txt --editable '.[dev,joblib,slurm]' ||
    fail "pip could not install the dependencies; its message stands above"

# Dr.Jit's fast CPU backend needs libLLVM 17 or newer. Without it everything runs, only slower.
llvm() {
    "$VENV/bin/python" -c '
import sys
from ngi.llvm import find_llvm
library = find_llvm()
print(f"setup: {library or '"'no usable libLLVM'"'}")
sys.exit(library is None)'
}

if ! llvm >/dev/null && command -v apt-get >/dev/null 2>&1; then
    echo "setup: libLLVM (for the fast renderer)"
    root=
    if [ "$(id -u)" != 0 ]; then root="sudo -n"; fi
    $root apt-get update >"$VENV/apt.log" 2>&1 || true
    for version in 19 20 21 22 18 17; do
        $root env DEBIAN_FRONTEND=noninteractive apt-get install --yes --no-install-recommends \
            "libllvm$version" >>"$VENV/apt.log" 2>&1 && break
    done
fi
llvm || echo "setup: the slower scalar renderer will be used; faster: apt-get install libllvm19" \
    "(any from 17 on), then make again"
