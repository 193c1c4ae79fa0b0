#!/usr/bin/env bash
# bash tests/lint.sh     ruff and mypy, in the versions of pyproject.toml's extra "lint", from PyPI into .venv
set -uo pipefail
tests=$(cd "$(dirname "${BASH_SOURCE[0]}")" && pwd)
. "$tests/../install/setup.sh"
vi_setup
cd "$vi_root" || exit 1
unset PYTHONPATH  # the checkers read files: they import nothing of ours

wanted=$("$vi_python" -c 'import tomllib
print(*tomllib.load(open("pyproject.toml", "rb"))["project"]["optional-dependencies"]["lint"])')
if [ "$(cat .venv/.lint 2>/dev/null)" != "$wanted" ] || ! .venv/bin/python -c "" 2>/dev/null; then
  echo "vi_contact: installing $wanted into .venv (once)…" >&2
  said=$({ .venv/bin/python -c "" 2>/dev/null || "$vi_python" -m venv --clear --system-site-packages .venv; } 2>&1 &&
    .venv/bin/python -m pip install -q $wanted 2>&1) || vi_fail "could not install $wanted (offline?): $(tail -n 1 <<<"$said")"
  echo "$wanted" >.venv/.lint
fi

status=0
.venv/bin/python -m ruff check --quiet . || status=1
.venv/bin/python -m mypy --no-error-summary || status=1
exit "$status"
