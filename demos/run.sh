#!/usr/bin/env bash
# bash demos/run.sh [-n RANKS] NAME [arguments of the demo…]     runs demos/NAME.py, and installs missing packages on Debian
set -euo pipefail
demos=$(cd "$(dirname "${BASH_SOURCE[0]}")" && pwd)
. "$demos/../install/setup.sh"

launch=()
if [ "${1:-}" = -n ]; then launch=("${vi_ranks[@]}" "${2:?number of ranks}"); shift 2; fi
name=${1:-}
if [ -z "$name" ] || [ ! -f "$demos/$name.py" ]; then
  echo "vi_contact: ${name:+no demo \"$name\"; }choose one of:" $(cd "$demos" && ls ./*.py 2>/dev/null | sed 's|^\./||; s|\.py$||') >&2
  exit 2
fi
shift
vi_setup
exec "${launch[@]}" "$vi_python" "$demos/$name.py" "$@"
