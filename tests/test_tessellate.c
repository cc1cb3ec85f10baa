/* Tessellation: what per-face and welded output have in common bit for bit, closedness, ranges,
   limits; and psurf_check and psurf_smooth, which are made of it. */
#include "common.h"

typedef struct tess {
    psurf_tess_desc desc;
    psurf_tess_span span;
    psurf_real *p, *n;
    psurf_sample *where;
    uint32_t *indices;
} tess;

/* The whole mesh. */
static tess tessellate(const surface *s, uint32_t rate, uint32_t flags)
{
    tess t;
    psurf_tess_out out;
    memset(&t, 0, sizeof t);
    memset(&out, 0, sizeof out);
    t.desc.rate = rate;
    t.desc.flags = flags;
    assert_int_equal(psurf_tessellate_size(s->topology, &t.desc, 0, PSURF_NONE, &t.span), PSURF_OK);
    assert_int_equal(t.span.first_vertex, 0);
    assert_int_equal(t.span.first_index, 0);
    out.p = t.p = (psurf_real *)grab((size_t)t.span.vertex_count * 3, sizeof *t.p);
    out.n = t.n = (psurf_real *)grab((size_t)t.span.vertex_count * 3, sizeof *t.n);
    out.where = t.where = (psurf_sample *)grab(t.span.vertex_count, sizeof *t.where);
    out.indices = t.indices = (uint32_t *)grab(t.span.index_count, sizeof *t.indices);
    assert_int_equal(psurf_tessellate(&s->patches, &t.desc, 0, PSURF_NONE, &out), PSURF_OK);
    return t;
}

static void tess_free(tess *t)
{
    free(t->p);
    free(t->n);
    free(t->where);
    free(t->indices);
}

static uint32_t vertices_of_face(uint32_t size, uint32_t rate)
{
    if (size == 3) return (rate + 1) * (rate + 2) / 2;
    return size == 4 ? (rate + 1) * (rate + 1) : 1 + size * rate * (rate + 1) / 2;
}

static uint32_t triangles_of_face(uint32_t size, uint32_t rate)
{
    return size == 3 ? rate * rate : size == 4 ? 2 * rate * rate : size * rate * rate;
}

/* By the rule in the header: corners stand in the order of facets, kind by kind. */
static uint32_t first_corner(const surface *s, uint32_t facet)
{
    static const uint32_t sides[PSURF_KIND_COUNT] = {4, 3, 3, 4, 5};
    uint32_t kind = 0;
    while (facet >= s->tables.kind_first[kind + 1]) kind++;
    return s->tables.kind_first_corner[kind] + (facet - s->tables.kind_first[kind]) * sides[kind];
}

/* Faces begin at every corner in turn. */
static void turn_corners(mesh *m)
{
    uint32_t f, k;
    for (f = 0; f < m->face_count; f++) {
        const mesh_face_data old = m->faces[f];
        for (k = 0; k < old.size; k++) m->faces[f].v[k] = old.v[(k + f) % old.size];
    }
}

/* The creature, its corners turned, beside other shapes: every kind and every corner. */
static mesh make_scene(uint64_t seed)
{
    uint64_t rng = seed;
    mesh m = make_creature(), ball = make_latlong(5, 1), torus = make_torus(6, 5);
    mesh_split_quads(&torus, &rng, 30);
    mesh_scramble(&torus, &rng, 6);
    mesh_append(&m, &ball, 8);
    mesh_append(&m, &torus, 16);
    mesh_jitter(&m, &rng, 0.04);
    turn_corners(&m);
    mesh_free(&ball);
    mesh_free(&torus);
    return m;
}

/* Closed and unmarked; then everything else. */
enum { SCENES = 2 };
static mesh make_scene_of(uint32_t scene, uint64_t seed)
{
    return scene ? make_marked() : make_scene(seed);
}

static int is_split(const surface *s, uint32_t face)
{
    const psurf_facet *facets = (const psurf_facet *)s->tables.facets.data;
    return (facets[patch_of(s, face)].piece & PSURF_SPLIT_FACE) != 0;
}

/* ---- counts, order, closedness --------------------------------------------------------------- */

typedef struct triangle_edge { uint32_t from, to; } triangle_edge;

static int compare_edges(const void *pa, const void *pb)
{
    const triangle_edge *a = (const triangle_edge *)pa, *b = (const triangle_edge *)pb;
    if (a->from != b->from) return a->from < b->from ? -1 : 1;
    return a->to < b->to ? -1 : a->to > b->to;
}

/* Every directed edge once, all but open of them with their reverse. Returns the number of
   undirected edges. */
static uint32_t expect_manifold(const tess *t, uint32_t open)
{
    triangle_edge *edges = (triangle_edge *)grab(t->span.index_count, sizeof *edges);
    uint32_t count = (uint32_t)t->span.index_count, alone = 0, i;
    for (i = 0; i < count; i++) {
        edges[i].from = t->indices[i];
        edges[i].to = t->indices[i % 3 == 2 ? i - 2 : i + 1];
        assert_true(edges[i].from < t->span.vertex_count && edges[i].from != edges[i].to);
    }
    qsort(edges, count, sizeof *edges, compare_edges);
    for (i = 0; i < count; i++) {
        triangle_edge back;
        back.from = edges[i].to, back.to = edges[i].from;
        assert_true(i == 0 || compare_edges(&edges[i - 1], &edges[i]) != 0);
        alone += !bsearch(&back, edges, count, sizeof *edges, compare_edges);
    }
    free(edges);
    assert_int_equal(alone, open);
    return (count + open) / 2;
}

/* Triangles see the outside: their plane agrees with the normals of their vertices. */
static uint32_t turned_triangles(const tess *t)
{
    uint32_t turned = 0;
    size_t i;
    for (i = 0; i < t->span.index_count; i += 3) {
        const uint32_t *v = t->indices + i;
        vec a = load(t->p + 3 * v[0]), b = load(t->p + 3 * v[1]), c = load(t->p + 3 * v[2]);
        vec n = add(load(t->n + 3 * v[0]), add(load(t->n + 3 * v[1]), load(t->n + 3 * v[2])));
        turned += !(dot(cross(sub(b, a), sub(c, a)), n) > 0);
    }
    return turned;
}

/* Sizes, manifold with boundary, every vertex in use. Both sides of hard edges are boundaries. */
static void expect_welded(const mesh *m, const surface *s, uint32_t rate)
{
    tess t = tessellate(s, rate, 0);
    uint32_t inside = 0, triangles = 0, edges, rings = s->info.rings - s->info.centres, f, i, *used;
    for (f = 0; f < m->face_count; f++) {
        inside += vertices_of_face(m->faces[f].size, rate) - m->faces[f].size * rate;
        triangles += triangles_of_face(m->faces[f].size, rate);
    }
    assert_int_equal(t.span.vertex_count, rings + s->info.edge_sides * (rate - 1) + inside);
    assert_int_equal(t.span.index_count, 3 * triangles);
    edges = expect_manifold(&t, rate * (s->info.boundary_edges + 2 * s->info.hard_edges));
    assert_int_equal((int)(t.span.vertex_count + triangles) - (int)edges,
                     (int)(rings + s->info.faces) - (int)s->info.edge_sides);
    used = (uint32_t *)grab(t.span.vertex_count, sizeof *used);
    for (i = 0; i < t.span.index_count; i++) used[t.indices[i]]++;
    for (i = 0; i < t.span.vertex_count; i++)
        assert_true(used[i] >= (s->info.edge_sides > s->info.edges ? 1 : 3));
    free(used);
    tess_free(&t);
}

static void test_welded(void **state)
{
    mesh shape = make_creature();
    surface s;
    uint32_t rate, scene;
    (void)state;
    for (scene = 0; scene < SCENES; scene++) {
        mesh m = make_scene_of(scene, 1);
        surface_build(&s, &m);
        /* at rate 1 the two sides of a hard edge may have both ends in common */
        for (rate = 1 + scene; rate <= 33; rate += rate < 9 ? 1 : 8) expect_welded(&m, &s, rate);
        surface_free(&s);
        mesh_free(&m);
    }
    surface_build(&s, &shape);                          /* no jitter, nothing folds over */
    for (rate = 1; rate <= 9; rate++) {
        tess t = tessellate(&s, rate, 0);
        assert_int_equal(turned_triangles(&t), 0);
        tess_free(&t);
    }
    surface_free(&s);
    mesh_free(&shape);
}

/* Vertices of the same corner of the same triangle have the same position, per face and welded, bit
   for bit; normals too where the writer is the face itself, else to rounding: so hard edges have
   one per side. */
static void expect_per_face_equals_welded(const mesh *m, const surface *s)
{
    uint32_t rate;
    for (rate = 1; rate <= 33; rate += rate < 9 ? 1 : 6) {
        tess a = tessellate(s, rate, PSURF_TESS_PER_FACE), b = tessellate(s, rate, 0);
        uint32_t f, vertex = 0, *lowest = (uint32_t *)grab(b.span.vertex_count, sizeof *lowest);
        size_t index = 0, k;
        assert_int_equal(a.span.index_count, b.span.index_count);
        memset(lowest, 0xFF, b.span.vertex_count * sizeof *lowest);
        for (f = 0; f < m->face_count; f++) {
            uint32_t size = m->faces[f].size, count = vertices_of_face(size, rate);
            size_t end = index + 3 * (size_t)triangles_of_face(size, rate);
            for (k = index; k < end; k++) {
                uint32_t i = a.indices[k], j = b.indices[k];
                assert_true(i >= vertex && i < vertex + count);
                assert_int_equal(a.where[i].face, f);
                assert_true(same_bits(a.p + 3 * i, b.p + 3 * j));
                assert_true(angle_between(load(a.n + 3 * i), load(b.n + 3 * j))
                            < (IS_DOUBLE ? 1e-10 : 2e-4));
                if (b.where[j].face == f) assert_true(same_bits(a.n + 3 * i, b.n + 3 * j));
                if (f < lowest[j]) lowest[j] = f;
            }
            index = end;
            vertex += count;
        }
        assert_int_equal(vertex, a.span.vertex_count);
        assert_int_equal(index, a.span.index_count);
        for (k = 0; k < b.span.vertex_count; k++) assert_int_equal(b.where[k].face, lowest[k]);
        free(lowest);
        tess_free(&a);
        tess_free(&b);
    }
}

static void test_per_face_equals_welded(void **state)
{
    uint32_t scene;
    (void)state;
    for (scene = 0; scene < SCENES; scene++) {
        mesh m = make_scene_of(scene, 2);
        surface s;
        surface_build(&s, &m);
        expect_per_face_equals_welded(&m, &s);
        surface_free(&s);
        mesh_free(&m);
    }
}

/* where is where: psurf_eval there gives the vertex; on edges, at rates that are powers of two, bit
   for bit. Per face the order is corner 0 -> 1 first, then towards the other side. */
static void expect_where(const mesh *m, const surface *s)
{
    uint32_t rate, on_edges = 0;
    for (rate = 1; rate <= 16; rate++) {
        tess t = tessellate(s, rate, PSURF_TESS_PER_FACE);
        uint32_t i, f, x, y, sector;
        for (i = 0; i < t.span.vertex_count; i++) {
            psurf_sample w = t.where[i];
            uint32_t size = m->faces[w.face].size;
            point p = eval_at(&s->patches, w);
            psurf_real exact[3];
            double u = (double)w.u, v = (double)w.v;
            assert_true(u >= 0 && v >= 0 && u <= 1 && v <= 1 && w.sector < (size < 5 ? 1 : size));
            assert_true(size == 4 || u + v < 1.000001);
            assert_true(distance(p.p, load(t.p + 3 * i)) < (IS_DOUBLE ? 1e-13 : 1e-4));
            assert_true(angle_between(p.n, load(t.n + 3 * i)) < (IS_DOUBLE ? 1e-10 : 1e-3));
            exact[0] = (psurf_real)p.p.x, exact[1] = (psurf_real)p.p.y;
            exact[2] = (psurf_real)p.p.z;
            if (rate & (rate - 1)) continue;
            if (size == 4 ? u * v * (1 - u) * (1 - v) == 0
                          : size == 3 ? u * v * (1 - u - v) == 0 : u + v == 1) {
                assert_true(same_bits(exact, t.p + 3 * i));
                on_edges++;
            }
        }
        for (f = i = 0; f < m->face_count; f++) {
            uint32_t size = m->faces[f].size;
            double step = 1.0 / rate, tiny = IS_DOUBLE ? 1e-14 : 1e-6;
            for (sector = 0; sector < (size < 5 ? 1 : size); sector++)
                for (y = 0; y < rate + (size < 5); y++)
                    for (x = 0; x < (size == 4 ? rate + 1 : rate + (size == 3) - y); x++, i++) {
                        psurf_sample w = t.where[i];
                        double centre = y * step, along = x * step;
                        assert_int_equal(w.face, f);
                        assert_int_equal(w.sector, sector);
                        if (size >= 5) {        /* u falls from corner to corner */
                            assert_true(fabs((double)w.v - along) < tiny);
                            assert_true(fabs((double)w.u - (1 - along - centre)) < tiny);
                        } else {
                            assert_true(fabs((double)w.u - along) < tiny);
                            assert_true(fabs((double)w.v - centre) < tiny);
                        }
                    }
            if (size >= 5) {
                assert_true(t.where[i].u == 0 && t.where[i].v == 0 && t.where[i].face == f);
                i++;
            }
        }
        assert_int_equal(i, t.span.vertex_count);
        tess_free(&t);
    }
    assert_true(on_edges > 1000);
}

static void test_where(void **state)
{
    uint32_t scene;
    (void)state;
    for (scene = 0; scene < SCENES; scene++) {
        mesh m = make_scene_of(scene, 3);
        surface s;
        surface_build(&s, &m);
        expect_where(&m, &s);
        surface_free(&s);
        mesh_free(&m);
    }
}

/* Welded numbers: a vertex per ring but centres, in their order; then each edge side's, from the
   writer's corner on; then the insides, face by face. */
static void expect_numbering(const mesh *m, const surface *s)
{
    const uint32_t rate = 7, rings = s->info.rings - s->info.centres;
    tess t = tessellate(s, rate, 0);
    uint32_t i, k, f, next;
    for (i = 0; i < rings; i++) {
        vec v = limit_point(s, i), p = load(t.p + 3 * i);
        assert_true(v.x == p.x && v.y == p.y && v.z == p.z);
    }
    for (i = 0; i < s->info.edge_sides; i++) {
        uint32_t corner = ((const psurf_edge *)s->tables.edges.data)[i].corner, facet = 0, local;
        while (facet + 1 < s->info.facets && first_corner(s, facet + 1) <= corner) facet++;
        f = psurf_get_patch(&s->patches, facet).face;
        local = corner - first_corner(s, facet);
        if (is_split(s, f)) local = psurf_get_patch(&s->patches, facet).sector;
        for (k = 1; k < rate; k++) {
            uint32_t at = rings + i * (rate - 1) + k - 1;
            point p = eval_at(&s->patches,
                              edge_sample(f, m->faces[f].size, local, (double)k / rate));
            assert_int_equal(t.where[at].face, f);
            assert_true(distance(p.p, load(t.p + 3 * at)) < (IS_DOUBLE ? 1e-13 : 1e-4));
        }
    }
    next = rings + s->info.edge_sides * (rate - 1);
    for (f = 0; f < m->face_count; f++) {
        uint32_t size = m->faces[f].size, inside = vertices_of_face(size, rate) - size * rate;
        for (k = 0; k < inside; k++) assert_int_equal(t.where[next + k].face, f);
        next += inside;
    }
    assert_int_equal(next, t.span.vertex_count);
    tess_free(&t);
}

static void test_numbering(void **state)
{
    uint32_t scene;
    (void)state;
    for (scene = 0; scene < SCENES; scene++) {
        mesh m = make_scene_of(scene, 9);
        surface s;
        surface_build(&s, &m);
        expect_numbering(&m, &s);
        surface_free(&s);
        mesh_free(&m);
    }
}

/* ---- ranges ---------------------------------------------------------------------------------- */

/* A range written to memory of its own, then copied to where its span says. */
static void write_range(const surface *s, tess *t, uint32_t first, uint32_t count)
{
    psurf_tess_span span;
    psurf_tess_out out;
    psurf_real *p, *n;
    psurf_sample *where;
    uint32_t *indices;
    size_t i;
    int welded = !(t->desc.flags & PSURF_TESS_PER_FACE);
    memset(&out, 0, sizeof out);
    assert_int_equal(psurf_tessellate_size(s->topology, &t->desc, first, count, &span), PSURF_OK);
    assert_true(span.first_vertex + span.vertex_count <= t->span.vertex_count);
    assert_true(span.first_index + span.index_count <= t->span.index_count);
    p = (psurf_real *)grab((size_t)span.vertex_count * 4, sizeof *p);
    n = (psurf_real *)grab((size_t)span.vertex_count * 5, sizeof *n);
    where = (psurf_sample *)grab(span.vertex_count, sizeof *where);
    indices = (uint32_t *)grab(span.index_count, sizeof *indices);
    for (i = 0; i < span.vertex_count; i++) {
        where[i].face = PSURF_NONE;
        p[4 * i + 3] = n[5 * i + 3] = n[5 * i + 4] = -77;
    }
    out.p = p, out.n = n, out.where = where, out.indices = indices;
    out.p_stride = 4 * sizeof *p;
    out.n_stride = 5 * sizeof *n;
    out.first_vertex = span.first_vertex;
    out.first_index = span.first_index;
    assert_int_equal(psurf_tessellate(&s->patches, &t->desc, first, count, &out), PSURF_OK);
    for (i = 0; i < span.vertex_count; i++) {
        size_t to = span.first_vertex + i;
        assert_true(p[4 * i + 3] == -77 && n[5 * i + 3] == -77 && n[5 * i + 4] == -77);
        if (where[i].face == PSURF_NONE) {
            assert_true(welded);                        /* another range writes it */
            continue;
        }
        assert_true(where[i].face >= first && where[i].face - first < count);
        assert_int_equal(t->where[to].face, PSURF_NONE);        /* nobody did before */
        t->where[to] = where[i];
        memcpy(t->p + 3 * to, p + 4 * i, 3 * sizeof *p);
        memcpy(t->n + 3 * to, n + 5 * i, 3 * sizeof *n);
    }
    for (i = 0; i < span.index_count; i++)
        t->indices[span.first_index + i] = indices[i] + span.first_vertex;
    free(p);
    free(n);
    free(where);
    free(indices);
}

static void expect_ranges(const mesh *m, const surface *s)
{
    static const uint32_t rates[] = {1, 2, 5, 8};
    uint64_t rng = 4;
    uint32_t round, i;
    for (round = 0; round < 24; round++) {
        uint32_t flags = round & 1 ? PSURF_TESS_PER_FACE : 0, rate = rates[round / 2 % 4], end;
        size_t vertices;
        tess whole = tessellate(s, rate, flags), parts = tessellate(s, rate, flags);
        memset(parts.p, 0, (size_t)parts.span.vertex_count * 3 * sizeof *parts.p);
        memset(parts.n, 0, (size_t)parts.span.vertex_count * 3 * sizeof *parts.n);
        memset(parts.indices, 0, parts.span.index_count * sizeof *parts.indices);
        for (i = 0; i < parts.span.vertex_count; i++) parts.where[i].face = PSURF_NONE;
        for (end = m->face_count; end > 0;) {            /* from the back */
            uint32_t count = 1 + random_below(&rng, round < 8 ? end : end < 9 ? end : 9);
            end -= count;
            write_range(s, &parts, end, end + count == m->face_count ? PSURF_NONE - end : count);
        }
        vertices = whole.span.vertex_count;
        assert_memory_equal(whole.p, parts.p, vertices * 3 * sizeof *whole.p);
        assert_memory_equal(whole.n, parts.n, vertices * 3 * sizeof *whole.n);
        assert_memory_equal(whole.where, parts.where, vertices * sizeof *whole.where);
        assert_memory_equal(whole.indices, parts.indices,
                            whole.span.index_count * sizeof *whole.indices);
        tess_free(&whole);
        tess_free(&parts);
    }
}

static void test_ranges(void **state)
{
    uint32_t scene;
    (void)state;
    for (scene = 0; scene < SCENES; scene++) {
        mesh m = make_scene_of(scene, 4);
        surface s;
        surface_build(&s, &m);
        expect_ranges(&m, &s);
        surface_free(&s);
        mesh_free(&m);
    }
}

/* Ranges that hold nothing, and outputs left out. */
static void test_empty_ranges(void **state)
{
    mesh m = make_creature();
    surface s;
    tess t;
    psurf_tess_out out;
    psurf_tess_span span;
    psurf_real p[3 * 64];
    uint32_t i;
    (void)state;
    surface_build(&s, &m);
    t = tessellate(&s, 4, PSURF_TESS_PER_FACE);
    memset(&out, 0, sizeof out);
    for (i = 0; i < 3; i++) {
        uint32_t first = i == 0 ? 3 : i == 1 ? m.face_count : PSURF_NONE, n = i ? PSURF_NONE : 0;
        assert_int_equal(psurf_tessellate_size(s.topology, &t.desc, first, n, &span), PSURF_OK);
        assert_int_equal(span.vertex_count + span.index_count, 0);
        assert_int_equal(psurf_tessellate(&s.patches, &t.desc, first, n, &out), PSURF_OK);
    }
    assert_int_equal(psurf_tessellate_size(s.topology, &t.desc, 2, 1, &span), PSURF_OK);
    out.p = p;
    out.first_vertex = span.first_vertex;
    out.first_index = span.first_index;
    assert_int_equal(psurf_tessellate(&s.patches, &t.desc, 2, 1, &out), PSURF_OK);
    assert_memory_equal(p, t.p + 3 * span.first_vertex, span.vertex_count * 3 * sizeof *p);
    tess_free(&t);
    surface_free(&s);
    mesh_free(&m);
}

/* 16-bit indices are the same numbers; 65535 vertices are possible, 65536 are not. */
static void test_index16(void **state)
{
    mesh m = make_creature(), cube = make_cube();
    surface s;
    tess t;
    psurf_tess_desc desc;
    psurf_tess_span span;
    psurf_tess_out out;
    uint16_t *narrow;
    uint32_t i, rate, first;
    (void)state;
    surface_build(&s, &m);
    t = tessellate(&s, 5, 0);
    memset(&out, 0, sizeof out);
    narrow = (uint16_t *)grab(t.span.index_count, sizeof *narrow);
    out.indices = narrow;
    desc = t.desc;
    desc.flags = PSURF_TESS_INDEX16;
    assert_int_equal(psurf_tessellate(&s.patches, &desc, 0, PSURF_NONE, &out), PSURF_OK);
    for (i = 0; i < t.span.index_count; i++) assert_int_equal(narrow[i], t.indices[i]);
    free(narrow);
    tess_free(&t);
    surface_free(&s);
    mesh_free(&m);
    /* a cube has 6 rate^2 + 2 vertices welded, 6 (rate + 1)^2 per face */
    surface_build(&s, &cube);
    memset(&desc, 0, sizeof desc);
    for (rate = 100; rate <= 108; rate++) {
        desc.rate = rate;
        desc.flags = PSURF_TESS_INDEX16;
        assert_int_equal(psurf_tessellate_size(s.topology, &desc, 0, PSURF_NONE, &span),
                         6 * rate * rate + 2 <= 65535 ? PSURF_OK : PSURF_TOO_LARGE);
        desc.flags |= PSURF_TESS_PER_FACE;
        assert_int_equal(psurf_tessellate_size(s.topology, &desc, 0, PSURF_NONE, &span),
                         6 * (rate + 1) * (rate + 1) <= 65535 ? PSURF_OK : PSURF_TOO_LARGE);
    }
    /* a face alone: numbers count from its own first vertex, if it is given */
    desc.rate = 254;                                            /* 255^2 = 65025 */
    first = 3;
    assert_int_equal(psurf_tessellate_size(s.topology, &desc, first, 1, &span), PSURF_OK);
    assert_int_equal(span.first_vertex, first * 65025);
    narrow = (uint16_t *)grab(span.index_count, sizeof *narrow);
    out.indices = narrow;
    out.first_index = span.first_index;
    assert_int_equal(psurf_tessellate(&s.patches, &desc, first, 1, &out), PSURF_TOO_LARGE);
    out.first_vertex = span.first_vertex;
    assert_int_equal(psurf_tessellate(&s.patches, &desc, first, 1, &out), PSURF_OK);
    for (i = rate = 0; i < span.index_count; i++) {
        assert_true(narrow[i] < span.vertex_count);
        rate = narrow[i] > rate ? narrow[i] : rate;
    }
    assert_int_equal(rate, span.vertex_count - 1);
    free(narrow);
    desc.rate = 255;                                            /* 256^2 = 65536 */
    assert_int_equal(psurf_tessellate_size(s.topology, &desc, 0, 1, &span), PSURF_TOO_LARGE);
    surface_free(&s);
    mesh_free(&cube);
}

/* ---- layouts of the output, groups of facets ------------------------------------------------- */

/* Where p and n go, in reals; distances from the start of one block of memory. */
enum { NOWHERE = -1, AFTER = -2 };              /* no such output; past the end of the other one */
typedef struct layout { int p, n; uint32_t p_stride, n_stride; } layout;

static const layout layouts[] = {
    {0, AFTER, 0, 0},           {0, 3, 6, 6},           {0, NOWHERE, 0, 0},
    {NOWHERE, 0, 0, 0},         {0, 3, 8, 8},           {2, 6, 10, 10},
    {3, 0, 6, 6},               {0, AFTER, 4, 7},       {0, NOWHERE, 8, 0},
    {NOWHERE, 0, 0, 5},         {0, AFTER, 6, 6},       {AFTER, 0, 0, 6},
    {0, 3, 24, 24},             {0, 3, 8, 16}
};

/* Reals of an output's elements and of all of them. */
static size_t layout_step(uint32_t stride) { return stride ? stride : 3; }

/* Puts what the range must write where a layout wants it. */
static void place_range(const tess *whole, const psurf_real *from, const psurf_tess_span *span,
                        uint32_t first, uint32_t count, psurf_real *to, size_t step)
{
    uint32_t i;
    if (!to) return;
    for (i = 0; i < span->vertex_count; i++) {
        const size_t vertex = (size_t)span->first_vertex + i;
        if (whole->where[vertex].face - first < count)  /* welded, others belong to other faces */
            memcpy(to + i * step, from + 3 * vertex, 3 * sizeof *to);
    }
}

/* A range in a layout: the bits of the whole in their places, and all else as it was, between the
   elements and round the arrays. */
static void expect_layout(const surface *s, const tess *whole, uint32_t first, uint32_t count,
                          const layout *l)
{
    enum { ROUND = 32 };                        /* reals on both sides that must stay */
    const size_t p_step = layout_step(l->p_stride), n_step = layout_step(l->n_stride);
    size_t size, i, p_at, n_at;
    psurf_real *want, *got;
    psurf_tess_span span;
    psurf_tess_out out;
    memset(&out, 0, sizeof out);
    assert_int_equal(psurf_tessellate_size(s->topology, &whole->desc, first, count, &span),
                     PSURF_OK);
    size = 2 * ROUND + (p_step + n_step) * span.vertex_count;
    p_at = l->p == AFTER ? ROUND + n_step * span.vertex_count : ROUND + (size_t)l->p;
    n_at = l->n == AFTER ? ROUND + p_step * span.vertex_count : ROUND + (size_t)l->n;
    want = (psurf_real *)grab(size, sizeof *want);
    got = (psurf_real *)grab(size, sizeof *got);
    for (i = 0; i < size; i++) want[i] = got[i] = -77;
    if (l->p != NOWHERE) {
        out.p = got + p_at;
        place_range(whole, whole->p, &span, first, count, want + p_at, p_step);
    }
    if (l->n != NOWHERE) {
        out.n = got + n_at;
        place_range(whole, whole->n, &span, first, count, want + n_at, n_step);
    }
    out.p_stride = l->p_stride * sizeof *got;
    out.n_stride = l->n_stride * sizeof *got;
    out.first_vertex = span.first_vertex;
    out.first_index = span.first_index;
    assert_int_equal(psurf_tessellate(&s->patches, &whole->desc, first, count, &out), PSURF_OK);
    for (i = 0; i < size && !memcmp(&want[i], &got[i], sizeof *got);) i++;
    REQUIRE(i == size, "real %u of %u: faces %u + %u, rate %u, flags %u, strides %u, %u\n",
            (unsigned)i, (unsigned)size, (unsigned)first, (unsigned)count,
            (unsigned)whole->desc.rate, (unsigned)whole->desc.flags, (unsigned)l->p_stride,
            (unsigned)l->n_stride);
    free(want);
    free(got);
}

/* Few faces, of every kind: fans of eight and more that begin at different corners, and faces that
   are split, of 3, 4 and more corners. */
static mesh make_few(void)
{
    mesh m = make_latlong(5, 2), part;
    uint64_t rng = 10;
    uint32_t k;
    mesh_take(&m, make_cylinder(3, 1), 8);
    mesh_take(&m, make_cylinder(5, 1), 12);
    mesh_take(&m, make_cylinder(7, 1), 16);
    part = make_cube();
    for (k = 0; k < 4; k++) mesh_hard(&part, part.faces[2].v[k], part.faces[2].v[(k + 1) % 4]);
    mesh_take(&m, part, 20);
    part = make_tetrahedron();
    for (k = 0; k < 3; k++) mesh_hard(&part, part.faces[1].v[k], part.faces[1].v[(k + 1) % 3]);
    mesh_take(&m, part, 24);
    mesh_jitter(&m, &rng, 0.0625);
    turn_corners(&m);
    return m;
}

static void test_few_has_all(void **state)
{
    mesh m = make_few();
    surface s;
    uint32_t f, kinds[PSURF_KIND_COUNT] = {0}, turns[3] = {0}, split[MESH_MAX_CORNERS] = {0};
    (void)state;
    surface_build(&s, &m);
    for (f = 0; f < m.face_count; f++) {
        const uint32_t facet = patch_of(&s, f);
        const uint32_t piece = ((const psurf_facet *)s.tables.facets.data)[facet].piece;
        const psurf_kind kind = psurf_get_patch(&s.patches, facet).kind;
        kinds[kind]++;
        if (kind == PSURF_POLAR) turns[piece >> 16 & 3]++;
        if (is_split(&s, f)) split[m.faces[f].size]++;
    }
    for (f = 0; f < PM_KINDS; f++) assert_true(kinds[f] >= 2);
    for (f = 0; f < 3; f++) assert_true(turns[f] >= 2);
    assert_true(kinds[PSURF_POLAR] >= 10);
    assert_true(split[3] && split[4] && split[7]);
    surface_free(&s);
    mesh_free(&m);
}

/* The layouts before count at one rate, of the whole and of ranges. */
static void expect_layouts(const surface *s, uint32_t rate, uint32_t count, uint32_t ranges,
                           uint64_t *rng)
{
    uint32_t flags, i, round;
    for (flags = 0; flags <= PSURF_TESS_PER_FACE; flags++) {
        tess whole = tessellate(s, rate, flags);
        for (i = 0; i < count; i++) {
            expect_layout(s, &whole, 0, s->info.faces, &layouts[i]);
            for (round = 0; round < ranges; round++) {
                const uint32_t first = random_below(rng, s->info.faces);
                expect_layout(s, &whole, first, 1 + random_below(rng, s->info.faces - first),
                              &layouts[i]);
            }
        }
        tess_free(&whole);
    }
}

static void test_layouts(void **state)
{
    static const uint32_t rates[] = {1, 2, 3, 4, 5, 8, 13, 16, 33, 64, 65, 70, 129};
    mesh few = make_few();
    surface s;
    uint64_t rng = 11;
    uint32_t i, scene;
    (void)state;
    for (scene = 0; scene < SCENES; scene++) {
        mesh m = make_scene_of(scene, 11);
        surface_build(&s, &m);
        expect_layouts(&s, 5, COUNT_OF(layouts), 3, &rng);
        surface_free(&s);
        mesh_free(&m);
    }
    surface_build(&s, &few);
    for (i = 0; i < COUNT_OF(rates); i++) {
        const int coarse = rates[i] < 33;
        expect_layouts(&s, rates[i], coarse ? COUNT_OF(layouts) : 4, coarse ? 3 : 1, &rng);
    }
    surface_free(&s);
    mesh_free(&few);
}

/* Meshes of one kind of patch, more faces than a group takes, and one of split faces. */
enum { UNIFORM = 6 };
static mesh make_uniform(uint32_t which)
{
    mesh m = which == 0   ? make_torus(5, 4)
             : which == 1 ? make_latlong(11, 1)
             : which == 2 ? make_triangle_ball(5)
             : which == 3 ? make_cube()
             : which == 4 ? make_dodecahedron()
                          : make_polygon(9);
    uint32_t k;
    uint64_t rng = 12 + which;
    for (k = 1; k < 10 && which == 5; k++) mesh_take(&m, make_polygon(6 + k % 5), 4.0 * k);
    for (k = 1; k < 3 && which == 3; k++) mesh_take(&m, make_cube(), 4.0 * k);
    mesh_jitter(&m, &rng, 0.0625);
    turn_corners(&m);
    return m;
}

/* However many facets meet in a group, and in whichever lanes: 1 to 9, and 10 in a call. */
static void test_groups(void **state)
{
    static const uint32_t rates[] = {1, 3, 8};
    uint32_t which, i, flags, first, count;
    (void)state;
    for (which = 0; which < UNIFORM; which++) {
        mesh m = make_uniform(which);
        surface s;
        surface_build(&s, &m);
        if (which < PM_KINDS) assert_int_equal(s.info.kind_faces[which], m.face_count);
        assert_true(m.face_count >= 10);
        for (i = 0; i < COUNT_OF(rates) * 2; i++) {
            tess whole;
            flags = i & 1;
            whole = tessellate(&s, rates[i / 2], flags);
            for (count = 1; count <= 10; count++)
                for (first = 0; first + count <= m.face_count; first += 1 + which % 2)
                    expect_layout(&s, &whole, first, count, &layouts[(first + count) % 4]);
            tess_free(&whole);
        }
        surface_free(&s);
        mesh_free(&m);
    }
}

/* ---- neighbours in a group ------------------------------------------------------------------- */

typedef enum defect {
    CREASED, NOT_A_NUMBER, INFINITE, IN_A_POINT, ON_A_LINE, TINY, HUGE_, DEFECTS
} defect;

/* Shuffles the faces. */
static void mesh_shuffle(mesh *m, uint64_t *rng)
{
    uint32_t i, k;
    for (i = m->face_count; i > 1; i--) {
        mesh_face_data swap = m->faces[i - 1];
        m->faces[i - 1] = m->faces[k = random_below(rng, i)];
        m->faces[k] = swap;
    }
}

/* Blend ratios for some edges at the vertices before count. */
static void tag_some(mesh *m, uint32_t count, uint64_t *rng)
{
    uint32_t f, k;
    for (f = 0; f < m->face_count; f++)
        for (k = 0; k < m->faces[f].size; k++)
            if (m->faces[f].v[k] < count && random_below(rng, 4) == 0)
                mesh_tag(m, m->faces[f].v[k], m->faces[f].v[(k + 1) % m->faces[f].size], 0.25,
                         random_below(rng, 2) / 2.0);
}

/* Spoils what the tags mark, or the vertices before count. */
static void spoil(mesh *m, surface *s, defect what, uint32_t count)
{
    uint32_t i;
    for (i = 0; i < m->tag_count && what == CREASED; i++) m->tags[i].blend0 = 0;
    surface_build(s, m);
    if (what == NOT_A_NUMBER) s->positions[0] = (psurf_real)NAN;
    if (what == INFINITE) s->positions[1] = (psurf_real)INFINITY;
    for (i = 0; i < 3 * count; i++) {
        psurf_real *x = &s->positions[i];
        if (what == IN_A_POINT || (what == ON_A_LINE && i % 3)) *x = 1;
        if (what == TINY) *x *= (psurf_real)(IS_DOUBLE ? 1e-90 : 1e-15);
        if (what == HUGE_) *x *= (psurf_real)(IS_DOUBLE ? 1e60 : 1e9);
    }
    assert_int_equal(psurf_construct(&s->patches, &s->construct), PSURF_OK);
}

static uint32_t count_faces(const mesh *m, uint32_t below)
{
    uint32_t f, n = 0;
    for (f = 0; f < m->face_count; f++) n += m->faces[f].v[0] < below;
    return n;
}

/* What became of the spoilt faces: non-finite results, normals that are zero. */
static void expect_spoilt(const tess *t, const mesh *m, uint32_t below, defect what)
{
    uint32_t i, nonfinite = 0, flat = 0, all = 0;
    for (i = 0; i < t->span.vertex_count; i++) {
        const vec p = load(t->p + 3 * i), n = load(t->n + 3 * i);
        if (m->faces[t->where[i].face].v[0] >= below) {
            assert_true(is_finite_vec(p) && fabs(length(n) - 1) < 1e-5);
            continue;
        }
        all++;
        nonfinite += !is_finite_vec(p);
        flat += length(n) == 0;
        if (what == CREASED || what == TINY || what == HUGE_)
            assert_true(is_finite_vec(p) && fabs(length(n) - 1) < 1e-5);
    }
    assert_true(all > 0);
    assert_true((nonfinite > 0) == (what == NOT_A_NUMBER || what == INFINITE));
    if (what == IN_A_POINT || what == ON_A_LINE) assert_int_equal(flat, all);
}

/* Faces that share groups with spoilt ones have the bits they have among their like; and the spoilt
   ones those they have alone. */
static void test_neighbours(void **state)
{
    uint64_t rng = 13;
    uint32_t which, what, f, i;
    (void)state;
    for (which = 0; which < UNIFORM; which++)
        for (what = 0; what < DEFECTS; what++) {
            mesh m = make_uniform(which), twin = make_uniform(which);
            const uint32_t below = m.vertex_count;
            surface healthy, spoilt;
            tess a, b;
            mesh_take(&m, twin, 8.0 * 8);
            mesh_shuffle(&m, &rng);
            assert_int_equal(2 * count_faces(&m, below), m.face_count);
            tag_some(&m, below, &rng);
            surface_build(&healthy, &m);
            spoil(&m, &spoilt, (defect)what, below);
            a = tessellate(&healthy, 6, PSURF_TESS_PER_FACE);
            b = tessellate(&spoilt, 6, PSURF_TESS_PER_FACE);
            expect_spoilt(&b, &m, below, (defect)what);
            for (i = 0; i < b.span.vertex_count; i++) {
                if (m.faces[b.where[i].face].v[0] < below) continue;
                REQUIRE(same_bits(a.p + 3 * i, b.p + 3 * i)
                            && same_bits(a.n + 3 * i, b.n + 3 * i),
                        "mesh %u, defect %u, face %u\n", (unsigned)which, (unsigned)what,
                        (unsigned)b.where[i].face);
            }
            for (f = 0; f < m.face_count; f++)
                expect_layout(&spoilt, &b, f, 1, &layouts[f % 4]);
            tess_free(&a);
            tess_free(&b);
            surface_free(&healthy);
            surface_free(&spoilt);
            mesh_free(&m);
        }
}

/* ---- psurf_check ----------------------------------------------------------------------------- */

/* Number, in a per-face tessellation, of the sample k of rate on edge i of a face. */
static uint32_t edge_vertex(uint32_t size, uint32_t rate, uint32_t i, uint32_t k)
{
    uint32_t n = rate + 1;
    if (k == rate) return edge_vertex(size, rate, (i + 1) % size, 0);
    if (size == 4)
        return i == 0 ? k : i == 1 ? k * n + rate : i == 2 ? rate * n + rate - k : (rate - k) * n;
    if (size == 3)                              /* row y begins at y n - y (y - 1) / 2 */
        return i == 0 ? k : i == 1 ? k * n - k * (k - 1) / 2 + rate - k
                                   : (rate - k) * n - (rate - k) * (rate - k - 1) / 2;
    return i * rate * n / 2 + k;
}

typedef struct gaps { uint64_t samples, cracks; double angle; } gaps;

/* The comparison that psurf_check makes, done again on per-face output. */
static gaps compare_edges_of(const surface *s, const mesh *m, uint32_t rate)
{
    tess t = tessellate(s, rate, PSURF_TESS_PER_FACE);
    edge_map map = map_edges(m);
    uint32_t *first = (uint32_t *)grab(m->face_count, sizeof *first), f, i, k, vertex = 0;
    gaps g;
    memset(&g, 0, sizeof g);
    for (f = 0; f < m->face_count; f++) {
        first[f] = vertex;
        vertex += vertices_of_face(m->faces[f].size, rate);
    }
    for (i = 0; i < map.count; i++) {
        const half_edge *a = &map.edges[i], *b = find_edge(&map, a->to, a->from);
        int hard = mesh_is_hard(m, a->from, a->to);
        if (!b || a->from > a->to) continue;
        for (k = 0; k <= rate; k++) {
            uint32_t va = first[a->face] + edge_vertex(m->faces[a->face].size, rate, a->corner, k);
            uint32_t vb = first[b->face]
                        + edge_vertex(m->faces[b->face].size, rate, b->corner, rate - k);
            g.samples++;
            g.cracks += !same_bits(t.p + 3 * va, t.p + 3 * vb);
            if (hard) continue;
            g.angle = fmax(g.angle, angle_between(load(t.n + 3 * va), load(t.n + 3 * vb)));
        }
    }
    free(first);
    free(map.edges);
    tess_free(&t);
    return g;
}

static psurf_check_result check(const surface *s, uint32_t rate)
{
    psurf_check_result r;
    memset(&r, 0xEE, sizeof r);
    assert_int_equal(psurf_check(&s->patches, &s->construct, rate, 0, PSURF_NONE, &r), PSURF_OK);
    return r;
}

/* No cracks at any rate, and psurf_check sees what a comparison of the output sees. */
static void expect_no_cracks(const mesh *m, const surface *s)
{
    const uint32_t pairs = s->info.edges - s->info.boundary_edges;
    uint32_t rate;
    for (rate = 1; rate <= 33; rate++) {
        gaps own = compare_edges_of(s, m, rate);
        psurf_check_result r = check(s, rate);
        assert_int_equal(own.cracks, 0);
        assert_int_equal(r.cracks, 0);
        assert_int_equal(r.samples, own.samples);
        assert_int_equal(r.samples, (uint64_t)pairs * (rate + 1));
        assert_int_equal(r.nonfinite + r.degenerate, 0);
        assert_int_equal(r.sharp_edges, s->info.hard_edges);
        assert_true(fabs(r.max_normal_deg - own.angle * 180 / PI)
                    < (IS_DOUBLE ? 1e-12 : 3e-5));     /* lengths are 1 to rounding */
        assert_true(r.max_normal_deg < (IS_DOUBLE ? 1e-8 : 0.01));
    }
}

static void test_no_cracks(void **state)
{
    uint32_t scene, k;
    (void)state;
    for (scene = 0; scene < SCENES; scene++) {
        mesh m = make_scene_of(scene, 5);
        surface s;
        surface_build(&s, &m);
        expect_no_cracks(&m, &s);
        surface_free(&s);
        if (scene) {
            psurf_real *blends;                         /* other ratios, given for the frame */
            uint64_t rng = 5;
            surface_build(&s, &m);
            blends = (psurf_real *)grab(s.info.spokes, sizeof *blends);
            for (k = 0; k < s.info.spokes; k++)
                blends[k] = (psurf_real)(0.25 + random_unit(&rng) / 2);
            s.construct.blends = blends;
            assert_int_equal(psurf_construct(&s.patches, &s.construct), PSURF_OK);
            expect_no_cracks(&m, &s);
            free(blends);
            surface_free(&s);
        }
        mesh_free(&m);
    }
}

/* One bit of one patch changed: both see it, at the same samples. */
static void test_cracks_are_found(void **state)
{
    mesh m = make_scene(6);
    surface s;
    uint64_t rng = 6;
    uint32_t k;
    (void)state;
    surface_build(&s, &m);
    for (k = 0; k < s.info.facets; k += 5) {
        psurf_patch patch = psurf_get_patch(&s.patches, k);
        size_t at = (size_t)((const char *)(const void *)patch.points - s.memory);
        unsigned char *real = (unsigned char *)s.memory + at;   /* the first point is a corner */
        uint32_t axis = random_below(&rng, 3), one = 1;
        unsigned char *low = real + axis * sizeof(psurf_real)
                           + (*(unsigned char *)&one ? 0 : sizeof(psurf_real) - 1);
        gaps own;
        psurf_check_result r;
        *low ^= 1;
        own = compare_edges_of(&s, &m, 4);
        r = check(&s, 4);
        assert_true(own.cracks >= 2);                   /* two edges end in that corner */
        assert_int_equal(r.cracks, own.cracks);
        *low ^= 1;
    }
    assert_int_equal(check(&s, 4).cracks, 0);
    surface_free(&s);
    mesh_free(&m);
}

/* Ranges add up; the worst place is one of the mesh; what must be left out is. */
static void test_check_accounts(void **state)
{
    mesh m = make_scene(7), cube = make_cube();
    surface s;
    psurf_check_result whole, part;
    uint64_t samples = 0;
    uint32_t e;
    double worst = 0;
    (void)state;
    surface_build(&s, &m);
    whole = check(&s, 6);
    for (e = 0; e < s.info.edges; e += 7) {
        assert_int_equal(psurf_check(&s.patches, &s.construct, 6, e, 7, &part), PSURF_OK);
        samples += part.samples;
        worst = fmax(worst, part.max_normal_deg);
    }
    assert_int_equal(samples, whole.samples);
    assert_true(worst == whole.max_normal_deg);
    assert_true(whole.worst_face < m.face_count && whole.worst_edge < s.info.edges);
    e = whole.worst_edge;
    assert_int_equal(psurf_check(&s.patches, &s.construct, 6, e, 1, &part), PSURF_OK);
    assert_true(part.max_normal_deg == whole.max_normal_deg);
    assert_int_equal(part.worst_face, whole.worst_face);
    assert_int_equal(psurf_check(&s.patches, &s.construct, 6, s.info.edges, 1, &part), PSURF_OK);
    assert_int_equal(part.samples, 0);
    assert_int_equal(part.worst_face & part.worst_edge, PSURF_NONE);
    /* a non-finite position is counted, not compared */
    s.positions[0] = (psurf_real)NAN;
    assert_int_equal(psurf_construct(&s.patches, &s.construct), PSURF_OK);
    part = check(&s, 6);
    assert_true(part.nonfinite > 0 && part.nonfinite < part.samples);
    assert_true(part.max_normal_deg <= whole.max_normal_deg * 2);
    surface_free(&s);
    /* blend ratio 0: edges that are sharp at one end, whichever that is */
    mesh_tag(&cube, 0, 1, 0, 1);
    mesh_tag(&cube, 6, 7, 1, 0);
    mesh_tag(&cube, 2, 6, 0.01, 0.01);
    surface_build(&s, &cube);
    part = check(&s, 6);
    assert_int_equal(part.sharp_edges, 2);
    assert_int_equal(part.samples, 12 * 7);
    surface_free(&s);
    /* a face with a corner of no angle: what lies beside it is degenerate */
    cube.tag_count = 0;
    cube.positions[1] = mad(cube.positions[0], 1e-7, sub(cube.positions[1], cube.positions[0]));
    surface_build(&s, &cube);
    part = check(&s, 6);
    assert_true(part.degenerate > 0 && part.cracks == 0);
    surface_free(&s);
    mesh_free(&cube);
    mesh_free(&m);
}

/* Boxes hold what is evaluated, and are not much too large. */
static void test_bounds_of_pieces(void **state)
{
    mesh m = make_marked();
    surface s;
    uint64_t rng = 9;
    uint32_t f, i, k;
    psurf_real *boxes;
    tess t;
    (void)state;
    surface_build(&s, &m);
    boxes = (psurf_real *)grab((size_t)m.face_count * 6, sizeof *boxes);
    psurf_bounds(&s.patches, 0, m.face_count, boxes);
    t = tessellate(&s, 13, PSURF_TESS_PER_FACE);
    for (i = 0; i < t.span.vertex_count; i++)
        for (k = 0; k < 3; k++) {
            const psurf_real *box = boxes + 6 * (size_t)t.where[i].face;
            assert_true(t.p[3 * i + k] >= box[k] && t.p[3 * i + k] <= box[3 + k]);
        }
    for (f = 0; f < m.face_count; f++) {
        double reach = 0, size = 0;
        const psurf_real *box = boxes + 6 * (size_t)f;
        vec p, middle;
        for (k = 0; k < 200; k++) {
            p = eval_at(&s.patches, random_sample_of(&m, f, &rng)).p;
            if (k == 0) middle = p;
            reach = fmax(reach, distance(p, middle));
            assert_true(p.x >= box[0] && p.y >= box[1] && p.z >= box[2]);
            assert_true(p.x <= box[3] && p.y <= box[4] && p.z <= box[5]);
        }
        size = distance(load(box), load(box + 3));
        REQUIRE(size < 4 * reach, "face %u: box %g, reach %g\n", (unsigned)f, size, reach);
    }
    tess_free(&t);
    free(boxes);
    surface_free(&s);
    mesh_free(&m);
}

/* ---- all at once ----------------------------------------------------------------------------- */

static void test_smooth_call(void **state)
{
    mesh m = make_scene(8);
    surface s;
    uint32_t rate;
    (void)state;
    mesh_take(&m, make_marked(), 24);
    mesh_tag(&m, m.faces[0].v[0], m.faces[0].v[1], 0.25f, 0.5f);
    surface_build(&s, &m);
    for (rate = 1; rate <= 6; rate++) {
        tess t = tessellate(&s, rate, 0);
        psurf_smooth_mesh out;
        psurf_error error;
        assert_int_equal(psurf_smooth(&s.desc, rate, &out, &error), PSURF_OK);
        assert_int_equal(error.result, PSURF_OK);
        assert_int_equal(out.vertex_count, t.span.vertex_count);
        assert_int_equal(out.index_count, t.span.index_count);
        assert_memory_equal(out.positions, t.p, (size_t)out.vertex_count * 3 * sizeof(psurf_real));
        assert_memory_equal(out.normals, t.n, (size_t)out.vertex_count * 3 * sizeof(psurf_real));
        assert_memory_equal(out.where, t.where, out.vertex_count * sizeof(psurf_sample));
        assert_memory_equal(out.indices, t.indices, out.index_count * sizeof(uint32_t));
        psurf_smooth_free(&out);
        tess_free(&t);
    }
    surface_free(&s);
    mesh_free(&m);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_welded),           cmocka_unit_test(test_per_face_equals_welded),
        cmocka_unit_test(test_where),            cmocka_unit_test(test_numbering),
        cmocka_unit_test(test_ranges),
        cmocka_unit_test(test_empty_ranges),     cmocka_unit_test(test_index16),
        cmocka_unit_test(test_few_has_all),      cmocka_unit_test(test_layouts),
        cmocka_unit_test(test_groups),           cmocka_unit_test(test_neighbours),
        cmocka_unit_test(test_no_cracks),        cmocka_unit_test(test_cracks_are_found),
        cmocka_unit_test(test_check_accounts),   cmocka_unit_test(test_bounds_of_pieces),
        cmocka_unit_test(test_smooth_call)};
    return cmocka_run_group_tests_name("tessellate", tests, NULL, NULL);
}
