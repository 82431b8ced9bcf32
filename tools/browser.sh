#!/bin/sh
# Chromium for the viewer's tests, where the package manager can give one; without it
# they are skipped. Can be repeated; called by make.
set -u

found() { command -v chromium >/dev/null 2>&1 || command -v chromium-browser >/dev/null 2>&1; }

if ! found && command -v apt-get >/dev/null 2>&1; then
    echo "setup: Chromium (for the viewer's tests)"
    root=
    if [ "$(id -u)" != 0 ]; then root="sudo -n"; fi
    $root env DEBIAN_FRONTEND=noninteractive sh -c \
        'apt-get update --yes; apt-get install --yes --no-install-recommends chromium' >/dev/null 2>&1
fi
found || echo "setup: no Chromium, so the viewer's tests are skipped; on Debian: apt-get install chromium"
