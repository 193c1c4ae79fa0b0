#!/usr/bin/env bash
# bash docs/build.sh                  builds the documentation site in build/site; warnings are errors; installs its tools if they are absent;
#                                     runs notebooks and demos, and keeps their pictures and printed lines in build/ for the next time
# bash docs/build.sh --quick [DIR]    builds it in DIR without running notebooks or demos: notebooks have no outputs, pictures are the stored ones
set -uo pipefail
quick=
[ "${1:-}" != --quick ] || { shift; quick=1; }
[ -z "${1:-}" ] && site=build/site || site=$(realpath -m "$1") # from where it is called
docs=$(cd "$(dirname "${BASH_SOURCE[0]}")" && pwd)
. "$docs/../install/setup.sh"
bash "$docs/../install/site.sh" || exit
vi_setup
cd "$vi_root" || exit
options=(--builder html --conf-dir docs --fail-on-warning --keep-going --quiet --fresh-env) # what is read is read again: its warnings too
[ -z "$quick" ] || options+=(--define nb_execution_mode=off --tag quick)
if [ "$site" = build/site ] || [ ! -d "$site" ] || [ -z "$(ls -A "$site")" ] || [ -e "$site/.buildinfo" ]; then
  rm -rf "$site"
else
  vi_fail "$site holds what is no site: give a new or an empty folder"
fi
if ! .venv/site/bin/python -m sphinx "${options[@]}" --doctree-dir "$site.doctrees" . "$site"; then
  vi_fail "the site is not built: see the warnings above"
fi
echo '<!doctype html><title>vi_contact</title><meta http-equiv="refresh" content="0; url=docs/index.html">' >"$site/index.html"
if [ -z "$quick" ] && ! VI_CONTACT_FIGURES=$(realpath "$site")/_images \
  .venv/site/bin/python -m pytest -q -n 2 --dist loadfile docs/gallery; then
  vi_fail "the gallery prints other lines than its pages say: see above"
fi
if [ -z "$quick" ] && ! "$vi_python" docs/theory/figures.py --out "$site/_images" >/dev/null; then
  vi_fail "the figures of the theory pages are not made, or a page states another number: see above"
fi
pages=$(find "$site" -name '*.html' | wc -l)
echo "vi_contact: $site/index.html, $pages pages, $(du -sm "$site" | cut -f 1) MB, $SECONDS s, no warnings"
