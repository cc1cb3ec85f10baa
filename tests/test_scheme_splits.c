/* Faces that point-normal schemes split: kinds, order and place of the pieces, tessellations of
   them, and what the topology refuses. By the rule in the header, not by the library's tables. */
#include "schemes.h"

/* ---- meshes ---------------------------------------------------------------------------------- */

/* Closed, without marks: faces of 3 to 9 corners, each beginning at a corner of its own. */
static mesh make_closed(void)
{
    uint64_t rng = 2;
    mesh m = make_creature();
    uint32_t n, f, k;
    for (n = 5; n <= 9; n++) mesh_take(&m, make_cylinder(n, 1), 4.0 * n - 8);
    mesh_take(&m, make_dodecahedron(), 40);
    mesh_jitter(&m, &rng, 0.0625);
    for (f = 0; f < m.face_count; f++) {
        const mesh_face_data old = m.faces[f];
        for (k = 0; k < old.size; k++) m.faces[f].v[k] = old.v[(k + f) % old.size];
    }
    return m;
}

/* The same with holes, hard edges, and other meshes that have them. */
static mesh make_open(void)
{
    uint64_t rng = 4;
    mesh m = with_holes(with_hard(make_closed(), &rng, 15), &rng, 4);
    mesh_take(&m, with_hard(make_holed_grid(), &rng, 20), 60);
    mesh_take(&m, make_polygon(9), 70);
    return m;
}

static const int split_styles[] = {PN, WM};

/* ---- pieces ---------------------------------------------------------------------------------- */

/* The positions of a patch's corners: of a Bezier triangle or a square net. */
static vec patch_corner(const psurf_patch *patch, uint32_t corner)
{
    static const uint32_t of_ten[3] = {0, 3, 9}, of_nine[3] = {0, 3, 8}, of_sixteen[4] = {0, 3, 15,
                                                                                        12};
    const uint32_t at = patch->kind == PSURF_PN_QUAD ? of_sixteen[corner]
                      : patch->kind == PSURF_PN_TRI || patch->kind == PSURF_NPATCH
                          ? of_ten[corner]
                      : patch->kind == PSURF_HYBRID_TRI ? corner : of_nine[corner];
    return load(patch->points + 3 * at);
}

/* Every piece has its patch: its kind, its corners in order, the first one at the apex. */
static void expect_pieces(const mesh *m, const style *y)
{
    scene c = make_scene(mesh_copy(m));
    const psurf_kind triangle = y->scheme == PSURF_PN ? PSURF_PN_TRI
                              : y->scheme == PSURF_SMOOTHED_N ? PSURF_NPATCH
                              : y->scheme == PSURF_HYBRID ? PSURF_HYBRID_TRI
                              : y->scheme == PSURF_PNG1 ? PSURF_PNG1_TRI
                              : y->scheme == PSURF_CUBIC_WM_B2 || y->scheme == PSURF_CUBIC_PN_B2
                                  ? PSURF_RIBBON_B2 : PSURF_RIBBON;
    uint32_t f, piece, k, facets = 0, split = 0, kinds[PSURF_KIND_COUNT] = {0};
    surface s;
    scene_build(&s, &c, y, PSURF_NORMALS_AVERAGE);
    for (f = 0; f < m->face_count; f++) {
        const uint32_t pieces = pieces_of(s.desc.split, m->faces[f].size);
        split += pieces > 1;
        for (piece = 0; piece < pieces; piece++) {
            uint32_t corners[4];
            const uint32_t count = piece_corners(s.desc.split, &m->faces[f], piece, corners);
            const psurf_patch patch = find_patch(&s, f, piece);
            assert_int_equal(patch.kind, count == 4 ? PSURF_PN_QUAD : triangle);
            for (k = 0; k < count; k++) {
                const vec p = load(s.positions + 3 * m->faces[f].v[corners[k]]);
                REQUIRE(distance(patch_corner(&patch, k), p) == 0, "%s: face %u piece %u\n",
                        y->name, (unsigned)f, (unsigned)piece);
            }
            kinds[patch.kind]++;
            facets++;
        }
    }
    assert_int_equal(s.info.facets, facets);
    assert_int_equal(s.info.ngon_faces, split);
    assert_int_equal(s.info.inner_edges, facets - m->face_count);
    assert_int_equal(s.info.centres, 0);
    assert_true(kinds[triangle] > 30);
    if (s.desc.split == PSURF_SPLIT_PN) assert_true(kinds[PSURF_PN_QUAD] > 30);
    surface_free(&s);
    scene_free(&c);
}

static void test_pieces(void **state)
{
    mesh m = make_closed(), open = make_open();
    uint32_t i;
    (void)state;
    for (i = 0; i < STYLES; i++) {
        expect_pieces(&m, &styles[i]);
        expect_pieces(&open, &styles[i]);
    }
    mesh_free(&m);
    mesh_free(&open);
}

static void test_scheme_splits(void **state)
{
    uint32_t i;
    (void)state;
    assert_int_equal(psurf_scheme_split(PSURF_PM), PSURF_SPLIT_PM);
    assert_int_equal(psurf_scheme_split(PSURF_PN), PSURF_SPLIT_PN);
    for (i = PSURF_SMOOTHED_N; i < PSURF_SCHEME_COUNT; i++)
        assert_int_equal(psurf_scheme_split((psurf_scheme)i), PSURF_SPLIT_TRIANGLES);
    assert_int_equal(psurf_scheme_split((psurf_scheme)99), PSURF_SPLIT_PM);
}

/* The parameters of a place where the face's corners are numbered from another one on. */
static psurf_sample turned_sample(uint32_t size, psurf_sample at, uint32_t turn)
{
    const double u = (double)at.u, v = (double)at.v, w[3] = {1 - u - v, u, v};
    if (size >= 5 || turn == 0) return at;              /* pieces begin at the same vertex */
    if (size == 3) return make_sample(at.face, 0, w[(1 + turn) % 3], w[(2 + turn) % 3]);
    return turn == 1 ? make_sample(at.face, 0, v, 1 - u)
         : turn == 2 ? make_sample(at.face, 0, 1 - u, 1 - v) : make_sample(at.face, 0, 1 - v, u);
}

/* Whichever corner a face begins with, the surface is the same to rounding. */
static void test_turned_faces(void **state)
{
    mesh m = make_open();
    uint32_t i, turn, f, k;
    (void)state;
    for (i = 0; i < STYLES; i++)
        for (turn = 1; turn < 4; turn++) {
            scene c = make_scene(mesh_copy(&m)), d = make_scene(mesh_copy(&m));
            surface s, t;
            uint64_t rng = 6 + turn;
            double worst_p = 0, worst_n = 0;
            for (f = 0; f < m.face_count; f++)
                for (k = 0; k < m.faces[f].size; k++)
                    d.m.faces[f].v[k] = m.faces[f].v[(k + turn) % m.faces[f].size];
            scene_build(&s, &c, &styles[i], PSURF_NORMALS_AVERAGE);
            scene_build(&t, &d, &styles[i], PSURF_NORMALS_AVERAGE);
            for (k = 0; k < 400; k++) {
                const psurf_sample at = random_sample(&m, &rng);
                const uint32_t size = m.faces[at.face].size;
                const psurf_sample there = turned_sample(size, at, turn % size);
                const point p = eval_at(&s.patches, at), q = eval_at(&t.patches, there);
                const double sine = length(cross(p.du, p.dv)) / (length(p.du) * length(p.dv));
                worst_p = fmax(worst_p, distance(p.p, q.p));
                if (sine > 1e-2) worst_n = fmax(worst_n, angle_between(p.n, q.n));
            }
            REQUIRE(worst_p < (IS_DOUBLE ? 1e-12 : 1e-4) && worst_n < (IS_DOUBLE ? 1e-9 : 1e-2),
                    "%s, turned by %u: %g %g\n", styles[i].name, (unsigned)turn, worst_p, worst_n);
            surface_free(&s);
            surface_free(&t);
            scene_free(&c);
            scene_free(&d);
        }
    mesh_free(&m);
}

/* ---- tessellations of pieces ----------------------------------------------------------------- */

/* Vertices and triangles of a face, its own: every inner edge has rate - 1, besides its ends. */
static uint32_t face_vertices(psurf_split split, const mesh_face_data *f, uint32_t rate)
{
    const uint32_t pieces = pieces_of(split, f->size);
    uint32_t piece, corners[4], n = f->size * rate + (pieces - 1) * (rate - 1);
    for (piece = 0; piece < pieces; piece++)
        n += piece_corners(split, f, piece, corners) == 4 ? (rate - 1) * (rate - 1)
                                                          : (rate - 1) * (rate - 2) / 2;
    return n;
}

static uint32_t face_triangles(psurf_split split, const mesh_face_data *f, uint32_t rate)
{
    uint32_t piece, corners[4], n = 0;
    for (piece = 0; piece < pieces_of(split, f->size); piece++)
        n += (piece_corners(split, f, piece, corners) == 4 ? 2 : 1) * rate * rate;
    return n;
}

typedef struct net {
    psurf_tess_desc desc;
    psurf_tess_span span;
    psurf_real *p, *n, *shade;
    psurf_sample *where;
    uint32_t *indices;
    unsigned char *written;             /* how often a range wrote the vertex */
} net;

static void net_free(net *t)
{
    free(t->p);
    free(t->n);
    free(t->shade);
    free(t->where);
    free(t->indices);
    free(t->written);
}

/* The whole mesh, in ranges of step faces. What no range writes stays as it is filled: NaN. */
static net make_net(const surface *s, uint32_t rate, uint32_t flags, uint32_t step)
{
    net t;
    psurf_tess_out out;
    uint32_t f, i;
    psurf_real *before;
    memset(&t, 0, sizeof t);
    memset(&out, 0, sizeof out);
    t.desc.rate = rate;
    t.desc.flags = flags;
    assert_int_equal(psurf_tessellate_size(s->topology, &t.desc, 0, PSURF_NONE, &t.span), PSURF_OK);
    out.p = t.p = (psurf_real *)grab((size_t)t.span.vertex_count * 3, sizeof *t.p);
    out.n = t.n = (psurf_real *)grab((size_t)t.span.vertex_count * 3, sizeof *t.n);
    out.shade = t.shade = (psurf_real *)grab((size_t)t.span.vertex_count * 3, sizeof *t.shade);
    out.where = t.where = (psurf_sample *)grab(t.span.vertex_count, sizeof *t.where);
    out.indices = t.indices = (uint32_t *)grab(t.span.index_count, sizeof *t.indices);
    t.written = (unsigned char *)grab(t.span.vertex_count, 1);
    before = (psurf_real *)grab((size_t)t.span.vertex_count * 3, sizeof *before);
    for (f = 0; f < s->info.faces; f += step < s->info.faces - f ? step : s->info.faces - f) {
        memset(before, 0xFF, (size_t)t.span.vertex_count * 3 * sizeof *before);
        out.p = before;
        assert_int_equal(psurf_tessellate(&s->patches, &t.desc, f, step, &out), PSURF_OK);
        for (i = 0; i < t.span.vertex_count; i++)
            if (!isnan(before[3 * i])) {
                memcpy(t.p + 3 * i, before + 3 * i, 3 * sizeof *before);
                t.written[i]++;
            }
    }
    free(before);
    return t;
}

typedef struct directed { uint32_t from, to; } directed;

static int compare_directed(const void *pa, const void *pb)
{
    const directed *a = (const directed *)pa, *b = (const directed *)pb;
    if (a->from != b->from) return a->from < b->from ? -1 : 1;
    return a->to < b->to ? -1 : a->to > b->to;
}

/* Counts the undirected edges of a net; every directed one is there once, and all but open of them
   have their reverse. */
static uint32_t count_edges(const net *t, uint32_t open)
{
    const uint32_t count = (uint32_t)t->span.index_count;
    directed *edges = (directed *)grab(count, sizeof *edges);
    uint32_t i, alone = 0;
    for (i = 0; i < count; i++) {
        edges[i].from = t->indices[i];
        edges[i].to = t->indices[i % 3 == 2 ? i - 2 : i + 1];
        assert_true(edges[i].from < t->span.vertex_count && edges[i].from != edges[i].to);
    }
    qsort(edges, count, sizeof *edges, compare_directed);
    for (i = 0; i < count; i++) {
        directed back;
        back.from = edges[i].to, back.to = edges[i].from;
        assert_true(i == 0 || compare_directed(&edges[i - 1], &edges[i]) != 0);
        alone += !bsearch(&back, edges, count, sizeof *edges, compare_directed);
    }
    free(edges);
    assert_int_equal(alone, open);
    return (count + open) / 2;
}

/* Numbers of vertices and triangles, every vertex written once and in use, a manifold of the
   Euler characteristic of the faces, whichever ranges write it. */
static void expect_net(const mesh *m, const surface *s, uint32_t rate, uint32_t step)
{
    net t = make_net(s, rate, 0, step);
    const psurf_split split = s->desc.split;
    uint32_t inside = 0, triangles = 0, edges, f, i;
    unsigned char *used = (unsigned char *)grab(t.span.vertex_count, 1);
    for (f = 0; f < m->face_count; f++) {
        inside += face_vertices(split, &m->faces[f], rate) - m->faces[f].size * rate;
        triangles += face_triangles(split, &m->faces[f], rate);
    }
    assert_int_equal(t.span.vertex_count,
                     s->info.rings + s->info.edge_sides * (rate - 1) + inside);
    assert_int_equal(t.span.index_count, 3 * triangles);
    assert_int_equal(s->info.edge_sides, s->info.edges + s->info.hard_edges);
    edges = count_edges(&t, rate * (s->info.boundary_edges + 2 * s->info.hard_edges));
    assert_int_equal((int)(t.span.vertex_count + triangles) - (int)edges,
                     (int)(s->info.rings + s->info.faces) - (int)s->info.edge_sides);
    for (i = 0; i < t.span.index_count; i++) used[t.indices[i]] = 1;
    for (i = 0; i < t.span.vertex_count; i++) {
        REQUIRE(t.written[i] == 1, "vertex %u written %u times\n", (unsigned)i,
                (unsigned)t.written[i]);
        assert_true(used[i]);
        assert_true(is_finite_vec(load(t.p + 3 * i)) && is_finite_vec(load(t.n + 3 * i)));
    }
    free(used);
    net_free(&t);
}

static void test_nets(void **state)
{
    uint32_t i, k, rate;
    (void)state;
    for (k = 0; k < 2; k++) {
        scene c = make_scene(k ? make_open() : make_closed());
        for (i = 0; i < COUNT_OF(split_styles); i++) {
            surface s;
            scene_build(&s, &c, &styles[split_styles[i]], PSURF_NORMALS_AVERAGE);
            if (!k) assert_int_equal(s.info.boundary_edges, 0);
            /* at rate 1 the two sides of a hard edge may have both ends in common */
            for (rate = 1 + k; rate <= 8; rate++)
                expect_net(&c.m, &s, rate, rate % 3 ? PSURF_NONE : rate);
            surface_free(&s);
        }
        scene_free(&c);
    }
}

/* Where a per-face vertex lies on the face, in weights of its corners, from its parameters. */
static void face_weights(psurf_split split, const mesh_face_data *f, psurf_sample at,
                         double weights[MESH_MAX_CORNERS])
{
    const double u = (double)at.u, v = (double)at.v;
    const double of_three[3] = {1 - u - v, u, v};
    const double of_four[4] = {(1 - u) * (1 - v), u * (1 - v), u * v, (1 - u) * v};
    uint32_t c[4], count, k;
    memset(weights, 0, MESH_MAX_CORNERS * sizeof *weights);
    if (f->size == 4) {
        for (k = 0; k < 4; k++) weights[k] = of_four[k];
        return;
    }
    count = piece_corners(split, f, f->size < 5 ? 0 : at.sector, c);
    for (k = 0; k < count; k++) weights[c[k]] = count == 4 ? of_four[k] : of_three[k];
}

/* In a plane: a face and the surface of every scheme are the polygon, so the triangles of a face
   must all turn the same way and have its area between them, whatever its pieces are. */
static void test_areas(void **state)
{
    uint32_t n, i, rate, k, turn;
    (void)state;
    for (n = 3; n <= 9; n++)
        for (turn = 0; turn < n; turn++)
            for (i = 0; i < COUNT_OF(split_styles); i++) {
                scene c = make_scene(make_polygon(n));
                const mesh_face_data old = c.m.faces[0];
                vec whole = make_vec(0, 0, 0);
                surface s;
                for (k = 0; k < n; k++) c.m.faces[0].v[k] = old.v[(k + turn) % n];
                for (k = 0; k < n; k++)
                    whole = add(whole, mul(0.5, cross(c.m.positions[k],
                                                      c.m.positions[(k + 1) % n])));
                scene_build(&s, &c, &styles[split_styles[i]], PSURF_NORMALS_AVERAGE);
                for (rate = 1; rate <= 7; rate += 2) {
                    net t = make_net(&s, rate, PSURF_TESS_PER_FACE, PSURF_NONE);
                    double area = 0;
                    size_t j;
                    assert_int_equal(t.span.vertex_count,
                                     face_vertices(s.desc.split, &c.m.faces[0], rate));
                    for (j = 0; j < t.span.index_count; j += 3) {
                        const uint32_t *v = t.indices + j;
                        vec a = load(t.p + 3 * v[0]), b = load(t.p + 3 * v[1]);
                        double part = cross(sub(b, a), sub(load(t.p + 3 * v[2]), a)).z / 2;
                        REQUIRE(part > 0, "%u corners, rate %u: triangle %u of area %g\n",
                                (unsigned)n, (unsigned)rate, (unsigned)(j / 3), part);
                        area += part;
                    }
                    REQUIRE(fabs(area - whole.z) < (IS_DOUBLE ? 1e-13 : 1e-5), "%u corners: %g\n",
                            (unsigned)n, area - whole.z);
                    net_free(&t);
                }
                surface_free(&s);
                scene_free(&c);
            }
}

/* where: the parameters of every vertex, at which psurf_eval gives it; every place of the lattice
   of every piece once, the ends of inner edges shared; psurf_interpolate takes them too: of flat
   faces with straight edges, positions interpolated from the corners are exact at the corners. */
static void test_where(void **state)
{
    scene c = make_scene(make_open());
    uint32_t i, k, rate, f;
    (void)state;
    for (i = 0; i < COUNT_OF(split_styles); i++) {
        surface s;
        scene_build(&s, &c, &styles[split_styles[i]], PSURF_NORMALS_AVERAGE);
        for (rate = 1; rate <= 8; rate++) {
            net t = make_net(&s, rate, PSURF_TESS_PER_FACE, PSURF_NONE);
            uint32_t vertex = 0;
            for (f = 0; f < c.m.face_count; f++) {
                const mesh_face_data *face = &c.m.faces[f];
                const uint32_t count = face_vertices(s.desc.split, face, rate), first = vertex;
                double weights[64][MESH_MAX_CORNERS];
                for (k = 0; k < count; k++, vertex++) {
                    const psurf_sample at = t.where[vertex];
                    const point p = eval_at(&s.patches, at);
                    uint32_t other, corner;
                    assert_int_equal(at.face, f);
                    assert_true(at.sector < (face->size < 5 ? 1 : pieces_of(s.desc.split,
                                                                            face->size)));
                    assert_true(at.u >= 0 && at.v >= 0 && at.u <= 1 && at.v <= 1);
                    assert_true(distance(p.p, load(t.p + 3 * vertex))
                                < (IS_DOUBLE ? 1e-13 : 5e-5));
                    if (rate > 4) continue;             /* no two vertices of a face in one place */
                    assert_true(count <= 64 || rate > 2);
                    if (count > 64) continue;
                    face_weights(s.desc.split, face, at, weights[vertex - first]);
                    for (other = 0; other < vertex - first; other++) {
                        double apart = 0;
                        for (corner = 0; corner < face->size; corner++)
                            apart += fabs(weights[other][corner]
                                          - weights[vertex - first][corner]);
                        assert_true(apart > 0.1 / rate);
                    }
                }
            }
            assert_int_equal(vertex, t.span.vertex_count);
            net_free(&t);
        }
        surface_free(&s);
    }
    scene_free(&c);
}

/* Attributes of corners: linear on triangles, pieces too; bilinear on quads. Corners give their own
   values, the middles of a piece's edges the means of two. */
static void test_interpolate(void **state)
{
    scene c = make_scene(make_open());
    const uint32_t corners = corner_count(&c.m);
    float *values = (float *)grab(corners, sizeof *values);
    uint64_t rng = 12;
    uint32_t i, k, f, piece;
    (void)state;
    for (k = 0; k < corners; k++) values[k] = (float)random_below(&rng, 1024);
    for (i = 0; i < COUNT_OF(split_styles); i++) {
        surface s;
        uint32_t first = 0;
        scene_build(&s, &c, &styles[split_styles[i]], PSURF_NORMALS_AVERAGE);
        for (f = 0; f < c.m.face_count; first += c.m.faces[f].size, f++)
            for (piece = 0; piece < pieces_of(s.desc.split, c.m.faces[f].size); piece++) {
                uint32_t at[4];
                const uint32_t count = piece_corners(s.desc.split, &c.m.faces[f], piece, at);
                for (k = 0; k < count; k++) {
                    const uint32_t next = (k + 1) % count;
                    double u, v, x, y, expected = values[first + at[k]];
                    psurf_sample there;
                    float got = -1;
                    corner_place(count, k, &u, &v);
                    corner_place(count, next, &x, &y);
                    there = piece_sample(s.desc.split, &c.m, f, piece, u, v);
                    psurf_interpolate(s.topology, &there, 1, values, 1, &got, 0);
                    REQUIRE((double)got == expected, "face %u piece %u corner %u: %g, not %g\n",
                            (unsigned)f, (unsigned)piece, (unsigned)k, (double)got, expected);
                    /* the diagonal of a split quad: bilinear all the same */
                    if (c.m.faces[f].size == 4 && (at[k] + 2) % 4 == at[next]) continue;
                    there = piece_sample(s.desc.split, &c.m, f, piece, (u + x) / 2, (v + y) / 2);
                    psurf_interpolate(s.topology, &there, 1, values, 1, &got, 0);
                    expected = 0.5 * (values[first + at[k]] + values[first + at[next]]);
                    REQUIRE((double)got == expected, "face %u piece %u edge %u: %g, not %g\n",
                            (unsigned)f, (unsigned)piece, (unsigned)k, (double)got, expected);
                }
            }
        surface_free(&s);
    }
    free(values);
    scene_free(&c);
}

/* Boxes hold the points. */
static void test_bounds(void **state)
{
    scene c = make_scene(make_open());
    uint64_t rng = 13;
    uint32_t i, k, j;
    (void)state;
    scene_vertex_normals(&c, &rng, 0.3);
    scene_split_normals(&c, &rng, 5);
    for (i = 0; i < STYLES; i++) {
        surface s;
        psurf_real *boxes = (psurf_real *)grab((size_t)c.m.face_count * 6, sizeof *boxes);
        scene_build(&s, &c, &styles[i], PSURF_NORMALS_AVERAGE);
        psurf_bounds(&s.patches, 0, c.m.face_count, boxes);
        for (k = 0; k < 3000; k++) {
            psurf_sample at = random_sample(&c.m, &rng);
            psurf_real p[3], *box = boxes + 6 * (size_t)at.face;
            psurf_points out;
            memset(&out, 0, sizeof out);
            out.p = p;
            psurf_eval(&s.patches, &at, 1, &out);
            for (j = 0; j < 3; j++)
                REQUIRE(p[j] >= box[j] && p[j] <= box[3 + j], "%s, face %u: %g not in %g %g\n",
                        styles[i].name, (unsigned)at.face, (double)p[j], (double)box[j],
                        (double)box[3 + j]);
        }
        free(boxes);
        surface_free(&s);
    }
    scene_free(&c);
}

/* ---- what is refused, what is ignored -------------------------------------------------------- */

static psurf_result create(const surface *s, psurf_error *error)
{
    psurf_topology *topology;
    psurf_result result = psurf_topology_create(&s->desc, &topology, error);
    assert_int_equal(error->result, result);
    assert_true((result == PSURF_OK) == (topology != NULL));
    psurf_topology_destroy(topology);
    return result;
}

static void test_bad_normals(void **state)
{
    scene c = make_scene(make_closed());
    uint64_t rng = 14;
    uint32_t i, k, split;
    (void)state;
    scene_vertex_normals(&c, &rng, 0);
    scene_split_normals(&c, &rng, 10);
    for (split = 0; split < PSURF_SPLIT_COUNT; split++) {
        surface s;
        psurf_error error;
        scene_describe(&s, &c, &styles[PN], PSURF_NORMALS_AVERAGE);
        s.desc.split = (psurf_split)split;
        assert_int_equal(create(&s, &error), PSURF_OK);
        for (i = 0; i < 40; i++) {
            const uint32_t corner = random_below(&rng, corner_count(&c.m));
            const uint32_t face = random_below(&rng, c.m.face_count), old = c.corners[corner];
            uint32_t f = 0, first = 0;
            (void)face;
            while (first + c.m.faces[f].size <= corner) first += c.m.faces[f++].size;
            c.corners[corner] = i % 2 ? c.normal_count : 0xFFFFFFFFu;
            k = corner - first;
            assert_int_equal(create(&s, &error), PSURF_BAD_NORMAL);
            assert_int_equal(error.face, f);
            assert_int_equal(error.corner, k);
            assert_int_equal(error.vertex, c.m.faces[f].v[k]);
            assert_int_equal(error.other, PSURF_NONE);
            c.corners[corner] = old;
        }
        s.desc.normal_count = 0;
        assert_int_equal(create(&s, &error), PSURF_BAD_NORMAL);
        assert_int_equal(error.face + error.corner, 0);
        surface_free(&s);
    }
    scene_free(&c);
}

static void test_bad_splits(void **state)
{
    uint32_t split, scheme;
    (void)state;
    for (split = 0; split < PSURF_SPLIT_COUNT; split++) {
        mesh m = make_cube();
        surface s;
        psurf_error error;
        psurf_patches_layout layout;
        psurf_patches patches;
        char *memory;
        surface_describe(&s, &m);
        s.desc.split = (psurf_split)split;
        assert_int_equal(psurf_topology_create(&s.desc, &s.topology, &error), PSURF_OK);
        memory = (char *)grab(1u << 20, 1);
        for (scheme = 0; scheme < PSURF_SCHEME_COUNT; scheme++) {
            psurf_result expected =
                (uint32_t)psurf_scheme_split((psurf_scheme)scheme) == split ? PSURF_OK
                                                                            : PSURF_BAD_SPLIT;
            if (scheme == PSURF_MIXED) continue;        /* needs schemes of faces */
            assert_int_equal(psurf_patches_size(s.topology, (psurf_scheme)scheme, &layout),
                             expected);
            if (expected == PSURF_OK) assert_true(layout.patch_bytes < 1u << 19);
            assert_int_equal(psurf_patches_bind(&patches, s.topology, (psurf_scheme)scheme, memory,
                                                memory + (1u << 19)), expected);
        }
        assert_true(psurf_patches_size(s.topology, PSURF_MIXED, &layout) != PSURF_OK);
        assert_int_equal(psurf_patches_size(s.topology, PSURF_SCHEME_COUNT, &layout),
                         PSURF_BAD_DESC);
        free(memory);
        surface_free(&s);
        mesh_free(&m);
    }
}

/* Schemes with equal boundary curves. */
static int curves_of(uint32_t scheme)
{
    switch (scheme) {
    case PSURF_PN: case PSURF_SMOOTHED_N: case PSURF_CUBIC_PN_B1: case PSURF_CUBIC_PN_B2: return 1;
    case PSURF_CUBIC_WM_B1: case PSURF_CUBIC_WM_B2: return 2;
    case PSURF_HYBRID: return 3;
    case PSURF_PNG1: return 4;
    default: return 0;                                  /* pm, and what is no scheme */
    }
}

static void test_mixes(void **state)
{
    mesh m = make_closed();
    uint64_t rng = 15;
    unsigned char *schemes = (unsigned char *)grab(m.face_count, 1);
    uint32_t i, allowed = 0, refused = 0;
    surface s;
    (void)state;
    surface_describe(&s, &m);
    s.desc.split = PSURF_SPLIT_TRIANGLES;
    s.desc.face_schemes = schemes;
    for (i = 0; i < 400; i++) {
        const uint32_t base = random_below(&rng, PSURF_SCHEME_COUNT + 2);
        uint32_t f, k, bad = PSURF_NONE;
        psurf_error error;
        psurf_result expected;
        for (f = 0; f < m.face_count; f++) {
            do k = random_below(&rng, PSURF_SCHEME_COUNT);
            while (curves_of(k) != curves_of(base) || k == PSURF_MIXED);
            schemes[f] = (unsigned char)(curves_of(base) ? k : base);
        }
        if (i % 2) {                                    /* one or two others among them */
            schemes[random_below(&rng, m.face_count)] =
                (unsigned char)random_below(&rng, PSURF_SCHEME_COUNT + 2);
            schemes[random_below(&rng, m.face_count)] = (unsigned char)random_below(&rng, 256);
        }
        for (f = m.face_count; f-- > 0;)
            if (!curves_of(schemes[f]) || curves_of(schemes[f]) != curves_of(schemes[0])) bad = f;
        expected = bad == PSURF_NONE ? PSURF_OK : PSURF_BAD_SCHEME;
        assert_int_equal(create(&s, &error), expected);
        assert_int_equal(error.face, bad);
        if (bad == PSURF_NONE) allowed++;
        else refused++;
    }
    assert_true(allowed > 50 && refused > 100);
    surface_free(&s);
    free(schemes);
    mesh_free(&m);
}

/* pm takes no notice of normals: the same bits with face_normals and without. */
static void test_pm_ignores_normals(void **state)
{
    scene c = make_scene(make_open());
    uint64_t rng = 16;
    surface with, without;
    style pm = styles[PN];
    (void)state;
    pm.name = "pm", pm.scheme = PSURF_PM;
    scene_vertex_normals(&c, &rng, 0.2);
    scene_split_normals(&c, &rng, 30);
    scene_build(&with, &c, &pm, PSURF_NORMALS_LIMIT);
    surface_build(&without, &c.m);
    assert_int_equal(with.info.hard_edges, without.info.hard_edges);
    assert_int_equal(with.patches.layout.patch_bytes, without.patches.layout.patch_bytes);
    assert_memory_equal(with.memory, without.memory, with.patches.layout.patch_bytes);
    surface_free(&with);
    surface_free(&without);
    scene_free(&c);
}

/* Edges are hard where the sides name different normals at an end, or where they are said to be:
   counted by the mesh itself. Every ring has a normal. */
static void test_hard_by_normals(void **state)
{
    uint32_t i, k;
    (void)state;
    for (i = 0; i < COUNT_OF(split_styles); i++) {
        scene c = make_scene(make_open());
        uint64_t rng = 18;
        uint32_t hard = 0;
        edge_map map = map_edges(&c.m);
        surface s;
        scene_vertex_normals(&c, &rng, 0.1);
        scene_split_normals(&c, &rng, 20);
        for (k = 0; k < map.count; k++) {
            const half_edge *a = &map.edges[k], *b = find_edge(&map, a->to, a->from);
            hard += b && a->from < a->to
                    && (mesh_is_hard(&c.m, a->from, a->to) || sides_differ(&c, a, b));
        }
        scene_build(&s, &c, &styles[split_styles[i]], PSURF_NORMALS_AVERAGE);
        assert_int_equal(s.info.hard_edges, hard);
        assert_int_equal(s.tables.ring_normals.count, s.info.rings);
        free(map.edges);
        surface_free(&s);
        scene_free(&c);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_scheme_splits),      cmocka_unit_test(test_pieces),
        cmocka_unit_test(test_turned_faces),       cmocka_unit_test(test_nets),
        cmocka_unit_test(test_areas),              cmocka_unit_test(test_where),
        cmocka_unit_test(test_interpolate),        cmocka_unit_test(test_bounds),
        cmocka_unit_test(test_bad_normals),        cmocka_unit_test(test_bad_splits),
        cmocka_unit_test(test_mixes),              cmocka_unit_test(test_pm_ignores_normals),
        cmocka_unit_test(test_hard_by_normals)};
    return cmocka_run_group_tests_name("scheme splits", tests, NULL, NULL);
}
