/* kinds.c - what each kind of patch costs, and Table 2 of [A], which is [GB] in patchsurf.h. */

#include "kinds.h"
#include "compare.h"
#include "surface.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

/* ---- are the points right? ------------------------------------------------------------------- */

/* The first faces, some 500 000 points: finite, with unit normals, and the same bits again in two
   parts. */
static void check_tessellation(const plan *p, const tessellation *t, const char *name)
{
    const double each = t->points / t->faces, most = 500000 / each;
    const uint32_t faces = t->faces < most ? t->faces : (uint32_t)most, part = faces / 3;
    const size_t count = (size_t)(faces * each), before = (size_t)(part * each);
    tessellate(t, 0, faces, p->out);
    check_points(name, p->out, count, 6);
    tessellate(t, part, faces - part, p->again + 6 * before);
    tessellate(t, 0, part, p->again);
    if (memcmp(p->out, p->again, 6 * count * sizeof(float)))
        fail("a second tessellation has other bits");
}

/* ---- one kind each --------------------------------------------------------------------------- */

typedef struct kind_row {
    const char *name;
    psurf_kind kind;
    psurf_scheme scheme;
    point_normals normals;
    psurf_variant variant;
    uint32_t flags;
    double lumps;                       /* how high they are; 1: as on the other meshes */
} kind_row;

/* The first is what the others are compared with. One that passes flat edges over stands right
   behind the same without. */
static const kind_row kind_rows[] = {
    { "bicubic", PSURF_BICUBIC, PSURF_PM, SURFACE_NORMALS, PSURF_N_G1, 0, 1 },
    { "polar", PSURF_POLAR, PSURF_PM, SURFACE_NORMALS, PSURF_N_G1, 0, 1 },
    { "p3", PSURF_P3, PSURF_PM, SURFACE_NORMALS, PSURF_N_G1, 0, 1 },
    { "p4", PSURF_P4, PSURF_PM, SURFACE_NORMALS, PSURF_N_G1, 0, 1 },
    { "p5", PSURF_P5, PSURF_PM, SURFACE_NORMALS, PSURF_N_G1, 0, 1 },
    { "pn_tri", PSURF_PN_TRI, PSURF_PN, SURFACE_NORMALS, PSURF_N_G1, 0, 1 },
    { "pn_tri shade", PSURF_PN_TRI, PSURF_PN, SHADING_NORMALS, PSURF_N_G1, 0, 1 },
    { "pn_quad", PSURF_PN_QUAD, PSURF_PN, SURFACE_NORMALS, PSURF_N_G1, 0, 1 },
    { "pn_quad shade", PSURF_PN_QUAD, PSURF_PN, SHADING_NORMALS, PSURF_N_G1, 0, 1 },
    { "npatch g1", PSURF_NPATCH, PSURF_SMOOTHED_N, SURFACE_NORMALS, PSURF_N_G1, 0, 1 },
    { "npatch final", PSURF_NPATCH, PSURF_SMOOTHED_N, SURFACE_NORMALS, PSURF_N_FINAL, 0, 1 },
    { "npatch nearly flat", PSURF_NPATCH, PSURF_SMOOTHED_N, SURFACE_NORMALS, PSURF_N_FINAL,
      PSURF_NEARLY_FLAT, 1 },
    { "npatch final", PSURF_NPATCH, PSURF_SMOOTHED_N, SURFACE_NORMALS, PSURF_N_FINAL, 0, 0.2 },
    { "npatch nearly flat", PSURF_NPATCH, PSURF_SMOOTHED_N, SURFACE_NORMALS, PSURF_N_FINAL,
      PSURF_NEARLY_FLAT, 0.2 },
    { "hybrid", PSURF_HYBRID_TRI, PSURF_HYBRID, SURFACE_NORMALS, PSURF_N_G1, 0, 1 },
    { "png1", PSURF_PNG1_TRI, PSURF_PNG1, SURFACE_NORMALS, PSURF_N_G1, 0, 1 },
    { "ribbon", PSURF_RIBBON, PSURF_CUBIC_WM_B1, SURFACE_NORMALS, PSURF_N_G1, 0, 1 },
    { "ribbon_b2", PSURF_RIBBON_B2, PSURF_CUBIC_WM_B2, SURFACE_NORMALS, PSURF_N_G1, 0, 1 }
};

/* What is raced, in this order; the last three with n_of samples per edge. */
enum { VERTICES, PATCHES, POINTS_5, POINTS_17, POINTS_33, KIND_STAGES,
       SIZES = KIND_STAGES - POINTS_5, KIND_ROWS = sizeof kind_rows / sizeof *kind_rows };
static const uint32_t n_of[SIZES] = { 5, 17, 33 };
static const struct { const char *measure, *unit; } kind_stages[KIND_STAGES] = {
    { "kind: vertices", "ns/patch" }, { "kind: patches", "ns/patch" }, { "kind: N=5", "ns/point" },
    { "kind: N=17", "ns/point" }, { "kind: N=33", "ns/point" }
};

typedef struct contender {
    mesh m;
    surface s;
    tessellation t[SIZES];
} contender;

/* For the file. */
static double kind_cost[KIND_STAGES][KIND_ROWS];

static mesh mesh_of_row(const kind_row *row, uint32_t quads)
{
    const uint32_t size = (uint32_t)sqrt(quads * 5 / 6.0);
    if (row->lumps < 1) return mesh_triangles("smooth", size, size, row->lumps);
    return mesh_of_kind((int)row->kind, quads);
}

/* Of the facets. */
static double share_of(const contender *c, psurf_kind kind)
{
    return (double)c->s.patches.layout.kind[kind].count / c->s.info.facets;
}

/* first: the first row, which has been opened before the others. */
static void open_contender(contender *c, const contender *first, const kind_row *row,
                           const plan *p, uint32_t quads)
{
    psurf_construct_desc how;
    int i;
    memset(&how, 0, sizeof how);
    how.variant = row->variant;
    how.flags = row->flags;
    c->m = mesh_of_row(row, quads);
    surface_open_as(&c->s, &c->m, row->scheme, &how);
    if (share_of(c, row->kind) < 0.9)
        fail("a mesh of one kind of patch has too many others");
    for (i = 0; i < SIZES; i++) {
        tessellation_open(&c->t[i], &c->s, n_of[i], row->normals, p->out);
        tessellation_resize(&c->t[i], first->t[i].points);
        check_tessellation(p, &c->t[i], row->name);
    }
}

static runner kind_runner(contender *c, const char *name, int stage)
{
    tessellation *t = &c->t[stage < POINTS_5 ? 0 : stage - POINTS_5];
    if (stage == VERTICES) return make_runner(name, run_vertices, &c->s, c->s.info.facets);
    if (stage == PATCHES) return make_runner(name, run_facets, &c->s, c->s.info.facets);
    return make_runner(name, run_tessellation, t, t->points);
}

static void race_stage_of_kinds(const plan *p, contender *c, int stage)
{
    runner r[KIND_ROWS];
    int k;
    progress(kind_stages[stage].measure);
    for (k = 0; k < KIND_ROWS; k++) r[k] = kind_runner(&c[k], kind_rows[k].name, stage);
    race(r, KIND_ROWS, p->seconds, p->rounds);
    for (k = 0; k < KIND_ROWS; k++) {
        kind_cost[stage][k] = r[k].median;
        note(c[k].m.name, c[k].m.faces, kind_stages[stage].measure, r[k].name,
             kind_stages[stage].unit, r[k].min, r[k].median, r[k].runs);
    }
}

static double times_bicubic(int k) { return kind_cost[POINTS_17][k] / kind_cost[POINTS_17][0]; }

static unsigned patch_bytes(const contender *c, const kind_row *row)
{
    return (unsigned)(c->s.patches.layout.kind[row->kind].points * 3 * sizeof(psurf_real));
}

static void print_kinds(const contender *c)
{
    int k, i;
    progress(NULL);
    printf("\nkinds of patch, on meshes of one kind each; median ns\n  %-20s %-10s %5s %6s %9s %8s "
           "%10s %10s %10s %8s\n  %-20s %-10s %5s %6s %9s %8s %10s %10s %10s %8s\n", "kind", "mesh",
           "share", "bytes", "vertices", "patch", "point N=5", "N=17", "N=33", "times", "", "", "",
           "", "", "", "", "", "", "bicubic");
    for (k = 0; k < KIND_ROWS; k++) {
        const kind_row *row = &kind_rows[k];
        printf("  %-20s %-10s %3.0f %% %6u %9.2f %8.2f", row->name, c[k].m.name,
               100 * share_of(&c[k], row->kind), patch_bytes(&c[k], row),
               kind_cost[VERTICES][k], kind_cost[PATCHES][k]);
        for (i = POINTS_5; i < KIND_STAGES; i++) printf(" %10.2f", kind_cost[i][k]);
        printf(" %8.2f\n", times_bicubic(k));
        note(c[k].m.name, c[k].m.faces, "kind: bytes", row->name, "byte/patch",
             patch_bytes(&c[k], row), patch_bytes(&c[k], row), 1);
        note(c[k].m.name, c[k].m.faces, "kind: N=17 in bicubic points", row->name, "ratio",
             times_bicubic(k), times_bicubic(k), 1);
    }
    printf("  vertices: construction of what the patches of a facet read, per facet; shade: with "
           "shading normals\n");
}

/* ---- flat edges, passed over ----------------------------------------------------------------- */

/* Percent of the edges of facets, and of those of eight facets in a row, which are worked on
   together: there all eight have to be flat. */
typedef struct flat_share { double edges, eights; } flat_share;

static flat_share flat_edges(const surface *s)
{
    const uint32_t eights = s->info.facets / 8;
    uint32_t edges = 0, all = 0, i, k, e;
    flat_share share;
    for (i = 0; i < eights; i++)
        for (e = 0; e < 3; e++) {
            uint32_t flat = 0;
            for (k = 0; k < 8; k++)             /* of N-patches: see psurf_kind */
                flat += psurf_get_patch(&s->patches, 8 * i + k).points[3 * 16 + e] >= 1;
            edges += flat;
            all += flat == 8;
        }
    share.edges = 100.0 * edges / (24.0 * eights);
    share.eights = 100.0 * all / (3.0 * eights);
    return share;
}

static void print_flat_edges(const contender *c)
{
    int k, i;
    printf("  nearly flat: final with PSURF_NEARLY_FLAT. Edges that are, those that are in all of "
           "eight facets; gain\n");
    for (k = 1; k < KIND_ROWS; k++) {
        const flat_share share = flat_edges(&c[k].s);
        if (!(kind_rows[k].flags & PSURF_NEARLY_FLAT)) continue;
        printf("  %-20s %-10s %3.0f %% %3.0f %% %19s", "", c[k].m.name, share.edges,
               share.eights, "");
        for (i = POINTS_5; i < KIND_STAGES; i++) {
            const double gain = kind_cost[i][k - 1] / kind_cost[i][k];
            printf(" %8.2f x", gain);
            note(c[k].m.name, c[k].m.faces, kind_stages[i].measure, "nearly flat: gain", "ratio",
                 gain, gain, 1);
        }
        printf("\n");
        note(c[k].m.name, c[k].m.faces, "nearly flat edges", "patchsurf", "%", share.edges,
             share.edges, 1);
        note(c[k].m.name, c[k].m.faces, "nearly flat edges in all of eight facets", "patchsurf",
             "%", share.eights, share.eights, 1);
    }
}

void run_kinds(const plan *p, uint32_t quads)
{
    contender *c = (contender *)allocate(KIND_ROWS * sizeof *c);
    int i;
    progress("kinds of patch");
    memset(c, 0, KIND_ROWS * sizeof *c);
    for (i = 0; i < KIND_ROWS; i++) open_contender(&c[i], &c[0], &kind_rows[i], p, quads);
    for (i = 0; i < KIND_STAGES; i++) race_stage_of_kinds(p, c, i);
    print_kinds(c);
    print_flat_edges(c);
    fflush(stdout);
    for (i = 0; i < KIND_ROWS; i++) {
        surface_close(&c[i].s);
        mesh_free(&c[i].m);
    }
    free(c);
}

/* ---- [A] Table 2 ----------------------------------------------------------------------------- */

typedef struct paper_row {
    const char *name;
    psurf_scheme scheme;
    double printed[2];                  /* ms */
} paper_row;

static const paper_row paper_rows[] = {
    { "hybrid", PSURF_HYBRID, { 331, 1080 } },
    { "png1", PSURF_PNG1, { 202, 730 } },
    { "wm", PSURF_WM, { 76.9, 266 } },          /* this and the next are one surface */
    { "cubic_wm_b1", PSURF_CUBIC_WM_B1, { 83, 286 } }
};

enum { PAPER_ROWS = sizeof paper_rows / sizeof *paper_rows, PAPER_SIZES = 2 };
static const struct { uint32_t rate; const char *points, *measure; } paper_sizes[PAPER_SIZES] = {
    { 9, "55", "[A] Table 2: 55 points" }, { 19, "210", "[A] Table 2: 210 points" }
};

static double paper_ratio[PAPER_SIZES][PAPER_ROWS];     /* for the file: printed / here */

static double ms(double ns) { return 1e-6 * ns; }

static void race_paper_size(const plan *p, surface *s, int size)
{
    tessellation t[PAPER_ROWS];
    runner r[PAPER_ROWS];
    int k;
    progress(paper_sizes[size].measure);
    for (k = 0; k < PAPER_ROWS; k++) {
        tessellation_open(&t[k], &s[k], paper_sizes[size].rate + 1, SURFACE_NORMALS, p->out);
        check_tessellation(p, &t[k], paper_rows[k].name);
        r[k] = make_runner(paper_rows[k].name, run_frame, &t[k], 1);
    }
    race(r, PAPER_ROWS, p->seconds, p->rounds);
    progress(NULL);
    for (k = 0; k < PAPER_ROWS; k++) {
        const double printed = paper_rows[k].printed[size], here = ms(r[k].median);
        paper_ratio[size][k] = printed / here;
        printf("    %-14s %10s %10.1f %10.3f %10.3f %8.0f x\n", r[k].name,
               paper_sizes[size].points, printed, ms(r[k].min), here, paper_ratio[size][k]);
        note(s[k].m->name, s[k].m->faces, paper_sizes[size].measure, r[k].name, "ms/mesh",
             ms(r[k].min), here, r[k].runs);
        note(s[k].m->name, s[k].m->faces, paper_sizes[size].measure, r[k].name, "ratio",
             paper_ratio[size][k], paper_ratio[size][k], 1);
    }
}

static void race_paper_build(const plan *p, surface *s)
{
    runner r = make_runner(paper_rows[0].name, run_build, s, 1);
    race(&r, 1, p->seconds / 2, p->rounds);
    printf("  of connectivity, not included: %.3f ms, once\n", ms(r.median));
    note(s->m->name, s->m->faces, "[A] Table 2: build", "patchsurf", "ms/mesh", ms(r.min),
         ms(r.median), r.runs);
}

void run_table2(const plan *p)
{
    mesh m = mesh_triangles("triangles", 25, 20, 1);
    psurf_construct_desc how;
    surface s[PAPER_ROWS];
    int k;
    memset(&how, 0, sizeof how);
    for (k = 0; k < PAPER_ROWS; k++) surface_open_as(&s[k], &m, paper_rows[k].scheme, &how);
    printf("\n[A] Table 2, %u triangles: vertex normals, construction, positions and exact "
           "normals; ms per mesh\n    %-14s %10s %10s %10s %10s %10s\n", (unsigned)m.faces,
           "scheme", "points", "printed", "min", "median", "ratio");
    for (k = 0; k < PAPER_SIZES; k++) race_paper_size(p, s, k);
    race_paper_build(p, &s[0]);
    fflush(stdout);
    for (k = 0; k < PAPER_ROWS; k++) surface_close(&s[k]);
    mesh_free(&m);
}

/* ---- the file -------------------------------------------------------------------------------- */

void write_kinds_json(void *stream)
{
    FILE *file = (FILE *)stream;
    const char *comma = "";
    int k, i;
    fprintf(file, "\"times_bicubic\": {");
    for (k = 1; k < KIND_ROWS; k++) {
        if (kind_rows[k].lumps < 1) continue;           /* names stand once */
        fprintf(file, "%s\"%s\": %.3f", comma, kind_rows[k].name, times_bicubic(k));
        comma = ", ";
    }
    fprintf(file, "},\n  \"table2\": {");
    for (k = 0; k < PAPER_ROWS; k++) {
        fprintf(file, "%s\"%s\": {", k ? ", " : "", paper_rows[k].name);
        for (i = 0; i < PAPER_SIZES; i++)
            fprintf(file, "%s\"%s\": %.1f", i ? ", " : "", paper_sizes[i].points,
                    paper_ratio[i][k]);
        fprintf(file, "}");
    }
    fprintf(file, "}");
}
