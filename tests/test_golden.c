/* Control points, vertex data and samples against an independent float64 reference (tests/data, see
   convert.py): to 1e-12 in double, to 2e-5 in float. */
#include "common.h"

typedef struct golden {
    FILE *file;
    const char *name;
    mesh m;
    surface s;
    double tolerance, worst;
    uint32_t compared;
} golden;

static void expect_word(golden *g, const char *word)
{
    char text[64];
    REQUIRE(fscanf(g->file, "%63s", text) == 1 && !strcmp(text, word), "%s: %s expected\n", g->name,
            word);
}

static uint32_t read_count(golden *g)
{
    unsigned long value = 0;
    REQUIRE(fscanf(g->file, "%lu", &value) == 1, "%s: count expected\n", g->name);
    return (uint32_t)value;
}

static double read_number(golden *g)
{
    double value = 0;
    REQUIRE(fscanf(g->file, "%lf", &value) == 1, "%s: number expected\n", g->name);
    return value;
}

static vec read_vec(golden *g)
{
    double x = read_number(g), y = read_number(g), z = read_number(g);
    return make_vec(x, y, z);
}

static void compare(golden *g, vec ours, vec theirs, const char *what, uint32_t face,
                    uint32_t index)
{
    double error = distance(ours, theirs);
    REQUIRE(error <= g->tolerance, "%s: %s of %u, number %u: off by %g\n", g->name, what,
            (unsigned)face, (unsigned)index, error);
    if (error > g->worst) g->worst = error;
    g->compared++;
}

static void read_mesh(golden *g)
{
    uint32_t vertices, faces, i, k, v[MESH_MAX_CORNERS];
    expect_word(g, "mesh");
    vertices = read_count(g);
    faces = read_count(g);
    for (i = 0; i < vertices; i++) mesh_point(&g->m, read_vec(g));
    for (i = 0; i < faces; i++) {
        uint32_t size = read_count(g);
        REQUIRE(size <= MESH_MAX_CORNERS, "%s: face %u\n", g->name, (unsigned)i);
        for (k = 0; k < size; k++) v[k] = read_count(g);
        mesh_face(&g->m, size, v);
    }
}

static double blend_of(double (*rows)[3], uint32_t count, uint32_t v, uint32_t w)
{
    uint32_t i;
    for (i = 0; i < count; i++)
        if ((uint32_t)rows[i][0] == v && (uint32_t)rows[i][1] == w) return rows[i][2];
    return 2.0 / 3.0;
}

static void read_blends(golden *g)
{
    double (*rows)[3];
    uint32_t count, i;
    expect_word(g, "alpha");
    REQUIRE(read_number(g) == 2.0 / 3.0, "%s: other default\n", g->name);
    expect_word(g, "blends");
    count = read_count(g);
    rows = (double (*)[3])grab(count, sizeof *rows);
    for (i = 0; i < count; i++) {
        rows[i][0] = read_count(g);
        rows[i][1] = read_count(g);
        rows[i][2] = read_number(g);
    }
    for (i = 0; i < count; i++) {               /* one tag per edge, from its first row */
        uint32_t v = (uint32_t)rows[i][0], w = (uint32_t)rows[i][1], k = 0;
        while ((uint32_t)rows[k][0] != w || (uint32_t)rows[k][1] != v)
            if (++k == count) break;
        if (k >= i) mesh_tag(&g->m, v, w, rows[i][2], blend_of(rows, count, w, v));
    }
    free(rows);
}

static void read_marks(golden *g)
{
    uint32_t count, v;
    expect_word(g, "hard");
    for (count = read_count(g); count > 0; count--) {
        v = read_count(g);
        mesh_hard(&g->m, v, read_count(g));
    }
    expect_word(g, "corners");
    for (count = read_count(g); count > 0; count--) mesh_corner(&g->m, read_count(g));
}

/* The ring of a vertex whose facet begins at the spoke to end: of the two rings beside a hard edge
   not the one that the edge ends. */
static uint32_t find_ring(const golden *g, uint32_t vertex, uint32_t end)
{
    const psurf_ring *rings = (const psurf_ring *)g->s.tables.rings.data;
    const psurf_spoke *spokes = (const psurf_spoke *)g->s.tables.spokes.data;
    uint32_t i, k;
    for (i = 0; i < g->s.tables.rings.count; i++) {
        uint32_t open = (rings[i].valence & PSURF_RING_OPEN) != 0;
        uint32_t facets = (rings[i].valence & PSURF_RING_VALENCE) - open;
        for (k = 0; rings[i].point == vertex && k < facets; k++)
            if (spokes[rings[i].first_spoke + k].end == end) return i;
    }
    REQUIRE(0, "%s: vertex %u has no ring with %u\n", g->name, (unsigned)vertex, (unsigned)end);
    return 0;
}

/* Limit points, tangent points and face points, through the layout of the scratch. A closed ring
   may begin at another spoke than the reference's; an open one begins at its sharp spoke. */
static void compare_ring(golden *g)
{
    uint32_t vertex = read_count(g), closed = read_count(g), n = read_count(g);
    uint32_t facets = read_count(g), turn = 0, index = 0, k;
    const psurf_ring *ring = NULL;
    const psurf_spoke *spokes = NULL;
    vec limit = read_vec(g);
    REQUIRE(facets == n - !closed, "%s: facets of %u\n", g->name, (unsigned)vertex);
    for (k = 0; k < n; k++) {
        uint32_t end = read_count(g);
        if (k == 0) {
            index = find_ring(g, vertex, end);
            ring = (const psurf_ring *)g->s.tables.rings.data + index;
            spokes = (const psurf_spoke *)g->s.tables.spokes.data + ring->first_spoke;
            REQUIRE((ring->valence & PSURF_RING_VALENCE) == n
                    && !(ring->valence & PSURF_RING_OPEN) == (closed != 0), "%s: valence of %u\n",
                    g->name, (unsigned)vertex);
            while (closed && spokes[turn].end != end) turn++;
            compare(g, limit_point(&g->s, index), limit, "limit point", vertex, 0);
        }
        REQUIRE(spokes[(turn + k) % n].end == end, "%s: spokes of %u\n", g->name,
                (unsigned)vertex);
        compare(g, spoke_point(&g->s, ring->first_spoke + (turn + k) % n, 0), read_vec(g),
                "tangent point", vertex, k);
    }
    for (k = 0; k < facets; k++)
        compare(g, spoke_point(&g->s, ring->first_spoke + (turn + k) % n, 1), read_vec(g),
                "face point", vertex, k);
}

static void compare_patch(golden *g)
{
    static const char *const names[PSURF_KIND_COUNT] = {"ordinary", "polar", "p3", "p4", "p5"};
    uint32_t face = read_count(g), piece = read_count(g), count, k;
    psurf_patch patch = psurf_get_patch(&g->s.patches, patch_of(&g->s, face) + piece);
    REQUIRE(patch.face == face && patch.sector == piece, "%s: patch of %u\n", g->name,
            (unsigned)face);
    expect_word(g, names[patch.kind]);
    count = read_count(g);
    REQUIRE(patch.point_count == count, "%s: points of %u\n", g->name, (unsigned)face);
    for (k = 0; k < count; k++)
        compare(g, load(patch.points + 3 * k), read_vec(g), "control points", face, k);
}

static void compare_sample(golden *g, uint32_t index)
{
    uint32_t face = read_count(g), sector = read_count(g);
    double u = read_number(g), v = read_number(g);
    point ours = eval_at(&g->s.patches, make_sample(face, sector, u, v));
    compare(g, ours.p, read_vec(g), "position", face, index);
    compare(g, ours.n, read_vec(g), "normal", face, index);
}

static void test_file(void **state)
{
    golden g;
    char path[256];
    uint32_t count, i;
    memset(&g, 0, sizeof g);
    g.name = (const char *)*state;
    g.tolerance = IS_DOUBLE ? 1e-12 : 2e-5;
    snprintf(path, sizeof path, "%s/%s.txt", PSURF_TEST_DATA, g.name);
    g.file = fopen(path, "r");
    REQUIRE(g.file, "cannot open %s\n", path);
    expect_word(&g, "golden");
    REQUIRE(fscanf(g.file, "%*s") == 0, "%s: name\n", g.name);
    read_mesh(&g);
    read_blends(&g);
    read_marks(&g);
    surface_build(&g.s, &g.m);
    expect_word(&g, "rings");
    for (i = 0, count = read_count(&g); i < count; i++) compare_ring(&g);
    assert_int_equal(count, g.s.info.rings);
    expect_word(&g, "patches");
    for (i = 0, count = read_count(&g); i < count; i++) compare_patch(&g);
    assert_int_equal(count, g.s.info.facets);
    expect_word(&g, "samples");
    for (i = 0, count = read_count(&g); i < count; i++) compare_sample(&g, i);
    assert_true(count >= 100);
    print_message("%s: %u vectors, largest difference %.2g (allowed %.2g)\n", g.name,
                  (unsigned)g.compared, g.worst, g.tolerance);
    fclose(g.file);
    surface_free(&g.s);
    mesh_free(&g.m);
}

#define GOLDEN(name) {name, test_file, NULL, NULL, (void *)(uintptr_t)name}

int main(void)
{
    const struct CMUnitTest tests[] = {GOLDEN("pm_cube"), GOLDEN("pm_latlong6_jitter"),
                                       GOLDEN("pm_octahedron_jitter"), GOLDEN("pm_torus_jitter"),
                                       GOLDEN("pm_sym_cube_loop"), GOLDEN("pm_open_grid"),
                                       GOLDEN("pm_t_corners"), GOLDEN("pm_hard_cube_loop"),
                                       GOLDEN("pm_hard_torus")};
    return cmocka_run_group_tests_name("golden", tests, NULL, NULL);
}
