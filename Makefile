# Every task of this repository. The library itself needs no building: it is patchsurf.h.

define HELP
make deps     install what demo and test need (gcc, cmocka, python3), where it is missing
make demo     build the tool and turn the sample meshes into smooth GLB files in build/demo
make test     build and run every test
make matrix   compilers, standards, sanitizers, architectures, fuzzing; installs what they need
make tool     build/patchsurf, the command-line tool
make bench    race OpenSubdiv, two or three minutes; installs it (libosd-dev) where it is missing
make clean    remove build/

CC, CFLAGS   the compiler and its flags, here: $(CC) $(CFLAGS)
endef

.DEFAULT_GOAL := help
.PHONY: help deps demo test matrix tool bench clean run-tests FORCE
.DELETE_ON_ERROR:
.SECONDARY:

ifeq ($(origin CC),default)
CC := gcc
endif
CFLAGS ?= -O2
WARNINGS := -Wall -Wextra -Wpedantic -Wshadow -Wconversion -Wsign-conversion -Wcast-align \
  -Wcast-qual -Wundef -Wdouble-promotion -Wstrict-prototypes -Wmissing-prototypes -Wformat=2 \
  -Wswitch-enum -Wvla -Wwrite-strings
TEST_FLAGS := -Wall -Wextra
# With sanitizers, gcc warns of values it has lost sight of.
# Of -g, line numbers are enough: variables would take gcc longer than all the rest.
SANITIZE := -g1 -fsanitize=address,undefined -fno-sanitize-recover=all -Wno-maybe-uninitialized
# A status of its own, so that no test takes a sanitizer's report for the tool's verdict.
SANITIZED_EXIT := ASAN_OPTIONS=exitcode=99 UBSAN_OPTIONS=exitcode=99
# $(call COMPILE,FLAGS,LIBRARIES): the first prerequisite. V=1 shows the command.
COMPILE = $(if $(V),,@echo '  $(CC) $@' &&) $(CC) -std=c99 -I. -MMD -MP $(1) $< -o $@ $(2)

# `make deps test` installs before it compiles, with -j as well.
AFTER_DEPS := $(filter deps,$(MAKECMDGOALS))

help:
	$(info $(HELP))
	@:

deps:
	@sh tests/deps.sh base

clean:
	rm -rf build

# ---- the tool and what it makes ------------------------------------------------------------------

TOOL := build/patchsurf
MESHES := $(sort $(wildcard examples/meshes/*.obj))
DEMOS := $(MESHES:examples/meshes/%.obj=build/demo/%.glb)

tool: $(TOOL)

# The library in float with all commands but one, and in double with the command report.
$(TOOL): build/report.o
$(TOOL): examples/patchsurf.c | build $(AFTER_DEPS)
	$(call COMPILE,$(CFLAGS) $(WARNINGS),build/report.o -lm)
build/report.o: examples/report.c | build $(AFTER_DEPS)
	$(call COMPILE,$(CFLAGS) $(WARNINGS) -c)

build/demo/%.glb: examples/meshes/%.obj $(TOOL) | build/demo
	@$(TOOL) tessellate --quiet $< -o $@

demo: $(DEMOS)
	@echo 'Smooth surfaces of the sample meshes, for any glTF viewer:'
	@for glb in $^; do \
	    printf '  %-34s %8d bytes\n' "$$glb" $$(wc -c < "$$glb"); \
	done

# ---- the benchmark -------------------------------------------------------------------------------

BENCH_FLAGS := -O3
BENCH_OBJECTS := $(patsubst bench/%,build/obj/%.o,$(wildcard bench/*.c bench/*.cc))
BENCH_COMMON = -I. -MMD -MP $(BENCH_FLAGS) -DBENCH_FLAGS='"$(BENCH_FLAGS)"' -c $< -o $@

.PHONY: bench-deps
bench-deps:
	@sh tests/deps.sh bench

build/obj/%.c.o: bench/%.c | build/obj bench-deps $(AFTER_DEPS)
	$(if $(V),,@echo '  $(CC) $@' &&) $(CC) -std=c99 $(WARNINGS) $(BENCH_COMMON)
build/obj/%.cc.o: bench/%.cc | build/obj bench-deps $(AFTER_DEPS)
	$(if $(V),,@echo '  $(CXX) $@' &&) $(CXX) -std=c++11 \
	    $(filter-out -Wstrict-prototypes -Wmissing-prototypes,$(WARNINGS)) $(BENCH_COMMON)
build/bench: $(BENCH_OBJECTS)
	$(if $(V),,@echo '  $(CXX) $@' &&) $(CXX) $(BENCH_OBJECTS) -o $@ -losdCPU -lpthread -lm

bench: build/bench
	@build/bench

-include $(wildcard build/obj/*.d)

build build/demo build/san build/obj:
	@mkdir -p $@

# ---- tests ---------------------------------------------------------------------------------------

# Every tests/test_X.c is a cmocka program, built for float and for double, plain and with
# sanitizers; some also for the instruction sets that the processor here would pass over. Every
# tests/*.py judges the tool or the sources. One step each.

# More meshes to try: make test MESHES_TOO='a.obj b.obj'.
MESHES_TOO ?=

PROGRAMS := $(patsubst tests/%.c,%,$(sort $(wildcard tests/test_*.c)))
PROGRAM_STEPS := $(foreach t,$(PROGRAMS),$(t) $(t)_double $(t).sanitized $(t)_double.sanitized)
SIMD_STEPS := $(foreach t,test_eval test_hash test_tessellate,$(t)_NO_AVX2 $(t)_NO_SIMD)
ESTIMATES := avx2 sse2
SCRIPTS := $(patsubst tests/%.py,%,$(sort $(wildcard tests/test_*.py)))
TOOL_STEPS := cracks cracks_found counts $(foreach t,$(SCRIPTS),$(t) $(t).sanitized)
STEPS := $(TOOL_STEPS) $(PROGRAM_STEPS) $(SIMD_STEPS) $(ESTIMATES:%=hash_finds_%) symbols docs
RUN := @sh tests/step.sh build/results

# Without -j on the command line, all processors work.
JOBS = $(if $(findstring -j,$(MAKEFLAGS)),,-j$(shell nproc))

test: $(AFTER_DEPS)
	@rm -rf build/results && mkdir -p build/results
	@echo $(STEPS) > build/results/steps
	@$(MAKE) -k --no-print-directory $(JOBS) run-tests || true
	@sh tests/step.sh build/results

run-tests: $(STEPS:%=build/results/%)

# $(eval $(call TEST_BUILD,PREFIX,SUFFIX,FLAGS,HEADER)): the implementation, compiled once, and the
# programs that are linked with it; HEADER: a patchsurf.h that has to be made first.
define TEST_BUILD
$(1)implementation$(2).o: tests/compile/implementation.c $(4) | $(patsubst %/,%,$(1)) $$(AFTER_DEPS)
	$$(call COMPILE,$(3) $$(TEST_FLAGS) -c)
$(1)test_%$(2): tests/test_%.c $(1)implementation$(2).o | $(patsubst %/,%,$(1)) $$(AFTER_DEPS)
	$$(call COMPILE,$(3) $$(TEST_FLAGS),$(1)implementation$(2).o -lcmocka -lm)
endef
$(eval $(call TEST_BUILD,build/,,$$(CFLAGS)))
$(eval $(call TEST_BUILD,build/,_double,$$(CFLAGS) -DPSURF_REAL=double))
$(eval $(call TEST_BUILD,build/,_NO_AVX2,$$(CFLAGS) -DPSURF_NO_AVX2))
$(eval $(call TEST_BUILD,build/,_NO_SIMD,$$(CFLAGS) -DPSURF_NO_SIMD))
$(eval $(call TEST_BUILD,build/san/,,-O1 $$(SANITIZE)))
$(eval $(call TEST_BUILD,build/san/,_double,-O1 $$(SANITIZE) -DPSURF_REAL=double))
build/san/patchsurf: build/san/report.o
build/san/patchsurf: examples/patchsurf.c | build/san $(AFTER_DEPS)
	$(call COMPILE,-O1 $(SANITIZE) $(WARNINGS),build/san/report.o -lm)
build/san/report.o: examples/report.c | build/san $(AFTER_DEPS)
	$(call COMPILE,-O1 $(SANITIZE) $(WARNINGS) -c)

# Instruction sets whose quotients are estimates: other bits, which test_hash must find.
ESTIMATE_avx2 := s/_mm256_div_ps(a, b)/_mm256_mul_ps(a, _mm256_rcp_ps(b))/
ESTIMATE_sse2 := s/_mm_div_ps(\(a[.a-z]*\), \(b[.a-z]*\))/_mm_mul_ps(\1, _mm_rcp_ps(\2))/g
ESTIMATE_FLAGS_sse2 := -DPSURF_NO_AVX2
$(ESTIMATES:%=build/%):
	@mkdir -p $@
$(ESTIMATES:%=build/%/patchsurf.h): build/%/patchsurf.h: patchsurf.h | build/%
	@sed '$(ESTIMATE_$*)' $< > $@ && ! cmp -s $< $@ || \
	    { echo '$@: nothing to replace' >&2; exit 1; }
$(foreach e,$(ESTIMATES),$(eval $(call TEST_BUILD,build/$(e)/,,-iquote build/$(e) $$(CFLAGS) \
  $(ESTIMATE_FLAGS_$(e)),build/$(e)/patchsurf.h)))
$(ESTIMATES:%=build/results/hash_finds_%): build/results/hash_finds_%: build/%/test_hash FORCE
	@STEP_EXPECT=1 sh tests/step.sh build/results $(@F) $< --set $*

build/results/test_%.sanitized: build/san/test_% FORCE
	$(RUN) $(@F) $<
build/results/symbols: FORCE
	$(RUN) $(@F) sh tests/check_symbols.sh $(CC)
build/results/docs: FORCE
	$(RUN) $(@F) python3 tests/check_docs.py $(CC)
build/results/counts: $(TOOL) FORCE
	$(RUN) $(@F) python3 tests/count_mesh.py --tool $(TOOL) $(MESHES) $(MESHES_TOO)
build/results/cracks: $(TOOL) FORCE
	$(RUN) $(@F) python3 tests/check_cracks.py --tool $(TOOL) --rates 1,2,3,7,8 $(MESHES)
build/results/cracks_found: $(TOOL) FORCE
	@STEP_EXPECT=1 sh tests/step.sh build/results $(@F) \
	    python3 tests/check_cracks.py --tool $(TOOL) --rates 3 --flip $(firstword $(MESHES))
$(SCRIPTS:%=build/results/%): build/results/%: tests/%.py $(TOOL) FORCE
	$(RUN) $(@F) python3 $< $(TOOL)
$(SCRIPTS:%=build/results/%.sanitized): build/results/%.sanitized: \
  tests/%.py build/san/patchsurf FORCE
	@$(SANITIZED_EXIT) sh tests/step.sh build/results $(@F) python3 $< build/san/patchsurf
build/results/test_%: build/test_% FORCE
	$(RUN) $(@F) $<

FORCE:

matrix:
	@sh tests/deps.sh matrix
	@bash tests/matrix.sh

-include $(wildcard build/*.d build/san/*.d $(ESTIMATES:%=build/%/*.d))
