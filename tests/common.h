/* What the tests share: random numbers, meshes, a second opinion on connectivity, and the few
   vectors the checks need. Programs are linked with the implementation, a unit of its own.

   Generators compute in integers and scale by a power of two, so that their positions have the
   same bits under every compiler and flag, contraction included. Tests run at the top of the
   checkout. */
#ifndef PSURF_TESTS_COMMON_H
#define PSURF_TESTS_COMMON_H

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#ifdef __cplusplus
extern "C" {
#endif
#include <cmocka.h>
#ifdef __cplusplus
}
#endif

#include "patchsurf.h"

#ifndef PSURF_TEST_DATA
#define PSURF_TEST_DATA "tests/data"
#endif

#if defined(__GNUC__)
#define UNUSED __attribute__((unused))
#else
#define UNUSED
#endif

#define IS_DOUBLE (sizeof(psurf_real) == sizeof(double))
#define COUNT_OF(array) (sizeof(array) / sizeof((array)[0]))
#define PI 3.14159265358979323846
#define PM_KINDS 5u                     /* kinds of patch that the scheme pm makes: the first */

/* Stops the test with a message unless the condition holds. */
#define REQUIRE(condition, ...)                                                                    \
    do {                                                                                           \
        if (!(condition)) {                                                                        \
            print_error("%s: ", #condition);                                                       \
            print_error(__VA_ARGS__);                                                              \
            fail();                                                                                \
        }                                                                                          \
    } while (0)

static UNUSED void *grab(size_t count, size_t size)
{
    void *memory = calloc(count ? count : 1, size ? size : 1);
    if (!memory) {
        fputs("tests: out of memory\n", stderr);
        exit(1);
    }
    return memory;
}

/* ---- random numbers: splitmix64 -------------------------------------------------------------- */

static UNUSED uint64_t random_bits(uint64_t *state)
{
    uint64_t z = (*state += 0x9E3779B97F4A7C15u);
    z = (z ^ (z >> 30)) * 0xBF58476D1CE4E5B9u;
    z = (z ^ (z >> 27)) * 0x94D049BB133111EBu;
    return z ^ (z >> 31);
}

static UNUSED uint32_t random_below(uint64_t *state, uint32_t bound)
{
    return (uint32_t)(((random_bits(state) >> 32) * bound) >> 32);
}

/* In [0, 1), a multiple of 2^-20: 1 - x is exact in every precision. */
static UNUSED double random_unit(uint64_t *state)
{
    return (double)(random_bits(state) >> 44) / 1048576.0;
}

/* ---- vectors --------------------------------------------------------------------------------- */

typedef struct vec { double x, y, z; } vec;

static UNUSED vec make_vec(double x, double y, double z)
{
    vec r;
    r.x = x, r.y = y, r.z = z;
    return r;
}
static UNUSED vec load(const psurf_real *p) { return make_vec(p[0], p[1], p[2]); }
static UNUSED vec add(vec a, vec b) { return make_vec(a.x + b.x, a.y + b.y, a.z + b.z); }
static UNUSED vec sub(vec a, vec b) { return make_vec(a.x - b.x, a.y - b.y, a.z - b.z); }
static UNUSED vec mul(double s, vec a) { return make_vec(s * a.x, s * a.y, s * a.z); }
static UNUSED vec mad(vec a, double s, vec b) { return add(a, mul(s, b)); }
static UNUSED double dot(vec a, vec b) { return a.x * b.x + a.y * b.y + a.z * b.z; }
static UNUSED double length(vec a) { return sqrt(dot(a, a)); }
static UNUSED double distance(vec a, vec b) { return length(sub(a, b)); }
static UNUSED vec unit(vec a) { return mul(1.0 / length(a), a); }
static UNUSED vec cross(vec a, vec b)
{
    return make_vec(a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x);
}
static UNUSED double angle_between(vec a, vec b) { return atan2(length(cross(a, b)), dot(a, b)); }
static UNUSED int is_finite_vec(vec a) { return isfinite(a.x) && isfinite(a.y) && isfinite(a.z); }
static UNUSED int same_bits(const psurf_real *a, const psurf_real *b)
{
    return memcmp(a, b, 3 * sizeof(psurf_real)) == 0;
}

static UNUSED vec random_vec(uint64_t *rng)
{
    double x = random_unit(rng), y = random_unit(rng), z = random_unit(rng);
    return make_vec(x, y, z);
}

/* ---- meshes ---------------------------------------------------------------------------------- */

enum { MESH_MAX_CORNERS = 16 };

typedef struct mesh_face_data { uint32_t size, v[MESH_MAX_CORNERS]; } mesh_face_data;
typedef struct mesh {
    uint32_t vertex_count, face_count, tag_count, corner_count;
    vec *positions;
    mesh_face_data *faces;
    psurf_edge_tag *tags;
    uint32_t *corners;                          /* vertices that stay in place */
    uint32_t vertex_room, face_room, tag_room, corner_room;
} mesh;

static UNUSED void mesh_free(mesh *m)
{
    free(m->positions);
    free(m->faces);
    free(m->tags);
    free(m->corners);
    memset(m, 0, sizeof *m);
}

static UNUSED void *mesh_grow(void *memory, uint32_t count, uint32_t *room, size_t size)
{
    if (count < *room) return memory;
    *room = *room ? *room * 2 : 64;
    memory = realloc(memory, *room * size);
    if (!memory) {
        fputs("tests: out of memory\n", stderr);
        exit(1);
    }
    return memory;
}

static UNUSED uint32_t mesh_point(mesh *m, vec p)
{
    m->positions = (vec *)mesh_grow(m->positions, m->vertex_count, &m->vertex_room, sizeof(vec));
    m->positions[m->vertex_count] = p;
    return m->vertex_count++;
}

static UNUSED void mesh_remove_face(mesh *m, uint32_t face)
{
    uint32_t i;
    m->face_count--;
    for (i = face; i < m->face_count; i++) m->faces[i] = m->faces[i + 1];
}

/* Fixed point: 65536 is 1. */
static UNUSED uint32_t mesh_vertex(mesh *m, int64_t x, int64_t y, int64_t z)
{
    return mesh_point(m, make_vec((double)x / 65536.0, (double)y / 65536.0, (double)z / 65536.0));
}

static UNUSED uint32_t mesh_face(mesh *m, uint32_t size, const uint32_t *v)
{
    mesh_face_data *f;
    m->faces = (mesh_face_data *)mesh_grow(m->faces, m->face_count, &m->face_room, sizeof *f);
    f = &m->faces[m->face_count];
    memset(f, 0, sizeof *f);
    f->size = size;
    memcpy(f->v, v, size * sizeof *v);
    return m->face_count++;
}

static UNUSED void mesh_tri(mesh *m, uint32_t a, uint32_t b, uint32_t c)
{
    uint32_t v[3];
    v[0] = a, v[1] = b, v[2] = c;
    mesh_face(m, 3, v);
}

static UNUSED void mesh_quad(mesh *m, uint32_t a, uint32_t b, uint32_t c, uint32_t d)
{
    uint32_t v[4];
    v[0] = a, v[1] = b, v[2] = c, v[3] = d;
    mesh_face(m, 4, v);
}

/* The tag of an edge, made where there is none. */
static UNUSED psurf_edge_tag *mesh_edge(mesh *m, uint32_t v0, uint32_t v1)
{
    psurf_edge_tag tag;
    uint32_t i;
    for (i = 0; i < m->tag_count; i++)
        if ((m->tags[i].v0 == v0 && m->tags[i].v1 == v1)
            || (m->tags[i].v0 == v1 && m->tags[i].v1 == v0)) return &m->tags[i];
    memset(&tag, 0, sizeof tag);
    tag.v0 = v0, tag.v1 = v1;
    m->tags = (psurf_edge_tag *)mesh_grow(m->tags, m->tag_count, &m->tag_room, sizeof tag);
    m->tags[m->tag_count] = tag;
    return &m->tags[m->tag_count++];
}

static UNUSED void mesh_tag(mesh *m, uint32_t v0, uint32_t v1, double blend0, double blend1)
{
    psurf_edge_tag *tag = mesh_edge(m, v0, v1);
    tag->flags |= PSURF_BLEND;
    tag->blend0 = (psurf_real)(tag->v0 == v0 ? blend0 : blend1);
    tag->blend1 = (psurf_real)(tag->v0 == v0 ? blend1 : blend0);
}

static UNUSED void mesh_hard(mesh *m, uint32_t v0, uint32_t v1)
{
    mesh_edge(m, v0, v1)->flags |= PSURF_HARD;
}

static UNUSED int mesh_is_hard(const mesh *m, uint32_t v, uint32_t w)
{
    uint32_t i;
    for (i = 0; i < m->tag_count; i++)
        if ((m->tags[i].flags & PSURF_HARD)
            && ((m->tags[i].v0 == v && m->tags[i].v1 == w)
                || (m->tags[i].v0 == w && m->tags[i].v1 == v))) return 1;
    return 0;
}

static UNUSED void mesh_corner(mesh *m, uint32_t vertex)
{
    m->corners = (uint32_t *)mesh_grow(m->corners, m->corner_count, &m->corner_room,
                                       sizeof *m->corners);
    m->corners[m->corner_count++] = vertex;
}

static UNUSED void *mesh_twice(const void *from, uint32_t room, size_t size)
{
    return room ? memcpy(grab(room, size), from, room * size) : NULL;
}

static UNUSED mesh mesh_copy(const mesh *from)
{
    mesh m = *from;
    m.positions = (vec *)mesh_twice(from->positions, from->vertex_room, sizeof(vec));
    m.faces = (mesh_face_data *)mesh_twice(from->faces, from->face_room, sizeof *m.faces);
    m.tags = (psurf_edge_tag *)mesh_twice(from->tags, from->tag_room, sizeof *m.tags);
    m.corners = (uint32_t *)mesh_twice(from->corners, from->corner_room, sizeof *m.corners);
    return m;
}

/* Appends other, moved by (dx, 0, 0): one more component. */
static UNUSED void mesh_append(mesh *m, const mesh *other, double dx)
{
    uint32_t base = m->vertex_count, i, j;
    for (i = 0; i < other->vertex_count; i++)
        mesh_point(m, add(other->positions[i], make_vec(dx, 0, 0)));
    for (i = 0; i < other->face_count; i++) {
        mesh_face_data f = other->faces[i];
        for (j = 0; j < f.size; j++) f.v[j] += base;
        mesh_face(m, f.size, f.v);
    }
    for (i = 0; i < other->tag_count; i++) {
        psurf_edge_tag t = other->tags[i], *tag = mesh_edge(m, t.v0 + base, t.v1 + base);
        t.v0 += base, t.v1 += base;
        *tag = t;
    }
    for (i = 0; i < other->corner_count; i++) mesh_corner(m, other->corners[i] + base);
}

/* Moves every vertex by up to amount (a multiple of 2^-16) along each axis. */
static UNUSED void mesh_jitter(mesh *m, uint64_t *rng, double amount)
{
    uint32_t i, range = (uint32_t)(amount * 65536.0);
    for (i = 0; i < m->vertex_count; i++) {
        double d[3];
        int k;
        for (k = 0; k < 3; k++)
            d[k] = ((double)random_below(rng, 2 * range + 1) - (double)range) / 65536.0;
        m->positions[i] = add(m->positions[i], make_vec(d[0], d[1], d[2]));
    }
}

/* Point k of n on a circle, counter-clockwise; nearly even steps from rational arithmetic alone. */
static UNUSED void circle_point(uint32_t k, uint32_t n, int64_t radius, int64_t *x, int64_t *y)
{
    const int64_t one = 1048576;
    int64_t den = n, num = (int64_t)(k % n) * 4, t, c, s;
    int quadrant = (int)(num / den);
    num %= den;
    t = num * (11 * den * den + 3 * num * num) * one / (14 * den * den * den);
    c = radius * (one * one - t * t) / (one * one + t * t);
    s = radius * (2 * one * t) / (one * one + t * t);
    *x = quadrant == 0 ? c : quadrant == 1 ? -s : quadrant == 2 ? -c : s;
    *y = quadrant == 0 ? s : quadrant == 1 ? c : quadrant == 2 ? -s : -c;
}

static UNUSED mesh make_tetrahedron(void)
{
    mesh m = {0};
    mesh_vertex(&m, 65536, 65536, 65536);
    mesh_vertex(&m, 65536, -65536, -65536);
    mesh_vertex(&m, -65536, 65536, -65536);
    mesh_vertex(&m, -65536, -65536, 65536);
    mesh_tri(&m, 0, 1, 2);
    mesh_tri(&m, 0, 3, 1);
    mesh_tri(&m, 0, 2, 3);
    mesh_tri(&m, 1, 3, 2);
    return m;
}

static UNUSED mesh make_cube(void)
{
    mesh m = {0};
    uint32_t i;
    for (i = 0; i < 8; i++)
        mesh_vertex(&m, i & 1 ? 65536 : -65536, i & 2 ? 65536 : -65536, i & 4 ? 65536 : -65536);
    mesh_quad(&m, 0, 2, 3, 1);
    mesh_quad(&m, 4, 5, 7, 6);
    mesh_quad(&m, 0, 1, 5, 4);
    mesh_quad(&m, 3, 2, 6, 7);
    mesh_quad(&m, 1, 3, 7, 5);
    mesh_quad(&m, 2, 0, 4, 6);
    return m;
}

static UNUSED mesh make_dodecahedron(void)
{
    static const uint32_t face[12][5] = {
        {0, 8, 10, 1, 16}, {0, 12, 14, 4, 8}, {0, 16, 18, 2, 12}, {1, 10, 5, 15, 13},
        {1, 13, 3, 18, 16}, {2, 9, 6, 14, 12}, {2, 18, 3, 11, 9}, {3, 13, 15, 7, 11},
        {4, 14, 6, 19, 17}, {4, 17, 5, 10, 8}, {5, 17, 19, 7, 15}, {6, 9, 11, 7, 19}};
    const int64_t phi = 106039, inv = 40503;        /* golden ratio and its inverse, of 65536 */
    mesh m = {0};
    uint32_t i, k;
    for (i = 0; i < 8; i++)
        mesh_vertex(&m, i & 4 ? 65536 : -65536, i & 2 ? 65536 : -65536, i & 1 ? 65536 : -65536);
    for (k = 0; k < 3; k++)
        for (i = 0; i < 4; i++) {
            int64_t a = i & 2 ? inv : -inv, b = i & 1 ? phi : -phi;
            mesh_vertex(&m, k == 0 ? 0 : k == 1 ? a : b, k == 1 ? 0 : k == 2 ? a : b,
                        k == 2 ? 0 : k == 0 ? a : b);
        }
    for (i = 0; i < 12; i++) mesh_face(&m, 5, face[i]);
    return m;
}

/* Ring of tubes: around times along quads, all regular. */
static UNUSED mesh make_torus(uint32_t along, uint32_t around)
{
    mesh m = {0};
    uint32_t i, j;
    for (i = 0; i < along; i++)
        for (j = 0; j < around; j++) {
            int64_t r, z, x, y;
            circle_point(j, around, 65536, &r, &z);
            circle_point(i, along, r + 3 * 65536, &x, &y);
            mesh_vertex(&m, x, y, z);
        }
    for (i = 0; i < along; i++)
        for (j = 0; j < around; j++) {
            uint32_t i1 = (i + 1) % along, j1 = (j + 1) % around;
            mesh_quad(&m, i * around + j, i1 * around + j, i1 * around + j1, i * around + j1);
        }
    return m;
}

/* A vertex at the top and at the bottom, and the given rings between; a builder fills the bands. */
typedef struct spindle {
    mesh m;
    uint32_t top, bottom, rings, first[16], size[16];
} spindle;

static UNUSED spindle make_spindle(uint32_t rings, const uint32_t *sizes)
{
    spindle s;
    uint32_t i, k;
    memset(&s, 0, sizeof s);
    s.rings = rings;
    s.top = mesh_vertex(&s.m, 0, 0, 98304);
    for (i = 0; i < rings; i++) {
        int64_t x, y, z, radius;
        circle_point(i + 1, 2 * (rings + 1), 98304, &z, &radius);
        s.first[i] = s.m.vertex_count;
        s.size[i] = sizes[i];
        for (k = 0; k < sizes[i]; k++) {
            circle_point(k, sizes[i], radius, &x, &y);
            mesh_vertex(&s.m, x, y, z);
        }
    }
    s.bottom = mesh_vertex(&s.m, 0, 0, -98304);
    for (k = 0; k < sizes[0]; k++)
        mesh_tri(&s.m, s.first[0] + k, s.first[0] + (k + 1) % sizes[0], s.top);
    for (k = 0; k < sizes[rings - 1]; k++)
        mesh_tri(&s.m, s.first[rings - 1] + (k + 1) % sizes[rings - 1], s.first[rings - 1] + k,
                 s.bottom);
    return s;
}

/* One facet between ring i and ring i+1: a edges of the upper ring from ua, b of the lower from
   ub. */
static UNUSED void spindle_facet(spindle *s, uint32_t i, uint32_t ua, uint32_t a, uint32_t ub,
                                 uint32_t b)
{
    uint32_t v[MESH_MAX_CORNERS], n = 0, k;
    for (k = 0; k <= b; k++) v[n++] = s->first[i + 1] + (ub + k) % s->size[i + 1];
    for (k = a + 1; k-- > 0;) v[n++] = s->first[i] + (ua + k) % s->size[i];
    mesh_face(&s->m, n, v);
}

/* Ball of latitudes and longitudes: two polar caps of n triangles, quads between. One ring: two
   fans back to back, a bipyramid. */
static UNUSED mesh make_latlong(uint32_t n, uint32_t rings)
{
    uint32_t sizes[16] = {0}, i, k;
    spindle s;
    for (i = 0; i < rings; i++) sizes[i] = n;
    s = make_spindle(rings, sizes);
    for (i = 0; i + 1 < rings; i++)
        for (k = 0; k < n; k++) spindle_facet(&s, i, k, 1, k, 1);
    return s.m;
}

/* Two caps of n triangles joined by a band of 2n triangles: the rims have valence 5, so the caps
   are not polar. n = 5: an icosahedron. */
static UNUSED mesh make_triangle_ball(uint32_t n)
{
    uint32_t sizes[2], k;
    spindle s;
    sizes[0] = sizes[1] = n;
    s = make_spindle(2, sizes);
    for (k = 0; k < n; k++) {
        spindle_facet(&s, 0, k, 1, k, 0);
        spindle_facet(&s, 0, k + 1, 0, k, 1);
    }
    return s.m;
}

/* Drops vertices that no face uses, and the marks that name them. */
static UNUSED void mesh_compact(mesh *m)
{
    uint32_t *name = (uint32_t *)grab(m->vertex_count, sizeof *name), i, k, n = 0;
    for (i = 0; i < m->face_count; i++)
        for (k = 0; k < m->faces[i].size; k++) name[m->faces[i].v[k]] = 1;
    for (i = 0; i < m->vertex_count; i++) {
        if (name[i]) m->positions[n] = m->positions[i];
        name[i] = name[i] ? n++ : PSURF_NONE;
    }
    m->vertex_count = n;
    for (i = 0; i < m->face_count; i++)
        for (k = 0; k < m->faces[i].size; k++) m->faces[i].v[k] = name[m->faces[i].v[k]];
    for (i = n = 0; i < m->tag_count; i++) {
        psurf_edge_tag t = m->tags[i];
        t.v0 = name[t.v0], t.v1 = name[t.v1];
        if (t.v0 != PSURF_NONE && t.v1 != PSURF_NONE) m->tags[n++] = t;
    }
    m->tag_count = n;
    for (i = n = 0; i < m->corner_count; i++)
        if (name[m->corners[i]] != PSURF_NONE) m->corners[n++] = name[m->corners[i]];
    m->corner_count = n;
    free(name);
}

/* An open sheet of quads, gently curved; vertex (i, j) is number j (width + 1) + i. */
static UNUSED mesh make_grid(uint32_t width, uint32_t height)
{
    mesh m = {0};
    uint32_t i, j, row = width + 1;
    for (j = 0; j <= height; j++)
        for (i = 0; i <= width; i++) {
            int64_t x = 2 * (int64_t)i - width, y = 2 * (int64_t)j - height;
            mesh_vertex(&m, 32768 * x, 32768 * y, -1536 * (x * x - y * x + 2 * y * y));
        }
    for (j = 0; j < height; j++)
        for (i = 0; i < width; i++)
            mesh_quad(&m, j * row + i, j * row + i + 1, (j + 1) * row + i + 1, (j + 1) * row + i);
    return m;
}

/* One face of n corners in a plane. */
static UNUSED mesh make_polygon(uint32_t n)
{
    mesh m = {0};
    uint32_t v[MESH_MAX_CORNERS], k;
    for (k = 0; k < n; k++) {
        int64_t x, y;
        circle_point(k, n, 65536, &x, &y);
        v[k] = mesh_vertex(&m, x, y, 0);
    }
    mesh_face(&m, n, v);
    return m;
}

/* A sheet with a hole and a corner cut out: boundary vertices of three faces. */
static UNUSED mesh make_holed_grid(void)
{
    static const uint32_t gone[] = {41, 40, 34, 33, 23, 16, 9, 8};
    mesh m = make_grid(7, 6);
    uint32_t i;
    for (i = 0; i < COUNT_OF(gone); i++) mesh_remove_face(&m, gone[i]);
    mesh_compact(&m);
    return m;
}

/* A pole at vertex 0, a fan of n triangles, and further rings of quads: a dome with an open rim.
   Vertex k of ring r (from 0) is number 1 + r n + k. */
static UNUSED mesh make_dome(uint32_t n, uint32_t rings)
{
    mesh m = {0};
    uint32_t r, k;
    mesh_vertex(&m, 0, 0, 65536);
    for (r = 0; r < rings; r++)
        for (k = 0; k < n; k++) {
            int64_t x, y, z, radius;
            circle_point(r + 1, 4 * (rings + 1), 65536, &z, &radius);
            circle_point(k, n, radius, &x, &y);
            mesh_vertex(&m, x, y, z);
        }
    for (k = 0; k < n; k++) mesh_tri(&m, 0, 1 + k, 1 + (k + 1) % n);
    for (r = 0; r + 1 < rings; r++)
        for (k = 0; k < n; k++) {
            uint32_t a = 1 + r * n + k, b = 1 + r * n + (k + 1) % n;
            mesh_quad(&m, a, a + n, b + n, b);
        }
    return m;
}

/* A tube of n quads by bands, its ends closed by one face each; ring r begins at vertex r n. */
static UNUSED mesh make_cylinder(uint32_t n, uint32_t bands)
{
    mesh m = {0};
    uint32_t r, k, top[MESH_MAX_CORNERS], bottom[MESH_MAX_CORNERS];
    for (r = 0; r <= bands; r++)
        for (k = 0; k < n; k++) {
            int64_t x, y;
            circle_point(k, n, 65536, &x, &y);
            mesh_vertex(&m, x, y, 65536 * (2 * (int64_t)r - bands));
        }
    for (r = 0; r < bands; r++)
        for (k = 0; k < n; k++) {
            uint32_t a = r * n + k, b = r * n + (k + 1) % n;
            mesh_quad(&m, a, b, b + n, a + n);
        }
    for (k = 0; k < n; k++) top[k] = bands * n + k, bottom[k] = n - 1 - k;
    mesh_face(&m, n, top);
    mesh_face(&m, n, bottom);
    return m;
}

/* ---- a second opinion on connectivity: every directed edge, sorted --------------------------- */

typedef struct half_edge { uint32_t from, to, face, corner; } half_edge;
typedef struct edge_map { half_edge *edges; uint32_t count; } edge_map;

static UNUSED int compare_half_edges(const void *pa, const void *pb)
{
    const half_edge *a = (const half_edge *)pa, *b = (const half_edge *)pb;
    if (a->from != b->from) return a->from < b->from ? -1 : 1;
    if (a->to != b->to) return a->to < b->to ? -1 : 1;
    return a->face < b->face ? -1 : a->face > b->face;
}

static UNUSED edge_map map_edges(const mesh *m)
{
    edge_map map;
    uint32_t i, j;
    map.count = 0;
    map.edges = (half_edge *)grab((size_t)m->face_count * MESH_MAX_CORNERS, sizeof(half_edge));
    for (i = 0; i < m->face_count; i++)
        for (j = 0; j < m->faces[i].size; j++) {
            half_edge *e = &map.edges[map.count++];
            e->from = m->faces[i].v[j];
            e->to = m->faces[i].v[(j + 1) % m->faces[i].size];
            e->face = i;
            e->corner = j;
        }
    qsort(map.edges, map.count, sizeof(half_edge), compare_half_edges);
    return map;
}

/* First directed edge not before (from, to); count if none. */
static UNUSED uint32_t lower_edge(const edge_map *map, uint32_t from, uint32_t to)
{
    uint32_t low = 0, high = map->count;
    while (low < high) {
        uint32_t mid = low + (high - low) / 2;
        const half_edge *e = &map->edges[mid];
        if (e->from < from || (e->from == from && e->to < to)) low = mid + 1;
        else high = mid;
    }
    return low;
}

static UNUSED const half_edge *find_edge(const edge_map *map, uint32_t from, uint32_t to)
{
    uint32_t i = lower_edge(map, from, to);
    if (i < map->count && map->edges[i].from == from && map->edges[i].to == to)
        return &map->edges[i];
    return NULL;
}

/* Edges that leave a vertex: its valence on a closed mesh with one fan there. */
static UNUSED uint32_t valence_of(const edge_map *map, uint32_t vertex)
{
    return lower_edge(map, vertex + 1, 0) - lower_edge(map, vertex, 0);
}

/* Of the sides of an edge the one from the lower vertex, or the only one. */
static UNUSED int is_first_side(const edge_map *map, const half_edge *e)
{
    return e->from < e->to || !find_edge(map, e->to, e->from);
}

/* Tags about half of the edges with blend ratios from low/256 to 1, drawn for each end. */
static UNUSED void mesh_random_tags(mesh *m, uint64_t *rng, uint32_t low)
{
    edge_map map = map_edges(m);
    uint32_t i;
    for (i = 0; i < map.count; i++) {
        uint32_t take = random_below(rng, 2);
        uint32_t a = low + random_below(rng, 257 - low), b = low + random_below(rng, 257 - low);
        if (take && is_first_side(&map, &map.edges[i]))
            mesh_tag(m, map.edges[i].from, map.edges[i].to, a / 256.0, b / 256.0);
    }
    free(map.edges);
}

/* Takes faces away at random. */
static UNUSED mesh with_holes(mesh m, uint64_t *rng, uint32_t holes)
{
    while (holes--) mesh_remove_face(&m, random_below(rng, m.face_count));
    mesh_compact(&m);
    return m;
}

/* Marks about percent of the edges hard. */
static UNUSED mesh with_hard(mesh m, uint64_t *rng, uint32_t percent)
{
    edge_map map = map_edges(&m);
    uint32_t i;
    for (i = 0; i < map.count; i++)
        if (is_first_side(&map, &map.edges[i]) && random_below(rng, 100) < percent)
            mesh_hard(&m, map.edges[i].from, map.edges[i].to);
    free(map.edges);
    return m;
}

/* A closed mesh of 3- to 5-sided faces, every edge met once from each side, no vertex of valence 2
   or used by no face. */
static UNUSED int mesh_is_valid(const mesh *m)
{
    edge_map map = map_edges(m);
    uint32_t i;
    int ok = 1;
    for (i = 0; i < m->face_count; i++) ok &= m->faces[i].size >= 3 && m->faces[i].size <= 5;
    for (i = 0; i < map.count; i++) {
        const half_edge *e = &map.edges[i];
        if (i && map.edges[i - 1].from == e->from && map.edges[i - 1].to == e->to) ok = 0;
        if (e->from == e->to || !find_edge(&map, e->to, e->from)) ok = 0;
    }
    for (i = 0; i < m->vertex_count; i++)
        if (valence_of(&map, i) < 3) ok = 0;
    free(map.edges);
    return ok;
}

/* The kind of every face by pm-formulas section 2, read off the definition. */
static UNUSED psurf_kind *classify_faces(const mesh *m)
{
    edge_map map = map_edges(m);
    psurf_kind *kind = (psurf_kind *)grab(m->face_count, sizeof *kind);
    char *candidate = (char *)grab(m->vertex_count, 1), *polar = (char *)grab(m->vertex_count, 1);
    uint32_t v, i, j;
    for (v = 0; v < m->vertex_count; v++) {
        candidate[v] = valence_of(&map, v) > 0;
        for (i = lower_edge(&map, v, 0); i < lower_edge(&map, v + 1, 0); i++)
            if (m->faces[map.edges[i].face].size != 3 || valence_of(&map, map.edges[i].to) != 4)
                candidate[v] = 0;
    }
    for (v = 0; v < m->vertex_count; v++) {
        polar[v] = candidate[v];
        for (i = lower_edge(&map, v, 0); i < lower_edge(&map, v + 1, 0); i++)
            if (candidate[map.edges[i].to]) polar[v] = 0;
    }
    for (i = 0; i < m->face_count; i++) {
        const mesh_face_data *f = &m->faces[i];
        uint32_t fours = 0, poles = 0;
        for (j = 0; j < f->size; j++) {
            fours += valence_of(&map, f->v[j]) == 4;
            poles += (uint32_t)polar[f->v[j]];
        }
        if (f->size == 4) kind[i] = fours == 4 ? PSURF_BICUBIC : PSURF_P4;
        else kind[i] = f->size == 5 ? PSURF_P5 : poles ? PSURF_POLAR : PSURF_P3;
    }
    free(candidate);
    free(polar);
    free(map.edges);
    return kind;
}

/* ---- conversions: they break regularity in every way a modeller does ------------------------- */

/* Cuts about percent of the quads in two along a random diagonal. */
static UNUSED void mesh_split_quads(mesh *m, uint64_t *rng, uint32_t percent)
{
    uint32_t i, count = m->face_count;
    for (i = 0; i < count; i++) {
        mesh_face_data f = m->faces[i];
        uint32_t k = random_below(rng, 2);
        edge_map map;
        int taken;
        if (f.size != 4 || random_below(rng, 100) >= percent) continue;
        map = map_edges(m);
        taken = find_edge(&map, f.v[k], f.v[k + 2]) || find_edge(&map, f.v[k + 2], f.v[k]);
        free(map.edges);
        if (taken) continue;
        m->faces[i].size = 3;
        m->faces[i].v[0] = f.v[k], m->faces[i].v[1] = f.v[k + 1], m->faces[i].v[2] = f.v[k + 2];
        mesh_tri(m, f.v[k], f.v[k + 2], f.v[(k + 3) % 4]);
    }
}

static UNUSED void insert_corner(mesh_face_data *f, uint32_t at, uint32_t vertex)
{
    uint32_t k;
    for (k = f->size; k > at; k--) f->v[k] = f->v[k - 1];
    f->v[at] = vertex;
    f->size++;
}

/* Puts a vertex of two edges on the edge at a corner. */
static UNUSED void mesh_insert_vertex(mesh *m, uint32_t face, uint32_t corner)
{
    const mesh_face_data f = m->faces[face];
    const uint32_t a = f.v[corner], b = f.v[(corner + 1) % f.size];
    const uint32_t v = mesh_point(m, mul(0.5, add(m->positions[a], m->positions[b])));
    edge_map map = map_edges(m);
    const half_edge *twin = find_edge(&map, b, a);
    insert_corner(&m->faces[face], corner + 1, v);
    if (twin) insert_corner(&m->faces[twin->face], twin->corner + 1, v);
    free(map.edges);
}

/* Splits the edge at a face's corner in its middle: that face is cut in two from the new vertex,
   the face beyond gets one corner more (a quad becomes a pentagon: a T-corner). 0 where it cannot
   be. */
static UNUSED int mesh_split_edge(mesh *m, uint32_t face, uint32_t corner, uint32_t opposite)
{
    mesh_face_data f = m->faces[face], g, part;
    uint32_t a = f.v[corner], b = f.v[(corner + 1) % f.size], middle, k, far;
    edge_map map = map_edges(m);
    half_edge twin = *find_edge(&map, b, a);
    free(map.edges);
    g = m->faces[twin.face];
    /* the new corner comes first: middle, b, ..., a; the far end is one that is no neighbour */
    memset(&part, 0, sizeof part);
    for (k = 0; k < f.size; k++) part.v[k + 1] = f.v[(corner + 1 + k) % f.size];
    part.size = f.size + 1;
    far = 2 + opposite % (f.size - 2);
    if (g.size >= 5 || twin.face == face || part.size - far + 1 > 5 || far + 1 > 5) return 0;
    middle = mesh_point(m, mul(0.5, add(m->positions[a], m->positions[b])));
    part.v[0] = middle;
    insert_corner(&m->faces[twin.face], twin.corner + 1, middle);
    m->faces[face].size = far + 1;
    memcpy(m->faces[face].v, part.v, (far + 1) * sizeof part.v[0]);
    f.size = 0;
    f.v[f.size++] = middle;
    for (k = far; k < part.size; k++) f.v[f.size++] = part.v[k];
    mesh_face(m, f.size, f.v);
    return 1;
}

/* Cuts a vertex off: a facet with one corner per edge takes its place, every face there gets one
   corner more. 0 where a face would have more than 5. The old vertex becomes one of the new. */
static UNUSED int mesh_cut_vertex(mesh *m, uint32_t vertex)
{
    edge_map map = map_edges(m);
    uint32_t first = lower_edge(&map, vertex, 0), n = valence_of(&map, vertex), k, j;
    uint32_t ends[8], cut[8], order[8];
    vec p = m->positions[vertex];
    int ok = n >= 3 && n <= 5;
    for (k = 0; ok && k < n; k++) ok = m->faces[map.edges[first + k].face].size <= 4;
    for (k = 0; ok && k < n; k++) ends[k] = map.edges[first + k].to;
    for (k = 0; ok && k < n; k++) {             /* the next edge counter-clockwise */
        const half_edge *e = &map.edges[first + k];
        const mesh_face_data *f = &m->faces[e->face];
        uint32_t before = f->v[(e->corner + f->size - 1) % f->size];
        for (j = 0; j < n; j++)
            if (ends[j] == before) order[k] = j;
    }
    for (k = 0; ok && k < n; k++) {
        vec q = mad(p, 0.25, sub(m->positions[ends[k]], p));
        cut[k] = k ? mesh_point(m, q) : vertex;
        m->positions[cut[k]] = q;
    }
    for (k = 0; ok && k < n; k++) {
        const half_edge *e = &map.edges[first + k];
        mesh_face_data *f = &m->faces[e->face];
        f->v[e->corner] = cut[k];
        insert_corner(f, e->corner, cut[order[k]]);
    }
    if (ok) {
        uint32_t around[8];
        for (k = 0, j = 0; k < n; k++, j = order[j]) around[k] = cut[j];
        mesh_face(m, n, around);
    }
    free(map.edges);
    return ok;
}

/* Whether a face has a corner of less than 3 degrees, an edge run back on itself included. */
static UNUSED int mesh_has_sliver(const mesh *m)
{
    uint32_t i, k;
    for (i = 0; i < m->face_count; i++) {
        const mesh_face_data *f = &m->faces[i];
        for (k = 0; k < f->size; k++) {
            vec p = m->positions[f->v[k]];
            vec a = sub(m->positions[f->v[(k + 1) % f->size]], p);
            vec b = sub(m->positions[f->v[(k + f->size - 1) % f->size]], p);
            if (dot(a, b) > 0.9986 * length(a) * length(b)) return 1;
        }
    }
    return 0;
}

/* A few random conversions. Every step keeps the mesh closed and of 3- to 5-sided faces. */
static UNUSED void mesh_scramble(mesh *m, uint64_t *rng, uint32_t steps)
{
    while (steps--) {
        mesh trial = mesh_copy(m);
        uint32_t face = random_below(rng, m->face_count), what = random_below(rng, 3);
        uint32_t corner = random_below(rng, m->faces[face].size);
        if (what == 0) mesh_cut_vertex(&trial, random_below(rng, m->vertex_count));
        else mesh_split_edge(&trial, face, corner, random_below(rng, 8));
        if (mesh_is_valid(&trial) && !mesh_has_sliver(&trial)) {
            mesh swap = *m;
            *m = trial;
            trial = swap;
        }
        mesh_free(&trial);
    }
}

/* Rings of random sizes joined by random bands: of the facets about percent are quads that step
   once on both sides, the rest triangles, quads and pentagons. */
static UNUSED mesh make_random_spindle(uint64_t *rng, uint32_t percent, uint32_t largest)
{
    static const uint32_t step[5][2] = {{1, 0}, {0, 1}, {1, 1}, {2, 1}, {1, 2}};
    for (;;) {
        uint32_t sizes[4], rings = 2 + random_below(rng, 3), i;
        spindle s;
        for (i = 0; i < rings; i++) sizes[i] = 3 + random_below(rng, largest - 2);
        if (percent > 50)
            for (i = 1; i < rings; i++) sizes[i] = sizes[0] + random_below(rng, 2);
        s = make_spindle(rings, sizes);
        for (i = 0; i + 1 < rings; i++) {
            uint32_t a = 0, b = 0;
            while (a < sizes[i] || b < sizes[i + 1]) {
                uint32_t k = random_below(rng, 100) < percent ? 2 : random_below(rng, 5);
                if (a + step[k][0] > sizes[i] || b + step[k][1] > sizes[i + 1])
                    k = a < sizes[i] ? 0 : 1;
                spindle_facet(&s, i, a, step[k][0], b, step[k][1]);
                a += step[k][0], b += step[k][1];
            }
        }
        if (mesh_is_valid(&s.m)) return s.m;
        mesh_free(&s.m);
    }
}

/* A polar cap over a band in which every facet has one edge on the cap's rim and a random one, none
   or two on the ring below, then a fan: poles beside P3, P4 and P5. */
static UNUSED mesh make_capped_spindle(uint64_t *rng, uint32_t n)
{
    for (;;) {
        uint32_t sizes[2], steps[64], k, b = 0;
        spindle s;
        sizes[0] = n, sizes[1] = 0;
        for (k = 0; k < n; k++) sizes[1] += steps[k] = random_below(rng, 3);
        if (sizes[1] < 3) continue;
        s = make_spindle(2, sizes);
        for (k = 0; k < n; k++) {
            spindle_facet(&s, 0, k, 1, b, steps[k]);
            b += steps[k];
        }
        if (mesh_is_valid(&s.m)) return s.m;
        mesh_free(&s.m);
    }
}

/* One of everything: polar, ordinary, P3, P4 and P5 on one closed surface. */
static UNUSED mesh make_creature(void)
{
    mesh m = make_latlong(7, 6);
    mesh_cut_vertex(&m, 22);                    /* in the middle: the caps stay polar */
    mesh_cut_vertex(&m, 25);
    mesh_split_edge(&m, 32, 0, 0);
    mesh_split_edge(&m, 33, 0, 1);
    return m;
}

/* Appends and consumes. */
static UNUSED void mesh_take(mesh *m, mesh part, double dx)
{
    mesh_append(m, &part, dx);
    mesh_free(&part);
}

/* Boundaries, corners, hard edges in every constellation, faces that are split: by their size, at a
   vertex of two edges, alone on their side of a crease; several components, touching fans. */
static UNUSED mesh make_marked(void)
{
    mesh m = make_creature(), part;
    uint64_t rng = 31;
    uint32_t k;
    mesh_take(&m, with_hard(make_holed_grid(), &rng, 20), 8);
    part = make_cylinder(9, 2);
    for (k = 0; k < 9; k++) mesh_hard(&part, k, (k + 1) % 9);
    mesh_take(&m, part, 16);
    part = make_dome(6, 3);
    mesh_corner(&part, 13);
    mesh_take(&m, part, 20);
    part = make_cube();
    mesh_insert_vertex(&part, 0, 1);
    mesh_take(&m, part, 24);
    part = make_torus(7, 6);
    mesh_split_quads(&part, &rng, 30);
    mesh_take(&m, with_hard(part, &rng, 15), 32);
    mesh_take(&m, with_holes(with_hard(make_dodecahedron(), &rng, 30), &rng, 2), 40);
    part = make_torus(6, 6);
    for (k = 0; k < 4; k++)
        mesh_hard(&part, part.faces[7].v[k], part.faces[7].v[(k + 1) % 4]);
    mesh_remove_face(&part, 21);
    mesh_remove_face(&part, 14);                        /* the two touch at a vertex */
    mesh_take(&m, part, 48);
    mesh_take(&m, make_cylinder(7, 1), 56);
    mesh_jitter(&m, &rng, 0.03125);
    return m;
}

/* ---- surfaces: the library's objects for a mesh ---------------------------------------------- */

typedef struct surface {
    uint32_t *sizes, *vertices, *first;         /* first: corner of each face in vertices */
    psurf_real *positions, *normals;
    psurf_scheme scheme;
    psurf_mesh_desc desc;
    psurf_topology *topology;
    psurf_info info;
    psurf_tables tables;
    psurf_construct_desc construct;
    psurf_patches patches;
    char *memory, *scratch;
} surface;

/* Fills the arrays and the descriptor, calls nothing. */
static UNUSED void surface_describe(surface *s, const mesh *m)
{
    uint32_t i, j, n = 0;
    memset(s, 0, sizeof *s);
    s->sizes = (uint32_t *)grab(m->face_count, sizeof(uint32_t));
    s->first = (uint32_t *)grab((size_t)m->face_count + 1, sizeof(uint32_t));
    for (i = 0; i < m->face_count; i++) {
        s->first[i] = n;
        s->sizes[i] = m->faces[i].size;
        n += m->faces[i].size;
    }
    s->first[m->face_count] = n;
    s->vertices = (uint32_t *)grab(n, sizeof(uint32_t));
    for (i = 0; i < m->face_count; i++)
        memcpy(s->vertices + s->first[i], m->faces[i].v, s->sizes[i] * sizeof(uint32_t));
    s->positions = (psurf_real *)grab((size_t)m->vertex_count * 3, sizeof(psurf_real));
    for (i = 0; i < m->vertex_count; i++) {
        const double p[3] = {m->positions[i].x, m->positions[i].y, m->positions[i].z};
        for (j = 0; j < 3; j++) s->positions[3 * i + j] = (psurf_real)p[j];
    }
    s->desc.vertex_count = m->vertex_count;
    s->desc.face_count = m->face_count;
    s->desc.face_sizes = s->sizes;
    s->desc.face_vertices = s->vertices;
    s->desc.edges = m->tag_count ? m->tags : NULL;
    s->desc.edge_count = m->tag_count;
    s->desc.corners = m->corner_count ? m->corners : NULL;
    s->desc.corner_count = m->corner_count;
    s->desc.positions = s->positions;
    s->construct.positions = s->positions;
}

/* Builds the topology of what is described and the patches, by default of pm. */
static UNUSED void surface_make(surface *s)
{
    psurf_error error;
    psurf_patches_layout layout;
    psurf_result result = psurf_topology_create(&s->desc, &s->topology, &error);
    REQUIRE(result == PSURF_OK, "%s: face %u corner %u vertices %u %u\n", error.message,
            (unsigned)error.face, (unsigned)error.corner, (unsigned)error.vertex,
            (unsigned)error.other);
    psurf_topology_info(s->topology, &s->info);
    psurf_topology_tables(s->topology, &s->tables);
    REQUIRE(psurf_patches_size(s->topology, s->scheme, &layout) == PSURF_OK, "size\n");
    s->memory = (char *)grab(layout.patch_bytes, 1);
    s->scratch = (char *)grab(layout.scratch_bytes, 1);
    REQUIRE(psurf_patches_bind(&s->patches, s->topology, s->scheme, s->memory, s->scratch)
                == PSURF_OK, "bind\n");
    REQUIRE(psurf_construct(&s->patches, &s->construct) == PSURF_OK, "construct\n");
}

static UNUSED void surface_build(surface *s, const mesh *m)
{
    surface_describe(s, m);
    surface_make(s);
}

static UNUSED void surface_free(surface *s)
{
    psurf_topology_destroy(s->topology);
    free(s->sizes);
    free(s->first);
    free(s->vertices);
    free(s->positions);
    free(s->normals);
    free(s->memory);
    free(s->scratch);
    memset(s, 0, sizeof *s);
}

/* Limit point of a ring; tangent point (0) or face point (1) of a spoke. */
static UNUSED vec limit_point(const surface *s, uint32_t ring)
{
    const char *base = s->scratch + s->patches.layout.limit_offset;
    return load((const psurf_real *)(const void *)base + 3 * (size_t)ring);
}
static UNUSED vec spoke_point(const surface *s, uint32_t spoke, int which)
{
    const char *base = s->scratch + s->patches.layout.spoke_offset;
    return load((const psurf_real *)(const void *)base + 6 * (size_t)spoke + 3 * which);
}

/* ---- samples --------------------------------------------------------------------------------- */

static UNUSED psurf_sample make_sample(uint32_t face, uint32_t sector, double u, double v)
{
    psurf_sample s;
    s.face = face, s.sector = sector, s.u = (psurf_real)u, s.v = (psurf_real)v;
    return s;
}

/* On edge i of a face of size corners, s of the way from corner i to corner i+1. With s a multiple
   of 2^-20 the other side's sample at 1-s is its exact partner. */
static UNUSED psurf_sample edge_sample(uint32_t face, uint32_t size, uint32_t i, double s)
{
    double r = 1.0 - s;
    if (size == 3)
        return make_sample(face, 0, i == 0 ? s : i == 1 ? r : 0, i == 0 ? 0 : i == 1 ? s : r);
    if (size == 4)
        return make_sample(face, 0, i == 0 ? s : i == 1 ? 1 : i == 2 ? r : 0,
                           i == 0 ? 0 : i == 1 ? s : i == 2 ? 1 : r);
    return make_sample(face, i, r, s);
}

/* Weights a of corner i, b of corner i+1, the rest of the face's centre. */
static UNUSED psurf_sample sector_sample(uint32_t face, uint32_t size, uint32_t i, double a,
                                         double b)
{
    static const double square[4][2] = {{0, 0}, {1, 0}, {1, 1}, {0, 1}};
    double c = 1.0 - a - b;
    uint32_t j = (i + 1) % size;
    if (size == 3)
        return make_sample(face, 0, a * (i == 1) + b * (j == 1) + c / 3,
                           a * (i == 2) + b * (j == 2) + c / 3);
    if (size == 4)
        return make_sample(face, 0, a * square[i][0] + b * square[j][0] + c / 2,
                           a * square[i][1] + b * square[j][1] + c / 2);
    return make_sample(face, i, a, b);
}

/* Anywhere on a face; anywhere on the mesh. */
static UNUSED psurf_sample random_sample_of(const mesh *m, uint32_t face, uint64_t *rng)
{
    uint32_t size = m->faces[face].size;
    double u = random_unit(rng), v = random_unit(rng);
    if (size != 4 && u + v > 1) u = 1 - u, v = 1 - v;
    return make_sample(face, random_below(rng, size), u, v);
}

static UNUSED psurf_sample random_sample(const mesh *m, uint64_t *rng)
{
    return random_sample_of(m, random_below(rng, m->face_count), rng);
}

typedef struct point { vec p, n, du, dv, duu, duv, dvv; } point;

static UNUSED point eval_at(const psurf_patches *patches, psurf_sample sample)
{
    psurf_real r[7][3];
    psurf_points out;
    point pt;
    memset(&out, 0, sizeof out);
    out.p = r[0], out.n = r[1], out.du = r[2], out.dv = r[3];
    out.duu = r[4], out.duv = r[5], out.dvv = r[6];
    psurf_eval(patches, &sample, 1, &out);
    pt.p = load(r[0]), pt.n = load(r[1]), pt.du = load(r[2]), pt.dv = load(r[3]);
    pt.duu = load(r[4]), pt.duv = load(r[5]), pt.dvv = load(r[6]);
    return pt;
}

/* The number of the patch of a face that is not split. */
static UNUSED uint32_t patch_of(const surface *s, uint32_t face)
{
    return ((const uint32_t *)s->tables.face_facet.data)[face];
}

#endif
