/* Points of the point-normal schemes against an evaluator of the test's own: numbers that carry
   their first and second derivatives go through the formulas as blend-formulas.md prints them, on
   the stored points, so that no derivative is written down here. Then curvature, shading, planes,
   and input on which the formulas are singular. */
#include "schemes.h"

/* ---- numbers with derivatives ---------------------------------------------------------------- */

/* Terms of 1e6 near corners cancel: more digits than a double has. */
typedef long double wide;

typedef struct jet { wide f, x, y, xx, xy, yy; } jet;

static jet number(wide f)
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

/* g(a), of which g0, g1, g2 are value and derivatives at a.f. */
static jet chain(jet a, wide g0, wide g1, wide g2)
{
    jet r;
    r.f = g0;
    r.x = g1 * a.x;
    r.y = g1 * a.y;
    r.xx = g1 * a.xx + g2 * a.x * a.x;
    r.xy = g1 * a.xy + g2 * a.x * a.y;
    r.yy = g1 * a.yy + g2 * a.y * a.y;
    return r;
}

static jet inverse(jet a) { return chain(a, 1 / a.f, -1 / (a.f * a.f), 2 / (a.f * a.f * a.f)); }
static jet root(jet a)
{
    const wide r = sqrtl(a.f);
    return chain(a, r, 0.5 / r, -0.25 / (r * a.f));
}
static jet scaled(wide s, jet a) { return chain(a, s * a.f, s, 0); }
static jet minus(jet a, jet b) { return plus(a, scaled(-1, b)); }
static jet over(jet a, jet b) { return times(a, inverse(b)); }
static jet square(jet a) { return times(a, a); }
static jet cube(jet a) { return times(a, times(a, a)); }
static jet one_less(jet a) { return minus(number(1), a); }

typedef struct jet3 { jet c[3]; } jet3;

static jet3 fixed(vec p)
{
    jet3 r;
    r.c[0] = number(p.x), r.c[1] = number(p.y), r.c[2] = number(p.z);
    return r;
}

/* a + w b */
static jet3 sum(jet3 a, jet w, jet3 b)
{
    int k;
    for (k = 0; k < 3; k++) a.c[k] = plus(a.c[k], times(w, b.c[k]));
    return a;
}

static jet3 along(jet w, jet3 a) { return sum(fixed(make_vec(0, 0, 0)), w, a); }
static jet3 mixed(jet3 a, jet3 b, jet w) { return sum(along(one_less(w), a), w, b); }
static jet3 less(jet3 a, jet3 b) { return sum(a, number(-1), b); }

static jet inner(jet3 a, jet3 b)
{
    return plus(times(a.c[0], b.c[0]), plus(times(a.c[1], b.c[1]), times(a.c[2], b.c[2])));
}

static jet3 unit_jet(jet3 a) { return along(inverse(root(inner(a, a))), a); }

static vec value_of(const jet3 *a)
{
    return make_vec((double)a->c[0].f, (double)a->c[1].f, (double)a->c[2].f);
}

/* ---- the formulas ---------------------------------------------------------------------------- */

/* Of a Bezier triangle, in the order they are stored. */
enum { B300, B210, B120, B030, B201, B111, B021, B102, B012, B003 };

/* key(k, l): the edge point next to corner k on the edge towards l. */
static const int key[3][3] = {{-1, B210, B201}, {B120, -1, B021}, {B102, B012, -1}};
static const int corner_point[3] = {B300, B030, B003};

static jet3 bezier_triangle(const jet3 b[10], const jet t[3])
{
    static const int power[10][3] = {{3, 0, 0}, {2, 1, 0}, {1, 2, 0}, {0, 3, 0}, {2, 0, 1},
                                     {1, 1, 1}, {0, 2, 1}, {1, 0, 2}, {0, 1, 2}, {0, 0, 3}};
    static const double factorial[4] = {1, 1, 2, 6};
    jet3 r = fixed(make_vec(0, 0, 0));
    int i, k, n;
    for (i = 0; i < 10; i++) {
        jet w = number(6);
        for (k = 0; k < 3; k++) {
            w = scaled(1 / factorial[power[i][k]], w);
            for (n = 0; n < power[i][k]; n++) w = times(w, t[k]);
        }
        r = sum(r, w, b[i]);
    }
    return r;
}

static jet3 bezier_curve(const jet3 b[4], jet t)
{
    const jet s = one_less(t);
    jet3 r = along(cube(s), b[0]);
    r = sum(r, scaled(3, times(square(s), t)), b[1]);
    r = sum(r, scaled(3, times(s, square(t))), b[2]);
    return sum(r, cube(t), b[3]);
}

/* Section 2: n = u^2 n200 + v^2 n020 + w^2 n002 + 2uv n110 + 2vw n011 + 2uw n101, then unit. */
static jet3 quadratic_normal(const jet3 n[6], const jet t[3])
{
    jet3 r = along(square(t[0]), n[0]);
    r = sum(r, scaled(2, times(t[0], t[1])), n[1]);
    r = sum(r, square(t[1]), n[2]);
    r = sum(r, scaled(2, times(t[0], t[2])), n[3]);
    r = sum(r, scaled(2, times(t[1], t[2])), n[4]);
    r = sum(r, square(t[2]), n[5]);
    return unit_jet(r);
}

/* Rule PN of section 1 on points and normals that vary. */
static jet3 curve(jet3 p, jet3 q, jet3 np, jet3 nq, jet t)
{
    const jet3 d = less(q, p);
    jet3 b[4];
    b[0] = p, b[3] = q;
    b[1] = along(number(1.0 / 3), sum(sum(sum(p, number(1), p), number(1), q),
                                      scaled(-1, inner(d, np)), np));
    b[2] = along(number(1.0 / 3), sum(sum(sum(q, number(1), q), number(1), p), inner(d, nq), nq));
    return bezier_curve(b, t);
}

static jet pair_sum(const jet t[3])
{
    return plus(times(t[0], t[1]), plus(times(t[1], t[2]), times(t[2], t[0])));
}

/* Section 8. points: ten, six normals, flatness, turns, switches. */
static jet3 smoothed(const jet3 *points, const jet t[3], jet3 *shade)
{
    const vec flat = value_of(points + 16), turn = value_of(points + 17);
    const vec switches = value_of(points + 18);
    const double flatness[3] = {flat.x, flat.y, flat.z}, turned[3] = {turn.x, turn.y, turn.z};
    static const int corner_normal[3] = {10, 12, 15};
    const jet uvw = times(t[0], times(t[1], t[2])), bl = scaled(27, uvw), s2 = pair_sum(t);
    const jet3 inside = bezier_triangle(points, t);
    jet3 r = fixed(make_vec(0, 0, 0));
    int e;
    for (e = 0; e < 3; e++) {
        const int a = e, b = (e + 1) % 3, c = (e + 2) % 3;
        const jet tau = over(t[b], plus(t[a], t[b])), g = over(times(t[a], t[b]), s2);
        const jet3 na = points[corner_normal[a]], nb = points[corner_normal[b]];
        jet3 edge[4], m = sum(na, tau, less(nb, na)), pe;
        edge[0] = points[corner_point[a]], edge[1] = points[key[a][b]];
        edge[2] = points[key[b][a]], edge[3] = points[corner_point[b]];
        if (turned[e] != 0) {                   /* l - c' (l.c')/(c'.c') */
            const jet s = one_less(tau);
            jet3 d = along(scaled(3, square(s)), less(edge[1], edge[0]));
            d = sum(d, scaled(6, times(s, tau)), less(edge[2], edge[1]));
            d = sum(d, scaled(3, square(tau)), less(edge[3], edge[2]));
            m = sum(m, scaled(-1, over(inner(m, d), inner(d, d))), d);
        }
        pe = curve(bezier_curve(edge, tau), points[corner_point[c]], unit_jet(m),
                   points[corner_normal[c]], t[c]);
        if (switches.x != 0) {                  /* min(1, fn + bl), as listed; from inside */
            jet bf = plus(number(flatness[e]), bl);
            if (bf.f >= 1) bf = number(1);
            pe = sum(pe, bf, less(inside, pe));
        }
        r = sum(r, g, pe);
    }
    if (switches.y != 0) r = sum(r, bl, less(inside, r));
    *shade = quadratic_normal(points + 10, t);
    return r;
}

/* Section 4. points: corners, per edge b210 b120 b201 b021 b111. */
static jet3 hybrid(const jet3 *points, const jet t[3])
{
    const jet3 *set[3];
    jet3 b[10];
    int k;
    for (k = 0; k < 3; k++) {
        set[k] = points + 3 + 5 * k;
        b[corner_point[k]] = points[k];
    }
    for (k = 0; k < 3; k++) {
        const int nx = (k + 1) % 3, pv = (k + 2) % 3;
        const jet wa = times(one_less(t[pv]), square(t[nx]));
        const jet wb = times(one_less(t[nx]), square(t[pv]));
        const jet lam = over(wa, plus(wa, wb));
        b[key[k][nx]] = mixed(set[pv][3], set[k][0], lam);
        b[key[k][pv]] = mixed(set[pv][1], set[k][2], lam);
    }
    b[B111] = along(times(t[0], t[1]), set[0][4]);
    b[B111] = sum(b[B111], times(t[1], t[2]), set[1][4]);
    b[B111] = sum(b[B111], times(t[2], t[0]), set[2][4]);
    b[B111] = along(inverse(pair_sum(t)), b[B111]);
    return bezier_triangle(b, t);
}

/* Section 7, B1 and B2: b111 of six points, two per edge. */
static jet3 blend_b1(const jet3 *six, const jet t[3])
{
    jet3 r = fixed(make_vec(0, 0, 0));
    int k;
    for (k = 0; k < 3; k++) {
        const jet x = t[k], y = t[(k + 1) % 3], z = t[(k + 2) % 3];
        const jet3 start = six[2 * k], end = six[2 * ((k + 2) % 3) + 1];
        r = sum(r, times(x, over(y, plus(y, z))), start);
        r = sum(r, times(x, over(z, plus(y, z))), end);
    }
    return r;
}

static jet3 blend_b2(const jet3 *six, const jet t[3])
{
    jet3 r = fixed(make_vec(0, 0, 0));
    int e;
    for (e = 0; e < 3; e++) {
        const jet a = t[e], b = t[(e + 1) % 3], ab = times(a, b);
        const jet d = minus(plus(a, b), scaled(2, ab));
        const jet l = over(times(a, one_less(b)), d);
        const jet3 m = mixed(six[2 * e + 1], six[2 * e], l);
        /* d = 0 at the corner opposite alone, where ab = 0 too */
        r = sum(r, over(ab, pair_sum(t)), m);
    }
    return r;
}

/* Nine boundary points as they are stored: ten without b111. */
static void boundary(const jet3 *points, jet3 b[10])
{
    int i;
    for (i = 0; i < 10; i++)
        if (i != B111) b[i] = points[i < B111 ? i : i - 1];
}

/* Section 5. points: boundary; alternatives of the six keys; two inner points per edge. */
static jet3 png1(const jet3 *points, const jet t[3])
{
    static const int order[6][2] = {{0, 1}, {1, 0}, {0, 2}, {1, 2}, {2, 0}, {2, 1}};
    jet3 b[10];
    int i;
    boundary(points, b);
    for (i = 0; i < 6; i++) {
        const int k = order[i][0], l = order[i][1], o = 3 - k - l;
        const jet x = square(t[o]), y = square(one_less(t[o]));
        b[key[k][l]] = mixed(b[key[k][l]], points[9 + i], over(x, plus(x, y)));
    }
    b[B111] = blend_b2(points + 15, t);
    return bezier_triangle(b, t);
}

static jet3 ribbon(const jet3 *points, const jet t[3], int b2)
{
    jet3 b[10];
    boundary(points, b);
    b[B111] = b2 ? blend_b2(points + 9, t) : blend_b1(points + 9, t);
    return bezier_triangle(b, t);
}

/* Sections 3: bicubic position, biquadratic normal. */
static jet3 quad(const jet3 *points, jet u, jet v, jet3 *shade)
{
    jet3 rows[4], n = fixed(make_vec(0, 0, 0));
    jet bu[3], bv[3];
    int i, j;
    for (j = 0; j < 4; j++) rows[j] = bezier_curve(points + 4 * j, u);
    bu[0] = square(one_less(u)), bu[1] = scaled(2, times(u, one_less(u))), bu[2] = square(u);
    bv[0] = square(one_less(v)), bv[1] = scaled(2, times(v, one_less(v))), bv[2] = square(v);
    for (j = 0; j < 3; j++)
        for (i = 0; i < 3; i++) n = sum(n, times(bu[i], bv[j]), points[16 + 3 * j + i]);
    *shade = unit_jet(n);
    return bezier_curve(rows, v);
}

/* ---- the reference evaluator ----------------------------------------------------------------- */

enum { MAX_POINTS = 31 };

/* The piece that holds a sample, and the sample's parameters there. */
static uint32_t locate(psurf_split split, const mesh_face_data *f, psurf_sample at, jet *u, jet *v)
{
    static const double square[4][2] = {{0, 0}, {1, 0}, {1, 1}, {0, 1}};
    const jet x = *u, y = *v;
    uint32_t piece, c[4];
    if (f->size >= 5) return at.sector;
    if (f->size == 3 || split == PSURF_SPLIT_PN) return 0;
    for (piece = 0; piece < 2; piece++) {
        const double *a, *b, *d;
        double ex, ey, gx, gy, det;
        jet px, py;
        piece_corners(split, f, piece, c);
        a = square[c[0]], b = square[c[1]], d = square[c[2]];
        ex = b[0] - a[0], ey = b[1] - a[1], gx = d[0] - a[0], gy = d[1] - a[1];
        det = ex * gy - ey * gx;
        px = minus(x, number(a[0])), py = minus(y, number(a[1]));
        *u = scaled(1 / det, minus(scaled(gy, px), scaled(gx, py)));
        *v = scaled(1 / det, minus(scaled(ex, py), scaled(ey, px)));
        if (u->f >= 0 && v->f >= 0 && u->f + v->f <= 1) return piece;
    }
    REQUIRE(0, "%g %g in no piece\n", (double)x.f, (double)y.f);
    return 0;
}

typedef struct reference_point {
    jet3 p, shade;
    int has_shade;                      /* of its own */
    double size;                        /* of the patch */
    double from_corner;                 /* 1 - the largest weight */
    psurf_kind kind;
} reference_point;

static reference_point reference(const surface *s, const mesh *m, psurf_sample at)
{
    jet u = number((double)at.u), v = number((double)at.v), t[3];
    jet3 points[MAX_POINTS];
    reference_point r;
    psurf_patch patch;
    uint32_t i;
    memset(&r, 0, sizeof r);
    u.x = 1, v.y = 1;
    patch = find_patch(s, at.face, locate(s->desc.split, &m->faces[at.face], at, &u, &v));
    assert_true(patch.point_count > 0 && patch.point_count <= MAX_POINTS);
    for (i = 0; i < patch.point_count; i++) points[i] = fixed(load(patch.points + 3 * i));
    for (i = 1; i < 9; i++)
        r.size = fmax(r.size, distance(value_of(&points[0]), value_of(&points[i])));
    t[0] = minus(one_less(u), v), t[1] = u, t[2] = v;
    r.kind = patch.kind;
    r.from_corner = 1 - fmax((double)t[0].f, fmax((double)t[1].f, (double)t[2].f));
    r.has_shade = 1;
    switch (patch.kind) {
    case PSURF_PN_TRI:
        r.p = bezier_triangle(points, t);
        r.shade = quadratic_normal(points + 10, t);
        break;
    case PSURF_PN_QUAD:
        r.from_corner = fmax(fmin((double)u.f, (double)(1 - u.f)),
                             fmin((double)v.f, (double)(1 - v.f)));
        r.p = quad(points, u, v, &r.shade);
        break;
    case PSURF_NPATCH:
        r.p = smoothed(points, t, &r.shade);
        r.has_shade = value_of(&points[18]).z == 0;
        break;
    case PSURF_HYBRID_TRI: r.p = hybrid(points, t), r.has_shade = 0; break;
    case PSURF_PNG1_TRI: r.p = png1(points, t), r.has_shade = 0; break;
    case PSURF_RIBBON: r.p = ribbon(points, t, 0), r.has_shade = 0; break;
    case PSURF_RIBBON_B2: r.p = ribbon(points, t, 1), r.has_shade = 0; break;
    case PSURF_BICUBIC: case PSURF_POLAR: case PSURF_P3: case PSURF_P4: case PSURF_P5:
    case PSURF_KIND_COUNT: default: REQUIRE(0, "kind %d\n", (int)patch.kind);
    }
    return r;
}

static vec part(const jet3 *a, int which)
{
    wide c[3];
    int k;
    for (k = 0; k < 3; k++) {
        const jet j = a->c[k];
        c[k] = which == 0 ? j.f : which == 1 ? j.x : which == 2 ? j.y : which == 3 ? j.xx
             : which == 4 ? j.xy : j.yy;
    }
    return make_vec((double)c[0], (double)c[1], (double)c[2]);
}

/* ---- derivatives ----------------------------------------------------------------------------- */

typedef struct errors { double p, n, shade, first, second, gauss, mean; uint32_t count; } errors;

static double relative(vec ours, const jet3 *theirs, int which, double size)
{
    const vec t = part(theirs, which);
    return distance(ours, t) / (size + length(t));
}

static void compare_sample(errors *w, const surface *s, const mesh *m, psurf_sample at)
{
    const reference_point r = reference(s, m, at);
    const point ours = eval_at(&s->patches, at);
    const vec shade = shade_at(&s->patches, at);
    const vec du = part(&r.p, 1), dv = part(&r.p, 2), n = cross(du, dv);
    const double sine = length(n) / (length(du) * length(dv));
    w->p = fmax(w->p, distance(ours.p, part(&r.p, 0)) / (r.size + length(ours.p)));
    w->first = fmax(w->first, relative(ours.du, &r.p, 1, r.size));
    w->first = fmax(w->first, relative(ours.dv, &r.p, 2, r.size));
    w->second = fmax(w->second, relative(ours.duu, &r.p, 3, r.size));
    w->second = fmax(w->second, relative(ours.duv, &r.p, 4, r.size));
    w->second = fmax(w->second, relative(ours.dvv, &r.p, 5, r.size));
    /* rounding turns the normal by its part of the sine between the tangents */
    if (sine > 1e-3 && length(du) > 1e-3 * r.size && length(dv) > 1e-3 * r.size) {
        psurf_real gauss, mean;
        const vec unit_n = unit(n);
        const double e = dot(du, du), f = dot(du, dv), g = dot(dv, dv), det = e * g - f * f;
        const double l = dot(part(&r.p, 3), unit_n), mm = dot(part(&r.p, 4), unit_n);
        const double nn = dot(part(&r.p, 5), unit_n);
        /* of what the curvatures are the difference */
        const double big = (length(part(&r.p, 3)) * g + 2 * length(part(&r.p, 4)) * sqrt(e * g)
                            + length(part(&r.p, 5)) * e) / det;
        w->n = fmax(w->n, sine * angle_between(ours.n, unit_n));
        w->shade = fmax(w->shade, r.has_shade ? angle_between(shade, part(&r.shade, 0))
                                              : sine * angle_between(shade, unit_n));
        psurf_curvature(&s->patches, &at, 1, &gauss, &mean);
        w->gauss = fmax(w->gauss, fabs((double)gauss - (l * nn - mm * mm) / det) * sine * sine
                                      / (big * big + 1));
        w->mean = fmax(w->mean, fabs((double)mean - (e * nn - 2 * f * mm + g * l) / (2 * det))
                                    * sine * sine / (big + 1));
    }
    w->count++;
}

/* Faces of 3 to 7 corners, open and closed, normals with noise, hard ends here and there. */
static scene make_varied_scene(void)
{
    uint64_t rng = 3;
    mesh m = make_creature();
    scene c;
    mesh_take(&m, make_cylinder(7, 1), 8);
    mesh_take(&m, make_holed_grid(), 16);
    mesh_take(&m, make_triangle_ball(6), 24);
    mesh_jitter(&m, &rng, 0.0625);
    c = make_scene(m);
    scene_vertex_normals(&c, &rng, 0.15);
    scene_split_normals(&c, &rng, 6);
    return c;
}

/* Anywhere on a face, on its edges and near corners too, but not nearer than a distance. */
static psurf_sample varied_sample(const surface *s, const mesh *m, uint64_t *rng, double away)
{
    const psurf_split split = s->desc.split;
    for (;;) {
        const uint32_t face = random_below(rng, m->face_count), size = m->faces[face].size;
        const uint32_t piece = random_below(rng, pieces_of(split, size));
        const uint32_t what = random_below(rng, 8), corner = random_below(rng, 3);
        double u = random_unit(rng), v = random_unit(rng);
        psurf_sample at;
        uint32_t c[4];
        if (what == 0) {
            at = side_sample(split, m, face, random_below(rng, size), u);
        } else {
            if (what == 1) {
                const double d = away * (1 + 9 * u), e = d * v;
                u = corner == 1 ? 1 - d : e;
                v = corner == 2 ? 1 - d : corner == 1 ? e : d - e;
            }
            if (piece_corners(split, &m->faces[face], piece, c) == 3 && u + v > 1)
                u = 1 - u, v = 1 - v;
            at = piece_sample(split, m, face, piece, u, v);
        }
        /* on the line between the pieces of a split quad derivatives have two values */
        if (size == 4 && pieces_of(split, 4) == 2) {
            const double x = (double)at.u, y = (double)at.v;
            if (fabs(apex_of(&m->faces[face]) % 2 ? x + y - 1 : x - y) < away) continue;
        }
        if (reference(s, m, at).from_corner >= away) return at;
    }
}

static void test_derivatives(void **state)
{
    scene c = make_varied_scene();
    const double away = IS_DOUBLE ? 1e-3 : 0.03;
    const uint32_t samples = is_thorough() ? 3000 : 1000;
    uint32_t i, k;
    (void)state;
    for (i = 0; i < STYLES; i++) {
        uint64_t rng = 41 + i;
        surface s;
        errors w;
        memset(&w, 0, sizeof w);
        scene_build(&s, &c, &styles[i], PSURF_NORMALS_AVERAGE);
        for (k = 0; k < samples; k++)
            compare_sample(&w, &s, &c.m, varied_sample(&s, &c.m, &rng, away));
        print_message("%s: p %.2g, n %.2g, shade %.2g, first %.2g, second %.2g, K %.2g, H %.2g\n",
                      styles[i].name, w.p, w.n, w.shade, w.first, w.second, w.gauss, w.mean);
        assert_true(w.p < (IS_DOUBLE ? 1e-14 : 2e-6));
        assert_true(w.first < (IS_DOUBLE ? 1e-9 : 1e-4));
        assert_true(w.second < (IS_DOUBLE ? 1e-9 : 1e-2));
        assert_true(w.n < (IS_DOUBLE ? 1e-9 : 1e-4) && w.shade < (IS_DOUBLE ? 1e-9 : 1e-4));
        assert_true(w.gauss < (IS_DOUBLE ? 1e-9 : 1e-2) && w.mean < (IS_DOUBLE ? 1e-9 : 1e-2));
        surface_free(&s);
    }
    scene_free(&c);
}

/* The comparison is sharp: a millionth of the parameter aside is another point, and so is the same
   place with the other blends. */
static void test_comparison_is_sharp(void **state)
{
    uint32_t i, k;
    scene c;
    (void)state;
    if (!IS_DOUBLE) skip();
    c = make_varied_scene();
    for (i = 0; i < STYLES; i++) {
        uint64_t rng = 43;
        surface s;
        uint32_t sharp = 0;
        scene_build(&s, &c, &styles[i], PSURF_NORMALS_AVERAGE);
        for (k = 0; k < 200; k++) {
            const psurf_sample at = varied_sample(&s, &c.m, &rng, 0.01);
            psurf_sample aside = at;
            reference_point r;
            point ours;
            aside.u += (psurf_real)(at.u < 0.5 ? 1e-6 : -1e-6);
            r = reference(&s, &c.m, at);
            ours = eval_at(&s.patches, aside);
            sharp += fmax(relative(ours.du, &r.p, 1, r.size), relative(ours.dv, &r.p, 2, r.size))
                     > 1e-8;
        }
        assert_true(sharp > 180);                       /* the others are all but flat */
        if (styles[i].scheme == PSURF_CUBIC_WM_B1) {    /* B1 taken for B2 */
            psurf_patch patch = find_patch(&s, 0, 0);
            jet3 points[MAX_POINTS], b1, b2;
            jet t[3];
            for (k = 0; k < patch.point_count; k++) points[k] = fixed(load(patch.points + 3 * k));
            t[0] = number(0.5), t[1] = number(0.3), t[2] = number(0.2);
            b1 = ribbon(points, t, 0), b2 = ribbon(points, t, 1);
            assert_true(distance(value_of(&b1), value_of(&b2)) > 1e-9);
        }
        surface_free(&s);
    }
    scene_free(&c);
}

/* ---- shading normals ------------------------------------------------------------------------- */

/* As [N] lists it: normalize(u n0 + v n1 + w n2); quadratic: that of PN triangles; exact: n. */
static void test_shading(void **state)
{
    const double slack = IS_DOUBLE ? 1e-13 : 1e-5;
    uint64_t rng = 45;
    scene c = make_noisy_octahedron(&rng);
    psurf_shading shading;
    surface pn, s;
    uint32_t k;
    (void)state;
    scene_build(&pn, &c, &styles[PN], PSURF_NORMALS_AVERAGE);
    for (shading = PSURF_SHADE_LINEAR; shading < PSURF_SHADE_COUNT;
         shading = (psurf_shading)(shading + 1)) {
        style y = styles[N_G1];
        y.shading = shading;
        scene_build(&s, &c, &y, PSURF_NORMALS_AVERAGE);
        for (k = 0; k < 1000; k++) {
            const psurf_sample at = random_sample(&c.m, &rng);
            const uint32_t *v = c.m.faces[at.face].v;
            const double u = (double)at.u, w = (double)at.v;
            vec expected = mad(mad(mul(1 - u - w, c.normals[v[0]]), u, c.normals[v[1]]), w,
                               c.normals[v[2]]);
            if (shading == PSURF_SHADE_QUADRATIC) expected = shade_at(&pn.patches, at);
            if (shading == PSURF_SHADE_EXACT) expected = eval_at(&s.patches, at).n;
            REQUIRE(angle_between(shade_at(&s.patches, at), expected) < slack,
                    "shading %d: %g rad\n", (int)shading,
                    angle_between(shade_at(&s.patches, at), expected));
        }
        surface_free(&s);
    }
    surface_free(&pn);
    scene_free(&c);
}

/* ---- strides --------------------------------------------------------------------------------- */

/* Normals that are not unit and lie apart, outputs that lie apart: the same bits. */
static void test_strides(void **state)
{
    enum { APART = 5, WIDTH = 7, SAMPLES = 64 };
    scene c = make_varied_scene();
    uint64_t rng = 53;
    uint32_t i, k, v, j;
    (void)state;
    for (i = 0; i < STYLES; i++) {
        psurf_real *normals = (psurf_real *)grab((size_t)c.normal_count * APART, sizeof *normals);
        psurf_real tight[SAMPLES][3], wide_apart[SAMPLES][WIDTH];
        psurf_sample at[SAMPLES];
        psurf_points out;
        surface s, t;
        scene_build(&s, &c, &styles[i], PSURF_NORMALS_AVERAGE);
        scene_build(&t, &c, &styles[i], PSURF_NORMALS_AVERAGE);
        for (v = 0; v < c.normal_count; v++)
            for (j = 0; j < 3; j++)             /* times 4: the unit normal has the same bits */
                normals[v * APART + j] = 4 * s.normals[3 * v + j];
        t.construct.normals = normals;
        t.construct.normal_stride = APART * sizeof *normals;
        memset(t.memory, 0, t.patches.layout.patch_bytes);
        assert_int_equal(psurf_construct(&t.patches, &t.construct), PSURF_OK);
        assert_memory_equal(s.memory, t.memory, s.patches.layout.patch_bytes);
        for (k = 0; k < SAMPLES; k++) at[k] = varied_sample(&s, &c.m, &rng, 0.01);
        memset(&out, 0, sizeof out);
        memset(wide_apart, 0, sizeof wide_apart);
        out.shade = tight[0];
        psurf_eval(&s.patches, at, SAMPLES, &out);
        out.shade = wide_apart[0] + 2;
        out.stride = sizeof wide_apart[0];
        psurf_eval(&s.patches, at, SAMPLES, &out);
        for (k = 0; k < SAMPLES; k++) {
            assert_true(same_bits(tight[k], wide_apart[k] + 2));
            assert_true(wide_apart[k][1] == 0 && wide_apart[k][5] == 0);
        }
        free(normals);
        surface_free(&s);
        surface_free(&t);
    }
    scene_free(&c);
}

/* ---- planes ---------------------------------------------------------------------------------- */

/* Calls back at a grid of places of every piece, corners and edges included. */
typedef void visitor(const surface *s, const scene *c, psurf_sample at, const char *what);
static void visit(const surface *s, const scene *c, uint32_t steps, visitor *visited,
                  const char *what)
{
    const psurf_split split = s->desc.split;
    uint32_t f, piece, i, j, corners[4];
    for (f = 0; f < c->m.face_count; f++)
        for (piece = 0; piece < pieces_of(split, c->m.faces[f].size); piece++)
            for (j = 0; j <= steps; j++)
                for (i = 0; i <= steps; i++)
                    if (piece_corners(split, &c->m.faces[f], piece, corners) == 4 ||
                        i + j <= steps)
                        visited(s, c, piece_sample(split, &c->m, f, piece, (double)i / steps,
                                                   (double)j / steps), what);
}

/* On the plane of the face's corners, with its normal. */
static void expect_on_plane(const surface *s, const scene *c, psurf_sample at, const char *what)
{
    const mesh *m = &c->m;
    const double slack = IS_DOUBLE ? 4e-15 : 2e-6;
    const vec n = face_normal(m, at.face), origin = m->positions[m->faces[at.face].v[0]];
    const point p = eval_at(&s->patches, at);
    REQUIRE(fabs(dot(sub(p.p, origin), n)) <= slack, "%s: %g off its plane\n", what,
            dot(sub(p.p, origin), n));
    REQUIRE(plane_angle(p.n, n) <= 4 * slack && plane_angle(shade_at(&s->patches, at), n)
                <= 4 * slack, "%s: normals %g and %g rad off\n", what, plane_angle(p.n, n),
            plane_angle(shade_at(&s->patches, at), n));
    REQUIRE(dot(p.n, n) > 0, "%s: normal reversed\n", what);
}

/* Flat faces with their own normals stay what they are: cube, prisms, dodecahedron, in every
   scheme; edges straight, so the solids too. */
static void test_flat_faces(void **state)
{
    uint32_t i, k, e;
    (void)state;
    for (i = 0; i < STYLES; i++)
        for (k = 0; k < 4; k++) {
            scene c = make_scene(k == 0 ? make_cube() : k == 1 ? make_cylinder(7, 1)
                                 : k == 2 ? make_tetrahedron() : make_cylinder(5, 2));
            surface s;
            edge_map map = map_edges(&c.m);
            scene_flat_normals(&c);
            scene_build(&s, &c, &styles[i], PSURF_NORMALS_AVERAGE);
            assert_int_equal(s.info.hard_edges, s.info.edges);
            visit(&s, &c, 6, expect_on_plane, styles[i].name);
            for (e = 0; e < map.count; e++) {
                const half_edge *a = &map.edges[e];
                const vec p = c.m.positions[a->from], d = unit(sub(c.m.positions[a->to], p));
                uint32_t at;
                for (at = 0; at <= 8; at++) {
                    vec q = eval_at(&s.patches, side_sample(s.desc.split, &c.m, a->face,
                                                            a->corner, at / 8.0)).p;
                    assert_true(length(cross(sub(q, p), d)) <= (IS_DOUBLE ? 4e-15 : 2e-6));
                }
            }
            free(map.edges);
            surface_free(&s);
            scene_free(&c);
        }
}

/* A sheet in a plane, with the plane's normals, given or computed. */
static void test_flat_sheet(void **state)
{
    const vec x = unit(make_vec(2, 1, 0.5)), z = unit(cross(x, make_vec(0.2, 0.3, 1)));
    const vec y = cross(z, x);
    uint32_t i, k, mode;
    (void)state;
    for (i = 0; i < STYLES; i++)
        for (mode = i % 2; mode <= PSURF_NORMALS_COUNT; mode += is_thorough() ? 1 : 2) {
            uint64_t rng = 47;
            mesh m = make_grid(4, 4), n;
            scene c;
            surface s;
            mesh_split_quads(&m, &rng, 40);
            n = make_polygon(7);
            mesh_take(&m, n, 6);
            mesh_jitter(&m, &rng, 0.125);
            for (k = 0; k < m.vertex_count; k++) {
                const vec p = m.positions[k];
                m.positions[k] = mad(mul(p.x, x), p.y, y);
            }
            c = make_scene(m);
            if (mode == PSURF_NORMALS_COUNT) {
                c.normal_count = m.vertex_count;
                c.normals = (vec *)grab(m.vertex_count, sizeof(vec));
                for (k = 0; k < m.vertex_count; k++) c.normals[k] = z;
            }
            scene_build(&s, &c, &styles[i], (psurf_normal_mode)(mode % PSURF_NORMALS_COUNT));
            visit(&s, &c, 5, expect_on_plane, styles[i].name);
            surface_free(&s);
            scene_free(&c);
        }
}

/* ---- input on which the formulas are singular ------------------------------------------------ */

typedef struct tally {
    double second;                      /* largest second derivative */
    uint32_t samples, without_normal, without_curvature, infinite;
} tally;

/* The first samples are not at corners. */
static void expect_finite(const surface *s, const psurf_sample *samples, uint32_t count,
                          uint32_t inside, const char *what, tally *r)
{
    psurf_real reals[MAX_BATCH][24], gauss[MAX_BATCH], mean[MAX_BATCH];
    const double slack = IS_DOUBLE ? 1e-9 : 1e-4;
    psurf_points out;
    uint32_t i, k;
    out.p = reals[0], out.n = out.p + 3, out.shade = out.p + 6, out.du = out.p + 9;
    out.dv = out.p + 12, out.duu = out.p + 15, out.duv = out.p + 18, out.dvv = out.p + 21;
    out.stride = sizeof reals[0];
    psurf_eval(&s->patches, samples, count, &out);
    psurf_curvature(&s->patches, samples, count, gauss, mean);
    for (i = 0; i < count; i++) {
        const psurf_sample at = samples[i];
        const double n = length(load(reals[i] + 3)), shade = length(load(reals[i] + 6));
        for (k = 0; k < 15; k++)
            REQUIRE(isfinite(reals[i][k]), "%s: face %u sector %u at %g %g: number %u\n", what,
                    (unsigned)at.face, (unsigned)at.sector, (double)at.u, (double)at.v,
                    (unsigned)k);
        REQUIRE(length(load(reals[i])) < 100, "%s: face %u at %g %g: far away, %g\n", what,
                (unsigned)at.face, (double)at.u, (double)at.v, length(load(reals[i])));
        REQUIRE((fabs(n - 1) < slack || n == 0) && (fabs(shade - 1) < slack || shade == 0),
                "%s: face %u at %g %g: normals of length %g and %g\n", what, (unsigned)at.face,
                (double)at.u, (double)at.v, n, shade);
        for (k = 15; k < 24; k++) r->second = fmax(r->second, fabs((double)reals[i][k]));
        for (k = 15; k < 24; k++) if (isnan(reals[i][k])) r->second = INFINITY;
        r->samples++;
        r->without_normal += n == 0;
        if (isnan(gauss[i]) || isnan(mean[i])) {        /* at corners, or where normals vanish */
            const vec du = load(reals[i] + 9), dv = load(reals[i] + 12);
            const double sine = length(cross(du, dv)) / (length(du) * length(dv));
            REQUIRE(i >= inside || n == 0 || !(sine > (IS_DOUBLE ? 1e-12 : 1e-5)),
                    "%s: face %u at %g %g: no curvature\n", what, (unsigned)at.face,
                    (double)at.u, (double)at.v);
            r->without_curvature++;
        }
        r->infinite += isinf(gauss[i]) || isinf(mean[i]);
    }
}

/* A grid on every piece, and places near corners and edges, where guards act. */
static void expect_finite_everywhere(const surface *s, const scene *c, const char *what, tally *r)
{
    static const double near[] = {0, 1e-30, 1e-7, 1e-3};
    const psurf_split split = s->desc.split;
    uint32_t f, piece, i, j, k, corners[4];
    psurf_check_result check;
    for (f = 0; f < c->m.face_count; f++)
        for (piece = 0; piece < pieces_of(split, c->m.faces[f].size); piece++) {
            const uint32_t size = piece_corners(split, &c->m.faces[f], piece, corners);
            psurf_sample at[MAX_BATCH];
            uint32_t n = 0, inside;
            for (i = 0; i <= 4; i++)
                for (j = 0; j <= 4; j++)
                    if ((size == 4 || i + j <= 4) && (i % 4 || j % 4))
                        at[n++] = piece_sample(split, &c->m, f, piece, i / 4.0, j / 4.0);
            inside = n;
            for (k = 0; k < 3; k++)
                for (i = 0; i < COUNT_OF(near); i++)
                    for (j = 0; j < COUNT_OF(near); j++) {
                        const double a = near[i], b = near[j], rest = 1 - a - b;
                        at[n++] = piece_sample(split, &c->m, f, piece,
                                               k == 0 ? a : k == 1 ? rest : b,
                                               k == 0 ? b : k == 1 ? a : rest);
                    }
            expect_finite(s, at, n, inside, what, r);
        }
    assert_int_equal(psurf_check(&s->patches, &s->construct, 3, 0, PSURF_NONE, &check), PSURF_OK);
    REQUIRE(check.cracks == 0 && check.nonfinite == 0, "%s: %lu cracks, %lu not finite\n", what,
            (unsigned long)check.cracks, (unsigned long)check.nonfinite);
}

/* Two faces back to back. */
static mesh make_pillow(uint32_t n)
{
    mesh m = make_polygon(n);
    uint32_t v[MESH_MAX_CORNERS], k;
    for (k = 0; k < n; k++) v[k] = n - 1 - k;
    mesh_face(&m, n, v);
    return m;
}

enum {
    OPPOSITE, ALONG_EDGE, ZERO_LENGTH, NO_NORMALS, COLLAPSED, POINT, FLAT, IN_PLANE, TRIANGLE, QUAD,
    PENTAGON, PILLOW, FAT_PILLOW, SHEETS, HARD_ALONG, HALF_TURN, TINY, LINE, DEFECTS
};
static const char *const defect_names[DEFECTS] = {
    "opposite normals", "normals along edges", "zero length", "zero normals", "collapsed triangles",
    "one point", "flat", "normals in the plane", "triangle", "quad", "pentagon", "pillow",
    "pillow of heptagons", "opposite sides", "hard, along edges", "half a turn", "tiny", "line"};

/* computed: without normals of its own, where the defect is in the positions. */
static scene make_defect(uint32_t what, int computed)
{
    uint64_t rng = 51;
    mesh m = make_latlong(4, 1);
    scene c;
    uint32_t k;
    mesh_take(&m, make_cube(), 5);
    mesh_take(&m, make_cylinder(5, 1), 10);
    if (what == FLAT || what == IN_PLANE) {
        mesh_free(&m);
        m = make_grid(3, 3);
        mesh_split_quads(&m, &rng, 40);
        for (k = 0; k < m.vertex_count; k++) m.positions[k].z = 0;
    }
    if (what == TRIANGLE || what == QUAD || what == PENTAGON) {
        mesh_free(&m);
        m = make_polygon(3 + what - TRIANGLE);
    }
    if (what == PILLOW || what == FAT_PILLOW) {
        mesh_free(&m);
        m = make_pillow(what == PILLOW ? 3 : 7);
    }
    c = make_scene(m);
    if (!computed) {
        c.normal_count = c.m.vertex_count;
        c.normals = (vec *)grab(c.normal_count, sizeof(vec));
        for (k = 0; k < c.normal_count; k++)
            c.normals[k] = unit(add(c.m.positions[k], make_vec(0.01, -0.02, 0.03)));
        if (what >= FLAT && what <= FAT_PILLOW)
            for (k = 0; k < c.normal_count; k++)
                c.normals[k] = what == IN_PLANE ? make_vec(k % 2 ? 1 : -1, k % 3, 0)
                                                : make_vec(0, 0, 1);
    }
    for (k = 0; k < c.m.vertex_count; k++) {
        const uint32_t next = c.m.faces[k % c.m.face_count].v[0];
        const vec e = sub(c.m.positions[c.m.faces[k % c.m.face_count].v[1]], c.m.positions[next]);
        if (what == OPPOSITE && k % 2 && !computed) c.normals[k] = mul(-1, c.normals[k - 1]);
        if (what == ALONG_EDGE && !computed) c.normals[next] = e;
        if (what == NO_NORMALS && !computed && k % 3 == 0) c.normals[k] = make_vec(0, 0, 0);
        if (what == ZERO_LENGTH && k % 4 == 0)
            c.m.positions[c.m.faces[k % c.m.face_count].v[1]] = c.m.positions[next];
        if (what == COLLAPSED && k % 5 == 0) {
            const uint32_t *v = c.m.faces[k % c.m.face_count].v;
            c.m.positions[v[2]] = mul(0.5, add(c.m.positions[v[0]], c.m.positions[v[1]]));
            if (k % 2) c.m.positions[v[1]] = c.m.positions[v[2]] = c.m.positions[v[0]];
        }
        if (what == POINT) c.m.positions[k] = make_vec(1, 2, 3);
        if (what == TINY) c.m.positions[k] = mul(IS_DOUBLE ? 1e-160 : 1e-20, c.m.positions[k]);
        if (what == LINE) c.m.positions[k] = make_vec(k / 8.0, 0, 0);
    }
    if (computed || (what != SHEETS && what != HARD_ALONG && what != HALF_TURN)) return c;
    free(c.normals);
    c.normals = NULL;
    scene_flat_normals(&c);             /* per face; now turned against each other */
    for (k = 0; k < c.m.face_count; k++) {
        const uint32_t *v = c.m.faces[k].v;
        if (what == SHEETS) c.normals[k] = make_vec(0, 0, k % 2 ? 1 : -1);
        if (what == HARD_ALONG) c.normals[k] = sub(c.m.positions[v[1]], c.m.positions[v[0]]);
        if (what == HALF_TURN && k % 2) c.normals[k] = mul(-1, c.normals[k]);
    }
    return c;
}

static void test_defects(void **state)
{
    tally r;
    uint32_t what, i, given;
    (void)state;
    memset(&r, 0, sizeof r);
    for (what = 0; what < DEFECTS; what++)
        for (given = 0; given < 2; given++) {
            scene c = make_defect(what, !given);
            for (i = 0; i < STYLES; i++) {
                const uint32_t mode = (what + i) % PSURF_NORMALS_COUNT;
                char name[128];
                surface s;
                if (!is_thorough() && (what + i + given) % 7) continue;
                snprintf(name, sizeof name, "%s, %s, %s %u", styles[i].name, defect_names[what],
                         given ? "given" : "mode", (unsigned)mode);
                scene_build(&s, &c, &styles[i], (psurf_normal_mode)mode);
                expect_finite_everywhere(&s, &c, name, &r);
                surface_free(&s);
            }
            scene_free(&c);
        }
    print_message("%u samples, %u without a normal, %u without curvature, %u of infinite one; "
                  "second derivatives up to %g\n", (unsigned)r.samples,
                  (unsigned)r.without_normal, (unsigned)r.without_curvature, (unsigned)r.infinite,
                  r.second);
    assert_true(r.without_normal < r.samples / 4);
}

/* ---- places that are looked at more closely -------------------------------------------------- */

/* Tessellation and psurf_eval say the same of normals that vanish or oppose, where both look
   a second time: at a corner without a normal, between opposite ones, along an edge. */
static void test_closer_look(void **state)
{
    static const double normals[4][3][3] = {{{0, 0, 1}, {0, 0, -1}, {0.6, 0, 0.8}},
                                            {{0, 0, 0}, {0, 0, 1}, {0, 0, 1}},
                                            {{0, 0, 1}, {0, 0, 0}, {0.6, 0, 0.8}},
                                            {{1, 0, 0}, {0, 0, 1}, {0, 1, 0}}};
    const uint32_t corners[3] = {0, 1, 2};
    psurf_real p[45], n[45], shade[45], at_n[45], at_shade[45];
    psurf_sample where[15];
    uint32_t i, k, style, turned = 0;
    (void)state;
    for (style = 0; style < COUNT_OF(styles); style++)
        for (i = 0; i < COUNT_OF(normals); i++) {
            scene c;
            surface s;
            psurf_tess_desc desc;
            psurf_tess_out out;
            psurf_points points;
            mesh m = {0};
            mesh_point(&m, make_vec(0, 0, 0));
            mesh_point(&m, make_vec(2, 0, 0.25));
            mesh_point(&m, make_vec(0, 1, 0.75));
            mesh_face(&m, 3, corners);
            c = make_scene(m);
            c.normals = (vec *)grab(3, sizeof(vec));
            c.normal_count = 3;
            for (k = 0; k < 3; k++)
                c.normals[k] = make_vec(normals[i][k][0], normals[i][k][1], normals[i][k][2]);
            scene_build(&s, &c, &styles[style], PSURF_NORMALS_AVERAGE);
            memset(&desc, 0, sizeof desc);
            memset(&out, 0, sizeof out);
            memset(&points, 0, sizeof points);
            desc.rate = 4;
            out.p = p, out.n = n, out.shade = shade, out.where = where;
            assert_int_equal(psurf_tessellate(&s.patches, &desc, 0, 1, &out), PSURF_OK);
            points.n = at_n, points.shade = at_shade;
            psurf_eval(&s.patches, where, 15, &points);
            for (k = 0; k < 15; k++) {
                const int middle = i == 0 && where[k].u > 0.4 && where[k].u < 0.6
                                   && where[k].v <= 0;
                const double apart = distance(load(n + 3 * k), load(at_n + 3 * k));
                const double shaded = distance(load(shade + 3 * k), load(at_shade + 3 * k));
                if (middle && s.scheme != PSURF_SMOOTHED_N) continue;   /* du and dv are parallel:
                                                                           rounding decides */
                REQUIRE(apart < 2e-3 && shaded < 2e-3, "%s, normals %u, sample %u: %g %g\n",
                        styles[style].name, (unsigned)i, (unsigned)k, apart, shaded);
                turned += length(load(shade + 3 * k)) > 0.5;
            }
            surface_free(&s);
            scene_free(&c);
        }
    assert_true(turned > 15 * COUNT_OF(styles));
}

/* A face alone is a corner everywhere, however it is split: its limit points are its vertices. */
static void test_lone_faces_stay(void **state)
{
    static const uint32_t which[2] = {0, 2};
    uint32_t size, i, k;
    (void)state;
    for (size = 3; size <= 9; size++)
        for (i = 0; i < COUNT_OF(which); i++) {
            uint32_t corners[9];
            psurf_sample at;
            scene c;
            surface s;
            mesh m = {0};
            for (k = 0; k < size; k++) {
                mesh_point(&m, make_vec(cos(2 * PI * k / size), sin(2 * PI * k / size), 0));
                corners[k] = (k + 2) % size;
            }
            mesh_face(&m, size, corners);
            c = make_scene(m);
            scene_build(&s, &c, &styles[which[i]], PSURF_NORMALS_LIMIT);
            for (k = 0; k < size; k++) {
                at = side_sample(psurf_scheme_split(s.scheme), &c.m, 0, k, 0);
                assert_true(distance(eval_at(&s.patches, at).p, c.m.positions[corners[k]]) < 1e-6);
            }
            surface_free(&s);
            scene_free(&c);
        }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_derivatives), cmocka_unit_test(test_comparison_is_sharp),
        cmocka_unit_test(test_shading),     cmocka_unit_test(test_strides),
        cmocka_unit_test(test_flat_faces),  cmocka_unit_test(test_flat_sheet),
        cmocka_unit_test(test_defects),     cmocka_unit_test(test_closer_look),
        cmocka_unit_test(test_lone_faces_stay)};
    return cmocka_run_group_tests_name("scheme points", tests, NULL, NULL);
}
