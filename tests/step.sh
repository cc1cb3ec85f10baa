#!/bin/sh
# Runs one step of `make test` or `make matrix`, and sums steps up.
#
#   tests/step.sh DIR NAME COMMAND...
#       runs COMMAND, prints one line with its result and time, leaves DIR/NAME.log and the result in
#       DIR/NAME.result; shows the log of a step that failed. Exit status 77 means skipped.
#   tests/step.sh DIR
#       prints `N passed, N failed` for all steps named in DIR/steps; a step without a result has
#       failed. Exit status 1 if any has.
set -u

limit=${STEP_LIMIT:-600}        # seconds; no step may hang the rest
expect=${STEP_EXPECT:-0}        # exit status of a step that passes; 1 for checks that must fail

run_step() {
    name=$1
    shift
    rm -f "$dir/$name.result"
    start=$(date +%s%N)
    timeout "$limit" "$@" >"$dir/$name.log" 2>&1 </dev/null
    status=$?
    took=$((($(date +%s%N) - start) / 100000000))
    case $status in
    "$expect") result=passed ;;
    77) result=skipped ;;
    124) result=failed && echo "stopped after $limit seconds" >>"$dir/$name.log" ;;
    *) result=failed && echo "exit status $status, not $expect" >>"$dir/$name.log" ;;
    esac
    echo "$result" >"$dir/$name.result"
    report=$(printf '%-8s %-36s %4d.%d s' "$result" "$name" $((took / 10)) $((took % 10)))
    case $result in
    skipped) report="$report  ($(tail -n 1 "$dir/$name.log"))" ;;
    failed) report="$report
$(tail -n 60 "$dir/$name.log" | sed 's/^/    | /')" ;;
    esac
    printf '%s\n' "$report"
}

sum_up() {
    passed=0 failed=0 lost=
    for name in $(cat "$dir/steps"); do
        case $(cat "$dir/$name.result" 2>/dev/null) in
        passed) passed=$((passed + 1)) ;;
        skipped) ;;
        *) failed=$((failed + 1)) lost="$lost $name" ;;
        esac
    done
    [ -z "$lost" ] || echo "failed:$lost"
    echo "$passed passed, $failed failed"
    [ "$failed" = 0 ] && [ "$passed" -gt 0 ]
}

dir=$1
shift
if [ $# = 0 ]; then sum_up; else run_step "$@"; fi
