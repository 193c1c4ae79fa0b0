#!/usr/bin/env bash
# bash tests/fuzz.sh --seed N [--count COUNT] [arguments of pytest…]   runs every fuzz test of the suite with another seed
#   --seed N                    N = 1, 2, …; the suite itself takes 0
#   --count COUNT               with the seeds N, N + 1, … one after the other; 1 if it is not given
#   VI_CONTACT_RANKS="1 2"      on these numbers of ranks; 1 if it is not given
# An input that fails is written into the folder "fixed" beside its test: commit it with what mends the fault.
# Last line: "N passed, N failed, N skipped", summed over the seeds.
set -uo pipefail
tests=$(cd "$(dirname "${BASH_SOURCE[0]}")" && pwd)

seed= count=1
while [ "$#" -gt 0 ]; do
  case $1 in
    --seed) seed=${2:-}; shift 2 || break ;;
    --count) count=${2:-}; shift 2 || break ;;
    *) break ;;
  esac
done
case $seed$count in
  '' | *[!0-9]*) seed= ;;
esac
if [ -z "$seed" ] || [ -z "$count" ]; then
  echo "usage: bash tests/fuzz.sh --seed N [--count COUNT] [arguments of pytest…]: N and COUNT are whole numbers" >&2
  exit 2
fi

export VI_CONTACT_RANKS=${VI_CONTACT_RANKS:-1} VI_CONTACT_FUZZ_KEEP=1
passed=0 failed=0 skipped=0 status=0
log=$(mktemp)
trap 'rm -f "$log"' EXIT
for ((number = seed; number < seed + count; number++)); do
  echo "vi_contact: the fuzz tests with seed $number"
  VI_CONTACT_FUZZ_SEED=$number bash "$tests/run.sh" -m fuzz "$@" 2>&1 | tee "$log"
  [ "${PIPESTATUS[0]}" -eq 0 ] || { status=1; echo "vi_contact: seed $number failed"; }
  read -r p _ f _ s _ < <(tail -n 1 "$log")
  passed=$((passed + p)) failed=$((failed + f)) skipped=$((skipped + s))
done
echo "$passed passed, $failed failed, $skipped skipped"
exit "$status"
