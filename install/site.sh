#!/usr/bin/env bash
# bash install/site.sh                installs Sphinx and the packages of install/site-requirements.txt into .venv/site of this clone;
#                                     then run bash docs/build.sh
# bash install/site.sh --browser      also installs Chromium, in which docs/test_site.py opens pages
set -uo pipefail
. "$(dirname "${BASH_SOURCE[0]}")/setup.sh"
vi_clean_environment
site=$vi_root/.venv/site
wanted=$vi_root/install/site-requirements.txt
if ! cmp -s "$wanted" "$site/installed" || ! "$site/bin/python" -c 'import furo, myst_nb' 2>/dev/null; then
  rm -rf "$site"
  said=$("$vi_python" -m venv --system-site-packages "$site" 2>&1) ||
    vi_fail "no virtual environment in .venv/site (is python3-venv installed?): $(tail -n 1 <<<"$said")"
  echo "vi_contact: installing the tools of the documentation site into .venv/site. This is done once." >&2
  said=$("$site/bin/pip" install --quiet --disable-pip-version-check --requirement "$wanted" 2>&1) ||
    vi_fail "could not install the tools of the site (offline?): $(tail -n 1 <<<"$said")"
  cp "$wanted" "$site/installed"
fi
if [ "${1:-}" = --browser ] && ! command -v chromium >/dev/null; then
  vi_apt update >/dev/null
  said=$(vi_apt install -y --no-install-recommends chromium) || vi_fail "could not install chromium: $(tail -n 1 <<<"$said")"
fi
