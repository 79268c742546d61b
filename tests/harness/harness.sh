#!/bin/bash
# SPDX-License-Identifier: GPL-3.0-or-later
# The four harnesses: hostile calls (attack), injected faults (faults), coverage-guided fuzzing (fuzz) and all pairs of options (pairwise).
# usage: harness.sh PROGRAM CONFIGS [HARNESS...]   default: attack faults pairwise, and fuzz if clang has its runtime
# Environment: SEED (1) of attack and faults; LAWS (1000) cases of attack whose right result is known;
# COUNT (100) kills of faults; PAIRS, or SHARE seconds of CPU time, of pairwise; MINUTES (10) per fuzzer and JOBS at a time.
set -u
here=$(dirname "$(realpath "$0")")
program=$1 configs=$2
shift 2
jobs=${JOBS:-$(nproc)}

can_fuzz() {
  echo 'extern "C" int LLVMFuzzerTestOneInput(const char*, unsigned long) { return 0; }' |
    clang++ -x c++ -fsanitize=fuzzer,address - -o /dev/null 2> /dev/null
}

attack() { python3 -B "$here/attack.py" "$program" "$configs" --seed "${SEED:-1}" --laws "${LAWS:-1000}" --jobs "$jobs"; }
faults() { "$here/faults.sh" "$program" "$configs" "${COUNT:-100}"; }

pairwise() {
  local amount=(--cases "${PAIRS:-1000000}") status=0
  for kind in fit experiment; do
    [ -z "${SHARE:-}" ] || amount=(--share "$SHARE" --seed day)
    python3 -B "$here/pairwise.py" "$program" "$configs" --kind $kind "${amount[@]}" || status=1
  done
  return $status
}

fuzz() {
  can_fuzz || { echo "fuzz: skipped; clang and its fuzzing runtime (libclang-rt-14-dev) are not installed"; return 0; }
  local targets="mesh_reader_fuzz config_fuzz text_reader_fuzz invesalius_fuzz volume_fuzz"
  CXX=clang++ cmake -G Ninja -S "$here/../.." -B build-fuzz -DSEMBLANCE_FUZZ=ON -DBUILD_TESTING=ON > /dev/null &&
    cmake --build build-fuzz --target $targets &&
    JOBS=$jobs "$here/fuzz/fuzz.sh" build-fuzz/tests/harness/fuzz "${MINUTES:-10}" $targets
}

status=0
for harness in ${*:-attack faults pairwise fuzz}; do
  case $harness in
    attack | faults | pairwise | fuzz) $harness || status=1 ;;
    *) echo "harness.sh: '$harness' is not a harness; there are attack, faults, pairwise and fuzz" >&2; exit 2 ;;
  esac
done
exit $status
