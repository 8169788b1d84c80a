# shellcheck shell=bash disable=SC2154
# What tools/compare-hardware.sh is made of: runs that are watched for foreign load, pairs of
# figures, and their table. Needs $work, a folder that is thrown away, and $threads, the processors that this process may use.

cpus=$(grep -c '^cpu[0-9]' /proc/stat)

say() { echo "$(basename "$0" .sh): $*" >&2; }

# Builds our command and the programs in C beside it.
cc=${CC:-cc}
start_sapwise() {
    cargo build --quiet --release -p sapwise-cli
    sapwise=${CARGO_TARGET_DIR:-target}/release/sapwise
    "$cc" -O2 -fopenmp tools/compare/reference.c -o "$work/reference"
    # A part of a measurement ends when its standard input does, so it gets one that nobody writes to and nobody closes.
    mkfifo "$work/open"
    exec 9<>"$work/open"
    : >"$work/loads"
    : >"$work/distances"
}
part() { "$sapwise" part "$@" <&9; }

# Whether a program is there; says once what is missing and how to get it, if not.
have() {
    command -v "$1" >/dev/null && return
    [ -e "$work/missing-$1" ] || say "left out: $1 is not installed ($2)"
    touch "$work/missing-$1"
    return 1
}

# Busy time is what idle and waiting time leave of the wall clock, as in src/measure/foreign_load.rs.
idle_ticks() { awk '/^cpu / { print $5 + $6; exit }' /proc/stat; }

# How far apart two cores lie, in ns; nothing where there is one.
distance() { if [ "$threads" -gt 1 ]; then "$work/reference" distance; fi; }

# take NAME COMMAND...: runs a command, its output in $work/NAME.out. Notes the seconds of CPU that others took meanwhile and
# that there were in $work/loads, and how far apart two cores lay before and after in $work/distances.
take() {
    local out=$work/$1.out before after
    shift
    distance >>"$work/distances"
    before=$(idle_ticks)
    TIMEFORMAT='%R %U %S'
    { time "$@" >"$out" 2>"$work/errors"; } 2>"$work/time" || { say "$1 failed: $(tail -n 1 "$work/errors")"; return 1; }
    after=$(idle_ticks)
    distance >>"$work/distances"
    tail -n 1 "$work/time" | awk -v idle=$((after - before)) -v cpus="$cpus" \
        '{ all = $1 * cpus; print all - idle / 100 - $2 - $3, all }' \
        >>"$work/loads"
}

# figure FILE NAME value|best: the value of one of our parameters, or the best of its raw samples, from one line of JSON.
figure() {
    grep -o "{\"name\":\"$2\"[^}]*}" "$1" | awk -v what="$3" '{
        if (what == "value") { if (match($0, /"value":[0-9.e+-]+/)) print substr($0, RSTART + 8, RLENGTH - 8); exit }
        if (!match($0, /"raw":\[[^]]*/)) exit
        count = split(substr($0, RSTART + 7, RLENGTH - 7), raw, ",")
        for (k = 1; k <= count; k++) if (raw[k] + 0 > best) best = raw[k] + 0
        print best
    }'
}

# pair ROW TOOL OURS THEIRS [REASON]: two figures of the same thing. The reason says why they may differ.
pair() {
    if [ -z "$3" ] || [ -z "$4" ]; then return; fi
    printf '%s\t%s\t%s\t%s\t%s\n' "$1" "$2" "$3" "$4" "${5:-}" >>"$work/staged"
}

# quiet GROUP: whether what was taken since the last call is of a quiet machine whose cores, where the group uses several,
# stayed where they were. Says why not.
quiet() {
    local load moved
    # Over all runs of the round: one of 50 ms holds too few ticks of the system's clock to judge it.
    load=$(awk '{ foreign += $1; all += $2 } END { printf "%.3f\n", (all > 0 ? foreign / all : 1) }' "$work/loads")
    moved=$(sort -g "$work/distances" | awk 'NF { if (!low) low = $1; high = $1 } END { if (high > 2 * low) print low " and " high }')
    : >"$work/loads"
    : >"$work/distances"
    case $1 in clock | latency | reported | vulkan) moved= ;; esac
    if awk -v load="$load" 'BEGIN { exit !(load > 0.05) }'; then
        say "thrown away: others took $load of the CPU"
        return 1
    fi
    if [ -n "$moved" ]; then
        say "thrown away: the host moved the cores, which lay $moved ns apart"
        return 1
    fi
}

# rounds GROUP COUNT: takes a group until that many of its rounds were quiet, 4 times as often at most.
rounds() {
    local group=$1 wanted=$2 kept=0 tried=0
    : >"$work/loads"
    : >"$work/distances"
    while [ "$kept" -lt "$wanted" ] && [ "$tried" -lt $((4 * wanted)) ]; do
        tried=$((tried + 1))
        : >"$work/staged"
        if ! "group_$group"; then
            say "the group $group is left out"
            return
        fi
        if quiet "$group"; then
            cat "$work/staged" >>"$work/pairs"
            kept=$((kept + 1))
        else
            sleep 2
        fi
    done
    say "$group: $kept rounds kept of $tried"
}

# Median of both, and median and quartiles of the ratio ours / theirs taken pair by pair, for each row and tool.
table() {
    awk -F '\t' '
        function sorted(key, n,   i, j, x) {
            for (i = 2; i <= n; i++) { x = v[key, i]; for (j = i - 1; j > 0 && v[key, j] > x; j--) v[key, j + 1] = v[key, j]; v[key, j + 1] = x }
        }
        function q(key, n, p,   at, low) {
            at = 1 + (n - 1) * p; low = int(at)
            return low < n ? v[key, low] + (v[key, low + 1] - v[key, low]) * (at - low) : v[key, low]
        }
        {
            key = $1 "\t" $2
            if (!(key in count)) { order[++rows] = key; why[key] = $5 }
            n = ++count[key]
            v[key "o", n] = $3; v[key "t", n] = $4; v[key "r", n] = $4 > 0 ? $3 / $4 : 0
        }
        END {
            format = "%-36s %-28s %10s %10s  %-5s  %-13s %3s  %s\n"
            printf format, "parameter", "against", "ours", "theirs", "ratio", "quartiles", "n", "verdict"
            for (k = 1; k <= rows; k++) {
                key = order[k]; n = count[key]
                sorted(key "o", n); sorted(key "t", n); sorted(key "r", n)
                split(key, name, "\t")
                ratio = q(key "r", n, 0.5)
                within = ratio >= 0.95 && ratio <= 1.05
                verdict = within ? "within 5 %" : why[key] != "" ? why[key] : "DIFFERS, and no reason is known"
                printf format, name[1], name[2], sprintf("%.4g", q(key "o", n, 0.5)), sprintf("%.4g", q(key "t", n, 0.5)), \
                    sprintf("%.3f", ratio), sprintf("%.3f..%.3f", q(key "r", n, 0.25), q(key "r", n, 0.75)), n, verdict
            }
        }' "$work/pairs"
}
