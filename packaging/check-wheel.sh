#!/bin/sh
# Checks the wheel of a release: installs it into a clean environment and runs the package's tests there.
#
#     packaging/check-wheel.sh FOLDER [PYTHON]
#
# pip chooses among the wheels in FOLDER the one that fits the machine; none that fits is a failure. Dependencies come from
# the package index.
set -eu
wheels=$1
python=${2:-python3}

folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
root=$(CDPATH='' cd -- "$(dirname -- "$0")/.." && pwd)
"$python" -m venv "$folder/environment"
if [ -d "$folder/environment/Scripts" ]; then
    python=$folder/environment/Scripts/python
else
    python=$folder/environment/bin/python
fi
# First without an index: the package itself must come from the folder, and as a wheel.
"$python" -m pip install --quiet --no-index --no-deps --only-binary :all: --find-links "$wheels" alhazen-render
"$python" -m pip install --quiet "alhazen-render[test]" --find-links "$wheels" --only-binary alhazen-render
cd "$folder"
"$python" -m pytest --quiet -p no:cacheprovider --rootdir "$root/crates/python" "$root/crates/python/tests"
