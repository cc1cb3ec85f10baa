#!/usr/bin/env bash
# What `make matrix` runs: every compiler, standard, sanitizer and architecture at hand.
#
#   tests/matrix.sh               all steps, as many at a time as there are processors
#   tests/matrix.sh list          their names and commands
#   tests/matrix.sh run NAME      one step, here, with its output
#
# A step is a line of steps() below: a name, and a function of this file with its arguments. It
# works in build/matrix/NAME and passes when the function returns 0. `make deps` does not install
# what is needed here; `make matrix` does.
set -u
cd "$(dirname "$0")/.." || exit 1

results=build/matrix
meshes=(examples/meshes/*.obj)
# shellcheck disable=SC2206
meshes+=(${MESHES_TOO:-})                       # more to try: make matrix MESHES_TOO='a.obj b.obj'
# A status of its own, so that no test takes a sanitizer's report for the tool's verdict.
export ASAN_OPTIONS=exitcode=99 MSAN_OPTIONS=exitcode=99
export UBSAN_OPTIONS=exitcode=99:print_stacktrace=1

# ---- the steps -----------------------------------------------------------------------------------

is_x86() { [ "$(uname -m)" = x86_64 ]; }
tests() { for test in tests/test_*.c; do basename "$test" .c; done; }

steps() {
    local test cc std simd
    echo fuzz_topology fuzz 40 -DPSURF_REAL=float
    echo fuzz_topology_double fuzz 20 -DPSURF_REAL=double
    echo cracks_gcc_gnu17 cracks 1-33 gnu17 gcc
    echo cracks_gcc_c++17 cracks 1,2,3,5,8,16,33 gnu++17 gcc -x c++
    echo cracks_clang_gnu17 cracks 1,2,3,5,8,16,33 gnu17 clang
    echo cracks_clang_c++17 cracks 1,2,3,5,8,16,33 gnu++17 clang -x c++
    echo cracks_found_without_symmetry cracks_without_symmetry
    echo hash_found_without_pragmas hash_without_pragmas

    for test in $(tests); do            # but for those that take minutes in an emulator
        echo "clang_sanitized.$test suite clang_sanitized $test"
        echo "clang_memory.$test suite clang_memory $test"
        if is_x86; then echo "m32_sanitized.$test suite m32_sanitized $test"; fi
        case $test in
        test_smooth | test_tessellate | test_eval | test_hash) ;;        # hash_s390x evaluates
        test_scheme_points | test_scheme_seams | test_schemes) ;;
        *) echo "s390x.$test suite s390x $test" ;;
        esac
    done
    if [ -e tests/test_tool.py ]; then echo clang_memory.test_tool tool_suite; fi

    for cc in gcc clang; do
        for std in c99 c11 c17; do echo "warnings_${cc}_$std warnings $cc $std c"; done
        for std in c++11 c++20; do echo "warnings_${cc}_$std warnings $cc $std c++"; done
        echo "warnings_${cc}_programs warnings_programs $cc"
    done
    echo units_c units c c
    echo units_c++ units c++ c
    echo units_used_by_c++ units c c++
    echo symbols_clang sh tests/check_symbols.sh clang
    echo cmake_subdirectory cmake_subdirectory
    echo cmake_installed cmake_installed

    for cc in gcc clang; do
        for level in 0 1 2 3; do echo "hash_${cc}_O$level hash none $cc -O$level"; done
        for simd in NO_AVX2 NO_SIMD; do echo "hash_${cc}_$simd hash none $cc -O2 -DPSURF_$simd"; done
        echo "hash_${cc}_native hash none $cc -std=gnu17 -O3 -march=native"
        echo "hash_${cc}_c++17 hash none $cc -x c++ -std=gnu++17 -O3 -march=native"
    done
    if is_x86; then echo hash_m32 hash none gcc -O2 "$(m32)"; fi
    echo hash_aarch64 hash qemu-aarch64-static aarch64-linux-gnu-gcc -O3 -static
    echo hash_finds_neon hash_finds_neon
    echo hash_s390x hash qemu-s390x-static s390x-linux-gnu-gcc -O3 -static
    echo fuzz_corpus fuzz_corpus
    if [ -e tests/vulkan_layouts.c ]; then echo vulkan_layouts vulkan_layouts; fi
    echo osd_limit osd_limit float
    echo osd_limit_double osd_limit double
    echo gltf_valid gltf_valid
}

# ---- compilers -----------------------------------------------------------------------------------

# 32-bit x86 computes in SSE registers: x87 rounds differently, and psurf_exact() says so.
# <asm/...> is found only beside the 64-bit headers.
m32() { echo "-m32 -msse2 -mfpmath=sse -idirafter /usr/include/$(gcc -print-multiarch)"; }

hostile=(-Wall -Wextra -Wpedantic -Wshadow -Wconversion -Wsign-conversion -Wcast-align -Wcast-qual
    -Wundef -Wdouble-promotion -Wformat=2 -Wswitch-enum -Wvla -Wwrite-strings -Wredundant-decls)
hostile_c=(-Wstrict-prototypes -Wmissing-prototypes -Wc++-compat)
# Left out: layout advice, C89, C++ features for C++98, and bounds that C cannot express.
everything=(-Weverything -Wno-unknown-warning-option -Wno-padded -Wno-declaration-after-statement
    -Wno-unsafe-buffer-usage -Wno-c++98-compat -Wno-c++98-compat-pedantic)
# Left out for C++: what asks that a C header be written in C++ or keep off C++'s reserved names.
everything_cxx=(-Wno-old-style-cast -Wno-zero-as-null-pointer-constant -Wno-reserved-identifier
    -Wno-reserved-macro-identifier)

flags_of() {            # flags_of COMPILER LANGUAGE: the hostile warnings as errors, in `flags`
    flags=(-Werror "${hostile[@]}")
    if [ "$2" = c ]; then flags+=("${hostile_c[@]}"); fi
    if [ "$1" = clang ]; then
        flags+=("${everything[@]}")
        if [ "$2" = c++ ]; then flags+=("${everything_cxx[@]}"); fi
    fi
}

# ---- warnings, units, symbols, packaging ---------------------------------------------------------

warnings() {            # COMPILER STANDARD LANGUAGE
    local flags source define
    flags_of "$1" "$3"
    for define in -DPSURF_REAL=float -DPSURF_REAL=double -DPSURF_NO_STDLIB; do
        for source in implementation declarations; do
            echo "$source $define"
            "$1" -x "$3" -std="$2" -O2 "${flags[@]}" "$define" -I. -c "tests/compile/$source.c" \
                -o "$work/a.o" || return 1
        done
    done
    # PSURF_STATIC marks functions as perhaps unused: clang can warn of the mark itself.
    if [ "$1" = clang ]; then flags+=(-Wno-used-but-marked-unused); fi
    for define in -DPSURF_REAL=float -DPSURF_REAL=double; do
        "$1" -x "$3" -std="$2" -O2 "${flags[@]}" "$define" -I. -c tests/compile/private.c \
            -o "$work/a.o" || return 1
    done
}

warnings_programs() {   # COMPILER
    local source
    for source in examples/*.c bench/*.c fuzz/*.c tests/compile/program.c; do
        "$1" -std=c99 -O2 -Werror "${hostile[@]}" -Wstrict-prototypes -Wmissing-prototypes -I. \
            -c "$source" -o "$work/a.o" || return 1
    done
}

# Two units share the implementation in a third; a fourth keeps a private copy.
units() {               # LANGUAGE-OF-IMPLEMENTATION LANGUAGE-OF-USER
    gcc -x "$1" -O1 -I. -c tests/compile/implementation.c -o "$work/implementation.o" &&
        gcc -x "$2" -O1 -I. -c tests/compile/declarations.c -o "$work/user.o" &&
        gcc -x "$2" -O1 -I. -c tests/compile/private.c -o "$work/private.o" &&
        gcc "$work"/*.o -o "$work/program" -lm && "$work/program"
}

cmake_user() {          # ARGUMENTS...
    cmake -S tests/compile -B "$work/user" "$@" && cmake --build "$work/user" &&
        (cd "$work/user" && ctest --output-on-failure)
}
cmake_subdirectory() { cmake_user -DPATCHSURF_DIR="$PWD"; }
cmake_installed() {
    local version
    version=$(awk '/^#define PSURF_VERSION_(MAJOR|MINOR) /{ printf dot $3; dot = "." }' patchsurf.h)
    cmake -S . -B "$work/build" -DCMAKE_INSTALL_PREFIX="$PWD/$work/prefix" &&
        cmake --install "$work/build" &&
        cmake_user -DCMAKE_PREFIX_PATH="$PWD/$work/prefix" -DPATCHSURF_VERSION="$version"
}

# ---- the same bits everywhere --------------------------------------------------------------------

# build_hash FOLDER COMPILER FLAGS...: test_hash of the header in FOLDER. Only the implementation is
# compiled as all the flags say, as C++ even.
build_hash() {
    local folder=$1 cc=$2 flag plain=()
    shift 2
    for flag in "$@"; do
        case $flag in -x | c++ | -std=*) ;; *) plain+=("$flag") ;; esac
    done
    $cc "$@" -iquote "$folder" -c tests/compile/implementation.c -o "$work/implementation.o" &&
        $cc -std=c99 "${plain[@]}" -iquote "$folder" -Itests/shim -c tests/test_hash.c \
            -o "$work/test.o" &&
        $cc "${plain[@]}" "$work/test.o" "$work/implementation.o" -o "$work/test_hash" -lm
}

hash() {                # EMULATOR COMPILER FLAGS...
    local real run=()
    [ "$1" = none ] || run=("$1")
    shift
    for real in float double; do
        build_hash . "$@" -DPSURF_REAL=$real && "${run[@]}" "$work/test_hash" || return 1
    done
}

# NEON with quotients that are estimates: other bits, and they are found. `make test` does this for
# the sets of x86.
hash_finds_neon() {
    sed 's/vdivq_f32(\(a[.a-z]*\), \(b[.a-z]*\))/vmulq_f32(\1, vrecpeq_f32(\2))/g' patchsurf.h \
        >"$work/patchsurf.h"
    cmp -s patchsurf.h "$work/patchsurf.h" && echo 'nothing to replace' && return 1
    build_hash "$work" aarch64-linux-gnu-gcc -O2 -static || return 1
    qemu-aarch64-static "$work/test_hash" --set neon
    [ $? = 1 ]
}

# The tool round an implementation that was compiled in its own way, without the command report.
tool_around() {         # IMPLEMENTATION.o
    gcc -O2 -I. -DPSURF_IMPLEMENTATION_DONE examples/patchsurf.c "$1" -o "$work/patchsurf" -lm
}

cracks() {              # RATES STANDARD COMPILER [-x c++]
    local rates=$1 std=$2
    shift 2
    "$@" -std="$std" -O3 -march=native -I. -c tests/compile/implementation.c \
        -o "$work/implementation.o" && tool_around "$work/implementation.o" &&
        python3 tests/check_cracks.py --tool "$work/patchsurf" --rates "$rates" "${meshes[@]}"
}

# The pragmas are what keeps the promise: without them products are fused where the processor can, and
# the hashes tell. Where this one cannot, an emulated one can.
hash_without_pragmas() {
    local cc=(gcc -march=native) emulator=
    if ! gcc -march=native -dM -E -x c /dev/null | grep -q '__FMA__'; then
        cc=(aarch64-linux-gnu-gcc -static) emulator=qemu-aarch64-static
    fi
    sed '/#pragma/d' patchsurf.h >"$work/patchsurf.h"
    build_hash "$work" "${cc[@]}" -std=gnu17 -O3 || return 1
    $emulator "$work/test_hash"
    [ $? = 1 ]
}

# Edges that are summed from one end to the other have cracks, and they are found.
cracks_without_symmetry() {
    sed 's/c\[0\] = psurf__l3_mul(psurf__l3_mad(outer, psurf__l_all(3), inner),/c[0] = psurf__l3_mul(\
        psurf__l3_add(psurf__l3_mad(psurf__l3_mad(p0, psurf__l_all(3), p1), psurf__l_all(3), p2), p3),/
        ' patchsurf.h >"$work/patchsurf.h"
    cmp -s patchsurf.h "$work/patchsurf.h" && echo 'nothing to replace' && return 1
    gcc -std=c99 -O2 -iquote "$work" -c tests/compile/implementation.c -o "$work/a.o" &&
        tool_around "$work/a.o" || return 1
    local mesh status
    for mesh in "${meshes[@]}"; do      # but where all edges run alike in both their faces
        python3 tests/check_cracks.py --tool "$work/patchsurf" --rates 7,8 "$mesh"
        status=$?
        case $mesh:$status in *:1 | *cloth.obj:0) ;; *) echo "exit status $status" && return 1 ;; esac
    done
}

# ---- the tests under other compilers, sanitizers and processors ----------------------------------

# implementation CONFIGURATION REAL COMPILER...: compiles it, once for all tests of a configuration:
# they wait for each other here. Sets `object`.
implementation() {
    local real=$2
    object=$results/objects/$1_$real.o
    shift 2
    mkdir -p "${object%/*}"
    (
        flock 9 || exit 1
        for source in patchsurf.h tests/compile/implementation.c tests/matrix.sh; do
            [ "$object" -nt $source ] || rm -f "$object"
        done
        [ -e "$object" ] || { "$@" -std=c99 -I. -DPSURF_REAL="$real" \
            -c tests/compile/implementation.c -o "$object.part" && mv "$object.part" "$object"; }
    ) 9>"$object.lock"
}

suite() {               # CONFIGURATION TEST
    local real cc object emulator=() library=-lcmocka
    case $1 in
    clang_sanitized) cc=(clang -O1 -g "-fsanitize=address,undefined" -fno-sanitize-recover=all) ;;
    clang_memory)
        cc=(clang -O1 -g -fsanitize=memory -fsanitize-memory-track-origins -Itests/shim)
        ;;
    m32_sanitized)      # shellcheck disable=SC2207
        cc=(gcc -O1 -g "-fsanitize=address,undefined" -fno-sanitize-recover=all -Itests/shim $(m32))
        ;;
    s390x)
        cc=(s390x-linux-gnu-gcc -O2 -static -Itests/shim)
        emulator=(qemu-s390x-static)
        ;;
    esac
    case " ${cc[*]} " in *" -Itests/shim "*) library=-lm ;; esac
    for real in float double; do
        implementation "$1" $real "${cc[@]}" &&
            "${cc[@]}" -std=c99 -I. -DPSURF_REAL=$real "tests/$2.c" "$object" -o "$work/$2" \
                $library -lm && "${emulator[@]}" "$work/$2" || return 1
    done
}

tool_suite() {
    clang -O1 -g -fsanitize=memory -I. examples/patchsurf.c examples/report.c \
        -o "$work/patchsurf" -lm &&
        python3 tests/test_tool.py "$work/patchsurf"
}

# ---- fuzzing -------------------------------------------------------------------------------------

fuzz() {                # SECONDS DEFINE
    mkdir -p "$work/corpus"
    clang -g -O1 -I. "$2" -fsanitize=fuzzer,address,undefined -fno-sanitize-recover=all \
        fuzz/fuzz_topology.c -o "$work/fuzz" &&
        "$work/fuzz" -max_total_time="$1" -max_len=512 -len_control=0 -timeout=20 -verbosity=0 \
            -print_final_stats=1 -artifact_prefix="$work/" "$work/corpus" fuzz/corpus/topology
}

fuzz_corpus() {
    gcc -g -O1 -I. -fsanitize=address,undefined -fno-sanitize-recover=all fuzz/fuzz_topology.c \
        fuzz/standalone.c -o "$work/replay" -lm && "$work/replay" fuzz/corpus/topology
}

# ---- a software GPU ------------------------------------------------------------------------------

vulkan_layouts() {
    glslangValidator -V --target-env vulkan1.1 tests/vulkan_layouts.comp -o "$work/layouts.spv" &&
        gcc -std=c99 -O2 -I. tests/vulkan_layouts.c -o "$work/vulkan_layouts" -lvulkan -lm &&
        "$work/vulkan_layouts" "$work/layouts.spv"
}

# Against OpenSubdiv's limit surface, in either precision.
osd_limit() {
    g++ -std=c++14 -O2 -Wall -DPSURF_REAL="$1" -I. tests/osd_limit.cc -o "$work/osd_limit" \
        -lcmocka -losdCPU && "$work/osd_limit" "${meshes[@]}"
}

# The Khronos glTF validator on every sample mesh; skipped where there is no node or no package.
gltf_valid() {
    command -v node >/dev/null && command -v npm >/dev/null || { echo 'no node or npm'; return 77; }
    gcc -std=c99 -O2 -I. examples/patchsurf.c -o "$work/patchsurf" -lm &&
        node tests/gltf_validate.mjs "$work/patchsurf" "${meshes[@]}"
}

# ---- running -------------------------------------------------------------------------------------

run_here() {            # NAME: the step's function, in a folder of its own
    local words
    read -r -a words < <(steps | awk -v name="$1" '$1 == name')
    [ ${#words[@]} -gt 1 ] || { echo "no step $1" >&2 && return 2; }
    work=$results/work/$1
    rm -rf "$work" && mkdir -p "$work" || return 1
    "${words[@]:1}"
}

case ${1-} in
run) run_here "$2" ;;
list) steps ;;
'')
    rm -rf "$results" && mkdir -p "$results"
    steps | cut -d' ' -f1 >"$results/steps"
    xargs -P "$(nproc)" -I{} sh tests/step.sh "$results" {} bash tests/matrix.sh run {} \
        <"$results/steps"
    sh tests/step.sh "$results"
    ;;
*) echo 'usage: tests/matrix.sh [list | run NAME]' >&2 && exit 2 ;;
esac
