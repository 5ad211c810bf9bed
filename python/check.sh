#!/usr/bin/env bash
# The Python package: installed into a fresh environment, its stubs, its tests and its notebook.
set -euo pipefail
cd "$(dirname "$0")/.."
python=${PYTHON:-python3}
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
"$python" -m venv "$folder/venv"
bin=$folder/venv/bin
"$bin/pip" install --quiet --disable-pip-version-check '.[test]'
# Not the sources beside this script: what was installed.
"$bin/python" -m mypy.stubtest gmlc._gmlc --ignore-missing-stub
"$bin/python" -m mypy python/python/gmlc
"$bin/python" -m pytest -q python/tests
"$bin/python" -m pytest -q --nbmake --nbmake-timeout=300 python/notebooks
