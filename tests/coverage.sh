#!/usr/bin/env bash
# bash tests/coverage.sh [TESTS…]     runs tests, or the quick ones, and prints the lines changed since the last tag that they do not run
set -uo pipefail
. "$(dirname "${BASH_SOURCE[0]}")/../install/setup.sh"
vi_setup
cd "$vi_root" || exit 1
tools=$vi_root/.venv/lint
[ -x "$tools/bin/diff-cover" ] || vi_fail "coverage and diff-cover are missing: bash tests/lint.sh brings them"
mkdir -p build/tracer
# Debian's Python runs the tests, since it has DOLFINx. Of the tools it sees coverage alone.
ln -sfn "$(echo "$tools"/lib/python3*/site-packages/coverage)" build/tracer/coverage
export PYTHONPATH=$vi_root:$vi_root/build/tracer COVERAGE_FILE=build/coverage PETSC_OPTIONS=-no_signal_handler
[ $# -gt 0 ] || set -- -m "not slow" --ignore tests/validation
"$vi_python" -m coverage run --source vi_contact -m pytest -q "$@"
"$vi_python" -m coverage xml --quiet -o build/coverage.xml
"$tools/bin/diff-cover" build/coverage.xml --compare-branch "$(git describe --tags --abbrev=0)"
