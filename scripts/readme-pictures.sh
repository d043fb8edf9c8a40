#!/bin/bash
# Draws README's pictures of maps to assets/pictures. Look at them before committing.
# usage: scripts/readme-pictures.sh [DEMO [KITCHEN]]
#   DEMO     output of `sqslam demo --output DEMO`; default: run the demo
#   KITCHEN  result of 7-Scenes redkitchen; default: keep the old picture
set -eu
demo=${1:+$(realpath -m "$1")}  # before the change of folder
kitchen=${2:+$(realpath -m "$2")}
cd "$(dirname "$0")/.."
scripts/install-packages.sh ffmpeg gifsicle pngquant python3
sqslam=$PWD/build/release/bin/sqslam
pictures=$PWD/assets/pictures
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
if [ -z "$demo" ]; then
  demo=$work/demo
  "$sqslam" demo --output "$demo" --deterministic --no-video --quiet
fi

# The growing map, close to the objects, in the time of the recording; the last picture is held for two seconds.
objects=$(python3 -c 'import json, sys
centers = [o["center"] for o in json.load(open(sys.argv[1]))["objects"]]
print(",".join(f"{sum(axis) / len(axis):.2f}" for axis in zip(*centers)))' "$demo/result/objects.json")
"$sqslam" render "$demo/result" --growth --output "$work/growth/{frame:04}.png" --fps 6 --resolution 960,400 --quiet \
  --camera-focal-point "$objects" --camera-zoom-factor 1.5
ffmpeg -loglevel error -framerate 6 -i "$work/growth/%04d.png" -vf "tpad=stop_mode=clone:stop_duration=2,
  split[a][b];[a]palettegen=max_colors=144[p];[b][p]paletteuse=dither=bayer:bayer_scale=4:diff_mode=rectangle" \
  "$work/growth.gif"
gifsicle -O3 --lossy=120 "$work/growth.gif" --output "$pictures/growth.gif"

picture() {  # NAME RESULT OPTIONS...
  local name=$1 result=$2
  shift 2
  "$sqslam" render "$result" --output "$work/$name.png" --quiet "$@"
  pngquant --force --speed 1 --nofs --output "$pictures/$name.png" 256 "$work/$name.png"
}
picture overlay "$demo/result" --camera-frame 120 --overlay --set overlay.fill=0.3
# The sparse map, as shown for a result without a dense cloud.
picture blueprint "$demo/result" --resolution 800,520 --style blueprint --view isometric --set dense_cloud.show=false
[ -z "$kitchen" ] || picture kitchen "$kitchen" --resolution 1280,720 --reliable-only --set objects.labels=true \
  --camera-azimuth-angle -12 --camera-elevation-angle -6 --camera-zoom-factor 1.12 --set cameras.keyframes=false \
  --set cameras.current=false --set dense_cloud.detail=1

"$sqslam" figure compare "$demo/result" --output "$work/compare.png" --dpi 150
pngquant --force --speed 1 --nofs --output "$pictures/compare.png" 256 "$work/compare.png"
ls -l "$pictures"
