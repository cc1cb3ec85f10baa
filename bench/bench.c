/* bench.c - patchsurf against OpenSubdiv, stage by stage, in one process.

   `make bench` builds and runs it, README.md says what is measured and how, --help what options
   there are. */

#include "compare.h"
#include "kinds.h"
#include "surface.h"
#include "threads.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

typedef struct settings {
    int quick, sabotage, kinds;
    double seconds;                     /* per race */
    int rounds;                         /* at least */
    const char *json, *results;
} settings;

static settings options;
static float *out, *expected;           /* STORE_BYTES each */

/* The stages that are raced; their names in the file. */
typedef enum race_stage {
    BUILD, REFRESH, EVAL_5, EVAL_9, EVAL_17, EVAL_33, POSITIONS_17, MEMORY, STAGE_COUNT
} race_stage;
static const char *const stage_names[STAGE_COUNT] = { "build", "refresh", "eval_n5", "eval_n9",
    "eval_n17", "eval_n33", "position_n17", "memory" };

/* What goes into the file beside the rows. Column 0 is patchsurf, column 1 + k path k; 0 where the
   path has no such stage. */
enum { COLUMNS = 1 + OSD_KIND_COUNT };
typedef struct summary {
    double cost[STAGE_COUNT][COLUMNS];  /* medians: ns per face or point; bytes per face */
    double store_share, store_rate;     /* of the last evaluation; GB/s */
    deviation from_limit;               /* patchsurf's */
    double two_threads[2], growth[3];
} summary;

static summary figures;

/* A path / patchsurf; 0 where the path has no such stage. */
static double ratio(const double cost[COLUMNS], int path) { return cost[1 + path] / cost[0]; }

/* OpenSubdiv's best path / patchsurf. */
static double best_ratio(const double cost[COLUMNS])
{
    double best = 0;
    int k;
    for (k = 0; k < OSD_KIND_COUNT; k++)
        if (cost[1 + k] > 0 && (!(best > 0) || ratio(cost, k) < best)) best = ratio(cost, k);
    return best;
}

/* As the targets were set: building, refreshing and keeping the patch tables that evaluate, with one
   table of stencils, as OpenSubdiv's manual makes them; evaluation by whatever path is best. */
static double target_ratio(const double (*costs)[COLUMNS], race_stage at)
{
    const double *cost = costs[at];
    if (at != BUILD && at != REFRESH && at != MEMORY) return best_ratio(cost);
    return ratio(cost, OSD_BSPLINE) < ratio(cost, OSD_GREGORY) ? ratio(cost, OSD_BSPLINE)
                                                               : ratio(cost, OSD_GREGORY);
}

/* One frame of an animation: refresh, then all points at n * n per face. */
static void frame_costs(const summary *s, race_stage at, double n, double cost[COLUMNS])
{
    int i;
    for (i = 0; i < COLUMNS; i++) {
        /* those with stencils of level on level evaluate as those without */
        const int twin = i == 1 + OSD_BSPLINE_LEVELS ? 1 + OSD_BSPLINE
                         : i == 1 + OSD_GREGORY_LEVELS ? 1 + OSD_GREGORY : i;
        const double points = s->cost[at][twin] * n * n;
        cost[i] = points > 0 ? s->cost[REFRESH][i] + points : 0;
    }
}

/* ---- one race as a table --------------------------------------------------------------------- */

/* Prints and notes a race in which runners[0] is patchsurf. */
static void report(const mesh *m, const char *measure, const char *unit, const runner *runners,
                   int count)
{
    int i;
    progress(NULL);
    printf("  %-14s %-13s %10s %10s%s\n", measure, unit, "min", "median",
           count > 1 ? "      ratio" : "");
    for (i = 0; i < count; i++) {
        const runner *r = &runners[i];
        printf("    %-26s %10.2f %10.2f", r->name, r->min, r->median);
        if (i) printf(" %8.1f x", r->median / runners[0].median);
        printf("\n");
        note(m->name, m->faces, measure, r->name, unit, r->min, r->median, r->runs);
    }
    fflush(stdout);
}

static void set_costs(race_stage at, const runner *runners, int count)
{
    int i;
    for (i = 0; i < count; i++) figures.cost[at][1 + runners[i].path] = runners[i].median;
}

static runner osd_runner(int kind, double (*run)(void *), osd_path *path, double items)
{
    runner r = make_runner(osd_name((osd_kind)kind), run, path, items);
    r.path = kind;
    return r;
}

/* ---- OpenSubdiv's stages as runners ---------------------------------------------------------- */

static double run_osd_build(void *path)
{
    double start;
    osd_drop((osd_path *)path);
    start = work_time();
    osd_build((osd_path *)path);
    return work_time() - start;
}

static double run_osd_refresh(void *path)
{
    const double start = work_time();
    osd_refresh((osd_path *)path);
    return work_time() - start;
}

static double run_osd_evaluate(void *path)
{
    const double start = work_time();
    osd_evaluate((osd_path *)path, out);
    return work_time() - start;
}

static double run_osd_positions(void *path)
{
    const double start = work_time();
    osd_positions((osd_path *)path, out);
    return work_time() - start;
}

typedef struct duel {
    mesh m;
    surface s;
    osd_path *path[OSD_KIND_COUNT];     /* NULL: not in this duel */
} duel;

/* As many of the first faces as are evaluated at N = n: every 400 are 25 tiles. */
static uint32_t evaluated_faces(const duel *d, uint32_t n)
{
    const uint32_t most = options.quick ? 400 : 400 * (n < 9 ? 16 : n < 17 ? 4 : n < 33 ? 2 : 1);
    return d->m.faces < most + 100 ? d->m.faces : most;
}

static void duel_open(duel *d, torus_kind kind, uint32_t size)
{
    int k;
    memset(d, 0, sizeof *d);
    d->m = mesh_torus(kind, size);
    surface_open(&d->s, &d->m);
    for (k = 0; k < OSD_KIND_COUNT; k++) {
        if (k == OSD_UNIFORM && (d->m.faces > 5000 || options.quick)) continue;
        progress(osd_name((osd_kind)k));
        d->path[k] = osd_open((osd_kind)k, &d->m);
        osd_build(d->path[k]);
        osd_refresh(d->path[k]);
    }
}

static void duel_close(duel *d)
{
    int k;
    for (k = 0; k < OSD_KIND_COUNT; k++) osd_close(d->path[k]);
    surface_close(&d->s);
    mesh_free(&d->m);
}

static void print_mesh(const surface *s)
{
    int k;
    printf("\n%s, %u faces:", s->m->name, (unsigned)s->m->faces);
    for (k = 0; k < PSURF_KIND_COUNT; k++)
        if (s->info.kind_faces[k])
            printf(" %u %s (%.0f %%)", (unsigned)s->info.kind_faces[k],
                   psurf_kind_name((psurf_kind)k), 100.0 * s->info.kind_faces[k] / s->m->faces);
    printf("\n");
}

/* ---- stages against each other --------------------------------------------------------------- */

/* A stage that all paths with control points have. */
static void race_control_points(duel *d, race_stage at, double (*ours)(void *),
                                double (*theirs)(void *), int rounds)
{
    runner r[MAX_RUNNERS];
    int n = 0, k;
    progress(stage_names[at]);
    r[n++] = make_runner("patchsurf", ours, &d->s, d->m.faces);
    for (k = OSD_BSPLINE; k <= OSD_BFR; k++)
        r[n++] = osd_runner(k, theirs, d->path[k], d->m.faces);
    race(r, n, options.seconds, rounds);
    report(&d->m, stage_names[at], "ns/face", r, n);
    set_costs(at, r, n);
    for (k = OSD_BSPLINE; k <= OSD_BFR; k++) osd_refresh(d->path[k]);
}

/* Paths that evaluate; those with a table per level evaluate as those with one. */
static int evaluates(const duel *d, int k, int normals)
{
    return d->path[k] && k != OSD_BSPLINE_LEVELS && k != OSD_GREGORY_LEVELS &&
           (k != OSD_UNIFORM || !normals);
}

/* By how much points may differ: positions in percent of the diagonal, normals in degrees, in the
   mean and at most. In float, normals on the small patches round a vertex stray. */
typedef struct allowance { double position, mean_degrees, degrees; } allowance;

static const allowance patchsurf_allowed = { 0.4, 1.5, 10 };       /* near the limit, not on it */
static const allowance limit_allowed = { 0.2, 0.2, 6 };         /* OpenSubdiv's paths from it */
static const allowance twin_allowed = { 0.001, 0.05, 3 };       /* the same surface, rounded */

static void require(deviation d, allowance allowed)
{
    if (d.max <= allowed.position && d.rms_degrees <= allowed.mean_degrees &&
        d.max_degrees <= allowed.degrees)
        return;
    fail("points differ by more than they may: wrong results");
}

/* What has been raced, compared: all with Bfr, or positions alone with those that have normals. */
static void check_race(duel *d, const tessellation *t, uint32_t n)
{
    const uint32_t faces = evaluated_faces(d, n);
    const size_t count = (size_t)faces * n * n;
    size_t i;
    int k;
    if (t->normals == NO_NORMALS) {
        tessellation both;
        tessellation_open(&both, &d->s, n, SURFACE_NORMALS, expected);
        tessellate(&both, 0, faces, expected);
        tessellate(t, 0, faces, out);
        for (i = 0; i < count; i++)
            if (memcmp(out + 3 * i, expected + 6 * i, 3 * sizeof(float)))
                fail("positions have other bits without normals");
        return;
    }
    osd_evaluate(d->path[OSD_BFR], expected);
    tessellate(t, 0, faces, out);
    require(deviation_of(out, expected, count, diagonal(&d->m)), patchsurf_allowed);
    for (k = 0; k < OSD_KIND_COUNT; k++) {
        if (!evaluates(d, k, 1)) continue;
        osd_evaluate(d->path[k], out);
        require(deviation_of(out, expected, count, diagonal(&d->m)),
                k == OSD_BSPLINE ? limit_allowed : twin_allowed);
    }
}

static void race_points(duel *d, race_stage at)
{
    static const uint32_t n_of[STAGE_COUNT] = { 0, 0, 5, 9, 17, 33, 17, 0 };
    const uint32_t n = n_of[at];
    const int normals = at != POSITIONS_17;
    runner r[MAX_RUNNERS];
    tessellation t;
    double stored;
    int count = 0, k;
    progress(stage_names[at]);
    tessellation_open(&t, &d->s, n, normals ? SURFACE_NORMALS : NO_NORMALS, out);
    r[count++] = make_runner("patchsurf", run_tessellation, &t, t.points);
    for (k = 0; k < OSD_KIND_COUNT; k++)
        if (evaluates(d, k, normals)) {
            const uint32_t faces = k == OSD_UNIFORM ? d->m.faces : evaluated_faces(d, n);
            r[count++] = osd_runner(k, normals ? run_osd_evaluate : run_osd_positions, d->path[k],
                                    (double)osd_sample(d->path[k], n, faces));
        }
    r[count] = make_runner("stores", run_stream, out, STORE_BYTES);
    race(r, count + 1, options.seconds, options.rounds);
    report(&d->m, stage_names[at], "ns/point", r, count);
    set_costs(at, r, count);
    stored = (normals ? 24 : 12) / r[0].median;
    figures.store_rate = 1 / r[count].median;
    figures.store_share = stored / figures.store_rate;
    printf("    patchsurf stores %.2f GB/s: %.0f %% of non-temporal stores (%.2f GB/s)\n", stored,
           100 * figures.store_share, figures.store_rate);
    note(d->m.name, d->m.faces, stage_names[at], "non-temporal stores", "ns/byte", r[count].min,
         r[count].median, r[count].runs);
    check_race(d, &t, n);
}

/* ---- memory ---------------------------------------------------------------------------------- */

static void note_memory(const mesh *m, const char *path, double resident, double peak,
                        double allocations)
{
    printf("    %-26s %10.0f %10.0f %10.0f\n", path, resident, peak, allocations);
    note(m->name, m->faces, "resident", path, "byte/face", resident, resident, 1);
    note(m->name, m->faces, "peak", path, "byte/face", peak, peak, 1);
    note(m->name, m->faces, "allocations", path, "count", allocations, allocations, 1);
}

static double patchsurf_memory(const surface *s)
{
    const double faces = s->m->faces, patches = (double)s->patches.layout.patch_bytes / faces;
    const double scratch = (double)s->patches.layout.scratch_bytes / faces;
    const double topology = (double)s->info.bytes / faces, peak = (double)s->memory.peak / faces;
    const double built = topology + patches + scratch;
    printf("  %-28s %10s %10s %10s\n", "bytes/face", "resident", "peak", "allocs");
    note_memory(s->m, "patchsurf", topology + patches, peak > built ? peak : built,
                s->memory.calls);
    printf("      topology %.0f, patches %.0f; scratch of a frame %.0f; peak heap of building the "
           "topology %.0f\n", topology, patches, scratch, peak);
    note(s->m->name, s->m->faces, "scratch", "patchsurf", "byte/face", scratch, scratch, 1);
    note(s->m->name, s->m->faces, "peak of topology", "patchsurf", "byte/face", peak, peak, 1);
    return topology + patches;
}

static void compare_memory(duel *d)
{
    const double faces = d->m.faces;
    int k;
    figures.cost[MEMORY][0] = patchsurf_memory(&d->s);
    for (k = OSD_BSPLINE; k <= OSD_BFR; k++) {
        const osd_memory memory = osd_build_counted(d->path[k]);
        const double bytes = (double)memory.resident / faces;
        note_memory(&d->m, osd_name((osd_kind)k), bytes, (double)memory.peak / faces,
                    (double)memory.allocations);
        figures.cost[MEMORY][1 + k] = bytes;
        osd_refresh(d->path[k]);
    }
}

/* ---- are the points right? ------------------------------------------------------------------- */

static deviation compare_path(const mesh *m, const char *name, const float *points, size_t count,
                              allowance allowed)
{
    const deviation d = deviation_of(points, expected, count, diagonal(m));
    printf("    %-26s %10.4f %10.5f %10.3f %10.4f", name, d.max, d.rms, d.max_degrees,
           d.rms_degrees);
    check_points(name, points, count, 6);
    note(m->name, m->faces, "deviation, largest", name, "% of diagonal", d.max, d.max, 1);
    note(m->name, m->faces, "deviation, rms", name, "% of diagonal", d.rms, d.rms, 1);
    note(m->name, m->faces, "normals, largest", name, "degrees", d.max_degrees, d.max_degrees, 1);
    note(m->name, m->faces, "normals, rms", name, "degrees", d.rms_degrees, d.rms_degrees, 1);
    require(d, allowed);
    return d;
}

static void print_unmet(const mesh *m, const char *name, const float *points, uint32_t n,
                        uint32_t faces)
{
    const double percent = unmet_percent(m, points, n, faces);
    printf(" %8.1f %%\n", percent);
    note(m->name, m->faces, "unequal on edges", name, "% of samples", percent, percent, 1);
}

/* Points of a uniform refinement lie off the surface, but not far. */
static void check_uniform(duel *d, uint32_t n, uint32_t faces)
{
    const double allowed = 0.002 * diagonal(&d->m);
    uint32_t i;
    if (!d->path[OSD_UNIFORM]) return;
    osd_sample(d->path[OSD_UNIFORM], 17, d->m.faces);
    osd_positions(d->path[OSD_UNIFORM], out);
    for (i = 0; i < faces; i++) {       /* a face's first sample is its first vertex */
        const uint32_t v = d->m.face_vertices[4 * i];
        const float *a = out + 4 * (size_t)osd_uniform_index(d->path[OSD_UNIFORM], v);
        const float *b = expected + 6 * (size_t)i * n * n;
        if (!(fabs((double)(a[0] - b[0])) + fabs((double)(a[1] - b[1])) +
              fabs((double)(a[2] - b[2])) < allowed))
            fail("uniform refinement is off the surface: wrong results");
    }
}

/* OpenSubdiv's paths against the limit, and against the first that has the same surface, from
   which rounding alone may set them apart. */
static void compare_osd(duel *d, uint32_t n, uint32_t faces)
{
    static const int twin[] = { OSD_BSPLINE, OSD_GREGORY, OSD_BSPLINE, OSD_GREGORY, OSD_GREGORY,
                                OSD_GREGORY };
    const size_t count = (size_t)faces * n * n;
    float *points[OSD_UNIFORM];
    int k;
    for (k = 0; k < OSD_UNIFORM; k++) {
        points[k] = (float *)allocate(count * 6 * sizeof(float));
        osd_sample(d->path[k], n, faces);
        osd_evaluate(d->path[k], points[k]);
        compare_path(&d->m, osd_name((osd_kind)k), points[k], count, limit_allowed);
        require(deviation_of(points[k], points[twin[k]], count, diagonal(&d->m)), twin_allowed);
        print_unmet(&d->m, osd_name((osd_kind)k), points[k], n, faces);
    }
    for (k = 0; k < OSD_UNIFORM; k++) free(points[k]);
}

/* All paths against the Catmull-Clark limit, which Bfr gives at level 10. */
static void compare_points(duel *d)
{
    const uint32_t n = 9, faces = evaluated_faces(d, n);
    const size_t count = (size_t)faces * n * n;
    osd_path *exact = osd_open(OSD_EXACT, &d->m);
    tessellation t;
    progress("comparing points");
    osd_build(exact);
    osd_refresh(exact);
    osd_sample(exact, n, faces);
    osd_evaluate(exact, expected);
    osd_close(exact);
    check_points("Bfr, level 10", expected, count, 6);
    progress(NULL);
    printf("  from the Catmull-Clark limit: %% of the diagonal, degrees; unequal on edges, to the "
           "bit\n    %-26s %10s %10s %10s %10s %10s\n", "", "largest", "rms", "largest", "rms",
           "unequal");
    tessellation_open(&t, &d->s, n, SURFACE_NORMALS, out);
    tessellate(&t, 0, faces, out);
    if (options.sabotage) out[6 * (count / 2)] += (float)(0.005 * diagonal(&d->m));
    figures.from_limit = compare_path(&d->m, "patchsurf", out, count,
                                      patchsurf_allowed);
    print_unmet(&d->m, "patchsurf", out, n, faces);
    compare_osd(d, n, faces);
    check_uniform(d, n, faces);
}

static void run_duel(torus_kind kind, uint32_t size, int build_rounds)
{
    duel d;
    int at;
    memset(&figures, 0, sizeof figures);
    duel_open(&d, kind, size);
    print_mesh(&d.s);
    compare_points(&d);
    compare_memory(&d);
    race_control_points(&d, BUILD, run_build, run_osd_build, build_rounds);
    race_control_points(&d, REFRESH, run_refresh, run_osd_refresh, options.rounds);
    race_points(&d, POSITIONS_17);
    for (at = EVAL_5; at <= EVAL_33; at++) race_points(&d, (race_stage)at);
    duel_close(&d);
}

/* ---- patchsurf alone ------------------------------------------------------------------------- */

static void race_alone(const mesh *m, const char *measure, const char *unit,
                       double (*run)(void *), void *what, double items)
{
    runner r = make_runner("patchsurf", run, what, items);
    progress(measure);
    race(&r, 1, options.seconds / 2, options.rounds);
    report(m, measure, unit, &r, 1);
}

static void run_mixed(uint32_t size)
{
    static const uint32_t n[4] = { 5, 9, 17, 33 };
    mesh m = mesh_torus(MIXED, size);
    surface s;
    int i;
    surface_open(&s, &m);
    print_mesh(&s);
    patchsurf_memory(&s);
    race_alone(&m, "build", "ns/face", run_build, &s, m.faces);
    race_alone(&m, "refresh", "ns/face", run_refresh, &s, m.faces);
    for (i = 0; i < 4; i++) {
        tessellation t;
        tessellation_open(&t, &s, n[i], SURFACE_NORMALS, out);
        race_alone(&m, stage_names[EVAL_5 + i], "ns/point", run_tessellation, &t, t.points);
        tessellate(&t, 0, t.faces, out);
        check_points(stage_names[EVAL_5 + i], out, (size_t)t.points, 6);
    }
    surface_close(&s);
    mesh_free(&m);
}

/* ---- two threads ----------------------------------------------------------------------------- */

static int compare_doubles(const void *a, const void *b)
{
    const double x = *(const double *)a, y = *(const double *)b;
    return (x > y) - (x < y);
}

/* By how much the median of two threads beats that of one. */
static double scaling(const char *stage, const mesh *m, double *one, double *two, int count)
{
    double faster;
    qsort(one, (size_t)count, sizeof *one, compare_doubles);
    qsort(two, (size_t)count, sizeof *two, compare_doubles);
    faster = one[count / 2] / two[count / 2];
    printf("    %-26s %10.2f %10.2f %8.2f x %8.2f x\n", stage, 1e9 * one[count / 2] / m->faces,
           1e9 * two[count / 2] / m->faces, faster, one[0] / two[0]);
    note(m->name, m->faces, stage, "1 thread", "ns/face", 1e9 * one[0] / m->faces,
         1e9 * one[count / 2] / m->faces, count);
    note(m->name, m->faces, stage, "2 threads", "ns/face", 1e9 * two[0] / m->faces,
         1e9 * two[count / 2] / m->faces, count);
    return faster;
}

static void run_threads(uint32_t size)
{
    enum { FRAMES = 3, ROUNDS = 7, ALL = FRAMES * ROUNDS };
    double construct[2][ALL], points[2][ALL];
    mesh m = mesh_torus(FROG_LIKE, size);
    surface s;
    tessellation t;
    int round, team, i;
    surface_open(&s, &m);
    tessellation_open(&t, &s, 5, SURFACE_NORMALS, out);
    progress("threads");
    for (round = 0; round < ROUNDS; round++)
        for (team = 0; team < 2; team++) {
            frame_times times[FRAMES];
            float *to = team ? out : expected;
            memset(to, 0, STORE_BYTES);
            run_team(&t, team ? 2 : 1, to, times, FRAMES);
            for (i = 0; i < FRAMES; i++) {
                construct[team][round * FRAMES + i] = times[i].construct;
                points[team][round * FRAMES + i] = times[i].tessellate;
            }
        }
    if (memcmp(out, expected, STORE_BYTES)) fail("two threads give other bits than one");
    progress(NULL);
    printf("\ntwo threads%s, %s, %u faces\n  %-28s %10s %10s %10s %10s\n",
           cpu_count() < 2 ? " on one processor: no gain possible" : "", m.name,
           (unsigned)m.faces, "median, ns/face", "one", "two", "faster", "best runs");
    figures.two_threads[0] = scaling("refresh", &m, construct[0], construct[1], ALL);
    figures.two_threads[1] = scaling("eval_n5", &m, points[0], points[1], ALL);
    surface_close(&s);
    mesh_free(&m);
}

/* ---- how cost grows -------------------------------------------------------------------------- */

static double print_growth(const char *stage, surface *s, runner *r, int count)
{
    const double growth = r[count - 1].median / r[0].median;
    int i;
    progress(NULL);
    printf("    %-16s", stage);
    for (i = 0; i < count; i++) {
        printf(" %9.1f", r[i].median);
        note(s[i].m->name, s[i].m->faces, stage, "growth", "ns/face", r[i].min, r[i].median,
             r[i].runs);
    }
    printf(" %8.2f x%s\n", growth, growth > 3 ? "  MORE THAN 3" : "");
    return growth;
}

static void run_growth(void)
{
    static const uint32_t sizes[] = { 32, 100, 316, 1000 };
    const int count = options.quick ? 2 : 4;
    mesh m[4];
    surface s[4];
    tessellation t[4];
    runner r[4];
    int i;
    printf("\ngrowth, frog-like, median ns/face\n    %-16s", "faces");
    for (i = 0; i < count; i++) {
        progress("growth");
        m[i] = mesh_torus(FROG_LIKE, sizes[i]);
        surface_open(&s[i], &m[i]);
        tessellation_open(&t[i], &s[i], 5, SURFACE_NORMALS, out);
        progress(NULL);
        printf(" %9u", (unsigned)m[i].faces);
    }
    printf(" %10s\n", "last/first");
    progress("growth");
    for (i = 0; i < count; i++) r[i] = make_runner("build", run_build, &s[i], m[i].faces);
    race(r, count, options.seconds, options.rounds);
    figures.growth[0] = print_growth("build", s, r, count);
    for (i = 0; i < count; i++) r[i] = make_runner("refresh", run_refresh, &s[i], m[i].faces);
    race(r, count, options.seconds, options.rounds);
    figures.growth[1] = print_growth("refresh", s, r, count);
    for (i = 0; i < count; i++) r[i] = make_runner("points", run_tessellation, &t[i], t[i].faces);
    race(r, count, options.seconds, options.rounds);
    figures.growth[2] = print_growth("eval_n5", s, r, count);
    for (i = 0; i < count; i++) {
        surface_close(&s[i]);
        mesh_free(&m[i]);
    }
}

/* ---- the whole run --------------------------------------------------------------------------- */

static void measure_stores(void)
{
    runner r[2];
    r[0] = make_runner("memset", run_memset, out, STORE_BYTES);
    r[1] = make_runner("non-temporal", run_stream, out, STORE_BYTES);
    race(r, 2, options.seconds, options.rounds);
    printf("stores, 64 MiB: memset %.2f GB/s, non-temporal %.2f GB/s%s\n", 1 / r[0].median,
           1 / r[1].median, has_stream ? "" : " (none on this machine: memset)");
    note("", 0, "stores", "memset", "ns/byte", r[0].min, r[0].median, r[0].runs);
    note("", 0, "stores", "non-temporal", "ns/byte", r[1].min, r[1].median, r[1].runs);
}

static void print_line(const char *name, const double cost[COLUMNS], double target)
{
    int k;
    printf("  %-14s", name);
    for (k = 0; k < OSD_KIND_COUNT; k++)
        if (cost[1 + k] > 0) printf(" %8.1f", ratio(cost, k));
        else printf(" %8s", "");
    printf(" %8.1f", best_ratio(cost));
    if (target > 0) printf(" %8.1f", target);
    printf("\n");
}

static const struct { race_stage at; int n; const char *name; } frames[4] = {
    { EVAL_5, 5, "frame_n5" }, { EVAL_9, 9, "frame_n9" }, { EVAL_17, 17, "frame_n17" },
    { EVAL_33, 33, "frame_n33" }
};

static void print_ratios(const summary *s)
{
    double cost[COLUMNS];
    int at, i;
    printf("\nfrog-like, OpenSubdiv / patchsurf, medians; a frame is refresh and all points\n"
           "  %-14s %8s %8s %8s %8s %8s %8s %8s %8s %8s\n"
           "  %-14s %8s %8s %8s %8s %8s %8s %8s %8s %8s\n", "",
           "B-spline", "Gregory", "B-spline", "Gregory", "Bfr", "limit", "uniform", "best", "as the",
           "", "", "", "levels", "levels", "", "stencils", "stencils", "", "targets");
    for (at = 0; at < STAGE_COUNT; at++)
        print_line(stage_names[at], s->cost[at], target_ratio(s->cost, (race_stage)at));
    for (i = 0; i < 4; i++) {
        frame_costs(s, frames[i].at, frames[i].n, cost);
        print_line(frames[i].name, cost, 0);
    }
    printf("  share of non-temporal stores at N=33: %.0f %%\n", 100 * s->store_share);
}

enum { AS_TARGETS = -2, STRICT = -1 };

/* k: a path, or one of the two above */
static void write_ratios_of(FILE *f, const summary *s, const char *name, int k)
{
    const char *comma = "";
    int at;
    fprintf(f, "\"%s\": {", name);
    for (at = 0; at < STAGE_COUNT; at++) {
        const double x = k == AS_TARGETS ? target_ratio(s->cost, (race_stage)at)
                         : k == STRICT   ? best_ratio(s->cost[at])
                                         : ratio(s->cost[at], k);
        if (!(x > 0)) continue;
        fprintf(f, "%s\"%s\": %.3f", comma, stage_names[at], x);
        comma = ", ";
    }
    fprintf(f, "}");
}

static void write_ratios(FILE *f, const summary *s)
{
    double cost[COLUMNS];
    int k, i;
    fprintf(f, "  ");
    write_ratios_of(f, s, "ratios", AS_TARGETS);
    fprintf(f, ",\n  ");
    write_ratios_of(f, s, "ratios_strict", STRICT);
    fprintf(f, ",\n  \"ratios_of_frames\": {");
    for (i = 0; i < 4; i++) {
        frame_costs(s, frames[i].at, frames[i].n, cost);
        fprintf(f, "%s\"%s\": %.3f", i ? ", " : "", frames[i].name, best_ratio(cost));
    }
    fprintf(f, "},\n  \"ratios_by_path\": {");
    for (k = 0; k < OSD_KIND_COUNT; k++) {
        fprintf(f, "%s\n    ", k ? "," : "");
        write_ratios_of(f, s, osd_name((osd_kind)k), k);
    }
    fprintf(f, "\n  },\n");
}

/* s: of the frog-like mesh; threads and growth are in figures. */
static void write_json(const summary *s)
{
    FILE *f = fopen(options.json, "w");
    if (!f) {
        fprintf(stderr, "bench: cannot write %s\n", options.json);
        exit(2);
    }
    fprintf(f, "{\n  \"machine\": \"%s\",\n  \"processors\": %d,\n  \"compiler\": \"%s\",\n"
            "  \"simd\": \"%s\",\n  \"date\": \"%s\",\n  \"version\": %u,\n"
            "  \"opensubdiv\": \"%s\",\n  \"quick\": %s,\n", cpu_name(), cpu_count(),
            compiler_name(), psurf_simd_name(), today(), (unsigned)psurf_version(), osd_version(),
            options.quick ? "true" : "false");
    write_ratios(f, s);
    fprintf(f, "  \"store_share_n33\": %.4f,\n  \"store_gb_per_s\": %.3f,\n", s->store_share,
            s->store_rate);
    fprintf(f, "  \"deviation\": {\"max_percent\": %.5f, \"rms_percent\": %.5f, \"max_degrees\": "
            "%.4f, \"rms_degrees\": %.4f},\n", s->from_limit.max, s->from_limit.rms,
            s->from_limit.max_degrees, s->from_limit.rms_degrees);
    fprintf(f, "  \"two_threads\": {\"refresh\": %.3f, \"eval_n5\": %.3f},\n",
            figures.two_threads[0], figures.two_threads[1]);
    fprintf(f, "  \"growth\": {\"build\": %.3f, \"refresh\": %.3f, \"eval_n5\": %.3f},\n",
            figures.growth[0], figures.growth[1], figures.growth[2]);
    fprintf(f, "  ");
    write_kinds_json(f);
    fprintf(f, ",\n  \"rows\": ");
    write_rows_json(f);
    fprintf(f, "\n}\n");
    if (fclose(f)) fail("the json file is incomplete");
}

static void run_all_kinds(void)
{
    plan p;
    p.seconds = options.seconds;
    p.rounds = options.rounds;
    p.out = out;
    p.again = expected;
    run_kinds(&p, options.quick ? 1200 : 20000);
    run_table2(&p);
}

static void run_all(void)
{
    summary frog;
    measure_stores();
    run_duel(FROG_LIKE, 36, options.rounds);
    frog = figures;
    if (!options.quick) {
        run_duel(FROG_LIKE, 316, 3);
        run_duel(TENTH, 316, 3);
    }
    run_mixed(options.quick ? 32 : 292);
    run_threads(options.quick ? 100 : 316);
    run_growth();
    run_all_kinds();
    print_ratios(&frog);
    write_json(&frog);
    if (options.results) write_rows_csv(options.results);
}

static const char help[] =
    "usage: bench [options]\n"
    "Races patchsurf against OpenSubdiv, two to three minutes long.\n\n"
    "  --quick        small meshes, few runs: does everything still work?\n"
    "  --kinds        what each kind of patch costs, and no more; writes no file\n"
    "  --results DIR  also write DIR/<processor>-<date>.csv\n"
    "  --json FILE    write there instead of beside the program (bench.json)\n"
    "  --sabotage     move one point of patchsurf's: the run must end with exit status 1\n\n"
    "Exit status: 0, 1 where results are wrong, 2 where arguments or files are.\n\n"
    "examples:\n"
    "  build/bench                                    tables, and build/bench.json\n"
    "  build/bench --results bench/results\n"
    "  build/bench --quick --json /tmp/bench.json\n";

static void parse(int argc, char **argv)
{
    static char json[512];
    const char *slash = strrchr(argv[0], '/');
    int i;
    snprintf(json, sizeof json, "%.*sbench.json", slash ? (int)(slash + 1 - argv[0]) : 0, argv[0]);
    options.json = json;
    options.seconds = 1;
    options.rounds = 5;
    for (i = 1; i < argc; i++) {
        if (!strcmp(argv[i], "--help")) {
            fputs(help, stdout);
            exit(0);
        } else if (!strcmp(argv[i], "--quick")) {
            options.quick = 1;
            options.seconds = 0.05;
            options.rounds = 3;
        } else if (!strcmp(argv[i], "--sabotage")) {
            options.sabotage = 1;
        } else if (!strcmp(argv[i], "--kinds")) {
            options.kinds = 1;
        } else if (!strcmp(argv[i], "--json") && i + 1 < argc) {
            options.json = argv[++i];
        } else if (!strcmp(argv[i], "--results") && i + 1 < argc) {
            options.results = argv[++i];
        } else {
            fprintf(stderr, "bench: %s? try --help\n", argv[i]);
            exit(2);
        }
    }
}

int main(int argc, char **argv)
{
    const double start = now();
    parse(argc, argv);
    out = (float *)allocate(STORE_BYTES);
    expected = (float *)allocate(STORE_BYTES);
    memset(out, 0, STORE_BYTES);
    memset(expected, 0, STORE_BYTES);
    printf("patchsurf %d.%d.%d (%s%s) and OpenSubdiv %s, one thread\n%s; %s; %s\n",
           PSURF_VERSION_MAJOR, PSURF_VERSION_MINOR, PSURF_VERSION_PATCH, psurf_simd_name(),
           psurf_exact() ? "" : ", this build promises no identical bits", osd_version(),
           cpu_name(), compiler_name(), today());
    if (options.kinds) run_all_kinds();
    else run_all();
    free(out);
    free(expected);
    printf("%.0f seconds\n", now() - start);
    return 0;
}
