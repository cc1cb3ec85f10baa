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

static vec value_of(const jet3 *a) { return make_vec((double)a->c[0].f, (double)a->c[1].f, (double)a->c[2].f); }

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
    uint32_t i, k;
    (void)state;
    for (i = 0; i < STYLES; i++) {
        uint64_t rng = 41 + i;
        surface s;
        errors w;
        memset(&w, 0, sizeof w);
        scene_build(&s, &c, &styles[i], PSURF_NORMALS_AVERAGE);
        for (k = 0; k < 3000; k++)
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

int main(void)
{
    const struct CMUnitTest tests[] = {cmocka_unit_test(test_derivatives)};
    return cmocka_run_group_tests_name("scheme points", tests, NULL, NULL);
}
