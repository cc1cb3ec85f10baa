/* Counts, classes and tables of the topology against a second reading of the mesh (edge_map and
   classify_faces of common.h), and against the rules written in the header. */
#include "common.h"

static const psurf_ring *rings_of(const surface *s)
{
    return (const psurf_ring *)s->tables.rings.data;
}
static const psurf_spoke *spokes_of(const surface *s)
{
    return (const psurf_spoke *)s->tables.spokes.data;
}
static const psurf_corner *corners_of(const surface *s)
{
    return (const psurf_corner *)s->tables.corners.data;
}
static const psurf_facet *facets_of(const surface *s)
{
    return (const psurf_facet *)s->tables.facets.data;
}
static const psurf_edge *edges_of(const surface *s)
{
    return (const psurf_edge *)s->tables.edges.data;
}

static uint32_t sides_of(psurf_kind kind)
{
    static const uint32_t sides[PSURF_KIND_COUNT] = {4, 3, 3, 4, 5};
    return sides[kind];
}

static psurf_kind kind_of_facet(const surface *s, uint32_t facet)
{
    uint32_t k = 0;
    while (facet >= s->tables.kind_first[k + 1]) k++;
    return (psurf_kind)k;
}

static uint32_t first_corner_of(const surface *s, uint32_t facet)
{
    psurf_kind kind = kind_of_facet(s, facet);
    return s->tables.kind_first_corner[kind]
         + (facet - s->tables.kind_first[kind]) * sides_of(kind);
}

/* The tables lie in one block, each at a multiple of 256 bytes, without overlap. */
static void check_block(const psurf_tables *t)
{
    const psurf_table *tables[8];
    size_t i, k;
    tables[0] = &t->rings, tables[1] = &t->spokes, tables[2] = &t->corners, tables[3] = &t->facets;
    tables[4] = &t->edges, tables[5] = &t->trig, tables[6] = &t->blends, tables[7] = &t->face_facet;
    for (i = 0; i < 8; i++) {
        size_t at = (size_t)((const char *)tables[i]->data - (const char *)t->block);
        size_t bytes = (size_t)tables[i]->count * tables[i]->stride;
        if (!tables[i]->count) continue;
        assert_int_equal(at % 256, 0);
        assert_true(at + bytes <= t->block_bytes);
        for (k = 0; k < i; k++) {
            size_t other = (size_t)((const char *)tables[k]->data - (const char *)t->block);
            assert_true(!tables[k]->count || at >= other
                        + (size_t)tables[k]->count * tables[k]->stride || at + bytes <= other);
        }
    }
}

/* Strides are the structs', every table is as long as its count says, sections follow each
   other. */
static void check_shapes(const surface *s, const mesh *m)
{
    const psurf_tables *t = &s->tables;
    uint32_t k, corners = 0;
    for (k = 0; k < m->face_count; k++) corners += m->faces[k].size;
    assert_int_equal(t->rings.stride, sizeof(psurf_ring));
    assert_int_equal(t->spokes.stride, sizeof(psurf_spoke));
    assert_int_equal(t->corners.stride, sizeof(psurf_corner));
    assert_int_equal(t->facets.stride, sizeof(psurf_facet));
    assert_int_equal(t->edges.stride, sizeof(psurf_edge));
    assert_int_equal(t->trig.stride, sizeof(psurf_trig));
    assert_int_equal(t->face_facet.stride, sizeof(uint32_t));
    assert_int_equal(t->rings.count, s->info.rings);
    assert_int_equal(t->spokes.count, s->info.spokes);
    assert_int_equal(t->facets.count, s->info.facets);
    assert_int_equal(t->edges.count, s->info.edges);
    assert_int_equal(t->corners.count, corners);
    assert_int_equal(t->face_facet.count, m->face_count);
    assert_int_equal(t->version, PSURF_TABLE_VERSION);
    check_block(t);
    assert_int_equal(t->kind_first[0], 0);
    assert_int_equal(t->kind_first_corner[0], 0);
    for (k = 0; k < PSURF_KIND_COUNT; k++)
        assert_int_equal(t->kind_first_corner[k + 1] - t->kind_first_corner[k],
                         (t->kind_first[k + 1] - t->kind_first[k]) * sides_of((psurf_kind)k));
    assert_int_equal(t->kind_first[PSURF_KIND_COUNT], s->info.facets);
    assert_int_equal(t->kind_first_corner[PSURF_KIND_COUNT], corners);
}

static void check_info(const surface *s, const mesh *m, const edge_map *map, const psurf_kind *kind)
{
    uint32_t kinds[PSURF_KIND_COUNT] = {0}, k, largest = 0;
    for (k = 0; k < m->face_count; k++) kinds[kind[k]]++;
    for (k = 0; k < m->vertex_count; k++)
        if (valence_of(map, k) > largest) largest = valence_of(map, k);
    assert_int_equal(s->info.vertices, m->vertex_count);
    assert_int_equal(s->info.faces, m->face_count);
    assert_int_equal(s->info.edges, map->count / 2);
    assert_int_equal(s->info.spokes, map->count);
    assert_int_equal(s->info.facets, m->face_count);
    assert_int_equal(s->info.boundary_edges, 0);
    assert_int_equal(s->info.hard_edges, 0);
    assert_int_equal(s->info.ngon_faces, 0);
    assert_int_equal(s->info.valence2, 0);
    assert_int_equal(s->info.max_valence, largest);
    for (k = 0; k < PSURF_KIND_COUNT; k++) assert_int_equal(s->info.kind_faces[k], kinds[k]);
    assert_true(s->info.bytes > 0 && s->info.peak_bytes >= s->info.bytes);
}

/* Facets: by kind, then by face; the face finds its facet; the pole of a polar one is opposite to
   its corner A. */
static void check_facets(const surface *s, const mesh *m, const psurf_kind *kind)
{
    uint32_t i, k;
    for (i = 0; i < s->info.facets; i++) {
        psurf_facet facet = facets_of(s)[i];
        psurf_patch patch = psurf_get_patch(&s->patches, i);
        uint32_t a = facet.piece >> 16 & 3, c = first_corner_of(s, i), poles = 0;
        assert_true(facet.face < m->face_count);
        assert_int_equal(kind_of_facet(s, i), kind[facet.face]);
        assert_int_equal(patch_of(s, facet.face), i);
        assert_int_equal(facet.piece & 0xFFFF, 0);
        assert_int_equal(patch.face, facet.face);
        assert_int_equal(patch.kind, kind[facet.face]);
        assert_int_equal(patch.sector, 0);
        if (i && kind_of_facet(s, i - 1) == kind_of_facet(s, i))
            assert_true(facets_of(s)[i - 1].face < facet.face);
        for (k = 0; k < m->faces[facet.face].size; k++) {
            const psurf_ring *ring = &rings_of(s)[corners_of(s)[c + k].ring & ~PSURF_WRITER];
            if (kind[facet.face] == PSURF_POLAR && (ring->valence & PSURF_RING_POLAR)) {
                poles++;
                assert_int_equal((a + 2) % 3, k);
            }
        }
        assert_int_equal(poles, kind[facet.face] == PSURF_POLAR);
    }
}

/* Corners: their ring is that of the corner's vertex, their spoke runs along the edge to the next
   corner, their edge is shared with the face beyond. One facet writes each ring and each edge, and
   it is that of the lowest face. */
static void check_corners(const surface *s, const mesh *m, const edge_map *map)
{
    uint32_t *ring_writer = (uint32_t *)grab(s->info.rings, 4);
    uint32_t *edge_writer = (uint32_t *)grab(s->info.edges, 4);
    uint32_t *ring_low = (uint32_t *)grab(s->info.rings, 4), i, f, k;
    memset(ring_low, 0xFF, s->info.rings * sizeof *ring_low);
    for (f = 0; f < m->face_count; f++) {
        uint32_t size = m->faces[f].size, c = first_corner_of(s, patch_of(s, f));
        for (k = 0; k < size; k++) {
            psurf_corner corner = corners_of(s)[c + k];
            uint32_t ring = corner.ring & ~PSURF_WRITER, edge = corner.edge & ~PSURF_WRITER;
            uint32_t v = m->faces[f].v[k], next = m->faces[f].v[(k + 1) % size];
            const half_edge *twin = find_edge(map, next, v);
            uint32_t other = first_corner_of(s, patch_of(s, twin->face)) + twin->corner;
            uint32_t before = m->faces[f].v[(k + size - 1) % size];
            const psurf_ring *r = &rings_of(s)[ring];
            uint32_t valence = r->valence & PSURF_RING_VALENCE, j = corner.spoke - r->first_spoke;
            assert_true(ring < s->info.rings && edge < s->info.edges && j < valence);
            assert_int_equal(r->point, v);
            /* the facet of a spoke lies between it and the next: that is this face */
            assert_int_equal(spokes_of(s)[corner.spoke].end, next);
            assert_int_equal(spokes_of(s)[corner.spoke].after, m->faces[f].v[(k + 2) % size]);
            assert_int_equal(spokes_of(s)[corner.spoke].before,
                             m->faces[f].v[(k + size - 2) % size]);
            assert_int_equal(spokes_of(s)[r->first_spoke + (j + 1) % valence].end, before);
            assert_true((edges_of(s)[edge].corner == c + k && edges_of(s)[edge].other == other)
                        || (edges_of(s)[edge].corner == other && edges_of(s)[edge].other == c + k));
            assert_int_equal(corners_of(s)[other].edge & ~PSURF_WRITER, edge);
            assert_int_equal((corner.edge & PSURF_WRITER) != 0, edges_of(s)[edge].corner == c + k);
            if (corner.edge & PSURF_WRITER) {
                edge_writer[edge]++;
                assert_true(f < twin->face);
            }
            if (f < ring_low[ring]) ring_low[ring] = f;
            if (corner.ring & PSURF_WRITER) {
                ring_writer[ring]++;
                assert_int_equal(ring_low[ring], f);
            }
        }
    }
    for (i = 0; i < s->info.rings; i++) assert_int_equal(ring_writer[i], 1);
    for (i = 0; i < s->info.edges; i++) assert_int_equal(edge_writer[i], 1);
    free(ring_writer);
    free(edge_writer);
    free(ring_low);
}

/* Rows of the trig table: scales, then cos and sin of j/n turns. */
static void check_rings(const surface *s)
{
    const psurf_trig *trig = (const psurf_trig *)s->tables.trig.data;
    const long double turn = 2 * 3.14159265358979323846264338L;
    double limit = IS_DOUBLE ? 2.3e-16 : 6e-8;
    uint32_t i, j, spokes = 0;
    for (i = 0; i < s->info.rings; i++) {
        const psurf_ring *r = &rings_of(s)[i];
        uint32_t n = r->valence & PSURF_RING_VALENCE;
        spokes += n;
        assert_true(r->first_spoke + n <= s->info.spokes);
        assert_true(r->trig + 1 + n <= s->tables.trig.count);
        for (j = 0; j < n; j++) {
            psurf_trig row = trig[r->trig + 1 + j];
            assert_true(fabs((double)(row.c - cosl(turn * j / n))) < limit);
            assert_true(fabs((double)(row.s - sinl(turn * j / n))) < limit);
        }
    }
    assert_int_equal(spokes, s->info.spokes);
}

static void check_find_spoke(const surface *s, const mesh *m, const edge_map *map)
{
    uint64_t rng = 1;
    uint32_t i, found;
    for (i = 0; i < map->count; i++) {
        found = psurf_find_spoke(s->topology, map->edges[i].from, map->edges[i].to);
        assert_true(found < s->info.spokes);
        assert_int_equal(spokes_of(s)[found].end, map->edges[i].to);
        assert_int_equal(corners_of(s)[first_corner_of(s, patch_of(s, map->edges[i].face))
                                       + map->edges[i].corner].spoke, found);
    }
    for (i = 0; i < 100; i++) {
        uint32_t a = random_below(&rng, m->vertex_count), b = random_below(&rng, m->vertex_count);
        found = psurf_find_spoke(s->topology, a, b);
        assert_int_equal(found == PSURF_NONE, find_edge(map, a, b) == NULL);
    }
    assert_int_equal(psurf_find_spoke(s->topology, 0, m->vertex_count), PSURF_NONE);
    assert_int_equal(psurf_find_spoke(s->topology, PSURF_NONE, 0), PSURF_NONE);
    assert_int_equal(psurf_find_spoke(s->topology, 0, 0), PSURF_NONE);
}

static void check_topology(const mesh *m)
{
    surface s;
    edge_map map = map_edges(m);
    psurf_kind *kind = classify_faces(m);
    surface_build(&s, m);
    check_shapes(&s, m);
    check_info(&s, m, &map, kind);
    check_facets(&s, m, kind);
    check_corners(&s, m, &map);
    check_rings(&s);
    check_find_spoke(&s, m, &map);
    surface_free(&s);
    free(kind);
    free(map.edges);
}

static void test_tables(void **state)
{
    uint64_t rng = 2;
    uint32_t k, n;
    mesh m;
    (void)state;
    for (n = 3; n <= 12; n++) {
        mesh balls[3];
        balls[0] = make_latlong(n, 1), balls[1] = make_latlong(n, 4);
        balls[2] = make_triangle_ball(n);
        for (k = 0; k < 3; k++) {
            check_topology(&balls[k]);
            mesh_free(&balls[k]);
        }
    }
    m = make_creature();
    check_topology(&m);
    mesh_free(&m);
    for (k = 0; k < 40; k++) {
        uint32_t i, j;
        m = make_random_spindle(&rng, k % 4 * 30, 9);
        mesh_scramble(&m, &rng, k % 10);
        /* faces in random order, begun at random corners */
        for (i = 0; i < m.face_count; i++) {
            mesh_face_data f = m.faces[i], *other = &m.faces[random_below(&rng, m.face_count)];
            uint32_t turn = random_below(&rng, f.size);
            for (j = 0; j < f.size; j++) m.faces[i].v[j] = f.v[(j + turn) % f.size];
            f = m.faces[i];
            m.faces[i] = *other;
            *other = f;
        }
        check_topology(&m);
        mesh_free(&m);
    }
}

/* Kinds where the definition can be read off by eye. */
static void test_known_counts(void **state)
{
    static const struct { const char *name; uint32_t counts[3 + PM_KINDS]; } want[] = {
        {"tetrahedron", {4, 4, 6, 0, 0, 4, 0, 0}},
        {"cube", {8, 6, 12, 0, 0, 0, 6, 0}},
        {"octahedron, poles tie", {6, 8, 12, 0, 0, 8, 0, 0}},
        {"bipyramid of 5", {7, 10, 15, 0, 10, 0, 0, 0}},
        {"icosahedron", {12, 20, 30, 0, 0, 20, 0, 0}},
        {"dodecahedron", {20, 12, 30, 0, 0, 0, 0, 12}},
        {"ball", {26, 32, 56, 16, 16, 0, 0, 0}},
        {"torus", {48, 48, 96, 48, 0, 0, 0, 0}}};
    mesh m[COUNT_OF(want)];
    uint32_t i, k;
    (void)state;
    m[0] = make_tetrahedron(), m[1] = make_cube(), m[2] = make_latlong(4, 1);
    m[3] = make_latlong(5, 1), m[4] = make_triangle_ball(5), m[5] = make_dodecahedron();
    m[6] = make_latlong(8, 3), m[7] = make_torus(8, 6);
    for (i = 0; i < COUNT_OF(want); i++) {
        surface s;
        surface_build(&s, &m[i]);
        print_message("%s\n", want[i].name);
        assert_int_equal(s.info.vertices, want[i].counts[0]);
        assert_int_equal(s.info.faces, want[i].counts[1]);
        assert_int_equal(s.info.edges, want[i].counts[2]);
        for (k = 0; k < PM_KINDS; k++)
            assert_int_equal(s.info.kind_faces[k], want[i].counts[3 + k]);
        assert_int_equal(s.info.components, 1);
        surface_free(&s);
        mesh_free(&m[i]);
    }
}

/* ---- boundaries, hard edges, split faces ----------------------------------------------------- */

static uint32_t ring_at(const surface *s, uint32_t face, uint32_t corner)
{
    uint32_t facet = patch_of(s, face), at = first_corner_of(s, facet) + corner;
    if (facets_of(s)[facet].piece & PSURF_SPLIT_FACE)
        at = first_corner_of(s, facet + corner);
    return corners_of(s)[at].ring & ~PSURF_WRITER;
}

/* Sharp edges of a vertex, boundaries and hard ones; how many of them are boundaries. */
static uint32_t count_sharp(const mesh *m, const edge_map *map, uint32_t v, uint32_t *boundary)
{
    uint32_t i, sharp = 0;
    *boundary = 0;
    for (i = 0; i < map->count; i++) {
        const half_edge *e = &map->edges[i];
        int open = !find_edge(map, e->to, e->from);
        if (e->from == v || (open && e->to == v)) sharp += open || mesh_is_hard(m, e->from, e->to);
        *boundary += open && (e->from == v || e->to == v);
    }
    return sharp;
}

static int is_flagged(const mesh *m, uint32_t v)
{
    uint32_t i;
    for (i = 0; i < m->corner_count; i++)
        if (m->corners[i] == v) return 1;
    return 0;
}

/* What lies beyond the last spoke of an open ring: the ring that begins with the same spoke. */
static void check_last_spoke(const surface *s, const mesh *m, uint32_t ring)
{
    const psurf_ring *r = &rings_of(s)[ring];
    const uint32_t last = r->first_spoke + (r->valence & PSURF_RING_VALENCE) - 1;
    const psurf_spoke spoke = spokes_of(s)[last];
    uint32_t i, first = PSURF_NONE;
    for (i = 0; i < s->info.rings; i++)
        if (rings_of(s)[i].point == r->point && (rings_of(s)[i].valence & PSURF_RING_OPEN)
            && spokes_of(s)[rings_of(s)[i].first_spoke].end == spoke.end)
            first = rings_of(s)[i].first_spoke;
    assert_int_equal(spoke.after, mesh_is_hard(m, r->point, spoke.end) ? first : PSURF_NONE);
    assert_int_equal(psurf_find_spoke(s->topology, r->point, spoke.end),
                     spoke.after == PSURF_NONE ? last : spoke.after);
}

/* Faces on both sides of an edge share a ring at its end unless the edge is hard and another sharp
   edge ends there too. What kind of ring it is depends on how many do. */
static void test_rings_of_marks(void **state)
{
    mesh m = make_marked();
    edge_map map = map_edges(&m);
    surface s;
    uint32_t i, k, f, counts[4] = {0};
    (void)state;
    surface_build(&s, &m);
    for (i = 0; i < map.count; i++) {
        const half_edge *a = &map.edges[i], *b = find_edge(&map, a->to, a->from);
        uint32_t boundary, sharp = count_sharp(&m, &map, a->from, &boundary);
        if (!b || boundary > 2) continue;               /* two fans: each counts for itself */
        k = ring_at(&s, b->face, (b->corner + 1) % m.faces[b->face].size);
        assert_int_equal(ring_at(&s, a->face, a->corner) == k,
                         !(mesh_is_hard(&m, a->from, a->to) && sharp >= 2));
        counts[0]++;
    }
    for (f = 0; f < m.face_count; f++)
        for (k = 0; k < m.faces[f].size; k++) {
            uint32_t v = m.faces[f].v[k], boundary, sharp = count_sharp(&m, &map, v, &boundary);
            const uint32_t flags = rings_of(&s)[ring_at(&s, f, k)].valence;
            int one = boundary == 2 && valence_of(&map, v) == 1, corner;
            if (boundary > 2) continue;
            corner = sharp > 2 || one || (sharp == 2 && is_flagged(&m, v));
            assert_int_equal((flags & PSURF_RING_OPEN) != 0, sharp >= 2);
            assert_int_equal((flags & (PSURF_RING_CORNER | PSURF_RING_WIDE)) != 0, corner);
            counts[corner ? 3 : sharp >= 2 ? 2 : 1]++;
        }
    for (i = 0; i < s.info.rings; i++)
        if (rings_of(&s)[i].valence & PSURF_RING_OPEN) check_last_spoke(&s, &m, i);
    assert_true(counts[0] > 500 && counts[1] > 500 && counts[2] > 50 && counts[3] > 20);
    surface_free(&s);
    free(map.edges);
    mesh_free(&m);
}

/* A crease that ends at another one: the side without it is wide, the two beside it know. */
static void test_wide_ring(void **state)
{
    mesh m = make_grid(4, 4);
    const uint32_t t = 12;                              /* in the middle */
    surface s;
    uint32_t k, i, wide = PSURF_NONE, seen = 0;
    (void)state;
    for (k = 0; k < 4; k++) mesh_hard(&m, 10 + k, 11 + k);
    for (k = 0; k < 2; k++) mesh_hard(&m, 5 * k + 2, 5 * k + 7);
    surface_build(&s, &m);
    assert_int_equal(s.info.hard_edges, 6);
    assert_int_equal(s.info.max_valence, 4);
    assert_int_equal(s.info.kind_faces[PSURF_BICUBIC], 16);
    for (i = 0; i < s.info.rings; i++)
        if (rings_of(&s)[i].valence & PSURF_RING_WIDE) wide = i;
    assert_true(wide != PSURF_NONE && rings_of(&s)[wide].point == t);
    for (i = 0; i < s.info.rings; i++) {
        const psurf_ring r = rings_of(&s)[i];
        const uint32_t n = r.valence & PSURF_RING_VALENCE, first = rings_of(&s)[wide].first_spoke;
        if (r.point != t || i == wide) continue;
        seen++;
        assert_int_equal(n, 2);
        assert_true(r.valence & PSURF_RING_CORNER);
        /* faces lie below the long crease: spokes go down, right, and left, down */
        if (spokes_of(&s)[r.first_spoke].end == 7) {
            assert_true((r.valence & PSURF_RING_WIDE_NEXT) && !(r.valence & PSURF_RING_WIDE_LAST));
            assert_int_equal(spokes_of(&s)[r.first_spoke + 1].before, first + 2);
        } else {
            assert_true((r.valence & PSURF_RING_WIDE_LAST) && !(r.valence & PSURF_RING_WIDE_NEXT));
            assert_int_equal(spokes_of(&s)[r.first_spoke + 1].before, first);
        }
    }
    assert_int_equal(seen, 2);
    surface_free(&s);
    mesh_free(&m);
}

/* Blocks follow each other, aligned, without gaps inside; scratch sections do not overlap. */
static void test_layout(void **state)
{
    static const uint32_t points[PSURF_KIND_COUNT] = {16, 13, 19, 25, 31};
    mesh m = make_creature();
    surface s;
    const psurf_patches_layout *layout;
    size_t end = 0;
    uint32_t k, i = 0, j;
    (void)state;
    surface_build(&s, &m);
    layout = &s.patches.layout;
    for (k = 0; k < PM_KINDS; k++) {
        const psurf_kind_block *block = &layout->kind[k];
        assert_true(s.info.kind_faces[k] > 0);          /* the creature has every kind */
        assert_int_equal(block->points, points[k]);
        assert_int_equal(block->count, s.info.kind_faces[k]);
        assert_int_equal(block->offset % 256, 0);
        assert_true(block->offset >= end);
        end = block->offset + (size_t)block->count * points[k] * 3 * sizeof(psurf_real);
        for (j = 0; j < block->count; j++, i++) {
            psurf_patch patch = psurf_get_patch(&s.patches, i);
            assert_int_equal(patch.point_count, points[k]);
            assert_ptr_equal(patch.points, s.memory + block->offset
                                               + (size_t)j * points[k] * 3 * sizeof(psurf_real));
        }
    }
    assert_true(end <= layout->patch_bytes);
    assert_int_equal(layout->spoke_offset % 256, 0);
    assert_true(layout->limit_offset + (size_t)s.info.rings * 3 * sizeof(psurf_real)
                    <= layout->spoke_offset
                || layout->spoke_offset < layout->limit_offset);
    assert_true(layout->spoke_offset + (size_t)s.info.spokes * 6 * sizeof(psurf_real)
                <= layout->scratch_bytes);
    assert_int_equal(layout->pass_items[PSURF_PASS_CENTRES], 0);
    assert_int_equal(layout->pass_items[PSURF_PASS_VERTICES], s.info.rings);
    assert_int_equal(layout->pass_items[PSURF_PASS_FACETS], s.info.facets);
    assert_int_equal(psurf_get_patch(&s.patches, i).point_count, 0);
    assert_int_equal(psurf_get_patch(&s.patches, PSURF_NONE).point_count, 0);
    surface_free(&s);
    mesh_free(&m);
}

static void test_several_meshes(void **state)
{
    mesh m = make_creature(), other = make_dodecahedron(), torus = make_torus(6, 5);
    surface s;
    (void)state;
    mesh_append(&m, &other, 10);
    mesh_append(&m, &torus, 20);
    mesh_append(&m, &torus, 30);
    check_topology(&m);
    surface_build(&s, &m);
    assert_int_equal(s.info.components, 4);
    /* Euler: 2 for each sphere, 0 for each torus */
    assert_int_equal((int)(s.info.vertices + s.info.faces) - (int)s.info.edges, 4);
    surface_free(&s);
    mesh_free(&m);
    mesh_free(&other);
    mesh_free(&torus);
}

/* Two tetrahedra that share a vertex: two rings there, one component, and each surface is the one
   it would be alone. */
static void test_shared_vertex(void **state)
{
    mesh alone = make_tetrahedron(), m = make_tetrahedron();
    surface a, s;
    uint32_t i, k, shared = 0;
    (void)state;
    mesh_append(&m, &alone, 4);
    for (i = 5; i < 8; i++) m.positions[i - 1] = m.positions[i];
    m.vertex_count = 7;
    for (i = 4; i < 8; i++)                 /* the second one's vertex 4 is vertex 0 now */
        for (k = 0; k < 3; k++) m.faces[i].v[k] = m.faces[i].v[k] == 4 ? 0 : m.faces[i].v[k] - 1;
    surface_build(&s, &m);
    surface_build(&a, &alone);
    assert_int_equal(s.info.vertices, 7);
    assert_int_equal(s.info.rings, 8);
    assert_int_equal(s.info.edges, 12);
    assert_int_equal(s.info.spokes, 24);
    assert_int_equal(s.info.components, 1);
    assert_int_equal(s.info.kind_faces[PSURF_P3], 8);
    for (i = 0; i < s.info.rings; i++) shared += rings_of(&s)[i].point == 0;
    assert_int_equal(shared, 2);
    check_rings(&s);
    for (i = 0; i < 8; i++)                 /* spokes of either fan are found */
        for (k = 0; k < 3; k++) {
            uint32_t v0 = m.faces[i].v[k], v1 = m.faces[i].v[(k + 1) % 3];
            uint32_t found = psurf_find_spoke(s.topology, v0, v1);
            assert_true(found < 24 && spokes_of(&s)[found].end == v1);
            assert_int_equal(found, corners_of(&s)[first_corner_of(&s, patch_of(&s, i)) + k].spoke);
        }
    assert_int_equal(psurf_find_spoke(s.topology, 1, 4), PSURF_NONE);
    for (i = 0; i < 4; i++) {
        psurf_patch one = psurf_get_patch(&a.patches, patch_of(&a, i));
        psurf_patch two = psurf_get_patch(&s.patches, patch_of(&s, i));
        for (k = 0; k < one.point_count; k++)
            assert_true(distance(load(one.points + 3 * k), load(two.points + 3 * k))
                        < (IS_DOUBLE ? 1e-15 : 1e-6));
    }
    surface_free(&a);
    surface_free(&s);
    mesh_free(&alone);
    mesh_free(&m);
}

/* Vertices that no face uses have no ring and do no harm, whatever their position. */
static void test_isolated_vertices(void **state)
{
    mesh m = {0}, cube = make_cube();
    surface s, alone;
    uint32_t i, k;
    (void)state;
    for (i = 0; i < 5; i++) mesh_vertex(&m, 0, 0, 0);
    mesh_append(&m, &cube, 0);
    mesh_vertex(&m, 1, 2, 3);
    surface_build(&s, &m);
    surface_build(&alone, &cube);
    assert_int_equal(s.info.vertices, 14);
    assert_int_equal(s.info.rings, 8);
    assert_int_equal(s.info.components, 1);
    check_rings(&s);
    for (i = 0; i < 6; i++)
        for (k = 0; k < 25; k++)
            assert_true(same_bits(psurf_get_patch(&s.patches, i).points + 3 * k,
                                  psurf_get_patch(&alone.patches, i).points + 3 * k));
    surface_free(&s);
    surface_free(&alone);
    mesh_free(&m);
    mesh_free(&cube);
}

/* face_sizes = NULL with uniform_size is the same mesh. */
static void test_uniform_size(void **state)
{
    mesh m[3];
    uint32_t k;
    (void)state;
    m[0] = make_triangle_ball(5), m[1] = make_torus(7, 5), m[2] = make_dodecahedron();
    for (k = 0; k < 3; k++) {
        surface a, b;
        surface_build(&a, &m[k]);
        surface_describe(&b, &m[k]);
        b.desc.face_sizes = NULL;
        b.desc.uniform_size = 3 + k;
        surface_make(&b);
        assert_int_equal(a.patches.layout.patch_bytes, b.patches.layout.patch_bytes);
        assert_memory_equal(a.memory, b.memory, a.patches.layout.patch_bytes);
        surface_free(&a);
        surface_free(&b);
        mesh_free(&m[k]);
    }
}

/* An empty mesh is a mesh. */
static void test_empty(void **state)
{
    mesh m = {0};
    surface s;
    uint32_t k;
    (void)state;
    for (k = 0; k < 2; k++) {
        surface_describe(&s, &m);
        if (k) {
            s.desc.face_sizes = NULL;
            s.desc.face_vertices = NULL;
            s.desc.positions = NULL;
            s.desc.uniform_size = 4;
        }
        surface_make(&s);
        assert_int_equal(s.info.facets + s.info.rings + s.info.spokes + s.info.edges, 0);
        assert_int_equal(s.info.components, 0);
        surface_free(&s);
    }
}

/* Two ranges of a pass, in any order, make the same bits as one; so do many. */
static void test_pass_ranges(void **state)
{
    mesh m = make_creature();
    surface a, b;
    uint64_t rng = 3;
    uint32_t round, pass;
    (void)state;
    mesh_jitter(&m, &rng, 0.05);
    surface_build(&a, &m);
    surface_build(&b, &m);
    for (round = 0; round < 20; round++) {
        memset(b.memory, 0, b.patches.layout.patch_bytes);
        memset(b.scratch, 0, b.patches.layout.scratch_bytes);
        for (pass = 0; pass < PSURF_PASS_COUNT; pass++) {
            uint32_t items = b.patches.layout.pass_items[pass];
            uint32_t cut = random_below(&rng, items + 1), end = cut;
            /* the upper part first, cut where the items end */
            assert_int_equal(psurf_construct_pass(&b.patches, &b.construct, (psurf_pass)pass, cut,
                                                  round & 1 ? PSURF_NONE : items), PSURF_OK);
            while (end > 0) {
                uint32_t n = 1 + random_below(&rng, end);
                end -= n;
                assert_int_equal(psurf_construct_pass(&b.patches, &b.construct, (psurf_pass)pass,
                                                      end, n), PSURF_OK);
            }
            assert_int_equal(psurf_construct_pass(&b.patches, &b.construct, (psurf_pass)pass, items,
                                                  7), PSURF_OK);
        }
        assert_memory_equal(a.scratch, b.scratch, a.patches.layout.scratch_bytes);
        assert_memory_equal(a.memory, b.memory, a.patches.layout.patch_bytes);
    }
    surface_free(&a);
    surface_free(&b);
    mesh_free(&m);
}

/* Blend ratios: of the topology, of the frame, of the default; and position strides. */
static void test_blends(void **state)
{
    mesh m = make_creature();
    edge_map map = map_edges(&m);
    surface plain, tagged, other;
    psurf_real *blends;
    uint32_t i;
    (void)state;
    surface_build(&plain, &m);
    assert_int_equal(plain.tables.blends.count, 0);
    for (i = 0; i < map.count; i++)
        if (map.edges[i].from < map.edges[i].to && i % 3 == 0)      /* either order of the ends */
            mesh_tag(&m, i & 1 ? map.edges[i].from : map.edges[i].to,
                     i & 1 ? map.edges[i].to : map.edges[i].from, 0.25, 0.875);
    surface_build(&tagged, &m);
    assert_int_equal(tagged.tables.blends.count, tagged.info.spokes);
    assert_int_equal(tagged.tables.blends.stride, sizeof(psurf_real));
    blends = (psurf_real *)grab(tagged.info.spokes, sizeof *blends);
    for (i = 0; i < tagged.info.spokes; i++) blends[i] = (psurf_real)(2.0 / 3.0);
    for (i = 0; i < m.tag_count; i++) {
        const psurf_edge_tag *t = &m.tags[i];
        blends[psurf_find_spoke(tagged.topology, t->v0, t->v1)] = t->blend0;
        blends[psurf_find_spoke(tagged.topology, t->v1, t->v0)] = t->blend1;
    }
    assert_memory_equal(tagged.tables.blends.data, blends, tagged.info.spokes * sizeof *blends);
    assert_memory_not_equal(tagged.memory, plain.memory, plain.patches.layout.patch_bytes);
    /* the frame's blends replace those of either topology */
    memset(plain.memory, 0, plain.patches.layout.patch_bytes);
    plain.construct.blends = blends;
    assert_int_equal(psurf_construct(&plain.patches, &plain.construct), PSURF_OK);
    assert_memory_equal(tagged.memory, plain.memory, plain.patches.layout.patch_bytes);
    /* all 1 by default, and all 1 by hand */
    m.tag_count = 0;
    surface_describe(&other, &m);
    other.desc.flags = PSURF_DEFAULT_BLEND;
    other.desc.default_blend = 1;
    surface_make(&other);
    for (i = 0; i < other.info.spokes; i++) blends[i] = 1;
    assert_int_equal(psurf_construct(&plain.patches, &plain.construct), PSURF_OK);
    assert_memory_equal(other.memory, plain.memory, plain.patches.layout.patch_bytes);
    free(blends);
    free(map.edges);
    surface_free(&plain);
    surface_free(&tagged);
    surface_free(&other);
    mesh_free(&m);
}

static void test_position_stride(void **state)
{
    mesh m = make_creature();
    surface a, b;
    psurf_real *wide = (psurf_real *)grab(m.vertex_count, 5 * sizeof *wide);
    uint32_t i;
    (void)state;
    surface_build(&a, &m);
    surface_describe(&b, &m);
    for (i = 0; i < m.vertex_count; i++) {
        memcpy(wide + 5 * i, a.positions + 3 * i, 3 * sizeof *wide);
        wide[5 * i + 3] = wide[5 * i + 4] = (psurf_real)NAN;        /* never looked at */
    }
    b.desc.positions = b.construct.positions = wide;
    b.desc.position_stride = b.construct.position_stride = 5 * sizeof *wide;
    surface_make(&b);
    assert_memory_equal(a.memory, b.memory, a.patches.layout.patch_bytes);
    surface_free(&a);
    surface_free(&b);
    free(wide);
    mesh_free(&m);
}

/* A non-finite position spoils the points its vertex reaches, two rings of faces, and no others. */
static void test_nonfinite_spreads_no_further(void **state)
{
    mesh m = make_torus(12, 12);
    surface a, b;
    uint32_t i, k, spoiled = 0;
    (void)state;
    surface_build(&a, &m);
    surface_build(&b, &m);
    b.positions[3 * 40] = (psurf_real)NAN;
    assert_int_equal(psurf_construct(&b.patches, &b.construct), PSURF_OK);
    for (i = 0; i < a.info.facets; i++) {
        psurf_patch pa = psurf_get_patch(&a.patches, i), pb = psurf_get_patch(&b.patches, i);
        uint32_t near = 0;
        for (k = 0; k < 4; k++) {
            uint32_t v = m.faces[pb.face].v[k], di = (v / 12 + 12 - 40 / 12) % 12;
            uint32_t dj = (v % 12 + 12 - 40 % 12) % 12;
            near |= (di <= 1 || di == 11) && (dj <= 1 || dj == 11);
        }
        for (k = 0; k < pb.point_count; k++) {
            if (isfinite(pb.points[3 * k])) continue;
            spoiled++;
            assert_true(near);
        }
        for (k = 0; k < pb.point_count; k++)            /* y and z do not feel x */
            assert_memory_equal(pa.points + 3 * k + 1, pb.points + 3 * k + 1,
                                2 * sizeof(psurf_real));
    }
    assert_true(spoiled > 16);
    surface_free(&a);
    surface_free(&b);
    mesh_free(&m);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_tables),          cmocka_unit_test(test_rings_of_marks),
        cmocka_unit_test(test_wide_ring),
        cmocka_unit_test(test_known_counts),
        cmocka_unit_test(test_layout),          cmocka_unit_test(test_several_meshes),
        cmocka_unit_test(test_shared_vertex),   cmocka_unit_test(test_isolated_vertices),
        cmocka_unit_test(test_uniform_size),    cmocka_unit_test(test_empty),
        cmocka_unit_test(test_pass_ranges),     cmocka_unit_test(test_blends),
        cmocka_unit_test(test_position_stride),
        cmocka_unit_test(test_nonfinite_spreads_no_further)};
    return cmocka_run_group_tests_name("topology", tests, NULL, NULL);
}
