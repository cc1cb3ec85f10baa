/* As much of cmocka's interface as the tests here use, in one header. For targets that have no
   libcmocka, and for MemorySanitizer, which needs every line instrumented: put -Itests/shim first.
   Everywhere else the tests use cmocka itself. */
#ifndef PSURF_TESTS_SHIM_CMOCKA_H
#define PSURF_TESTS_SHIM_CMOCKA_H

#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#if defined(__GNUC__)
#define SHIM_UNUSED __attribute__((unused))
#define SHIM_NORETURN __attribute__((unused, noreturn))
#else
#define SHIM_UNUSED
#define SHIM_NORETURN
#endif

typedef int (*CMFixtureFunction)(void **state);
struct CMUnitTest {
    const char *name;
    void (*test_func)(void **state);
    CMFixtureFunction setup_func, teardown_func;
    void *initial_state;
};

static jmp_buf shim_leave;              /* of the test that runs */
enum { SHIM_FAILED = 1, SHIM_SKIPPED };

SHIM_UNUSED static void print_message(const char *format, ...)
{
    va_list args;
    va_start(args, format);
    vprintf(format, args);
    va_end(args);
}

SHIM_UNUSED static void print_error(const char *format, ...)
{
    va_list args;
    va_start(args, format);
    vprintf(format, args);
    va_end(args);
}

SHIM_NORETURN static void shim_fail(const char *file, int line)
{
    printf("%s:%d: error: Failure!\n", file, line);
    longjmp(shim_leave, SHIM_FAILED);
}

SHIM_UNUSED static void shim_true(int truth, const char *what, const char *file, int line)
{
    if (!truth) {
        printf("not true: %s\n", what);
        shim_fail(file, line);
    }
}

SHIM_UNUSED static void shim_equal(uintmax_t a, uintmax_t b, int equal, const char *file, int line)
{
    if ((a == b) != equal) {
        printf("%#jx %s %#jx\n", a, equal ? "!=" : "==", b);
        shim_fail(file, line);
    }
}

#define fail() shim_fail(__FILE__, __LINE__)
#define fail_msg(...) (print_error(__VA_ARGS__), print_error("\n"), fail())
#define skip() longjmp(shim_leave, SHIM_SKIPPED)

#define assert_true(c) shim_true(!!(c), #c, __FILE__, __LINE__)
#define assert_false(c) shim_true(!(c), "!(" #c ")", __FILE__, __LINE__)
#define assert_null(p) assert_true((p) == NULL)
#define assert_non_null(p) assert_true((p) != NULL)
#define assert_ptr_equal(a, b) assert_true((const void *)(a) == (const void *)(b))
#define assert_ptr_not_equal(a, b) assert_true((const void *)(a) != (const void *)(b))
#define assert_int_equal(a, b) shim_equal((uintmax_t)(a), (uintmax_t)(b), 1, __FILE__, __LINE__)
#define assert_int_not_equal(a, b) shim_equal((uintmax_t)(a), (uintmax_t)(b), 0, __FILE__, __LINE__)
#define assert_in_range(x, low, high)                                                              \
    assert_true((uintmax_t)(x) >= (uintmax_t)(low) && (uintmax_t)(x) <= (uintmax_t)(high))
#define assert_string_equal(a, b) assert_true(strcmp((a), (b)) == 0)
#define assert_string_not_equal(a, b) assert_true(strcmp((a), (b)) != 0)
#define assert_memory_equal(a, b, size) assert_true(memcmp((a), (b), (size)) == 0)
#define assert_memory_not_equal(a, b, size) assert_true(memcmp((a), (b), (size)) != 0)

#define cmocka_unit_test(f) {#f, f, NULL, NULL, NULL}
#define cmocka_unit_test_setup_teardown(f, setup, teardown) {#f, f, setup, teardown, NULL}
#define cmocka_run_group_tests(tests, setup, teardown)                                             \
    cmocka_run_group_tests_name(#tests, tests, setup, teardown)
#define cmocka_run_group_tests_name(name, tests, setup, teardown)                                  \
    shim_run(name, tests, sizeof(tests) / sizeof((tests)[0]), setup, teardown)

/* Runs one test: 0, SHIM_FAILED or SHIM_SKIPPED. */
SHIM_UNUSED static int shim_run_one(const struct CMUnitTest *test, void **state)
{
    int outcome = setjmp(shim_leave);
    if (outcome == 0) {
        if (test->setup_func && test->setup_func(state))
            return SHIM_FAILED;
        test->test_func(state);
        if (test->teardown_func && test->teardown_func(state))
            return SHIM_FAILED;
    }
    return outcome;
}

SHIM_UNUSED static int shim_run(const char *name, const struct CMUnitTest *tests, size_t count,
                                CMFixtureFunction setup, CMFixtureFunction teardown)
{
    static const char *const words[3] = {"OK", "FAILED", "SKIPPED"};
    int failed = 0;
    void *group = NULL;
    if (setup && setup(&group))
        return 1;
    for (size_t i = 0; i < count; i++) {
        void *state = tests[i].initial_state ? tests[i].initial_state : group;
        int outcome = shim_run_one(&tests[i], &state);
        failed += outcome == SHIM_FAILED;
        printf("[ %-7s ] %s\n", words[outcome], tests[i].name);
        fflush(stdout);
    }
    if (teardown)
        failed += teardown(&group) != 0;
    printf("%s: %d of %lu failed\n", name, failed, (unsigned long)count);
    return failed;
}

#endif /* PSURF_TESTS_SHIM_CMOCKA_H */
