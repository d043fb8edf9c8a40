#!/bin/bash
# Installs those of the given Debian packages that are missing. Needs root or sudo only if some are missing.
# usage: scripts/install-packages.sh [LIST.txt | PACKAGE]...; default: packages.txt
set -euo pipefail
cd "$(dirname "$0")/.."

[ $# -gt 0 ] || set -- packages.txt
wanted=()
for name in "$@"; do
  case $name in
    *.txt) mapfile -t -O "${#wanted[@]}" wanted < <(sed 's/#.*//' "$name" | awk 'NF {print $1}') ;;
    *) wanted+=("$name") ;;
  esac
done
if ! command -v dpkg-query >/dev/null; then
  echo "No dpkg-query, expected Debian 12; on other systems install by yourself what $PWD/packages.txt lists" >&2
  exit 3
fi
installed=$(dpkg-query --show --showformat '${db:Status-Status} ${Package}\n' 2>/dev/null | sed -n 's/^installed //p')
missing=()
for package in "${wanted[@]}"; do
  grep -qxF "$package" <<<"$installed" || missing+=("$package")
done
if [ ${#missing[@]} -eq 0 ]; then
  exit 0
fi

echo "Installing: ${missing[*]}"
as_root=()
if [ "$(id -u)" -ne 0 ]; then
  command -v sudo >/dev/null || { echo "Neither root nor sudo: install these packages first: ${missing[*]}" >&2; exit 1; }
  as_root=(sudo)
fi
"${as_root[@]}" apt-get update -qq
"${as_root[@]}" env DEBIAN_FRONTEND=noninteractive apt-get install -y -qq --no-install-recommends "${missing[@]}"
