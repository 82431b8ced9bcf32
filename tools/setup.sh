#!/bin/sh
# Sets up the virtual environment $VENV with pinned dependencies, and a usable libLLVM where the
# package manager can give one. Can be repeated; called by make.
set -eu

PYTHON=${PYTHON:-python3}
VENV=${VENV:-.venv}

# apt-get without questions, as root or by sudo where that asks for no password.
apt() {
    verb=$1
    shift
    root=
    if [ "$(id -u)" != 0 ]; then root="sudo -n"; fi
    $root env DEBIAN_FRONTEND=noninteractive apt-get "$verb" --yes "$@" >/dev/null 2>&1
}

fail() { printf 'setup: %s\n' "$1" >&2; exit 1; }

"$PYTHON" -c 'import sys; sys.exit(sys.version_info < (3, 11))' 2>/dev/null ||
    fail "$PYTHON is not Python 3.11 or newer; install one and run: make PYTHON=/path/to/python3.11"

if [ ! -x "$VENV/bin/python" ] || ! "$VENV/bin/python" -m pip --version >/dev/null 2>&1; then
    echo "setup: virtual environment in $VENV"
    "$PYTHON" -m venv --clear "$VENV" >/dev/null 2>&1 || {
        apt update && apt install python3-venv && "$PYTHON" -m venv --clear "$VENV"
    } || fail "could not make a virtual environment; on Debian: apt-get install python3-venv"
fi

echo "setup: dependencies (a minute or two)"
if ! command -v nvidia-smi >/dev/null 2>&1 && [ -z "${PIP_EXTRA_INDEX_URL:-}${PIP_INDEX_URL:-}" ]; then
    echo "setup: no NVIDIA driver here; if pip fetches PyTorch with gigabytes of CUDA libraries," \
        "PIP_EXTRA_INDEX_URL=<PyTorch's CPU index> make avoids that"
fi
"$VENV/bin/python" -m pip install --quiet --disable-pip-version-check \
    --no-compile --constraint constraints.txt --editable '.[dev,docs,joblib,slurm,viewer,video,denoise,export,tensorboard,mlflow]' ||
    fail "pip could not install the dependencies; its message stands above"
# On all cores, where pip compiles one file after the other; some are of other versions of Python.
# Now, because containers often forbid it to later imports; the libraries' own tests are a fifth.
# Nothing here imports databricks, and mypy has a compiled twin beside each of its files.
"$VENV/bin/python" -m compileall -qq -j 0 -x '/tests?/|/site-packages/(databricks|mypyc?)/' \
    "$VENV/lib" ngi analysis || true

# LPIPS needs AlexNet's weights; without them its column stays empty. LPIPS=no leaves them out.
[ "${LPIPS:-yes}" = no ] || "$VENV/bin/python" -m ngi.evaluate.lpips_download || true

# Dr.Jit's fast CPU backend needs libLLVM 17 or newer. Without it everything runs, only slower.
llvm() {
    "$VENV/bin/python" -c '
import sys
from ngi.machine.llvm import find_llvm
library = find_llvm()
print(f"setup: {library or '"'no usable libLLVM'"'}")
sys.exit(library is None)'
}

if ! llvm >/dev/null && command -v apt-get >/dev/null 2>&1; then
    echo "setup: libLLVM (for the fast renderer)"
    apt update || true
    for version in 19 20 21 22 18 17; do
        apt install "libllvm$version" && break
    done
fi
llvm || echo "setup: the slower scalar renderer will be used, without caustics, which method=ours and" \
    "make view are refused for; better: apt-get install libllvm19 (any from 17 on), then make again"
