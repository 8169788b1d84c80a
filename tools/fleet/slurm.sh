#!/usr/bin/env bash
#SBATCH --job-name=sapwise
#SBATCH --exclusive
#SBATCH --ntasks-per-node=1
#SBATCH --time=00:15:00
# Probes every node of a Slurm job, each alone, into one shared folder, tells which can be believed, and trains on them where all can.
#
#   sbatch --nodes=16 tools/fleet/slurm.sh REPORTS [OPTION OF probe...]
#
# REPORTS is made where it is missing. Submitted again, it measures the nodes whose report is missing, was disturbed or cut short. The model goes to
# REPORTS/model/. SAPWISE names the command where it is not on the PATH.
set -euo pipefail
[ $# -ge 1 ] || { echo "usage: sbatch --nodes=N tools/fleet/slurm.sh REPORTS [OPTION OF probe...]" >&2; exit 2; }
folder=$1
shift
sapwise=${SAPWISE:-sapwise}
mkdir -p "$folder"
# A node that fails keeps no other from its end: the table tells. Two nodes may share a host name, and not the name that Slurm has for them.
srun --ntasks-per-node=1 --kill-on-bad-exit=0 bash -c 'export SAPWISE_NODE=$SLURMD_NODENAME; exec "$@"' probe "$sapwise" probe --out "$folder" "$@" || true
"$sapwise" fleet "$folder" --nodes "$SLURM_JOB_NUM_NODES"
mkdir -p "$folder/model"
"$sapwise" train "$folder" --out "$folder/model/model.json" --card "$folder/model/card.md"
