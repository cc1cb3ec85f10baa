/* Watertight: every scheme, variant and source of normals, at every rate, on meshes of everything:
   positions on shared edges have the same bits from both sides, per face and welded, in whole and
   in ranges, tessellated and sampled. psurf_check says so, and an eye of the test's own. */
#include "schemes.h"

/* ---- meshes ---------------------------------------------------------------------------------- */

/* Small, with everything: faces of 3 to 9 corners, poles, hard edges on both ends and on one, open
   rims, a vertex where two fans touch. */
static mesh make_everything(void)
{
    uint64_t rng = 31;
    mesh m = make_cylinder(9, 1), part;
    uint32_t k;
    for (k = 0; k < 9; k++) mesh_hard(&m, k, (k + 1) % 9);
    mesh_take(&m, with_hard(make_cylinder(6, 1), &rng, 30), 4);
    mesh_take(&m, with_hard(make_cylinder(5, 1), &rng, 15), 8);
    part = make_torus(4, 3);
    mesh_split_quads(&part, &rng, 40);
    mesh_take(&m, with_hard(part, &rng, 10), 16);
    part = make_grid(4, 3);
    mesh_split_quads(&part, &rng, 30);
    mesh_remove_face(&part, 7);
    mesh_remove_face(&part, 2);                 /* the two holes touch at a vertex */
    mesh_take(&m, part, 24);
    mesh_take(&m, make_latlong(5, 1), 28);
    mesh_jitter(&m, &rng, 0.0625);
    return m;
}

enum { AVERAGED, BY_AREA, LIMITS, GIVEN, SPLIT, TURNED, SOURCES };
static const char *const source_names[SOURCES] = {"averaged", "by area", "limits",
                                                  "given",    "split",   "turned"};

/* The mesh with normals from somewhere. */
static scene make_source(uint32_t source)
{
    scene c = make_scene(make_everything());
    uint64_t rng = 33;
    if (source >= GIVEN) scene_vertex_normals(&c, &rng, 0.3);
    if (source == SPLIT) scene_split_normals(&c, &rng, 12);
    if (source == TURNED) scene_turn_normals(&c, &rng, 40, 2);
    return c;
}

static psurf_normal_mode mode_of(uint32_t source)
{
    return source == BY_AREA ? PSURF_NORMALS_AREA
         : source == LIMITS ? PSURF_NORMALS_LIMIT : PSURF_NORMALS_AVERAGE;
}

/* ---- an eye of the test's own ---------------------------------------------------------------- */

typedef struct net {
    psurf_tess_desc desc;
    psurf_tess_span span;
    psurf_real *p, *n, *shade;
    psurf_sample *where;
    uint32_t *indices;
} net;

static void net_free(net *t)
{
    free(t->p);
    free(t->n);
    free(t->shade);
    free(t->where);
    free(t->indices);
}

/* The whole mesh, in ranges of step faces. */
static net make_net(const surface *s, uint32_t rate, uint32_t flags, uint32_t step)
{
    net t;
    psurf_tess_out out;
    uint32_t f;
    memset(&t, 0, sizeof t);
    memset(&out, 0, sizeof out);
    t.desc.rate = rate;
    t.desc.flags = flags;
    assert_int_equal(psurf_tessellate_size(s->topology, &t.desc, 0, PSURF_NONE, &t.span), PSURF_OK);
    out.p = t.p = (psurf_real *)grab((size_t)t.span.vertex_count * 3, sizeof *t.p);
    out.n = t.n = (psurf_real *)grab((size_t)t.span.vertex_count * 3, sizeof *t.n);
    out.shade = t.shade = (psurf_real *)grab((size_t)t.span.vertex_count * 3, sizeof *t.shade);
    out.where = t.where = (psurf_sample *)grab(t.span.vertex_count, sizeof *t.where);
    out.indices = t.indices = (uint32_t *)grab(t.span.index_count, sizeof *t.indices);
    memset(t.p, 0xFF, (size_t)t.span.vertex_count * 3 * sizeof *t.p);
    memset(t.n, 0xFF, (size_t)t.span.vertex_count * 3 * sizeof *t.n);
    memset(t.shade, 0xFF, (size_t)t.span.vertex_count * 3 * sizeof *t.shade);
    for (f = 0; f < s->info.faces; f += step < s->info.faces - f ? step : s->info.faces - f)
        assert_int_equal(psurf_tessellate(&s->patches, &t.desc, f, step, &out), PSURF_OK);
    return t;
}

static void expect_same_net(const net *a, const net *b)
{
    const size_t bytes = (size_t)a->span.vertex_count * 3 * sizeof *a->p;
    assert_int_equal(a->span.vertex_count, b->span.vertex_count);
    assert_int_equal(a->span.index_count, b->span.index_count);
    assert_memory_equal(a->p, b->p, bytes);
    assert_memory_equal(a->n, b->n, bytes);
    assert_memory_equal(a->shade, b->shade, bytes);
    assert_memory_equal(a->where, b->where, a->span.vertex_count * sizeof *a->where);
    assert_memory_equal(a->indices, b->indices, a->span.index_count * sizeof *a->indices);
}

/* Per corner of the mesh and step along the edge that starts there: the vertex of the per-face net,
   found by its parameters. */
static uint32_t *find_sides(const surface *s, const mesh *m, const net *t)
{
    const uint32_t rate = t->desc.rate, corners = corner_count(m);
    uint32_t *sides = (uint32_t *)grab((size_t)corners * (rate + 1), sizeof *sides);
    uint32_t *first = (uint32_t *)grab(m->face_count, sizeof *first), f, i, k, e;
    const double tiny = 0.25 / rate;
    for (f = i = 0; f < m->face_count; i += m->faces[f].size, f++) first[f] = i;
    memset(sides, 0xFF, (size_t)corners * (rate + 1) * sizeof *sides);
    for (i = 0; i < t->span.vertex_count; i++) {
        const psurf_sample at = t->where[i];
        const mesh_face_data *face = &m->faces[at.face];
        const double u = (double)at.u, v = (double)at.v;
        uint32_t c[4];
        uint32_t count = face->size == 4 ? 4 : piece_corners(s->desc.split, face, at.sector, c);
        /* how far along each edge of the piece, and whether on it at all */
        const double along3[3] = {u, v, 1 - u - v}, off3[3] = {v, 1 - u - v, u};
        const double along4[4] = {u, v, 1 - u, 1 - v}, off4[4] = {v, 1 - u, 1 - v, u};
        if (face->size == 4)
            for (k = 0; k < 4; k++) c[k] = k;
        for (e = 0; e < count; e++) {
            const double along = count == 4 ? along4[e] : along3[e];
            if ((count == 4 ? off4[e] : off3[e]) > tiny) continue;
            k = (uint32_t)(along * rate + 0.5);
            if ((c[e] + 1) % face->size == c[(e + 1) % count])
                sides[(size_t)(first[at.face] + c[e]) * (rate + 1) + k] = i;
        }
        /* corners of the face where pieces begin or end: they lie on edges of other pieces */
        for (e = 0; e < count; e++) {
            double x, y;
            corner_place(count, e, &x, &y);
            if (fabs(u - x) + fabs(v - y) > tiny) continue;
            k = c[e];
            sides[(size_t)(first[at.face] + k) * (rate + 1)] = i;
            k = (k + face->size - 1) % face->size;
            sides[(size_t)(first[at.face] + k) * (rate + 1) + rate] = i;
        }
    }
    free(first);
    for (i = 0; i < corners * (rate + 1); i++)
        REQUIRE(sides[i] != PSURF_NONE, "corner %u, step %u of %u: no vertex\n",
                (unsigned)(i / (rate + 1)), (unsigned)(i % (rate + 1)), (unsigned)rate);
    return sides;
}

/* Pairs on shared edges that differ in a bit; all of them are counted in pairs. */
static uint32_t count_cracks(const surface *s, const mesh *m, const net *t, uint32_t *pairs)
{
    const uint32_t rate = t->desc.rate;
    uint32_t *sides = find_sides(s, m, t), i, k, cracks = 0;
    edge_map map = map_edges(m);
    for (i = 0; i < map.count; i++) {
        const half_edge *a = &map.edges[i], *b = find_edge(&map, a->to, a->from);
        size_t ca, cb;
        if (!b || a->from > a->to) continue;
        ca = (size_t)(first_corner_of(m, a->face) + a->corner) * (rate + 1);
        cb = (size_t)(first_corner_of(m, b->face) + b->corner) * (rate + 1);
        for (k = 0; k <= rate; k++) {
            const psurf_real *p = t->p + 3 * (size_t)sides[ca + k];
            const psurf_real *q = t->p + 3 * (size_t)sides[cb + rate - k];
            REQUIRE(is_finite_vec(load(p)), "edge %u-%u: not finite\n", (unsigned)a->from,
                    (unsigned)a->to);
            cracks += !same_bits(p, q);
            ++*pairs;
        }
    }
    free(map.edges);
    free(sides);
    return cracks;
}

static psurf_check_result check_rate(const surface *s, uint32_t rate)
{
    psurf_check_result r;
    assert_int_equal(psurf_check(&s->patches, &s->construct, rate, 0, PSURF_NONE, &r), PSURF_OK);
    return r;
}

static uint32_t count_shared(const mesh *m)
{
    edge_map map = map_edges(m);
    uint32_t i, n = 0;
    for (i = 0; i < map.count; i++)
        n += map.edges[i].from < map.edges[i].to
             && find_edge(&map, map.edges[i].to, map.edges[i].from) != NULL;
    free(map.edges);
    return n;
}

/* The rates at which every edge is compared: all with split normals, some with other sources. */
static int is_checked(uint32_t source, uint32_t rate)
{
    static const uint32_t few[] = {1, 2, 5, 9};
    uint32_t k;
    if (is_thorough()) return source == SPLIT || rate % SOURCES == source;
    if (source != SPLIT) return rate == 3 + source;
    for (k = 0; k < COUNT_OF(few); k++)
        if (few[k] == rate) return 1;
    return 0;
}

/* ---- the promises ---------------------------------------------------------------------------- */

static void test_no_cracks(void **state)
{
    const uint32_t most = is_thorough() ? 33 : 6;
    uint32_t source, i, rate;
    (void)state;
    for (source = 0; source < SOURCES; source++) {
        scene c = make_source(source);
        const uint32_t shared = count_shared(&c.m);
        for (i = 0; i < STYLES; i++) {
            uint32_t pairs = 0;
            surface s;
            if (!is_thorough() && source != SPLIT && (source + i) % 3) continue;
            scene_build(&s, &c, &styles[i], mode_of(source));
            for (rate = 1; rate <= 33; rate++) {
                psurf_check_result r;
                if (!is_checked(source, rate)) continue;
                r = check_rate(&s, rate);
                REQUIRE(r.cracks == 0 && r.nonfinite == 0,
                        "%s, %s, rate %u: %lu cracks, %lu not finite\n", styles[i].name,
                        source_names[source], (unsigned)rate, (unsigned long)r.cracks,
                        (unsigned long)r.nonfinite);
                assert_int_equal(r.samples, ((uint64_t)shared + s.info.inner_edges) * (rate + 1));
            }
            for (rate = 1; rate <= most; rate += rate < 3 ? 1 : most / 2 - 1) {
                net t = make_net(&s, rate, PSURF_TESS_PER_FACE, PSURF_NONE);
                uint32_t cracks = count_cracks(&s, &c.m, &t, &pairs);
                REQUIRE(cracks == 0, "%s, %s, rate %u: %u cracks\n", styles[i].name,
                        source_names[source], (unsigned)rate, (unsigned)cracks);
                net_free(&t);
            }
            assert_true(pairs > most * shared / 2);
            surface_free(&s);
        }
        scene_free(&c);
    }
}

/* The eye sees: one bit of one vertex on an edge, one bit of one control point. */
static void test_cracks_are_found(void **state)
{
    scene c = make_source(SPLIT);
    const uint32_t flips = is_thorough() ? 10 : 2;
    uint32_t i, k, pairs = 0, seen = 0;
    uint64_t rng = 35;
    (void)state;
    for (i = 0; i < STYLES; i++) {
        surface s;
        net t;
        uint32_t *sides;
        scene_build(&s, &c, &styles[i], PSURF_NORMALS_AVERAGE);
        t = make_net(&s, 3, PSURF_TESS_PER_FACE, PSURF_NONE);
        sides = find_sides(&s, &c.m, &t);
        for (k = 0; k < flips; k++) {
            const uint32_t at = random_below(&rng, corner_count(&c.m)) * 4 + 1;
            unsigned char *low = (unsigned char *)(void *)(t.p + 3 * (size_t)sides[at]);
            *low ^= 1;
            seen += count_cracks(&s, &c.m, &t, &pairs) == 1;    /* not on open rims */
            *low ^= 1;
            assert_int_equal(count_cracks(&s, &c.m, &t, &pairs), 0);
        }
        free(sides);
        net_free(&t);
        for (k = 0; k < flips; k++) {           /* the point next to corner 0 on edge 0 */
            psurf_patch patch = psurf_get_patch(&s.patches, random_below(&rng, s.info.facets));
            const int set = patch.kind == PSURF_HYBRID_TRI;
            size_t at = (size_t)((const char *)(const void *)(patch.points + (set ? 9 : 3))
                                 - s.memory);
            psurf_check_result r;
            s.memory[at] ^= 1;
            t = make_net(&s, 3, PSURF_TESS_PER_FACE, PSURF_NONE);
            assert_int_equal(psurf_check(&s.patches, &s.construct, 3, 0, s.info.edges, &r),
                             PSURF_OK);
            assert_int_equal(count_cracks(&s, &c.m, &t, &pairs), r.cracks);
            seen += check_rate(&s, 3).cracks > 0;       /* between pieces too */
            net_free(&t);
            s.memory[at] ^= 1;
        }
        assert_int_equal(check_rate(&s, 3).cracks, 0);
        surface_free(&s);
    }
    print_message("%u of %u flipped bits were cracks\n", (unsigned)seen,
                  (unsigned)(2 * STYLES * flips));
    assert_true(seen > STYLES * flips);
    scene_free(&c);
}

/* Corner for corner of every triangle, welded vertices have the position of the per-face ones, bit
   for bit, and, where the face wrote them, the normals. */
static void expect_welded(const surface *s, const char *name, uint32_t rate)
{
    net a = make_net(s, rate, PSURF_TESS_PER_FACE, PSURF_NONE);
    net b = make_net(s, rate, 0, PSURF_NONE);
    size_t k;
    assert_int_equal(a.span.index_count, b.span.index_count);
    for (k = 0; k < a.span.index_count; k++) {
        const size_t i = a.indices[k], j = b.indices[k];
        REQUIRE(same_bits(a.p + 3 * i, b.p + 3 * j), "%s, rate %u: welded index %u\n", name,
                (unsigned)rate, (unsigned)k);
        if (a.where[i].face != b.where[j].face) continue;
        assert_true(same_bits(a.n + 3 * i, b.n + 3 * j));
        assert_true(same_bits(a.shade + 3 * i, b.shade + 3 * j));
    }
    net_free(&a);
    net_free(&b);
}

static void test_welded(void **state)
{
    scene c = make_source(SPLIT);
    uint32_t i, rate;
    (void)state;
    for (i = 0; i < STYLES; i++) {
        surface s;
        scene_build(&s, &c, &styles[i], PSURF_NORMALS_AVERAGE);
        for (rate = 1; rate <= (is_thorough() ? 17u : 6u); rate += rate < 6 ? 1 : 5)
            expect_welded(&s, styles[i].name, rate);
        surface_free(&s);
    }
    scene_free(&c);
}

/* Passes and tessellation in ranges of any size: the same bits. */
static void test_ranges(void **state)
{
    static const uint32_t steps[] = {1, 3, 8, 13};
    scene c = make_source(SPLIT);
    uint32_t i, k, pass, first;
    (void)state;
    for (i = 0; i < STYLES; i++) {
        surface s, whole;
        scene_build(&whole, &c, &styles[i], PSURF_NORMALS_AVERAGE);
        for (k = 0; k < COUNT_OF(steps); k++) {
            scene_build(&s, &c, &styles[i], PSURF_NORMALS_AVERAGE);
            memset(s.memory, 0, s.patches.layout.patch_bytes);
            for (pass = 0; pass < PSURF_PASS_COUNT; pass++)
                for (first = 0; first < s.patches.layout.pass_items[pass]; first += steps[k])
                    assert_int_equal(psurf_construct_pass(&s.patches, &s.construct,
                                                          (psurf_pass)pass, first, steps[k]),
                                     PSURF_OK);
            assert_memory_equal(s.memory, whole.memory, s.patches.layout.patch_bytes);
            surface_free(&s);
        }
        for (k = 0; k < COUNT_OF(steps); k++) {
            const uint32_t flags = k % 2 ? PSURF_TESS_PER_FACE : 0, rate = k + 4;
            net a = make_net(&whole, rate, flags, PSURF_NONE);
            net b = make_net(&whole, rate, flags, steps[k]);
            expect_same_net(&a, &b);
            net_free(&a);
            net_free(&b);
        }
        surface_free(&whole);
    }
    scene_free(&c);
}

/* Samples on edges have the bits of the tessellation where the parameters are the same, so at rates
   that are powers of two; from both sides, at s and 1-s. Inner edges of split faces too. */
static void test_samples_on_edges(void **state)
{
    scene c = make_source(SPLIT);
    uint32_t i, f, k, e, piece;
    (void)state;
    for (i = 0; i < STYLES; i++) {
        const uint32_t rate = 8;
        surface s;
        net t;
        uint32_t *sides, inner = 0, corner = 0;
        edge_map map = map_edges(&c.m);
        scene_build(&s, &c, &styles[i], PSURF_NORMALS_AVERAGE);
        t = make_net(&s, rate, PSURF_TESS_PER_FACE, PSURF_NONE);
        sides = find_sides(&s, &c.m, &t);
        for (f = 0; f < c.m.face_count; f++)
            for (e = 0; e < c.m.faces[f].size; e++, corner++)
                for (k = 0; k <= rate; k++) {
                    psurf_sample at = side_sample(s.desc.split, &c.m, f, e, (double)k / rate);
                    const uint32_t vertex = sides[corner * (rate + 1) + k];
                    psurf_real p[3];
                    psurf_points out;
                    memset(&out, 0, sizeof out);
                    out.p = p;
                    psurf_eval(&s.patches, &at, 1, &out);
                    REQUIRE(same_bits(p, t.p + 3 * (size_t)vertex),
                            "%s: face %u edge %u at %u/8\n", styles[i].name, (unsigned)f,
                            (unsigned)e, (unsigned)k);
                }
        for (k = 0; k < map.count; k++) {       /* anywhere on edges */
            const half_edge *a = &map.edges[k], *b = find_edge(&map, a->to, a->from);
            uint64_t rng = 36 + k;
            for (e = 0; b && e < 4; e++) {
                const double at = random_unit(&rng);
                point pa = eval_at(&s.patches, side_sample(s.desc.split, &c.m, a->face, a->corner,
                                                           at));
                point pb = eval_at(&s.patches, side_sample(s.desc.split, &c.m, b->face, b->corner,
                                                           1 - at));
                assert_true(!memcmp(&pa.p, &pb.p, sizeof pa.p));
            }
        }
        for (f = 0; f < c.m.face_count; f++) {  /* between pieces that have samples */
            const uint32_t pieces = pieces_of(s.desc.split, c.m.faces[f].size);
            if (c.m.faces[f].size < 5) continue;
            for (piece = 0; piece + 1 < pieces; piece++)
                for (k = 0; k <= 16; k++) {
                    uint32_t at[4];
                    const double d = k / 16.0;          /* last edge of one, first of the next */
                    const uint32_t count = piece_corners(s.desc.split, &c.m.faces[f], piece, at);
                    psurf_sample sa = edge_sample(f, count, count - 1, 1 - d);
                    psurf_sample sb = make_sample(f, piece + 1, d, 0);
                    point pa, pb;
                    sa.sector = piece;
                    pa = eval_at(&s.patches, sa), pb = eval_at(&s.patches, sb);
                    REQUIRE(!memcmp(&pa.p, &pb.p, sizeof pa.p), "%s: face %u, pieces %u and next\n",
                            styles[i].name, (unsigned)f, (unsigned)piece);
                    inner++;
                }
        }
        assert_true(inner > 100);
        free(map.edges);
        free(sides);
        net_free(&t);
        surface_free(&s);
    }
    scene_free(&c);
}

/* Several schemes on one object. */
static void test_mixes(void **state)
{
    static const unsigned char of_pn[] = {PSURF_PN, PSURF_SMOOTHED_N, PSURF_CUBIC_PN_B1,
                                          PSURF_CUBIC_PN_B2};
    static const unsigned char of_wm[] = {PSURF_CUBIC_WM_B1, PSURF_CUBIC_WM_B2};
    static const unsigned char of_one[] = {PSURF_HYBRID}, of_png1[] = {PSURF_PNG1};
    static const struct { const unsigned char *schemes; uint32_t count; } mixes[] = {
        {of_pn, 4}, {of_wm, 2}, {of_one, 1}, {of_png1, 1}};
    uint32_t i, f, k, rate, source;
    (void)state;
    for (source = 0; source < SOURCES; source += 2)
        for (i = 0; i < COUNT_OF(mixes); i++)
            for (k = 0; k < PSURF_N_COUNT; k++) {
                scene c = make_source(source);
                uint64_t rng = 37;
                uint32_t pairs = 0, of_scheme[PSURF_SCHEME_COUNT] = {0};
                style y = styles[N_G1 + k];
                surface s, alone[PSURF_SCHEME_COUNT];
                /* variants are of smoothed_n alone */
                if (k && (i || !is_thorough())) {
                    scene_free(&c);
                    continue;
                }
                y.variant = (psurf_variant)k;
                memset(alone, 0, sizeof alone);
                c.schemes = (unsigned char *)grab(c.m.face_count, 1);
                for (f = 0; f < c.m.face_count; f++) {
                    c.schemes[f] = mixes[i].schemes[random_below(&rng, mixes[i].count)];
                    of_scheme[c.schemes[f]]++;
                }
                scene_build(&s, &c, &y, mode_of(source));
                for (rate = 1; rate <= (is_thorough() ? 33u : 4u); rate += rate < 5 ? 1 : 4) {
                    psurf_check_result r = check_rate(&s, rate);
                    assert_int_equal(r.cracks + r.nonfinite, 0);
                }
                for (rate = 2; rate <= 7; rate += 5) {
                    net t = make_net(&s, rate, PSURF_TESS_PER_FACE, PSURF_NONE);
                    net u = make_net(&s, rate, PSURF_TESS_PER_FACE, 5);
                    assert_int_equal(count_cracks(&s, &c.m, &t, &pairs), 0);
                    expect_same_net(&t, &u);
                    net_free(&t);
                    net_free(&u);
                }
                expect_welded(&s, "mix", 6);
                /* a face is what it is on an object of its scheme alone */
                for (f = 0; f < PSURF_SCHEME_COUNT; f++)
                    if (of_scheme[f]) {
                        unsigned char *schemes = c.schemes;
                        style z = y;
                        z.scheme = (psurf_scheme)f;
                        c.schemes = NULL;
                        if (f == PSURF_PN) {    /* its own split is another */
                            c.schemes = (unsigned char *)grab(c.m.face_count, 1);
                            memset(c.schemes, PSURF_PN, c.m.face_count);
                        }
                        scene_build(&alone[f], &c, &z, mode_of(source));
                        if (c.schemes) free(c.schemes);
                        c.schemes = schemes;
                    }
                for (f = 0; f < 500; f++) {
                    psurf_sample at = random_sample(&c.m, &rng);
                    const surface *own = &alone[c.schemes[at.face]];
                    point p = eval_at(&s.patches, at), q = eval_at(&own->patches, at);
                    REQUIRE(!memcmp(&p, &q, sizeof p), "face %u of %s differs in a mix\n",
                            (unsigned)at.face,
                            psurf_scheme_name((psurf_scheme)c.schemes[at.face]));
                }
                for (f = 0; f < PSURF_SCHEME_COUNT; f++)
                    if (of_scheme[f]) surface_free(&alone[f]);
                surface_free(&s);
                scene_free(&c);
            }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_no_cracks), cmocka_unit_test(test_cracks_are_found),
        cmocka_unit_test(test_welded),    cmocka_unit_test(test_ranges),
        cmocka_unit_test(test_samples_on_edges), cmocka_unit_test(test_mixes)};
    return cmocka_run_group_tests_name("scheme seams", tests, NULL, NULL);
}
