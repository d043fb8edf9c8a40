#!/bin/bash
# Runs every command of the programs on short inputs and counts the sanitizers' reports, also those of child processes.
# usage: scripts/sanitized-runs.sh FOLDER [SEQUENCE]...
#   FOLDER    build folder of sqslam and sqslam-viewer, such as build/asan
#   SEQUENCE  folders of further sequences with boxes, of which the first 80 frames are mapped and drawn
# With DETECTOR=FILE.yaml in the environment also those that need a network. Exits with 1 if there was a report or
# another exit code than expected. Logs, reports and outputs are left in FOLDER/runs.
set -euo pipefail
repository=$(cd "$(dirname "$0")/.." && pwd)
folder=$(realpath "$1")
work=$folder/runs
sequences=()
for sequence in "${@:2}"; do sequences+=("$(realpath "$sequence")"); done
"$repository/scripts/install-packages.sh" xvfb xauth
rm -rf "$work"
mkdir -p "$work/reports" "$work/home"
cd "$work"
export XDG_CONFIG_HOME=$work/home XDG_CACHE_HOME=$work/home XDG_STATE_HOME=$work/home XDG_DATA_HOME=$work/home
options=log_path=$work/reports/report
export ASAN_OPTIONS=$options:detect_stack_use_after_return=1:strict_string_checks=1
export UBSAN_OPTIONS=$options:print_stacktrace=1
export LSAN_OPTIONS=$options:print_suppressions=0:suppressions=$repository/scripts/leak-sanitizer.supp
number=0 wrong=0

try() {  # CODE COMMAND...: its output goes to a log
  local expected=$1 code=0 began=$SECONDS verdict=
  shift
  number=$((number + 1))
  "$@" >"$number.log" 2>&1 || code=$?
  if [ "$code" -ne "$expected" ]; then
    verdict="  EXIT CODE $code instead of $expected, see $number.log"
    wrong=$((wrong + 1))
  fi
  local said="${*//$repository\//}"
  printf '%3d  %4d s  %s%s\n' "$number" $((SECONDS - began)) "${said//$folder\//}" "$verdict"
}
q() {  # ARGUMENTS...: sqslam, which succeeds
  try 0 "$folder/bin/sqslam" "$@"
}
interrupt() {  # SECONDS ARGUMENTS...: by Ctrl-C
  try 130 timeout --preserve-status --signal=INT "$1" "$folder/bin/sqslam" "${@:2}"
}
# Keeps the OpenGL driver loaded until leaks are reported: the leaks of an unloaded driver have no names.
driver=/usr/lib/x86_64-linux-gnu/dri/swrast_dri.so
sanitizer=$(ldd "$folder/bin/sqslam-viewer" | awk '/libasan/ {print $3}')
window() {  # ARGUMENTS...: the viewer, with a script on standard input
  local script=$work/$((number + 1)).txt
  cat >"$script"
  LSAN_OPTIONS=${LSAN_OPTIONS/sanitizer.supp/sanitizer-viewer.supp} \
    try 0 xvfb-run -a -s '-screen 0 1280x900x24' env "LD_PRELOAD=${sanitizer:+$sanitizer:$driver}" \
    "$folder/bin/sqslam-viewer" "$@" --resolution 1200,800 --play-events "$script"
}

# Sequences: a desk, the same through a fisheye lens, a film, pictures.
scene=$repository/assets/scenes/desk.yaml
sed 's/fx: 525.0, fy: 525.0/fx: 320.0, fy: 320.0, distortion_model: fisheye/' "$scene" >fisheye.yaml
q synth "$scene" -o desk --frames 60 --supersampling 1 --noise
q synth fisheye.yaml -o fisheye --frames 30
q render --join 'desk/rgb/{frame:06}.jpg' -o film.mp4

# Maps.
short=(--no-render --frames 40)
q demo -o demo --frames 24
q run desk -o map --video map-growth.mp4 --dense --seed 3
for name in ellipsoid quadric cuboid; do q run desk -o "$name" --representation "$name"; done
q run desk -o single "${short[@]}" --representation quadric --quadric-init single-view
for name in iou iou+points iou+ttest nonparametric ensemble; do
  q run desk -o "with-$name" "${short[@]}" --association "$name"
done
q run desk -o paper "${short[@]}" --set objects.method=paper
q run desk -o deterministic "${short[@]}" --deterministic
q run desk -o realtime "${short[@]}" --realtime
q run desk -o live-dense --no-render --dense live
q run desk -o noisy "${short[@]}" --detections desk/boxes_exact.txt --ignore cup,book --stride 2
q run desk -o metres --no-render --scale-from tv=0.33
q run fisheye -o fisheye-map
q run film.mp4 -o film-map --resize 480 --camera auto --detector none
q run desk/rgb -o pictures --camera desk/camera.yaml --detections desk/boxes.txt --no-render
q run desk -o extended --extend deterministic --start 20 --no-render
# The same path forwards and backwards for over a minute.
mkdir laps && ln -s ../desk/rgb laps/rgb && cp desk/camera.yaml laps
tac desk/rgb.txt | cat desk/rgb.txt - | awk '/rgb\// {file[n++] = $2} END {
  for (i = 0; i < 20 * n; ++i) printf "%.6f %s\n", i / 30, file[i % n]}' >laps/rgb.txt
interrupt 30 run laps -o interrupted --realtime
q run --dump-config
q doctor desk -o doctor.json
q localize desk --map map -o localized --start 10 --stride 3
q run desk -o second --no-render --start 15
q merge map second -o merged
if [ -n "${DETECTOR:-}" ]; then
  q run film.mp4 -o detected --camera desk/camera.yaml --detector "$DETECTOR" --no-render
  for name in boxes yolo coco mot; do
    q detect desk --frames 5 --detector "$DETECTOR" --output-format "$name" -o "boxes.$name"
  done
  try 2 "$folder/bin/sqslam" detect desk --detector "$DETECTOR" --output-format csv -o boxes.csv
fi
q detect --check desk/boxes.txt desk
for sequence in "${sequences[@]}"; do
  name=$(basename "$sequence")
  q run "$sequence" -o "real-$name" --frames 80 --dense --video "$name.mp4"
  q render "real-$name" -o "$name-overlay.png" --camera-frame 60 --overlay
  q eval "real-$name" --ground-truth "$sequence"
done

# Products of a finished map.
q densify second
q densify second --set dense.scale=1 --threads 1
q eval map ellipsoid quadric cuboid --ground-truth desk -o table.tex
q eval map --dense --ground-truth desk
for name in tables.md tables.json; do q eval map --ground-truth desk --set alignment=poses -o "$name"; done
printf '{"format": "sqslam-edits", "version": 1, "objects": [{"id": 1, "name": "first", "label": "cup"},
  {"id": 2, "hidden": true}, {"id": 3, "merged_into": 4}, {"id": 5, "deleted": true}]}' >edits.json
q render map -o edited.png --edits edits.json --reliable-only
q export map -o edited.json --edits edits.json
q info map --history --reliable-only
q info map --config
q info "$repository/assets/vocabulary.bin"
for name in map.html map.glb map.obj map.ply map.json map.txt; do q export map -o "$name"; done
q export map -o meshes.ply --meshes --reliable-only
q export map -o surface.glb --surface
q export map -o truth.html --ground-truth auto
for name in colmap nerfstudio; do q export map -o "$name" --format "$name" --masks; done
q export fisheye-map -o fisheye-colmap --format colmap
q export map -o scene.xml --scale 2
for name in grid.npy plan.pgm; do q export map -o "$name"; done
q query map "largest objects next to the wall" --json --picture answer.png
q diff map map --json changes.json --picture changes.png --fail-on-change
q scale map
q scale second --distance 1 2 0.3
q scale second --none
for style in blueprint dark minimal paper; do q render map -o "$style.png" --style "$style" --view isometric; done
for look in solid glass outline; do q render map -o "$look.png" --set "objects.look=$look" --set objects.labels=true; done
q render map -o mesh.png --set dense_cloud.look=mesh --no-background --view top
q render map -o covisible.png --ground-truth auto --set covisibility.show=true --set clip.axis=z --at-frame 40
q render map -o photo.png --camera-frame 40 --photo
q render map -o overlay.png --camera-frame 40 --overlay
q render fisheye-map -o fisheye.png --camera-frame 20 --overlay
q render map -o again.png --view top --rendering-backend osmesa
try 0 "$folder/bin/sqslam" render map --view top --reference again.png --set text.legend=true
for path in still orbit follow first-person "$repository/configs/camera_paths/tour.yaml"; do
  q render map -o "$(basename "$path").mp4" --camera-path "$path" --seconds 1 --resolution 320,240
done
for piece in 1 2; do q render map -o pieces.mp4 --camera-path orbit --seconds 4 --resolution 640,240 --shard "$piece/2"; done
q render --join pieces.part-1-of-2.mp4 pieces.part-2-of-2.mp4 -o pieces.mp4
interrupt 3 render map -o interrupted.mp4 --camera-path orbit --seconds 60
q figure shapes -o shapes.pdf
for end in png svg pdf; do q figure compare map -o "compare.$end" --values; done
q figure maps map fisheye-map --name Desk --name Fisheye --boxes --labels -o maps.png --dpi 150
q figure trajectory map second --ground-truth desk --heights -o path.svg
q figure timing map second -o timing.pdf
q figure iou map ellipsoid --objects all -o iou.pdf
q figure outliers map -o outliers.pdf
q figure yaw map -o yaw.pdf

# Tools.
q fit map.ply --remove-plane --clusters auto -o fit.json -o fit.obj
q fit map.ply --upright -o fit.ply
for board in chessboard charuco; do q calibrate --print-board "$board.png" --board "$board"; done
q vocabulary desk -o vocabulary.bin --branching 4 --depth 3 --stride 10
printf 'output: experiment\nrepetitions: 1\nassociations: [full, iou]\nsequences:\n  - {name: desk, path: desk, frames: 30}\n' >two.yaml
q experiment two.yaml --jobs 2
q experiment two.yaml --dry-run

# The viewer: a live run, a replay with every panel, edits and annotations, an empty window; then all of that at random.
window run desk -o live --video live.mp4 <<<$'wait frame 20\nkey Space\nframes 10\nkey Space\nwait end\nwait idle\nclose'
window run desk -o closed --dense live <<<$'wait map\nframes 5\nclose'
{
  printf '%s\n' 'wait idle' 'key Home' 'wait idle' 'key End' 'wait idle'
  for panel in View Picture Inspector Annotate Objects; do printf 'click %s\nframes 5\nwait idle\n' "$panel"; done
  printf 'click %s\nframes 3\nwait idle\n' Objects 'cereal*' Inspector Annotate 'From cereal*' 'objects of the map' View
  for key in 1 3 7 9 0 F C X G P T I H M K R R F12; do printf 'key %s\nframes 4\nwait idle\n' "$key"; done
  printf 'keydown Control\nkey Z\nkey Y\nkey S\nkeyup Control\nframes 5\npicture window.png\nresize 0 0\nframes 3\nclose\n'
} >replay.txt
window map --ground-truth auto --dense-cloud second/dense.ply --timing <replay.txt
window <<<$'frames 5\ndrop map\nwait idle\ndrop second/dense.ply\nframes 5\nwait idle\nclose'
try 0 env -u ASAN_OPTIONS -u UBSAN_OPTIONS "$repository/scripts/viewer-endurance.py" map --minutes 3 --viewer "$folder/bin/sqslam-viewer"

reports=$(find reports -type f | wc -l)
echo "$number commands, $wrong with another exit code than expected, $reports reports"
[ "$reports" -eq 0 ] || grep -h -E 'ERROR: |SUMMARY|runtime error' reports/* | cut -c -160 | sort | uniq -c
[ "$wrong" -eq 0 ] && [ "$reports" -eq 0 ]
