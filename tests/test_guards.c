/* What ordinary meshes never meet: ranges that begin beyond their memory, sizes far from 1,
   needles, normals that vanish or nearly do. */
#include "patchsurf.h"

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stdlib.h>
#include <string.h>
#include <cmocka.h>

static const psurf_real cube[8][3] = {{-1, -1, -1}, {1, -1, -1}, {1, 1, -1}, {-1, 1, -1},
                                      {-1, -1, 1},  {1, -1, 1},  {1, 1, 1},  {-1, 1, 1}};
static const uint32_t faces[6][4] = {{3, 2, 1, 0}, {4, 5, 6, 7}, {0, 1, 5, 4},
                                     {1, 2, 6, 5}, {2, 3, 7, 6}, {3, 0, 4, 7}};

typedef struct surface {
    psurf_real positions[8][3];
    psurf_topology *topology;
    psurf_patches patches;
    psurf_construct_desc construct;
} surface;

/* A box: the cube times a size in each direction; blend: of every edge. */
static void open_box(surface *s, double x, double y, double z, double blend)
{
    psurf_mesh_desc desc;
    psurf_patches_layout layout;
    uint32_t i;
    memset(s, 0, sizeof *s);
    memset(&desc, 0, sizeof desc);
    for (i = 0; i < 8; i++) {
        s->positions[i][0] = (psurf_real)(x * (double)cube[i][0]);
        s->positions[i][1] = (psurf_real)(y * (double)cube[i][1]);
        s->positions[i][2] = (psurf_real)(z * (double)cube[i][2]);
    }
    desc.vertex_count = 8;
    desc.face_count = 6;
    desc.uniform_size = 4;
    desc.face_vertices = faces[0];
    desc.flags = PSURF_DEFAULT_BLEND;
    desc.default_blend = (psurf_real)blend;
    assert_int_equal(psurf_topology_create(&desc, &s->topology, NULL), PSURF_OK);
    assert_int_equal(psurf_patches_size(s->topology, PSURF_PM, &layout), PSURF_OK);
    assert_int_equal(psurf_patches_bind(&s->patches, s->topology, PSURF_PM,
                                        malloc(layout.patch_bytes), malloc(layout.scratch_bytes)),
                     PSURF_OK);
    s->construct.positions = s->positions[0];
    assert_int_equal(psurf_construct(&s->patches, &s->construct), PSURF_OK);
}

static void close_box(surface *s)
{
    free(s->patches.patches);
    free(s->patches.scratch);
    psurf_topology_destroy(s->topology);
}

/* Output memory that begins after the range would be written before its start. */
static void test_ranges_before_memory(void **state)
{
    surface s;
    psurf_tess_desc tess = {0, 3, PSURF_TESS_PER_FACE, 0};
    psurf_tess_span span;
    psurf_tess_out out;
    psurf_real p[3 * 16];
    (void)state;
    open_box(&s, 1, 1, 1, 2.0 / 3.0);
    memset(&out, 0, sizeof out);
    out.p = p;
    assert_int_equal(psurf_tessellate_size(s.topology, &tess, 2, 1, &span), PSURF_OK);
    out.first_vertex = span.first_vertex;
    out.first_index = span.first_index;
    assert_int_equal(psurf_tessellate(&s.patches, &tess, 2, 1, &out), PSURF_OK);
    assert_int_equal(psurf_tessellate(&s.patches, &tess, 1, 1, &out), PSURF_BAD_DESC);
    out.first_vertex = 0;
    assert_int_equal(psurf_tessellate(&s.patches, &tess, 1, 1, &out), PSURF_BAD_DESC);
    close_box(&s);
}

/* Normals do not depend on the size of the mesh, down to the last digits that floats have. */
static void test_normals_at_any_size(void **state)
{
    static const double sizes[] = {1, 1e-30, 1e-12, 1e-3, 1e9, 1e30};
    psurf_sample sample = {2, 0, (psurf_real)0.3, (psurf_real)0.8};
    psurf_real expected[3], n[3];
    psurf_points out;
    uint32_t i, k;
    (void)state;
    memset(&out, 0, sizeof out);
    for (i = 0; i < sizeof sizes / sizeof sizes[0]; i++) {
        surface s;
        open_box(&s, sizes[i], 2 * sizes[i], 3 * sizes[i], 2.0 / 3.0);
        out.n = n;
        psurf_eval(&s.patches, &sample, 1, &out);
        if (i == 0) memcpy(expected, n, sizeof n);
        for (k = 0; k < 3; k++) assert_true(fabs((double)n[k] - (double)expected[k]) < 1e-6);
        close_box(&s);
    }
}

/* On a crease of blend ratio 0 du x dv vanishes: the normal is that of the face, a bit inside. */
static void test_normals_on_creases(void **state)
{
    psurf_sample sample = {1, 0, (psurf_real)0.5, 0};
    psurf_real n[3];
    psurf_points out;
    surface s;
    (void)state;
    memset(&out, 0, sizeof out);
    out.n = n;
    open_box(&s, 1, 1, 1, 0);
    psurf_eval(&s.patches, &sample, 1, &out);
    assert_true(fabs((double)n[0]) < 1e-5 && fabs((double)n[1]) < 1e-5 && (double)n[2] > 0.9999);
    close_box(&s);
}

/* A box closed to a third of a degree is degenerate along its sharp faces, and counted as such. */
static void test_needles(void **state)
{
    psurf_check_result r;
    surface s;
    uint32_t i;
    (void)state;
    open_box(&s, 1, 1, 1, 2.0 / 3.0);
    assert_int_equal(psurf_check(&s.patches, &s.construct, 4, 0, PSURF_NONE, &r), PSURF_OK);
    assert_int_equal(r.degenerate, 0);
    for (i = 0; i < 8; i++)                             /* the far side shrinks to a blade */
        if (s.positions[i][0] > 0) s.positions[i][1] *= (psurf_real)1e-3;
    assert_int_equal(psurf_construct(&s.patches, &s.construct), PSURF_OK);
    assert_int_equal(psurf_check(&s.patches, &s.construct, 4, 0, PSURF_NONE, &r), PSURF_OK);
    assert_int_equal(r.degenerate, 0);                  /* a blade has no needle corner, */
    for (i = 0; i < 8; i++)
        if (s.positions[i][0] > 0) s.positions[i][2] *= (psurf_real)1e-3;
    s.positions[0][1] = s.positions[3][1] = 0;          /* two corners of a side in one line do */
    s.positions[4][1] = s.positions[7][1] = 0;
    assert_int_equal(psurf_construct(&s.patches, &s.construct), PSURF_OK);
    assert_int_equal(psurf_check(&s.patches, &s.construct, 4, 0, PSURF_NONE, &r), PSURF_OK);
    assert_true(r.degenerate > 0);
    assert_int_equal(r.cracks, 0);
    close_box(&s);
}

/* A flat grid of 6 x 6 quads with a hard row, and a hard panel on one side of it. The panel is
   split, yet at its corner on the row the straight side stays wide: du x dv does not vanish. */
static void test_junction_beside_panel(void **state)
{
    enum { N = 6, W = N + 1 };
    psurf_real positions[W * W][3], du[3], dv[3];
    uint32_t quads[N * N][4], tags = 0, i, x, y;
    psurf_edge_tag tag[N + 3];
    psurf_mesh_desc desc;
    psurf_topology *topology;
    psurf_patches_layout layout;
    psurf_patches patches;
    psurf_construct_desc construct;
    psurf_sample sample = {N + 2, 0, 0, 1};             /* quad (2, 1): its corner (2, 2) */
    psurf_points out;
    (void)state;
    for (i = 0; i < W * W; i++) {
        positions[i][0] = (psurf_real)(i % W);
        positions[i][1] = (psurf_real)(i / W);
        positions[i][2] = 0;
    }
    for (y = 0; y < N; y++)
        for (x = 0; x < N; x++) {
            uint32_t *q = quads[y * N + x], v = y * W + x;
            q[0] = v;
            q[1] = v + 1;
            q[2] = v + W + 1;
            q[3] = v + W;
        }
    memset(tag, 0, sizeof tag);
    for (x = 0; x < N; x++, tags++) {
        tag[tags].v0 = 2 * W + x;
        tag[tags].v1 = 2 * W + x + 1;
    }
    for (i = 0; i < 3; i++, tags++) {                   /* the other sides of quad (2, 2) */
        const uint32_t *q = quads[2 * N + 2];
        tag[tags].v0 = q[i + 1];
        tag[tags].v1 = q[(i + 2) % 4];
    }
    for (i = 0; i < tags; i++) tag[i].flags = PSURF_HARD;
    memset(&desc, 0, sizeof desc);
    desc.vertex_count = W * W;
    desc.face_count = N * N;
    desc.uniform_size = 4;
    desc.face_vertices = quads[0];
    desc.edges = tag;
    desc.edge_count = tags;
    assert_int_equal(psurf_topology_create(&desc, &topology, NULL), PSURF_OK);
    assert_int_equal(psurf_patches_size(topology, PSURF_PM, &layout), PSURF_OK);
    assert_int_equal(psurf_patches_bind(&patches, topology, PSURF_PM, malloc(layout.patch_bytes),
                                        malloc(layout.scratch_bytes)), PSURF_OK);
    memset(&construct, 0, sizeof construct);
    construct.positions = positions[0];
    assert_int_equal(psurf_construct(&patches, &construct), PSURF_OK);
    memset(&out, 0, sizeof out);
    out.du = du;
    out.dv = dv;
    psurf_eval(&patches, &sample, 1, &out);
    assert_true((double)(du[0] * dv[1] - du[1] * dv[0]) > 0.5);
    free(patches.patches);
    free(patches.scratch);
    psurf_topology_destroy(topology);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_ranges_before_memory),
        cmocka_unit_test(test_normals_at_any_size),
        cmocka_unit_test(test_normals_on_creases),
        cmocka_unit_test(test_needles),
        cmocka_unit_test(test_junction_beside_panel),
    };
    return cmocka_run_group_tests_name("guards", tests, NULL, NULL);
}
