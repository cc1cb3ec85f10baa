/* meshes.c - a lumpy torus of tiles, and meshes of one kind of patch each. */

#include "bench.h"
#include "patchsurf.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

static const double pi = 3.14159265358979323846;

static mesh mesh_allocate(const char *name, uint32_t vertices, uint32_t faces, uint32_t corners)
{
    mesh m;
    memset(&m, 0, sizeof m);
    m.name = name;
    m.face_sizes = (uint32_t *)allocate(faces * sizeof(uint32_t));
    m.face_vertices = (uint32_t *)allocate(corners * sizeof(uint32_t));
    m.positions = (float *)allocate((size_t)vertices * 3 * sizeof(float));
    return m;
}

void mesh_free(mesh *m)
{
    free(m->face_sizes);
    free(m->face_vertices);
    free(m->positions);
}

static uint32_t add_point(mesh *m, double x, double y, double z)
{
    float *p = m->positions + 3 * (size_t)m->vertices;
    p[0] = (float)x;
    p[1] = (float)y;
    p[2] = (float)z;
    return m->vertices++;
}

/* At turns x of 0..1 along the torus and y around its tube. */
static uint32_t add_lumpy_point(mesh *m, double x, double y, double lumps)
{
    const double a = 2 * pi * x, b = 2 * pi * y;
    const double lump = 0.06 * sin(7 * a) * cos(5 * b) + 0.03 * cos(13 * (a + b));
    const double tube = 0.5 + lumps * lump, ring = 1.5 + tube * cos(b);
    return add_point(m, ring * cos(a), ring * sin(a), tube * sin(b));
}

static uint32_t add_torus_point(mesh *m, double x, double y)
{
    return add_lumpy_point(m, x, y, 1);
}

/* first: the corner that the face starts with. */
static void add_face(mesh *m, uint32_t n, const uint32_t *corners, uint32_t first)
{
    uint32_t i;
    for (i = 0; i < n; i++) m->face_vertices[m->indices + i] = corners[(first + i) % n];
    m->face_sizes[m->faces++] = n;
    m->indices += n;
}

/* ---- tiles of 4 x 4 cells -------------------------------------------------------------------- */

typedef struct tiling {
    mesh m;
    uint32_t size;                      /* cells along and around */
    uint32_t random;
} tiling;

/* Vertex of the grid, both directions wrapped. */
static uint32_t grid(const tiling *t, uint32_t x, uint32_t y)
{
    return y % t->size * t->size + x % t->size;
}

static uint32_t between(tiling *t, double x, double y)
{
    return add_torus_point(&t->m, x / t->size, y / t->size);
}

/* Faces start with any corner, as those of a modelled mesh do. */
static void add_any(tiling *t, uint32_t n, uint32_t a, uint32_t b, uint32_t c, uint32_t d,
                    uint32_t e)
{
    uint32_t corners[5];
    corners[0] = a; corners[1] = b; corners[2] = c; corners[3] = d; corners[4] = e;
    add_face(&t->m, n, corners, random_u32(&t->random) % n);
}

static void add_cell(tiling *t, uint32_t x, uint32_t y)
{
    add_any(t, 4, grid(t, x, y), grid(t, x + 1, y), grid(t, x + 1, y + 1), grid(t, x, y + 1), 0);
}

/* Two quads side by side whose common edge is turned, one of four ways: vertices of valence 3, 3,
   5, 5, which 10 of the 16 quads of the tile touch. */
static void add_turned_edge(tiling *t, uint32_t x, uint32_t y, uint32_t way)
{
    static const uint32_t across[6][2] = { {0,0}, {1,0}, {2,0}, {2,1}, {1,1}, {0,1} };
    static const uint32_t upward[6][2] = { {0,0}, {1,0}, {1,1}, {1,2}, {0,2}, {0,1} };
    const uint32_t (*place)[2] = way & 1 ? upward : across;
    const uint32_t from = way & 2 ? 0 : way & 1 ? 1 : 2;        /* an end of the new edge */
    uint32_t v[6], i;
    for (i = 0; i < 6; i++) {
        const uint32_t k = (from + i) % 6;
        v[i] = grid(t, x + place[k][0], y + place[k][1]);
    }
    add_any(t, 4, v[0], v[1], v[2], v[3], 0);
    add_any(t, 4, v[3], v[4], v[5], v[0], 0);
}

static void add_turned_tile(tiling *t, uint32_t x0, uint32_t y0)
{
    const uint32_t way = random_u32(&t->random) >> 7 & 3;
    uint32_t x, y;
    add_turned_edge(t, x0 + 1, y0 + 1, way);
    for (y = 0; y < 4; y++)
        for (x = 0; x < 4; x++) {
            const int second = way & 1 ? x == 1 && y == 2 : x == 2 && y == 1;
            if (!second && (x != 1 || y != 1)) add_cell(t, x0 + x, y0 + y);
        }
}

/* A quad cut in two by an edge that ends in T-corners: its neighbours become pentagons. */
static void add_t_corners(tiling *t, uint32_t x, uint32_t y)
{
    const uint32_t left = between(t, x + 1, y + 0.5), right = between(t, x + 2, y + 0.5);
    add_any(t, 5, grid(t, x, y), grid(t, x + 1, y), left, grid(t, x + 1, y + 1),
            grid(t, x, y + 1));
    add_any(t, 4, grid(t, x + 1, y), grid(t, x + 2, y), right, left, 0);
    add_any(t, 4, left, right, grid(t, x + 2, y + 1), grid(t, x + 1, y + 1), 0);
    add_any(t, 5, grid(t, x + 2, y), grid(t, x + 3, y), grid(t, x + 3, y + 1),
            grid(t, x + 2, y + 1), right);
}

static void add_triangles(tiling *t, uint32_t x, uint32_t y)
{
    const uint32_t a = grid(t, x, y), c = grid(t, x + 1, y + 1);
    add_any(t, 3, a, grid(t, x + 1, y), c, 0, 0);
    add_any(t, 3, c, grid(t, x, y + 1), a, 0, 0);
}

static void add_mixed_tile(tiling *t, uint32_t x0, uint32_t y0)
{
    uint32_t x, y;
    for (y = 0; y < 4; y++)
        for (x = y ? 0 : 3; x < 4; x++)
            if (y == 2 && (x == 1 || x == 2)) add_triangles(t, x0 + x, y0 + y);
            else add_cell(t, x0 + x, y0 + y);
    add_t_corners(t, x0, y0);
}

static void add_plain_tile(tiling *t, uint32_t x0, uint32_t y0)
{
    uint32_t i;
    for (i = 0; i < 16; i++) add_cell(t, x0 + i % 4, y0 + i / 4);
}

/* Of the quads, 10/16 times 24/25 or 4/25 touch a vertex that is not of valence 4. */
mesh mesh_torus(torus_kind kind, uint32_t size)
{
    static const char *const names[] = { "ordinary", "frog-like", "tenth", "mixed" };
    static const uint32_t turned[] = { 0, 24, 4, 0 };           /* tiles of 25 */
    const uint32_t tiles = size / 4;
    tiling t;
    uint32_t i;
    t.size = tiles * 4;
    t.random = 1;
    t.m = mesh_allocate(names[kind], t.size * t.size + 2 * tiles * tiles, tiles * tiles * 19,
                        tiles * tiles * 19 * 5);
    for (i = 0; i < t.size * t.size; i++) between(&t, i % t.size, i / t.size);
    for (i = 0; i < tiles * tiles; i++) {
        const uint32_t x = i % tiles * 4, y = i / tiles * 4;
        if (kind == MIXED) add_mixed_tile(&t, x, y);
        else if (i * 7 % 25 < turned[kind]) add_turned_tile(&t, x, y);
        else add_plain_tile(&t, x, y);
    }
    return t.m;
}

/* ---- one kind each --------------------------------------------------------------------------- */

static void add_tri(mesh *m, uint32_t a, uint32_t b, uint32_t c)
{
    uint32_t v[3];
    v[0] = a; v[1] = b; v[2] = c;
    add_face(m, 3, v, 0);
}

static void add_quad(mesh *m, uint32_t a, uint32_t b, uint32_t c, uint32_t d)
{
    uint32_t v[4];
    v[0] = a; v[1] = b; v[2] = c; v[3] = d;
    add_face(m, 4, v, 0);
}

/* Beads: fans of triangles on both sides of a rim, poles of valence 6 to 12. */
static mesh mesh_polar(uint32_t faces)
{
    mesh m = mesh_allocate("beads", faces, faces + 24, 3 * (faces + 24));
    uint32_t bead, i;
    for (bead = 0; m.faces < faces; bead++) {
        const uint32_t n = 6 + bead % 7, top = m.vertices, rim = top + 2;
        const double x = bead % 100, y = bead / 100;
        add_point(&m, x, y, 0.3);
        add_point(&m, x, y, -0.3);
        for (i = 0; i < n; i++)
            add_point(&m, x + 0.4 * cos(2 * pi * i / n), y + 0.4 * sin(2 * pi * i / n), 0);
        for (i = 0; i < n; i++) {
            add_tri(&m, top, rim + i, rim + (i + 1) % n);
            add_tri(&m, top + 1, rim + (i + 1) % n, rim + i);
        }
    }
    return m;
}

mesh mesh_triangles(const char *name, uint32_t along, uint32_t around, double lumps)
{
    const uint32_t cells = along * around;
    mesh m = mesh_allocate(name, cells, 2 * cells, 6 * cells);
    uint32_t i;
    for (i = 0; i < cells; i++)
        add_lumpy_point(&m, i % along / (double)along, i / along / (double)around, lumps);
    for (i = 0; i < cells; i++) {
        const uint32_t x = i % along, right = (x + 1) % along;
        const uint32_t up = (i / along + 1) % around * along;
        add_tri(&m, i, i - x + right, up + right);
        add_tri(&m, up + right, up + x, i);
    }
    return m;
}

/* The triangles above, each made three quads: every quad has a corner of valence 3 and one of 6.
   Per cell: its vertex, middles of the edges right, up and across, centres of both triangles. */
static mesh mesh_p4(uint32_t faces)
{
    static const double place[6][2] = { {0, 0}, {0.5, 0}, {0, 0.5}, {0.5, 0.5}, {2 / 3.0, 1 / 3.0},
                                        {1 / 3.0, 2 / 3.0} };
    const uint32_t size = (uint32_t)sqrt(faces / 6.0);
    mesh m = mesh_allocate("quads 3-6", 6 * size * size, 6 * size * size, 24 * size * size);
    uint32_t i, k;
    for (i = 0; i < size * size; i++)
        for (k = 0; k < 6; k++)
            add_torus_point(&m, (i % size + place[k][0]) / size, (i / size + place[k][1]) / size);
    for (i = 0; i < size * size; i++) {
        const uint32_t x = i % size, right = (x + 1) % size, row = i - x;
        const uint32_t above = (i / size + 1) % size * size;
        const uint32_t a = 6 * i, b = 6 * (row + right), c = 6 * (above + right);
        const uint32_t d = 6 * (above + x), low = a + 4, high = a + 5;
        add_quad(&m, a, a + 1, low, a + 3);
        add_quad(&m, b, b + 2, low, a + 1);
        add_quad(&m, c, a + 3, low, b + 2);
        add_quad(&m, c, d + 1, high, a + 3);
        add_quad(&m, d, a + 2, high, d + 1);
        add_quad(&m, a, a + 3, high, a + 2);
    }
    return m;
}

/* Bricks laid with shifted joints, each cut in two along the middle: vertices of valence 3 and 4.
   Per row and column: a vertex of the joint below; in every second column one halfway up. */
static mesh mesh_p5(uint32_t faces)
{
    const uint32_t size = (uint32_t)sqrt((double)faces) / 2 * 2, half = size / 2;
    mesh m = mesh_allocate("bricks", size * (size + half), size * size, 5 * size * size);
    uint32_t x, y, i;
    for (y = 0; y < size; y++)
        for (x = 0; x < size; x++) add_torus_point(&m, x / (double)size, y / (double)size);
    for (y = 0; y < size; y++)
        for (i = 0; i < half; i++)
            add_torus_point(&m, (2 * i + y % 2) / (double)size, (y + 0.5) / size);
    for (y = 0; y < size; y++)
        for (i = 0; i < half; i++) {
            const uint32_t x0 = 2 * i + y % 2, x1 = (x0 + 1) % size, x2 = (x0 + 2) % size;
            const uint32_t low = y * size, high = (y + 1) % size * size;
            const uint32_t middle = size * size + y * half;
            uint32_t v[5];
            v[0] = low + x0; v[1] = low + x1; v[2] = low + x2;
            v[3] = middle + (i + 1) % half; v[4] = middle + i;
            add_face(&m, 5, v, 0);
            v[0] = middle + i; v[1] = middle + (i + 1) % half;
            v[2] = high + x2; v[3] = high + x1; v[4] = high + x0;
            add_face(&m, 5, v, 0);
        }
    return m;
}

mesh mesh_of_kind(int kind, uint32_t quads)
{
    const uint32_t triangles = quads * 5 / 3, size = (uint32_t)sqrt(triangles / 2.0);
    switch (kind) {
    case PSURF_BICUBIC:
    case PSURF_PN_QUAD: return mesh_torus(ORDINARY, (uint32_t)sqrt((double)quads));
    case PSURF_POLAR: return mesh_polar(triangles);
    case PSURF_P4: return mesh_p4(quads);
    case PSURF_P5: return mesh_p5(quads);
    default: return mesh_triangles("triangles", size, size, 1);
    }
}
