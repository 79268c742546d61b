#!/bin/bash
# SPDX-License-Identifier: GPL-3.0-or-later
# Injects faults into the program, and looks whether every one ends with the old bytes or the new ones.
# usage: faults.sh PROGRAM CONFIGS [COUNT]   COUNT: kills of run, half of them over an old one, and of study; half as
# many of merge and of the workbench (100); the seed is $SEED (1).
# JOB=depth does so with the shorter job (run), RUNS=0 kills no run. Prints a table; ends with 1 if anything fell short.
set -u
shopt -s nullglob
here=$(dirname "$(realpath "$0")")
program=$(realpath "$1") configs=$(realpath "$2") count=${3:-100}
RANDOM=${SEED:-1}
kind=${JOB:-run}
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
cd "$folder" || exit 1
ulimit -c 0

job=($kind "$configs/phantom.yaml" --quiet --threads 1 --set subject.rings=16 --set implicit.resolution=16
     --set implicit.target_triangles=400 --set seeds.level=0 --set template.max_level=1 --set template.patches_u=6
     --set template.patches_v=6 --set "fit.plan.schedule=[{level: 0, fraction: 1}]" --set "first_fit=[]")
cat > study.yaml <<END
base: $configs/phantom.yaml
set: {subject.rings: 16, implicit.resolution: 16, implicit.target_triangles: 400, seeds.level: 0, template.max_level: 1,
      template.patches_u: 6, template.patches_v: 6, first_fit: [], fit.plan.schedule: [{level: 0, fraction: 1}]}
grid: {interp: [nearest, mean], implicit.resolution: [16, 17, 18]}
keep: view
END
[ "$kind" = depth ] && echo 'job: depth' >> study.yaml

short=0
tell() { printf '%-58s %5d tried %5d fell short\n' "$1" "$2" "$3"; short=$((short + $3)); }
# What a folder holds but for times, which a study's report has too: one hash, or "none".
state() {
  [ -d "$1" ] || { echo none; return; }
  (cd "$1" && { find . -type f ! -name timing.json ! -path ./report.html -print0 | sort -z | xargs -0 sha256sum
    [ ! -f report.html ] || sed 's/\(data-head="\(mean \)\?seconds">\)[0-9.]*/\1/g' report.html | sha256sum; } | sha256sum)
}
leftovers() { find "$1" -name '.*semblance-part' -o -name '.*.tmp' | grep -c .; }
now() { date +%s%N; }
# A random part of $1 nanoseconds, as seconds.
part_of() { awk -v t="$1" -v r="$RANDOM" 'BEGIN { printf "%.4f", 1.1 * t / 1e9 * r / 32767 }'; }
crashed() { [ "$1" -gt 2 ]; }
# Starts the program and sends signal $1 after $2 s, if it has not ended by then; its exit code is in $code.
interrupt() {
  local signal=$1 after=$2
  shift 2
  "$program" "$@" > /dev/null 2>&1 &
  local child=$!
  (sleep "$after"; kill "-$signal" $child) 2> /dev/null &
  local killer=$!
  wait $child 2> /dev/null
  code=$?
  kill $killer 2> /dev/null
  wait $killer 2> /dev/null
}

start=$(now); "$program" "${job[@]}" --out run > run.log 2>&1 || { cat run.log; exit 1; }
run_time=$(($(now) - start)) run_state=$(state run)
start=$(now); "$program" study study.yaml --out study --quiet > study.log 2>&1 || { cat study.log; exit 1; }
study_time=$(($(now) - start)) study_state=$(state study)

half=$((count / 2)) fifth=$((count / 5 + 1)) half_of_runs=$((${RUNS:-$count} / 2))
bad=0
for _ in $(seq $half_of_runs); do
  interrupt KILL "$(part_of $run_time)" "${job[@]}" --out killed
  s=$(state killed)
  [ "$s" = none ] || [ "$s" = "$run_state" ] || bad=$((bad + 1))
  rm -rf killed
done
"$program" "${job[@]}" --out killed > /dev/null 2>&1
[ "$(state killed)" = "$run_state" ] && [ "$(leftovers .)" = 0 ] || bad=$((bad + 1))
rm -rf killed
tell "$kind: kill -9; nothing or all, the next one clears up" $half_of_runs $bad

# An old run of another title, written over with --force: each file is the old one or the new one.
"$program" "${job[@]}" --set title=old --out old > /dev/null 2>&1
echo mine > old/mine.txt
bad=0
for _ in $(seq $half_of_runs); do
  rm -rf over; cp -r old over
  interrupt KILL "$(part_of $run_time)" "${job[@]}" --out over --force
  for f in $(cd over && find . -type f ! -name timing.json ! -path './.semblance-part/*'); do
    cmp -s "over/$f" "old/$f" || cmp -s "over/$f" "run/$f" || { bad=$((bad + 1)); break; }
  done
  [ "$(cat over/mine.txt)" = mine ] || bad=$((bad + 1))
done
rm -rf over
tell "$kind --force: kill -9; each file old or new" $half_of_runs $bad

bad=0 kills=0
while [ $kills -lt "$count" ]; do
  interrupt KILL "$(part_of $study_time)" study study.yaml --out killed --quiet
  kills=$((kills + 1))
  if [ "$code" = 0 ] || [ $kills = "$count" ]; then
    "$program" study study.yaml --out killed --quiet > /dev/null 2>&1
    [ "$(state killed)" = "$study_state" ] && [ "$(leftovers killed)" = 0 ] || bad=$((bad + 1))
    rm -rf killed
  fi
done
tell "study: kill -9, gone on until done; the same bytes" $kills $bad

"$program" study study.yaml --out shard0 --shard 0/2 --quiet > /dev/null 2>&1
"$program" study study.yaml --out shard1 --shard 1/2 --quiet > /dev/null 2>&1
start=$(now); "$program" merge merged shard0 shard1 > /dev/null 2>&1
merge_time=$(($(now) - start)) merge_state=$(state merged)
[ "$merge_state" = "$study_state" ] || short=$((short + 1))
bad=0
for _ in $(seq $half); do
  rm -rf killed
  interrupt KILL "$(part_of $merge_time)" merge killed shard0 shard1
  "$program" merge killed shard0 shard1 > /dev/null 2>&1
  [ "$(state killed)" = "$merge_state" ] && [ "$(leftovers killed)" = 0 ] || bad=$((bad + 1))
done
rm -rf killed
tell "merge: kill -9, merged again; the same bytes" $half $bad

# A workbench while actions are posted: what it had said to be done is there when it is opened again.
echo "base: $configs/phantom.yaml
subject: {type: phantom, rings: 24}" > bench.yaml
if command -v python3 > /dev/null; then
  bad=$(python3 "$here/workbench_kills.py" "$program" bench.yaml $half "${SEED:-1}")
  tell "workbench: kill -9; nothing that was acknowledged is lost" $half "$bad"
else
  echo "workbench: not tried, as python3 is not here"
fi

bad=0
for _ in $(seq $fifth); do
  start=$(now)
  after=$(part_of $run_time)
  interrupt TERM "$after" "${job[@]}" --out stopped
  took=$(($(now) - start))
  s=$(state stopped)
  crashed $code && [ $code != 143 ] && bad=$((bad + 1))  # 143: before the program could listen
  { [ "$s" = none ] || [ "$s" = "$run_state" ]; } || bad=$((bad + 1))
  awk -v t=$took -v a="$after" 'BEGIN { exit !(t / 1e9 - a > 2) }' && bad=$((bad + 1))
  rm -rf stopped .stopped.semblance-part  # what a stop that came too late for leaves, for the next run to clear
done
tell "$kind: SIGTERM; ends within 2 s with nothing or all" $fifth $bad

bad=0 tried=0
for blocks in 0 1 2 4 8 16 32 64 128 256 512 1024; do
  (ulimit -f $blocks; trap '' XFSZ; exec "$program" "${job[@]}" --out full) > /dev/null 2>&1
  code=$? s=$(state full)
  crashed $code && bad=$((bad + 1))
  { [ "$s" = none ] || [ "$s" = "$run_state" ]; } || bad=$((bad + 1))
  (ulimit -f $blocks; trap '' XFSZ; exec "$program" merge mfull shard0 shard1) > /dev/null 2>&1
  crashed $? && bad=$((bad + 1))
  "$program" merge mfull shard0 shard1 > /dev/null 2>&1
  [ "$(state mfull)" = "$merge_state" ] || bad=$((bad + 1))
  rm -rf full mfull
  tried=$((tried + 2))
done
tell "no room for files above a size: $kind and merge" $tried $bad

bad=0 tried=0
for megabytes in $(seq 40 40 400); do
  (ulimit -v $((megabytes * 1024)); exec "$program" "${job[@]}" --out little) > /dev/null 2> little.err
  code=$? s=$(state little)
  # 126, 127: the system could not load the program at all.
  { crashed $code && [ $code != 127 ] && [ $code != 126 ]; } && { bad=$((bad + 1)); echo "$megabytes MB: $code"; cat little.err; }
  { [ "$s" = none ] || [ "$s" = "$run_state" ]; } || bad=$((bad + 1))
  rm -rf little
  tried=$((tried + 1))
done
tell "little memory: done, or said" $tried $bad

bad=0 tried=$((count / 20 + 1))
for _ in $(seq $tried); do
  "$program" "${job[@]}" --out both > /dev/null 2>&1 & a=$!
  "$program" "${job[@]}" --out both > /dev/null 2>&1 & b=$!
  wait $a; code_a=$?
  wait $b; code_b=$?
  [ $((code_a + code_b)) = 2 ] && [ "$(state both)" = "$run_state" ] && [ "$(leftovers .)" = 0 ] || bad=$((bad + 1))
  rm -rf both
done
tell "two processes on one folder: one is refused" $tried $bad

bad=0 tried=0
"$program" study study.yaml --out cached --cache cache --quiet > /dev/null 2>&1
for file in cache/*.bin; do
  for damage in cut flip empty; do
    rm -rf again
    case $damage in
      cut) truncate -s -10 "$file" ;;
      flip) printf 'X' | dd of="$file" bs=1 seek=$((RANDOM % 5000)) conv=notrunc 2> /dev/null ;;
      empty) : > "$file" ;;
    esac
    "$program" study study.yaml --out again --cache cache --quiet > /dev/null 2>&1
    [ "$(state again)" = "$study_state" ] || bad=$((bad + 1))
    tried=$((tried + 1))
  done
done
tell "damaged cache: the same bytes" $tried $bad

# A clock that somebody sets, and files of another century; the study goes on where a trial is gone.
if c++ -shared -fPIC -O1 -o clock_jumps.so "$here/clock_jumps.cc" 2> /dev/null; then
  bad=0 tried=0
  for century in 1971-01-01 2090-01-01; do
    rm -rf jumped merged_jumped jumped_cache
    for _ in 1 2; do
      LD_PRELOAD=$PWD/clock_jumps.so "$program" study study.yaml --out jumped --cache jumped_cache --cache-limit-mb 1 --quiet > /dev/null 2>&1
      [ "$(state jumped)" = "$study_state" ] || bad=$((bad + 1))
      find jumped jumped_cache -exec touch -d $century {} +
      rm -rf "$(find jumped/trials -mindepth 1 -maxdepth 1 | sort | head -1)"
      LD_PRELOAD=$PWD/clock_jumps.so "$program" study study.yaml --out jumped --cache jumped_cache --quiet > /dev/null 2>&1
      [ "$(state jumped)" = "$study_state" ] || bad=$((bad + 1))
      LD_PRELOAD=$PWD/clock_jumps.so "$program" merge merged_jumped shard0 shard1 > /dev/null 2>&1
      [ "$(state merged_jumped)" = "$merge_state" ] || bad=$((bad + 1))
      tried=$((tried + 3))
    done
  done
  tell "a clock that is set: the same bytes" $tried $bad
else
  echo "a clock that is set: not tried, as c++ is not here"
fi

bad=0 tried=0
for trial in study/trials/*; do
  id=$(basename "$trial")
  for text in '' '{' '[]' '{"id": 7}' "{\"id\": \"$id\", \"status\": []}"; do
    rm -rf damaged; cp -r study damaged
    printf '%s' "$text" > "damaged/trials/$id/trial.json"
    "$program" status damaged > /dev/null 2>&1; crashed $? && bad=$((bad + 1))
    "$program" study study.yaml --out damaged --quiet > /dev/null 2>&1
    [ "$(state damaged)" = "$study_state" ] || bad=$((bad + 1))
    tried=$((tried + 1))
  done
  rm -rf damaged; cp -r study damaged
  printf 'X' >> "damaged/trials/$id/$(ls "study/trials/$id" | grep -E 'scene.json|depth.p' | head -1)"
  rm -rf gathered; "$program" merge gathered damaged > /dev/null 2>&1
  [ ! -e "gathered/trials/$id" ] || bad=$((bad + 1))
  tried=$((tried + 1))
done
tell "damaged trial: made again, and not merged" $tried $bad

[ $short = 0 ]
