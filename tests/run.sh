#!/usr/bin/env bash
# bash tests/run.sh [arguments of pytest…]     the whole suite on 1, 2 and 3 ranks; installs what is missing on Debian 12 or 13
#   VI_CONTACT_RANKS="1 2"      other numbers of ranks
#   VI_CONTACT_TIMEOUT=1800     seconds for all of them together
# Last line: "N passed, N failed, N skipped", summed over the runs.
set -uo pipefail
tests=$(cd "$(dirname "${BASH_SOURCE[0]}")" && pwd)
. "$tests/../install/setup.sh"
vi_setup
cd "$vi_root" || exit 1

export PETSC_OPTIONS="-no_signal_handler ${PETSC_OPTIONS:-}"  # a crash is then told by Python, with the line it came from
[ -t 1 ] && colour=auto || colour=no  # mpirun gives its processes a terminal, even when its own output is a file
seconds=${VI_CONTACT_TIMEOUT:-1800} passed=0 failed=0 skipped=0 status=0 child=
tally=$(mktemp)
trap 'rm -f "$tally"' EXIT
trap 'kill "$child"; wait; exit 130' INT TERM

run() {  # on $1 ranks, with pytest's arguments
  local ranks=$1 launch=() code=0 p=0 f=0 s=0; shift
  # --capture=sys: a library that calls exit() on one rank takes what pytest has captured from it along
  [ "$ranks" -eq 1 ] || { launch=(mpirun -n "$ranks"); set -- --capture=sys "$@"; }
  : >"$tally"
  VI_CONTACT_TALLY=$tally timeout -k 10 "$((SECONDS < seconds ? seconds - SECONDS : 1))" \
    "${launch[@]}" "$vi_python" -m pytest --color="$colour" "$@" </dev/null &
  child=$!
  wait "$child" || code=$?
  case $code in 124 | 137) echo "vi_contact: stopped, the $seconds s of VI_CONTACT_TIMEOUT are over" >&2 ;; esac
  read -r p f s <"$tally"
  [ "$code" -eq 0 ] || [ "${f:-0}" -gt 0 ] || f=1  # killed or aborted before it could count
  [ "$code" -eq 0 ] || status=1
  passed=$((passed + p)) failed=$((failed + f)) skipped=$((skipped + s))
}

for ranks in ${VI_CONTACT_RANKS:-1 2 3}; do
  echo "vi_contact: the suite on $ranks $([ "$ranks" -eq 1 ] && echo rank || echo ranks)"
  run "$ranks" "$@"
done
echo "$passed passed, $failed failed, $skipped skipped"
exit "$status"
