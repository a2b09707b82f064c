#!/bin/bash
# preprocess.sh - canonicalize a large collection as a SLURM array job and merge what its tasks make: byte for byte the archive of one run.
#
#   scripts/slurm/preprocess.sh TASKS OUTPUT.h5 INPUT... [canonicalize's options]      e.g.
#   scripts/slurm/preprocess.sh 64 amass.h5 /data/AMASS --labels labels.tsv --mirror
#
# Submits two jobs and prints their numbers: an array of TASKS tasks, each of which makes OUTPUT.h5.shards/N.h5 of its share of the inputs and N.rejects.tsv of those that were refused, and a
# job that merges the shards once all tasks are through. Submitted again, tasks whose shard is up to date are done at once (--skip-existing): after a task was killed, or some inputs changed,
# the same line does what is missing. SBATCH_PARTITION, SBATCH_TIMELIMIT, SBATCH_ACCOUNT and the like are read by sbatch; the tools must be on PATH.
set -eu
[ $# -ge 3 ] || { sed -n '2,/^set/s/^# \?//p' "$0"; exit 2; }
tasks=$1 output=$2
shift 2
here=$(cd "$(dirname "$0")" && pwd)
case $tasks in '' | *[!0-9]* | 0) echo "preprocess.sh: '$tasks' tasks, expected a number from 1" >&2; exit 2 ;; esac
case $output in *.h5) ;; *) echo "preprocess.sh: $output: expected an output that ends in .h5" >&2; exit 2 ;; esac
command -v canonicalize motion-merge > /dev/null || { echo "preprocess.sh: canonicalize and motion-merge are not on PATH" >&2; exit 2; }
mkdir -p "$output.shards"
array=$(sbatch --parsable --array="1-$tasks" --job-name=canonicalize --requeue --output="$output.shards/%a.log" "$here/shard.sbatch" "$output.shards" "$@")
merge=$(sbatch --parsable --dependency="afterok:${array%%;*}" --kill-on-invalid-dep=yes --job-name=motion-merge --output="$output.shards/merge.log" "$here/merge.sbatch" "$output.shards" "$tasks" "$output")
echo "${array%%;*} ${merge%%;*}"
