#!/bin/bash
# Retrains assets/vocabulary.bin on photographs in Debian packages and on rendered scenes (assets/README.md lists them
# with their licences). Takes a quarter of an hour, 500 MB below WORK and a network connection.
# usage: scripts/train-vocabulary.sh [WORK [OUTPUT]]
set -euo pipefail
work=${1:+$(realpath -m "$1")}  # before the change of folder
output=${2:+$(realpath -m "$2")}
cd "$(dirname "$0")/.."

work=${work:-out/vocabulary}
output=${output:-assets/vocabulary.bin}
sqslam=$PWD/build/release/bin/sqslam
packages=(gnome-backgrounds lomiri-wallpapers-16.04 lomiri-wallpapers-20.04 mate-backgrounds opencv-doc
          plasma-workspace-wallpapers python3-skimage ukui-wallpapers)
mkdir -p "$work"
work=$(cd "$work" && pwd)

# Photographs: a folder of links with descriptive names, without previews of drawings and test patterns.
if [ ! -d "$work/photographs" ]; then
  rm -rf "$work/photographs.part"  # of an interrupted run
  mkdir -p "$work/debs" "$work/unpacked" "$work/photographs.part"
  (cd "$work/debs" && apt-get download "${packages[@]}")
  for deb in "$work"/debs/*.deb; do
    package=$(basename "${deb%%_*}")
    dpkg-deb -x "$deb" "$work/unpacked/$package"
    find "$work/unpacked/$package" -type f -size +40k \
         \( -iname '*.jpg' -o -iname '*.jpeg' -o -iname '*.png' -o -iname '*.webp' \) \
         ! -name 'screenshot*' ! -path '*/images_dark/*' ! -path '*/html/*' ! -path '*/tests/*' \
         ! -iname '*chessboard*' ! -iname '*gradient*' ! -iname '*trimap*' ! -iname '*segmented*' \
         ! -iname '*GT.png' |
      sort | while read -r image; do
        above=$(basename "$(dirname "$(dirname "$(dirname "$image")")")")
        ln -s "$image" "$work/photographs.part/$package-$above-$(basename "$image")"
      done
  done
  mv "$work/photographs.part" "$work/photographs"
fi

# Rendered scenes: the desk along its own path and on a tour of the room, with four sets of textures.
cat >"$work/tour.txt" <<END
    - {position: [0.9, -1.7, 1.5], look_at: [-0.8, 1.2, 1.2]}
    - {position: [0.2, -2.2, 1.4], look_at: [0.8, 1.2, 1.4]}
    - {position: [-0.6, -1.9, 1.6], look_at: [2.5, -0.2, 1.2]}
    - {position: [-1.2, -1.2, 1.5], look_at: [2.5, -1.4, 1.1]}
    - {position: [-0.4, -1.0, 1.7], look_at: [1.2, -3.0, 1.2]}
    - {position: [0.9, -1.0, 1.6], look_at: [-2.5, -2.0, 1.1]}
    - {position: [1.5, -0.8, 1.4], look_at: [-2.5, 0.5, 1.1]}
    - {position: [1.0, -0.7, 1.1], look_at: [-0.4, 0.2, 0.8]}
    - {position: [0.3, -0.8, 1.0], look_at: [0.3, 1.1, 1.2]}
    - {position: [-0.5, -0.7, 1.1], look_at: [0.4, 0.2, 0.8]}
END
mkdir -p "$work/rendered"
for textures in 1 2 3 4; do
  sed -E "s/seed: ([0-9]+)/seed: ${textures}0\1/; s/^frames: .*/frames: 24/" assets/scenes/desk.yaml \
    >"$work/desk$textures.yaml"
  sed '/^  waypoints:/,/^$/{/^  waypoints:/!d}' "$work/desk$textures.yaml" |
    sed "/^  waypoints:/r $work/tour.txt" >"$work/tour$textures.yaml"
  for path in desk tour; do
    [ -d "$work/rendered/$path$textures" ] ||
      "$sqslam" synth "$work/$path$textures.yaml" --output "$work/rendered/$path$textures"
  done
done

"$sqslam" vocabulary "$work/photographs" "$work"/rendered/* --views 12 --output "$output"
