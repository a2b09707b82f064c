#!/bin/bash
# The job scripts of scripts/slurm under a real SLURM on this machine: slurmctld, slurmd and munged of their own, in a temporary folder, as root. An array job with a merge gives the bytes of
# one run, also after a task was killed; a training that is told to stop before its time limit, puts itself into the queue, is killed by force and requeued once more ends at the bits of one
# that ran through. Needs the packages slurm-wlm and munge; skipped (status 77) without them.
set -u
source=$(cd "$(dirname "$0")/../.." && pwd)
bin=$(readlink -f "${MOCAPKIT_BIN:?set it to the folder of the tools}")
for needed in munged slurmctld slurmd sbatch; do
  PATH=$PATH:/usr/sbin command -v $needed > /dev/null || { echo "skipped: $needed is absent (apt-get install slurm-wlm munge)"; exit 77; }
done
[ "$(id -u)" = 0 ] || { echo "skipped: slurmd needs root"; exit 77; }
work=$(mktemp -d)
node=$(hostname -s)
pids=()
finish() {
  for pid in "${pids[@]}"; do kill "$pid" 2> /dev/null; done
  wait 2> /dev/null
  rm -rf "$work"
}
trap finish EXIT
fail() { echo "slurm.sh: $*"; tail -n 15 "$work"/log/* "$work"/*.log 2> /dev/null; exit 1; }
export PATH=$bin:$PATH:/usr/sbin SLURM_CONF=$work/slurm.conf LC_ALL=C
mkdir -p "$work"/{log,state,spool,munge}
chmod 755 "$work"
chmod 755 "$work/munge"
head -c 1024 /dev/urandom > "$work/munge/key"
chmod 400 "$work/munge/key"
# cred_expire is also how long a requeued job waits: two minutes otherwise.
cat > "$SLURM_CONF" <<CONF
ClusterName=mocapkit
SlurmctldHost=$node(127.0.0.1)
SlurmUser=root
SlurmdUser=root
SlurmctldPort=16817
SlurmdPort=16818
AuthType=auth/munge
AuthInfo=socket=$work/munge/socket,cred_expire=6
CredType=cred/munge
StateSaveLocation=$work/state
SlurmdSpoolDir=$work/spool
SlurmctldPidFile=$work/slurmctld.pid
SlurmdPidFile=$work/slurmd.pid
SlurmctldLogFile=$work/log/slurmctld
SlurmdLogFile=$work/log/slurmd
ProctrackType=proctrack/linuxproc
TaskPlugin=task/none
SchedulerParameters=sched_interval=2,bf_interval=2
SelectType=select/cons_tres
SelectTypeParameters=CR_Core
ReturnToService=2
JobRequeue=1
KillWait=5
MailProg=/bin/true
NodeName=$node NodeAddr=127.0.0.1 CPUs=2 State=UNKNOWN
PartitionName=test Nodes=$node Default=YES MaxTime=INFINITE State=UP
CONF
munged --foreground --force --key-file="$work/munge/key" --socket="$work/munge/socket" --pid-file="$work/munge/pid" --log-file="$work/log/munged" --seed-file="$work/munge/seed" 2> "$work/log/munged.err" &
pids+=($!)
for _ in $(seq 50); do [ -S "$work/munge/socket" ] && break; sleep 0.1; done
slurmctld -D -c -f "$SLURM_CONF" > "$work/log/slurmctld.out" 2>&1 &
pids+=($!)
slurmd -D -c -f "$SLURM_CONF" -N "$node" > "$work/log/slurmd.out" 2>&1 &
pids+=($!)
for _ in $(seq 100); do [ "$(sinfo -h -o %T 2> /dev/null)" = idle ] && break; sleep 0.2; done
[ "$(sinfo -h -o %T)" = idle ] || fail "no node came up: $(sinfo 2>&1)"

state() { scontrol -o show job "$1" | sed -n 's/.*JobState=\([A-Z_]*\).*/\1/p' | sort -u | tr '\n' ' '; }
# Waits until all of a job (an array has many) is in STATE; SECONDS_ at most.
await() {
  for _ in $(seq $(($3 * 5))); do [ "$(state "$1")" = "$2 " ] && return; sleep 0.2; done
  fail "job $1 is $(state "$1")after $3 s, expected $2"
}

cd "$work"
make-corpus -q --subjects 3 --seconds 2 --transitions 0 -o corpus
head -c 3000 corpus/walking_f001_1.bvh > corpus/bad.bvh
canonicalize -q corpus --labels corpus/labels.tsv --mirror -o whole.h5 2> /dev/null

# Preprocessing: four shards and a merge; once more after one shard was lost and another task's input changed.
read -r array merge < <("$source/scripts/slurm/preprocess.sh" 4 all.h5 corpus --labels corpus/labels.tsv --mirror) || fail "preprocess.sh"
await "$merge" COMPLETED 60
cmp whole.h5 all.h5 || fail "four tasks and a merge differ from one run"
[ "$(cat all.h5.shards/*.rejects.tsv | grep -c bad.bvh)" = 1 ] || fail "the bad file is not in the rejects: $(cat all.h5.shards/*.rejects.tsv)"
grep -q '1 inputs were refused' all.h5.shards/merge.log || fail "$(cat all.h5.shards/merge.log)"
before=$(stat -c %Y.%i all.h5.shards/[124].h5)
rm all.h5.shards/3.h5
read -r array merge < <("$source/scripts/slurm/preprocess.sh" 4 all.h5 corpus --labels corpus/labels.tsv --mirror)
await "$merge" COMPLETED 60
cmp whole.h5 all.h5 || fail "after a lost shard was made again: other bytes"
[ "$(stat -c %Y.%i all.h5.shards/[124].h5)" = "$before" ] || fail "shards that were up to date were written again"
# In fewer tasks: what is left of the four is not merged.
read -r array merge < <("$source/scripts/slurm/preprocess.sh" 3 all.h5 corpus --labels corpus/labels.tsv --mirror)
await "$merge" COMPLETED 60
cmp whole.h5 all.h5 || fail "three tasks after four: other bytes"
# The comparison can fail: without a shard.
motion-merge -q -f all.h5.shards/[13].h5 -o few.h5
if cmp -s whole.h5 few.h5; then fail "a missing shard makes no difference"; fi
echo "4 tasks and a merge: the bytes of one run, also after a shard was lost"

# Training: a minute's limit, of which SLURM signals 50 s before the end; about a minute and a half of work.
training=(train-lstm -q "$work/whole.h5" --batch 8 --window 32 --steps "${STEPS:-700}" --checkpoint-minutes 0.05 -o)
job=$(sbatch --parsable --time=1 --signal=B:USR1@50 --cpus-per-task=1 --output="$work/train.log" "$source/scripts/slurm/train.sbatch" "${training[@]}" "$work/model.h5")
restarts() { scontrol -o show job "$job" | sed -n 's/.* Restarts=\([0-9]*\).*/\1/p'; }
for _ in $(seq 450); do [ "$(restarts)" -ge 1 ] && break; [ -e model.h5 ] && break; sleep 0.2; done
[ "$(restarts)" -ge 1 ] || fail "the training was not requeued by itself: $(scontrol -o show job "$job"); $(cat train.log)"
grep -q 'goes into the queue again' train.log || fail "$(cat train.log)"
ls model.h5.ckpt-? > /dev/null || fail "no checkpoint"
# Runs again; then killed by force.
await "$job" RUNNING 60
scontrol update job "$job" TimeLimit=20  # enough for the rest
touch mark
for _ in $(seq 300); do [ -n "$(find . -maxdepth 1 -name 'model.h5.ckpt-?' -newer mark)" ] && break; sleep 0.1; done
[ -e model.h5 ] && fail "the training ended before it was killed: give it more STEPS"
pkill -KILL -f "train-lstm.*$work/model.h5" || fail "nothing to kill"
scontrol requeue "$job" 2> /dev/null  # the job itself may have ended with the kill: then it is started anew, as a user would
sleep 1
[ "$(state "$job")" = "FAILED " ] && scontrol requeue "$job"
for _ in $(seq 1500); do [ -e model.h5 ] && [ "$(state "$job")" = "COMPLETED " ] && break; sleep 0.2; done
[ "$(state "$job")" = "COMPLETED " ] || fail "the training did not end: $(state "$job") $(cat train.log)"
stops=$(restarts)
OPENBLAS_CORETYPE=Haswell ATEN_CPU_CAPABILITY=avx2 ONEDNN_MAX_CPU_ISA=AVX2 "${training[@]}" "$work/through.h5"
cmp model.h5 through.h5 || fail "the requeued training ends at other bits"
cmp model.h5.log.tsv through.h5.log.tsv || fail "the requeued training has another log"
[ "$stops" -ge 2 ] || fail "$stops restarts, expected two"
echo "a training of $(($(wc -l < through.h5.log.tsv) - 1)) steps, requeued $stops times, once by itself and once killed: the bits of one that ran through"
