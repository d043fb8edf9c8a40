#!/bin/bash
# Downloads a network for `sqslam detect` from the npm registry: the TensorFlow.js weights of CenterNet-MobileNetV3
# in the package @vladmandic/human (MIT), converted to ONNX. Checks the files by sha256 and puts the network into
# FOLDER, by default assets/detectors, which is not part of the repository.
# usage: scripts/fetch-detector.sh [FOLDER]
set -euo pipefail
folder=${1:+$(realpath -m "$1")}  # before the change of folder
cd "$(dirname "$0")/.."

folder=${folder:-assets/detectors}
target=$folder/centernet_mbv3.onnx
package=@vladmandic/human@3.3.6
archive_sha=425e9c51dbbca0c8934362b170cb0d54c2529c11c654b3c03092b16e9d6ad3f7
network_sha=73a0407d54ef0092125e97e99671a2570ff36c3589a10288d1e4e5d3981fc0dd

fail() {  # MESSAGE
  echo "fetch-detector: $1" >&2
  exit 3
}
has_sum() {  # FILE SHA256
  [ "$(sha256sum "$1" | cut -d' ' -f1)" = "$2" ]
}
check() {  # FILE SHA256
  has_sum "$1" "$2" || fail "$1 is not the file that was expected (sha256 $2)"
}

mkdir -p "$folder" || fail "$folder cannot be created"
if [ -f "$target" ]; then
  if has_sum "$target" "$network_sha"; then
    echo "$target is there already"
    exit 0
  fi
  echo "fetch-detector: $target is not the file that was expected, and is fetched again" >&2
fi

# In the same file system as the target, so that the last step is a rename.
work=$(mktemp -d "$folder/.fetch.XXXXXX") || fail "$folder is not writable"
trap 'rm -rf "$work"' EXIT
archive=$work/human.tgz
command -v python3 >/dev/null || scripts/install-packages.sh python3
if command -v npm >/dev/null; then
  (cd "$work" && npm pack --silent "$package" >/dev/null) ||
    fail "npm cannot download $package, expected a connection to the npm registry and room in $folder"
  mv "$work"/vladmandic-human-*.tgz "$archive"
else
  command -v curl >/dev/null || scripts/install-packages.sh curl ca-certificates
  reason=$(curl -fsSL -o "$archive" https://registry.npmjs.org/@vladmandic/human/-/human-3.3.6.tgz 2>&1) ||
    fail "$package cannot be downloaded ($reason)"
fi
check "$archive" "$archive_sha"
tar -xzf "$archive" -C "$work" package/models/centernet.json package/models/centernet.bin ||
  fail "$archive cannot be unpacked, expected room in $folder"
python3 scripts/tfjs2onnx.py "$work/package/models/centernet.json" "$work/network.onnx" ||
  fail "the network cannot be converted"
check "$work/network.onnx" "$network_sha"
mv "$work/network.onnx" "$target"
echo "$target is there; \`sqslam run\` finds networks in assets/detectors by itself"
