#!/usr/bin/env bash
# Probes many machines over ssh, all at once, copies their reports into one folder here, and ends with the table of
# `sapwise check`.
#
#   tools/fleet/ssh.sh NODES REPORTS [OPTION OF probe...]
#
# NODES is a file for GNU parallel's --sshloginfile: a host, or user@host, a line; `:` is this machine. No folder need
# be shared. SAPWISE names the command on the machines if it is not on their PATH, SAPWISE_HERE the one here. Run again,
# it measures only the machines whose report is missing, was disturbed or cut short: each machine keeps its own in
# ~/.cache/sapwise/fleet. The exit status is 1 if a machine left no report or a report has a problem.
set -euo pipefail
usage="usage: tools/fleet/ssh.sh NODES REPORTS [OPTION OF probe...]"
[ $# -ge 2 ] || { echo "$usage" >&2; exit 2; }
nodes=$1 folder=$2
shift 2
fail() { echo "ssh.sh: $*" >&2; exit 1; }
command -v parallel >/dev/null || fail "GNU parallel is missing; install the package parallel"
[ -r "$nodes" ] || fail "$nodes can't be read; write a host a line into it, or : for this machine"
count=$(grep -cvE '^[[:space:]]*(#|$)' "$nodes") || fail "$nodes names no machine; write a host a line into it"
sapwise=${SAPWISE:-sapwise}
mkdir -p "$folder"
brought=$(mktemp -d)
trap 'rm -rf "$brought"' EXIT

# A machine that fails does not end the others. GNU parallel shows what it writes to standard error with its name; its
# standard output is the report.
printf -v options ' %q' "$@"
[ $# -gt 0 ] || options=
# shellcheck disable=SC2016 # `$HOME` is that of the machine.
probe='mkdir -p "$HOME/.cache/sapwise/fleet" && '$(printf %q "$sapwise")
probe+=' probe --json --out "$HOME/.cache/sapwise/fleet"'$options
TMPDIR=$brought parallel --nonall --tag --files --will-cite --sshloginfile "$nodes" "$probe" >"$brought/printed" || true

# One file for each machine; its name is a hash of the host's name.
left=0
while IFS=$'\t' read -r host text; do
    [ -s "$text" ] || continue
    left=$((left + 1))
    cp "$text" "$folder/node-$(printf %s "$host" | sha256sum | cut -c 1-12).json"
done <"$brought/printed"
[ "$left" = 0 ] || "${SAPWISE_HERE:-sapwise}" check "$folder"
[ "$left" -ge "$count" ] || fail "$left of $count machines left a report; run it again for the others"
