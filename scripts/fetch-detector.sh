#!/bin/bash
# Downloads a network for `sqslam detect` from the npm registry: the TensorFlow.js weights of CenterNet-MobileNetV3
# in the package @vladmandic/human (MIT), converted to ONNX. Checks the files by sha256 and puts the network into
# FOLDER, by default assets/detectors, which is not part of the repository.
# usage: scripts/fetch-detector.sh [FOLDER]
set -euo pipefail
cd "$(dirname "$0")/.."

folder=${1:-assets/detectors}
target=$folder/centernet_mbv3.onnx
package=@vladmandic/human@3.3.6
archive_sha=425e9c51dbbca0c8934362b170cb0d54c2529c11c654b3c03092b16e9d6ad3f7
network_sha=73a0407d54ef0092125e97e99671a2570ff36c3589a10288d1e4e5d3981fc0dd

check() {  # FILE SHA256
  if [ "$(sha256sum "$1" | cut -d' ' -f1)" != "$2" ]; then
    echo "fetch-detector: $1 is not the file that was expected (sha256 $2)" >&2
    exit 3
  fi
}

mkdir -p "$folder"
if [ -f "$target" ]; then
  check "$target" "$network_sha"
  echo "$target is there already"
  exit 0
fi

work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
archive=$work/human.tgz
command -v python3 >/dev/null || scripts/install-packages.sh python3
if command -v npm >/dev/null; then
  (cd "$work" && npm pack --silent "$package" >/dev/null)
  mv "$work"/vladmandic-human-*.tgz "$archive"
else
  command -v curl >/dev/null || scripts/install-packages.sh curl ca-certificates
  curl -fsSL -o "$archive" https://registry.npmjs.org/@vladmandic/human/-/human-3.3.6.tgz
fi
check "$archive" "$archive_sha"
tar -xzf "$archive" -C "$work" package/models/centernet.json package/models/centernet.bin
python3 scripts/tfjs2onnx.py "$work/package/models/centernet.json" "$work/network.onnx"
check "$work/network.onnx" "$network_sha"
mv "$work/network.onnx" "$target"
echo "$target: \`sqslam run\` finds it by itself"
