#!/usr/bin/env bash
# bash docs/test.sh                   runs the snippets and commands of the pages, which must print what the pages say, and the notebooks;
#                                     builds the site and opens pages of it in Chromium, if bash install/site.sh --browser brought one.
#                                     bash docs/build.sh runs the pages of the gallery, which take minutes
# bash docs/test.sh docs/guide/soil.md …   runs these pages, with any arguments of pytest
set -uo pipefail
. "$(dirname "${BASH_SOURCE[0]}")/../install/setup.sh"
bash "$vi_root/install/site.sh" || exit
vi_setup
cd "$vi_root" || exit
pages=
for argument; do [ ! -e "${argument%%::*}" ] || pages=1; done
[ -n "$pages" ] || set -- docs --ignore docs/gallery "$@"
exec .venv/site/bin/python -m pytest -q -n 2 --dist loadfile "$@" </dev/null
