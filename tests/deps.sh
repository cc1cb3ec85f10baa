#!/bin/sh
# Installs what is missing to build and test this repository.
#
#   tests/deps.sh base      compiler, cmocka, python3: all that `make demo` and `make test` need
#   tests/deps.sh bench     base, and what `make bench` needs: a C++ compiler, OpenSubdiv
#   tests/deps.sh matrix    bench, and what `make matrix` needs: clang, cross compilers, Vulkan ...
#
# Each need is probed by using it, so a machine with other packages or another package manager is
# left alone as long as the thing works. apt-get runs only when a probe fails.
set -u

scratch=$(mktemp -d) || exit 1
trap 'rm -rf "$scratch"' EXIT
log=build/deps.log

cmocka='#include <stdarg.h>
#include <stddef.h>
#include <setjmp.h>
#include <stdint.h>
#include <cmocka.h>
int main(void) { print_message("%s", ""); return 0; }'
vulkan='#include <vulkan/vulkan.h>
int main(void) { return vkEnumerateInstanceVersion(0) == VK_SUCCESS; }'
fuzzer='#include <stddef.h>
#include <stdint.h>
int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size);
int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size) { return data != 0 && size == 0; }'
opensubdiv='#include <opensubdiv/bfr/refinerSurfaceFactory.h>
#include <opensubdiv/osd/cpuEvaluator.h>
int main() { return sizeof(OpenSubdiv::Osd::CpuEvaluator) == 0; }'
program='#include <errno.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
int main(int argc, char **argv) { return argc > 2 && argv[1] && sqrt((double)argc) < 0.0; }'

# builds SOURCE LIBRARY COMPILER FLAGS...: true if the compiler makes a program of them
builds() {
    source=$1
    library=$2
    shift 2
    printf '%s\n' "$source" | "$@" -x c - -o "$scratch/a.out" "-l$library" >/dev/null 2>&1
}
builds_cxx() {          # SOURCE LIBRARY
    printf '%s\n' "$1" | g++ -x c++ - -o "$scratch/a.out" "-l$2" >/dev/null 2>&1
}
runs() { command -v "$1" >/dev/null 2>&1; }

multilib_flags() {      # <asm/...> of 32-bit programs is found only beside the 64-bit one
    echo "-m32 -idirafter /usr/include/$(gcc -print-multiarch)"
}

missing_base() {
    builds "$program" m gcc -fsanitize=address,undefined || echo gcc libc6-dev
    builds "$cmocka" cmocka gcc || echo libcmocka-dev
    python3 -c 'import json, struct' >/dev/null 2>&1 || echo python3
}

missing_bench() {
    builds_cxx 'int main() { delete new int; }' stdc++ || echo g++
    builds_cxx "$opensubdiv" osdCPU || echo libosd-dev
}

missing_matrix() {
    runs clang || echo clang
    builds "$fuzzer" m clang -fsanitize=fuzzer,address || clang_runtime
    runs cmake || echo cmake
    if [ "$(uname -m)" = x86_64 ]; then
        # Not gcc-multilib: it conflicts with the cross compilers.
        # shellcheck disable=SC2046
        builds "$program" m gcc $(multilib_flags) || echo "gcc-$(gcc_major)-multilib"
    fi
    builds "$program" m aarch64-linux-gnu-gcc -static ||
        echo gcc-aarch64-linux-gnu libc6-dev-arm64-cross
    builds "$program" m s390x-linux-gnu-gcc -static ||
        echo gcc-s390x-linux-gnu libc6-dev-s390x-cross
    { runs qemu-aarch64-static && runs qemu-s390x-static; } || echo qemu-user-static
    builds "$vulkan" vulkan gcc || echo libvulkan-dev
    runs glslangValidator || echo glslang-tools
    ls /usr/share/vulkan/icd.d/lvp_icd.*json >/dev/null 2>&1 || echo mesa-vulkan-drivers
    ls /usr/share/vulkan/explicit_layer.d/*validation* >/dev/null 2>&1 ||
        echo vulkan-validationlayers
}

gcc_major() {
    if runs gcc; then
        gcc -dumpversion | cut -d. -f1
    else
        apt-cache depends gcc | sed -n 's/.*Depends: gcc-\([0-9]*\)$/\1/p'
    fi
}

clang_runtime() {       # the sanitizers of the clang that is, or will be, `clang`
    version=$(apt-cache depends clang | sed -n 's/.*Depends: clang-\([0-9]*\)$/\1/p')
    for package in "libclang-rt-$version-dev" "libclang-common-$version-dev"; do
        if apt-cache show "$package" >/dev/null 2>&1; then
            echo "$package"
            return
        fi
    done
}

missing() {
    missing_base
    if [ "$set" != base ]; then missing_bench; fi
    if [ "$set" = matrix ]; then missing_matrix; fi
}

as_root() {
    if [ "$(id -u)" = 0 ]; then
        env DEBIAN_FRONTEND=noninteractive "$@"
    elif [ -t 0 ]; then
        sudo env DEBIAN_FRONTEND=noninteractive "$@"
    else
        sudo -n env DEBIAN_FRONTEND=noninteractive "$@" </dev/null
    fi
}

fail() {
    echo "deps: $1" >&2
    exit 1
}

apt() { as_root apt-get -o DPkg::Lock::Timeout=300 "$@" >>"$log" 2>&1; }

set=${1:-base}
case $set in base | bench | matrix) ;; *) fail "unknown set '$set': base, bench or matrix" ;; esac

if [ -z "$(missing)" ]; then
    echo "deps: nothing is missing"
    exit 0
fi
packages=$(missing | tr '\n' ' ')
runs apt-get || fail "missing: $packages(Debian names), and there is no apt-get to install them"
[ "$(id -u)" = 0 ] || runs sudo || fail "missing: ${packages}- become root or install them yourself"

mkdir -p build || exit 1
: >"$log"
echo "deps: reading package lists"
apt update || echo "deps: apt-get update failed; trying with the lists at hand" >&2
packages=$(missing | tr '\n' ' ')       # versioned names are known only now
echo "deps: installing $packages"
# shellcheck disable=SC2086
if ! apt -y --no-install-recommends install $packages; then
    tail -n 12 "$log" >&2
    fail "apt-get could not install $packages(whole log: $log)"
fi
sed -n 's/^After this operation, /deps: /p' "$log"
left=$(missing | tr '\n' ' ')
[ -z "$left" ] || fail "installed, but still not usable: $left(log: $log)"
