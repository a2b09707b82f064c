#!/bin/bash
# fuzz.sh - libFuzzer with address and undefined-behaviour sanitizers over every parser (tests/fuzz).
#
#   scripts/fuzz.sh [BUILD]          BUILD: a build of the preset `fuzz` (build/fuzz)
#
# 1,000,000 executions of each text parser and of npz, ten minutes each of archive and model; RUNS, MINUTES and TARGETS change that. What was reached grows in fuzz/<target> below the
# build and is gone on from. A find ends the run with status 1; put it into tests/fuzz/finds/<target>/, where the test run replays it.
set -eu
build=${1:-build/fuzz}
runs=${RUNS:-1000000} minutes=${MINUTES:-10}
status=0
for target in ${TARGETS:-bvh asf npz curve steering tables archive model}; do
  fuzzer=$build/bin/fuzz_$target folder=$build/fuzz/$target
  [ -x "$fuzzer" ] || { echo "fuzz.sh: $fuzzer: absent; cmake --preset fuzz && cmake --build build/fuzz --target fuzzers"; exit 2; }
  mkdir -p "$folder/corpus" "$folder/finds"
  "$fuzzer" --write-seeds "$folder/seeds"
  case $target in archive|model) limit=-max_total_time=$((60 * minutes)) ;; *) limit=-runs=$runs ;; esac
  "$fuzzer" "$folder/corpus" "$folder/seeds" -dict="$folder/seeds.dict" $limit -max_len=16384 -timeout=20 -rss_limit_mb=2048 -artifact_prefix="$folder/finds/" -print_final_stats=1 > "$folder/log" 2>&1 || status=1
  echo "$target: $(sed -n 's/^stat::number_of_executed_units: *//p' "$folder/log") executions, $(sed -n 's/^stat::average_exec_per_sec: *//p' "$folder/log") a second, $(grep -o 'cov: [0-9]*' "$folder/log" | tail -1), finds: $(ls "$folder/finds" | tr '\n' ' ')"
done
exit $status
