#!/bin/bash
# Renders the beginning of the desk into FOLDER/desk and maps it into FOLDER/result.
# usage: desk.sh PROGRAM SOURCES FOLDER
set -euo pipefail
program=$1 sources=$2 folder=$3

rm -rf "$folder"
"$program" synth "$sources/assets/scenes/desk.yaml" --output "$folder/desk" --frames 40 --supersampling 1 --quiet
"$program" run "$folder/desk" --output "$folder/result" --deterministic --no-render --quiet
