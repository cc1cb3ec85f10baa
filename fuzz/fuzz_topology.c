/* Fuzzes everything from a mesh to its triangles: bytes become a small mesh, sound or not, and
   whatever the library accepts has to keep all its promises. Inputs that end with the byte MARK
   carry a record of options before it: scheme, normals, flags; others use pm as it comes.

       clang -g -O1 -I. -fsanitize=fuzzer,address,undefined fuzz/fuzz_topology.c -o fuzz_topology
       ./fuzz_topology fuzz/corpus/topology

   -DPSURF_REAL=double works too, and fuzz/standalone.c replays inputs without libFuzzer. The corpus
   is kept to one input per edge of the code reached, from a folder of many:

       ./fuzz_topology -set_cover_merge=1 -use_counters=0 fuzz/corpus/topology many */

#define PSURF_IMPLEMENTATION
#include "patchsurf.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size);

#define CHECK(condition)                                                                           \
    do {                                                                                           \
        if (!(condition)) {                                                                        \
            fprintf(stderr, "%s:%d: not true: %s\n", __FILE__, __LINE__, #condition);              \
            abort();                                                                               \
        }                                                                                          \
    } while (0)

enum { MAX_VERTICES = 256, MAX_FACES = 256, MAX_CORNERS = 1536, MAX_TAGS = 32, MAX_SAMPLES = 16 };
enum { MARK = 0xB5, RECORD = 24 };      /* an input's last byte, and the bytes of options before it */

/* ---- bytes as a source of decisions ---------------------------------------------------------- */

typedef struct source { const uint8_t *data; size_t size; } source;

static uint32_t take(source *s)         /* one byte; 0 when there are no more */
{
    if (!s->size)
        return 0;
    s->size--;
    return *s->data++;
}

static uint32_t take_below(source *s, uint32_t limit)
{
    return limit ? take(s) % limit : 0;
}

static uint32_t take_word(source *s)
{
    uint32_t word = take(s);
    word |= take(s) << 8;
    word |= take(s) << 16;
    return word | take(s) << 24;
}

/* Mostly tame numbers, now and then any bits at all: infinities, NaN, denormals. */
static psurf_real take_real(source *s)
{
    uint32_t kind = take(s);
    if (kind >= 8)
        return (psurf_real)((double)kind / 16.0 - 8.0 + (double)take(s) / 4096.0);
    uint32_t bits = take_word(s);
    float any;
    memcpy(&any, &bits, sizeof any);
    return (psurf_real)any;
}

static void *get(size_t size)           /* exactly so much: the sanitizer sees one byte more */
{
    void *memory = malloc(size + !size);
    if (!memory)
        exit(2);
    return memory;
}

/* ---- meshes ---------------------------------------------------------------------------------- */

typedef struct mesh {
    uint32_t vertex_count, face_count, corner_count;
    uint32_t sizes[MAX_FACES], corners[MAX_CORNERS];
    psurf_real positions[MAX_VERTICES][3];
    psurf_edge_tag tags[MAX_TAGS];
    uint32_t tag_count;
    uint32_t flagged[MAX_TAGS];         /* vertices named as corners */
    uint32_t flagged_count;
} mesh;

/* The face that an index into corners lies in, and its first corner. */
static uint32_t face_of(const mesh *m, uint32_t corner, uint32_t *first)
{
    uint32_t face = 0;
    *first = 0;
    while (corner >= *first + m->sizes[face])
        *first += m->sizes[face++];
    return face;
}

static void add_face(mesh *m, uint32_t size, const uint32_t *corners)
{
    if (m->face_count == MAX_FACES || m->corner_count + size > MAX_CORNERS)
        return;
    m->sizes[m->face_count++] = size;
    for (uint32_t i = 0; i < size; i++)
        m->corners[m->corner_count++] = corners[i];
}

static void add_quad(mesh *m, uint32_t a, uint32_t b, uint32_t c, uint32_t d, uint32_t cut)
{
    const uint32_t quad[4] = {a, b, c, d}, halves[2][2][3] = {{{a, b, c}, {a, c, d}},
                                                              {{b, c, d}, {b, d, a}}};
    if (cut < 2) {
        add_face(m, 3, halves[cut][0]);
        add_face(m, 3, halves[cut][1]);
    } else {
        add_face(m, 4, quad);
    }
}

/* A torus of width x height quads, some of them cut: valences 3 to 8. */
static void make_torus(mesh *m, source *s)
{
    uint32_t width = 3 + take_below(s, 5), height = 3 + take_below(s, 5);
    uint32_t base = m->vertex_count;
    for (uint32_t y = 0; y < height; y++)
        for (uint32_t x = 0; x < width; x++) {
            uint32_t row = base + y * width, above = base + (y + 1) % height * width;
            uint32_t right = (x + 1) % width;
            add_quad(m, row + x, row + right, above + right, above + x, take_below(s, 8));
        }
    m->vertex_count += width * height;
}

/* A tube of n sides, closed at each end by one face or by a fan round a pole. */
static void make_tube(mesh *m, source *s)
{
    uint32_t n = 3 + take_below(s, 14), rings = 1 + take_below(s, 3), base = m->vertex_count;
    uint32_t cap[16], fan[3];
    for (uint32_t y = 0; y + 1 < rings; y++)
        for (uint32_t x = 0; x < n; x++) {
            uint32_t row = base + y * n, right = (x + 1) % n;
            add_quad(m, row + x, row + right, row + n + right, row + n + x, take_below(s, 8));
        }
    m->vertex_count += rings * n;
    for (uint32_t end = 0; end < 2; end++) {
        uint32_t row = base + (end ? (rings - 1) * n : 0);
        for (uint32_t x = 0; x < n; x++)
            cap[x] = row + (end ? x : n - 1 - x);
        if (take(s) & 1) {
            add_face(m, n, cap);
            continue;
        }
        for (uint32_t x = 0; x < n; x++) {
            fan[0] = cap[x];
            fan[1] = cap[(x + 1) % n];
            fan[2] = m->vertex_count;
            add_face(m, 3, fan);
        }
        m->vertex_count++;
    }
}

static void make_dodecahedron(mesh *m)
{
    static const uint32_t faces[12][5] = {
        {0, 1, 2, 3, 4},      {0, 5, 10, 6, 1},     {1, 6, 11, 7, 2},     {2, 7, 12, 8, 3},
        {3, 8, 13, 9, 4},     {4, 9, 14, 5, 0},     {19, 18, 17, 16, 15}, {15, 16, 11, 6, 10},
        {16, 17, 12, 7, 11},  {17, 18, 13, 8, 12},  {18, 19, 14, 9, 13},  {19, 15, 10, 5, 14}};
    for (uint32_t f = 0; f < 12; f++) {
        uint32_t face[5];
        for (uint32_t i = 0; i < 5; i++)
            face[i] = m->vertex_count + faces[f][i];
        add_face(m, 5, face);
    }
    m->vertex_count += 20;
}

/* A sheet with four borders. */
static void make_grid(mesh *m, source *s)
{
    uint32_t width = 1 + take_below(s, 6), height = 1 + take_below(s, 6), row = width + 1;
    uint32_t base = m->vertex_count;
    for (uint32_t y = 0; y < height; y++)
        for (uint32_t x = 0; x < width; x++) {
            uint32_t v = base + y * row + x;
            add_quad(m, v, v + 1, v + row + 1, v + row, take_below(s, 8));
        }
    m->vertex_count += row * (height + 1);
}

/* Faces without rhyme or reason. */
static void make_junk(mesh *m, source *s)
{
    uint32_t faces = take_below(s, 24);
    m->vertex_count = take_below(s, 24);
    for (uint32_t f = 0; f < faces; f++) {
        uint32_t size = take_below(s, 9), corners[9];
        for (uint32_t i = 0; i < size; i++)
            corners[i] = take_below(s, m->vertex_count + 1);
        add_face(m, size, corners);
    }
}

/* Damages a mesh, or makes another sound one of it. */
static void mutate(mesh *m, source *s)
{
    uint32_t what = take_below(s, 6), a, b, swap, face, first = 0;
    if (!m->corner_count)
        return;
    a = take_word(s) % m->corner_count;
    b = take_word(s) % m->corner_count;
    face = take_below(s, m->face_count);
    for (uint32_t f = 0; f < face; f++)
        first += m->sizes[f];
    switch (what) {
    case 0:                             /* any index */
        m->corners[a] = take_word(s);
        break;
    case 1:                             /* glue: two vertices become one where a corner is */
        m->corners[a] = m->corners[b];
        break;
    case 2:                             /* glue everywhere: often a non-manifold vertex */
        swap = m->corners[a];
        for (uint32_t i = 0; i < m->corner_count; i++)
            if (m->corners[i] == swap)
                m->corners[i] = m->corners[b];
        break;
    case 3:                             /* turn a face round */
        for (uint32_t i = 0; i < m->sizes[face] / 2; i++) {
            swap = m->corners[first + i];
            m->corners[first + i] = m->corners[first + m->sizes[face] - 1 - i];
            m->corners[first + m->sizes[face] - 1 - i] = swap;
        }
        break;
    case 4:                             /* a face goes: a hole */
        m->corner_count -= m->sizes[face];
        for (uint32_t i = first; i < m->corner_count; i++)
            m->corners[i] = m->corners[i + m->sizes[face]];
        m->face_count--;
        for (uint32_t f = face; f < m->face_count; f++)
            m->sizes[f] = m->sizes[f + 1];
        break;
    default:                            /* rotate a face: the mesh stays the same */
        swap = m->sizes[face] ? m->corners[first] : 0;
        for (uint32_t i = 0; i + 1 < m->sizes[face]; i++)
            m->corners[first + i] = m->corners[first + i + 1];
        if (m->sizes[face])
            m->corners[first + m->sizes[face] - 1] = swap;
        break;
    }
}

static int is_tagged(const mesh *m, uint32_t v0, uint32_t v1)
{
    for (uint32_t i = 0; i < m->tag_count; i++)
        if ((m->tags[i].v0 == v0 && m->tags[i].v1 == v1) ||
            (m->tags[i].v0 == v1 && m->tags[i].v1 == v0))
            return 1;
    return 0;
}

/* Marks: mostly of edges that exist and once each, so that the mesh is taken. */
static void make_tags(mesh *m, source *s)
{
    static const double blends[8] = {0.0, 1.0, 0.5, 0.01, 2.0 / 3.0, 1e-30, -1.0, (double)NAN};
    uint32_t count = take_below(s, 2) ? 0 : take_below(s, MAX_TAGS + 1);
    for (uint32_t i = 0; i < count && m->corner_count; i++) {
        psurf_edge_tag *tag = &m->tags[m->tag_count];
        uint32_t corner = take_word(s) % m->corner_count, first, kind = take(s);
        uint32_t face = face_of(m, corner, &first);
        uint32_t next = first + (corner - first + 1) % m->sizes[face];
        memset(tag, 0, sizeof *tag);
        tag->v0 = m->corners[corner];
        tag->v1 = m->corners[kind == 255 ? (corner + 2) % m->corner_count : next];
        tag->flags = kind < 240 ? kind & (PSURF_HARD | PSURF_BLEND) : kind;
        tag->blend0 = (psurf_real)blends[take_below(s, kind & 4 ? 8 : 6)];
        tag->blend1 = (psurf_real)blends[take_below(s, kind & 4 ? 8 : 6)];
        if (!is_tagged(m, tag->v0, tag->v1) || kind == 254)
            m->tag_count++;
    }
    m->flagged_count = take_below(s, 4) ? 0 : take_below(s, MAX_TAGS + 1);
    for (uint32_t i = 0; i < m->flagged_count; i++)
        m->flagged[i] = take_below(s, m->vertex_count + (take(s) == 255));
}

static void make_mesh(mesh *m, source *s)
{
    uint32_t parts = 1 + take_below(s, 2), mutations;
    memset(m, 0, sizeof *m);
    for (uint32_t i = 0; i < parts; i++)
        switch (take_below(s, 7)) {
        case 0: make_torus(m, s); break;
        case 1: case 2: make_tube(m, s); break;
        case 3: make_dodecahedron(m); break;
        case 4: case 5: make_grid(m, s); break;
        default: make_junk(m, s); break;
        }
    mutations = take_below(s, 4);
    for (uint32_t i = 0; i < mutations; i++)
        mutate(m, s);
    if (m->vertex_count > MAX_VERTICES)
        m->vertex_count = MAX_VERTICES;
    for (uint32_t v = 0; v < m->vertex_count; v++)
        for (int i = 0; i < 3; i++)
            m->positions[v][i] = take_real(s);
    make_tags(m, s);
}

/* ---- options: what else a mesh and its construction are given --------------------------------- */

typedef struct options {
    psurf_scheme scheme;
    psurf_split split;
    psurf_normal_mode normal_mode;
    psurf_variant variant;
    psurf_shading shading;
    uint32_t flags;
    psurf_real sigma;
    uint32_t canary, given;             /* given: kind of normals, see make_given_normals */
    uint32_t stride[4];                 /* in reals: positions, normals, points, tessellation */
    uint32_t seed;                      /* of what needs no bytes of its own */
    uint32_t normal_count;
    int has_normals, has_schemes;
    uint32_t face_normals[MAX_CORNERS];
    unsigned char face_schemes[MAX_FACES];
} options;

/* Another number each time, from a seed alone: for choices that need not be searched. */
static uint32_t next_below(uint32_t *seed, uint32_t limit)
{
    *seed = *seed * 1664525u + 1013904223u;
    return limit ? (*seed >> 8) % limit : 0;
}

/* Normals by index: one per vertex, per face, two per vertex, or any; now and then one too high. */
static void make_face_normals(options *o, const mesh *m, source *record)
{
    const uint32_t kind = take_below(record, 8), count = take(record);
    uint32_t seed = o->seed, corner = 0;
    o->has_normals = kind != 0;
    o->normal_count = kind == 1   ? m->vertex_count
                      : kind == 2 ? m->face_count
                      : kind <= 5 ? 2 * m->vertex_count
                                  : count;
    for (uint32_t f = 0; f < m->face_count; f++) {
        const uint32_t side = next_below(&seed, 4) == 0;
        for (uint32_t i = 0; i < m->sizes[f]; i++, corner++) {
            const uint32_t v = m->corners[corner];
            o->face_normals[corner] = kind == 2   ? f
                                      : kind <= 4 ? v + (kind > 2 ? side * m->vertex_count : 0)
                                      : kind == 5 ? 2 * v + (next_below(&seed, 16) == 0)
                                                  : next_below(&seed, count + (kind == 7));
        }
    }
}

/* A scheme per face: of those that go together, of one alone, or any number. */
static void make_face_schemes(options *o, const mesh *m, source *record)
{
    static const unsigned char mixes[4][4] = {
        {PSURF_PN, PSURF_SMOOTHED_N, PSURF_CUBIC_PN_B1, PSURF_CUBIC_PN_B2},
        {PSURF_CUBIC_WM_B1, PSURF_CUBIC_WM_B2, PSURF_WM, PSURF_CUBIC_WM_B1},
        {PSURF_HYBRID, PSURF_HYBRID, PSURF_HYBRID, PSURF_HYBRID},
        {PSURF_PNG1, PSURF_PNG1, PSURF_PNG1, PSURF_PNG1}};
    const uint32_t kind = take(record), any = kind >= 240;
    uint32_t seed = o->seed;
    for (uint32_t f = 0; f < m->face_count; f++)
        o->face_schemes[f] = (unsigned char)(any ? next_below(&seed, PSURF_SCHEME_COUNT + 1)
                                                 : mixes[kind % 4][next_below(&seed, 4)]);
}

static uint32_t take_enum(source *record, uint32_t count)       /* now and then one too high */
{
    const uint32_t byte = take(record);
    return byte == 255 ? count : byte % count;
}

static void make_options(options *o, const mesh *m, source *record)
{
    uint32_t what, bits;
    memset(o, 0, sizeof *o);
    o->seed = take(record);
    o->scheme = (psurf_scheme)take_enum(record, PSURF_SCHEME_COUNT);
    what = take(record);
    o->split = what < 240 ? psurf_scheme_split(o->scheme)
                          : (psurf_split)(what % (PSURF_SPLIT_COUNT + 1));
    o->has_schemes = (o->scheme == PSURF_MIXED) ^ (what >= 248);
    make_face_normals(o, m, record);
    make_face_schemes(o, m, record);
    o->given = take_below(record, 8);
    o->normal_mode = (psurf_normal_mode)take_enum(record, PSURF_NORMALS_COUNT);
    o->variant = (psurf_variant)take_enum(record, PSURF_N_COUNT);
    o->shading = (psurf_shading)take_enum(record, PSURF_SHADE_COUNT);
    bits = take(record);
    o->flags = bits == 255 ? 32u : bits & 31u;
    o->sigma = take_real(record);
    o->canary = take(record) == 255;
    bits = take(record);
    for (int i = 0; i < 4; i++)
        o->stride[i] = 3 + (bits >> 2 * i & 3);
}

/* Given normals, of stride reals each, or NULL. They may point anywhere, or nowhere. */
static psurf_real *make_given_normals(const options *o, const mesh *m, source *s, uint32_t *count)
{
    static const double odd[8] = {0, 0, 1, 1e-30, -1e30, 1e-44, (double)INFINITY, (double)NAN};
    uint32_t seed = o->seed;
    psurf_real *normals;
    *count = o->has_normals ? o->normal_count : m->vertex_count;
    if (!o->given)
        return NULL;
    normals = (psurf_real *)get((size_t)*count * o->stride[1] * sizeof *normals);
    for (uint32_t i = 0; i < *count; i++)
        for (uint32_t k = 0; k < o->stride[1]; k++) {
            const psurf_real p = k < 3 && m->vertex_count
                                     ? m->positions[i % m->vertex_count][k] : 0;
            psurf_real *n = &normals[i * o->stride[1] + k];
            switch (o->given) {
            case 1: case 2: *n = p; break;                              /* as on a sphere */
            case 3: *n = k == i % 7 % 3 ? 1 : 0; break;                 /* of a few directions */
            case 4: *n = next_below(&seed, 2) ? p : -p; break;          /* folded */
            case 5: *n = next_below(&seed, 8) ? p : 0; break;
            case 6: *n = take_real(s); break;
            default: *n = next_below(&seed, 4) ? p : (psurf_real)odd[next_below(&seed, 8)]; break;
            }
        }
    return normals;
}

/* ---- memory that counts, and fails when told to ---------------------------------------------- */

typedef struct heap { size_t held, peak; uint32_t blocks, calls, fail_at; } heap;

static void *heap_alloc(void *ctx, size_t size, size_t align)
{
    heap *h = (heap *)ctx;
    CHECK(align && align <= 16 && !(align & (align - 1)));
    if (++h->calls == h->fail_at)
        return NULL;
    h->blocks++;
    h->held += size;
    if (h->held > h->peak)
        h->peak = h->held;
    return malloc(size);
}

static void heap_release(void *ctx, void *memory, size_t size)
{
    heap *h = (heap *)ctx;
    CHECK(memory && h->blocks && h->held >= size);
    h->blocks--;
    h->held -= size;
    free(memory);
}

/* ---- what must be true of tables ------------------------------------------------------------- */

typedef struct tables {
    psurf_tables t;
    const psurf_ring *rings;
    const psurf_spoke *spokes;
    const psurf_corner *corners;
    const psurf_facet *facets;
    const psurf_edge *edges;
    uint32_t first_corner[MAX_FACES];   /* of each face in the input */
    psurf_split split;
} tables;

static const uint32_t kind_sides[PSURF_KIND_COUNT] = {4, 3, 3, 4, 5, 3, 4, 3, 3, 3, 3, 3};

/* Whether a point is a vertex or a centre. */
static int is_point(const mesh *m, const tables *t, uint32_t point)
{
    return point < m->vertex_count + t->t.centres.count;
}

static void check_ring(const mesh *m, const tables *t, const psurf_topology *topology,
                       const psurf_ring *ring, int centre)
{
    const uint32_t n = ring->valence & PSURF_RING_VALENCE;
    const uint32_t open = (ring->valence & PSURF_RING_OPEN) != 0;
    const uint32_t corner = (ring->valence & PSURF_RING_CORNER) != 0;
    const uint32_t wide = (ring->valence & (PSURF_RING_WIDE_NEXT | PSURF_RING_WIDE_LAST)) != 0;
    const uint32_t nominal = (n - open) * (corner ? 4 : open ? 2 : 1);
    const int pm = t->split == PSURF_SPLIT_PM;      /* splits faces where a ring has too few */
    CHECK(n >= (pm && !corner ? 3 : 2));
    CHECK(open || (!(ring->valence & PSURF_RING_WIDE) && !corner));
    CHECK(!corner || !(ring->valence & PSURF_RING_WIDE));
    CHECK(!wide || corner);
    CHECK(!open || !(ring->valence & PSURF_RING_POLAR));
    CHECK(pm || !(ring->valence & (PSURF_RING_POLAR | PSURF_RING_WIDE | PSURF_RING_WIDE_NEXT |
                                   PSURF_RING_WIDE_LAST)));
    CHECK(centre ? ring->point >= m->vertex_count && !open : ring->point < m->vertex_count);
    CHECK(is_point(m, t, ring->point) && n <= t->t.spokes.count - ring->first_spoke);
    CHECK(ring->trig < t->t.trig.count && nominal < t->t.trig.count - ring->trig);
    for (uint32_t j = 0; j < n; j++) {
        const psurf_spoke *spoke = &t->spokes[ring->first_spoke + j];
        CHECK(is_point(m, t, spoke->end) && spoke->end != ring->point);
        if (ring->point < m->vertex_count && spoke->end < m->vertex_count)
            CHECK(psurf_find_spoke(topology, ring->point, spoke->end) != PSURF_NONE);
        if (open && j + 1 == n) {
            CHECK(spoke->after == PSURF_NONE ||
                  (spoke->after < t->t.spokes.count && t->spokes[spoke->after].end == spoke->end));
            CHECK((spoke->before != PSURF_NONE) == wide);
            CHECK(!wide || spoke->before < t->t.spokes.count);
        } else {
            CHECK(is_point(m, t, spoke->after) && is_point(m, t, spoke->before));
        }
    }
}

static void check_rings(const mesh *m, const tables *t, const psurf_topology *topology)
{
    uint32_t spokes = 0;
    for (uint32_t r = 0; r < t->t.rings.count; r++) {
        CHECK(t->rings[r].first_spoke == spokes);
        check_ring(m, t, topology, &t->rings[r], r + t->t.centres.count >= t->t.rings.count);
        spokes += t->rings[r].valence & PSURF_RING_VALENCE;
    }
    CHECK(spokes == t->t.spokes.count);
    CHECK(!t->t.blends.count || t->t.blends.count == spokes);
    for (uint32_t i = 0; i < t->t.blends.count; i++) {
        psurf_real blend = ((const psurf_real *)t->t.blends.data)[i];
        CHECK(blend >= 0 && blend <= 1);
    }
}

/* Pieces of a face of so many corners, and corners of one piece. pm may split any face. */
static uint32_t piece_count(psurf_split split, uint32_t size, int is_split)
{
    if (split == PSURF_SPLIT_PM)
        return is_split ? size : 1;
    if (split == PSURF_SPLIT_PN)
        return size < 5 ? 1 : (size - 1) / 2;
    return size - 2;
}

static uint32_t piece_sides(psurf_split split, uint32_t size, uint32_t piece, int is_split)
{
    if (split == PSURF_SPLIT_PM)
        return is_split ? 3 : size;
    return split == PSURF_SPLIT_PN && 2 * piece + 3 < size ? 4 : 3;
}

/* The corner of the face that corner i of a piece is; PSURF_NONE: the centre. */
static uint32_t corner_of_piece(psurf_split split, uint32_t size, uint32_t apex, uint32_t piece,
                                uint32_t i, int is_split)
{
    if (!is_split)
        return i;
    if (split == PSURF_SPLIT_PM)
        return i == 2 ? PSURF_NONE : (piece + i) % size;
    return (apex + (i ? (split == PSURF_SPLIT_PN ? 2 : 1) * piece + i : 0)) % size;
}

static uint32_t lowest_corner(const uint32_t *corners, uint32_t size)
{
    uint32_t lowest = 0;
    for (uint32_t i = 1; i < size; i++)
        if (corners[i] < corners[lowest])
            lowest = i;
    return lowest;
}

/* One facet: its corners are the face's, or some of them in the order of the split, and every
   corner's spoke leads to the next corner and starts a facet of its ring. */
static void check_facet(const mesh *m, const tables *t, const options *o, const psurf_facet *facet,
                        uint32_t first, uint32_t sides)
{
    const uint32_t size = m->sizes[facet->face], piece = facet->piece & 0xFFFF;
    const uint32_t *face_corners = m->corners + t->first_corner[facet->face];
    const int split = (facet->piece & PSURF_SPLIT_FACE) != 0;
    uint32_t apex = 0;
    if (t->split != PSURF_SPLIT_PM) {
        CHECK(split == (size >= (t->split == PSURF_SPLIT_PN ? 5u : 4u)));
        apex = split ? lowest_corner(face_corners, size) : 0;
        CHECK((facet->piece & ~PSURF_SPLIT_FACE) >> 16 == apex);
    }
    CHECK(piece < piece_count(t->split, size, split));
    CHECK(sides == piece_sides(t->split, size, piece, split));
    for (uint32_t i = 0; i < sides; i++) {
        const psurf_corner *corner = &t->corners[first + i];
        const psurf_corner *next = &t->corners[first + (i + 1) % sides];
        const uint32_t r = corner->ring & ~PSURF_WRITER, edge = corner->edge & ~PSURF_WRITER;
        const uint32_t here = corner_of_piece(t->split, size, apex, piece, i, split);
        const uint32_t there = corner_of_piece(t->split, size, apex, piece, (i + 1) % sides, split);
        const int outer = here != PSURF_NONE && there == (here + 1) % size;
        uint32_t point, open;
        CHECK(r < t->t.rings.count && (next->ring & ~PSURF_WRITER) < t->t.rings.count);
        point = t->rings[r].point;
        open = (t->rings[r].valence & PSURF_RING_OPEN) != 0;
        if (here == PSURF_NONE)
            CHECK(point >= m->vertex_count &&
                  ((const uint32_t *)t->t.centres.data)[point - m->vertex_count] == facet->face);
        else
            CHECK(point == face_corners[here]);
        if (t->t.ring_normals.count && here != PSURF_NONE)
            CHECK(((const uint32_t *)t->t.ring_normals.data)[r] ==
                  o->face_normals[t->first_corner[facet->face] + here]);
        if (!outer && t->split == PSURF_SPLIT_PM)
            CHECK(corner->edge == PSURF_INNER_EDGE);
        else
            CHECK(edge < t->t.edges.count);
        CHECK(corner->spoke >= t->rings[r].first_spoke &&
              corner->spoke - t->rings[r].first_spoke + open <
                  (t->rings[r].valence & PSURF_RING_VALENCE));
        CHECK(t->spokes[corner->spoke].end == t->rings[next->ring & ~PSURF_WRITER].point);
    }
}

/* What a face's triangles are filed under. */
static int is_kind_of(const tables *t, const options *o, uint32_t kind, uint32_t face)
{
    static const uint32_t triangles[PSURF_SCHEME_COUNT] = {
        PSURF_PN_TRI, PSURF_PN_TRI, PSURF_NPATCH, PSURF_HYBRID_TRI, PSURF_PNG1_TRI, PSURF_RIBBON,
        PSURF_RIBBON, PSURF_RIBBON_B2, PSURF_RIBBON_B2, PSURF_PN_TRI};
    if (t->split == PSURF_SPLIT_PM)
        return kind <= PSURF_P5;
    if (t->split == PSURF_SPLIT_PN && kind == PSURF_PN_QUAD)
        return 1;
    return kind == (o->has_schemes ? triangles[o->face_schemes[face]] : (uint32_t)PSURF_PN_TRI);
}

static void check_facets(const mesh *m, const tables *t, const options *o)
{
    uint32_t corner = 0;
    CHECK(t->t.kind_first[0] == 0 && t->t.kind_first_corner[0] == 0);
    CHECK(t->t.face_facet.count == m->face_count);
    for (uint32_t kind = 0; kind < PSURF_KIND_COUNT; kind++) {
        uint32_t end = t->t.kind_first[kind + 1];
        CHECK(end >= t->t.kind_first[kind] && end <= t->t.facets.count);
        CHECK(corner == t->t.kind_first_corner[kind]);
        for (uint32_t k = t->t.kind_first[kind]; k < end; k++) {
            const psurf_facet *facet = &t->facets[k];
            const psurf_facet *last = &t->facets[k - (k > t->t.kind_first[kind])];
            const uint32_t piece = facet->piece & 0xFFFF;
            CHECK(facet->face < m->face_count && is_kind_of(t, o, kind, facet->face));
            CHECK(corner + kind_sides[kind] <= t->t.corners.count);
            CHECK(k == t->t.kind_first[kind] || facet->face > last->face ||
                  (facet->face == last->face && piece > (last->piece & 0xFFFF)));
            if (piece == 0)
                CHECK(((const uint32_t *)t->t.face_facet.data)[facet->face] == k);
            check_facet(m, t, o, facet, corner, kind_sides[kind]);
            corner += kind_sides[kind];
        }
    }
    CHECK(t->t.kind_first[PSURF_KIND_COUNT] == t->t.facets.count);
    CHECK(corner == t->t.corners.count);
}

static uint32_t face_of_corner(const tables *t, uint32_t corner)
{
    uint32_t kind = 0;
    while (corner >= t->t.kind_first_corner[kind + 1])
        kind++;
    return t->facets[t->t.kind_first[kind] +
                     (corner - t->t.kind_first_corner[kind]) / kind_sides[kind]].face;
}

/* The two sides of an edge run against each other. One facet writes an edge, of a hard one each its
   own side; one facet writes a ring, nobody a centre's. Last come edges between pieces. */
static void check_edges(const tables *t, const psurf_info *info)
{
    uint32_t edge_writers = 0, ring_writers = 0, open = 0, inner = 0;
    for (uint32_t e = 0; e < t->t.edges.count; e++) {
        const psurf_edge *edge = &t->edges[e];
        const psurf_corner *a, *b;
        CHECK(edge->corner < t->t.corners.count);
        a = &t->corners[edge->corner];
        CHECK(a->edge == (e | PSURF_WRITER));
        if (edge->other == PSURF_NONE) {
            CHECK(e < info->edges);
            open++;
            continue;
        }
        CHECK(edge->other < t->t.corners.count);
        b = &t->corners[edge->other];
        if (b->edge & PSURF_WRITER) {
            uint32_t back = b->edge & ~PSURF_WRITER;
            CHECK((back < info->edges) != (e < info->edges));
            CHECK(back < info->edge_sides && e < info->edge_sides);
            CHECK(t->edges[back].other == edge->corner && t->edges[back].corner == edge->other);
        } else {
            CHECK(b->edge == e && (e < info->edges || e >= info->edge_sides));
        }
        CHECK(e < info->edge_sides ||
              face_of_corner(t, edge->corner) == face_of_corner(t, edge->other));
        CHECK(t->spokes[a->spoke].end == t->rings[b->ring & ~PSURF_WRITER].point);
        CHECK(t->spokes[b->spoke].end == t->rings[a->ring & ~PSURF_WRITER].point);
    }
    for (uint32_t c = 0; c < t->t.corners.count; c++) {
        edge_writers += t->corners[c].edge >> 31;
        ring_writers += t->corners[c].ring >> 31;
        inner += t->corners[c].edge == PSURF_INNER_EDGE;
    }
    CHECK(open == info->boundary_edges && info->edge_sides == info->edges + info->hard_edges);
    CHECK(edge_writers == t->t.edges.count && ring_writers == info->rings - info->centres);
    CHECK(t->t.corners.count == 2 * info->edges - open + inner + 2 * info->inner_edges);
}

/* Faces and pieces against a count of our own. */
static void check_info(const mesh *m, const tables *t, const psurf_info *info)
{
    uint32_t faces = info->ngon_faces, facets = info->faces, ngons = 0;
    for (uint32_t kind = 0; kind < PSURF_KIND_COUNT; kind++)
        faces += info->kind_faces[kind];
    CHECK(info->vertices == m->vertex_count && info->faces == m->face_count);
    CHECK(faces == info->faces);
    CHECK(t->t.centres.count == info->centres);
    if (t->split == PSURF_SPLIT_PM) {
        for (uint32_t i = 0; i < info->centres; i++)
            facets += m->sizes[((const uint32_t *)t->t.centres.data)[i]] - 1;
        CHECK(info->ngon_faces == info->centres && !info->inner_edges);
    } else {
        for (uint32_t f = 0; f < m->face_count; f++) {
            facets += piece_count(t->split, m->sizes[f], 1) - 1;
            ngons += piece_count(t->split, m->sizes[f], 1) > 1;
        }
        CHECK(info->ngon_faces == ngons && !info->centres);
        CHECK(info->inner_edges == facets - info->faces);
    }
    CHECK(info->facets == facets && t->t.facets.count == facets);
    CHECK(t->t.edges.count == info->edge_sides + info->inner_edges);
    CHECK(info->rings == t->t.rings.count && info->spokes == t->t.spokes.count);
}

static void check_topology(const mesh *m, const options *o, const psurf_topology *topology,
                           const heap *h)
{
    const int names_normals = o->has_normals && o->split != PSURF_SPLIT_PM;
    psurf_info info;
    tables t;
    psurf_topology_info(topology, &info);
    psurf_topology_tables(topology, &t.t);
    t.rings = (const psurf_ring *)t.t.rings.data;
    t.spokes = (const psurf_spoke *)t.t.spokes.data;
    t.corners = (const psurf_corner *)t.t.corners.data;
    t.facets = (const psurf_facet *)t.t.facets.data;
    t.edges = (const psurf_edge *)t.t.edges.data;
    t.split = o->split;
    for (uint32_t f = 0, first = 0; f < m->face_count; first += m->sizes[f++])
        t.first_corner[f] = first;
    CHECK(info.bytes == h->held && info.peak_bytes == h->peak);
    CHECK(t.t.version == PSURF_TABLE_VERSION);
    CHECK(t.t.ring_normals.count == (names_normals ? info.rings : 0));
    for (uint32_t r = 0; r < t.t.ring_normals.count; r++)
        CHECK(((const uint32_t *)t.t.ring_normals.data)[r] < o->normal_count);
    check_info(m, &t, &info);
    check_rings(m, &t, topology);
    check_facets(m, &t, o);
    check_edges(&t, &info);
}

/* ---- what must be true of points ------------------------------------------------------------- */

static int is_tame(const psurf_real *values, size_t count)
{
    for (size_t i = 0; i < count; i++)
        if (!(values[i] <= (psurf_real)1e6 && values[i] >= (psurf_real)-1e6))
            return 0;
    return 1;
}

static int is_finite(const psurf_real *values, size_t count)
{
    for (size_t i = 0; i < count; i++)
        if (!isfinite((double)values[i]))
            return 0;
    return 1;
}

/* The same bits, or both NaN, which may have any payload. */
static int is_same(const psurf_real *a, const psurf_real *b, size_t count)
{
    for (size_t i = 0; i < count; i++)
        if (memcmp(&a[i], &b[i], sizeof a[i]) && !(isnan((double)a[i]) && isnan((double)b[i])))
            return 0;
    return 1;
}

static int is_unit_or_zero(const psurf_real *n)
{
    const double q = (double)n[0] * (double)n[0] + (double)n[1] * (double)n[1] +
                     (double)n[2] * (double)n[2];
    return q <= 0 || fabs(q - 1) < 1e-5;
}

/* An array of points, stride reals apart, of exactly the memory that it may take. What lies between
   the points is of one value, and has to stay it. */
typedef struct points { psurf_real *at; size_t count, stride; } points;

static const psurf_real untouched = (psurf_real)12345678;

static points make_points(size_t count, size_t stride)
{
    const size_t reals = count ? (count - 1) * stride + 3 : 0;
    points a = {NULL, count, stride};
    a.at = (psurf_real *)get(reals * sizeof *a.at);
    for (size_t i = 0; i < reals; i++)
        a.at[i] = untouched;
    return a;
}

static psurf_real *point_of(const points *a, size_t i)
{
    return a->at + i * a->stride;
}

static void check_gaps(const points *a)
{
    for (size_t i = 0; i + 1 < a->count; i++)
        for (size_t k = 3; k < a->stride; k++)
            CHECK(!memcmp(&point_of(a, i)[k], &untouched, sizeof untouched));
}

/* Points of b, from its first on, are those of a from some on. */
static void check_same(const points *a, size_t first, const points *b)
{
    CHECK(first <= a->count && b->count <= a->count - first);
    for (size_t i = 0; i < b->count; i++)
        CHECK(is_same(point_of(a, first + i), point_of(b, i), 3));
}

static void check_finite(const points *a, int unit)
{
    for (size_t i = 0; i < a->count; i++)
        CHECK(is_finite(point_of(a, i), 3) && (!unit || is_unit_or_zero(point_of(a, i))));
}

/* All that is known of one surface. */
typedef struct surface {
    const mesh *m;
    const options *o;
    const psurf_patches *patches;
    const psurf_construct_desc *desc;
    psurf_info info;
    int tame;                           /* input of moderate size: so has the output to be */
    int finite;
} surface;

enum { EVAL_ARRAYS = 8 };               /* p n shade du dv duu duv dvv */

static void eval_into(const psurf_patches *patches, const psurf_sample *samples, uint32_t count,
                      points a[EVAL_ARRAYS], uint32_t stride)
{
    psurf_points out;
    for (int k = 0; k < EVAL_ARRAYS; k++)
        a[k] = make_points(count, stride);
    out.p = a[0].at;
    out.n = a[1].at;
    out.shade = a[2].at;
    out.du = a[3].at;
    out.dv = a[4].at;
    out.duu = a[5].at;
    out.duv = a[6].at;
    out.dvv = a[7].at;
    out.stride = stride * sizeof(psurf_real);
    psurf_eval(patches, samples, count, &out);
}

/* Samples of any bytes, all at once and one by one. */
static void check_eval(const surface *f, source *s)
{
    psurf_sample samples[MAX_SAMPLES];
    psurf_real gauss[MAX_SAMPLES], mean[MAX_SAMPLES], box[6];
    uint32_t count = take_below(s, MAX_SAMPLES + 1), faces = f->info.faces;
    points all[EVAL_ARRAYS], one[EVAL_ARRAYS];
    memset(samples, 0, sizeof samples);
    for (uint32_t i = 0; i < count; i++) {
        samples[i].face = take_below(s, 8) ? take_below(s, faces) : take_word(s);
        samples[i].sector = take_below(s, 8) ? take_below(s, 17) : take_word(s);
        samples[i].u = take_below(s, 2) ? take_real(s) : (psurf_real)take_below(s, 5) / 4;
        samples[i].v = take_below(s, 2) ? take_real(s) : (psurf_real)take_below(s, 5) / 4;
    }
    eval_into(f->patches, samples, count, all, f->o->stride[2]);
    psurf_curvature(f->patches, samples, count, gauss, mean);
    for (uint32_t i = 0; i < count; i++) {
        uint32_t face = samples[i].face < faces ? samples[i].face : faces - 1;
        eval_into(f->patches, &samples[i], 1, one, 3);
        for (int k = 0; k < EVAL_ARRAYS; k++) {
            CHECK(is_same(point_of(&all[k], i), one[k].at, 3));
            free(one[k].at);
        }
        if (!f->tame || !faces)
            continue;
        for (int k = 0; k < 5; k++)     /* second derivatives grow without bound towards a pole */
            CHECK(is_finite(point_of(&all[k], i), 3));
        CHECK(is_unit_or_zero(point_of(&all[1], i)) && is_unit_or_zero(point_of(&all[2], i)));
        psurf_bounds(f->patches, face, 1, box);
        for (int k = 0; k < 3; k++)
            CHECK(point_of(&all[0], i)[k] >= box[k] && point_of(&all[0], i)[k] <= box[3 + k]);
    }
    for (int k = 0; k < EVAL_ARRAYS; k++) {
        check_gaps(&all[k]);
        free(all[k].at);
    }
}

/* Boxes of all faces, and of a range that reaches beyond the last. */
static void check_bounds(const surface *f)
{
    const uint32_t faces = f->info.faces, first = faces / 3;
    psurf_real *all = (psurf_real *)get(6 * faces * sizeof *all);
    psurf_real *some = (psurf_real *)get(6 * (faces - first) * sizeof *some);
    psurf_bounds(f->patches, 0, PSURF_NONE, all);
    psurf_bounds(f->patches, first, PSURF_NONE, some);
    CHECK(is_same(all + 6 * first, some, 6 * (faces - first)));
    free(all);
    free(some);
}

/* A tessellation of a range of faces, and the memory for it. */
typedef struct tessellation {
    psurf_tess_span span;
    points p, n, shade;
    psurf_sample *where;
    void *indices;
    size_t wide;
} tessellation;

static tessellation make_tessellation(const psurf_tess_span *span, const psurf_tess_desc *desc,
                                      uint32_t stride)
{
    tessellation t;
    memset(&t, 0, sizeof t);
    t.span = *span;
    t.wide = desc->flags & PSURF_TESS_INDEX16 ? 2 : 4;
    t.p = make_points(span->vertex_count, stride);
    t.n = make_points(span->vertex_count, stride);
    t.shade = make_points(span->vertex_count, 3);
    t.where = (psurf_sample *)get(span->vertex_count * sizeof *t.where);
    t.indices = get(span->index_count * t.wide);
    return t;
}

static void free_tessellation(tessellation *t)
{
    free(t->p.at);
    free(t->n.at);
    free(t->shade.at);
    free(t->where);
    free(t->indices);
}

/* Writes faces into the memory of a range that holds them. */
static void tessellate(const surface *f, const psurf_tess_desc *desc, uint32_t first,
                       uint32_t count, const tessellation *t, int shades)
{
    psurf_tess_out out;
    memset(&out, 0, sizeof out);
    out.p = t->p.at;
    out.n = t->n.at;
    out.shade = shades ? t->shade.at : NULL;
    out.p_stride = t->p.stride * sizeof(psurf_real);
    out.n_stride = t->n.stride == 3 ? 0 : t->n.stride * sizeof(psurf_real);
    out.where = t->where;
    out.indices = t->indices;
    out.first_vertex = t->span.first_vertex;
    out.first_index = t->span.first_index;
    CHECK(psurf_tessellate(f->patches, desc, first, count, &out) == PSURF_OK);
}

static uint32_t index_of(const tessellation *t, size_t i)
{
    return t->wide == 2 ? ((const uint16_t *)t->indices)[i] : ((const uint32_t *)t->indices)[i];
}

static int is_same_place(const psurf_sample *a, const psurf_sample *b)
{
    return a->face == b->face && a->sector == b->sector && !memcmp(&a->u, &b->u, sizeof a->u) &&
           !memcmp(&a->v, &b->v, sizeof a->v);
}

/* A part of a whole tessellation, in memory of its own. */
static void check_part(const tessellation *whole, const tessellation *part)
{
    const size_t first = part->span.first_vertex;
    check_same(&whole->p, first, &part->p);
    check_same(&whole->n, first, &part->n);
    check_same(&whole->shade, first, &part->shade);
    CHECK(!memcmp(whole->where + first, part->where, part->span.vertex_count * sizeof *part->where));
    for (size_t i = 0; i < part->span.index_count; i++)
        CHECK(index_of(whole, part->span.first_index + i) == index_of(part, i) + first);
}

static void check_numbers(const surface *f, const tessellation *t)
{
    const float one = 1;
    float *ones = (float *)get(f->m->corner_count * sizeof *ones), sum;
    for (uint32_t i = 0; i < f->m->corner_count; i++)
        ones[i] = one;
    for (size_t i = 0; i < t->span.index_count; i++)
        CHECK(index_of(t, i) < t->span.vertex_count);
    for (uint32_t i = 0; i < t->span.vertex_count; i++) {
        CHECK(t->where[i].face < f->info.faces);
        psurf_interpolate(f->patches->topology, &t->where[i], 1, ones, 1, &sum, 0);
        CHECK(fabsf(sum - 1) < 1e-4f);
    }
    if (f->tame) {
        check_finite(&t->p, 0);
        check_finite(&t->n, 1);
        check_finite(&t->shade, 1);
    }
    check_gaps(&t->p);
    check_gaps(&t->n);
    free(ones);
}

/* All faces at once, and in ranges: per face each in memory of its own. */
static tessellation check_ranges(const surface *f, uint32_t rate, uint32_t flags)
{
    const uint32_t faces = f->info.faces, parts[4] = {faces / 2, faces, 0, faces / 2};
    psurf_tess_desc desc;
    psurf_tess_span span;
    tessellation whole, part;
    memset(&desc, 0, sizeof desc);
    desc.rate = rate;
    desc.flags = flags;
    CHECK(psurf_tessellate_size(f->patches->topology, &desc, 0, faces, &span) == PSURF_OK);
    CHECK(span.first_vertex == 0 && span.first_index == 0);
    whole = make_tessellation(&span, &desc, f->o->stride[3]);
    part = make_tessellation(&span, &desc, 3);
    tessellate(f, &desc, 0, PSURF_NONE, &whole, 1);
    for (int i = 0; i < 4; i += 2) {
        const uint32_t first = parts[i], count = parts[i + 1] - first;
        if (flags & PSURF_TESS_PER_FACE) {
            free_tessellation(&part);
            CHECK(psurf_tessellate_size(f->patches->topology, &desc, first, count, &span) ==
                  PSURF_OK);
            part = make_tessellation(&span, &desc, 3);
        }
        tessellate(f, &desc, first, count, &part, 1);
        if (flags & PSURF_TESS_PER_FACE)
            check_part(&whole, &part);
    }
    if (!(flags & PSURF_TESS_PER_FACE))
        check_part(&whole, &part);
    free_tessellation(&part);
    check_numbers(f, &whole);
    return whole;
}

/* Welded or per face: the same triangles with the same corners. */
static void check_tessellation(const surface *f, uint32_t rate, uint32_t flags)
{
    const uint32_t wide = flags & PSURF_TESS_INDEX16;
    tessellation welded = check_ranges(f, rate, wide);
    tessellation apart = check_ranges(f, rate, wide | PSURF_TESS_PER_FACE);
    CHECK(welded.span.index_count == apart.span.index_count);
    for (size_t i = 0; i < welded.span.index_count; i++) {
        const uint32_t a = index_of(&welded, i), b = index_of(&apart, i);
        if (f->tame)
            CHECK(is_same(point_of(&welded.p, a), point_of(&apart.p, b), 3));
        if (!is_same_place(&welded.where[a], &apart.where[b]))
            continue;                   /* another face wrote it */
        CHECK(is_same(point_of(&welded.p, a), point_of(&apart.p, b), 3));
        CHECK(is_same(point_of(&welded.n, a), point_of(&apart.n, b), 3));
        CHECK(is_same(point_of(&welded.shade, a), point_of(&apart.shade, b), 3));
    }
    free_tessellation(&welded);
    free_tessellation(&apart);
}

static void check_edges_meet(const surface *f, uint32_t rate)
{
    const psurf_info *info = &f->info;
    const uint32_t pairs = info->edges - info->boundary_edges + info->inner_edges;
    const uint32_t edges = info->edges + info->inner_edges, half = edges / 2;
    psurf_check_result whole, a, b;
    CHECK(psurf_check(f->patches, f->desc, rate, 0, edges, &whole) == PSURF_OK);
    CHECK(psurf_check(f->patches, f->desc, rate, 0, half, &a) == PSURF_OK);
    CHECK(psurf_check(f->patches, f->desc, rate, half, PSURF_NONE, &b) == PSURF_OK);
    CHECK(whole.samples == (uint64_t)pairs * (rate + 1));
    CHECK(whole.samples == a.samples + b.samples && whole.cracks == a.cracks + b.cracks);
    CHECK(whole.nonfinite == a.nonfinite + b.nonfinite);
    CHECK(whole.degenerate == a.degenerate + b.degenerate);
    CHECK(whole.sharp_edges == a.sharp_edges + b.sharp_edges);
    CHECK(whole.fallback_edges == a.fallback_edges + b.fallback_edges);
    CHECK(whole.sharp_edges >= info->hard_edges && whole.sharp_edges <= pairs);
    CHECK(whole.fallback_edges <= pairs);
    CHECK(whole.max_normal_deg >= 0 && whole.max_normal_deg <= 180);
    if (f->tame)
        CHECK(whole.cracks == 0 && whole.nonfinite == 0);
    if (f->finite)                      /* beyond the range of reals a pair may be two NaN */
        CHECK(whole.cracks <= whole.nonfinite);
}

/* Patches of all facets, in the order of kinds and faces, inside the memory they were given. */
static void check_patches(const surface *f)
{
    const psurf_patches *p = f->patches;
    uint32_t count = 0;
    for (uint32_t k = 0; k < PSURF_KIND_COUNT; k++)
        count += p->layout.kind[k].count;
    CHECK(count == f->info.facets);
    for (uint32_t i = 0; i <= f->info.facets; i++) {
        const psurf_patch patch = psurf_get_patch(p, i);
        const psurf_kind_block *block = &p->layout.kind[patch.kind];
        const size_t at = patch.points ? (size_t)((const char *)patch.points -
                                                  (const char *)p->patches) : 0;
        CHECK((patch.point_count == 0) == (i == f->info.facets));
        if (!patch.point_count)
            continue;
        CHECK(patch.kind < PSURF_KIND_COUNT && patch.point_count == block->points);
        CHECK(at >= block->offset && patch.face < f->info.faces);
        CHECK(at - block->offset < (size_t)block->count * block->points * 3 * sizeof(psurf_real));
    }
}

/* Patches made in ranges, last ones first: the same as all at once. */
static void check_construction(const surface *f)
{
    const psurf_patches_layout *l = &f->patches->layout;
    psurf_patches again;
    void *memory = get(l->patch_bytes), *scratch = get(l->scratch_bytes);
    uint32_t seed = f->o->seed;
    memset(memory, 0x5A, l->patch_bytes);
    memset(scratch, 0x5A, l->scratch_bytes);
    CHECK(psurf_patches_bind(&again, f->patches->topology, f->o->scheme, memory, scratch) ==
          PSURF_OK);
    for (uint32_t pass = 0; pass < PSURF_PASS_COUNT; pass++) {
        const uint32_t cut = next_below(&seed, l->pass_items[pass] + 1);
        CHECK(psurf_construct_pass(&again, f->desc, (psurf_pass)pass, cut, PSURF_NONE) == PSURF_OK);
        CHECK(psurf_construct_pass(&again, f->desc, (psurf_pass)pass, 0, cut) == PSURF_OK);
    }
    for (uint32_t k = 0; k < PSURF_KIND_COUNT; k++) {
        const psurf_kind_block *block = &l->kind[k];
        const char *a = (const char *)f->patches->patches, *b = (const char *)memory;
        CHECK(is_same((const psurf_real *)(const void *)(a + block->offset),
                      (const psurf_real *)(const void *)(b + block->offset),
                      3 * (size_t)block->count * block->points));
    }
    free(memory);
    free(scratch);
}

/* Which schemes a topology is good for. */
static void check_sizes(const psurf_topology *topology, const options *o)
{
    psurf_patches_layout layout;
    for (uint32_t k = 0; k <= PSURF_SCHEME_COUNT; k++) {
        const psurf_scheme scheme = (psurf_scheme)k;
        const int fits = psurf_scheme_split(scheme) == o->split &&
                         (scheme == PSURF_MIXED) == o->has_schemes;
        CHECK(psurf_patches_size(topology, scheme, &layout) ==
              (k == PSURF_SCHEME_COUNT ? PSURF_BAD_DESC : fits ? PSURF_OK : PSURF_BAD_SPLIT));
    }
}

static int is_good(const options *o)
{
    return !o->canary && o->normal_mode < PSURF_NORMALS_COUNT && o->variant < PSURF_N_COUNT &&
           o->shading < PSURF_SHADE_COUNT && o->flags < 32 &&
           (!(o->flags & PSURF_SIGMA) || isfinite((double)o->sigma));
}

static psurf_real *copy_positions(const mesh *m, uint32_t stride)
{
    psurf_real *to = (psurf_real *)get((size_t)m->vertex_count * stride * sizeof *to);
    memset(to, 0, (size_t)m->vertex_count * stride * sizeof *to);
    for (uint32_t i = 0; i < m->vertex_count; i++)
        memcpy(to + i * stride, m->positions[i], sizeof m->positions[i]);
    return to;
}

static psurf_real *make_blends(const psurf_info *info, source *s)
{
    psurf_real *blends = NULL;
    if (!(take(s) & 1))
        return NULL;
    blends = (psurf_real *)get(info->spokes * sizeof *blends);
    for (uint32_t i = 0; i < info->spokes; i++)
        blends[i] = (psurf_real)take(s) / 255;
    return blends;
}

static void check_points(surface *f, uint32_t rate, source *s)
{
    check_patches(f);
    check_construction(f);
    check_eval(f, s);
    check_bounds(f);
    check_tessellation(f, rate, take_below(s, 4));
    check_edges_meet(f, rate);
}

static void check_surface(const mesh *m, const options *o, const psurf_topology *topology,
                          source *s)
{
    psurf_patches_layout layout;
    psurf_patches patches;
    psurf_construct_desc desc;
    surface f;
    psurf_real *blends, *normals, *positions;
    void *memory, *scratch;
    uint32_t rate = 1 + take_below(s, 4), normal_count;

    check_sizes(topology, o);
    if (psurf_patches_size(topology, o->scheme, &layout) != PSURF_OK)
        return;
    memset(&f, 0, sizeof f);
    f.m = m;
    f.o = o;
    f.patches = &patches;
    f.desc = &desc;
    psurf_topology_info(topology, &f.info);
    memory = get(layout.patch_bytes);
    scratch = get(layout.scratch_bytes);
    positions = copy_positions(m, o->stride[0]);
    normals = make_given_normals(o, m, s, &normal_count);
    blends = make_blends(&f.info, s);
    f.tame = is_tame(m->positions[0], (size_t)m->vertex_count * 3) &&
             (!normals || is_tame(normals, (size_t)normal_count * o->stride[1])) &&
             (!(o->flags & PSURF_SIGMA) || fabs((double)o->sigma) < 1000);
    f.finite = is_finite(m->positions[0], (size_t)m->vertex_count * 3) &&
               (!normals || is_finite(normals, (size_t)normal_count * o->stride[1]));
    memset(&desc, 0, sizeof desc);
    desc._end_canary = o->canary;
    desc.positions = positions;
    desc.position_stride = o->stride[0] == 3 ? 0 : o->stride[0] * sizeof(psurf_real);
    desc.blends = blends;
    desc.normals = normals;
    desc.normal_stride = o->stride[1] == 3 ? 0 : o->stride[1] * sizeof(psurf_real);
    desc.normal_mode = o->normal_mode;
    desc.variant = o->variant;
    desc.shading = o->shading;
    desc.flags = o->flags;
    desc.sigma = o->sigma;
    CHECK(psurf_patches_bind(&patches, topology, o->scheme, memory, NULL) == PSURF_OK);
    CHECK(layout.scratch_bytes == 0 || psurf_construct(&patches, &desc) == PSURF_BAD_DESC);
    CHECK(psurf_patches_bind(&patches, topology, o->scheme, memory, scratch) == PSURF_OK);
    if (is_good(o)) {
        CHECK(psurf_construct(&patches, &desc) == PSURF_OK);
        check_points(&f, rate, s);
    } else {
        CHECK(psurf_construct(&patches, &desc) == PSURF_BAD_DESC);
    }
    free(blends);
    free(normals);
    free(positions);
    free(memory);
    free(scratch);
}

/* ---- one input ------------------------------------------------------------------------------- */

/* Schemes with the same boundary curves have the same number; those without any have 0. */
static uint32_t curves_of(unsigned char scheme)
{
    switch ((int)scheme) {
    case PSURF_PN: case PSURF_SMOOTHED_N: case PSURF_CUBIC_PN_B1: case PSURF_CUBIC_PN_B2: return 1;
    case PSURF_CUBIC_WM_B1: case PSURF_CUBIC_WM_B2: return 2;
    case PSURF_HYBRID: return 3;
    case PSURF_PNG1: return 4;
    default: return 0;
    }
}

/* Whether the first faces have schemes that go together. */
static int are_mixable(const options *o, uint32_t faces)
{
    for (uint32_t f = 0; f < faces; f++)
        if (!curves_of(o->face_schemes[f]) ||
            curves_of(o->face_schemes[f]) != curves_of(o->face_schemes[0]))
            return 0;
    return 1;
}

/* What a topology that was made must not have been given. */
static void check_accepted(const mesh *m, const options *o)
{
    CHECK(o->split < PSURF_SPLIT_COUNT);
    CHECK(!o->has_schemes || (o->split == PSURF_SPLIT_TRIANGLES && are_mixable(o, m->face_count)));
    for (uint32_t c = 0; o->has_normals && c < m->corner_count; c++)
        CHECK(o->face_normals[c] < o->normal_count);
}

static void check_refusal(const mesh *m, const options *o, psurf_result result,
                          const psurf_error *error, const psurf_topology *topology, const heap *h)
{
    uint32_t corner = error->corner;
    CHECK(!topology && !h->held && !h->blocks);
    CHECK(result < PSURF_RESULT_COUNT && error->result == result && error->message);
    CHECK(error->face == PSURF_NONE || error->face < m->face_count);
    CHECK(error->corner == PSURF_NONE ||
          (error->face != PSURF_NONE && error->corner < m->sizes[error->face]));
    CHECK(result != PSURF_OUT_OF_MEMORY || h->fail_at);
    if (result == PSURF_BAD_NORMAL) {
        CHECK(error->face < m->face_count && corner < m->sizes[error->face]);
        for (uint32_t f = 0; f < error->face; f++)
            corner += m->sizes[f];
        CHECK(o->has_normals && o->face_normals[corner] >= o->normal_count);
        CHECK(m->corners[corner] == error->vertex);
    }
    if (result == PSURF_BAD_SCHEME)
        CHECK(o->has_schemes && error->face < m->face_count && !are_mixable(o, error->face + 1));
}

static void check_smooth(psurf_mesh_desc *desc, const mesh *m, uint32_t rate)
{
    psurf_smooth_mesh smooth;
    desc->positions = m->positions[0];
    if (psurf_smooth(desc, rate, &smooth, NULL) != PSURF_OK) {
        CHECK(!smooth.vertex_count && !smooth.positions && !smooth.indices);
    } else {
        for (size_t i = 0; i < smooth.index_count; i++)
            CHECK(smooth.indices[i] < smooth.vertex_count);
    }
    psurf_smooth_free(&smooth);
}

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size)
{
    static mesh m;
    static options o;
    source s, record;
    heap h;
    psurf_mesh_desc desc;
    psurf_error error;
    psurf_topology *topology = NULL;
    psurf_result result;

    s.data = data;
    s.size = size;
    record.data = NULL;
    record.size = 0;
    if (size > RECORD && data[size - 1] == MARK) {
        s.size = size - RECORD - 1;
        record.data = data + s.size;
        record.size = RECORD;
    }
    make_mesh(&m, &s);
    make_options(&o, &m, &record);
    memset(&h, 0, sizeof h);
    h.fail_at = take_below(&s, 8) ? 0 : take_below(&s, 6);
    memset(&desc, 0, sizeof desc);
    desc.vertex_count = m.vertex_count;
    desc.face_count = m.face_count;
    desc.face_sizes = m.sizes;
    desc.face_vertices = m.corners;
    desc.edges = m.tag_count ? m.tags : NULL;
    desc.edge_count = m.tag_count;
    desc.corners = m.flagged_count ? m.flagged : NULL;
    desc.corner_count = m.flagged_count;
    desc.positions = take(&s) & 1 ? m.positions[0] : NULL;
    desc.allocator.alloc = heap_alloc;
    desc.allocator.release = heap_release;
    desc.allocator.ctx = &h;
    desc._end_canary = take(&s) == 255;
    if (take_below(&s, 4) == 3) {
        desc.flags = PSURF_DEFAULT_BLEND;
        desc.default_blend = (psurf_real)take(&s) / 240;
    }
    if (take_below(&s, 3) == 1)
        desc.flags |= PSURF_CUT_BAD_EDGES;
    desc.face_normals = o.has_normals ? o.face_normals : NULL;
    desc.normal_count = o.normal_count;
    desc.split = o.split;
    desc.face_schemes = o.has_schemes ? o.face_schemes : NULL;

    result = psurf_topology_create(&desc, &topology, &error);
    if (result == PSURF_OK) {
        check_accepted(&m, &o);
        check_topology(&m, &o, topology, &h);
        check_surface(&m, &o, topology, &s);
        psurf_topology_destroy(topology);
    } else {
        check_refusal(&m, &o, result, &error, topology, &h);
    }
    h.calls = 0;
    check_smooth(&desc, &m, 1 + take_below(&s, 3));
    CHECK(!h.held && !h.blocks);
    return 0;
}
