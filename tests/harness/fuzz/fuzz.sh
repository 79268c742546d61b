#!/bin/bash
# SPDX-License-Identifier: GPL-3.0-or-later
# Runs fuzzers and prints a table; ends with 1 if one of them found something.
# usage: fuzz.sh FOLDER MINUTES TARGET...   FOLDER: of the programs; $BROKEN: a folder of files to begin with too; $JOBS: so many at a time (1).
# The corpus grows in FOLDER/corpus; what is found is kept in FOLDER/found.
set -u
shopt -s nullglob
source=$(realpath "$(dirname "$0")/../../..")
folder=$(realpath "$1") seconds=$(awk -v m="$2" 'BEGIN { print int(60 * m) }')
shift 2
broken=${BROKEN:-$source/../shared/data/broken}
cd "$folder" || exit 1
mkdir -p found

# Seeds for a target. Those of text_reader_fuzz begin with the letter of their reader.
seeds() {
  case $1 in
    config_fuzz) cp "$source"/configs/*.yaml "$source"/configs/*/*.yaml "$broken"/*.yaml corpus/config_fuzz 2> /dev/null ;;
    mesh_reader_fuzz | invesalius_fuzz)
      for f in "$broken"/*; do [ "$(stat -c %s "$f")" -lt 20000 ] && cp "$f" "corpus/$1"; done ;;
    volume_fuzz) python3 -B "$source/tests/harness/fuzz/volume_seeds.py" corpus/volume_fuzz ;;
    text_reader_fuzz)
      { printf c; head -20 "$source/configs/fit/points.csv"; } > corpus/$1/points
      printf 'n\x93NUMPY\x01\x00\x46\x00{"descr": "<f8", "fortran_order": False, "shape": (1, 1), }         \n12345678' > corpus/$1/npy
      printf 'h{"format": "semblance-hspline", "version": 1, "patches": [1, 1], "max_level": 0, "closure": "open", "offset_reference": "frame", "units": "mm", "level0": [[0,0,0],[1,0,0],[2,0,0],[3,0,0],[0,1,0],[1,1,0],[2,1,0],[3,1,0],[0,2,0],[1,2,0],[2,2,0],[3,2,0],[0,3,0],[1,3,0],[2,3,0],[3,3,0]], "offsets": []}' > corpus/$1/hspline
      printf 'h{"format": "semblance-hspline", "version": 1, "patches": [4, 4], "max_level": 1, "closure": "periodic_u", "offset_reference": "world", "units": "mm", "level0": [[0,0,0],[1,0,0],[2,0,0],[3,0,0],[0,1,0],[1,1,1],[2,1,2],[3,1,0],[0,2,0],[1,2,2],[2,2,1],[3,2,0],[0,3,0],[1,3,0],[2,3,0],[3,3,0],[0,4,0],[1,4,0],[2,4,1],[3,4,0],[0,5,0],[1,5,1],[2,5,0],[3,5,0],[0,6,0],[1,6,0],[2,6,1],[3,6,0]], "offsets": [[1,0,7,0,0,1]]}' > corpus/$1/tube
      printf 'f# Markups fiducial file version = 4.11\n# CoordinateSystem = LPS\n# columns = id,x,y,z,ow,ox,oy,oz,vis,sel,lock,label,desc,associatedNodeID\n1,1,2,3,0,0,0,1,1,1,0,g,,\n' > corpus/$1/fcsv
      printf 'm{"markups": [{"type": "Fiducial", "coordinateSystem": "LPS", "controlPoints": [{"label": "g", "position": [1, 2, 3]}]}]}' > corpus/$1/markups
      printf 'p<!DOCTYPE PickedPoints>\n<PickedPoints><point x="1" y="2" z="3" name="g" active="1"/></PickedPoints>' > corpus/$1/picked
      printf 'tg,1,2,3\nn,4,5,6\n' > corpus/$1/list
      printf 'lsite;x;y;z\ng;1,5;2;3\n' > corpus/$1/table
      printf 'vsubject = a and (interp = kriging or not resolution >= 3)' > corpus/$1/condition
      for f in "$broken"/*.csv; do { printf c; cat "$f"; } > "corpus/$1/$(basename "$f")"; done
      for f in "$broken"/*.json; do [ "$(stat -c %s "$f")" -lt 20000 ] && { printf h; cat "$f"; } > "corpus/$1/$(basename "$f")"; done ;;
  esac
}

# One target; its line of the table into TARGET.row, and below it what was found.
fuzz() {
  local target=$1 options=detect_leaks=1 longest_s=10 found done
  mkdir -p "corpus/$target"
  seeds "$target"
  # What ITK and GDCM forget when they give up is theirs. The program gives them little memory by a limit that ASan does not know.
  # A library that goes round for ever is ended after some seconds of processor.
  [ "$target" = volume_fuzz ] && options=detect_leaks=0:max_allocation_size_mb=256 longest_s=60
  ASAN_OPTIONS=$options "./$target" "corpus/$target" -max_total_time="$seconds" -timeout="$longest_s" -rss_limit_mb=2048 -max_len=20000 -print_final_stats=1 \
    -artifact_prefix="found/$target-" > "$target.log" 2>&1
  found=$(($? != 0))
  [ "$target$found" = volume_fuzz0 ] && rm -f found/volume_fuzz-crash-*  # of ITK's and GDCM's own process
  done=$(awk '/stat::number_of_executed_units/ { print $2 }' "$target.log")
  {
    printf '%-20s %8d %12s %12s %9d\n' "$target" "$seconds" "${done:-0}" "$((${done:-0} / seconds))" $found
    [ $found = 0 ] || grep -m 3 -E 'ERROR|SUMMARY|runtime error' "$target.log"
  } > "$target.row"
}

for target in "$@"; do
  [ "$(jobs -rp | wc -l)" -lt "${JOBS:-1}" ] || wait -n
  fuzz "$target" &
done
wait
printf '%-20s %8s %12s %12s %9s\n' target seconds executions 'per second' findings
for target in "$@"; do cat "$target.row"; done
! for target in "$@"; do head -1 "$target.row"; done | grep -qv ' 0$'
