#!/usr/bin/env bash
# bash tests/lint.sh     runs ruff, codespell, import-linter and mypy in the versions of install/lint-requirements.txt, from PyPI, in .venv/lint
set -uo pipefail
tests=$(cd "$(dirname "${BASH_SOURCE[0]}")" && pwd)
. "$tests/../install/setup.sh"
vi_setup
cd "$vi_root" || exit 1
unset PYTHONPATH  # the checkers read files: they import nothing of ours

# numpy only for its types: the oldest we support, on every release the same, never imported (hence the foreign version)
numpy="--only-binary=:all: --no-deps --python-version 3.11 numpy==1.24.2"

venv=.venv/lint
wanted="$(cat install/lint-requirements.txt) $numpy"
install_checkers() {
  "$vi_python" -m venv --clear $venv &&
    $venv/bin/pip install -r install/lint-requirements.txt &&
    $venv/bin/pip install --target $venv/lib/python3*/site-packages $numpy
}
if [ "$(cat $venv/installed 2>/dev/null)" != "$wanted" ] || ! $venv/bin/python -c "" 2>/dev/null; then
  echo "vi_contact: installing the checkers into $venv. This is done once." >&2
  said=$(install_checkers 2>&1) || vi_fail "could not install the checkers (offline?): $(tail -n 1 <<<"$said")"
  echo "$wanted" >$venv/installed
fi

status=0
$venv/bin/ruff check --quiet --output-format concise . || status=1
$venv/bin/ruff format --quiet --check . || status=1
$venv/bin/codespell || status=1
said=$($venv/bin/lint-imports 2>&1) || { echo "$said"; status=1; }
$venv/bin/mypy --no-error-summary || status=1
exit "$status"
