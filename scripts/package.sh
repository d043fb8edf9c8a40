#!/bin/bash
# Builds the packages sqslam, sqslam-viewer, libsqslam-dev and python3-sqslam (NAME_VERSION_amd64.deb) in build/release,
# with man pages made from the help texts, and completion for bash and zsh. Install with:
# apt install ./build/release/sqslam_*.deb
set -euo pipefail
cd "$(dirname "$0")/.."

scripts/install-packages.sh help2man dpkg-dev fakeroot file python3 python3-dev pybind11-dev
scripts/build.sh programs
folder=build/release/package
program=build/release/bin/sqslam
version=$("$program" --version | sed -n '1s/.* //p')
rm -rf "$folder"

# usage: man_page PACKAGE NAME WHAT PROGRAM [COMMAND]...
man_page() {
  local part=$1 name=$2 what=$3
  shift 3
  mkdir -p "$folder/$part/man/man1" "$folder/run"
  # help2man needs a single program: make a script of this name that calls the command.
  set -- "$PWD/$1" "${@:2}"
  printf '#!/bin/bash\nexec %s "$@"\n' "${*@Q}" >"$folder/run/$name"
  chmod +x "$folder/run/$name"
  COLUMNS=80 help2man --no-info --version-string "$version" --name "$what" --manual "sqslam" --source "sqslam $version" \
    "$folder/run/$name" | gzip -9n >"$folder/$part/man/man1/$name.1.gz"
}

mkdir -p "$folder/sqslam"
commands=$("$program" --help | sed -n '/^General:/q; s/^  \([a-z]*\)  .*/\1/p')
man_page sqslam sqslam "object maps of image sequences" "$program"
for command in $commands; do
  man_page sqslam "sqslam-$command" "$("$program" "$command" --help | head -1 | tr '\n' ' ')" "$program" "$command"
done
man_page sqslam-viewer sqslam-viewer "looks at object maps" build/release/bin/sqslam-viewer
scripts/make-completion.py "$program" "$folder/sqslam"
for part in sqslam sqslam-viewer libsqslam-dev python3-sqslam; do
  mkdir -p "$folder/$part/doc/$part"
  {
    printf '%s (%s) stable; urgency=low\n\n  * docs/changes.md tells what is new.\n\n' "$part" "$version"
    printf ' -- the sqslam authors <maintainers@sqslam.example>  %s\n' "$(git log -1 --format=%cD 2>/dev/null || date -R)"
  } | gzip -9n >"$folder/$part/doc/$part/changelog.gz"
done

(cd build/release && cpack -G DEB)
