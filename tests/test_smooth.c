/* Smoothness, measured: tangent planes across every kind of edge, derivatives inside Pm patches,
   and what the construction must reproduce whatever its formulas look like. */
#include "common.h"

/* ---- tangent planes across edges ------------------------------------------------------------- */

typedef struct joins {
    double worst;                                               /* radians */
    uint32_t pairs[PSURF_KIND_COUNT][PSURF_KIND_COUNT];     /* edges measured, lower kind first */
    uint32_t valences[13];                                      /* ends of edges measured */
} joins;

/* Angle between the normals that two faces give at a point they share. The cross product of the
   derivatives must agree with both, wherever it is far from vanishing. */
static double normal_jump(const psurf_patches *patches, psurf_sample a, psurf_sample b)
{
    point pa = eval_at(patches, a), pb = eval_at(patches, b);
    double jump = angle_between(pa.n, pb.n);
    vec product = cross(pa.du, pa.dv);
    double size = length(pa.du) * length(pa.dv);
    REQUIRE(fabs(length(pa.n) - 1) < 1e-6 && fabs(length(pb.n) - 1) < 1e-6, "not unit length\n");
    if (length(product) > 1e-2 * size) jump = fmax(jump, angle_between(product, pb.n));
    return jump;
}

static void measure_joins(joins *j, const mesh *m, uint64_t *rng, uint32_t samples)
{
    surface s;
    edge_map map = map_edges(m);
    psurf_kind *kind = classify_faces(m);
    uint32_t i, k;
    surface_build(&s, m);
    for (i = 0; i < map.count; i++) {
        const half_edge *a = &map.edges[i], *b = find_edge(&map, a->to, a->from);
        uint32_t ka = (uint32_t)kind[a->face], kb = (uint32_t)kind[b->face];
        if (a->from > a->to) continue;
        for (k = 0; k < samples + 2; k++) {
            double t = k < 2 ? (double)k : random_unit(rng);
            double jump = normal_jump(
                &s.patches, edge_sample(a->face, m->faces[a->face].size, a->corner, t),
                edge_sample(b->face, m->faces[b->face].size, b->corner, 1 - t));
            REQUIRE(!isnan(jump), "edge %u-%u\n", (unsigned)a->from, (unsigned)a->to);
            if (jump > j->worst) j->worst = jump;
        }
        j->pairs[ka < kb ? ka : kb][ka < kb ? kb : ka]++;
        if (valence_of(&map, a->from) <= 12) j->valences[valence_of(&map, a->from)]++;
        if (valence_of(&map, a->to) <= 12) j->valences[valence_of(&map, a->to)]++;
    }
    surface_free(&s);
    free(kind);
    free(map.edges);
}

/* Measures a mesh as it is, with random positions, and with random blend ratios; consumes it. */
static void measure_variants(joins *plain, joins *blended, mesh m, uint64_t *rng)
{
    measure_joins(plain, &m, rng, 4);
    mesh_jitter(&m, rng, 0.06);
    measure_joins(plain, &m, rng, 4);
    mesh_random_tags(&m, rng, 51);
    measure_joins(blended, &m, rng, 4);
    mesh_free(&m);
}

static void report_joins(const char *what, const joins *j)
{
    uint32_t a, b;
    print_message("%s: largest angle %.2g rad;", what, j->worst);
    for (a = 0; a < PM_KINDS; a++)
        for (b = a; b < PM_KINDS; b++)
            print_message(" %s|%s %u", psurf_kind_name((psurf_kind)a),
                          psurf_kind_name((psurf_kind)b), (unsigned)j->pairs[a][b]);
    print_message("\n");
}

static void test_all_joins(void **state)
{
    joins plain, blended;
    uint64_t rng = 1;
    uint32_t n, k, a, b;
    mesh m;
    (void)state;
    if (!IS_DOUBLE) skip();
    memset(&plain, 0, sizeof plain);
    memset(&blended, 0, sizeof blended);
    measure_variants(&plain, &blended, make_tetrahedron(), &rng);
    measure_variants(&plain, &blended, make_cube(), &rng);
    measure_variants(&plain, &blended, make_dodecahedron(), &rng);
    measure_variants(&plain, &blended, make_creature(), &rng);
    for (n = 3; n <= 12; n++) {
        measure_variants(&plain, &blended, make_latlong(n, 1), &rng);
        measure_variants(&plain, &blended, make_latlong(n, 3), &rng);
        measure_variants(&plain, &blended, make_triangle_ball(n), &rng);
        m = make_torus(n, 15 - n);
        mesh_split_quads(&m, &rng, 30);
        mesh_scramble(&m, &rng, 10);
        measure_variants(&plain, &blended, m, &rng);
    }
    for (n = 3; n <= 12; n++)
        measure_variants(&plain, &blended, make_capped_spindle(&rng, n), &rng);
    for (k = 0; k < 24; k++) {
        m = make_random_spindle(&rng, k % 3 == 0 ? 10 : k % 3 == 1 ? 50 : 85, 9);
        if (k & 1) mesh_scramble(&m, &rng, 6);
        measure_variants(&plain, &blended, m, &rng);
    }
    report_joins("default blends", &plain);
    report_joins("random blends", &blended);
    for (a = 0; a < PM_KINDS; a++)
        for (b = a; b < PM_KINDS; b++)
            REQUIRE(plain.pairs[a][b] >= 20 && blended.pairs[a][b] >= 10, "kinds %u and %u\n",
                    (unsigned)a, (unsigned)b);
    for (n = 3; n <= 12; n++)
        REQUIRE(plain.valences[n] >= 50, "valence %u: %u\n", (unsigned)n,
                (unsigned)plain.valences[n]);
    assert_true(plain.worst < 1e-10);
    assert_true(blended.worst < 1e-10);
}

/* ---- boundaries, hard edges, split faces ----------------------------------------------------- */

/* What was measured on meshes with marks. Sharp edges of a vertex: hard ones and boundaries. */
typedef struct marked {
    double worst, inside;                       /* across edges, across lines inside split faces */
    uint32_t edges, hard, boundary, lines, meshes;
    uint32_t darts[7], creases[7], corners[7], at_boundary;     /* by valence; hard at boundaries */
    uint32_t alone, wide, splits, split_sizes[MESH_MAX_CORNERS + 1], poles;
} marked;

/* Positions of the two sides have the same bits everywhere; normals are of unit length, and one
   where the edge is not hard. */
static void measure_edge(marked *r, const surface *s, const mesh *m, const half_edge *a,
                         const half_edge *b, uint64_t *rng, uint32_t samples)
{
    int hard = mesh_is_hard(m, a->from, a->to);
    uint32_t k;
    for (k = 0; k < samples + 2; k++) {
        double t = k < 2 ? (double)k : random_unit(rng), jump;
        psurf_sample sa = edge_sample(a->face, m->faces[a->face].size, a->corner, t);
        psurf_sample sb = edge_sample(b->face, m->faces[b->face].size, b->corner, 1 - t);
        point pa = eval_at(&s->patches, sa), pb = eval_at(&s->patches, sb);
        REQUIRE(!memcmp(&pa.p, &pb.p, sizeof pa.p), "crack in %u-%u\n", (unsigned)a->from,
                (unsigned)a->to);
        jump = normal_jump(&s->patches, sa, sb);
        REQUIRE(!isnan(jump), "edge %u-%u\n", (unsigned)a->from, (unsigned)a->to);
        if (!hard) r->worst = fmax(r->worst, jump);
    }
    r->edges += !hard;
    r->hard += (uint32_t)hard;
}

/* The line from corner i of a split face to its centre, seen from the pieces on both sides. */
static void measure_line(marked *r, const surface *s, uint32_t face, uint32_t size, uint32_t i,
                         double t)
{
    const double aside = size < 5 ? 1.0 / 17592186044416.0 : 0;         /* 2^-44: into the piece */
    psurf_sample before = sector_sample(face, size, (i + size - 1) % size, aside, t * (1 - aside));
    psurf_sample after = sector_sample(face, size, i, t * (1 - aside), aside);
    point pa = eval_at(&s->patches, before), pb = eval_at(&s->patches, after);
    double jump = angle_between(pa.n, pb.n);
    REQUIRE(fabs(length(pa.n) - 1) < 1e-6 && fabs(length(pb.n) - 1) < 1e-6, "face %u\n",
            (unsigned)face);
    if (aside > 0) assert_true(distance(pa.p, pb.p) < 1e-11);
    else assert_true(!memcmp(&pa.p, &pb.p, sizeof pa.p));
    r->inside = fmax(r->inside, jump);
    r->lines++;
}

/* Notes what a mesh has: marks by the mesh's own edges, the rest from the tables. */
static void count_marks(marked *r, const surface *s, const mesh *m, const edge_map *map)
{
    const psurf_ring *rings = (const psurf_ring *)s->tables.rings.data;
    uint32_t v, i;
    for (v = 0; v < m->vertex_count; v++) {
        uint32_t n = 0, hard = 0, open = 0;
        for (i = lower_edge(map, v, 0); i < lower_edge(map, v + 1, 0); i++, n++) {
            hard += (uint32_t)mesh_is_hard(m, v, map->edges[i].to);
            open |= find_edge(map, map->edges[i].to, v) == NULL;
        }
        if (open && hard) r->at_boundary++;
        if (open || n > 6) continue;
        if (hard == 1) r->darts[n]++;
        if (hard == 2) r->creases[n]++;
        if (hard > 2) r->corners[n]++;
    }
    for (i = 0; i < s->info.rings; i++) {
        uint32_t n = rings[i].valence & PSURF_RING_VALENCE;
        r->wide += (rings[i].valence & PSURF_RING_WIDE) != 0;
        r->alone += (rings[i].valence & PSURF_RING_CORNER) && n == 2;
        r->poles += (rings[i].valence & PSURF_RING_POLAR) != 0;
    }
    r->boundary += s->info.boundary_edges;
    r->meshes++;
}

static void measure_marked(marked *r, const mesh *m, uint64_t *rng)
{
    surface s;
    edge_map map = map_edges(m);
    uint32_t i, k;
    surface_build(&s, m);
    count_marks(r, &s, m, &map);
    for (i = 0; i < map.count; i++) {
        const half_edge *a = &map.edges[i], *b = find_edge(&map, a->to, a->from);
        if (b && a->from < a->to) measure_edge(r, &s, m, a, b, rng, 4);
    }
    for (i = 0; i < s.tables.centres.count; i++) {
        uint32_t face = ((const uint32_t *)s.tables.centres.data)[i], size = m->faces[face].size;
        r->splits++;
        r->split_sizes[size]++;
        for (k = 0; k < 5 * size; k++)
            measure_line(r, &s, face, size, k % size,
                         k < size ? 0 : k < 2 * size ? 1 : random_unit(rng));
    }
    surface_free(&s);
    free(map.edges);
}

static void report_marked(const char *what, const marked *r)
{
    uint32_t n;
    print_message("%s: %u meshes, %u smooth edges %.2g rad, %u hard, %u boundary; %u lines in %u "
                  "split faces %.2g rad; %u wide wedges, %u faces in corners, %u poles, %u hard "
                  "at boundaries; darts/creases/corners", what, (unsigned)r->meshes,
                  (unsigned)r->edges, r->worst, (unsigned)r->hard, (unsigned)r->boundary,
                  (unsigned)r->lines, (unsigned)r->splits, r->inside, (unsigned)r->wide,
                  (unsigned)r->alone, (unsigned)r->poles, (unsigned)r->at_boundary);
    for (n = 3; n <= 6; n++)
        print_message(" %u: %u/%u/%u", (unsigned)n, (unsigned)r->darts[n],
                      (unsigned)r->creases[n], (unsigned)r->corners[n]);
    print_message("\n");
    assert_true(r->worst < 1e-10);
    assert_true(r->inside < 1e-10);
}

/* As it is, with other positions, and with random blend ratios; consumes it. */
static void measure_marked_variants(marked *r, mesh m, uint64_t *rng)
{
    measure_marked(r, &m, rng);
    mesh_jitter(&m, rng, 0.04);
    measure_marked(r, &m, rng);
    mesh_random_tags(&m, rng, 16);
    measure_marked(r, &m, rng);
    mesh_free(&m);
}

static void test_open_meshes(void **state)
{
    marked r;
    uint64_t rng = 20;
    uint32_t n, k;
    mesh m;
    (void)state;
    if (!IS_DOUBLE) skip();
    memset(&r, 0, sizeof r);
    measure_marked_variants(&r, make_grid(6, 5), &rng);
    measure_marked_variants(&r, make_grid(1, 5), &rng);
    measure_marked_variants(&r, make_holed_grid(), &rng);
    for (n = 3; n <= 9; n++) {
        measure_marked_variants(&r, make_polygon(n), &rng);
        measure_marked_variants(&r, make_dome(n, 1), &rng);
        measure_marked_variants(&r, make_dome(n, 1 + n % 4), &rng);
        m = make_dome(n, 1);                            /* corners of two triangles */
        for (k = 0; k < n && n < 7; k++) mesh_corner(&m, 1 + k);
        measure_marked_variants(&r, m, &rng);
        m = make_grid(n, 5);
        mesh_split_quads(&m, &rng, 50);
        mesh_corner(&m, 0);
        mesh_corner(&m, n);
        measure_marked_variants(&r, m, &rng);
        measure_marked_variants(&r, with_holes(make_triangle_ball(n), &rng, 2), &rng);
    }
    assert_true(r.poles >= 30);
    for (k = 1; k <= 8; k++) {
        measure_marked_variants(&r, with_holes(make_dodecahedron(), &rng, k), &rng);
        measure_marked_variants(&r, with_holes(make_creature(), &rng, 2 * k), &rng);
        measure_marked_variants(&r, with_holes(make_random_spindle(&rng, 10 * k, 9), &rng, k),
                                &rng);
    }
    report_marked("open", &r);
    assert_true(r.meshes / 3 >= 60 && r.boundary > 1000);
}

/* Darts, creases, corners and lone faces wherever chance puts them. */
static void test_hard_edges(void **state)
{
    static const uint32_t percents[] = {3, 10, 25, 60};
    marked r;
    uint64_t rng = 21;
    uint32_t n, k;
    (void)state;
    if (!IS_DOUBLE) skip();
    memset(&r, 0, sizeof r);
    for (k = 0; k < COUNT_OF(percents); k++) {
        const uint32_t percent = percents[k];
        measure_marked_variants(&r, with_hard(make_cube(), &rng, percent), &rng);
        measure_marked_variants(&r, with_hard(make_dodecahedron(), &rng, percent), &rng);
        measure_marked_variants(&r, with_hard(make_creature(), &rng, percent), &rng);
        measure_marked_variants(&r, with_hard(make_torus(9, 7), &rng, percent), &rng);
        measure_marked_variants(&r, with_hard(make_holed_grid(), &rng, percent), &rng);
        for (n = 3; n <= 8; n++) {
            mesh m = make_torus(n + 2, 9);
            mesh_split_quads(&m, &rng, 40);
            measure_marked_variants(&r, with_hard(m, &rng, percent), &rng);
            measure_marked_variants(&r, with_hard(make_triangle_ball(n), &rng, percent), &rng);
            measure_marked_variants(&r, with_hard(make_latlong(n, 4), &rng, percent), &rng);
            m = with_holes(make_random_spindle(&rng, 30, 9), &rng, n % 4);
            measure_marked_variants(&r, with_hard(m, &rng, percent), &rng);
        }
    }
    report_marked("hard", &r);
    for (n = 3; n <= 6; n++)
        REQUIRE(r.darts[n] >= 50 && r.creases[n] >= 50 && r.corners[n] >= 30, "valence %u\n",
                (unsigned)n);
    assert_true(r.hard > 3000 && r.at_boundary > 50 && r.wide > 50 && r.alone > 300);
    assert_true(r.split_sizes[3] > 20 && r.split_sizes[4] > 20 && r.split_sizes[5] > 20);
}

/* Two chains of hard edges round a face: it is alone on its side at every vertex. */
static void test_lone_faces(void **state)
{
    mesh m;
    marked r;
    uint64_t rng = 22;
    uint32_t f, k;
    (void)state;
    if (!IS_DOUBLE) skip();
    m = make_torus(8, 8);
    memset(&r, 0, sizeof r);
    for (f = 9; f < 64; f += 18)
        for (k = 0; k < 4; k++) mesh_hard(&m, m.faces[f].v[k], m.faces[f].v[(k + 1) % 4]);
    measure_marked_variants(&r, m, &rng);
    assert_int_equal(r.splits, 3 * 4);
    assert_int_equal(r.poles, 3 * 4);                   /* a hard rim: the fan is a polar cap */
    m = make_torus(8, 8);                               /* only two edges of it, at one vertex */
    mesh_hard(&m, m.faces[9].v[0], m.faces[9].v[1]);
    mesh_hard(&m, m.faces[9].v[1], m.faces[9].v[2]);
    measure_marked_variants(&r, m, &rng);
    assert_int_equal(r.splits, 3 * 4 + 3);
    report_marked("lone faces", &r);
}

/* At a vertex every face's normal is near that of its plane. */
static void expect_upright(const mesh *m, uint32_t vertex)
{
    surface s;
    uint32_t f, k, found = 0;
    surface_build(&s, m);
    for (f = 0; f < m->face_count; f++)
        for (k = 0; k < m->faces[f].size; k++) {
            const uint32_t *v = m->faces[f].v;
            vec p = m->positions[v[0]], n = cross(sub(m->positions[v[1]], p),
                                                  sub(m->positions[v[2]], p));
            point at = eval_at(&s.patches, edge_sample(f, m->faces[f].size, k, 0));
            if (v[k] != vertex) continue;
            assert_true(angle_between(at.n, n) < 30 * PI / 180);
            found++;
        }
    assert_true(found >= 4);
    surface_free(&s);
}

/* A crease opens from a dart gently: a little way along it the two normals are still close. */
static void test_darts_open_gently(void **state)
{
    const double t = 1.0 / 64;
    uint32_t n;
    (void)state;
    if (!IS_DOUBLE) skip();
    for (n = 3; n <= 12; n++) {
        mesh m = make_triangle_ball(n);                 /* of valence n at its top */
        edge_map map;
        surface s;
        const half_edge *a, *b;
        double angle;
        mesh_hard(&m, 0, 1);
        mesh_hard(&m, 1, n + 1);                        /* to the bottom, and round it */
        map = map_edges(&m);
        surface_build(&s, &m);
        a = find_edge(&map, 0, 1), b = find_edge(&map, 1, 0);
        angle = angle_between(eval_at(&s.patches, edge_sample(a->face, 3, a->corner, t)).n,
                              eval_at(&s.patches, edge_sample(b->face, 3, b->corner, 1 - t)).n);
        print_message("dart of valence %u: %.2g degrees\n", (unsigned)n, angle * 180 / PI);
        assert_true(angle > 0 && angle * 180 / PI < 4 * t);
        surface_free(&s);
        free(map.edges);
        mesh_free(&m);
    }
}

/* Where a crease ends at another one the straight side is smooth, its normal that of the faces. */
static void test_wide_wedges(void **state)
{
    marked r;
    uint64_t rng = 23;
    uint32_t k, triangles;
    (void)state;
    if (!IS_DOUBLE) skip();
    memset(&r, 0, sizeof r);
    for (triangles = 0; triangles < 2; triangles++) {
        mesh m = make_grid(8, 8);
        if (triangles) mesh_split_quads(&m, &rng, 100);
        for (k = 0; k < 8; k++) mesh_hard(&m, 9 * 4 + k, 9 * 4 + k + 1);
        for (k = 0; k < 4; k++) mesh_hard(&m, 9 * k + 3, 9 * (k + 1) + 3);
        expect_upright(&m, 9 * 4 + 3);
        measure_marked_variants(&r, m, &rng);
    }
    report_marked("T of creases", &r);
    assert_true(r.wide >= 5);
}

/* Caps of cylinders are polar fans, hard rim or not. */
static void test_ngons(void **state)
{
    uint64_t rng = 24;
    uint32_t n, k, hard;
    marked r;
    (void)state;
    if (!IS_DOUBLE) skip();
    memset(&r, 0, sizeof r);
    for (n = 6; n <= 12; n++)
        for (hard = 0; hard < 2; hard++) {
            mesh m = make_cylinder(n, 3);
            surface s;
            for (k = 0; k < n && hard; k++) mesh_hard(&m, 3 * n + k, 3 * n + (k + 1) % n);
            surface_build(&s, &m);
            assert_int_equal(s.info.ngon_faces, 2);
            assert_int_equal(s.info.facets, 3 * n + 2 * n);
            assert_int_equal(s.tables.kind_first[PSURF_P3] - s.tables.kind_first[PSURF_POLAR],
                             2 * n);
            assert_int_equal(s.info.kind_faces[PSURF_BICUBIC], 3 * n);
            surface_free(&s);
            measure_marked_variants(&r, m, &rng);
            assert_true(r.split_sizes[n] > 0);
        }
    report_marked("n-gons", &r);
}

static void test_two_edges_at_a_vertex(void **state)
{
    uint64_t rng = 25;
    uint32_t k;
    marked r;
    (void)state;
    if (!IS_DOUBLE) skip();
    memset(&r, 0, sizeof r);
    for (k = 0; k < 4; k++) {
        mesh m = k == 0 ? make_cube() : k == 1 ? make_tetrahedron() : make_torus(7, 6);
        surface s;
        mesh_insert_vertex(&m, 0, 0);
        if (k == 3) {
            mesh_insert_vertex(&m, 0, 1);               /* two of them in a row */
            mesh_insert_vertex(&m, 20, 2);
            mesh_hard(&m, m.faces[20].v[2], m.faces[20].v[3]);
            mesh_hard(&m, m.faces[20].v[3], m.faces[20].v[4]);
        }
        surface_build(&s, &m);
        assert_int_equal(s.info.valence2, k == 3 ? 3 : 1);
        assert_int_equal(s.info.ngon_faces, k == 3 ? 4 : 2);
        surface_free(&s);
        measure_marked_variants(&r, m, &rng);
    }
    report_marked("two edges", &r);
}

/* A hard edge between two smooth vertices, corners where no crease is: nothing changes. */
static void test_marks_without_effect(void **state)
{
    mesh m = make_creature(), marked_mesh;
    surface a, b;
    uint32_t i, k;
    (void)state;
    marked_mesh = mesh_copy(&m);
    mesh_hard(&marked_mesh, m.faces[30].v[0], m.faces[30].v[1]);
    mesh_corner(&marked_mesh, m.faces[30].v[0]);
    mesh_corner(&marked_mesh, m.faces[20].v[0]);
    surface_build(&a, &m);
    surface_build(&b, &marked_mesh);
    assert_int_equal(b.info.hard_edges, 1);
    assert_int_equal(a.patches.layout.patch_bytes, b.patches.layout.patch_bytes);
    for (i = 0; i < a.info.facets; i++) {               /* the ring may begin at another spoke */
        psurf_patch pa = psurf_get_patch(&a.patches, i), pb = psurf_get_patch(&b.patches, i);
        assert_true(pa.kind == pb.kind && pa.face == pb.face);
        for (k = 0; k < pa.point_count; k++)
            assert_true(distance(load(pa.points + 3 * k), load(pb.points + 3 * k))
                        < (IS_DOUBLE ? 1e-14 : 2e-6));
    }
    surface_free(&a);
    surface_free(&b);
    mesh_free(&m);
    mesh_free(&marked_mesh);
}

/* The same in float on shapes as they are modelled. */
static void test_joins_in_float(void **state)
{
    joins j;
    uint64_t rng = 2;
    uint32_t k;
    mesh m[14];
    (void)state;
    if (IS_DOUBLE) skip();
    memset(&j, 0, sizeof j);
    m[0] = make_tetrahedron(), m[1] = make_cube(), m[2] = make_dodecahedron();
    m[3] = make_creature(), m[4] = make_latlong(12, 7), m[5] = make_triangle_ball(5);
    m[6] = make_torus(12, 8), m[7] = make_latlong(4, 1), m[8] = make_latlong(7, 1);
    m[9] = make_torus(16, 8), m[10] = make_torus(9, 6), m[11] = make_creature();
    m[12] = make_capped_spindle(&rng, 6), m[13] = make_capped_spindle(&rng, 9);
    mesh_split_quads(&m[9], &rng, 40);
    mesh_scramble(&m[10], &rng, 20);
    mesh_append(&m[11], &m[10], 8);
    for (k = 0; k < COUNT_OF(m); k++) {
        measure_joins(&j, &m[k], &rng, 6);
        mesh_free(&m[k]);
    }
    report_joins("float", &j);
    assert_true(j.worst * 180 / PI < 0.01);
}

/* Fans of many edges: poles, and vertices among P3 patches. */
static void test_high_valence(void **state)
{
    static const uint32_t valences[] = {3, 20, 60, 200, 1000, 4096};
    uint64_t rng = 3;
    uint32_t k, polar;
    (void)state;
    for (k = 0; k < COUNT_OF(valences); k++)
        for (polar = 0; polar < 2; polar++) {
            uint32_t n = valences[k];
            mesh m = polar ? make_latlong(n, 2) : make_triangle_ball(n);
            joins j;
            memset(&j, 0, sizeof j);
            measure_joins(&j, &m, &rng, 3);
            print_message("valence %u, %s: %.2g rad\n", (unsigned)n, polar ? "polar" : "p3",
                          j.worst);
            if (polar) assert_int_equal(j.pairs[PSURF_POLAR][PSURF_POLAR], 2 * n);
            else assert_int_equal(j.pairs[PSURF_P3][PSURF_P3], 6 * n);
            /* in float, rounding of points grows against the space between the spokes */
            assert_true(IS_DOUBLE ? j.worst < 1e-10
                                  : j.worst * 180 / PI < 0.01 * fmax(1, (double)n / 256));
            mesh_free(&m);
        }
}

/* The normal at a pole: one for all facets of the fan, perpendicular to the tangent points, and the
   limit of the normals on the way there. */
static void test_poles(void **state)
{
    uint64_t rng = 4;
    uint32_t n, i, k, poles = 0, meshes = 0;
    (void)state;
    for (n = 3; n <= 40; n += n < 8 ? 1 : 8, meshes++) {
        mesh m = make_latlong(n, 2);
        surface s;
        const psurf_ring *rings;
        mesh_jitter(&m, &rng, 0.04);
        surface_build(&s, &m);
        rings = (const psurf_ring *)s.tables.rings.data;
        for (i = 0; i < s.info.rings; i++) {
            vec v = limit_point(&s, i), normal = make_vec(0, 0, 0);
            uint32_t valence = rings[i].valence & PSURF_RING_VALENCE;
            if (!(rings[i].valence & PSURF_RING_POLAR)) continue;
            poles++;
            for (k = 0; k < valence; k++)
                normal = add(normal, cross(sub(spoke_point(&s, rings[i].first_spoke + k, 0), v),
                                           sub(spoke_point(&s, rings[i].first_spoke
                                                                   + (k + 1) % valence, 0), v)));
            for (k = 0; k < m.face_count; k++) {
                double w[3] = {0.3, 0.7, 0}, near_pole = IS_DOUBLE ? 1e-9 : 1e-4;
                uint32_t corner = 0;
                point at, near;
                while (corner < 3 && m.faces[k].v[corner] != rings[i].point) corner++;
                if (m.faces[k].size != 3 || corner == 3) continue;
                at = eval_at(&s.patches, make_sample(k, 0, corner == 1, corner == 2));
                w[corner] = 1 - near_pole;
                w[(corner + 1) % 3] = 0.3 * near_pole;
                w[(corner + 2) % 3] = 0.7 * near_pole;
                near = eval_at(&s.patches, make_sample(k, 0, w[1], w[2]));
                assert_true(distance(at.p, v) < (IS_DOUBLE ? 1e-14 : 1e-6));
                assert_true(angle_between(at.n, normal) < (IS_DOUBLE ? 1e-12 : 1e-4));
                assert_true(angle_between(at.n, near.n) < (IS_DOUBLE ? 1e-7 : 3e-3));
            }
        }
        surface_free(&s);
        mesh_free(&m);
    }
    assert_int_equal(poles, 2 * meshes);
}

/* ---- inside Pm patches ----------------------------------------------------------------------- */

/* Control points of a Pm patch as pm-formulas section 4.3 names them, rebuilt from the stored ones
   with (2) and (3) where they are not stored. */
typedef struct pm_net {
    uint32_t m;
    double c;                                   /* cos of 1/m turn */
    vec v[5], t0[5], t1[5], b211[5], b121[5], b112[5], b004, b202[5], b103[5];
} pm_net;

static pm_net load_net(const psurf_patch *patch)
{
    pm_net net;
    uint32_t i, m = patch->kind == PSURF_P3 ? 3 : patch->kind == PSURF_P4 ? 4 : 5;
    double k1, k2;
    memset(&net, 0, sizeof net);
    net.m = m;
    net.c = cos(2 * PI / m);
    k2 = 0.5 / (1 - net.c);
    k1 = 1 - 2 * k2;
    for (i = 0; i < m; i++) {
        const psurf_real *p = patch->points + 18 * i;
        net.v[i] = load(p), net.t0[i] = load(p + 3), net.t1[(i + 1) % m] = load(p + 6);
        net.b211[i] = load(p + 9), net.b121[i] = load(p + 12), net.b112[i] = load(p + 15);
    }
    net.b004 = load(patch->points + 18 * m);
    for (i = 0; i < m; i++) {
        uint32_t h = (i + m - 1) % m;
        vec b310 = mad(mul(0.25, net.v[i]), 0.75, net.t0[i]);
        vec b130 = mad(mul(0.25, net.v[i]), 0.75, net.t1[i]);
        vec b301 = mad(mul(k1, net.v[i]), k2, add(b310, b130));
        net.b202[i] = mad(mul(k1, b301), k2, add(net.b211[i], net.b121[h]));
        net.b103[i] = mad(mul(k1, net.b202[i]), k2, add(net.b112[i], net.b112[h]));
    }
    return net;
}

/* Equation (6) at the centre, for the points as stored. The rest of (6) holds by (2) and (3), which
   the test of derivatives below sees at work. */
static double centre_condition(const psurf_patch *patch)
{
    pm_net net = load_net(patch);
    double worst = 0;
    uint32_t i;
    for (i = 0; i < net.m; i++) {
        vec left = mad(mul(2 * (1 - net.c), net.b004), 2 * net.c, net.b103[i]);
        vec right = add(net.b103[(i + net.m - 1) % net.m], net.b103[(i + 1) % net.m]);
        worst = fmax(worst, distance(left, right));
    }
    return worst;
}

/* Derivatives on the line from corner i to the centre, from the sectors on both sides of it. In
   pentagons each sector has its own parameters: those of the regular pentagon's sectors agree. */
static double line_jump(const psurf_patches *patches, uint32_t face, uint32_t m, uint32_t i,
                        double t)
{
    const double aside = 1.0 / 17592186044416.0;        /* 2^-44: into the sector, not onto it */
    uint32_t h = (i + m - 1) % m;
    point before, after;
    if (m == 5) {
        double c = cos(2 * PI / 5);
        before = eval_at(patches, make_sample(face, h, 0, t));
        after = eval_at(patches, make_sample(face, i, t, 0));
        return fmax(distance(before.dv, after.du),
                    distance(after.dv, sub(mul(2 * c, after.du), before.du)));
    }
    before = eval_at(patches, sector_sample(face, m, h, aside, t));
    after = eval_at(patches, sector_sample(face, m, i, t, aside));
    return fmax(distance(before.du, after.du), distance(before.dv, after.dv));
}

/* Second derivatives at the centre, from sectors i and i+1. */
static double centre_jump(const psurf_patches *patches, uint32_t face, uint32_t m, uint32_t i)
{
    const double aside = 1.0 / 17592186044416.0;
    uint32_t j = (i + 1) % m;
    point a, b;
    if (m == 5) {
        double c = cos(2 * PI / 5);
        a = eval_at(patches, make_sample(face, i, 0, 0));
        b = eval_at(patches, make_sample(face, j, 0, 0));
        return fmax(distance(b.duu, a.dvv),
                    fmax(distance(b.duv, sub(mul(2 * c, a.dvv), a.duv)),
                         distance(b.dvv, add(mad(mul(4 * c * c, a.dvv), -4 * c, a.duv), a.duu))));
    }
    a = eval_at(patches, sector_sample(face, m, i, aside, aside));
    b = eval_at(patches, sector_sample(face, m, j, aside, aside));
    return fmax(distance(a.duu, b.duu), fmax(distance(a.duv, b.duv), distance(a.dvv, b.dvv)));
}

static void test_inside_pm(void **state)
{
    double control = 0, lines = 0, centres = 0;
    uint32_t counts[6] = {0}, round;
    uint64_t rng = 5;
    (void)state;
    if (!IS_DOUBLE) skip();
    for (round = 0; round < 12; round++) {
        mesh m = make_random_spindle(&rng, 10, 9);
        psurf_kind *kind = classify_faces(&m);
        surface s;
        uint32_t f, i, k;
        mesh_jitter(&m, &rng, 0.1);
        surface_build(&s, &m);
        for (f = 0; f < m.face_count; f++) {
            psurf_patch patch = psurf_get_patch(&s.patches, patch_of(&s, f));
            uint32_t size = m.faces[f].size;
            if (kind[f] < PSURF_P3) continue;
            assert_int_equal(patch.kind, kind[f]);
            counts[size]++;
            control = fmax(control, centre_condition(&patch));
            for (i = 0; i < size; i++) {
                centres = fmax(centres, centre_jump(&s.patches, f, size, i));
                for (k = 0; k < 4; k++)
                    lines = fmax(lines, line_jump(&s.patches, f, size, i,
                                                  0.01 + 0.98 * random_unit(&rng)));
            }
        }
        surface_free(&s);
        free(kind);
        mesh_free(&m);
    }
    print_message("inside %u P3, %u P4, %u P5: (6) %.2g, first derivatives %.2g, second at the "
                  "centre %.2g\n", (unsigned)counts[3], (unsigned)counts[4], (unsigned)counts[5],
                  control, lines, centres);
    assert_true(counts[3] > 50 && counts[4] > 20 && counts[5] > 20);
    assert_true(control < 1e-13);
    assert_true(lines < 1e-10);
    assert_true(centres < 1e-10);
}

/* ---- reproduction ---------------------------------------------------------------------------- */

static void bspline_weights(double t, double w[3][4])
{
    double r = 1 - t;
    w[0][0] = r * r * r / 6, w[0][3] = t * t * t / 6;
    w[0][1] = 2.0 / 3 - t * t + t * t * t / 2, w[0][2] = 2.0 / 3 - r * r + r * r * r / 2;
    w[1][0] = -r * r / 2, w[1][3] = t * t / 2;
    w[1][1] = -2 * t + 1.5 * t * t, w[1][2] = 2 * r - 1.5 * r * r;
    w[2][0] = r, w[2][3] = t, w[2][1] = -2 + 3 * t, w[2][2] = -2 + 3 * r;
}

/* Uniform bicubic B-spline over a 4 x 4 net, derivative a along u and b along v. */
static vec bspline(const vec net[4][4], double u, double v, int a, int b)
{
    double wu[3][4], wv[3][4];
    vec sum = make_vec(0, 0, 0);
    int i, j;
    bspline_weights(u, wu);
    bspline_weights(v, wv);
    for (i = 0; i < 4; i++)
        for (j = 0; j < 4; j++) sum = mad(sum, wu[a][i] * wv[b][j], net[i][j]);
    return sum;
}

/* Where four-valent quads lie all round, the surface is the uniform bicubic B-spline. */
static void test_bspline(void **state)
{
    const uint32_t along = 9, around = 7;
    double tolerance = IS_DOUBLE ? 1e-13 : 2e-5, worst = 0;
    mesh m = make_torus(along, around);
    uint64_t rng = 6;
    uint32_t f, k, i, j;
    surface s;
    (void)state;
    mesh_jitter(&m, &rng, 0.25);
    surface_build(&s, &m);
    for (f = 0; f < m.face_count; f++) {
        vec net[4][4];
        for (i = 0; i < 4; i++)
            for (j = 0; j < 4; j++)
                net[i][j] = m.positions[(f / around + i + along - 1) % along * around
                                        + (f % around + j + around - 1) % around];
        for (k = 0; k < 10; k++) {
            double u = random_unit(&rng), v = random_unit(&rng);
            point p = eval_at(&s.patches, make_sample(f, 0, u, v));
            worst = fmax(worst, distance(p.p, bspline((const vec(*)[4])net, u, v, 0, 0)));
            worst = fmax(worst, distance(p.du, bspline((const vec(*)[4])net, u, v, 1, 0)) / 4);
            worst = fmax(worst, distance(p.dv, bspline((const vec(*)[4])net, u, v, 0, 1)) / 4);
            worst = fmax(worst, distance(p.duu, bspline((const vec(*)[4])net, u, v, 2, 0)) / 16);
            worst = fmax(worst, distance(p.duv, bspline((const vec(*)[4])net, u, v, 1, 1)) / 16);
            worst = fmax(worst, distance(p.dvv, bspline((const vec(*)[4])net, u, v, 0, 2)) / 16);
        }
    }
    print_message("B-spline: largest difference %.2g\n", worst);
    assert_true(worst < tolerance);
    assert_int_equal(s.info.kind_faces[PSURF_BICUBIC], m.face_count);
    surface_free(&s);
    mesh_free(&m);
}

/* On a regular quad grid over the integers, heights q(x, y) of a quadratic give the quadratic
   itself, lifted by (q_xx + q_yy) / 6: that is what the uniform cubic B-spline does to x^2. */
static void test_quadratic_on_grid(void **state)
{
    const double q[6] = {0.25, -0.5, 0.75, 0.3, -0.2, 1.5};         /* xx xy yy x y 1 */
    const uint32_t n = 10, block = 6;
    mesh m = make_torus(n, n);
    uint32_t i, j, k, faces = 0;
    uint64_t rng = 7;
    double worst = 0;
    surface s;
    (void)state;
    for (i = 0; i < block; i++)
        for (j = 0; j < block; j++) {
            double x = i, y = j;
            m.positions[i * n + j] = make_vec(x, y, q[0] * x * x + q[1] * x * y + q[2] * y * y
                                                        + q[3] * x + q[4] * y + q[5]);
        }
    surface_build(&s, &m);
    for (i = 1; i + 2 < block; i++)
        for (j = 1; j + 2 < block; j++, faces++)
            for (k = 0; k < 20; k++) {
                double u = random_unit(&rng), v = random_unit(&rng), x = i + u, y = j + v;
                point p = eval_at(&s.patches, make_sample(i * n + j, 0, u, v));
                double z = q[0] * x * x + q[1] * x * y + q[2] * y * y + q[3] * x + q[4] * y + q[5];
                vec up = unit(make_vec(-2 * q[0] * x - q[1] * y - q[3],
                                       -q[1] * x - 2 * q[2] * y - q[4], 1));
                worst = fmax(worst, distance(p.p, make_vec(x, y, z + (q[0] + q[2]) / 3)));
                worst = fmax(worst, angle_between(p.n, up));
            }
    assert_int_equal(faces, 9);
    assert_true(worst < (IS_DOUBLE ? 1e-13 : 2e-5) * 10);
    surface_free(&s);
    mesh_free(&m);
}

/* The rule for b112 (21), (22), found out from the outside: a linear map of the other points of the
   patch, fitted to what the library makes of random meshes. */
enum { RULE_MAX = 26 };
typedef struct rule {
    uint32_t m, terms, rows;
    double normal[RULE_MAX][RULE_MAX + 1];      /* normal equations, then their solution in place */
    double weight[RULE_MAX];
} rule;

/* What b112 of sector 0 may depend on: per sector v, t0, t1, b211, b121; and b004. */
static void rule_inputs(const pm_net *net, vec *in)
{
    uint32_t i;
    for (i = 0; i < net->m; i++) {
        in[5 * i] = net->v[i], in[5 * i + 1] = net->t0[i], in[5 * i + 2] = net->t1[i];
        in[5 * i + 3] = net->b211[i], in[5 * i + 4] = net->b121[i];
    }
    in[5 * net->m] = net->b004;
}

static void rule_learn(rule *r, const pm_net *net)
{
    vec in[RULE_MAX], out = net->b112[0];
    uint32_t i, j, k;
    rule_inputs(net, in);
    for (k = 0; k < 3; k++) {
        double x[RULE_MAX + 1];
        for (i = 0; i < r->terms; i++) x[i] = k == 0 ? in[i].x : k == 1 ? in[i].y : in[i].z;
        x[r->terms] = k == 0 ? out.x : k == 1 ? out.y : out.z;
        for (i = 0; i < r->terms; i++)
            for (j = 0; j <= r->terms; j++) r->normal[i][j] += x[i] * x[j];
        r->rows++;
    }
}

static void rule_solve(rule *r)
{
    uint32_t n = r->terms, i, j, k;
    for (k = 0; k < n; k++) {
        uint32_t pivot = k;
        for (i = k; i < n; i++)
            if (fabs(r->normal[i][k]) > fabs(r->normal[pivot][k])) pivot = i;
        for (j = 0; j <= n; j++) {
            double t = r->normal[k][j];
            r->normal[k][j] = r->normal[pivot][j];
            r->normal[pivot][j] = t;
        }
        for (i = 0; i < n; i++) {
            double factor = r->normal[i][k] / r->normal[k][k];
            for (j = k; i != k && j <= n; j++) r->normal[i][j] -= factor * r->normal[k][j];
        }
    }
    for (k = 0; k < n; k++) r->weight[k] = r->normal[k][n] / r->normal[k][k];
}

static vec rule_error(const rule *r, const pm_net *net)
{
    vec in[RULE_MAX], sum = make_vec(0, 0, 0);
    uint32_t i;
    rule_inputs(net, in);
    for (i = 0; i < r->terms; i++) sum = mad(sum, r->weight[i], in[i]);
    return sub(sum, net->b112[0]);
}

/* Polar form, of degree n, of three polynomials at once: the mean over all pairs of the polar forms
   of degree 2. linear: 1, x, y; else x^2, xy, y^2. */
static vec blossom(int linear, const vec *p, int n)
{
    vec sum = make_vec(0, 0, 0);
    int i, j;
    for (i = 0; i < n; i++)
        for (j = i + 1; j < n; j++) {
            vec a = p[i], b = p[j];
            vec pair = linear ? make_vec(1, (a.x + b.x) / 2, (a.y + b.y) / 2)
                              : make_vec(a.x * b.x, (a.x * b.y + a.y * b.x) / 2, a.y * b.y);
            sum = mad(sum, 2.0 / (n * (n - 1)), pair);
        }
    return sum;
}

/* The Bezier net of those polynomials over the regular m-gon. */
static pm_net polynomial_net(uint32_t m, int linear)
{
    pm_net net;
    vec o = make_vec(0, 0, 0), p[7];
    uint32_t i;
    memset(&net, 0, sizeof net);
    net.m = m;
    for (i = 0; i < m; i++) {
        uint32_t j = (i + 1) % m;
        vec a = make_vec(cos(2 * PI * i / m), sin(2 * PI * i / m), 0);
        vec b = make_vec(cos(2 * PI * j / m), sin(2 * PI * j / m), 0);
        p[0] = p[1] = p[2] = a, p[3] = p[4] = b;
        net.v[i] = blossom(linear, p, 3);               /* a a a */
        net.t0[i] = blossom(linear, p + 1, 3);          /* a a b */
        net.t1[j] = blossom(linear, p + 2, 3);          /* a b b */
        p[1] = p[2] = a, p[3] = b, p[4] = o;
        net.b211[i] = blossom(linear, p + 1, 4);        /* a a b o */
        p[2] = b;
        net.b121[i] = blossom(linear, p + 1, 4);        /* a b b o */
        p[3] = o;
        net.b112[i] = blossom(linear, p + 1, 4);        /* a b o o */
    }
    p[0] = p[1] = p[2] = p[3] = o;
    net.b004 = blossom(linear, p, 4);
    return net;
}

/* (21), (22): the rules for the last points reproduce every quadratic on squares and pentagons, and
   on triangles linear functions and x^2 + y^2. */
static void test_quadratics_at_centre(void **state)
{
    rule *rules;
    uint64_t rng = 8;
    uint32_t round, i, k;
    (void)state;
    if (!IS_DOUBLE) skip();
    rules = (rule *)grab(3, sizeof(rule));
    for (k = 0; k < 3; k++) rules[k].m = 3 + k, rules[k].terms = 5 * (3 + k) + 1;
    for (round = 0; round < 60; round++) {
        mesh m = make_random_spindle(&rng, 10, 9);
        surface s;
        for (i = 0; i < m.vertex_count; i++)    /* random altogether: rows in general position */
            m.positions[i] = random_vec(&rng);
        surface_build(&s, &m);
        for (i = 0; i < s.info.facets; i++) {
            psurf_patch patch = psurf_get_patch(&s.patches, i);
            if (patch.kind >= PSURF_P3) {
                pm_net net = load_net(&patch);
                rule_learn(&rules[net.m - 3], &net);
            }
        }
        surface_free(&s);
        mesh_free(&m);
    }
    for (k = 0; k < 3; k++) {
        pm_net linear = polynomial_net(3 + k, 1), quadratic = polynomial_net(3 + k, 0);
        vec error;
        assert_true(rules[k].rows > 20 * rules[k].terms);
        rule_solve(&rules[k]);
        assert_true(length(rule_error(&rules[k], &linear)) < 1e-8);
        error = rule_error(&rules[k], &quadratic);
        print_message("m = %u: x^2, xy, y^2 off by %.2g %.2g %.2g, from %u rows\n",
                      (unsigned)(3 + k), error.x, error.y, error.z, (unsigned)rules[k].rows);
        if (k) assert_true(length(error) < 1e-8);
        else assert_true(fabs(error.x + error.z) < 1e-8);
    }
    free(rules);
}

/* How round the surfaces of the regular solids are, against figures of an independent
   implementation (to the digits it gives): (largest - smallest) / mean radius, and the radius at
   the centres of faces over that at the vertices. This is what the weights w of the centre, free
   otherwise, decide. */
static void test_roundness(void **state)
{
    static const struct { const char *name; double spread, ratio; } want[] = {
        {"tetrahedron", 0.199, 0}, {"octahedron", 0.047, 0}, {"icosahedron", 0.018, 1.018},
        {"dodecahedron", 0.027, 0.974}};
    mesh m[4];
    uint32_t i, f, x, y, k;
    (void)state;
    m[0] = make_tetrahedron(), m[1] = make_latlong(4, 1);
    m[2] = make_triangle_ball(5), m[3] = make_dodecahedron();
    for (k = 0; k < 6; k++) m[1].positions[k] = unit(m[1].positions[k]);
    m[2].positions[0] = make_vec(0, 0, 1), m[2].positions[11] = make_vec(0, 0, -1);
    for (k = 0; k < 5; k++) {
        double up = 2 * PI * k / 5, down = up + PI / 5, z = sqrt(0.2);
        m[2].positions[1 + k] = make_vec(2 * z * cos(up), 2 * z * sin(up), z);
        m[2].positions[6 + k] = make_vec(2 * z * cos(down), 2 * z * sin(down), -z);
    }
    for (i = 0; i < 4; i++) {
        double low = 1e9, high = 0, sum = 0, vertex = 0, centre = 0;
        uint32_t count = 0;
        surface s;
        surface_build(&s, &m[i]);
        for (f = 0; f < m[i].face_count; f++)
            for (k = 0; k < m[i].faces[f].size; k++)
                for (y = 0; y <= 20; y++)
                    for (x = 0; x + y <= 20; x++, count++) {
                        psurf_sample at = sector_sample(f, m[i].faces[f].size, k, x / 20.0,
                                                        y / 20.0);
                        double r = length(eval_at(&s.patches, at).p);
                        low = fmin(low, r), high = fmax(high, r), sum += r;
                        if (x + y == 0) centre = r;
                        if (x == 20) vertex = r;
                    }
        print_message("%s: spread %.4f, centre over vertex %.4f\n", want[i].name,
                      (high - low) * count / sum, centre / vertex);
        assert_true(fabs((high - low) * count / sum - want[i].spread) < 0.0015);
        if (want[i].ratio > 0) assert_true(fabs(centre / vertex - want[i].ratio) < 0.0015);
        surface_free(&s);
        mesh_free(&m[i]);
    }
}

/* ---- blend ratios ---------------------------------------------------------------------------- */

/* A ratio acts at its own end: 0 puts the two face points beside the spoke onto its line (that is
   what [PM] eq. 14 is for), and leaves the other end as it was. */
static void test_blend_at_one_end(void **state)
{
    mesh m = make_creature();
    edge_map map = map_edges(&m);
    double tolerance = IS_DOUBLE ? 1e-15 : 1e-6;
    uint32_t i, tried = 0;
    surface plain, s;
    (void)state;
    surface_build(&plain, &m);
    for (i = 0; i < map.count; i += 7, tried++) {
        uint32_t v0 = map.edges[i].from, v1 = map.edges[i].to, there, here, k;
        const psurf_ring *ring;
        vec p = m.positions[v0], along = unit(sub(m.positions[v1], p));
        m.tag_count = 0;
        mesh_tag(&m, v0, v1, 0, 2.0 / 3.0);
        surface_build(&s, &m);
        here = psurf_find_spoke(s.topology, v0, v1);
        there = psurf_find_spoke(s.topology, v1, v0);
        ring = (const psurf_ring *)s.tables.rings.data;
        while (here - ring->first_spoke >= (ring->valence & PSURF_RING_VALENCE)) ring++;
        for (k = 0; k < 2; k++) {
            uint32_t n = ring->valence & PSURF_RING_VALENCE;
            uint32_t j = ring->first_spoke + (here - ring->first_spoke + (k ? n - 1 : 0)) % n;
            vec f = sub(spoke_point(&s, j, 1), p);
            assert_true(length(cross(f, along)) < tolerance && dot(f, along) > 0);
            assert_true(length(cross(sub(spoke_point(&plain, j, 1), p), along)) > 0.01);
        }
        for (k = 0; k < 2; k++)
            assert_true(distance(spoke_point(&s, there, (int)k), spoke_point(&plain, there, (int)k))
                        < tolerance);
        surface_free(&s);
    }
    assert_true(tried > 20);
    surface_free(&plain);
    free(map.edges);
    mesh_free(&m);
}

/* All ratios 0: edges are the mesh's own, run through as 3 s^2 - 2 s^3; ordinary faces are
   bilinear, so run through; Pm patches have their centre in the mean of the corners. Positions
   meet, and normals are one-sided but there. */
static void test_all_creases(void **state)
{
    mesh m = make_creature();
    surface s;
    uint64_t rng = 12;
    double tolerance = IS_DOUBLE ? 2e-15 : 1e-6;
    uint32_t f, i, k;
    psurf_check_result r;
    (void)state;
    mesh_jitter(&m, &rng, 0.04);
    surface_describe(&s, &m);
    s.desc.flags = PSURF_DEFAULT_BLEND;
    s.desc.default_blend = 0;
    surface_make(&s);
    for (f = 0; f < m.face_count; f++) {
        uint32_t size = m.faces[f].size;
        psurf_kind kind = psurf_get_patch(&s.patches, patch_of(&s, f)).kind;
        const uint32_t *v = m.faces[f].v;
        vec mean = make_vec(0, 0, 0);
        for (i = 0; i < size; i++) {
            vec a = m.positions[v[i]], b = m.positions[v[(i + 1) % size]];
            mean = mad(mean, 1.0 / size, a);
            for (k = 0; k <= 8; k++) {
                double t = k / 8.0;
                point p = eval_at(&s.patches, edge_sample(f, size, i, t));
                assert_true(distance(p.p, mad(a, t * t * (3 - 2 * t), sub(b, a))) < tolerance);
                assert_true(fabs(length(p.n) - 1) < 1e-6);
                if (k == 4) {                   /* it is the face's own, a little inside */
                    double aside = 0.4995;
                    point q = eval_at(&s.patches, sector_sample(f, size, i, aside, aside));
                    assert_true(angle_between(p.n, q.n) < 2e-3);
                }
            }
        }
        for (k = 0; k < 10 && kind == PSURF_BICUBIC; k++) {
            double u = random_unit(&rng), w = random_unit(&rng), x = u * u * (3 - 2 * u);
            double y = w * w * (3 - 2 * w);
            vec low = mad(mul(1 - x, m.positions[v[0]]), x, m.positions[v[1]]);
            vec high = mad(mul(1 - x, m.positions[v[3]]), x, m.positions[v[2]]);
            vec p = eval_at(&s.patches, make_sample(f, 0, u, w)).p;
            assert_true(distance(p, mad(mul(1 - y, low), y, high)) < tolerance);
        }
        if (kind >= PSURF_P3)
            assert_true(distance(eval_at(&s.patches, sector_sample(f, size, 0, 0, 0)).p, mean)
                        < tolerance);
    }
    assert_int_equal(psurf_check(&s.patches, &s.construct, 7, 0, PSURF_NONE, &r), PSURF_OK);
    assert_int_equal(r.cracks + r.nonfinite, 0);
    assert_int_equal(r.sharp_edges, s.info.edges);
    surface_free(&s);
    mesh_free(&m);
}

/* ---- invariance ------------------------------------------------------------------------------ */

static vec affine(vec p)
{
    return make_vec(1.5 * p.x - 0.25 * p.y + 0.5 * p.z + 3, 0.125 * p.x + 0.75 * p.y - p.z - 1,
                    -0.5 * p.x + 0.375 * p.y + 1.25 * p.z + 2);
}

static void test_affine(void **state)
{
    mesh m = make_creature(), moved;
    surface a, b;
    uint64_t rng = 9;
    uint32_t i, k;
    (void)state;
    mesh_jitter(&m, &rng, 0.05);
    moved = mesh_copy(&m);
    for (i = 0; i < m.vertex_count; i++) moved.positions[i] = affine(m.positions[i]);
    surface_build(&a, &m);
    surface_build(&b, &moved);
    for (i = 0; i < a.info.facets; i++) {
        psurf_patch pa = psurf_get_patch(&a.patches, i), pb = psurf_get_patch(&b.patches, i);
        assert_int_equal(pa.point_count, pb.point_count);
        for (k = 0; k < pa.point_count; k++)
            assert_true(distance(affine(load(pa.points + 3 * k)), load(pb.points + 3 * k))
                        < (IS_DOUBLE ? 1e-13 : 1e-5));
    }
    for (i = 0; i < 400; i++) {
        psurf_sample s = random_sample(&m, &rng);
        assert_true(distance(affine(eval_at(&a.patches, s).p), eval_at(&b.patches, s).p)
                    < (IS_DOUBLE ? 1e-13 : 1e-5));
    }
    surface_free(&a);
    surface_free(&b);
    mesh_free(&m);
    mesh_free(&moved);
}

/* Vertices in a plane: the surface stays in it. */
static void test_planar(void **state)
{
    const vec normal = {0.36, 0.48, 0.8};
    double limit = IS_DOUBLE ? 1e-14 : 2e-6;
    mesh m = make_creature();
    surface s;
    uint64_t rng = 10;
    uint32_t i, k;
    (void)state;
    mesh_jitter(&m, &rng, 0.05);
    for (i = 0; i < m.vertex_count; i++)
        m.positions[i] = mad(m.positions[i], 0.5 - dot(m.positions[i], normal), normal);
    surface_build(&s, &m);
    for (i = 0; i < s.info.facets; i++) {
        psurf_patch patch = psurf_get_patch(&s.patches, i);
        for (k = 0; k < patch.point_count; k++)
            assert_true(fabs(dot(load(patch.points + 3 * k), normal) - 0.5) < limit);
    }
    for (i = 0; i < 1000; i++) {
        point p = eval_at(&s.patches, random_sample(&m, &rng));
        assert_true(fabs(dot(p.p, normal) - 0.5) < limit);
    }
    surface_free(&s);
    mesh_free(&m);
}

static void shuffle(uint32_t *order, uint32_t count, uint64_t *rng)
{
    uint32_t i;
    for (i = 0; i < count; i++) order[i] = i;
    for (i = count; i > 1; i--) {
        uint32_t k = random_below(rng, i), t = order[k];
        order[k] = order[i - 1];
        order[i - 1] = t;
    }
}

/* The same mesh, its vertices renumbered, its faces reordered and begun at other corners. */
static mesh renumber(const mesh *m, const uint32_t *vertex, const uint32_t *face,
                     const uint32_t *turn)
{
    mesh other = mesh_copy(m);
    uint32_t i, k;
    for (i = 0; i < m->vertex_count; i++) other.positions[vertex[i]] = m->positions[i];
    for (i = 0; i < m->face_count; i++)
        for (k = 0; k < m->faces[i].size; k++) {
            other.faces[face[i]].size = m->faces[i].size;
            other.faces[face[i]].v[k] =
                vertex[m->faces[i].v[(k + turn[i]) % m->faces[i].size]];
        }
    for (i = 0; i < m->tag_count; i++) {
        psurf_edge_tag *t = &other.tags[i];
        t->v0 = vertex[m->tags[i].v0];
        t->v1 = vertex[m->tags[i].v1];
    }
    return other;
}

static void test_bookkeeping(void **state)
{
    mesh m = make_creature(), other;
    uint32_t *vertex = (uint32_t *)grab(m.vertex_count, sizeof *vertex);
    uint32_t *face = (uint32_t *)grab(m.face_count, sizeof *face);
    uint32_t *turn = (uint32_t *)grab(m.face_count, sizeof *turn), i, round;
    uint64_t rng = 11;
    surface a, b;
    (void)state;
    mesh_jitter(&m, &rng, 0.05);
    mesh_random_tags(&m, &rng, 51);
    surface_build(&a, &m);
    for (round = 0; round < 10; round++) {
        shuffle(vertex, m.vertex_count, &rng);
        shuffle(face, m.face_count, &rng);
        for (i = 0; i < m.face_count; i++) turn[i] = random_below(&rng, m.faces[i].size);
        other = renumber(&m, vertex, face, turn);
        surface_build(&b, &other);
        for (i = 0; i < 500; i++) {
            uint32_t f = random_below(&rng, m.face_count), size = m.faces[f].size;
            uint32_t sector = random_below(&rng, size);
            double u = random_unit(&rng) / 2, v = random_unit(&rng) / 2;
            point p = eval_at(&a.patches, sector_sample(f, size, sector, u, v));
            point q = eval_at(&b.patches, sector_sample(face[f], size,
                                                        (sector + size - turn[f]) % size, u, v));
            assert_true(distance(p.p, q.p) < (IS_DOUBLE ? 1e-13 : 1e-5));
            assert_true(distance(p.n, q.n) < (IS_DOUBLE ? 1e-11 : 1e-3));
        }
        surface_free(&b);
        mesh_free(&other);
    }
    surface_free(&a);
    free(vertex);
    free(face);
    free(turn);
    mesh_free(&m);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_all_joins),          cmocka_unit_test(test_open_meshes),
        cmocka_unit_test(test_hard_edges),         cmocka_unit_test(test_lone_faces),
        cmocka_unit_test(test_darts_open_gently),  cmocka_unit_test(test_wide_wedges),
        cmocka_unit_test(test_ngons),
        cmocka_unit_test(test_two_edges_at_a_vertex),
        cmocka_unit_test(test_marks_without_effect),
        cmocka_unit_test(test_joins_in_float),
        cmocka_unit_test(test_high_valence),       cmocka_unit_test(test_poles),
        cmocka_unit_test(test_inside_pm),          cmocka_unit_test(test_bspline),
        cmocka_unit_test(test_quadratic_on_grid),  cmocka_unit_test(test_quadratics_at_centre),
        cmocka_unit_test(test_roundness),
        cmocka_unit_test(test_blend_at_one_end),   cmocka_unit_test(test_all_creases),
        cmocka_unit_test(test_affine),             cmocka_unit_test(test_planar),
        cmocka_unit_test(test_bookkeeping)};
    return cmocka_run_group_tests_name("smooth", tests, NULL, NULL);
}
