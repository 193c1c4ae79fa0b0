#!/usr/bin/env bash
# bash benchmarks/peers/run.sh                  runs all peers, one after the other, and prints one table
# bash benchmarks/peers/run.sh NAME…            runs these peers (peer_NAME.py of this folder)
# bash benchmarks/peers/run.sh --json FILE …    also stores the rows with versions, date and machine
# bash benchmarks/peers/run.sh --together …     runs all at once: the times are processor times
#
# Installs each program first: from Debian with apt, or from PyPI into its own virtual environment .venv/peers/NAME of this clone, which
# sees the system's packages. A program that cannot be installed becomes a row that says why. All run on one thread.
set -uo pipefail
. "$(dirname "${BASH_SOURCE[0]}")/../../install/setup.sh"
vi_setup
folder=$vi_root/benchmarks/peers
# Else the modules of a clone are compiled anew in every row, and those of an installed program not.
unset PYTHONDONTWRITEBYTECODE
export PYTHONPATH=$vi_root PETSC_OPTIONS=-no_signal_handler NUMBA_NUM_THREADS=1 NGS_NUM_THREADS=1
json= together=
while [ $# -gt 0 ]; do
  case $1 in
    --json) json=$2; shift 2 ;;
    --together) together=yes; shift ;;
    *) break ;;
  esac
done
rows=$(mktemp -d)
trap 'rm -rf "$rows"' EXIT

asked() { "$vi_python" -c 'import sys; sys.path.insert(0, sys.argv[1]); import compare as c
words = c.words_of(sys.argv[2]); print(*words["INSTALL"].get(sys.argv[3], []))' "$folder" "$1" "$2"; }

cannot() { "$vi_python" - "$folder" "$1" "$2" "$rows/$1.json" <<'END'
import json, sys
sys.path.insert(0, sys.argv[1])
import compare as c
name, said, file = sys.argv[2:]
rows = [{"peer": c.words_of(name)["TITLE"], "name": name, "problem": one, "failed": "not installed: " + c.reason(said)} for one in c.PROBLEMS]
open(file, "w").write(json.dumps({"rows": rows}))
END
}

peer() {
  local name=$1 python=$vi_python apt pip said one
  apt=$(asked "$name" apt) pip=$(asked "$name" pip)
  for one in $apt; do
    dpkg-query -W -f '${db:Status-Status}' "$one" 2>/dev/null | grep -qx installed && continue
    said=$(vi_apt install -y --no-install-recommends "$one") || { cannot "$name" "$(grep -m1 '^E:' <<<"$said" || tail -n 1 <<<"$said")"; return; }
  done
  if [ -n "$pip" ]; then
    python=$vi_root/.venv/peers/$name/bin/python
    [ -x "$python" ] || "$vi_python" -m venv --system-site-packages "$vi_root/.venv/peers/$name" >/dev/null || { cannot "$name" "no virtual environment"; return; }
    said=$("$python" -m pip install --quiet --disable-pip-version-check $pip 2>&1) ||
      { cannot "$name" "$(grep -m1 '^ERROR' <<<"$said" || tail -n 1 <<<"$said")"; return; }
  fi
  "$python" "$folder/compare.py" "$name" --json "$rows/$name.json" >/dev/null || cannot "$name" "compare.py failed"
}

[ $# -gt 0 ] || set -- $("$vi_python" -c 'import sys; sys.path.insert(0, sys.argv[1]); import compare; print(*compare.names())' "$folder")
files=()
for name in "$@"; do
  [ -e "$folder/peer_$name.py" ] || vi_fail "there is no peer $name: benchmarks/peers/peer_$name.py is missing"
  if [ -n "$together" ]; then peer "$name" & else peer "$name"; fi
  files+=("$rows/$name.json")
done
wait
"$vi_python" "$folder/compare.py" --join "${files[@]}" ${json:+--json "$json"}
