#!/bin/sh
# The header defines no symbol and no macro without its prefix, has no writable data, and asks
# nothing of the C library but what it says, and of the compiler's which processor this is.
#
#   tests/check_symbols.sh [COMPILER [FLAGS...]]
set -u

[ $# -gt 0 ] || set -- gcc
scratch=$(mktemp -d) || exit 1
trap 'rm -rf "$scratch"' EXIT

# complain WHAT: each line of standard input is an offender. In a file, since pipes are subshells.
complain() { sort -u | sed "s/^/$1: /" >>"$scratch/complaints"; }

# object NAME [DEFINE...]: compiles the implementation
object() {
    name=$1
    shift
    {
        for define in "$@" PSURF_IMPLEMENTATION; do echo "#define $define"; done
        echo '#include "patchsurf.h"'
    } >"$scratch/$name.c"
    # Not as PIE: there, constant tables of pointers count as data until they are relocated.
    $compiler -O1 -I. -fno-pic -fno-stack-protector -c "$scratch/$name.c" \
        -o "$scratch/$name.o" || exit 1
}
undefined() { nm -u "$scratch/$1.o" | awk '$NF != "_GLOBAL_OFFSET_TABLE_" { print $NF }'; }
defined() { nm --defined-only "$scratch/$1.o"; }
macros() {              # names of all macros after some lines of C
    printf '%s\n' "$@" | $compiler -I. -dM -E -x c - | awk '{ sub(/\(.*/, "", $2); print $2 }' |
        sort -u
}
# new_macros LINE...: those that the header adds to the standard ones
new_macros() {
    headers='#include <stddef.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>
#include <math.h>
#include <float.h>
#include <limits.h>'
    case $(macros '') in                # and of the instruction set in use
    *__SSE2__*) headers="$headers
#include <immintrin.h>" ;;
    *__ARM_NEON*) headers="$headers
#include <arm_neon.h>" ;;
    esac
    macros "$headers" >"$scratch/before"
    macros "$headers" "$@" | comm -13 "$scratch/before" -
}

compiler=$*
object normal
object static PSURF_STATIC
object bare PSURF_NO_STDLIB

defined normal | awk '$2 ~ /[A-Z]/ && $3 !~ /^psurf_[a-z]/ { print $3 }' |
    complain 'exported without the prefix psurf_'
defined normal | awk '$2 ~ /[a-z]/ && $3 !~ /^\.|\.[0-9]+$/ && $3 !~ /^psurf_/ { print $3 }' |
    complain 'private, without the prefix psurf_'
defined normal | awk '$2 ~ /[bBdDcC]/ && $3 !~ /^\./ { print $3 }' | complain 'writable data'
defined static | awk '$2 ~ /[A-Z]/ { print $3 }' | complain 'exported with PSURF_STATIC'
undefined normal | grep -v -x -E 'malloc|free|mem(cpy|set|move|cmp)|sqrtf?|__cpu_model' |
    complain 'asked of the C library'
undefined bare | grep -v -x -E 'mem(cpy|set|move|cmp)|sqrtf?|__cpu_model' |
    complain 'asked of the C library with PSURF_NO_STDLIB'

new_macros '#include "patchsurf.h"' >"$scratch/api"
grep -v '^PSURF_[A-Z]' "$scratch/api" | complain 'macro without the prefix PSURF_, or private'
new_macros '#define PSURF_IMPLEMENTATION' '#include "patchsurf.h"' | comm -13 "$scratch/api" - |
    grep -v '^PSURF_[A-Z]' | complain 'macro that the implementation leaves defined'

exported=$(defined normal | awk '$2 == "T"' | wc -l)
[ "$exported" -gt 0 ] || echo 'nothing at all' | complain 'exported'
cat "$scratch/complaints"
echo "$compiler: $exported symbols and $(wc -l <"$scratch/api") macros," \
    "$(wc -l <"$scratch/complaints") complaints"
[ ! -s "$scratch/complaints" ]
