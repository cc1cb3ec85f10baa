/* Evaluation against an evaluator of the test's own: numbers that carry their first and second
   derivatives go through plain de Casteljau and Bernstein sums of the stored points, so that no
   derivative and no chain rule is written down here. Then the edges of the contract: samples
   outside, outputs left out, curvature, bounds, interpolation. */
#include "common.h"

/* ---- numbers with derivatives ---------------------------------------------------------------- */

typedef struct jet { double f, x, y, xx, xy, yy; } jet;

static jet constant(double f)
{
    jet r = {0, 0, 0, 0, 0, 0};
    r.f = f;
    return r;
}

static jet plus(jet a, jet b)
{
    a.f += b.f, a.x += b.x, a.y += b.y, a.xx += b.xx, a.xy += b.xy, a.yy += b.yy;
    return a;
}

static jet times(jet a, jet b)
{
    jet r;
    r.f = a.f * b.f;
    r.x = a.x * b.f + a.f * b.x;
    r.y = a.y * b.f + a.f * b.y;
    r.xx = a.xx * b.f + 2 * a.x * b.x + a.f * b.xx;
    r.xy = a.xy * b.f + a.x * b.y + a.y * b.x + a.f * b.xy;
    r.yy = a.yy * b.f + 2 * a.y * b.y + a.f * b.yy;
    return r;
}

static jet scale(double s, jet a) { return times(constant(s), a); }
static jet minus(jet a, jet b) { return plus(a, scale(-1, b)); }

static jet inverse(jet a)
{
    jet r;
    double i = 1 / a.f;
    r.f = i;
    r.x = -a.x * i * i;
    r.y = -a.y * i * i;
    r.xx = (2 * a.x * a.x * i - a.xx) * i * i;
    r.xy = (2 * a.x * a.y * i - a.xy) * i * i;
    r.yy = (2 * a.y * a.y * i - a.yy) * i * i;
    return r;
}

typedef struct jet3 { jet c[3]; } jet3;

static jet3 constant3(vec p)
{
    jet3 r;
    r.c[0] = constant(p.x), r.c[1] = constant(p.y), r.c[2] = constant(p.z);
    return r;
}

/* a + w b */
static jet3 add_scaled(jet3 a, jet w, jet3 b)
{
    int k;
    for (k = 0; k < 3; k++) a.c[k] = plus(a.c[k], times(w, b.c[k]));
    return a;
}

static jet3 casteljau(const jet3 *points, jet t)
{
    jet3 work[4];
    int level, i, k;
    memcpy(work, points, sizeof work);
    for (level = 3; level > 0; level--)
        for (i = 0; i < level; i++)
            for (k = 0; k < 3; k++)
                work[i].c[k] = plus(work[i].c[k], times(t, minus(work[i + 1].c[k], work[i].c[k])));
    return work[0];
}

/* ---- the reference evaluator ----------------------------------------------------------------- */

static jet3 tensor(vec net[4][4], jet s, jet t)         /* net[j][i], i along s */
{
    jet3 rows[4], row[4];
    int i, j;
    for (j = 0; j < 4; j++) {
        for (i = 0; i < 4; i++) row[i] = constant3(net[j][i]);
        rows[j] = casteljau(row, s);
    }
    return casteljau(rows, t);
}

/* Quartic of sector i of a Pm patch, b[k][l]: k steps towards corner i+1, l towards the centre.
   pm-formulas (2) and (3). */
static void quartic(const psurf_patch *patch, uint32_t m, uint32_t i, vec b[5][5])
{
    const double c = cos(2 * PI / m), k2 = 0.5 / (1 - c), k1 = 1 - 2 * k2;
    uint32_t side;
    for (side = 0; side < 2; side++) {          /* the inner boundaries at corners i and i+1 */
        uint32_t here = (i + side) % m, back = (here + m - 1) % m;
        const psurf_real *p = patch->points + 18 * here, *q = patch->points + 18 * back;
        vec v = load(p), b310 = mul(0.25, mad(v, 3, load(p + 3)));
        vec b130 = mul(0.25, mad(v, 3, load(q + 6)));
        vec row = mad(mul(k1, v), k2, add(b310, b130));
        b[side ? 4 : 0][0] = v;
        b[side ? 3 : 0][1] = row;
        row = mad(mul(k1, row), k2, add(load(p + 9), load(q + 12)));
        b[side ? 2 : 0][2] = row;
        row = mad(mul(k1, row), k2, add(load(p + 15), load(q + 15)));
        b[side ? 1 : 0][3] = row;
        if (side == 0) {
            vec t1 = load(p + 6);
            vec end = load(patch->points + 18 * ((i + 1) % m));
            b[1][0] = b310;
            b[2][0] = mul(0.5, add(load(p + 3), t1));
            b[3][0] = mul(0.25, mad(end, 3, t1));
            b[1][1] = load(p + 9), b[2][1] = load(p + 12), b[1][2] = load(p + 15);
        }
    }
    b[0][4] = load(patch->points + 18 * m);
}

static jet3 bernstein4(vec b[5][5], jet wa, jet wb)
{
    static const double factorial[5] = {1, 1, 2, 6, 24};
    jet wc = minus(minus(constant(1), wa), wb);
    jet3 sum = constant3(make_vec(0, 0, 0));
    int j, k, l, n;
    for (k = 0; k <= 4; k++)
        for (l = 0; k + l <= 4; l++) {
            jet w = constant(24 / (factorial[4 - k - l] * factorial[k] * factorial[l]));
            j = 4 - k - l;
            for (n = 0; n < j; n++) w = times(w, wa);
            for (n = 0; n < k; n++) w = times(w, wb);
            for (n = 0; n < l; n++) w = times(w, wc);
            sum = add_scaled(sum, w, constant3(b[k][l]));
        }
    return sum;
}

/* Weights of corners i and i+1 in sector i of a triangle or quad. */
static void sector_weights(uint32_t m, uint32_t i, jet u, jet v, jet *wa, jet *wb)
{
    jet one = constant(1), turned;
    uint32_t k;
    if (m == 3) {
        jet w[3];
        w[0] = minus(minus(one, u), v), w[1] = u, w[2] = v;
        *wa = minus(w[i], w[(i + 2) % 3]);
        *wb = minus(w[(i + 1) % 3], w[(i + 2) % 3]);
        return;
    }
    for (k = 0; k < i; k++) {                   /* a quarter turn takes edge k+1 to edge k */
        turned = v;
        v = minus(one, u);
        u = turned;
    }
    *wb = minus(u, v);
    *wa = minus(minus(one, u), v);
}

/* The lowest sector that holds a place; on a line that is the lower one. */
static uint32_t sector_of(uint32_t m, double u, double v)
{
    const double w[3] = {1 - u - v, u, v}, away[4] = {v, 1 - u, 1 - v, u};
    uint32_t i, best = 0;
    for (i = 1; i < m; i++)
        if (m == 3 ? w[(i + 2) % 3] < w[(best + 2) % 3] : away[i] < away[best]) best = i;
    return best;
}

static jet3 reference(const surface *s, psurf_sample sample)
{
    uint32_t facet = patch_of(s, sample.face), m = s->sizes[sample.face], i, j;
    psurf_patch patch = psurf_get_patch(&s->patches, facet);
    jet u = constant((double)sample.u), v = constant((double)sample.v), a, b;
    vec net[4][4], sector[5][5];
    u.x = 1, v.y = 1;
    if (patch.kind == PSURF_BICUBIC || patch.kind == PSURF_POLAR) {
        for (j = 0; j < 4; j++)
            for (i = 0; i < 4; i++)
                net[j][i] = load(patch.points
                                 + 3 * (patch.kind == PSURF_POLAR && j == 3 ? 12 : 4 * j + i));
    }
    if (patch.kind == PSURF_BICUBIC) return tensor(net, u, v);
    if (patch.kind == PSURF_POLAR) {
        uint32_t base = ((const psurf_facet *)s->tables.facets.data)[facet].piece >> 16 & 3;
        jet w[3];
        w[0] = minus(minus(constant(1), u), v), w[1] = u, w[2] = v;
        a = w[base], b = w[(base + 1) % 3];
        return tensor(net, times(b, inverse(plus(a, b))), w[(base + 2) % 3]);
    }
    i = m == 5 ? sample.sector : sector_of(m, u.f, v.f);
    if (m == 5) a = u, b = v;
    else sector_weights(m, i, u, v, &a, &b);
    quartic(&patch, m, i, sector);
    return bernstein4(sector, a, b);
}

static point point_of(jet3 j)
{
    point p;
    p.p = make_vec(j.c[0].f, j.c[1].f, j.c[2].f);
    p.du = make_vec(j.c[0].x, j.c[1].x, j.c[2].x);
    p.dv = make_vec(j.c[0].y, j.c[1].y, j.c[2].y);
    p.duu = make_vec(j.c[0].xx, j.c[1].xx, j.c[2].xx);
    p.duv = make_vec(j.c[0].xy, j.c[1].xy, j.c[2].xy);
    p.dvv = make_vec(j.c[0].yy, j.c[1].yy, j.c[2].yy);
    p.n = unit(cross(p.du, p.dv));
    return p;
}

/* ---- values and derivatives ------------------------------------------------------------------ */

typedef struct worst { double p, n, first, second; uint32_t count; } worst;

/* Differences relative to the size of the mesh, about 1, and of its derivatives. */
static void compare(worst *w, const surface *s, psurf_sample sample)
{
    point ours = eval_at(&s->patches, sample), ref = point_of(reference(s, sample));
    double size = 1 + length(ref.duu) + length(ref.duv) + length(ref.dvv);
    double area = length(cross(ref.du, ref.dv)) / (length(ref.du) * length(ref.dv));
    w->p = fmax(w->p, distance(ours.p, ref.p));
    w->first = fmax(w->first, distance(ours.du, ref.du) / (1 + length(ref.du)));
    w->first = fmax(w->first, distance(ours.dv, ref.dv) / (1 + length(ref.dv)));
    w->second = fmax(w->second, distance(ours.duu, ref.duu) / size);
    w->second = fmax(w->second, distance(ours.duv, ref.duv) / size);
    w->second = fmax(w->second, distance(ours.dvv, ref.dvv) / size);
    if (area > 0.05) w->n = fmax(w->n, angle_between(ours.n, ref.n));
    w->count++;
}

/* How close a sample is to the pole of a polar face; 1 elsewhere. */
static double from_pole(const surface *s, psurf_sample sample)
{
    uint32_t facet = patch_of(s, sample.face);
    const double u = (double)sample.u, v = (double)sample.v, w[3] = {1 - u - v, u, v};
    if (psurf_get_patch(&s->patches, facet).kind != PSURF_POLAR) return 1;
    return 1 - w[((((const psurf_facet *)s->tables.facets.data)[facet].piece >> 16 & 3) + 2) % 3];
}

/* The creature with its corners turned, so that every corner is corner A of some polar face. */
static mesh turned_creature(uint64_t *rng)
{
    mesh m = make_creature();
    uint32_t f, k;
    mesh_jitter(&m, rng, 0.05);
    for (f = 0; f < m.face_count; f++) {
        mesh_face_data old = m.faces[f];
        for (k = 0; k < old.size; k++) m.faces[f].v[k] = old.v[(k + f) % old.size];
    }
    return m;
}

static void test_derivatives(void **state)
{
    uint64_t rng = 1;
    uint32_t i, counts[PSURF_KIND_COUNT] = {0};
    worst w[PSURF_KIND_COUNT];
    mesh m = turned_creature(&rng);
    surface s;
    (void)state;
    memset(w, 0, sizeof w);
    surface_build(&s, &m);
    for (i = 0; i < 20000; i++) {
        psurf_sample sample = random_sample(&m, &rng);
        psurf_kind kind = psurf_get_patch(&s.patches, patch_of(&s, sample.face)).kind;
        if (from_pole(&s, sample) < 0.05) continue;
        compare(&w[kind], &s, sample);
    }
    for (i = 0; i < PM_KINDS; i++) {
        print_message("%s: %u samples, p %.2g, n %.2g, first %.2g, second %.2g\n",
                      psurf_kind_name((psurf_kind)i), (unsigned)w[i].count, w[i].p, w[i].n,
                      w[i].first, w[i].second);
        assert_true(w[i].count > 500);
        assert_true(w[i].p < (IS_DOUBLE ? 4e-15 : 2e-6));
        assert_true(w[i].n < (IS_DOUBLE ? 1e-12 : 5e-4));
        assert_true(w[i].first < (IS_DOUBLE ? 1e-13 : 5e-5));
        assert_true(w[i].second < (IS_DOUBLE ? 1e-12 : 5e-4));
    }
    for (i = 0; i < s.info.facets; i++)
        counts[((const psurf_facet *)s.tables.facets.data)[i].piece >> 16 & 3]++;
    for (i = 0; i < 3; i++) assert_true(counts[i] > 2);
    surface_free(&s);
    mesh_free(&m);
}

/* On edges, at corners, on the lines between sectors (the lower one's) and at centres. */
static void test_special_places(void **state)
{
    uint64_t rng = 2;
    mesh m = turned_creature(&rng);
    uint32_t f, i, k;
    worst w;
    surface s;
    (void)state;
    memset(&w, 0, sizeof w);
    surface_build(&s, &m);
    for (f = 0; f < m.face_count; f++)
        for (i = 0; i < m.faces[f].size; i++) {
            psurf_sample places[10];
            uint32_t n = 0;
            for (k = 0; k <= 4; k++) places[n++] = edge_sample(f, m.faces[f].size, i, k / 4.0);
            if (m.faces[f].size == 4) {                 /* diagonals, exactly */
                places[n++] = make_sample(f, 0, 0.25, 0.25);
                places[n++] = make_sample(f, 0, 0.75, 0.75);
                places[n++] = make_sample(f, 0, 0.75, 0.25);
                places[n++] = make_sample(f, 0, 0.5, 0.5);
            } else if (m.faces[f].size == 3) {
                places[n++] = make_sample(f, 0, 0.25, 0.25);
                places[n++] = make_sample(f, 0, 0.25, 0.5);
                places[n++] = make_sample(f, 0, 0.5, 0.25);
            } else {
                places[n++] = make_sample(f, i, 0, 0), places[n++] = make_sample(f, i, 0.25, 0);
                places[n++] = make_sample(f, i, 0, 0.25);
            }
            while (n--)
                if (from_pole(&s, places[n]) > 0.01) compare(&w, &s, places[n]);
        }
    print_message("%u places: p %.2g, n %.2g, first %.2g, second %.2g\n", (unsigned)w.count, w.p,
                  w.n, w.first, w.second);
    assert_true(w.p < (IS_DOUBLE ? 4e-15 : 2e-6));
    assert_true(w.first < (IS_DOUBLE ? 1e-13 : 5e-5));
    assert_true(w.second < (IS_DOUBLE ? 1e-12 : 5e-4));
    assert_true(w.n < (IS_DOUBLE ? 1e-12 : 5e-4));
    surface_free(&s);
    mesh_free(&m);
}

/* At a pole: derivatives of the line from the middle of the base, second ones zero, no curvature;
   and first derivatives hold all the way there. */
static void test_poles(void **state)
{
    uint64_t rng = 3;
    mesh m = turned_creature(&rng);
    uint32_t i, poles = 0;
    surface s;
    (void)state;
    surface_build(&s, &m);
    for (i = s.tables.kind_first[PSURF_POLAR]; i < s.tables.kind_first[PSURF_POLAR + 1]; i++) {
        const psurf_facet facet = ((const psurf_facet *)s.tables.facets.data)[i];
        const double h = IS_DOUBLE ? 1e-7 : 1e-3, tolerance = IS_DOUBLE ? 1e-5 : 1e-2;
        uint32_t a = facet.piece >> 16 & 3, pole = (a + 2) % 3, k;
        psurf_sample at = make_sample(facet.face, 0, pole == 1, pole == 2);
        point p = eval_at(&s.patches, at), near;
        psurf_real gauss = 0, mean = 0;
        double w[3];
        w[pole] = 1 - h, w[a] = w[(a + 1) % 3] = h / 2;
        near = point_of(reference(&s, make_sample(facet.face, 0, w[1], w[2])));
        assert_true(distance(p.du, near.du) < tolerance);
        assert_true(distance(p.dv, near.dv) < tolerance);
        assert_true(length(p.du) > 0.01);
        assert_true(angle_between(p.n, cross(p.du, p.dv)) < tolerance);
        assert_true(length(p.duu) + length(p.duv) + length(p.dvv) == 0);
        psurf_curvature(&s.patches, &at, 1, &gauss, &mean);
        assert_true(isnan(gauss) && isnan(mean));
        for (k = 2; k < (IS_DOUBLE ? 12u : 5u); k++) {
            double step = pow(10, -(double)k), t = 0.1 + 0.8 * random_unit(&rng);
            psurf_sample close;
            point ours, ref;
            w[pole] = 1 - step, w[a] = step * (1 - t), w[(a + 1) % 3] = step * t;
            close = make_sample(facet.face, 0, w[1], w[2]);
            ours = eval_at(&s.patches, close);
            ref = point_of(reference(&s, close));
            /* the place itself is only known to rounding over its distance from the pole */
            assert_true(distance(ours.p, ref.p) < (IS_DOUBLE ? 4e-15 : 2e-6));
            assert_true(distance(ours.du, ref.du) < (IS_DOUBLE ? 4e-15 : 2e-6) / step + 1e-13);
            assert_true(distance(ours.dv, ref.dv) < (IS_DOUBLE ? 4e-15 : 2e-6) / step + 1e-13);
            assert_true(is_finite_vec(ours.n) && fabs(length(ours.n) - 1) < 1e-6);
            assert_true(angle_between(ours.n, p.n) < 100 * step + 1e-3);
        }
        poles++;
    }
    assert_int_equal(poles, 14);
    surface_free(&s);
    mesh_free(&m);
}

/* The derivatives are those of the positions: central differences, extrapolated, of the library's
   own output. The reference above could share a misreading of the domain; this cannot. */
static void test_differences(void **state)
{
    uint64_t rng = 4;
    mesh m;
    surface s;
    uint32_t i, k, tried = 0;
    const double h = 1.0 / 512;
    (void)state;
    if (!IS_DOUBLE) skip();
    m = turned_creature(&rng);
    surface_build(&s, &m);
    for (i = 0; i < 4000; i++) {
        psurf_sample sample = random_sample(&m, &rng);
        uint32_t size = m.faces[sample.face].size;
        double u = (double)sample.u, v = (double)sample.v, edge = size == 4 ? 1 : 1 - u - v;
        vec slope[2][2];
        int near_line = 0, d;
        if (u < 0.05 || v < 0.05 || edge < 0.05 || u > 0.95 || v > 0.95) continue;
        if (from_pole(&s, sample) < 0.2) continue;
        for (k = 0; k < 8 && size != 5; k++)            /* stay inside one sector */
            near_line |= sector_of(size, u + (k & 1 ? h : -h), v) != sector_of(size, u, v)
                      || sector_of(size, u, v + (k & 1 ? h : -h)) != sector_of(size, u, v);
        if (near_line) continue;
        for (d = 0; d < 2; d++)
            for (k = 0; k < 2; k++) {
                double step = k ? h / 2 : h, du = d ? 0 : step, dv = d ? step : 0;
                vec ahead = eval_at(&s.patches, make_sample(sample.face, sample.sector, u + du,
                                                            v + dv)).p;
                vec back = eval_at(&s.patches, make_sample(sample.face, sample.sector, u - du,
                                                           v - dv)).p;
                slope[d][k] = mul(0.5 / step, sub(ahead, back));
            }
        for (d = 0; d < 2; d++) {
            point p = eval_at(&s.patches, sample);
            vec best = mad(mul(4.0 / 3, slope[d][1]), -1.0 / 3, slope[d][0]);
            assert_true(distance(best, d ? p.dv : p.du) < 1e-6);
        }
        tried++;
    }
    assert_true(tried > 1000);
    surface_free(&s);
    mesh_free(&m);
}

/* ---- samples that are none ------------------------------------------------------------------- */

static void expect_same(const surface *s, psurf_sample a, psurf_sample b)
{
    point pa = eval_at(&s->patches, a), pb = eval_at(&s->patches, b);
    assert_memory_equal(&pa, &pb, sizeof pa);
}

static void expect_inside(const surface *s, psurf_sample sample)
{
    point p = eval_at(&s->patches, sample);
    psurf_real box[6];
    uint32_t last = s->info.faces - 1;
    psurf_bounds(&s->patches, sample.face < last ? sample.face : last, 1, box);
    assert_true(is_finite_vec(p.n) && is_finite_vec(p.du) && is_finite_vec(p.dv));
    assert_true(is_finite_vec(p.duu) && is_finite_vec(p.duv) && is_finite_vec(p.dvv));
    assert_true(p.p.x >= (double)box[0] && p.p.y >= (double)box[1] && p.p.z >= (double)box[2]);
    assert_true(p.p.x <= (double)box[3] && p.p.y <= (double)box[4] && p.p.z <= (double)box[5]);
}

static void test_outside(void **state)
{
    uint64_t rng = 5;
    mesh m = turned_creature(&rng);
    surface s;
    uint32_t i, k, f;
    (void)state;
    surface_build(&s, &m);
    for (f = 0; f < m.face_count; f++) {
        uint32_t last = m.faces[f].size - 1;
        expect_same(&s, make_sample(f, 1, NAN, 0.25), make_sample(f, 1, 0, 0.25));
        expect_same(&s, make_sample(f, 1, 0.25, NAN), make_sample(f, 1, 0.25, 0));
        expect_same(&s, make_sample(f, 1, NAN, NAN), make_sample(f, 1, 0, 0));
        expect_same(&s, make_sample(f, 1, -0.5, 0.25), make_sample(f, 1, 0, 0.25));
        expect_same(&s, make_sample(f, 1, 0.25, -1e30), make_sample(f, 1, 0.25, 0));
        expect_same(&s, make_sample(f, 1, -INFINITY, 1), make_sample(f, 1, 0, 1));
        expect_same(&s, make_sample(f, 1, INFINITY, 0), make_sample(f, 1, 1, 0));
        expect_same(&s, make_sample(f, 1, 0, INFINITY), make_sample(f, 1, 0, 1));
        if (last == 3) expect_same(&s, make_sample(f, 1, 7, 0.25), make_sample(f, 0, 1, 0.25));
        if (last == 4) {
            expect_same(&s, make_sample(f, 5, 0.25, 0.25), make_sample(f, 4, 0.25, 0.25));
            expect_same(&s, make_sample(f, PSURF_NONE, 0.5, 0), make_sample(f, 4, 0.5, 0));
        } else {
            expect_same(&s, make_sample(f, 3, 0.25, 0.5), make_sample(f, 0, 0.25, 0.5));
        }
    }
    f = m.face_count - 1;
    expect_same(&s, make_sample(m.face_count, 1, 0.25, 0.5), make_sample(f, 1, 0.25, 0.5));
    expect_same(&s, make_sample(PSURF_NONE, 1, 0.25, 0.5), make_sample(f, 1, 0.25, 0.5));
    for (i = 0; i < 20000; i++) {               /* any bytes */
        psurf_sample sample;
        unsigned char *bytes = (unsigned char *)&sample;
        for (k = 0; k < sizeof sample; k++) bytes[k] = (unsigned char)random_bits(&rng);
        if (i & 1) sample.face = random_below(&rng, m.face_count);
        if (i & 2) sample.u = (psurf_real)(4 * random_unit(&rng) - 2);
        if (i & 4) sample.v = (psurf_real)(4 * random_unit(&rng) - 2);
        expect_inside(&s, sample);
    }
    surface_free(&s);
    mesh_free(&m);
}

static void test_empty_mesh(void **state)
{
    mesh m = {0};
    surface s;
    psurf_sample sample = make_sample(0, 0, 0.5, 0.5);
    psurf_real p[3], box[6];
    psurf_points out;
    psurf_tess_desc tess;
    psurf_tess_span span;
    float value = 0;
    (void)state;
    memset(&out, 0, sizeof out);
    memset(&tess, 0, sizeof tess);
    out.p = p;
    tess.rate = 3;
    surface_build(&s, &m);
    psurf_eval(&s.patches, &sample, 1, &out);
    psurf_curvature(&s.patches, &sample, 1, p, p + 1);
    psurf_bounds(&s.patches, 0, 1, box);
    psurf_interpolate(s.topology, &sample, 1, &value, 1, &value, 0);
    assert_int_equal(psurf_tessellate_size(s.topology, &tess, 0, PSURF_NONE, &span), PSURF_OK);
    assert_int_equal(span.vertex_count + span.index_count, 0);
    surface_free(&s);
}

/* Vertices on one line, or in one point: no direction exists, the normal is zero, nothing is
   NaN. */
static void test_degenerate(void **state)
{
    uint64_t rng = 11;
    uint32_t round, i;
    (void)state;
    for (round = 0; round < 2; round++) {
        mesh m = make_creature();
        surface s;
        psurf_check_result check;
        for (i = 0; i < m.vertex_count; i++)
            m.positions[i] = make_vec(round ? 0 : m.positions[i].z, 0, 0);
        surface_build(&s, &m);
        for (i = 0; i < 2000; i++) {
            psurf_sample sample = random_sample(&m, &rng);
            point p = eval_at(&s.patches, sample);
            psurf_real gauss, mean;
            assert_true(is_finite_vec(p.p) && is_finite_vec(p.du) && is_finite_vec(p.dvv));
            assert_true(length(p.n) == 0);
            psurf_curvature(&s.patches, &sample, 1, &gauss, &mean);
            assert_true(isnan(gauss) && isnan(mean));
        }
        assert_int_equal(psurf_check(&s.patches, &s.construct, 4, 0, PSURF_NONE, &check), PSURF_OK);
        assert_int_equal(check.cracks + check.nonfinite, 0);
        assert_int_equal(check.degenerate, check.samples);
        assert_int_equal(check.worst_face & check.worst_edge, PSURF_NONE);
        surface_free(&s);
        mesh_free(&m);
    }
}

/* ---- outputs --------------------------------------------------------------------------------- */

/* Any choice of outputs, at any stride, gives the same bits and touches nothing else. */
static void test_outputs(void **state)
{
    enum { COUNT = 50, WIDE = 5 };
    uint64_t rng = 6;
    mesh m = turned_creature(&rng);
    psurf_sample samples[COUNT];
    psurf_real full[7][COUNT][3], wide[7][COUNT * WIDE];
    psurf_points out;
    uint32_t i, k, mask, c;
    surface s;
    (void)state;
    surface_build(&s, &m);
    for (i = 0; i < COUNT; i++) samples[i] = random_sample(&m, &rng);
    memset(&out, 0, sizeof out);
    out.p = full[0][0], out.n = full[1][0], out.du = full[2][0], out.dv = full[3][0];
    out.duu = full[4][0], out.duv = full[5][0], out.dvv = full[6][0], out.stride = 0;
    psurf_eval(&s.patches, samples, COUNT, &out);
    for (mask = 0; mask < 128; mask++) {
        psurf_real **to[7];
        to[0] = &out.p, to[1] = &out.n, to[2] = &out.du, to[3] = &out.dv;
        to[4] = &out.duu, to[5] = &out.duv, to[6] = &out.dvv;
        for (k = 0; k < 7; k++) {
            *to[k] = mask >> k & 1 ? wide[k] : NULL;
            for (i = 0; i < COUNT * WIDE; i++) wide[k][i] = -77;
        }
        out.stride = WIDE * sizeof(psurf_real);
        psurf_eval(&s.patches, samples, 0, &out);
        assert_true(wide[0][0] == -77);
        psurf_eval(&s.patches, samples, COUNT, &out);
        for (k = 0; k < 7; k++)
            for (i = 0; i < COUNT; i++) {
                if (mask >> k & 1) assert_true(same_bits(&wide[k][i * WIDE], full[k][i]));
                for (c = mask >> k & 1 ? 3 : 0; c < WIDE; c++)
                    assert_true(wide[k][i * WIDE + c] == -77);
            }
    }
    surface_free(&s);
    mesh_free(&m);
}

/* ---- batches --------------------------------------------------------------------------------- */

enum { BATCH = 700 };
typedef struct result { psurf_real at[7][3], curvature[2]; } result;

static void eval_batch(const surface *s, const psurf_sample *samples, uint32_t count, result *to)
{
    psurf_real gauss[BATCH], mean[BATCH];
    psurf_points out;
    uint32_t i;
    memset(&out, 0, sizeof out);
    out.p = to->at[0], out.n = to->at[1], out.du = to->at[2], out.dv = to->at[3];
    out.duu = to->at[4], out.duv = to->at[5], out.dvv = to->at[6], out.stride = sizeof *to;
    psurf_eval(&s->patches, samples, count, &out);
    psurf_curvature(&s->patches, samples, count, gauss, mean);
    for (i = 0; i < count; i++) to[i].curvature[0] = gauss[i], to[i].curvature[1] = mean[i];
}

/* In calls of block samples each, in a random order. */
static void expect_batches(const surface *s, const psurf_sample *samples, const result *want,
                           uint32_t block, uint64_t *rng)
{
    psurf_sample shuffled[BATCH];
    static result got[BATCH];
    uint32_t order[BATCH], i, k;
    for (i = 0; i < BATCH; i++) {
        k = random_below(rng, i + 1);
        order[i] = order[k];
        order[k] = i;
    }
    for (i = 0; i < BATCH; i++) shuffled[i] = samples[order[i]];
    memset(got, 0xEE, sizeof got);
    for (i = 0; i < BATCH; i += block)
        eval_batch(s, shuffled + i, block < BATCH - i ? block : BATCH - i, got + i);
    for (i = 0; i < BATCH; i++) assert_memory_equal(&got[i], &want[order[i]], sizeof *got);
}

/* Of all kinds, at corners, on edges, across the poles, at centres, on creases of blend ratio 0. */
static void batch_samples(const mesh *m, uint64_t *rng, psurf_sample *samples)
{
    uint32_t i, f;
    for (i = 0; i < BATCH; i++) {
        const uint32_t size = m->faces[f = random_below(rng, m->face_count)].size;
        const uint32_t side = random_below(rng, size);
        samples[i] = i % 3 == 0   ? edge_sample(f, size, side, random_below(rng, 5) / 4.0)
                     : i % 7 == 0 ? sector_sample(f, size, side, 0, 0)
                                  : random_sample_of(m, f, rng);
    }
}

/* Neither the order of samples nor how many a call takes shows in what comes out. */
static void test_batches(void **state)
{
    static const uint32_t blocks[] = {1, 2, 7, 8, 9, 31, 32, 33, 64, BATCH};
    static result want[BATCH];
    psurf_sample samples[BATCH];
    uint64_t rng = 12;
    mesh m = turned_creature(&rng);
    uint32_t i, round, kinds[PSURF_KIND_COUNT] = {0}, split = 0, sided = 0;
    surface s;
    (void)state;
    mesh_take(&m, make_marked(), 8);
    for (i = 0; i < m.face_count; i += 3) mesh_tag(&m, m.faces[i].v[0], m.faces[i].v[1], 0, 0);
    surface_build(&s, &m);
    for (round = 0; round < 4; round++) {
        batch_samples(&m, &rng, samples);
        for (i = 0; i < BATCH; i++) {
            kinds[psurf_get_patch(&s.patches, patch_of(&s, samples[i].face)).kind]++;
            split += (((const psurf_facet *)s.tables.facets.data)[patch_of(&s, samples[i].face)]
                          .piece & PSURF_SPLIT_FACE) != 0;
            eval_batch(&s, &samples[i], 1, &want[i]);
            sided += length(cross(load(want[i].at[2]), load(want[i].at[3]))) == 0
                  && length(load(want[i].at[1])) > 0.5;         /* a one-sided normal */
        }
        for (i = 0; i < COUNT_OF(blocks); i++) expect_batches(&s, samples, want, blocks[i], &rng);
    }
    for (i = 0; i < PM_KINDS; i++) assert_true(kinds[i] > 100);
    assert_true(split > 100 && sided >= 20);
    surface_free(&s);
    mesh_free(&m);
}

/* ---- curvature ------------------------------------------------------------------------------- */

static void test_curvature(void **state)
{
    uint64_t rng = 7;
    mesh m = turned_creature(&rng);
    surface s;
    uint32_t i, compared = 0;
    double most = 0;
    (void)state;
    surface_build(&s, &m);
    for (i = 0; i < 5000; i++) {
        psurf_sample sample = random_sample(&m, &rng);
        point p = point_of(reference(&s, sample));
        double e = dot(p.du, p.du), f = dot(p.du, p.dv), g = dot(p.dv, p.dv), area = e * g - f * f;
        double l = dot(p.duu, p.n), mm = dot(p.duv, p.n), n = dot(p.dvv, p.n);
        double gauss = (l * n - mm * mm) / area, mean = (e * n - 2 * f * mm + g * l) / (2 * area);
        psurf_real ours[2], alone[2];
        if (from_pole(&s, sample) < 0.1 || area < 0.1 * e * g) continue;
        psurf_curvature(&s.patches, &sample, 1, ours, ours + 1);
        psurf_curvature(&s.patches, &sample, 1, alone, NULL);
        psurf_curvature(&s.patches, &sample, 1, NULL, alone + 1);
        assert_memory_equal(ours, alone, sizeof ours);
        most = fmax(most, fabs((double)ours[0] - gauss) / (1 + mean * mean));
        most = fmax(most, fabs((double)ours[1] - mean) / (1 + fabs(mean)));
        compared++;
    }
    print_message("curvature: %u samples, largest difference %.2g\n", (unsigned)compared, most);
    assert_true(compared > 2000);
    assert_true(most < (IS_DOUBLE ? 1e-11 : 1e-2));
    surface_free(&s);
    mesh_free(&m);
}

/* Signs and sizes where they are known: a ball, and the graph of a quadratic, which the B-spline
   reproduces. */
static void test_known_curvature(void **state)
{
    const double a = -0.375, b = 0.25, c = 0.125;       /* z = a x^2 + b xy + c y^2 */
    const uint32_t n = 10;
    mesh m = make_torus(n, n), ball = make_latlong(24, 15);
    surface s;
    double most = 0;
    uint64_t rng = 8;
    uint32_t i, j;
    (void)state;
    for (i = 0; i < 6; i++)
        for (j = 0; j < 6; j++) {
            double x = i - 2.5, y = j - 2.5;
            m.positions[i * n + j] = make_vec(x, y, a * x * x + b * x * y + c * y * y);
        }
    surface_build(&s, &m);
    for (i = 0; i < 200; i++) {
        uint32_t fi = 1 + random_below(&rng, 3), fj = 1 + random_below(&rng, 3);
        double u = random_unit(&rng), v = random_unit(&rng), x = fi + u - 2.5, y = fj + v - 2.5;
        double zx = 2 * a * x + b * y, zy = b * x + 2 * c * y, w = 1 + zx * zx + zy * zy;
        double gauss = (4 * a * c - b * b) / (w * w);
        double mean = ((1 + zy * zy) * 2 * a - 2 * zx * zy * b + (1 + zx * zx) * 2 * c)
                    / (2 * w * sqrt(w));
        psurf_sample sample = make_sample(fi * n + fj, 0, u, v);
        psurf_real ours[2];
        psurf_curvature(&s.patches, &sample, 1, ours, ours + 1);
        assert_true(fabs((double)ours[0] - gauss) < (IS_DOUBLE ? 1e-12 : 2e-5));
        assert_true(fabs((double)ours[1] - mean) < (IS_DOUBLE ? 1e-12 : 2e-5));
    }
    surface_free(&s);
    mesh_free(&m);
    surface_build(&s, &ball);                           /* radius 1.5 */
    for (i = 0; i < 500; i++) {
        psurf_sample sample = random_sample(&ball, &rng);
        psurf_real ours[2];
        if (sample.face < (2 + 2) * 24 || sample.face >= (2 + 12) * 24) continue;   /* not caps */
        psurf_curvature(&s.patches, &sample, 1, ours, ours + 1);
        most = fmax(most, fabs((double)ours[1] * 1.5 + 1));
        most = fmax(most, fabs((double)ours[0] * 2.25 - 1));
    }
    print_message("ball: curvature off by %.2g of it\n", most);
    assert_true(most < 0.2);
    surface_free(&s);
    mesh_free(&ball);
}

/* ---- bounds ---------------------------------------------------------------------------------- */

static void test_bounds(void **state)
{
    uint64_t rng = 9;
    mesh meshes[3];
    uint32_t which, f, i, k;
    (void)state;
    meshes[0] = turned_creature(&rng);
    meshes[1] = turned_creature(&rng);
    for (i = 0; i < meshes[1].vertex_count; i++) meshes[1].positions[i].z = 0.1;    /* flat */
    meshes[2] = make_torus(5, 5);
    for (which = 0; which < 3; which++) {
        const mesh *m = &meshes[which];
        double loosest = 0;
        psurf_real *boxes = (psurf_real *)grab((size_t)m->face_count + 2, 6 * sizeof *boxes);
        surface s;
        surface_build(&s, m);
        psurf_bounds(&s.patches, 0, m->face_count, boxes);
        for (f = 0; f < m->face_count; f++) {
            const psurf_real *box = boxes + 6 * f;
            vec low = make_vec(1e9, 1e9, 1e9), high = make_vec(-1e9, -1e9, -1e9);
            double ratio;
            for (i = 0; i < 400; i++) {
                uint32_t size = m->faces[f].size;
                psurf_sample sample = i < 40 ? edge_sample(f, size, i % size, (i / size) / 8.0)
                                             : random_sample_of(m, f, &rng);
                vec p = eval_at(&s.patches, sample).p;
                assert_true(p.x >= (double)box[0] && p.x <= (double)box[3]);
                assert_true(p.y >= (double)box[1] && p.y <= (double)box[4]);
                assert_true(p.z >= (double)box[2] && p.z <= (double)box[5]);
                low = make_vec(fmin(low.x, p.x), fmin(low.y, p.y), fmin(low.z, p.z));
                high = make_vec(fmax(high.x, p.x), fmax(high.y, p.y), fmax(high.z, p.z));
            }
            ratio = distance(load(box), load(box + 3)) / distance(low, high);
            loosest = fmax(loosest, ratio);
        }
        print_message("bounds: boxes up to %.5g times those of the samples\n", loosest);
        assert_true(loosest < 2);
        /* ranges begin at the array's start; what lies beyond the last face is not written */
        for (k = 0; k < 12; k++) boxes[k] = -77;
        psurf_bounds(&s.patches, m->face_count - 1, 5, boxes);
        for (k = 6; k < 12; k++) assert_true(boxes[k] == -77);
        assert_memory_equal(boxes, boxes + 6 * (m->face_count - 1), 6 * sizeof *boxes);
        psurf_bounds(&s.patches, m->face_count, 1, boxes + 6);
        psurf_bounds(&s.patches, PSURF_NONE, PSURF_NONE, boxes + 6);
        for (k = 6; k < 12; k++) assert_true(boxes[k] == -77);
        surface_free(&s);
        free(boxes);
        mesh_free(&meshes[which]);
    }
}

/* ---- interpolation --------------------------------------------------------------------------- */

static void test_interpolate(void **state)
{
    enum { WIDTH = 3 };
    uint64_t rng = 10;
    mesh m = turned_creature(&rng);
    surface s;
    float *values, got[WIDTH];
    uint32_t i, k, corners, c;
    (void)state;
    mesh_take(&m, make_marked(), 8);                    /* n-gons, and faces that are split */
    surface_build(&s, &m);
    corners = s.first[m.face_count];
    values = (float *)grab((size_t)corners * WIDTH, sizeof *values);
    for (i = 0; i < corners * WIDTH; i++) values[i] = (float)random_unit(&rng);
    for (i = 0; i < 5000; i++) {
        psurf_sample sample = random_sample(&m, &rng);
        uint32_t size = m.faces[sample.face].size, n = sample.sector;
        double u = (double)sample.u, v = (double)sample.v;
        const float *corner = values + (size_t)s.first[sample.face] * WIDTH;
        psurf_interpolate(s.topology, &sample, 1, values, WIDTH, got, 0);
        for (k = 0; k < WIDTH; k++) {
            double want, x[MESH_MAX_CORNERS], centre = 0;
            for (c = 0; c < size; c++) centre += (x[c] = (double)corner[c * WIDTH + k]) / size;
            if (size == 3) want = x[0] + u * (x[1] - x[0]) + v * (x[2] - x[0]);
            else if (size == 4)
                want = x[0] + u * (x[1] - x[0]) + v * (x[3] - x[0])
                     + u * v * (x[0] - x[1] + x[2] - x[3]);
            else want = centre + u * (x[n] - centre) + v * (x[(n + 1) % size] - centre);
            assert_true(fabs((double)got[k] - want) < 1e-6);
        }
    }
    for (i = 0; i < m.face_count; i++)          /* exact at corners, for every width at once */
        for (c = 0; c < m.faces[i].size; c++) {
            psurf_sample sample = edge_sample(i, m.faces[i].size, c, 0);
            psurf_interpolate(s.topology, &sample, 1, values, WIDTH, got, 0);
            assert_memory_equal(got, values + (size_t)(s.first[i] + c) * WIDTH, sizeof got);
        }
    {                                           /* many at once, with room between */
        enum { MANY = 50, STRIDE = WIDTH + 2 };
        psurf_sample samples[MANY];
        float spread[MANY * STRIDE];
        for (i = 0; i < MANY * STRIDE; i++) spread[i] = -77;
        for (i = 0; i < MANY; i++) samples[i] = random_sample(&m, &rng);
        psurf_interpolate(s.topology, samples, MANY, values, WIDTH, spread,
                          STRIDE * sizeof(float));
        for (i = 0; i < MANY; i++) {
            psurf_interpolate(s.topology, &samples[i], 1, values, WIDTH, got, 0);
            assert_memory_equal(got, spread + i * STRIDE, sizeof got);
            assert_true(spread[i * STRIDE + WIDTH] == -77 && spread[i * STRIDE + WIDTH + 1] == -77);
        }
    }
    free(values);
    surface_free(&s);
    mesh_free(&m);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_derivatives), cmocka_unit_test(test_special_places),
        cmocka_unit_test(test_poles),       cmocka_unit_test(test_differences),
        cmocka_unit_test(test_outside),     cmocka_unit_test(test_empty_mesh),
        cmocka_unit_test(test_degenerate),
        cmocka_unit_test(test_outputs),     cmocka_unit_test(test_batches),
        cmocka_unit_test(test_curvature),
        cmocka_unit_test(test_known_curvature), cmocka_unit_test(test_bounds),
        cmocka_unit_test(test_interpolate)};
    return cmocka_run_group_tests_name("eval", tests, NULL, NULL);
}
