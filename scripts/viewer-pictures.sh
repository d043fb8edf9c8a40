#!/bin/bash
# Draws README's pictures of the viewer to assets/pictures, under Xvfb: the bundled desk, while it is mapped and
# afterwards. Look at them before committing.
# usage: scripts/viewer-pictures.sh [PRESET [DEMO]]; DEMO: output of `sqslam demo --output DEMO`; default: run the demo
set -eu
cd "$(dirname "$0")/.."
scripts/install-packages.sh xvfb xauth pngquant
bin=$PWD/build/${1:-release}/bin
demo=${2:-}
pictures=$PWD/assets/pictures
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
if [ -z "$demo" ]; then
  demo=$work/demo
  "$bin/sqslam" demo --output "$demo" --no-video --quiet
fi
mkdir -p "$pictures"

click() {  # X Y, pixels of the window
  printf 'move %s %s\nframes 2\npress left\nrelease left\nframes 3\n' "$1" "$2"
}
drag() {  # X Y to X Y
  printf 'move %s %s\nframes 2\npress left\nframes 1\nmove %s %s\nframes 2\nrelease left\nframes 3\n' "$@"
}
# Plays the script from standard input and saves the window as a picture with a palette.
play() {  # NAME ARGUMENTS...
  local name=$1
  shift
  { cat; printf 'picture %s.png\nclose\n' "$work/$name"; } >"$work/$name.txt"
  xvfb-run -a -s "-screen 0 1600x1000x24" \
    "$bin/sqslam-viewer" "$@" --resolution 1440,900 --play-events "$work/$name.txt"
  pngquant --force --speed 1 --nofs --output "$pictures/viewer-$name.png" 256 "$work/$name.png"
}
finish='move 640 720
frames 360
wait idle'  # until messages are gone

# Paused half way, so that the view is rendered in full quality.
play live run "$demo/desk" --output "$work/live" <<EOF
wait frame 90
key Space
move 60 420
wheel 0 -1
frames 2
move 640 720
frames 20
EOF

play replay "$demo/result" <<EOF
wait idle
$(click 800 830)
wait idle
key P
key G
$(drag 1200 299 1200 200)
$(click 1205 225)
$finish
EOF

play inspector "$demo/result" <<EOF
wait idle
key I
$(click 534 508)
$(click 1137 47)
$finish
EOF

# Solids in place of four objects, then without these.
play annotation "$demo/result" <<EOF
wait idle
$(drag 1017 500 897 500)
$(drag 1200 299 1200 379)
wait idle
$(click 1152 404)
$(click 278 345)
$(click 1160 565)
$(click 327 462)
$(click 1160 565)
$(click 472 505)
$(click 1160 565)
$(click 589 544)
$(click 1160 565)
$(click 924 596)
$(drag 1200 379 1200 335)
$finish
EOF
ls -l "$pictures"/viewer-*.png
