/* Defective meshes, and odd ones that are none: what is refused, and where; what comes of it with
   PSURF_CUT_BAD_EDGES. Whatever is taken has to give a surface without cracks. */
#include "common.h"

#define NONE PSURF_NONE

typedef struct place { uint32_t face, corner, vertex, other; } place;

/* What a mesh that is taken must count. */
typedef struct counts {
    uint32_t edges, cut, boundary, rings, components, valence2, split;
} counts;

typedef struct defect {
    const char *name;
    psurf_result result;                        /* as it is, and where */
    place at;
    psurf_result repaired;                      /* with bad edges cut open */
    counts want;
    uint32_t vertices, faces;
    uint32_t sizes[8], indices[32];
} defect;

#define TAKEN PSURF_OK, {NONE, NONE, NONE, NONE}, PSURF_OK

static const defect defects[] = {
    {"sound tetrahedron", TAKEN, {6, 0, 0, 4, 1, 0, 0}, 4, 4,
     {3, 3, 3, 3}, {0, 1, 2, 0, 3, 1, 0, 2, 3, 1, 3, 2}},
    {"two tetrahedra that share a vertex", TAKEN, {12, 0, 0, 8, 1, 0, 0}, 7, 8,
     {3, 3, 3, 3, 3, 3, 3, 3},
     {0, 1, 2, 0, 3, 1, 0, 2, 3, 1, 3, 2, 0, 4, 5, 0, 6, 4, 0, 5, 6, 4, 6, 5}},
    {"two triangles that share a vertex", TAKEN, {6, 0, 6, 6, 1, 0, 0}, 5, 2,
     {3, 3}, {0, 1, 2, 0, 3, 4}},
    {"vertices without faces", TAKEN, {6, 0, 0, 4, 1, 0, 0}, 9, 4,
     {3, 3, 3, 3}, {1, 3, 5, 1, 7, 3, 1, 5, 7, 3, 7, 5}},
    {"two components", TAKEN, {12, 0, 0, 8, 2, 0, 0}, 8, 8,
     {3, 3, 3, 3, 3, 3, 3, 3},
     {0, 1, 2, 0, 3, 1, 0, 2, 3, 1, 3, 2, 4, 5, 6, 4, 7, 5, 4, 6, 7, 5, 7, 6}},
    {"a face missing", TAKEN, {6, 0, 3, 4, 1, 0, 0}, 4, 3,
     {3, 3, 3}, {0, 1, 2, 0, 3, 1, 0, 2, 3}},
    {"one face alone", TAKEN, {5, 0, 5, 5, 1, 0, 0}, 5, 1, {5}, {0, 1, 2, 3, 4}},
    {"triangles back to back", TAKEN, {3, 0, 0, 5, 1, 3, 2}, 3, 2, {3, 3}, {0, 1, 2, 2, 1, 0}},
    {"hexagons back to back", TAKEN, {6, 0, 0, 8, 1, 6, 2}, 6, 2,
     {6, 6}, {0, 1, 2, 3, 4, 5, 5, 4, 3, 2, 1, 0}},
    {"a vertex of two edges", TAKEN, {7, 0, 0, 7, 1, 1, 2}, 5, 4,
     {4, 4, 3, 3}, {0, 4, 1, 2, 0, 3, 1, 4, 0, 2, 3, 1, 3, 2}},
    {"a T-corner", TAKEN, {10, 0, 7, 8, 1, 0, 0}, 8, 3,
     {5, 4, 4}, {0, 1, 2, 3, 4, 1, 5, 6, 2, 2, 6, 7, 3}},
    {"two T-corners on one quad", TAKEN, {13, 0, 8, 11, 1, 0, 1}, 10, 4,
     {6, 4, 4, 4}, {0, 1, 2, 3, 4, 5, 1, 6, 7, 2, 2, 7, 8, 3, 3, 8, 9, 4}},
    {"a slit", TAKEN, {13, 0, 10, 10, 1, 0, 0}, 10, 4,
     {4, 4, 4, 4}, {0, 1, 4, 3, 1, 2, 5, 4, 3, 4, 7, 6, 4, 9, 8, 7}},
    {"an edge of three faces: a fin", PSURF_NON_MANIFOLD, {4, 0, 2, 3},
     PSURF_OK, {10, 1, 5, 7, 1, 0, 0}, 5, 5,
     {3, 3, 3, 3, 3}, {0, 1, 2, 0, 3, 1, 0, 2, 3, 1, 3, 2, 2, 3, 4}},
    {"an edge of three faces: a book", PSURF_NON_MANIFOLD, {2, 0, 1, 0},
     PSURF_OK, {9, 1, 9, 9, 1, 0, 0}, 5, 3, {3, 3, 3}, {0, 1, 2, 0, 1, 3, 1, 0, 4}},
    {"an edge of four faces", PSURF_NON_MANIFOLD, {4, 0, 0, 1},
     PSURF_OK, {14, 1, 4, 8, 1, 0, 0}, 6, 8,
     {3, 3, 3, 3, 3, 3, 3, 3},
     {0, 1, 2, 0, 3, 1, 0, 2, 3, 1, 3, 2, 0, 1, 4, 0, 5, 1, 0, 4, 5, 1, 5, 4}},
    {"a face turned over", PSURF_BAD_WINDING, {2, 2, 2, 0},
     PSURF_OK, {9, 3, 6, 7, 1, 0, 0}, 4, 4,
     {3, 3, 3, 3}, {0, 1, 2, 0, 3, 1, 0, 3, 2, 1, 3, 2}},
    {"the same face twice", PSURF_BAD_WINDING, {1, 0, 0, 1},
     PSURF_OK, {6, 3, 6, 6, 1, 0, 0}, 3, 2, {3, 3}, {0, 1, 2, 0, 1, 2}},
    {"a Moebius strip", PSURF_BAD_WINDING, {3, 1, 1, 0},
     PSURF_OK, {13, 1, 10, 10, 1, 0, 0}, 8, 4,
     {4, 4, 4, 4}, {0, 2, 3, 1, 2, 4, 5, 3, 4, 6, 7, 5, 6, 1, 0, 7}},
    {"a vertex twice in a face", PSURF_BAD_FACE, {0, 3, 1, NONE},
     PSURF_BAD_FACE, {0, 0, 0, 0, 0, 0, 0}, 5, 4,
     {5, 3, 3, 3}, {0, 1, 2, 1, 4, 0, 3, 1, 0, 2, 3, 1, 3, 2}},
    {"a face of two corners", PSURF_BAD_FACE, {4, NONE, NONE, NONE},
     PSURF_BAD_FACE, {0, 0, 0, 0, 0, 0, 0}, 4, 5,
     {3, 3, 3, 3, 2}, {0, 1, 2, 0, 3, 1, 0, 2, 3, 1, 3, 2, 0, 1}},
    {"a vertex that is not there", PSURF_BAD_INDEX, {1, 2, 4, NONE},
     PSURF_BAD_INDEX, {0, 0, 0, 0, 0, 0, 0}, 4, 4,
     {3, 3, 3, 3}, {0, 1, 2, 0, 3, 4, 0, 2, 3, 1, 3, 2}}};

/* Vertices stand in rows of three, shaken; the last of the slit lies on the one it was cut from. */
static void place_vertices(const defect *d, psurf_real *positions)
{
    uint64_t rng = 7;
    uint32_t v, k;
    for (v = 0; v < d->vertices; v++) {
        positions[3 * v] = (psurf_real)(v % 3);
        positions[3 * v + 1] = (psurf_real)(v / 3);
        positions[3 * v + 2] = (psurf_real)0;
        for (k = 0; k < 3; k++)
            positions[3 * v + k] += (psurf_real)(random_unit(&rng) / 4);
    }
    if (!strcmp(d->name, "a slit"))
        memcpy(positions + 3 * 9, positions + 3 * 5, 3 * sizeof *positions);
}

static psurf_mesh_desc describe(const defect *d, const psurf_real *positions, uint32_t flags)
{
    psurf_mesh_desc desc;
    memset(&desc, 0, sizeof desc);
    desc.vertex_count = d->vertices;
    desc.face_count = d->faces;
    desc.face_sizes = d->sizes;
    desc.face_vertices = d->indices;
    desc.positions = positions;
    desc.flags = flags;
    return desc;
}

static void expect_counts(const char *name, const counts *want, const psurf_topology *topology)
{
    psurf_info info;
    psurf_topology_info(topology, &info);
#define COUNT(field, member)                                                                       \
    REQUIRE(info.member == want->field, "%s: %u, not %u\n", name, (unsigned)info.member,           \
            (unsigned)want->field)
    COUNT(edges, edges);
    COUNT(cut, edges_cut);
    COUNT(boundary, boundary_edges);
    COUNT(rings, rings);
    COUNT(components, components);
    COUNT(valence2, valence2);
    COUNT(split, ngon_faces);
#undef COUNT
    assert_int_equal(info.hard_edges, 0);
    assert_int_equal(info.edge_sides, info.edges);
}

/* The surface of what was taken: no cracks, every number finite, vertices without faces unused. */
static void expect_surface(const psurf_topology *topology, const psurf_real *positions)
{
    psurf_patches_layout layout;
    psurf_patches patches;
    psurf_construct_desc construct;
    psurf_check_result check;
    psurf_info info;
    void *memory, *scratch;
    psurf_topology_info(topology, &info);
    assert_int_equal(psurf_patches_size(topology, PSURF_PM, &layout), PSURF_OK);
    memory = grab(layout.patch_bytes, 1);
    scratch = grab(layout.scratch_bytes, 1);
    memset(&construct, 0, sizeof construct);
    construct.positions = positions;
    assert_int_equal(psurf_patches_bind(&patches, topology, PSURF_PM, memory, scratch), PSURF_OK);
    assert_int_equal(psurf_construct(&patches, &construct), PSURF_OK);
    assert_int_equal(psurf_check(&patches, &construct, 5, 0, NONE, &check), PSURF_OK);
    assert_int_equal(check.samples, (uint64_t)(info.edges - info.boundary_edges) * 6);
    assert_int_equal(check.cracks + check.nonfinite + check.sharp_edges, 0);
    if (info.valence2 < info.vertices)          /* two faces on each other are all one fold */
        REQUIRE(check.max_normal_deg < (IS_DOUBLE ? 1e-7 : 0.05), "%g degrees\n",
                check.max_normal_deg);
    free(memory);
    free(scratch);
}

/* Creates, compares with what the catalogue says, and looks at the surface. */
static void expect_result(const defect *d, uint32_t flags, psurf_result want)
{
    psurf_real positions[3 * 16];
    psurf_mesh_desc desc = describe(d, positions, flags);
    psurf_topology *topology;
    psurf_error e;
    psurf_result result;
    place_vertices(d, positions);
    result = psurf_topology_create(&desc, &topology, &e);
    REQUIRE(result == want && e.result == want, "%s: %s\n", d->name, psurf_result_string(result));
    if (result == PSURF_OK) {
        assert_int_equal(e.face & e.corner & e.vertex & e.other, NONE);
        expect_counts(d->name, &d->want, topology);
        expect_surface(topology, positions);
    } else {
        REQUIRE(e.face == d->at.face && e.corner == d->at.corner && e.vertex == d->at.vertex
                && e.other == d->at.other, "%s: at face %d corner %d vertices %d %d\n", d->name,
                (int)e.face, (int)e.corner, (int)e.vertex, (int)e.other);
        assert_null(topology);
    }
    psurf_topology_destroy(topology);
}

static void test_catalogue(void **state)
{
    uint32_t i;
    (void)state;
    for (i = 0; i < COUNT_OF(defects); i++) {
        const defect *d = &defects[i];
        expect_result(d, 0, d->result);
        expect_result(d, PSURF_CUT_BAD_EDGES, d->repaired);
        print_message("%s: %s; cut: %s\n", d->name, psurf_result_string(d->result),
                      psurf_result_string(d->repaired));
    }
}

/* The tip of a slit has no tangent plane: what lies beside it is reported as degenerate. */
static void test_slit_is_degenerate(void **state)
{
    mesh m = {0};
    surface s;
    psurf_check_result r;
    uint32_t i;
    (void)state;
    for (i = 0; i < 9; i++) mesh_vertex(&m, 65536 * (i % 3), 65536 * (i / 3), 0);
    mesh_vertex(&m, 2 * 65536, 65536, 0);
    mesh_quad(&m, 0, 1, 4, 3);
    mesh_quad(&m, 1, 2, 5, 4);
    mesh_quad(&m, 3, 4, 7, 6);
    mesh_quad(&m, 4, 9, 8, 7);
    surface_build(&s, &m);
    assert_int_equal(psurf_check(&s.patches, &s.construct, 8, 0, NONE, &r), PSURF_OK);
    assert_int_equal(r.degenerate, 3 * 9);              /* the three edges that end at the tip */
    assert_int_equal(r.cracks + r.nonfinite, 0);
    surface_free(&s);
    m.positions[9].z = 0.5;                             /* opened, it is a boundary like others */
    surface_build(&s, &m);
    assert_int_equal(psurf_check(&s.patches, &s.construct, 8, 0, NONE, &r), PSURF_OK);
    assert_int_equal(r.degenerate, 0);
    surface_free(&s);
    mesh_free(&m);
}

/* Marks on an edge that was cut: its parts are boundaries, none is hard, all have its ratios. */
static void test_marks_on_cut_edges(void **state)
{
    mesh m = {0};
    surface s;
    uint32_t i, found = 0;
    (void)state;
    for (i = 0; i < 5; i++) mesh_vertex(&m, 65536 * (i / 2), 65536 * (i % 2), 8192 * i * i);
    mesh_tri(&m, 0, 1, 2);
    mesh_tri(&m, 0, 1, 3);
    mesh_tri(&m, 1, 0, 4);
    mesh_hard(&m, 0, 1);
    mesh_tag(&m, 0, 1, 0.25, 0.75);
    mesh_hard(&m, 0, 3);                                /* a boundary is none either */
    surface_describe(&s, &m);
    s.desc.flags = PSURF_CUT_BAD_EDGES;
    surface_make(&s);
    assert_int_equal(s.info.edges_cut, 1);
    assert_int_equal(s.info.hard_edges, 0);
    assert_int_equal(s.tables.blends.count, s.info.spokes);
    for (i = 0; i < s.info.rings; i++) {
        const psurf_ring *ring = (const psurf_ring *)s.tables.rings.data + i;
        const psurf_spoke *spokes = (const psurf_spoke *)s.tables.spokes.data;
        const psurf_real *blends = (const psurf_real *)s.tables.blends.data;
        uint32_t k;
        for (k = ring->first_spoke; k < ring->first_spoke + 2; k++)
            if (ring->point < 2 && spokes[k].end == 1 - ring->point) {
                assert_true(blends[k] == (psurf_real)(ring->point ? 0.75 : 0.25));
                found++;
            } else {
                assert_true(blends[k] == (psurf_real)(2.0 / 3.0));
            }
    }
    assert_int_equal(found, 6);                         /* two ends of three parts */
    surface_free(&s);
    mesh_free(&m);
}

int main(void)
{
    const struct CMUnitTest tests[] = {cmocka_unit_test(test_catalogue),
                                       cmocka_unit_test(test_slit_is_degenerate),
                                       cmocka_unit_test(test_marks_on_cut_edges)};
    return cmocka_run_group_tests_name("defects", tests, NULL, NULL);
}
