#!/bin/sh
# Installs the system libraries that rendering without a display needs, where they are missing and we may install them.
set -eu

packages="libegl1 libgl1 libgl1-mesa-dri"
missing=""
for package in $packages; do
    dpkg-query --show --showformat='${Status}' "$package" 2>/dev/null | grep -q "ok installed" || missing="$missing $package"
done
[ -n "$missing" ] || exit 0

if ! command -v apt-get >/dev/null 2>&1; then
    # Not a Debian machine: its libraries have other names, and `orchestrator doctor` tells whether EGL works.
    exit 0
fi
if [ "$(id -u)" = 0 ]; then
    as_root=""
elif sudo -n true 2>/dev/null; then
    as_root="sudo"
else
    echo "Rendering needs these system packages:$missing" >&2
    echo "Install them and start again:  sudo apt-get install$missing" >&2
    exit 1
fi
echo "Installing$missing" >&2
$as_root apt-get update -qq
# Word splitting is meant: one argument a package.
# shellcheck disable=SC2086
$as_root env DEBIAN_FRONTEND=noninteractive apt-get install -y -qq --no-install-recommends $missing >/dev/null
