#!/bin/sh
# make setup-visual: what the tests of pages and recordings look with: Chromium, a Vulkan driver in software, and
# poppler's tools for the printed page, a font with Chinese letters. Installed where we may; otherwise the one command is printed.
set -eu
packages=""
command -v chromium >/dev/null 2>&1 || command -v chromium-browser >/dev/null 2>&1 ||
    command -v google-chrome >/dev/null 2>&1 || packages="$packages chromium"
command -v pdftotext >/dev/null 2>&1 || packages="$packages poppler-utils"
ls /usr/share/vulkan/icd.d/*.json >/dev/null 2>&1 || packages="$packages libvulkan1 mesa-vulkan-drivers"
fc-list :lang=zh family 2>/dev/null | grep -q . || packages="$packages fontconfig fonts-wqy-microhei"
[ -n "$packages" ] || { echo "setup-visual: everything is there"; exit 0; }
command="apt-get -o DPkg::Lock::Timeout=120 install -y --no-install-recommends$packages"
command -v apt-get >/dev/null 2>&1 || { echo "setup-visual: install what your system calls:$packages" >&2; exit 2; }
if [ "$(id -u)" = 0 ]; then as=""
elif command -v sudo >/dev/null 2>&1 && sudo -n true 2>/dev/null; then as="sudo"
else echo "setup-visual: run: sudo $command" >&2; exit 2
fi
echo "setup-visual: installing$packages"
$as apt-get -o DPkg::Lock::Timeout=120 update -qq </dev/null || true
$as env DEBIAN_FRONTEND=noninteractive $command </dev/null >/dev/null || { echo "setup-visual: run: sudo $command" >&2; exit 2; }
echo "setup-visual: ready"
