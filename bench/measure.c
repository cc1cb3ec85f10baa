/* measure.c - clock, races, what machine this is, results. */

#if !defined(_GNU_SOURCE)
#define _GNU_SOURCE                     /* sched_getaffinity */
#endif

#include "bench.h"

#include <ctype.h>
#include <math.h>
#include <sched.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <time.h>
#include <unistd.h>
#if defined(__SSE2__)
#include <emmintrin.h>
#endif

#ifndef BENCH_FLAGS
#define BENCH_FLAGS "unknown"
#endif

static double read_clock(clockid_t clock)
{
    struct timespec t;
    clock_gettime(clock, &t);
    return (double)t.tv_sec + 1e-9 * (double)t.tv_nsec;
}

double now(void) { return read_clock(CLOCK_MONOTONIC); }
double work_time(void) { return read_clock(CLOCK_THREAD_CPUTIME_ID); }

void fail(const char *what)
{
    progress(NULL);
    fflush(stdout);
    fprintf(stderr, "bench: %s\n", what);
    exit(1);
}

void *allocate(size_t size)
{
    void *memory = malloc(size ? size : 1);
    if (!memory) fail("out of memory");
    return memory;
}

uint32_t random_u32(uint32_t *state)
{
    *state ^= *state << 13;
    *state ^= *state >> 17;
    *state ^= *state << 5;
    return *state;
}

void progress(const char *what)
{
    if (!isatty(2)) return;
    fprintf(stderr, "\r\033[K%s%s", what ? what : "", what ? " ..." : "");
    fflush(stderr);
}

/* ---- races ----------------------------------------------------------------------------------- */

static int compare_doubles(const void *a, const void *b)
{
    const double x = *(const double *)a, y = *(const double *)b;
    return (x > y) - (x < y);
}

/* Seconds of one of several runs in a row. */
static double run_some(const runner *r, int times)
{
    double sum = 0;
    int i;
    for (i = 0; i < times; i++) sum += r->run(r->what);
    return sum / times;
}

runner make_runner(const char *name, double (*run)(void *), void *what, double items)
{
    runner r;
    memset(&r, 0, sizeof r);
    r.name = name;
    r.run = run;
    r.what = what;
    r.items = items;
    r.path = -1;
    return r;
}

void race(runner *runners, int count, double seconds, int min_rounds)
{
    static double results[MAX_RUNNERS][MAX_ROUNDS];
    const double section = 0.003;       /* of one runner in one round */
    int times[MAX_RUNNERS], rounds = 0, i;
    double start;
    if (count > MAX_RUNNERS) fail("too many in a race");
    for (i = 0; i < count; i++) {       /* to warm up, and to see how long it takes */
        double once = runners[i].run(runners[i].what);
        if (once < 0.1) once = runners[i].run(runners[i].what);
        times[i] = once < section / 1000 ? 1000 : once < section ? (int)(section / once) + 1 : 1;
    }
    start = now();
    do {
        for (i = 0; i < count; i++)
            results[i][rounds] = run_some(&runners[i], times[i]) / runners[i].items * 1e9;
        rounds++;
    } while (rounds < MAX_ROUNDS && (rounds < min_rounds || now() - start < seconds));
    for (i = 0; i < count; i++) {
        double *r = results[i];
        qsort(r, (size_t)rounds, sizeof *r, compare_doubles);
        runners[i].min = r[0];
        runners[i].median = rounds % 2 ? r[rounds / 2] : (r[rounds / 2 - 1] + r[rounds / 2]) / 2;
        runners[i].runs = rounds;
    }
}

/* ---- the machine ----------------------------------------------------------------------------- */

static void trim(char *text)
{
    size_t n = strlen(text);
    while (n && (text[n - 1] == '\n' || text[n - 1] == ' ')) text[--n] = 0;
}

const char *cpu_name(void)
{
    static char name[128];
    char line[256];
    FILE *f;
    if (name[0]) return name;
    snprintf(name, sizeof name, "unknown processor");
    f = fopen("/proc/cpuinfo", "r");
    if (!f) return name;
    while (fgets(line, sizeof line, f))
        if (!strncmp(line, "model name", 10) && strchr(line, ':')) {
            snprintf(name, sizeof name, "%.*s", (int)sizeof name - 1, strchr(line, ':') + 2);
            trim(name);
            break;
        }
    fclose(f);
    return name;
}

const char *compiler_name(void)
{
#if defined(__clang__)
    return "clang " __clang_version__ ", " BENCH_FLAGS;
#elif defined(__GNUC__)
    return "gcc " __VERSION__ ", " BENCH_FLAGS;
#else
    return "unknown compiler, " BENCH_FLAGS;
#endif
}

int cpu_count(void)
{
    cpu_set_t set;
    CPU_ZERO(&set);
    return sched_getaffinity(0, sizeof set, &set) ? 1 : CPU_COUNT(&set);
}

double run_memset(void *bytes)
{
    static int value;
    const double start = work_time();
    memset(bytes, ++value & 255, STORE_BYTES);
    return work_time() - start;
}

#if defined(__SSE2__)

const int has_stream = 1;

double run_stream(void *bytes)
{
    const double start = work_time();
    const __m128 value = _mm_set1_ps((float)start);
    float *p = (float *)bytes;
    size_t i;
    for (i = 0; i < STORE_BYTES / sizeof(float); i += 16) {
        _mm_stream_ps(p + i, value);
        _mm_stream_ps(p + i + 4, value);
        _mm_stream_ps(p + i + 8, value);
        _mm_stream_ps(p + i + 12, value);
    }
    _mm_sfence();
    return work_time() - start;
}

#else

const int has_stream = 0;
double run_stream(void *bytes) { return run_memset(bytes); }

#endif

const char *today(void)
{
    static char date[16];
    const time_t t = time(NULL);
    if (!date[0]) strftime(date, sizeof date, "%Y-%m-%d", gmtime(&t));
    return date;
}

/* ---- results --------------------------------------------------------------------------------- */

typedef struct row {
    const char *mesh, *measure, *path, *unit;
    uint32_t faces;
    double min, median;
    int runs;
} row;

static row *rows;
static size_t row_count, row_room;

/* The texts of a row must last: literals, names of meshes and paths. */
void note(const char *mesh_name, uint32_t faces, const char *measure, const char *path,
          const char *unit, double min, double median, int runs)
{
    row *r;
    if (row_count == row_room) {
        row_room = row_room ? 2 * row_room : 256;
        rows = (row *)realloc(rows, row_room * sizeof *rows);
        if (!rows) fail("out of memory");
    }
    r = &rows[row_count++];
    r->mesh = mesh_name;
    r->faces = faces;
    r->measure = measure;
    r->path = path;
    r->unit = unit;
    r->min = min;
    r->median = median;
    r->runs = runs;
}

void write_rows_json(void *stream)
{
    FILE *file = (FILE *)stream;
    size_t i;
    fprintf(file, "[");
    for (i = 0; i < row_count; i++) {
        const row *r = &rows[i];
        fprintf(file, "%s\n    {\"mesh\": \"%s\", \"faces\": %u, \"measure\": \"%s\", \"path\": "
                "\"%s\", \"unit\": \"%s\", \"min\": %.5g, \"median\": %.5g, \"runs\": %d}",
                i ? "," : "", r->mesh, (unsigned)r->faces, r->measure, r->path, r->unit, r->min,
                r->median, r->runs);
    }
    fprintf(file, "\n  ]");
}

void write_rows_csv(const char *directory)
{
    char name[512];
    size_t i, from = strlen(directory);
    FILE *file;
    snprintf(name, sizeof name, "%s/%s-%s.csv", directory, cpu_name(), today());
    for (i = from + 1; name[i]; i++)
        if (!isalnum((unsigned char)name[i]) && name[i] != '-' && name[i] != '.') name[i] = '_';
    mkdir(directory, 0777);             /* it may exist: opening the file tells */
    file = fopen(name, "w");
    if (!file) {
        fprintf(stderr, "bench: cannot write %s\n", name);
        exit(2);
    }
    fprintf(file, "date,cpu,compiler,mesh,faces,measure,path,unit,min,median,runs\n");
    for (i = 0; i < row_count; i++) {
        const row *r = &rows[i];
        fprintf(file, "%s,\"%s\",\"%s\",%s,%u,%s,\"%s\",%s,%.5g,%.5g,%d\n", today(), cpu_name(),
                compiler_name(), r->mesh, (unsigned)r->faces, r->measure, r->path, r->unit, r->min,
                r->median, r->runs);
    }
    if (fclose(file)) fail("the file of results is incomplete");
    printf("\nwritten: %s\n", name);
}
