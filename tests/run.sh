#!/usr/bin/env bash
# bash tests/run.sh [--quick] [arguments of pytest…]     runs the whole suite on 1, 2 and 3 ranks; installs what is missing on Debian
#   --quick                     runs on one rank, without tests/validation and without slow tests
#   VI_CONTACT_PYTHON=venv/bin/python      runs with another interpreter and its packages, as after pip install '.[fenicsx,dev]'
#   VI_CONTACT_RANKS="1 2"      runs on these numbers of ranks
#   VI_CONTACT_TIMES=FILE       appends "ranks seconds file" for every test file
#   VI_CONTACT_TIMEOUT=1800     limits the seconds of all runs together; without it only single tests have a limit (tests/conftest.py)
# Last line: "N passed, N failed, N skipped", summed over the runs.
set -uo pipefail
tests=$(cd "$(dirname "${BASH_SOURCE[0]}")" && pwd)
. "$tests/../install/setup.sh"
vi_setup
cd "$vi_root" || exit 1

unset PYTHONDONTWRITEBYTECODE  # or every process of every test compiles the package anew
export PETSC_OPTIONS="-no_signal_handler ${PETSC_OPTIONS:-}"  # a crash is then told by Python, with the line it came from
[ -t 1 ] && colour=auto || colour=no  # mpirun gives its processes a terminal, even when its own output is a file
seconds=${VI_CONTACT_TIMEOUT:-} passed=0 failed=0 skipped=0 status=0 child=
ranks=${VI_CONTACT_RANKS:-1 2 3}
if [ "${1:-}" = --quick ]; then shift; ranks=1; set -- -m "not slow" --ignore=tests/validation "$@"; fi
tally=$(mktemp)
trap 'rm -f "$tally"' EXIT
trap 'kill "$child"; wait; exit 130' INT TERM

# One rank leaves cores idle: whole files go to as many processes (a few: each takes two gigabytes), unless somebody wants to
# see a test talk.
share() {
  local cores argument; cores=$(env -u OMP_NUM_THREADS nproc)
  for argument; do case $argument in -s | --capture=no | --pdb | --trace | -n*) return ;; esac; done
  [ "$cores" -lt 2 ] || echo "-n $((cores < 4 ? cores : 4)) --dist loadfile --max-worker-restart 0"
}

run() {  # on $1 ranks, with pytest's arguments
  local ranks=$1 launch=() limit=() code=0 p=0 f=0 s=0; shift
  # --capture=sys: a library that calls exit() on one rank takes what pytest has captured from it along
  if [ "$ranks" -eq 1 ]; then set -- $(share "$@") "$@"; else launch=("${vi_ranks[@]}" "$ranks"); set -- --capture=sys "$@"; fi
  [ -z "$seconds" ] || limit=(timeout -k 10 "$((SECONDS < seconds ? seconds - SECONDS : 1))")
  : >"$tally"
  # bash lets what it starts with & ignore Ctrl-C, which tests send themselves
  VI_CONTACT_TALLY=$tally "${limit[@]}" env --default-signal=INT,QUIT "${launch[@]}" "$vi_python" -m pytest --color="$colour" "$@" </dev/null &
  child=$!
  wait "$child" || code=$?
  [ -z "$seconds" ] || [ "$SECONDS" -lt "$seconds" ] || [ "$code" -eq 0 ] ||
    echo "vi_contact: stopped, the $seconds s of VI_CONTACT_TIMEOUT are over" >&2
  read -r p f s <"$tally"
  [ "$code" -eq 0 ] || [ "${f:-0}" -gt 0 ] || { f=1; echo; }  # killed or aborted before it could count, maybe within a line
  [ "$code" -eq 0 ] || status=1
  passed=$((passed + p)) failed=$((failed + f)) skipped=$((skipped + s))
}

for count in $ranks; do
  echo "vi_contact: the suite on $count $([ "$count" -eq 1 ] && echo rank || echo ranks)"
  run "$count" "$@"
done
echo "$passed passed, $failed failed, $skipped skipped"
exit "$status"
