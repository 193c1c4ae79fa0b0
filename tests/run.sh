#!/usr/bin/env bash
# bash tests/run.sh [--quick] [arguments of pytest…]
# runs the whole suite on 1, 2 and 3 ranks, and installs what is missing on Debian.
#   --quick                     runs one case of each test on one rank, without long and slow tests,
#                               pages, pictures and validation
#   VI_CONTACT_PYTHON=PYTHON    runs with another interpreter and its packages, as after
#                               pip install '.[fenicsx,dev]' in a virtual environment
#   VI_CONTACT_RANKS="1 2"      runs on these numbers of ranks
#   VI_CONTACT_TIMES=FILE       appends "ranks seconds file" for every test file
#   VI_CONTACT_TIMEOUT=1800     limits the seconds of all runs together; without it only single
#                               tests have a limit (tests/conftest.py)
# Last line: "N passed, N failed, N skipped", summed over the runs.
set -uo pipefail
tests=$(cd "$(dirname "${BASH_SOURCE[0]}")" && pwd)
. "$tests/../install/setup.sh"
vi_setup
cd "$vi_root" || exit 1

unset PYTHONDONTWRITEBYTECODE  # or every process of every test compiles the package anew
# a crash is then told by Python, with the line it came from
export PETSC_OPTIONS="-no_signal_handler ${PETSC_OPTIONS:-}"
# mpirun gives its processes a terminal, even when its own output is a file
[ -t 1 ] && colour=auto || colour=no
seconds=${VI_CONTACT_TIMEOUT:-}
passed=0 failed=0 skipped=0
status=0
child=
ranks=${VI_CONTACT_RANKS:-1 2 3}
if [ "${1:-}" = --quick ]; then
  ranks=1
fi
export VI_CONTACT_RANKS=$ranks # tests/conftest.py says which tests run on how many
tally=$(mktemp)
trap 'rm -f "$tally"' EXIT
trap 'kill "$child"; wait; exit 130' INT TERM

# share ARGUMENTS: those with which pytest shares the work of one rank, which leaves cores idle.
# Whole files go to as many processes (a few: each takes two gigabytes), unless somebody wants to
# see a test talk.
share() {
  local cores argument
  cores=$(env -u OMP_NUM_THREADS nproc)
  for argument; do
    case $argument in
      -s | --capture=no | --pdb | --trace | -n*) return ;;
    esac
  done
  [ "$cores" -lt 2 ] || echo "-n $((cores < 4 ? cores : 4)) --dist loadfile --max-worker-restart 0"
}

# run RANKS ARGUMENTS: pytest with these arguments, on so many ranks.
run() {
  local ranks=$1 launch=() limit=() code=0 p=0 f=0 s=0
  shift
  if [ "$ranks" -eq 1 ]; then
    set -- $(share "$@") "$@"
  else
    launch=("${vi_ranks[@]}" "$ranks")
    # a library that calls exit() on one rank takes along what pytest has captured from it
    set -- --capture=sys "$@"
  fi
  if [ -n "$seconds" ]; then
    limit=(timeout -k 10 "$((SECONDS < seconds ? seconds - SECONDS : 1))")
  fi
  : >"$tally"
  # bash lets what it starts with & ignore Ctrl-C, which tests send themselves
  VI_CONTACT_TALLY=$tally "${limit[@]}" env --default-signal=INT,QUIT "${launch[@]}" \
    "$vi_python" -m pytest --color="$colour" "$@" </dev/null &
  child=$!
  wait "$child" || code=$?

  if [ "$code" -ne 0 ] && [ -n "$seconds" ] && [ "$SECONDS" -ge "$seconds" ]; then
    echo "vi_contact: stopped, the $seconds s of VI_CONTACT_TIMEOUT are over" >&2
  fi
  read -r p f s <"$tally"
  if [ "$code" -ne 0 ]; then
    status=1
    # killed or aborted before it could count, maybe within a line
    if [ "${f:-0}" -eq 0 ]; then
      f=1
      echo
    fi
  fi
  passed=$((passed + p)) failed=$((failed + f)) skipped=$((skipped + s))
}

for count in $ranks; do
  echo "vi_contact: the suite on $count $([ "$count" -eq 1 ] && echo rank || echo ranks)"
  run "$count" "$@"
done
echo "$passed passed, $failed failed, $skipped skipped"
exit "$status"
