#!/bin/bash
# Installs into a tree, moves it, builds docs/examples against it and looks at what they do.
# usage: examples.sh BUILD SOURCES FOLDER DESK COMPILER FLAGS
set -euo pipefail
build=$1 sources=$2 folder=$3 desk=$4 compiler=$5 flags=$6
fail() {
  echo "examples.sh: $*" >&2
  exit 1
}

rm -rf "$folder"
for part in sqslam libsqslam-dev; do
  cmake --install "$build" --prefix "$folder/first" --component "$part" >/dev/null
done
tree=$folder/moved
mv "$folder/first" "$tree"
! grep -rlF -e "$sources" -e "$folder" "$tree"/lib*/cmake "$tree/include" || fail "these name folders of this machine"

cmake -S "$tree/share/doc/libsqslam-dev/examples" -B "$folder/build" -G Ninja --log-level=WARNING \
  -DCMAKE_PREFIX_PATH="$tree" -DCMAKE_CXX_COMPILER="$compiler" -DCMAKE_CXX_FLAGS="$flags"
cmake --build "$folder/build"
cd "$folder/build"
export DISPLAY=

./map_video "$desk/desk" mapped >objects
grep -q '^40 of 40 frames' objects || fail "map_video: $(cat objects)"
grep -q ' cereal_box at .* exponents ' objects || fail "map_video: $(cat objects)"
cmp mapped/objects.json "$desk/result/objects.json"  # as the program does it

./draw_map "$desk/result" picture.png
"$tree/bin/sqslam" render "$desk/result" --style blueprint --view isometric --resolution 640,480 \
  --reference picture.png --reference-threshold 0.0001

./own_detector "$desk/desk" colored >boxes
grep -qE '^boxes by strong colours: [1-9]' boxes || fail "own_detector: $(cat boxes)"
grep -q '^# boxes of .*strong colours' colored/boxes.txt || fail "own_detector: $(head -1 colored/boxes.txt)"

# A box of 0.4 x 0.2 x 0.6.
awk 'BEGIN { for (i = -10; i <= 10; ++i) for (j = -10; j <= 10; ++j) {
  a = i / 10; b = j / 10
  for (s = -1; s <= 1; s += 2) { print 0.2 * s, 0.1 * a, 0.3 * b; print 0.2 * a, 0.1 * s, 0.3 * b; print 0.2 * a, 0.1 * b, 0.3 * s } } }' >box.xyz
./fit_cloud box.xyz >fit
awk 'function near(a, b) { return a > 0.95 * b && a < 1.05 * b }
  /half size/ { gsub(",", ""); found = near($5, 0.3) && (near($3, 0.2) && near($4, 0.1) || near($3, 0.1) && near($4, 0.2)) }
  /overlap by/ { alike = $NF > 0.95 }
  END { exit !(found && alike) }' fit || fail "fit_cloud: $(cat fit)"
