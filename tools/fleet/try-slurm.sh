#!/usr/bin/env bash
# Tries tools/fleet/slurm.sh on two Slurm nodes that both are this machine: one job as it should be, and one of which a
# node is killed. Needs root on Debian; installs Slurm and munge if they are missing, and ends and removes only what it
# started.
#
#   tools/fleet/try-slurm.sh
#
# The two nodes share the cores and measure at once, so their times mean nothing.
set -euo pipefail
cd "$(dirname "$0")/../.."
{ command -v slurmctld && command -v slurmd && command -v sbatch && command -v munged; } >/dev/null 2>&1 || {
    apt-get update -q
    apt-get install -qy --no-install-recommends slurmctld slurmd slurm-client munge
}
cargo build --quiet --release -p sapwise-cli
SAPWISE=$(realpath "${CARGO_TARGET_DIR:-target}/release/sapwise")
export SAPWISE
dir=$(mktemp -d)
started=()
end() {
    for pid in "${started[@]}"; do kill "$pid" 2>/dev/null || true; done
    for pid in "${started[@]}"; do wait "$pid" 2>/dev/null || true; done
    rm -rf "$dir"
}
trap end EXIT
fail() {
    echo "try-slurm: $*" >&2
    tail -n 20 "$dir"/*.log "$dir"/*.out >&2 || true
    exit 1
}

mkdir "$dir/munge" "$dir/state" "$dir/spool-n1" "$dir/spool-n2"
chmod 755 "$dir" "$dir/munge"
head -c 1024 /dev/urandom >"$dir/munge.key"
chmod 400 "$dir/munge.key"
munged --foreground --force --key-file="$dir/munge.key" --socket="$dir/munge/socket" --pid-file="$dir/munge/pid" \
    --seed-file="$dir/munge/seed" --log-file="$dir/munged.log" >"$dir/munged.out" 2>&1 &
started+=($!)
cat >"$dir/slurm.conf" <<CONF
ClusterName=try
SlurmctldHost=$(hostname)(127.0.0.1)
SlurmUser=root
SlurmctldPort=16817
AuthType=auth/munge
AuthInfo=socket=$dir/munge/socket
CredType=cred/munge
StateSaveLocation=$dir/state
SlurmdSpoolDir=$dir/spool-%n
SlurmctldPidFile=$dir/slurmctld.pid
SlurmdPidFile=$dir/slurmd-%n.pid
ProctrackType=proctrack/linuxproc
TaskPlugin=task/none
SelectType=select/linear
SlurmdParameters=config_overrides
ReturnToService=2
MailProg=/bin/true
NodeName=n1 NodeHostname=$(hostname) NodeAddr=127.0.0.1 Port=16821 CPUs=2
NodeName=n2 NodeHostname=$(hostname) NodeAddr=127.0.0.1 Port=16822 CPUs=2
PartitionName=all Nodes=n1,n2 Default=YES State=UP
CONF
export SLURM_CONF=$dir/slurm.conf
for _ in $(seq 50); do [ -S "$dir/munge/socket" ] && break; sleep 0.1; done
slurmctld -D >"$dir/slurmctld.log" 2>&1 &
started+=($!)
for node in n1 n2; do
    slurmd -D -N $node >"$dir/slurmd-$node.log" 2>&1 &
    started+=($!)
done
for _ in $(seq 60); do [ "$(sinfo --noheader --states=idle --format=%D 2>/dev/null)" = 2 ] && break; sleep 0.5; done
[ "$(sinfo --noheader --states=idle --format=%D)" = 2 ] || fail "the two nodes don't come up"

job() {
    local name=$1
    shift
    sbatch --wait --parsable --nodes=2 --output="$dir/$name.out" \
        tools/fleet/slurm.sh "$dir/reports" --no-gpus --seed 1 "$@" >"$dir/$name.id"
}
whole() { find "$dir/reports" -name '*.json' | wc -l; }

tiny=(--quick --scenario uniform --max-objects 10)
job first "${tiny[@]}" || fail "the job failed"
[ "$(whole)" = 2 ] || fail "two nodes left $(whole) reports"
grep -q "of 2 reports can be believed" "$dir/first.out" || fail "no table of the reports"

rm -r "$dir/reports"
job killed --scenario uniform --scenario slab --scenario clustered --max-objects 1000 &
waiting=$!
for _ in $(seq 600); do
    [ "$(find "$dir/reports" -name '*.unfinished' 2>/dev/null | wc -l)" = 2 ] && break
    sleep 0.1
done
victim=$(pgrep -f "^$SAPWISE probe --out $dir/reports" | head -n 1) || fail "no probe to kill"
kill -KILL "$victim"
if wait $waiting; then fail "a job of which a node was killed succeeded"; fi
grep -q "1 of 2 nodes left a report" "$dir/killed.out" || fail "the job does not say that a node was killed"
[ "$(whole)" = 1 ] || fail "the node that was not killed left $(whole) reports"
"$SAPWISE" check "$dir/reports" >/dev/null || fail "the report of the node that was not killed is not sound"
cat "$dir/killed.out"
echo "try-slurm: two nodes measured into one folder, and a node that was killed is reported"
