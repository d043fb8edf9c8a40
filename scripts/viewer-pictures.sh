#!/bin/bash
# Draws README's pictures of the viewer to assets/pictures, under Xvfb: the bundled desk, while it is mapped and
# afterwards. Look at them before committing.
# usage: scripts/viewer-pictures.sh [PRESET [DEMO]]; DEMO: output of `sqslam demo --output DEMO`; default: run the demo
set -eu
demo=${2:+$(realpath -m "$2")}  # before the change of folder
cd "$(dirname "$0")/.."
scripts/install-packages.sh xvfb xauth pngquant
bin=$PWD/build/${1:-release}/bin
pictures=$PWD/assets/pictures
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
if [ -z "$demo" ]; then
  demo=$work/demo
  "$bin/sqslam" demo --output "$demo" --no-video --quiet
fi
mkdir -p "$pictures"

click() {  # LABEL...: of tabs, buttons, rows of a table
  printf 'click %s\n' "$@"
}
zoom() {  # NOTCHES X Y: to a place in the scene
  printf 'move %s %s\nwheel 0 %s\nframes 2\n' "$2" "$3" "$1"
}
# Plays the script from standard input and saves the window as a picture with a palette.
play() {  # NAME ARGUMENTS...
  local name=$1
  shift
  { cat; printf 'picture %s.png\nclose\n' "$work/$name"; } >"$work/$name.txt"
  xvfb-run -a -s "-screen 0 1600x1000x24" \
    "$bin/sqslam-viewer" "$@" --resolution 1280,900 --play-events "$work/$name.txt"
  pngquant --force --speed 1 --nofs --output "$pictures/viewer-$name.png" 256 "$work/$name.png"
}
# A click on the time axis, a little after the middle of the run.
later='wait idle
point 700 0 tracked points
press left
release left
wait idle'
# Moves the mouse to an empty place and waits until messages disappear.
finish='point 500 -32 tracked points
frames 360
wait idle'

# Plays slowly, so that a busy computer does not miss the middle; pauses, so that the view is rendered in full quality.
play live run "$demo/desk" --output "$work/live" <<EOF
wait frame 1
key Space
$(click 'full speed' '5 frames/s')
key Space
wait frame 90
key Space
point 500 -32 tracked points
frames 40
EOF

play replay "$demo/result" <<EOF
$later
$(click View)
key I
key P
key G
$(zoom 2 340 520)
$finish
EOF

play inspector "$demo/result" <<EOF
wait idle
$(click Objects 'microwave*' Inspector)
key I
$(zoom 3 350 420)
$finish
EOF

# Adds solids in place of six objects and hides the objects.
play annotation "$demo/result" <<EOF
$later
$(for object in tv cereal keyboard book bowl toaster; do
  click Objects "$object*" Annotate "From $object*"
done)
$(click 'objects of the map' View 'camera path' keyframes 'present camera' legend Annotate)
$(zoom 4 400 420)
$finish
EOF
ls -l "$pictures"/viewer-*.png
