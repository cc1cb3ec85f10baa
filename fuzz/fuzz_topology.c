/* Fuzzes everything from a mesh to its triangles: bytes become a small mesh, sound or not, and
   whatever the library accepts has to keep all its promises.

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

static void *get(size_t size)           /* exactly so much: the sanitizer sees one byte more */
{
    void *memory = malloc(size + !size);
    if (!memory)
        exit(2);
    return memory;
}

/* ---- what must be true of tables ------------------------------------------------------------- */

typedef struct tables {
    psurf_tables t;
    const psurf_ring *rings;
    const psurf_spoke *spokes;
    const psurf_corner *corners;
    const psurf_facet *facets;
    const psurf_edge *edges;
} tables;

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
    CHECK(open ? n >= (corner ? 2 : 3) : n >= 3 && !(ring->valence & PSURF_RING_WIDE) && !corner);
    CHECK(!corner || !(ring->valence & PSURF_RING_WIDE));
    CHECK(!wide || corner);
    CHECK(!open || !(ring->valence & PSURF_RING_POLAR));
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

/* One facet: its corners are the face's, or two of them and the centre, and every corner's spoke
   leads to the next corner and starts a facet of its ring. */
static void check_facet(const mesh *m, const tables *t, const psurf_facet *facet, uint32_t first,
                        uint32_t sides, const uint32_t *face_corners)
{
    const uint32_t size = m->sizes[facet->face], piece = facet->piece & 0xFFFF;
    const int split = (facet->piece & PSURF_SPLIT_FACE) != 0;
    CHECK(split ? sides == 3 && piece < size : sides == size && piece == 0);
    for (uint32_t i = 0; i < sides; i++) {
        const psurf_corner *corner = &t->corners[first + i];
        const psurf_corner *next = &t->corners[first + (i + 1) % sides];
        const uint32_t r = corner->ring & ~PSURF_WRITER;
        uint32_t point, open;
        CHECK(r < t->t.rings.count && (next->ring & ~PSURF_WRITER) < t->t.rings.count);
        point = t->rings[r].point;
        open = (t->rings[r].valence & PSURF_RING_OPEN) != 0;
        if (split && i == 2)
            CHECK(point >= m->vertex_count &&
                  ((const uint32_t *)t->t.centres.data)[point - m->vertex_count] == facet->face);
        else
            CHECK(point == face_corners[(piece + i) % size]);
        if (split && i > 0)
            CHECK(corner->edge == PSURF_INNER_EDGE);
        else
            CHECK((corner->edge & ~PSURF_WRITER) < t->t.edges.count);
        CHECK(corner->spoke >= t->rings[r].first_spoke &&
              corner->spoke - t->rings[r].first_spoke + open <
                  (t->rings[r].valence & PSURF_RING_VALENCE));
        CHECK(t->spokes[corner->spoke].end == t->rings[next->ring & ~PSURF_WRITER].point);
    }
}

static void check_facets(const mesh *m, const tables *t)
{
    static const uint32_t sides[PSURF_KIND_COUNT] = {4, 3, 3, 4, 5};
    uint32_t first_corner[MAX_FACES], corner = 0;
    for (uint32_t f = 0, first = 0; f < m->face_count; first += m->sizes[f++])
        first_corner[f] = first;
    CHECK(t->t.kind_first[0] == 0 && t->t.kind_first_corner[0] == 0);
    CHECK(t->t.face_facet.count == m->face_count);
    for (uint32_t kind = 0; kind < PSURF_KIND_COUNT; kind++) {
        uint32_t end = t->t.kind_first[kind + 1];
        CHECK(end >= t->t.kind_first[kind] && end <= t->t.facets.count);
        CHECK(corner == t->t.kind_first_corner[kind]);
        for (uint32_t k = t->t.kind_first[kind]; k < end; k++) {
            uint32_t face = t->facets[k].face;
            CHECK(face < m->face_count && corner + sides[kind] <= t->t.corners.count);
            CHECK(((const uint32_t *)t->t.face_facet.data)[face] ==
                  k - (t->facets[k].piece & 0xFFFF));
            check_facet(m, t, &t->facets[k], corner, sides[kind], m->corners + first_corner[face]);
            corner += sides[kind];
        }
    }
    CHECK(t->t.kind_first[PSURF_KIND_COUNT] == t->t.facets.count);
    CHECK(corner == t->t.corners.count);
}

/* The two sides of an edge run against each other. One facet writes an edge, of a hard one each its
   own side; one facet writes a ring, nobody a centre's. */
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
            CHECK(t->edges[back].other == edge->corner && t->edges[back].corner == edge->other);
        } else {
            CHECK(b->edge == e && e < info->edges);
        }
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
    CHECK(t->t.corners.count == 2 * info->edges - open + inner);
}

static void check_topology(const mesh *m, const psurf_topology *topology, const heap *h)
{
    psurf_info info;
    tables t;
    uint32_t faces = 0, facets = 0;
    psurf_topology_info(topology, &info);
    psurf_topology_tables(topology, &t.t);
    t.rings = (const psurf_ring *)t.t.rings.data;
    t.spokes = (const psurf_spoke *)t.t.spokes.data;
    t.corners = (const psurf_corner *)t.t.corners.data;
    t.facets = (const psurf_facet *)t.t.facets.data;
    t.edges = (const psurf_edge *)t.t.edges.data;
    for (uint32_t kind = 0; kind < PSURF_KIND_COUNT; kind++)
        faces += info.kind_faces[kind];
    CHECK(info.vertices == m->vertex_count && info.faces == m->face_count);
    CHECK(faces + info.ngon_faces == info.faces && info.ngon_faces == info.centres);
    CHECK(t.t.centres.count == info.centres && info.edge_sides == t.t.edges.count);
    for (uint32_t i = 0; i < info.centres; i++)
        facets += m->sizes[((const uint32_t *)t.t.centres.data)[i]];
    CHECK(info.facets == info.faces - info.centres + facets);
    CHECK(info.rings == t.t.rings.count && info.spokes == t.t.spokes.count);
    CHECK(info.facets == t.t.facets.count);
    CHECK(info.bytes == h->held && info.peak_bytes == h->peak);
    CHECK(t.t.version == PSURF_TABLE_VERSION);
    check_rings(m, &t, topology);
    check_facets(m, &t);
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

static void check_eval(const psurf_patches *patches, uint32_t faces, source *s, int tame)
{
    psurf_sample samples[MAX_SAMPLES];
    psurf_real out[7][MAX_SAMPLES][3], gauss[MAX_SAMPLES], mean[MAX_SAMPLES], box[6];
    uint32_t count = take_below(s, MAX_SAMPLES + 1);
    psurf_points points;
    memset(&points, 0, sizeof points);
    memset(samples, 0, sizeof samples);
    for (uint32_t i = 0; i < count; i++) {
        samples[i].face = take_below(s, 8) ? take_below(s, faces) : take_word(s);
        samples[i].sector = take_below(s, 8) ? take_below(s, 17) : take_word(s);
        samples[i].u = take_below(s, 2) ? take_real(s) : (psurf_real)take_below(s, 5) / 4;
        samples[i].v = take_below(s, 2) ? take_real(s) : (psurf_real)take_below(s, 5) / 4;
    }
    points.p = out[0][0];
    points.n = out[1][0];
    points.du = out[2][0];
    points.dv = out[3][0];
    points.duu = out[4][0];
    points.duv = out[5][0];
    points.dvv = out[6][0];
    psurf_eval(patches, samples, count, &points);
    psurf_curvature(patches, samples, count, gauss, mean);
    for (uint32_t i = 0; i < count && tame && faces; i++) {
        uint32_t face = samples[i].face < faces ? samples[i].face : faces - 1;
        for (int k = 0; k < 4; k++)     /* second derivatives grow without bound towards a pole */
            CHECK(is_finite(out[k][i], 3));
        psurf_bounds(patches, face, 1, box);
        for (int k = 0; k < 3; k++)
            CHECK(out[0][i][k] >= box[k] && out[0][i][k] <= box[3 + k]);
    }
}

/* Tessellates all faces, in one call and in two ranges: the same bytes, indices in range. */
static void check_tessellation(const mesh *m, const psurf_patches *patches, uint32_t rate,
                               uint32_t flags, int tame)
{
    psurf_tess_desc desc;
    psurf_tess_span span;
    psurf_tess_out out[2];
    uint32_t half = m->face_count / 2;
    size_t vertex_bytes, wide = flags & PSURF_TESS_INDEX16 ? 2 : 4;
    memset(&desc, 0, sizeof desc);
    desc.rate = rate;
    desc.flags = flags;
    CHECK(psurf_tessellate_size(patches->topology, &desc, 0, m->face_count, &span) == PSURF_OK);
    CHECK(span.first_vertex == 0 && span.first_index == 0);
    vertex_bytes = (size_t)span.vertex_count * 3 * sizeof(psurf_real);
    for (int i = 0; i < 2; i++) {
        memset(&out[i], 0, sizeof out[i]);
        out[i].p = (psurf_real *)get(vertex_bytes);
        out[i].n = (psurf_real *)get(vertex_bytes);
        out[i].where = (psurf_sample *)get(span.vertex_count * sizeof(psurf_sample));
        out[i].indices = get(span.index_count * wide);
    }
    CHECK(psurf_tessellate(patches, &desc, 0, m->face_count, &out[0]) == PSURF_OK);
    CHECK(psurf_tessellate(patches, &desc, half, m->face_count, &out[1]) == PSURF_OK);
    CHECK(psurf_tessellate(patches, &desc, 0, half, &out[1]) == PSURF_OK);
    CHECK(!memcmp(out[0].indices, out[1].indices, span.index_count * wide));
    CHECK(!memcmp(out[0].where, out[1].where, span.vertex_count * sizeof(psurf_sample)));
    if (tame) {                         /* NaN may have any payload */
        CHECK(!memcmp(out[0].p, out[1].p, vertex_bytes));
        CHECK(!memcmp(out[0].n, out[1].n, vertex_bytes));
        CHECK(is_finite(out[0].p, (size_t)span.vertex_count * 3));
        CHECK(is_finite(out[0].n, (size_t)span.vertex_count * 3));
    }
    for (size_t i = 0; i < span.index_count; i++)
        CHECK((wide == 2 ? ((const uint16_t *)out[0].indices)[i]
                         : ((const uint32_t *)out[0].indices)[i]) < span.vertex_count);
    for (int i = 0; i < 2; i++) {
        free(out[i].p);
        free(out[i].n);
        free(out[i].where);
        free(out[i].indices);
    }
}

static void check_edges_meet(const psurf_patches *patches, const psurf_construct_desc *desc,
                             uint32_t rate, const psurf_info *info, int tame)
{
    const uint32_t pairs = info->edges - info->boundary_edges;
    psurf_check_result result;
    CHECK(psurf_check(patches, desc, rate, 0, info->edges, &result) == PSURF_OK);
    CHECK(result.samples == (uint64_t)pairs * (rate + 1));
    CHECK(result.sharp_edges >= info->hard_edges && result.sharp_edges <= pairs);
    if (tame)
        CHECK(result.cracks == 0 && result.nonfinite == 0);
}

static void check_surface(const mesh *m, const psurf_topology *topology, source *s)
{
    psurf_patches_layout layout;
    psurf_patches patches;
    psurf_construct_desc desc;
    psurf_info info;
    psurf_real *blends = NULL;
    void *memory, *scratch;
    uint32_t rate = 1 + take_below(s, 4);
    int tame = is_tame(m->positions[0], (size_t)m->vertex_count * 3);

    psurf_topology_info(topology, &info);
    CHECK(psurf_patches_size(topology, PSURF_PM, &layout) == PSURF_OK);
    memory = get(layout.patch_bytes);
    scratch = get(layout.scratch_bytes);
    CHECK(psurf_patches_bind(&patches, topology, PSURF_PM, memory, scratch) == PSURF_OK);
    memset(&desc, 0, sizeof desc);
    desc.positions = m->positions[0];
    if (take(s) & 1) {
        blends = (psurf_real *)get(info.spokes * sizeof *blends);
        for (uint32_t i = 0; i < info.spokes; i++)
            blends[i] = (psurf_real)take(s) / 255;
        desc.blends = blends;
    }
    CHECK(psurf_construct(&patches, &desc) == PSURF_OK);
    check_eval(&patches, info.faces, s, tame);
    check_tessellation(m, &patches, rate, take_below(s, 4), tame);
    check_edges_meet(&patches, &desc, rate, &info, tame);
    free(blends);
    free(memory);
    free(scratch);
}

/* ---- one input ------------------------------------------------------------------------------- */

static void check_refusal(const mesh *m, psurf_result result, const psurf_error *error,
                          const psurf_topology *topology, const heap *h)
{
    CHECK(!topology && !h->held && !h->blocks);
    CHECK(result < PSURF_RESULT_COUNT && error->result == result && error->message);
    CHECK(error->face == PSURF_NONE || error->face < m->face_count);
    CHECK(error->corner == PSURF_NONE ||
          (error->face != PSURF_NONE && error->corner < m->sizes[error->face]));
    CHECK(result != PSURF_OUT_OF_MEMORY || h->fail_at);
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
    source s;
    heap h;
    psurf_mesh_desc desc;
    psurf_error error;
    psurf_topology *topology = NULL;
    psurf_result result;

    s.data = data;
    s.size = size;
    make_mesh(&m, &s);
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

    result = psurf_topology_create(&desc, &topology, &error);
    if (result == PSURF_OK) {
        check_topology(&m, topology, &h);
        check_surface(&m, topology, &s);
        psurf_topology_destroy(topology);
    } else {
        check_refusal(&m, result, &error, topology, &h);
    }
    h.calls = 0;
    check_smooth(&desc, &m, 1 + take_below(&s, 3));
    CHECK(!h.held && !h.blocks);
    return 0;
}
