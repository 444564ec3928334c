#!/bin/sh
# Checks an archive of a release as a user would: unpacks it, runs the program, renders a picture.
#
#     packaging/check-archive.sh alhazen-1.2.3-linux-x86_64.tar.gz 1.2.3
#
# Needs tar with gzip, or unzip for archives of Windows; no Rust, no display, no GPU.
set -eu
archive=$1
version=$2

folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
case $archive in
    *.zip) unzip -q "$archive" -d "$folder" ;;
    *) tar -xzf "$archive" -C "$folder" ;;
esac
tree=$(echo "$folder"/alhazen-"$version"-*)
if [ -f "$tree/alhazen.exe" ]; then
    program=$tree/alhazen.exe
    documents=$tree
    others="completions/_alhazen.ps1"
else
    program=$tree/bin/alhazen
    documents=$tree/share/doc/alhazen
    others="share/man/man1/alhazen.1 share/man/man1/alhazen-render.1
        share/bash-completion/completions/alhazen share/zsh/site-functions/_alhazen
        share/fish/vendor_completions.d/alhazen.fish"
fi

for file in $others; do
    [ -s "$tree/$file" ] || { echo "$file is missing or empty" >&2; exit 1; }
done
for file in README.md LICENSE-MIT LICENSE-APACHE THIRD-PARTY-LICENSES.txt; do
    [ -s "$documents/$file" ] || { echo "$file is missing or empty" >&2; exit 1; }
done

found=$("$program" --version | tr -d '\r')
[ "$found" = "alhazen $version" ] || { echo "--version prints \"$found\"" >&2; exit 1; }
"$program" doctor
"$program" scenes >/dev/null
picture=$folder/cornell.png
"$program" render cornell --backend cpu --width 64 --height 64 --spp 4 --quiet --output "$picture"
[ "$(head -c 4 "$picture" | tail -c 3)" = PNG ] || { echo "no picture" >&2; exit 1; }
echo "$archive works"
