#!/usr/bin/env bash
# bash install/report.sh              installs jinja2 and plotly, which write reports for browsers, into .venv/report of this clone;
#                                     then run .venv/report/bin/python -m vi_contact report DIR
# bash install/report.sh --browser    also installs Chromium, in which tests/plots/test_browser.py opens a report
set -uo pipefail
. "$(dirname "${BASH_SOURCE[0]}")/setup.sh"
vi_clean_environment
packages=$vi_root/.venv/report
wanted=(jinja2 "plotly>=5.13")
if ! "$packages/bin/python" -c 'import jinja2, plotly' 2>/dev/null; then
  rm -rf "$packages"
  "$vi_python" -m venv --system-site-packages "$packages" >/dev/null || vi_fail "no virtual environment: install python3-venv"
  said=$("$packages/bin/pip" install --quiet --disable-pip-version-check "${wanted[@]}" 2>&1) ||
    vi_fail "could not install ${wanted[*]}: $(tail -n 1 <<<"$said")"
fi
if [ "${1:-}" = --browser ] && ! command -v chromium >/dev/null; then
  vi_apt update >/dev/null
  said=$(vi_apt install -y --no-install-recommends chromium) || vi_fail "could not install chromium: $(tail -n 1 <<<"$said")"
fi
