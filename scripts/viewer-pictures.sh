#!/bin/bash
# Draws README's picture of the viewer under Xvfb, into assets/pictures. Look at it before committing.
# usage: scripts/viewer-pictures.sh [RESULT] [PRESET]; without RESULT the demo's map, made anew
set -eu
cd "$(dirname "$0")/.."
bin=$PWD/build/${2:-release}/bin
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
result=${1:-}
if [ -z "$result" ]; then
  "$bin/sqslam" demo --output "$work/demo" --quiet
  result=$(dirname "$(find "$work/demo" -name map.sqmap | head -n 1)")
fi
cat > "$work/events.txt" <<EOF
wait idle
key Left
key Left
key Left
wait idle
move 420 400
frames 2
press left
release left
frames 3
move 640 640
wait idle
picture $work/viewer.png
close
EOF
xvfb-run -a -s "-screen 0 1600x1000x24" \
  "$bin/sqslam-viewer" "$result" --resolution 1440,900 --play-events "$work/events.txt"
mkdir -p assets/pictures
mv "$work/viewer.png" assets/pictures/
ls -l assets/pictures/viewer.png
