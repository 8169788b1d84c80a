#!/usr/bin/env bash
#SBATCH --job-name=sapwise
#SBATCH --exclusive
#SBATCH --ntasks-per-node=1
#SBATCH --time=00:15:00
# Probes every node of a Slurm job, each alone, into one shared folder, and ends with the table of `sapwise check`.
#
#   sbatch --nodes=16 tools/fleet/slurm.sh REPORTS [OPTION OF probe...]
#
# Creates REPORTS if it is missing. Submitted again, it measures the nodes whose report is missing, was disturbed or cut
# short. SAPWISE names the command if it is not on the PATH. The exit status is 1 if a node left no report or a report
# has a problem.
set -euo pipefail
[ $# -ge 1 ] || { echo "usage: sbatch --nodes=N tools/fleet/slurm.sh REPORTS [OPTION OF probe...]" >&2; exit 2; }
folder=$1
shift
sapwise=${SAPWISE:-sapwise}
mkdir -p "$folder"
# A node that fails does not end the others. Two nodes may share a host name, but not the name that Slurm has for them.
failed=0
srun --ntasks-per-node=1 --kill-on-bad-exit=0 \
    bash -c 'export SAPWISE_NODE=$SLURMD_NODENAME; exec "$@"' probe "$sapwise" probe --out "$folder" "$@" || failed=1
# The folder may hold reports of other jobs. The name of a report ends with a hash of its node.
nodes=$(scontrol show hostnames "$SLURM_JOB_NODELIST")
missing=()
for node in $nodes; do
    compgen -G "$folder/*-$(printf %s "$node" | sha256sum | cut -c 1-12).json" >/dev/null || missing+=("$node")
done
there=$((SLURM_JOB_NUM_NODES - ${#missing[@]}))
[ "$there" = 0 ] || "$sapwise" check "$folder"
[ ${#missing[@]} = 0 ] \
    || { echo "$there of $SLURM_JOB_NUM_NODES nodes left a report; submit the job again for ${missing[*]}"; exit 1; }
[ "$failed" = 0 ] || { echo "every node has a report, but a probe failed; its message is above"; exit 1; }
