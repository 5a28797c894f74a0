#!/usr/bin/env bash
# tools/trial.sh BUILT ENVIRONMENT: what was installed there runs, brings its data files along, and names its commit.
set -euo pipefail
built=$1 environment=$(realpath "$2")

folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
cd "$folder"   # not the checkout: nothing must come from there

run() { "$environment/bin/$@" >said || { cat said; echo "$built: failed: $*" >&2; exit 1; }; }
run hil --version
run hil effects backlash
run hil rig new rig.toml --simulated --yes
run hil check --eds "$("$environment/bin/python" -I -c 'from drivers.resources import data_file; print(data_file("inverter.eds"))')"
run hil export st --adaptive --out estimator.st
run python -I -c 'from hil.version import program; print(program())'
grep -q '([0-9a-f]\{12\}' said || { echo "$built: expected a commit, got: $(cat said)" >&2; exit 1; }
echo "$built: $(cat said)"
