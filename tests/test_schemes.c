/* The point-normal schemes against what was published and measured of them: the reference's points
   (tests/data, see convert.py), the papers' tables, tangent planes across edges, hard edges, and
   where normals come from. */
#include "schemes.h"

/* ---- points of the reference ----------------------------------------------------------------- */

static style as_listed(int which)
{
    style y = styles[which];
    y.shading = PSURF_SHADE_LINEAR;
    y.flags = 0;
    return y;
}

typedef struct difference { double p, n, shade, gauss; uint32_t points, gausses; } difference;

static void compare_case(const golden_case *g, const style *y, difference *worst)
{
    surface s;
    uint32_t i;
    scene_build(&s, &g->c, y, PSURF_NORMALS_AVERAGE);
    for (i = 0; i < g->sample_count; i++) {
        const golden_sample *x = &g->samples[i];
        psurf_sample at = make_sample(x->face, 0, x->u, x->v);
        point ours = eval_at(&s.patches, at);
        vec shade = shade_at(&s.patches, at);
        worst->p = fmax(worst->p, distance(ours.p, x->p));
        worst->n = fmax(worst->n, angle_between(ours.n, x->n));
        /* schemes without normals of their own shade with the surface's */
        worst->shade = fmax(worst->shade, angle_between(shade, x->has_shade ? x->shade : ours.n));
        REQUIRE(is_finite_vec(ours.p) && is_finite_vec(ours.n) && is_finite_vec(shade),
                "%s %s: sample %u\n", y->name, g->name, (unsigned)i);
        worst->points++;
        if (x->has_gauss) {
            psurf_real gauss = -1, mean = -1;
            psurf_curvature(&s.patches, &at, 1, &gauss, &mean);
            /* what is flat in the reference is flat to rounding: an absolute part */
            worst->gauss = fmax(worst->gauss, fabs((double)gauss - x->gauss)
                                                  / (fabs(x->gauss) + 1e-5));
            REQUIRE(!isnan(gauss) && !isnan(mean), "%s: curvature of sample %u\n", g->name,
                    (unsigned)i);
            worst->gausses++;
        }
    }
    surface_free(&s);
}

static const struct { const char *file; int style; uint32_t samples, gausses; } golden_files[] = {
    {"pn_triangle", PN, 330, 132},
    {"pn_quad", PN, 390, 0},
    {"smoothed_n_g1", N_G1, 330, 132},
    {"smoothed_n_final", N_FINAL, 330, 132},
    {"smoothed_n_intermediate", N_BETWEEN, 330, 132},
    {"hybrid", HYBRID, 330, 132},
    {"png1", PNG1, 330, 132},
    {"cubic_wm_b1", WM, 330, 132},
    {"cubic_pn_b1", PN_B1, 330, 132},
    {"cubic_wm_b2", WM_B2, 330, 132},
    {"cubic_pn_b2", PN_B2, 330, 132},
    {"hard_pn_triangle", PN, 360, 144},
    {"hard_hybrid", HYBRID, 360, 144},
    {"hard_cubic_wm_b1", WM, 360, 144}};

static void test_golden(void **state)
{
    uint32_t f, i;
    (void)state;
    for (f = 0; f < COUNT_OF(golden_files); f++) {
        golden_case cases[GOLDEN_MAX_CASES];
        const uint32_t count = golden_load(golden_files[f].file, cases);
        const style y = as_listed(golden_files[f].style);
        difference worst;
        memset(&worst, 0, sizeof worst);
        for (i = 0; i < count; i++) {
            compare_case(&cases[i], &y, &worst);
            golden_free(&cases[i]);
        }
        print_message("%s: %u samples, p %.2g, n %.2g rad, shade %.2g rad, K %.2g\n",
                      golden_files[f].file, (unsigned)worst.points, worst.p, worst.n, worst.shade,
                      worst.gauss);
        assert_int_equal(worst.points, golden_files[f].samples);
        assert_int_equal(worst.gausses, golden_files[f].gausses);
        assert_true(worst.p <= (IS_DOUBLE ? 1e-9 : 3e-5));
        /* 1e-6 degrees */
        assert_true(worst.n <= (IS_DOUBLE ? 1.7e-8 : 1e-3));
        assert_true(worst.shade <= (IS_DOUBLE ? 1.7e-8 : 1e-3));
        if (IS_DOUBLE) assert_true(worst.gauss <= 1e-6);
    }
}

/* ---- the papers' tables ---------------------------------------------------------------------- */

typedef struct statistics { double low, high, mean, deviation; } statistics;

/* Of values; the deviation from count - 1, and from half the mean as tables 3 and 4 have it. */
static statistics summarize(const double *values, uint32_t count, int printed)
{
    statistics r = {INFINITY, -INFINITY, 0, 0};
    double square = 0;
    uint32_t i;
    for (i = 0; i < count; i++) {
        r.low = fmin(r.low, values[i]);
        r.high = fmax(r.high, values[i]);
        r.mean += values[i] / count;
    }
    for (i = 0; i < count; i++) square += (values[i] - r.mean) * (values[i] - r.mean) / (count - 1);
    r.deviation = sqrt(square + (printed ? r.mean * r.mean / 4 : 0));
    return r;
}

enum { SEGMENTS = 20 };

/* Signed distance to the sphere, or the torus, at the 231 samples of every triangle. */
static statistics distances(const surface *s, int torus)
{
    const uint32_t faces = s->info.faces;
    double *values = (double *)grab((size_t)faces * 231, sizeof(double));
    uint32_t f, i, j, n = 0;
    statistics r;
    for (f = 0; f < faces; f++) {
        psurf_sample at[231];
        vec p[231];
        uint32_t count = 0;
        for (j = 0; j <= SEGMENTS; j++)
            for (i = 0; i + j <= SEGMENTS; i++)
                at[count++] = make_sample(f, 0, (double)i / SEGMENTS, (double)j / SEGMENTS);
        eval_many(&s->patches, at, count, p, NULL);
        for (i = 0; i < count; i++)
            values[n++] = torus ? hypot(hypot(p[i].x, p[i].y) - 1, p[i].z) - 0.5
                                : length(p[i]) - 1;
    }
    assert_int_equal(n, faces * 231);
    r = summarize(values, n, 1);
    free(values);
    return r;
}

/* Gaussian curvature at the 171 samples inside every triangle. */
static statistics curvatures(const surface *s)
{
    const uint32_t faces = s->info.faces;
    double *values = (double *)grab((size_t)faces * 171, sizeof(double));
    uint32_t f, i, j, n = 0;
    statistics r;
    for (f = 0; f < faces; f++) {
        psurf_sample at[171];
        psurf_real gauss[171];
        uint32_t count = 0;
        for (j = 1; j < SEGMENTS; j++)
            for (i = 1; i + j < SEGMENTS; i++)
                at[count++] = make_sample(f, 0, (double)i / SEGMENTS, (double)j / SEGMENTS);
        psurf_curvature(&s->patches, at, count, gauss, NULL);
        for (i = 0; i < count; i++) values[n++] = (double)gauss[i];
    }
    assert_int_equal(n, faces * 171);
    r = summarize(values, n, 0);
    free(values);
    return r;
}

typedef struct row { int torus; uint32_t step; int style; statistics printed; } row;

/* published-tables.md: tables 3 and 4; wm and cubic_wm_b1 are one surface, both rows printed. */
static const row distance_rows[] = {
    {0, 0, HYBRID, {-0.00274014, 0.0131108, 0.00498299, 0.00479724}},
    {0, 0, PNG1, {-0.0111526, 0, -0.00695174, 0.00452694}},
    {0, 0, WM, {-0.0105214, 0, -0.00507952, 0.00375258}},
    {0, 0, WM, {-0.0105212, 0, -0.0050795, 0.00375258}},
    {0, 1, HYBRID, {-0.000161588, 0.00126064, 0.000440331, 0.000403261}},
    {0, 1, PNG1, {-0.00230867, 0, -0.000629614, 0.000615845}},
    {0, 1, WM, {-0.000817776, 0, -0.000329054, 0.000245696}},
    {0, 1, WM, {-0.000817716, 0, -0.000329053, 0.000245695}},
    {1, 5, HYBRID, {-0.0227294, 0.0478425, 0.00720392, 0.015833}},
    {1, 5, PNG1, {-0.158901, 0.044207, -0.00913514, 0.0326367}},
    {1, 5, WM, {-0.0977793, 0.0493978, -0.00872526, 0.0304518}},
    {1, 10, HYBRID, {-0.00262406, 0.00356019, 0.000410239, 0.000964081}},
    {1, 10, PNG1, {-0.00952291, 0.00411868, -0.000726871, 0.00221538}},
    {1, 10, WM, {-0.00544271, 0.00396627, -0.000399186, 0.00178612}},
    {1, 10, WM, {-0.00544268, 0.00396627, -0.000399186, 0.00178612}},
    {1, 20, HYBRID, {-0.000292093, 0.000354946, 2.6755e-05, 0.000100177}},
    {1, 20, PNG1, {-0.000647008, 0.000430048, -4.78646e-05, 0.00017302}},
    {1, 20, WM, {-0.000424266, 0.000427842, -1.60885e-05, 0.000150207}},
    {1, 20, WM, {-0.000424266, 0.000427842, -1.60887e-05, 0.000150205}}};

/* Table 6. */
static const row curvature_rows[] = {
    {0, 0, HYBRID, {0.327537, 1.83937, 0.901277, 0.414196}},
    {0, 0, PNG1, {0.807412, 1.45757, 1.04739, 0.131043}},
    {0, 0, WM, {0.768408, 1.1719, 0.971776, 0.123817}},
    {1, 5, HYBRID, {-820.956, 63.2143, -2.50575, 29.3715}},
    {1, 5, PNG1, {-8.33147, 8.23699, -0.585947, 2.33862}},
    {1, 5, WM, {-9.8852, 10.9848, -0.61218, 2.58269}}};

static void build_row(surface *s, const row *r)
{
    scene c = r->torus ? make_tube(r->step) : make_sphere(r->step);
    scene_build(s, &c, &styles[r->style], PSURF_NORMALS_AVERAGE);
    scene_free(&c);
}

static double worst_of(statistics a, statistics b, int relative)
{
    const double ours[4] = {a.low, a.high, a.mean, a.deviation};
    const double theirs[4] = {b.low, b.high, b.mean, b.deviation};
    double worst = 0;
    int i;
    for (i = 0; i < 4; i++)
        worst = fmax(worst, fabs(ours[i] - theirs[i]) / (relative ? fabs(theirs[i]) : 1));
    return worst;
}

static void test_tables(void **state)
{
    double worst = 0;
    statistics ours = {0, 0, 0, 0};
    uint32_t i;
    (void)state;
    if (!IS_DOUBLE) skip();
    for (i = 0; i < COUNT_OF(distance_rows); i++) {
        const row *r = &distance_rows[i];
        surface s;
        build_row(&s, r);
        if (i == 0 || r->style != r[-1].style || r->step != r[-1].step)
            ours = distances(&s, r->torus);
        REQUIRE(worst_of(ours, r->printed, 0) <= 1e-6, "%s %u, %s: %g %g %g %g\n",
                r->torus ? "torus" : "sphere", (unsigned)r->step, styles[r->style].name, ours.low,
                ours.high, ours.mean, ours.deviation);
        worst = fmax(worst, worst_of(ours, r->printed, 0));
        surface_free(&s);
    }
    print_message("tables 3 and 4: largest difference %.2g\n", worst);
    for (i = 0, worst = 0; i < COUNT_OF(curvature_rows); i++) {
        const row *r = &curvature_rows[i];
        surface s;
        build_row(&s, r);
        ours = curvatures(&s);
        REQUIRE(worst_of(ours, r->printed, 1) <= 1e-4, "%s %u, %s: %g %g %g %g\n",
                r->torus ? "torus" : "sphere", (unsigned)r->step, styles[r->style].name, ours.low,
                ours.high, ours.mean, ours.deviation);
        worst = fmax(worst, worst_of(ours, r->printed, 1));
        surface_free(&s);
    }
    print_message("table 6: largest relative difference %.2g\n", worst);
}

/* Table 5: cosines between the normals of vertices, means of four quads', and triangles. */
static void test_table_5(void **state)
{
    scene triangles, quads;
    mesh m = {0};
    double values[150];
    statistics r;
    surface s;
    uint32_t f, k, n = 0;
    (void)state;
    if (!IS_DOUBLE) skip();
    triangles = make_tube(5);
    quads = make_scene(m);
    for (k = 0; k < triangles.m.vertex_count; k++)
        mesh_point(&quads.m, triangles.m.positions[k]);
    for (f = 0; f < 50; f += 2) {
        const uint32_t *a = triangles.m.faces[f].v;
        mesh_quad(&quads.m, a[0], a[1], a[2], triangles.m.faces[f + 1].v[2]);
    }
    scene_build(&s, &quads, &styles[PN], PSURF_NORMALS_AVERAGE);
    for (f = 0; f < 50; f++)
        for (k = 0; k < 3; k++) {
            const uint32_t q = f / 2, corner = f % 2 ? (k ? k + 1 : 0) : k;
            values[n++] = dot(shade_at(&s.patches, edge_sample(q, 4, corner, 0)),
                              face_normal(&triangles.m, f));
        }
    r = summarize(values, n, 0);
    print_message("table 5: %.6g +- %.6g, %.6g to %.6g\n", r.mean, r.deviation, r.low, r.high);
    assert_true(fabs(r.mean - 0.726595) < 1e-6 && fabs(r.deviation - 0.0808356) < 1e-6);
    assert_true(fabs(r.low - 0.620812) < 1e-6 && fabs(r.high - 0.826384) < 1e-6);
    surface_free(&s);
    scene_free(&triangles);
    scene_free(&quads);
}

/* ---- tangent planes across edges ------------------------------------------------------------- */

static const int smooth_styles[] = {N_G1, HYBRID, HYBRID_NORMALS, PNG1, WM, PN_B1};

static psurf_check_result check_all(const surface *s, uint32_t rate)
{
    psurf_check_result r;
    assert_int_equal(psurf_check(&s->patches, &s->construct, rate, 0, PSURF_NONE, &r), PSURF_OK);
    return r;
}

static scene smooth_shape(uint32_t which)
{
    uint64_t rng = 5;
    switch (which) {
    case 0: return make_sphere(1);
    case 1: return make_sphere(2);
    case 2: return make_tube(5);
    case 3: return make_noisy_octahedron(&rng);
    case 4: return golden_scene("open_grid_4x4");
    default: return golden_scene("tetrahedron");
    }
}

/* Whether the hybrid patch's construction is singular at an edge: section 4, Domain. Normals are
   those of the vertices. */
static int hybrid_fails(const scene *c, const half_edge *a, const half_edge *b, int plane_normals)
{
    const mesh *m = &c->m;
    const vec *normals = c->normals;
    uint32_t v[4], k;
    vec p[4], mm, d;
    double least = 1, area, t;
    v[0] = a->from, v[1] = a->to;
    v[2] = m->faces[a->face].v[(a->corner + 2) % 3];
    v[3] = m->faces[b->face].v[(b->corner + 2) % 3];
    for (k = 0; k < 4; k++) p[k] = m->positions[v[k]];
    d = unit(sub(p[1], p[0]));
    mm = plane_normals ? add(normals[v[0]], normals[v[1]])
                       : add(face_normal(m, a->face), face_normal(m, b->face));
    mm = unit(mad(mm, -dot(mm, d), d));
    for (k = 0; k < 4; k++) least = fmin(least, fabs(dot(normals[v[k]], mm)));
    area = dot(cross(sub(p[1], p[0]), sub(p[2], p[0])), mm);
    t = dot(cross(sub(p[1], p[0]), sub(p[3], p[0])), mm) / area;
    return least < 0.1 || t >= 0;
}

static int bisector_fails(const scene *c, const half_edge *a, const half_edge *b)
{
    return hybrid_fails(c, a, b, 0);
}

static int normals_fail(const scene *c, const half_edge *a, const half_edge *b)
{
    return hybrid_fails(c, a, b, 1);
}

/* Edges that a test holds for. */
static uint32_t count_edges(const scene *c, edge_test *holds)
{
    edge_map map = map_edges(&c->m);
    uint32_t i, n = 0;
    for (i = 0; holds && i < map.count; i++) {
        const half_edge *a = &map.edges[i], *b = find_edge(&map, a->to, a->from);
        n += b && a->from < a->to && holds(c, a, b);
    }
    free(map.edges);
    return n;
}

static void test_smooth(void **state)
{
    static const char *const names[] = {"sphere", "sphere", "torus", "noisy octahedron",
                                        "open grid", "tetrahedron"};
    uint32_t i, k, v;
    (void)state;
    for (k = 0; k < COUNT_OF(names); k++) {
        scene c = smooth_shape(k);
        surface s;
        kinks r;
        for (i = 0; i < COUNT_OF(smooth_styles); i++) {
            edge_test *fails = smooth_styles[i] == HYBRID ? bisector_fails
                             : smooth_styles[i] == HYBRID_NORMALS ? normals_fail : NULL;
            psurf_check_result check;
            memset(&r, 0, sizeof r);
            scene_build(&s, &c, &styles[smooth_styles[i]], PSURF_NORMALS_AVERAGE);
            if (!c.normals) {                   /* what the library made of them */
                c.normals = (vec *)grab(c.m.vertex_count, sizeof(vec));
                for (v = 0; v < corner_count(&c.m); v++)
                    c.normals[c.m.faces[v / 3].v[v % 3]] =
                        shade_at(&s.patches, edge_sample(v / 3, 3, v % 3, 0));
                c.normal_count = c.m.vertex_count;
            }
            measure_kinks(&r, &s, &c, 1.0 / 64, 63.0 / 64, 32, fails);
            check = check_all(&s, is_thorough() ? 16 : 4);
            print_message("%s, %s: %u edges, %.2g degrees, check %.2g\n", names[k],
                          styles[smooth_styles[i]].name, (unsigned)r.edges, r.worst,
                          check.max_normal_deg);
            /* the plane of the normals does not suit the torus: ten edges there, no others */
            assert_int_equal(check.fallback_edges, count_edges(&c, fails));
            assert_int_equal(check.fallback_edges,
                             k == 2 && smooth_styles[i] == HYBRID_NORMALS ? 10 : 0);
            assert_int_equal(check.cracks + check.nonfinite, 0);
            if (!check.fallback_edges)
                assert_true(check.max_normal_deg < (IS_DOUBLE ? 1e-9 : 0.05));
            REQUIRE(r.worst < (IS_DOUBLE ? 1e-9 : 0.05), "edge %u-%u at %g\n",
                    (unsigned)r.worst_from, (unsigned)r.worst_to, r.worst_at);
            surface_free(&s);
        }
        memset(&r, 0, sizeof r);                /* the measure sees what is not smooth */
        scene_build(&s, &c, &styles[PN], PSURF_NORMALS_AVERAGE);
        measure_kinks(&r, &s, &c, 1.0 / 64, 63.0 / 64, 32, NULL);
        assert_true(r.worst > 0.3);
        surface_free(&s);
        scene_free(&c);
    }
}

/* Kinks of the schemes that are not smooth, in degrees, as blend-formulas.md (8, 6 and 10) prints
   them: largest and mean over 19 places from 0.02 to 0.98 on every edge. Half a unit of the last
   digit; mean 0: not printed. */
typedef struct printed_kink { int shape, style; double worst, worst_unit, mean, mean_unit; }
    printed_kink;
enum { CUBE, TETRAHEDRON, ICOSAHEDRON, TORUS, OPEN_GRID };
static const printed_kink printed_kinks[] = {
    {CUBE, PN, 50, 1, 24, 1},
    {CUBE, N_BETWEEN, 21.9, 0.1, 6.1, 0.1},
    {CUBE, N_FINAL, 9.1, 0.1, 2.0, 0.1},
    {TETRAHEDRON, PN, 89, 1, 75, 1},
    {TETRAHEDRON, N_BETWEEN, 21.9, 0.1, 12.5, 0.1},
    {TETRAHEDRON, N_FINAL, 49.9, 0.1, 42, 1},
    {TETRAHEDRON, N_FOLDS, 22, 1, 12.5, 0.1},
    {TETRAHEDRON, WM_B2, 6.5, 0.1, 0, 0},
    {TETRAHEDRON, PN_B2, 11, 1, 0, 0},
    {ICOSAHEDRON, PN, 15.8, 0.1, 11.1, 0.1},
    {ICOSAHEDRON, N_BETWEEN, 2.4, 0.1, 1.3, 0.1},
    {ICOSAHEDRON, N_FINAL, 12.2, 0.1, 8.2, 0.1},
    {ICOSAHEDRON, WM_B2, 0.22, 0.01, 0, 0},
    {ICOSAHEDRON, PN_B2, 0.54, 0.01, 0, 0},
    {TORUS, PN, 41, 1, 15, 1},
    {TORUS, N_BETWEEN, 51, 1, 10, 1},
    {TORUS, N_FINAL, 22, 1, 9.9, 0.1},
    {TORUS, WM_B2, 1.95, 0.01, 0, 0},
    {TORUS, PN_B2, 2.3, 0.1, 0, 0},
    {OPEN_GRID, PN, 3.3, 0.1, 0, 0},
    {OPEN_GRID, N_BETWEEN, 7.6, 0.1, 0, 0},
    {OPEN_GRID, N_FINAL, 3.3, 0.1, 0, 0},
    {OPEN_GRID, WM_B2, 0.0165, 0.001, 0, 0},    /* printed 0.017; 0.01647 with these samples */
    {OPEN_GRID, PN_B2, 0.025, 0.001, 0, 0}};

/* The cube of 12 triangles is the library's own split of the quads: from the lowest vertex. */
static scene kinked_shape(int which)
{
    scene c;
    uint32_t i;
    switch (which) {
    case CUBE:
        c = make_scene(make_cube());
        for (i = 0; i < 6; i++) {
            mesh_face_data f = c.m.faces[i];
            const uint32_t a = apex_of(&f);
            c.m.faces[i].size = 3;
            c.m.faces[i].v[0] = f.v[a], c.m.faces[i].v[1] = f.v[(a + 1) % 4];
            c.m.faces[i].v[2] = f.v[(a + 2) % 4];
            mesh_tri(&c.m, f.v[a], f.v[(a + 2) % 4], f.v[(a + 3) % 4]);
        }
        c.normal_count = 8;
        c.normals = (vec *)grab(8, sizeof(vec));
        for (i = 0; i < 8; i++) c.normals[i] = unit(c.m.positions[i]);
        return c;
    case TETRAHEDRON: return golden_scene("tetrahedron");
    case ICOSAHEDRON: return make_sphere(0);
    case TORUS: return make_tube(5);
    default: return golden_scene("open_grid_4x4");
    }
}

static void test_printed_kinks(void **state)
{
    uint32_t i;
    (void)state;
    if (!IS_DOUBLE) skip();
    for (i = 0; i < COUNT_OF(printed_kinks); i++) {
        const printed_kink *k = &printed_kinks[i];
        scene c = kinked_shape(k->shape);
        style y = styles[k->style];
        surface s;
        kinks r;
        memset(&r, 0, sizeof r);
        y.flags &= PSURF_FOLDS;                 /* with default sigma, nothing counted as flat */
        scene_build(&s, &c, &y, PSURF_NORMALS_AVERAGE);
        measure_kinks(&r, &s, &c, 0.02, 0.98, 19, NULL);
        REQUIRE(fabs(r.worst - k->worst) <= 0.501 * k->worst_unit
                && (k->mean == 0 || fabs(r.sum / r.pairs - k->mean) <= 0.501 * k->mean_unit),
                "shape %d, %s: %g / %g, printed %g / %g\n", k->shape, y.name, r.worst,
                r.sum / r.pairs, k->worst, k->mean);
        surface_free(&s);
        scene_free(&c);
    }
}

/* ---- hard edges ------------------------------------------------------------------------------ */

/* Largest difference of a face's points from a cylinder of radius 1, on an edge or all over. */
static double radial_error(const surface *s, const mesh *m, uint32_t face, int edge)
{
    const psurf_split split = s->desc.split;
    double worst = 0;
    uint32_t i, j, piece, corners[4], count = 0;
    psurf_sample at[MAX_BATCH];
    vec p[MAX_BATCH];
    for (i = 0; edge >= 0 && i <= 64; i++)
        at[count++] = side_sample(split, m, face, (uint32_t)edge, i / 64.0);
    for (piece = 0; edge < 0 && piece < pieces_of(split, m->faces[face].size); piece++)
        for (j = 0; j <= 14; j++)
            for (i = 0; i <= 14; i++)
                if (piece_corners(split, &m->faces[face], piece, corners) == 4 || i + j <= 14)
                    at[count++] = piece_sample(split, m, face, piece, i / 14.0, j / 14.0);
    eval_many(&s->patches, at, count, p, NULL);
    for (i = 0; i < count; i++) worst = fmax(worst, fabs(hypot(p[i].x, p[i].y) - 1));
    return worst;
}

static const double handle_of[STYLES] = {0, 0, 0, 0, 0, 0, 2, 2, 1, 2, 0, 2, 0};

/* Rims of cans of 6, 8 and 12 sides, by the stretch mu of the scheme: blend-formulas.md 11. */
static const double rim_error[3][3] = {
    {2.6e-2, 8.5e-3, 1.7e-3}, {1.0e-2, 3.1e-3, 6.0e-4}, {4.1e-3, 1.2e-3, 2.1e-4}};
static const uint32_t rim_sides[3] = {6, 8, 12};

/* Half a unit of the second digit. */
static int prints_as(double value, double printed)
{
    return fabs(value - printed) <= 0.0501 * pow(10, floor(log10(printed) + 1e-9));
}

/* Positions and plane of the caps, normals on both sides of the rim. */
static void expect_caps(const surface *s, const scene *c, uint32_t sides, const char *name)
{
    const psurf_split split = s->desc.split;
    const mesh *m = &c->m;
    const double slack = IS_DOUBLE ? 2e-15 : 1e-6;
    const uint32_t steps = is_thorough() ? 8 : 4;
    edge_map map = map_edges(m);
    uint32_t f, i, j, piece, rims = 0;
    for (f = 0; f < m->face_count; f++) {
        const double z = m->positions[m->faces[f].v[0]].z;
        if (normal_of(c, f, 0) < sides) continue;
        for (piece = 0; piece < pieces_of(split, m->faces[f].size); piece++)
            for (j = 0; j <= steps; j++)
                for (i = 0; i <= steps; i++) {
                    uint32_t corners[4], size = piece_corners(split, &m->faces[f], piece, corners);
                    point p;
                    if (size == 3 && i + j > steps) continue;
                    p = eval_at(&s->patches, piece_sample(split, m, f, piece, (double)i / steps,
                                                           (double)j / steps));
                    REQUIRE(fabs(p.p.z - z) <= slack, "%s: cap at %g\n", name, p.p.z - z);
                    REQUIRE(angle_between(p.n, make_vec(0, 0, z)) <= 4 * slack,
                            "%s: normal of the cap %g %g %g\n", name, p.n.x, p.n.y, p.n.z);
                }
    }
    for (i = 0; i < map.count; i++) {
        const half_edge *a = &map.edges[i], *b = find_edge(&map, a->to, a->from);
        if (a->from > a->to || !sides_differ(c, a, b)) continue;
        rims++;
        for (j = 1; j < 32; j += 32 / steps - 1) {
            point pa = eval_at(&s->patches, side_sample(split, m, a->face, a->corner, j / 32.0));
            point pb = eval_at(&s->patches,
                               side_sample(split, m, b->face, b->corner, 1 - j / 32.0));
            assert_true(!memcmp(&pa.p, &pb.p, sizeof pa.p));
            REQUIRE(plane_angle(pa.n, pb.n) > 0.7, "%s: %g rad across the rim\n", name,
                    plane_angle(pa.n, pb.n));
        }
    }
    assert_int_equal(rims, 2 * sides);
    free(map.edges);
}

static void test_cans(void **state)
{
    uint32_t i, k, f;
    (void)state;
    for (i = 0; i < STYLES; i++) {
        const double *expected = rim_error[(int)handle_of[i]];
        double rim[3], side[3];
        for (k = 0; k < 3; k++) {
            scene c = make_can(rim_sides[k], 1, 0, 0);
            surface s;
            kinks r;
            memset(&r, 0, sizeof r);
            scene_build(&s, &c, &styles[i], PSURF_NORMALS_AVERAGE);
            assert_int_equal(s.info.hard_edges, 2 * rim_sides[k]);
            expect_caps(&s, &c, rim_sides[k], styles[i].name);
            for (f = 0, rim[k] = side[k] = 0; f < 2 * rim_sides[k]; f++) {
                rim[k] = fmax(rim[k], radial_error(&s, &c.m, f, f % 2 ? 1 : 0));
                side[k] = fmax(side[k], radial_error(&s, &c.m, f, -1));
            }
            REQUIRE(prints_as(rim[k], expected[k]), "%s, %u sides: rim %g, printed %g\n",
                    styles[i].name, (unsigned)rim_sides[k], rim[k], expected[k]);
            if (i == N_G1 || i == PNG1 || i == WM || i == PN_B1 || i == HYBRID) {
                measure_kinks(&r, &s, &c, 1.0 / 64, 63.0 / 64, 32, NULL);
                REQUIRE(r.worst < (IS_DOUBLE ? 1e-9 : 0.05), "%s: smooth edges of cans, %g\n",
                        styles[i].name, r.worst);
                if (k == 0)
                    print_message("%s: %g degrees across %u smooth edges of a can\n",
                                  styles[i].name, r.worst, (unsigned)r.edges);
            }
            surface_free(&s);
            scene_free(&c);
        }
        print_message("%s: rim %.2g %.2g %.2g, side %.2g %.2g %.2g\n", styles[i].name, rim[0],
                      rim[1], rim[2], side[0], side[1], side[2]);
        if (i == PN || i == PN_B1) assert_true(prints_as(side[0], 2.6e-2));
        if (i == PNG1) assert_true(prints_as(side[0], 2.3e-2));
        if (i == WM) assert_true(prints_as(side[0], 4.4e-3));
        if (i == HYBRID) assert_true(prints_as(side[0], 1.0e-2));
    }
}

/* PN quads: by rule (4) the side is worse than the rim; by the Coons rule it is the rim. */
static void test_cans_of_quads(void **state)
{
    static const double side_error[3] = {4.6e-2, 2.1e-2, 7.8e-3};
    uint32_t k, f, coons, polygons;
    (void)state;
    for (k = 0; k < 3; k++)
        for (coons = 0; coons < 2; coons++)
            for (polygons = 0; polygons < 2; polygons++) {
                scene c = make_can(rim_sides[k], 1, 1, (int)polygons);
                style y = styles[PN];
                surface s;
                double side = 0, rim = 0;
                y.flags = coons ? PSURF_COONS : 0;
                scene_build(&s, &c, &y, PSURF_NORMALS_AVERAGE);
                expect_caps(&s, &c, rim_sides[k], "quads");
                for (f = 0; f < rim_sides[k]; f++) {
                    rim = fmax(rim, radial_error(&s, &c.m, f, 0));
                    side = fmax(side, radial_error(&s, &c.m, f, -1));
                }
                print_message("quads, %u sides%s: rim %.2g, side %.2g\n", (unsigned)rim_sides[k],
                              coons ? ", coons" : "", rim, side);
                assert_true(prints_as(rim, rim_error[0][k]));
                assert_true(prints_as(side, coons ? rim_error[0][k] : side_error[k]));
                surface_free(&s);
                scene_free(&c);
            }
}

/* Hard ends here and there, on one end of an edge alone too: the edges between them stay smooth. */
static void test_smooth_beside_hard(void **state)
{
    uint32_t i, k;
    (void)state;
    if (!IS_DOUBLE) skip();
    for (i = 0; i < COUNT_OF(smooth_styles); i++) {
        uint64_t rng = 11;
        double worst = 0;
        uint32_t edges = 0, hard = 0;
        for (k = 0; k < 4; k++) {
            scene c = k < 2 ? make_sphere(1) : make_tube(k == 2 ? 6 : 9);
            surface s;
            kinks r;
            memset(&r, 0, sizeof r);
            free(c.normals);
            scene_vertex_normals(&c, &rng, 0.1);
            scene_split_normals(&c, &rng, k % 2 ? 4 : 12);
            scene_build(&s, &c, &styles[smooth_styles[i]], PSURF_NORMALS_AVERAGE);
            assert_int_equal(check_all(&s, 8).fallback_edges, 0);
            measure_kinks(&r, &s, &c, 1.0 / 64, 63.0 / 64, 32, NULL);
            worst = fmax(worst, r.worst);
            edges += r.edges;
            hard += s.info.hard_edges;
            surface_free(&s);
            scene_free(&c);
        }
        print_message("%s: %.2g degrees across %u smooth edges, %u hard ones between\n",
                      styles[smooth_styles[i]].name, worst, (unsigned)edges, (unsigned)hard);
        assert_true(worst < 1e-9);
        assert_true(edges > 400 && hard > 100);
    }
}

/* Area-weighted or unit normal of a piece. */
static vec piece_normal(psurf_split split, const mesh *m, uint32_t face, uint32_t piece, int area)
{
    uint32_t c[4], count = piece_corners(split, &m->faces[face], piece, c), k;
    vec n = make_vec(0, 0, 0);
    for (k = 0; k < count; k++)
        n = add(n, mul(0.5, cross(m->positions[m->faces[face].v[c[k]]],
                                  m->positions[m->faces[face].v[c[(k + 1) % count]]])));
    return area ? n : unit(n);
}

/* The cosine of a degree between n1 and n2, as blend-formulas.md section 1 asks: c.c < 3.05e-4. */
static int is_hard_end(vec n1, vec n2)
{
    const vec c = cross(n1, n2);
    return !(dot(n1, n2) > 0 && dot(c, c) < 3.05e-4);
}

/* The point next to p on the edge to q, from the normals on the two sides at both ends: section 1,
   rules PN, LEN and WM where no end is hard, one line at each end where one is. */
static vec edge_point(double mu, vec p, vec q, const vec np[2], const vec nq[2])
{
    const vec d = sub(q, p);
    const double l = length(d), dd = dot(d, d);
    vec m = unit(add(np[0], np[1])), n = unit(add(nq[0], nq[1])), e;
    if (!is_hard_end(np[0], np[1]) && !is_hard_end(nq[0], nq[1])) {
        const vec g = mul(1 / l, d);
        const double a = dot(m, n), a0 = dot(m, g), a1 = dot(n, g), den = 4 - a * a;
        const double rho = 6 * (2 * a0 + a * a1) / den, sig = 6 * (2 * a1 + a * a0) / den;
        const vec flat = mad(d, -dot(d, m), m);
        if (mu == 0) return mad(p, 1.0 / 3, flat);
        if (mu == 1) return mad(p, l / 3, unit(flat));
        return mad(p, l / 18, add(mul(6, g), add(mul(-2 * rho, m), mul(sig, n))));
    }
    e = mad(d, -dot(d, m), m);
    if (is_hard_end(np[0], np[1])) {
        const vec c = cross(np[0], np[1]);
        e = c;
        if (dot(c, c) < 3.05e-4) {              /* opposite */
            m = unit(sub(np[0], np[1]));
            e = mad(d, -dot(d, m), m);
        }
    }
    return mad(p, dot(d, e) * (1 + mu) * dd / (3 * (dot(e, e) * dd + mu * dot(d, e) * dot(d, e))),
               e);
}

/* The stored point next to corner a of a patch on the edge to its corner b. */
static vec stored_point(const psurf_patch *patch, uint32_t a, uint32_t b)
{
    static const uint32_t ten[3][3] = {{0, 1, 4}, {2, 0, 6}, {7, 8, 0}};
    static const uint32_t square[4][4] = {
        {0, 1, 0, 4}, {2, 0, 7, 0}, {0, 11, 0, 14}, {8, 0, 13, 0}};
    uint32_t at;
    if (patch->kind == PSURF_PN_QUAD) at = square[a][b];
    else if (patch->kind == PSURF_HYBRID_TRI) at = b == (a + 1) % 3 ? 3 + 5 * a : 4 + 5 * b;
    else at = ten[a][b];
    if (patch->kind != PSURF_PN_QUAD && patch->kind != PSURF_HYBRID_TRI && at > 4
        && patch->kind != PSURF_PN_TRI && patch->kind != PSURF_NPATCH)
        at--;                                   /* nine points: b111 is not among them */
    return load(patch->points + 3 * at);
}

/* Every edge of a face, from its own side: smooth, hard at one end or both, below a degree. */
static void test_edge_points(void **state)
{
    uint32_t i, turned, f, k, piece;
    (void)state;
    for (i = 0; i < STYLES; i++) {
        double worst = 0;
        uint32_t hard = 0, half = 0, slight = 0, smooth = 0;
        for (turned = 0; turned < 2; turned++) {
            uint64_t rng = 13;
            scene c = make_scene(make_creature());
            edge_map map;
            surface s;
            mesh_take(&c.m, make_cylinder(7, 1), 5);
            mesh_take(&c.m, make_torus(5, 4), 10);
            mesh_jitter(&c.m, &rng, 0.0625);
            scene_vertex_normals(&c, &rng, 0.2);
            if (turned) scene_turn_normals(&c, &rng, 30, 3);
            else scene_split_normals(&c, &rng, 15);
            map = map_edges(&c.m);
            scene_build(&s, &c, &styles[i], PSURF_NORMALS_AVERAGE);
            for (f = 0; f < c.m.face_count; f++)
                for (piece = 0; piece < pieces_of(s.desc.split, c.m.faces[f].size); piece++) {
                    const mesh_face_data *face = &c.m.faces[f];
                    const psurf_patch patch = find_patch(&s, f, piece);
                    uint32_t at[4];
                    const uint32_t count = piece_corners(s.desc.split, face, piece, at);
                    for (k = 0; k < count; k++) {
                        const uint32_t a = at[k], b = at[(k + 1) % count];
                        const vec p = c.m.positions[face->v[a]], q = c.m.positions[face->v[b]];
                        const half_edge *twin = find_edge(&map, face->v[b], face->v[a]);
                        vec np[2], nq[2];
                        int hard_p, hard_q;
                        np[0] = np[1] = c.normals[normal_of(&c, f, a)];
                        nq[0] = nq[1] = c.normals[normal_of(&c, f, b)];
                        if (twin && (a + 1) % face->size == b) {
                            np[1] = c.normals[normal_of(&c, twin->face, twin->corner + 1)];
                            nq[1] = c.normals[normal_of(&c, twin->face, twin->corner)];
                        }
                        hard_p = is_hard_end(np[0], np[1]), hard_q = is_hard_end(nq[0], nq[1]);
                        hard += hard_p && hard_q;
                        half += hard_p != hard_q;
                        slight += !hard_p && !hard_q
                                  && (distance(np[0], np[1]) > 0 || distance(nq[0], nq[1]) > 0);
                        smooth++;
                        /* the hybrid patch lifts the points of smooth edges in its own way */
                        if (styles[i].scheme == PSURF_HYBRID && !hard_p && !hard_q) continue;
                        worst = fmax(worst, distance(stored_point(&patch, k, (k + 1) % count),
                                                     edge_point(handle_of[i], p, q, np, nq)));
                        worst = fmax(worst, distance(stored_point(&patch, (k + 1) % count, k),
                                                     edge_point(handle_of[i], q, p, nq, np)));
                    }
                }
            free(map.edges);
            surface_free(&s);
            scene_free(&c);
        }
        print_message("%s: points on %u edges, %u hard, %u at one end, %u below a degree: %.2g\n",
                      styles[i].name, (unsigned)smooth, (unsigned)hard, (unsigned)half,
                      (unsigned)slight, worst);
        assert_true(worst < (IS_DOUBLE ? 1e-13 : 2e-5));
        assert_true(hard > 50 && half > 100 && slight > 20);
    }
}

/* The piece of a face that has the edge from a vertex to the next. */
static uint32_t piece_at(psurf_split split, const mesh *m, uint32_t face, uint32_t from,
                         uint32_t to)
{
    uint32_t piece, k, c[4];
    for (piece = 0; piece < pieces_of(split, m->faces[face].size); piece++) {
        const uint32_t count = piece_corners(split, &m->faces[face], piece, c);
        for (k = 0; k < count; k++)
            if (m->faces[face].v[c[k]] == from && m->faces[face].v[c[(k + 1) % count]] == to)
                return piece;
    }
    return PSURF_NONE;
}

/* Smoothed N-patches: how flat their edges are, by the normals of the two facets; which of the
   blended normals are turned; what the switches say. Section 8, its points 9 and 14. */
static void test_flatness(void **state)
{
    static const uint32_t flags[] = {0, PSURF_FOLDS, PSURF_NEARLY_FLAT,
                                     PSURF_FOLDS | PSURF_NEARLY_FLAT};
    const double slack = IS_DOUBLE ? 1e-13 : 1e-5;
    uint32_t variant, n, i, k, c[4], folds = 0, flat = 0, hard = 0, borders = 0, turned = 0;
    (void)state;
    for (variant = 0; variant < PSURF_N_COUNT; variant++)
        for (n = 0; n < COUNT_OF(flags); n++) {
            uint64_t rng = 15;
            style y = styles[N_G1];
            scene s;
            edge_map map;
            surface made;
            mesh m = make_tetrahedron();        /* folded by more than a right angle */
            mesh_take(&m, make_cylinder(7, 1), 5);
            mesh_take(&m, with_holes(make_creature(), &rng, 4), 10);
            mesh_jitter(&m, &rng, 0.03125);
            s = make_scene(m);
            scene_vertex_normals(&s, &rng, 0.1);
            scene_split_normals(&s, &rng, 5);
            map = map_edges(&s.m);
            y.variant = (psurf_variant)variant;
            y.flags = flags[n];
            scene_build(&made, &s, &y, PSURF_NORMALS_AVERAGE);
            for (i = 0; i < made.info.facets; i++) {
                const psurf_patch patch = psurf_get_patch(&made.patches, i);
                const psurf_split split = made.desc.split;
                const vec own = piece_normal(split, &s.m, patch.face, patch.sector, 0);
                const vec switches = load(patch.points + 3 * 18);
                const int is_final = variant == PSURF_N_FINAL;
                assert_true(switches.x == is_final && switches.y == is_final && switches.z == 0);
                piece_corners(split, &s.m.faces[patch.face], patch.sector, c);
                for (k = 0; k < 3; k++) {
                    const mesh_face_data *f = &s.m.faces[patch.face];
                    const uint32_t a = f->v[c[k]], b = f->v[c[(k + 1) % 3]];
                    const int outer = (c[k] + 1) % f->size == c[(k + 1) % 3];
                    const half_edge *here = outer ? find_edge(&map, a, b) : NULL;
                    const half_edge *twin = outer ? find_edge(&map, b, a) : NULL;
                    const uint32_t face = outer && twin ? twin->face : patch.face;
                    double expected = 1, dotted = 1;
                    int is_hard = 0;
                    if (outer && twin) {
                        is_hard = is_hard_end(s.normals[normal_of(&s, here->face, here->corner)],
                                              s.normals[normal_of(&s, face, twin->corner + 1)])
                                  || is_hard_end(
                                         s.normals[normal_of(&s, here->face, here->corner + 1)],
                                         s.normals[normal_of(&s, face, twin->corner)]);
                    }
                    if (!outer || twin) {
                        dotted = dot(own, piece_normal(split, &s.m, face,
                                                       piece_at(split, &s.m, face, b, a), 0));
                        expected = flags[n] & PSURF_FOLDS ? fmax(0, dotted) : fabs(dotted);
                        /* where rounding decides, either is right */
                        if (fabs(expected - 0.98) < 1e-5) continue;
                        if ((flags[n] & PSURF_NEARLY_FLAT) && expected > 0.98) expected = 1;
                    }
                    if (is_hard) expected = 1;
                    if (!is_final) expected = 0;
                    REQUIRE(fabs((double)patch.points[3 * 16 + k] - expected) < slack,
                            "face %u, edge %u-%u: %g, expected %g\n", (unsigned)patch.face,
                            (unsigned)a, (unsigned)b, (double)patch.points[3 * 16 + k], expected);
                    assert_true(patch.points[3 * 17 + k] == (variant == PSURF_N_G1 && !is_hard));
                    folds += dotted < 0;
                    flat += dotted > 0.98 && dotted < 0.999;
                    hard += (uint32_t)is_hard;
                    borders += outer && !twin;
                    turned += patch.points[3 * 17 + k] == 1;
                }
            }
            free(map.edges);
            surface_free(&made);
            scene_free(&s);
        }
    assert_true(folds > 60 && flat > 20 && hard > 60 && borders > 60 && turned > 200);
}

/* Inner points of PN triangles and quads, and of smoothed N-patches' PN triangle, from the boundary
   as it is stored: sections 2 and 3. */
static void test_inner_points(void **state)
{
    static const double sigmas[] = {0.5, 0, 1, 0.25};
    /* of corner i: the points towards the next and the one before, inner point, corner */
    static const uint32_t next[4] = {1, 7, 14, 8}, before[4] = {4, 2, 11, 13};
    static const uint32_t inside[4] = {5, 6, 10, 9}, corner[4] = {0, 3, 15, 12};
    uint32_t i, n, k, which, quads = 0, triangles = 0;
    double worst = 0;
    (void)state;
    for (which = 0; which < 3; which++)                 /* rule (4), Coons, smoothed_n */
        for (n = 0; n < COUNT_OF(sigmas); n++) {
            scene c = make_scene(make_creature());
            style y = styles[which == 2 ? N_FINAL : PN];
            surface s;
            y.flags = (n ? PSURF_SIGMA : 0u) | (which == 1 ? PSURF_COONS : 0u);
            y.sigma = n ? sigmas[n] : 77;               /* not read without its flag */
            scene_build(&s, &c, &y, PSURF_NORMALS_AVERAGE);
            for (i = 0; i < s.info.facets; i++) {
                const psurf_patch patch = psurf_get_patch(&s.patches, i);
                const double sigma = sigmas[n];
                vec b[16], q = make_vec(0, 0, 0);
                for (k = 0; k < 16; k++) b[k] = load(patch.points + 3 * k);
                if (patch.kind != PSURF_PN_QUAD) {
                    vec e = mul(1.0 / 6, add(add(add(b[1], b[2]), add(b[4], b[6])),
                                             add(b[7], b[8])));
                    vec v = mul(1.0 / 3, add(add(b[0], b[3]), b[9]));
                    worst = fmax(worst, distance(b[5], sub(mul(1 + sigma, e), mul(sigma, v))));
                    triangles++;
                    continue;
                }
                for (k = 0; k < 4; k++) q = add(q, add(b[next[k]], b[before[k]]));
                for (k = 0; k < 4; k++) {
                    const uint32_t l = (k + 1) % 4, o = (k + 2) % 4, r = (k + 3) % 4;
                    const vec own = add(b[next[k]], b[before[k]]);
                    const vec p = b[corner[k]], sides = add(b[corner[l]], b[corner[r]]);
                    vec e = mul(1.0 / 18, sub(mul(2, add(own, q)), add(b[next[o]], b[before[o]])));
                    vec v = mul(1.0 / 9, add(add(mul(4, p), mul(2, sides)), b[corner[o]]));
                    vec expected = sub(mul(1 + sigma, e), mul(sigma, v));
                    if (which == 1)                     /* 6 own + 3 of the neighbours', outwards */
                        expected = mul(1.0 / 9,
                                       sub(add(mul(6, own), mul(3, add(b[next[l]], b[before[r]]))),
                                           mul(9, v)));
                    worst = fmax(worst, distance(b[inside[k]], expected));
                    quads++;
                }
            }
            surface_free(&s);
            scene_free(&c);
        }
    print_message("inner points of %u triangles, %u of quads: %.2g\n", (unsigned)triangles,
                  (unsigned)quads, worst);
    assert_true(worst < (IS_DOUBLE ? 1e-14 : 2e-6));
    assert_true(triangles > 100 && quads > 100);
}

/* ---- where normals come from ----------------------------------------------------------------- */

/* One facet at a vertex, and the edges there between which it lies. */
typedef struct wedge { uint32_t face, piece, left, right, side; } wedge;

/* The facets around a vertex; those that meet in an edge that is not hard get the same side. */
static uint32_t wedges_at(psurf_split split, const mesh *m, uint32_t vertex, wedge *w)
{
    uint32_t n = 0, f, piece, i, k, turns;
    for (f = 0; f < m->face_count; f++)
        for (piece = 0; piece < pieces_of(split, m->faces[f].size); piece++) {
            uint32_t c[4], count = piece_corners(split, &m->faces[f], piece, c);
            for (k = 0; k < count; k++) {
                if (m->faces[f].v[c[k]] != vertex) continue;
                w[n].face = f, w[n].piece = piece, w[n].side = n;
                w[n].right = m->faces[f].v[c[(k + 1) % count]];
                w[n].left = m->faces[f].v[c[(k + count - 1) % count]];
                n++;
            }
        }
    for (turns = 0; turns < n; turns++)
        for (i = 0; i < n; i++)
            for (k = 0; k < n; k++)
                if (w[i].left == w[k].right && !mesh_is_hard(m, vertex, w[i].left))
                    w[i].side = w[k].side = w[i].side < w[k].side ? w[i].side : w[k].side;
    return n;
}

/* The sum over the facets on this side. */
static vec side_normal(psurf_split split, const mesh *m, const wedge *w, uint32_t n, uint32_t side,
                       int area)
{
    vec sum = make_vec(0, 0, 0);
    uint32_t i;
    for (i = 0; i < n; i++)
        if (w[i].side == side)
            sum = add(sum, piece_normal(split, m, w[i].face, w[i].piece, area));
    return unit(sum);
}

static mesh make_various(void)
{
    uint64_t rng = 17;
    mesh m = make_creature(), can = make_cylinder(7, 2);
    uint32_t k;
    for (k = 0; k < 7; k++) mesh_hard(&can, k, (k + 1) % 7);    /* one rim is a crease */
    mesh_take(&m, can, 8);
    mesh_take(&m, make_holed_grid(), 16);
    mesh_take(&m, with_hard(make_dodecahedron(), &rng, 20), 24);
    mesh_jitter(&m, &rng, 0.0625);
    return m;
}

static void test_computed_normals(void **state)
{
    static const int which[] = {PN, WM};
    uint32_t i, area, vertex, k, two_sided = 0;
    scene c = make_scene(make_various());
    double worst = 0, apart = 0;
    (void)state;
    for (i = 0; i < COUNT_OF(which); i++)
        for (area = 0; area < 2; area++) {
            surface s;
            scene_build(&s, &c, &styles[which[i]],
                        area ? PSURF_NORMALS_AREA : PSURF_NORMALS_AVERAGE);
            for (vertex = 0; vertex < c.m.vertex_count; vertex++) {
                wedge w[64];
                const uint32_t n = wedges_at(s.desc.split, &c.m, vertex, w);
                for (k = 0; k < n; k++) {
                    uint32_t corners[4], j = 0;
                    const mesh_face_data *f = &c.m.faces[w[k].face];
                    const uint32_t count = piece_corners(s.desc.split, f, w[k].piece, corners);
                    const vec n0 = side_normal(s.desc.split, &c.m, w, n, w[k].side, (int)area);
                    double u, v;
                    psurf_sample at;
                    while (f->v[corners[j]] != vertex) j++;
                    corner_place(count, j, &u, &v);
                    at = piece_sample(s.desc.split, &c.m, w[k].face, w[k].piece, u, v);
                    worst = fmax(worst, angle_between(shade_at(&s.patches, at), n0));
                    worst = fmax(worst, angle_between(eval_at(&s.patches, at).n, n0));
                    apart = fmax(apart, angle_between(n0, side_normal(s.desc.split, &c.m, w, n,
                                                                      w[k].side, !area)));
                    two_sided += w[k].side != w[0].side;
                }
            }
            surface_free(&s);
        }
    print_message("computed normals: %.2g rad; modes up to %.2g rad apart\n", worst, apart);
    assert_true(worst < (IS_DOUBLE ? 1e-12 : 1e-4));
    assert_true(apart > 0.05 && two_sided > 20);
    scene_free(&c);
}

/* Corners may name normals that are computed all the same: they tell which facets share one. */
static void test_computed_by_name(void **state)
{
    static const int which[] = {PN, WM};
    uint32_t i, f, k, piece, j, at[4];
    (void)state;
    for (i = 0; i < COUNT_OF(which); i++) {
        scene c = make_scene(make_cylinder(7, 2));
        uint64_t rng = 19;
        surface s;
        double worst = 0;
        mesh_jitter(&c.m, &rng, 0.125);
        scene_flat_normals(&c);                         /* one name per face */
        free(c.normals);
        c.normals = NULL;
        scene_build(&s, &c, &styles[which[i]], PSURF_NORMALS_AVERAGE);
        assert_int_equal(s.info.hard_edges, s.info.edges);
        for (f = 0; f < c.m.face_count; f++)
            for (k = 0; k < c.m.faces[f].size; k++) {
                vec n = make_vec(0, 0, 0);
                for (piece = 0; piece < pieces_of(s.desc.split, c.m.faces[f].size); piece++) {
                    const uint32_t count = piece_corners(s.desc.split, &c.m.faces[f], piece, at);
                    for (j = 0; j < count; j++)
                        if (at[j] == k)
                            n = add(n, piece_normal(s.desc.split, &c.m, f, piece, 0));
                }
                worst = fmax(worst, angle_between(
                    shade_at(&s.patches, side_sample(s.desc.split, &c.m, f, k, 0)), n));
            }
        assert_true(worst < (IS_DOUBLE ? 1e-13 : 1e-5));
        surface_free(&s);
        scene_free(&c);
    }
}

/* Every face of a closed mesh into quads, by its middle and those of its edges: vertices of four
   edges, of as many as the face had corners, of as many as the vertex had. */
static mesh make_quads(const mesh *from)
{
    mesh m = {0};
    uint32_t i, k, *middle;
    edge_map map = map_edges(from);
    for (i = 0; i < from->vertex_count; i++) mesh_point(&m, from->positions[i]);
    middle = (uint32_t *)grab(map.count, sizeof *middle);
    for (i = 0; i < map.count; i++) {
        const half_edge *a = &map.edges[i], *b = find_edge(&map, a->to, a->from);
        if (a->from > a->to) continue;
        middle[i] = middle[b - map.edges] =
            mesh_point(&m, mul(0.5, add(from->positions[a->from], from->positions[a->to])));
    }
    for (i = 0; i < from->face_count; i++) {
        const mesh_face_data *f = &from->faces[i];
        vec centre = make_vec(0, 0, 0);
        uint32_t v;
        for (k = 0; k < f->size; k++)
            centre = mad(centre, 1.0 / f->size, from->positions[f->v[k]]);
        v = mesh_point(&m, centre);
        for (k = 0; k < f->size; k++) {
            uint32_t before = f->v[(k + f->size - 1) % f->size], after = f->v[(k + 1) % f->size];
            mesh_quad(&m, f->v[k], middle[find_edge(&map, f->v[k], after) - map.edges], v,
                      middle[find_edge(&map, before, f->v[k]) - map.edges]);
        }
    }
    free(middle);
    free(map.edges);
    return m;
}

/* Limit point and normal of a closed vertex of quads: blend-formulas.md section 3. */
static void limit_of(const mesh *m, const edge_map *map, uint32_t vertex, vec *p, vec *normal)
{
    const uint32_t n = valence_of(map, vertex);
    const double a = 1 + cos(2 * PI / n) + cos(PI / n) * sqrt(2 * (9 + cos(2 * PI / n)));
    vec t1 = make_vec(0, 0, 0), t2 = t1, sum = mul((double)n * n, m->positions[vertex]);
    uint32_t end = map->edges[lower_edge(map, vertex, 0)].to, k;
    for (k = 0; k < n; k++) {
        const half_edge *e = find_edge(map, vertex, end);
        const uint32_t *f = m->faces[e->face].v, at = e->corner;
        const vec ek = m->positions[end], fk = m->positions[f[(at + 2) % 4]];
        const double c0 = cos(2 * PI * k / n), c1 = cos(2 * PI * (k + 1) / n);
        const double cm = cos(2 * PI * (k + n - 1) / n);
        sum = add(sum, add(mul(4, ek), fk));
        t1 = add(t1, add(mul(a * c0, ek), mul(c0 + c1, fk)));
        t2 = add(t2, add(mul(a * cm, ek), mul(cm + c0, fk)));
        end = f[(at + 3) % 4];                  /* the next edge counter-clockwise */
    }
    *p = mul(1.0 / (n * (n + 5.0)), sum);
    *normal = unit(cross(t1, t2));
}

static void test_limit_normals(void **state)
{
    uint64_t rng = 23;
    mesh bodies[3];
    uint32_t i, f, k, valences[12] = {0};
    double worst_p = 0, worst_n = 0;
    (void)state;
    bodies[0] = make_dodecahedron();
    bodies[1] = make_creature();
    bodies[2] = make_triangle_ball(7);
    for (i = 0; i < 3; i++) {
        scene c = make_scene(make_quads(&bodies[i]));
        surface s;
        edge_map map;
        mesh_jitter(&c.m, &rng, 0.0625);
        map = map_edges(&c.m);
        scene_build(&s, &c, &styles[PN], PSURF_NORMALS_LIMIT);
        for (f = 0; f < c.m.face_count; f++)
            for (k = 0; k < 4; k++) {
                const psurf_sample at = edge_sample(f, 4, k, 0);
                vec p, n;
                limit_of(&c.m, &map, c.m.faces[f].v[k], &p, &n);
                worst_p = fmax(worst_p, distance(p, eval_at(&s.patches, at).p));
                worst_n = fmax(worst_n, angle_between(n, shade_at(&s.patches, at)));
                valences[valence_of(&map, c.m.faces[f].v[k])]++;
            }
        free(map.edges);
        surface_free(&s);
        scene_free(&c);
        mesh_free(&bodies[i]);
    }
    print_message("limit points %.2g, normals %.2g rad\n", worst_p, worst_n);
    assert_true(worst_p < (IS_DOUBLE ? 1e-12 : 1e-5));
    assert_true(worst_n < (IS_DOUBLE ? 1e-12 : 1e-4));
    for (k = 3; k <= 7; k++) assert_true(valences[k] >= 6);
}

static int is_split_by_pm(const surface *s, uint32_t face)
{
    const psurf_facet *facets = (const psurf_facet *)s->tables.facets.data;
    return (facets[patch_of(s, face)].piece & PSURF_SPLIT_FACE) != 0;
}

/* On other meshes they are pm's: at corners, of mixed faces, boundaries and creases. */
static void test_limit_is_pm(void **state)
{
    static const int which[] = {PN, WM};
    uint32_t i, f, k;
    (void)state;
    for (i = 0; i < COUNT_OF(which); i++) {
        uint64_t rng = 29;
        mesh m = which[i] == PN ? make_torus(8, 7) : make_tube(7).m;
        scene c;
        surface s, pm;
        double worst_p = 0, worst_n = 0;
        if (which[i] == PN) mesh_split_quads(&m, &rng, 40);
        for (k = 0; k < 3; k++) mesh_hard(&m, 7 * k, 7 * k + 7);
        mesh_remove_face(&m, 30);               /* not at it: three sharp edges make corners */
        mesh_jitter(&m, &rng, 0.0625);
        c = make_scene(m);
        scene_build(&s, &c, &styles[which[i]], PSURF_NORMALS_LIMIT);
        surface_build(&pm, &c.m);
        for (f = 0; f < c.m.face_count; f++)
            for (k = 0; k < c.m.faces[f].size; k++) {
                const psurf_sample at = edge_sample(f, c.m.faces[f].size, k, 0);
                const point a = eval_at(&s.patches, at), b = eval_at(&pm.patches, at);
                if (is_split_by_pm(&pm, f)) continue;
                worst_p = fmax(worst_p, distance(a.p, b.p));
                worst_n = fmax(worst_n, angle_between(a.n, b.n));
            }
        print_message("%s: limit points %.2g, normals %.2g rad from pm's\n",
                      styles[which[i]].name, worst_p, worst_n);
        assert_true(worst_p < (IS_DOUBLE ? 1e-12 : 1e-5));
        assert_true(worst_n < (IS_DOUBLE ? 1e-12 : 1e-3));
        surface_free(&s);
        surface_free(&pm);
        scene_free(&c);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_golden),           cmocka_unit_test(test_tables),
        cmocka_unit_test(test_table_5),          cmocka_unit_test(test_smooth),
        cmocka_unit_test(test_printed_kinks),    cmocka_unit_test(test_cans),
        cmocka_unit_test(test_cans_of_quads),    cmocka_unit_test(test_smooth_beside_hard),
        cmocka_unit_test(test_edge_points),      cmocka_unit_test(test_inner_points),
        cmocka_unit_test(test_flatness),
        cmocka_unit_test(test_computed_normals), cmocka_unit_test(test_limit_normals),
        cmocka_unit_test(test_limit_is_pm),      cmocka_unit_test(test_computed_by_name)};
    return cmocka_run_group_tests_name("schemes", tests, NULL, NULL);
}
