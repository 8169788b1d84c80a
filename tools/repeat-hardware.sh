#!/usr/bin/env bash
# Measures the hardware parameters of the CPU several times in a row and tells how well they repeat.
#
#     tools/repeat-hardware.sh [TIMES]          10 by default
#
# Prints for each measured parameter the median, the interquartile range over the median, and the extremes over the median,
# and whether the range is within 5 % for rates and ratios and 15 % for times. Where the host of a virtual machine had its cores
# near each other in some measurements and far apart in others, what several cores do differs by as much as the machine does:
# the measurements of each distance are then told on their own. Ends with status 1 where a range is too wide.
#
# A measurement in which other programs took more than 5 % of the CPU is thrown away and repeated, 4 times TIMES at most.
# Needs Linux, bash, awk, cargo, and a C compiler with OpenMP in CC (default: cc).
set -euo pipefail
cd "$(dirname "$0")/.."

wanted=${1:-10}
threads=$(nproc)
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
: >"$work/pairs"
# shellcheck source=tools/compare/lib.sh
. tools/compare/lib.sh
start_sapwise

kinds=(clock caches memory fork_join scaling arithmetic)
# One measurement of every family, as lines of name, distance and value in $work/staged.
group_all() {
    local kind near name
    : >"$work/all"
    for kind in "${kinds[@]}"; do
        take ours part hardware "$kind" || return
        cat "$work/ours.out" >>"$work/all"
    done
    near=$(figure "$work/all" core_to_core_ns value)
    grep -o '{"name":"[^"]*"[^}]*"how":"measured"' "$work/all" | sed 's/^{"name":"//; s/".*//' >"$work/names"
    while read -r name; do
        printf '%s\t%s\t%s\n' "$name" "${near:-1}" "$(figure "$work/all" "$name" value)" >>"$work/staged"
    done <"$work/names"
}
rounds all "$wanted"

awk -F '\t' '
    function sorted(key, n,   i, j, x) {
        for (i = 2; i <= n; i++) { x = v[key, i]; for (j = i - 1; j > 0 && v[key, j] > x; j--) v[key, j + 1] = v[key, j]; v[key, j + 1] = x }
    }
    function q(key, n, p,   at, low) {
        at = 1 + (n - 1) * p; low = int(at)
        return low < n ? v[key, low] + (v[key, low + 1] - v[key, low]) * (at - low) : v[key, low]
    }
    function add(key, x) { v[key, ++count[key]] = x }
    NR == FNR { if (!least || $2 < least) least = $2; next }
    {
        if (!($1 in known)) { known[$1] = 1; order[++names] = $1 }
        add($1, $3)
        add($1 (($2 > 2 * least) ? ", cores far apart" : ", cores near"), $3)
        if ($2 > 2 * least) far = 1; else near = 1
    }
    function row(key,   n, m, spread, limit, wide) {
        n = count[key]
        if (!n) return 0
        sorted(key, n)
        m = q(key, n, 0.5); spread = (q(key, n, 0.75) - q(key, n, 0.25)) / m; limit = key ~ /_ns/ ? 0.15 : 0.05
        wide = spread > limit && key !~ /^core_to_core/
        printf "%-52s %10.4g  %5.1f %%  %.3f..%.3f %4d  %s\n", key, m, 100 * spread, v[key, 1] / m, v[key, n] / m, n, \
            wide ? "TOO WIDE" : spread > limit ? "as the host placed the cores" : "good"
        return wide
    }
    END {
        printf "%-52s %10s  %7s  %-13s %3s\n", "parameter", "median", "IQR", "extremes", "n"
        for (k = 1; k <= names; k++) {
            if (!(near && far)) { bad += row(order[k]); continue }
            bad += row(order[k] ", cores near")
            bad += row(order[k] ", cores far apart")
        }
        exit bad > 0
    }' "$work/pairs" "$work/pairs"
