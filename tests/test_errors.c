/* Every result code provoked and located, canaries, sizes that overflow, and memory: what is
   allocated, what happens where it is refused, what comes back. */
#include <stdlib.h>

/* The library's own calls of the C library are counted: in a private copy of the implementation. */
static unsigned long stdlib_calls;
static void *counted_malloc(size_t size)
{
    stdlib_calls++;
    return malloc(size);
}
static void counted_free(void *memory)
{
    stdlib_calls++;
    free(memory);
}
#define malloc counted_malloc
#define free counted_free
#define PSURF_STATIC
#define PSURF_IMPLEMENTATION
#include "patchsurf.h"
#undef malloc
#undef free
#include "common.h"

static int provoked[PSURF_RESULT_COUNT];

/* ---- an allocator that counts, refuses and checks -------------------------------------------- */

enum { MAX_LIVE = 16 };
typedef struct pool {
    unsigned calls, refuse_from, refuse_count;  /* calls refuse_from .. + refuse_count get NULL */
    size_t largest, bytes, peak;                /* above largest: refused; 0: no limit */
    struct { char *memory, *given; size_t size; } live[MAX_LIVE];
    unsigned live_count;
} pool;

static void *pool_alloc(void *ctx, size_t size, size_t align)
{
    pool *p = (pool *)ctx;
    unsigned call = p->calls++, i = 0;
    char *memory, *given;
    assert_true(size > 0 && align > 0 && align <= 16 && (align & (align - 1)) == 0);
    if (call >= p->refuse_from && call - p->refuse_from < p->refuse_count) return NULL;
    if (p->largest && size > p->largest) return NULL;
    /* aligned to what was asked for and to no more */
    memory = (char *)malloc(size + 2 * align);
    assert_non_null(memory);
    given = memory + align - (uintptr_t)memory % align;
    if ((uintptr_t)given % (2 * align) == 0) given += align;
    memset(given, 0xA5, size);
    while (i < MAX_LIVE && p->live[i].memory) i++;
    assert_true(i < MAX_LIVE);
    p->live[i].memory = memory;
    p->live[i].given = given;
    p->live[i].size = size;
    p->live_count++;
    p->bytes += size;
    if (p->bytes > p->peak) p->peak = p->bytes;
    return given;
}

static void pool_release(void *ctx, void *memory, size_t size)
{
    pool *p = (pool *)ctx;
    unsigned i = 0;
    assert_non_null(memory);
    while (i < MAX_LIVE && p->live[i].given != memory) i++;
    assert_true(i < MAX_LIVE);
    assert_int_equal(p->live[i].size, size);
    memset(memory, 0x5A, size);
    free(p->live[i].memory);
    memset(&p->live[i], 0, sizeof p->live[i]);
    p->live_count--;
    p->bytes -= size;
}

static psurf_allocator pool_of(pool *p)
{
    psurf_allocator a;
    memset(p, 0, sizeof *p);
    a.alloc = pool_alloc;
    a.release = pool_release;
    a.ctx = p;
    return a;
}

/* ---- bad meshes ------------------------------------------------------------------------------ */

#define NONE PSURF_NONE
#define ANY 0xFFFFFFFEu                 /* of several that are equally at fault, one */

typedef struct bad_mesh {
    const char *name;
    psurf_result result;
    uint32_t face, corner, vertex, other;       /* expected place */
    uint32_t vertices, faces;
    uint32_t sizes[9], indices[32];
} bad_mesh;

static const bad_mesh bad_meshes[] = {
    {"good tetrahedron", PSURF_OK, NONE, NONE, NONE, NONE, 4, 4,
     {3, 3, 3, 3}, {0, 1, 2, 0, 3, 1, 0, 2, 3, 1, 3, 2}},
    {"first index too large", PSURF_BAD_INDEX, 1, 2, 4, NONE, 4, 4,
     {3, 3, 3, 3}, {0, 1, 2, 0, 3, 4, 0, 2, 3, 1, 3, 2}},
    {"index of all ones", PSURF_BAD_INDEX, 0, 0, 0xFFFFFFFFu, NONE, 4, 4,
     {3, 3, 3, 3}, {0xFFFFFFFFu, 1, 2, 0, 3, 1, 0, 2, 3, 1, 3, 2}},
    {"no vertices at all", PSURF_BAD_INDEX, 0, 0, 0, NONE, 0, 1, {3}, {0, 1, 2}},
    {"face without corners", PSURF_BAD_FACE, 1, NONE, NONE, NONE, 4, 4,
     {3, 0, 3, 3}, {0, 1, 2, 0, 2, 3, 1, 3, 2}},
    {"face of one corner", PSURF_BAD_FACE, 3, NONE, NONE, NONE, 4, 4,
     {3, 3, 3, 1}, {0, 1, 2, 0, 3, 1, 0, 2, 3, 1}},
    {"face of two corners", PSURF_BAD_FACE, 4, NONE, NONE, NONE, 4, 5,
     {3, 3, 3, 3, 2}, {0, 1, 2, 0, 3, 1, 0, 2, 3, 1, 3, 2, 0, 1}},
    {"face beyond the largest", PSURF_BAD_FACE, 2, NONE, NONE, NONE, 4, 4,
     {3, 3, PSURF_MAX_FACE_SIZE + 1, 3}, {0, 1, 2, 0, 3, 1, 0, 2, 3, 1, 3, 2}},
    {"face of all ones", PSURF_BAD_FACE, 0, NONE, NONE, NONE, 4, 4,
     {0xFFFFFFFFu, 3, 3, 3}, {0, 1, 2, 0, 3, 1, 0, 2, 3, 1, 3, 2}},
    {"vertex twice in a row", PSURF_BAD_FACE, 2, 1, 0, NONE, 4, 4,
     {3, 3, 3, 3}, {0, 1, 2, 0, 3, 1, 0, 0, 3, 1, 3, 2}},
    {"vertex first and last", PSURF_BAD_FACE, 3, 2, 1, NONE, 4, 4,
     {3, 3, 3, 3}, {0, 1, 2, 0, 3, 1, 0, 2, 3, 1, 3, 1}},
    {"vertex twice, apart", PSURF_BAD_FACE, 0, 3, 1, NONE, 5, 4,
     {5, 3, 3, 3}, {0, 1, 2, 1, 4, 0, 3, 1, 0, 2, 3, 1, 3, 2}},
    {"one face turned over", PSURF_BAD_WINDING, ANY, ANY, ANY, ANY, 4, 4,
     {3, 3, 3, 3}, {0, 1, 2, 0, 3, 1, 0, 3, 2, 1, 3, 2}},
    {"a fin", PSURF_NON_MANIFOLD, ANY, ANY, 2, 3, 5, 5,
     {3, 3, 3, 3, 3}, {0, 1, 2, 0, 3, 1, 0, 2, 3, 1, 3, 2, 2, 3, 4}}};

static uint32_t index_of(const bad_mesh *m, uint32_t face, uint32_t corner)
{
    uint32_t i, first = 0;
    for (i = 0; i < face; i++) first += m->sizes[i];
    return m->indices[first + corner];
}

/* Whatever the table leaves open: face and corner exist, and name the vertices reported. */
static void check_place(const bad_mesh *m, const psurf_error *e)
{
    assert_true(e->face == NONE || e->face < m->faces);
    assert_true(m->face == ANY || e->face == m->face);
    assert_true(m->corner == ANY || e->corner == m->corner);
    if (m->vertex != ANY && m->corner == ANY) {         /* an edge: either end may come first */
        assert_true((e->vertex == m->vertex && e->other == m->other)
                    || (e->vertex == m->other && e->other == m->vertex));
    } else if (m->vertex != ANY) {
        assert_int_equal(e->vertex, m->vertex);
        assert_int_equal(e->other, m->other);
    }
    if (e->corner != NONE) {
        assert_true(e->face != NONE && e->corner < m->sizes[e->face]);
        assert_int_equal(index_of(m, e->face, e->corner), e->vertex);
    }
    if (e->corner != NONE && e->other != NONE)
        assert_int_equal(index_of(m, e->face, (e->corner + 1) % m->sizes[e->face]), e->other);
    if (m->face == ANY) assert_true(e->face != NONE && e->corner != NONE && e->other != NONE);
    if (m->vertex == ANY && m->face == NONE) assert_true(e->vertex < m->vertices);
}

/* Calls with a pool, checks that nothing stays behind, and notes the result. */
static psurf_result create(psurf_mesh_desc *desc, psurf_error *error)
{
    pool p;
    psurf_topology *topology = (psurf_topology *)(uintptr_t)16;
    psurf_result result;
    desc->allocator = pool_of(&p);
    p.largest = 1u << 30;
    memset(error, 0xEE, sizeof *error);
    result = psurf_topology_create(desc, &topology, error);
    assert_int_equal(error->result, result);
    assert_true(error->message && error->message[0]);
    if (result == PSURF_OK) assert_non_null(topology);
    else assert_null(topology);
    psurf_topology_destroy(topology);
    assert_int_equal(p.live_count, 0);
    provoked[result]++;
    return result;
}

static void test_bad_meshes(void **state)
{
    uint32_t i;
    (void)state;
    for (i = 0; i < COUNT_OF(bad_meshes); i++) {
        const bad_mesh *m = &bad_meshes[i];
        psurf_mesh_desc desc;
        psurf_error error;
        psurf_topology *topology;
        psurf_result result;
        memset(&desc, 0, sizeof desc);
        desc.vertex_count = m->vertices;
        desc.face_count = m->faces;
        desc.face_sizes = m->sizes;
        desc.face_vertices = m->indices;
        result = create(&desc, &error);
        REQUIRE(result == m->result, "%s: %s\n", m->name, psurf_result_string(result));
        print_message("%s: face %d corner %d vertices %d %d\n", m->name, (int)error.face,
                      (int)error.corner, (int)error.vertex, (int)error.other);
        check_place(m, &error);
        assert_string_equal(error.message, psurf_result_string(result));
        /* the place is optional */
        memset(&desc.allocator, 0, sizeof desc.allocator);
        assert_int_equal(psurf_topology_create(&desc, &topology, NULL), m->result);
        psurf_topology_destroy(topology);
    }
}

/* A cube as arrays that a test may spoil. */
static void good_cube(surface *s)
{
    mesh m = make_cube();
    surface_describe(s, &m);
    mesh_free(&m);
}

static void test_bad_positions(void **state)
{
    static const double bad[] = {NAN, INFINITY, -INFINITY};
    surface s;
    psurf_error error;
    uint32_t v, k;
    (void)state;
    good_cube(&s);
    for (v = 0; v < 8; v++)
        for (k = 0; k < 9; k++) {
            psurf_real keep = s.positions[3 * v + k % 3];
            s.positions[3 * v + k % 3] = (psurf_real)bad[k / 3];
            assert_int_equal(create(&s.desc, &error), PSURF_NOT_FINITE);
            assert_int_equal(error.vertex, v);
            assert_int_equal(error.face & error.corner & error.other, NONE);
            s.positions[3 * v + k % 3] = keep;
        }
    s.positions[0] = (psurf_real)(IS_DOUBLE ? 1.7e308 : 3.4e38);       /* large is finite */
    assert_int_equal(create(&s.desc, &error), PSURF_OK);
    surface_free(&s);
}

/* Normals of corners, schemes of faces, schemes on topologies that do not suit them. */
static void test_bad_schemes(void **state)
{
    uint32_t normals[24], i;
    unsigned char schemes[6];
    psurf_patches_layout layout;
    surface s;
    psurf_error error;
    (void)state;
    good_cube(&s);
    for (i = 0; i < 24; i++) normals[i] = i;
    s.desc.face_normals = normals;
    s.desc.normal_count = 24;
    assert_int_equal(create(&s.desc, &error), PSURF_OK);
    normals[22] = 24;
    assert_int_equal(create(&s.desc, &error), PSURF_BAD_NORMAL);
    assert_int_equal(error.face, 5);
    assert_int_equal(error.corner, 2);
    assert_int_equal(error.vertex, s.desc.face_vertices[22]);
    s.desc.face_normals = NULL;
    s.desc.split = PSURF_SPLIT_COUNT;
    assert_int_equal(create(&s.desc, &error), PSURF_BAD_DESC);
    for (i = 0; i < 6; i++) schemes[i] = PSURF_PN;
    s.desc.face_schemes = schemes;
    s.desc.split = PSURF_SPLIT_PN;
    assert_int_equal(create(&s.desc, &error), PSURF_BAD_DESC);
    s.desc.split = PSURF_SPLIT_TRIANGLES;
    schemes[1] = PSURF_SMOOTHED_N;
    schemes[2] = PSURF_CUBIC_PN_B1;
    assert_int_equal(create(&s.desc, &error), PSURF_OK);
    for (i = PSURF_PM; i <= PSURF_SCHEME_COUNT; i++) {
        const int fits = i == PSURF_PN || i == PSURF_SMOOTHED_N || i == PSURF_CUBIC_PN_B1 ||
                         i == PSURF_CUBIC_PN_B2;
        schemes[4] = (unsigned char)i;
        assert_int_equal(create(&s.desc, &error), fits ? PSURF_OK : PSURF_BAD_SCHEME);
        if (!fits) assert_int_equal(error.face, 4);
    }
    schemes[4] = PSURF_PN;
    memset(&s.desc.allocator, 0, sizeof s.desc.allocator);
    assert_int_equal(psurf_topology_create(&s.desc, &s.topology, &error), PSURF_OK);
    for (i = PSURF_PM; i < PSURF_SCHEME_COUNT; i++)
        assert_int_equal(psurf_patches_size(s.topology, (psurf_scheme)i, &layout),
                         i == PSURF_MIXED ? PSURF_OK : PSURF_BAD_SPLIT);
    provoked[PSURF_BAD_SPLIT]++;
    surface_free(&s);
}

static void test_bad_tags(void **state)
{
    static const struct { psurf_edge_tag tags[2]; uint32_t count, bad; } cases[] = {
        {{{0, 3, PSURF_BLEND, 0.5f, 0.5f}}, 1, 0},                      /* a diagonal */
        {{{0, 8, PSURF_BLEND, 0.5f, 0.5f}}, 1, 0},                      /* no such vertex */
        {{{0xFFFFFFFFu, 1, PSURF_BLEND, 0.5f, 0.5f}}, 1, 0},
        {{{2, 2, PSURF_BLEND, 0.5f, 0.5f}}, 1, 0},
        {{{0, 3, 0, 0, 0}}, 1, 0},                              /* tags without flags count */
        {{{0, 1, PSURF_BLEND, 0.5f, 0.5f}, {0, 1, PSURF_BLEND, 0.5f, 0.5f}}, 2, 1},
        {{{0, 1, PSURF_BLEND, 0.5f, 0.5f}, {1, 0, PSURF_BLEND, 0.5f, 0.5f}}, 2, 1},
        {{{0, 2, PSURF_BLEND, 0, 1}, {0, 1, PSURF_BLEND, -0.001f, 0.5f}}, 2, 1},
        {{{0, 1, PSURF_BLEND, 0.5f, 1.001f}}, 1, 0},
        {{{0, 1, PSURF_BLEND, NAN, 0.5f}}, 1, 0},
        {{{0, 1, PSURF_BLEND, 0.5f, INFINITY}}, 1, 0},
        {{{0, 1, PSURF_HARD, 0, 0}, {1, 0, PSURF_BLEND, 0, 0}}, 2, 1},
        {{{0, 3, PSURF_HARD, 0, 0}}, 1, 0},
        {{{0, 1, PSURF_HARD | PSURF_BLEND, 0.5f, 2}}, 1, 0},
        {{{0, 1, PSURF_BLEND << 1, 0.5f, 0.5f}}, 1, 0}};                /* a flag of the future */
    static const psurf_edge_tag good[3] = {
        {0, 1, PSURF_BLEND, 0, 1}, {3, 1, 0, -7, 7}, {2, 3, PSURF_HARD, NAN, 7}};
    surface s;
    psurf_error error;
    uint32_t i;
    (void)state;
    good_cube(&s);
    for (i = 0; i < COUNT_OF(cases); i++) {
        const psurf_edge_tag *tag = &cases[i].tags[cases[i].bad];
        s.desc.edges = cases[i].tags;
        s.desc.edge_count = cases[i].count;
        assert_int_equal(create(&s.desc, &error), PSURF_BAD_EDGE);
        assert_int_equal(error.vertex, tag->v0);
        assert_int_equal(error.other, tag->v1);
    }
    s.desc.edges = good;        /* 0 and 1 are in range; without the flag values are ignored */
    s.desc.edge_count = 3;
    assert_int_equal(create(&s.desc, &error), PSURF_OK);
    surface_free(&s);
}

static void test_bad_corners(void **state)
{
    static const uint32_t good[] = {7, 0, 7}, bad[][3] = {{8, 0, 0}, {0, 7, 0xFFFFFFFFu}};
    static const uint32_t vertex[] = {8, 0xFFFFFFFFu};
    surface s;
    psurf_error error;
    uint32_t i;
    (void)state;
    good_cube(&s);
    s.desc.corner_count = 3;
    for (i = 0; i < COUNT_OF(bad); i++) {
        s.desc.corners = bad[i];
        assert_int_equal(create(&s.desc, &error), PSURF_BAD_CORNER);
        assert_int_equal(error.vertex, vertex[i]);
        assert_int_equal(error.face & error.corner & error.other, NONE);
    }
    s.desc.corners = good;                      /* no hard edges there: ignored */
    assert_int_equal(create(&s.desc, &error), PSURF_OK);
    surface_free(&s);
}

static void expect_bad_desc(const psurf_mesh_desc *desc, int line)
{
    psurf_mesh_desc copy = *desc;
    psurf_error error;
    psurf_result result = create(&copy, &error);
    REQUIRE(result == PSURF_BAD_DESC, "line %d: %s\n", line, psurf_result_string(result));
    assert_int_equal(error.face & error.corner & error.vertex & error.other, NONE);
}

static void test_bad_descriptors(void **state)
{
    static const psurf_real bad_blends[] = {(psurf_real)-0.01, (psurf_real)1.01, (psurf_real)NAN,
                                            (psurf_real)INFINITY};
    surface s;
    psurf_mesh_desc d;
    psurf_topology *topology = NULL;
    psurf_error error;
    uint32_t i;
    (void)state;
    good_cube(&s);
#define BAD(change) (d = s.desc, change, expect_bad_desc(&d, __LINE__))
    BAD(d._start_canary = 1);
    BAD(d._end_canary = 0x80000000u);
    BAD(d.face_vertices = NULL);
    BAD((d.edge_count = 1, d.edges = NULL));
    BAD(d.flags = 0x80000000u);
    BAD(d.flags = PSURF_CUT_BAD_EDGES << 1);
    BAD((d.corner_count = 1, d.corners = NULL));
    BAD(d.position_stride = 3 * sizeof(psurf_real) + 1);
    for (i = 0; i < COUNT_OF(bad_blends); i++)
        BAD((d.flags = PSURF_DEFAULT_BLEND, d.default_blend = bad_blends[i]));
#undef BAD
    d = s.desc;
    d.default_blend = 7;                                /* not looked at without its flag */
    assert_int_equal(create(&d, &error), PSURF_OK);
    d.allocator.release = NULL;
    assert_int_equal(psurf_topology_create(&d, &topology, &error), PSURF_BAD_DESC);
    d = s.desc;
    d.allocator.release = pool_release;
    d.allocator.alloc = NULL;
    assert_int_equal(psurf_topology_create(&d, &topology, &error), PSURF_BAD_DESC);
    assert_int_equal(psurf_topology_create(NULL, &topology, &error), PSURF_BAD_DESC);
    assert_int_equal(error.result, PSURF_BAD_DESC);
    assert_int_equal(psurf_topology_create(&s.desc, NULL, &error), PSURF_BAD_DESC);
    assert_null(topology);
    psurf_topology_destroy(NULL);
    surface_free(&s);
}

/* Counts that lie about the arrays: refused from the numbers alone, or by the allocator. */
static void test_sizes(void **state)
{
    surface s;
    psurf_error error;
    psurf_result result;
    (void)state;
    good_cube(&s);
    s.desc.positions = NULL;
    s.desc.vertex_count = 0xFFFFFFFFu;
    assert_int_equal(create(&s.desc, &error), PSURF_TOO_LARGE);
    s.desc.vertex_count = 0x7FFFFFFFu;
    result = create(&s.desc, &error);
    assert_true(result == PSURF_OUT_OF_MEMORY || result == PSURF_TOO_LARGE);
    s.desc.vertex_count = 8;
    s.desc.face_sizes = NULL;
    s.desc.uniform_size = 5;
    s.desc.face_count = 0x30000000u;                    /* 5 times that does not fit 31 bits */
    assert_int_equal(create(&s.desc, &error), PSURF_TOO_LARGE);
    s.desc.uniform_size = 2;
    assert_int_equal(create(&s.desc, &error), PSURF_BAD_FACE);
    s.desc.face_count = 0xFFFFFFFFu;
    s.desc.uniform_size = PSURF_MAX_FACE_SIZE + 1;
    assert_int_equal(create(&s.desc, &error), PSURF_BAD_FACE);
    surface_free(&s);
}

/* ---- memory ---------------------------------------------------------------------------------- */

/* A mesh with everything that takes memory, tags included. */
static void describe_creature(surface *s, mesh *m)
{
    edge_map map;
    *m = make_creature();
    map = map_edges(m);
    mesh_tag(m, map.edges[0].from, map.edges[0].to, 0.25f, 0.5f);
    mesh_tag(m, map.edges[60].from, map.edges[60].to, 0.25f, 0.5f);
    free(map.edges);
    surface_describe(s, m);
}

static void expect_all_zero(const psurf_smooth_mesh *m)
{
    assert_true(!m->vertex_count && !m->index_count && !m->bytes);
    assert_true(!m->positions && !m->normals && !m->indices && !m->where);
    assert_true(!m->allocator.alloc && !m->allocator.release && !m->allocator.ctx);
}

static psurf_result smooth_and_free(const psurf_mesh_desc *desc)
{
    psurf_smooth_mesh out;
    psurf_error error;
    psurf_result result;
    memset(&out, 0xEE, sizeof out);
    result = psurf_smooth(desc, 3, &out, &error);
    assert_int_equal(error.result, result);
    provoked[result]++;
    if (result != PSURF_OK) expect_all_zero(&out);
    psurf_smooth_free(&out);
    expect_all_zero(&out);
    psurf_smooth_free(&out);
    return result;
}

static psurf_result topology_and_free(const psurf_mesh_desc *desc)
{
    psurf_topology *topology;
    psurf_error error;
    psurf_result result = psurf_topology_create(desc, &topology, &error);
    provoked[result]++;
    if (result != PSURF_OK) assert_null(topology);
    psurf_topology_destroy(topology);
    return result;
}

/* Every allocation refused in turn, alone and with all after it: reported, nothing left behind. */
static void test_refused_memory(void **state)
{
    static psurf_result (*const calls[2])(const psurf_mesh_desc *) = {topology_and_free,
                                                                       smooth_and_free};
    static const unsigned refuse[2] = {1, 0xFFFFFFFFu};
    surface s;
    mesh m;
    uint32_t i, k, n;
    pool p;
    (void)state;
    describe_creature(&s, &m);
    for (i = 0; i < 2; i++) {
        unsigned count;
        s.desc.allocator = pool_of(&p);
        assert_int_equal(calls[i](&s.desc), PSURF_OK);
        assert_int_equal(p.live_count, 0);
        count = p.calls;
        print_message("%u allocations, at most %lu bytes\n", count, (unsigned long)p.peak);
        assert_int_equal(count, i == 0 ? 3 : 5);
        for (n = 0; n < count; n++)
            for (k = 0; k < 2; k++) {
                s.desc.allocator = pool_of(&p);
                p.refuse_from = n;
                p.refuse_count = refuse[k];
                assert_int_equal(calls[i](&s.desc), PSURF_OUT_OF_MEMORY);
                assert_int_equal(p.live_count, 0);
            }
    }
    surface_free(&s);
    mesh_free(&m);
}

/* The topology holds what it says it holds; nothing else allocates, neither through the allocator
   nor behind its back. */
static void test_who_allocates(void **state)
{
    surface s;
    mesh m;
    pool p;
    unsigned long before = stdlib_calls;
    psurf_check_result check;
    psurf_tess_desc tess;
    psurf_tess_span span;
    psurf_tess_out out;
    psurf_real box[6], gauss, mean;
    psurf_sample sample = make_sample(3, 0, 0.25, 0.25);
    float values[512] = {0}, value;
    unsigned calls;
    (void)state;
    describe_creature(&s, &m);
    s.desc.allocator = pool_of(&p);
    surface_make(&s);
    calls = p.calls;
    assert_int_equal(calls, 3);
    assert_int_equal(p.live_count, 1);
    assert_int_equal(p.bytes, s.info.bytes);
    assert_int_equal(p.peak, s.info.peak_bytes);
    eval_at(&s.patches, sample);
    psurf_curvature(&s.patches, &sample, 1, &gauss, &mean);
    psurf_bounds(&s.patches, 0, 1, box);
    assert_true(s.first[m.face_count] <= COUNT_OF(values));
    psurf_interpolate(s.topology, &sample, 1, values, 1, &value, 0);
    assert_int_equal(psurf_check(&s.patches, &s.construct, 4, 0, NONE, &check), PSURF_OK);
    assert_true(psurf_find_spoke(s.topology, m.tags[0].v0, m.tags[0].v1) != NONE);
    memset(&tess, 0, sizeof tess);
    memset(&out, 0, sizeof out);
    tess.rate = 5;
    assert_int_equal(psurf_tessellate_size(s.topology, &tess, 0, NONE, &span), PSURF_OK);
    out.p = (psurf_real *)grab(span.vertex_count, 3 * sizeof(psurf_real));
    out.n = (psurf_real *)grab(span.vertex_count, 3 * sizeof(psurf_real));
    out.indices = grab(span.index_count, sizeof(uint32_t));
    assert_int_equal(psurf_tessellate(&s.patches, &tess, 0, NONE, &out), PSURF_OK);
    free(out.p);
    free(out.n);
    free(out.indices);
    assert_int_equal(p.calls, calls);
    assert_int_equal(stdlib_calls, before);
    surface_free(&s);
    assert_int_equal(p.live_count, 0);
    assert_int_equal(stdlib_calls, before);
    /* without an allocator it is malloc and free, in pairs: that the counting works */
    surface_describe(&s, &m);
    surface_make(&s);
    assert_int_equal(stdlib_calls, before + 5);      /* three times malloc, twice free */
    surface_free(&s);
    assert_int_equal(stdlib_calls, before + 6);
    mesh_free(&m);
}

/* ---- the other calls ------------------------------------------------------------------------- */

#define BAD_DESC(call) assert_int_equal((call), PSURF_BAD_DESC)

static void test_construct_errors(void **state)
{
    surface s;
    psurf_patches patches;
    psurf_patches_layout layout;
    psurf_construct_desc d;
    mesh m = make_cube();
    (void)state;
    surface_build(&s, &m);
    BAD_DESC(psurf_patches_size(NULL, PSURF_PM, &layout));
    BAD_DESC(psurf_patches_size(s.topology, PSURF_PM, NULL));
    BAD_DESC(psurf_patches_size(s.topology, PSURF_SCHEME_COUNT, &layout));
    BAD_DESC(psurf_patches_size(s.topology, (psurf_scheme)77, &layout));
    BAD_DESC(psurf_patches_bind(NULL, s.topology, PSURF_PM, s.memory, s.scratch));
    BAD_DESC(psurf_patches_bind(&patches, NULL, PSURF_PM, s.memory, s.scratch));
    BAD_DESC(psurf_patches_bind(&patches, s.topology, PSURF_SCHEME_COUNT, s.memory, s.scratch));
    BAD_DESC(psurf_patches_bind(&patches, s.topology, PSURF_PM, NULL, s.scratch));
    BAD_DESC(psurf_patches_bind(&patches, s.topology, PSURF_PM, s.memory + 1, s.scratch));
    BAD_DESC(psurf_patches_bind(&patches, s.topology, PSURF_PM, s.memory, s.scratch + 1));
    assert_int_equal(psurf_patches_bind(&patches, s.topology, PSURF_PM, s.memory, NULL), PSURF_OK);
    BAD_DESC(psurf_construct(&patches, &s.construct));          /* no scratch */
    BAD_DESC(psurf_construct(NULL, &s.construct));
    BAD_DESC(psurf_construct(&s.patches, NULL));
    BAD_DESC(psurf_construct_pass(&s.patches, &s.construct, PSURF_PASS_COUNT, 0, 1));
#define BAD(change) (d = s.construct, change, psurf_construct(&s.patches, &d))
    BAD_DESC(BAD(d._start_canary = 1));
    BAD_DESC(BAD(d._end_canary = 1));
    BAD_DESC(BAD(d.positions = NULL));
    BAD_DESC(BAD(d.position_stride = 3 * sizeof(psurf_real) + 2));
#undef BAD
    surface_free(&s);
    mesh_free(&m);
}

static void test_tessellate_errors(void **state)
{
    surface s;
    mesh m = make_torus(6, 6);
    psurf_tess_desc good, d;
    psurf_tess_span span;
    psurf_tess_out out;
    psurf_check_result check;
    (void)state;
    surface_build(&s, &m);
    memset(&good, 0, sizeof good);
    memset(&out, 0, sizeof out);
    good.rate = 2;
    assert_int_equal(psurf_tessellate(&s.patches, &good, 0, NONE, &out), PSURF_OK);
#define SIZE(change) (d = good, change, psurf_tessellate_size(s.topology, &d, 0, NONE, &span))
#define TESS(change) (d = good, change, psurf_tessellate(&s.patches, &d, 0, NONE, &out))
#define BOTH(change, result) \
    (assert_int_equal(SIZE(change), result), assert_int_equal(TESS(change), result))
    BOTH(d._start_canary = 1, PSURF_BAD_DESC);
    BOTH(d._end_canary = 1, PSURF_BAD_DESC);
    BOTH(d.rate = 0, PSURF_BAD_DESC);
    BOTH(d.rate = PSURF_MAX_RATE + 1, PSURF_BAD_DESC);
    BOTH(d.rate = 0xFFFFFFFFu, PSURF_BAD_DESC);
    BOTH(d.flags = 4, PSURF_BAD_DESC);
    BOTH(d.rate = PSURF_MAX_RATE, PSURF_TOO_LARGE);             /* 36 faces of 2^28 samples */
    BOTH((d.rate = PSURF_MAX_RATE, d.flags = PSURF_TESS_PER_FACE), PSURF_TOO_LARGE);
    BOTH((d.rate = 64, d.flags = PSURF_TESS_INDEX16), PSURF_TOO_LARGE);
    provoked[PSURF_TOO_LARGE]++;
#undef SIZE
#undef TESS
#undef BOTH
    BAD_DESC(psurf_tessellate_size(NULL, &good, 0, 1, &span));
    BAD_DESC(psurf_tessellate_size(s.topology, NULL, 0, 1, &span));
    BAD_DESC(psurf_tessellate_size(s.topology, &good, 0, 1, NULL));
    BAD_DESC(psurf_tessellate(NULL, &good, 0, 1, &out));
    BAD_DESC(psurf_tessellate(&s.patches, NULL, 0, 1, &out));
    BAD_DESC(psurf_tessellate(&s.patches, &good, 0, 1, NULL));
    out.p_stride = 13;
    BAD_DESC(psurf_tessellate(&s.patches, &good, 0, 1, &out));
    BAD_DESC(psurf_check(NULL, &s.construct, 1, 0, 1, &check));
    BAD_DESC(psurf_check(&s.patches, NULL, 1, 0, 1, &check));
    BAD_DESC(psurf_check(&s.patches, &s.construct, 0, 0, 1, &check));
    BAD_DESC(psurf_check(&s.patches, &s.construct, PSURF_MAX_RATE + 1, 0, 1, &check));
    BAD_DESC(psurf_check(&s.patches, &s.construct, 1, 0, 1, NULL));
    surface_free(&s);
    mesh_free(&m);
}

static void test_smooth_errors(void **state)
{
    surface s;
    psurf_smooth_mesh out;
    psurf_error error;
    psurf_mesh_desc d;
    (void)state;
    good_cube(&s);
    BAD_DESC(psurf_smooth(NULL, 1, &out, &error));
    BAD_DESC(psurf_smooth(&s.desc, 1, NULL, &error));
    BAD_DESC(psurf_smooth(&s.desc, 0, &out, &error));
    BAD_DESC(psurf_smooth(&s.desc, PSURF_MAX_RATE + 1, &out, &error));
    d = s.desc;
    d.positions = NULL;
    BAD_DESC(psurf_smooth(&d, 1, &out, &error));
    assert_int_equal(error.result, PSURF_BAD_DESC);
    d = s.desc;
    s.vertices[4] = s.vertices[5];
    assert_int_equal(psurf_smooth(&d, 1, &out, &error), PSURF_BAD_FACE);
    assert_true(error.face == 1 && error.corner == 1 && error.vertex == s.vertices[5]);
    assert_null(out.positions);
    psurf_smooth_free(&out);
    psurf_smooth_free(NULL);
    surface_free(&s);
}

/* ---- the list -------------------------------------------------------------------------------- */

/* A code that this program did not see is a code that nothing tests. Runs last. */
static void test_every_result(void **state)
{
    int i;
    (void)state;
#define SEEN(name, text) REQUIRE(provoked[PSURF_##name] > 0, "%s never provoked\n", #name);
    PSURF_RESULTS(SEEN)
#undef SEEN
    for (i = 0; i < PSURF_RESULT_COUNT; i++) {
        const char *text = psurf_result_string((psurf_result)i);
        int k;
        assert_true(text && strlen(text) > 1);
        for (k = 0; k < i; k++) assert_string_not_equal(text, psurf_result_string((psurf_result)k));
    }
    assert_non_null(psurf_result_string(PSURF_RESULT_COUNT));
    assert_non_null(psurf_result_string((psurf_result)-1));
    assert_string_equal(psurf_scheme_name(PSURF_PM), "pm");
    assert_null(psurf_scheme_name(PSURF_SCHEME_COUNT));
    assert_string_equal(psurf_kind_name(PSURF_BICUBIC), "bicubic");
    assert_null(psurf_kind_name(PSURF_KIND_COUNT));
    assert_int_equal(psurf_version(), PSURF_VERSION);
    assert_int_equal(psurf_abi(), PSURF_VERSION << 8 | sizeof(psurf_real));
    assert_int_equal(psurf_exact(), 1);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_bad_meshes),        cmocka_unit_test(test_bad_positions),
        cmocka_unit_test(test_bad_tags),          cmocka_unit_test(test_bad_corners),
        cmocka_unit_test(test_bad_descriptors),
        cmocka_unit_test(test_sizes),             cmocka_unit_test(test_refused_memory),
        cmocka_unit_test(test_who_allocates),     cmocka_unit_test(test_construct_errors),
        cmocka_unit_test(test_tessellate_errors), cmocka_unit_test(test_smooth_errors),
        cmocka_unit_test(test_bad_schemes),
        cmocka_unit_test(test_every_result)};
    return cmocka_run_group_tests_name("errors", tests, NULL, NULL);
}
