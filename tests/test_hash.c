/* One 64-bit hash per scene over control points, tessellations, samples and curvature: the same
   under every compiler, flag, instruction set, width and byte order. Compares with
   tests/data/hashes.txt (double: hashes_double.txt); with --print it only prints the lines of that
   file; with --set NAME it only compares, and is skipped where another instruction set is in
   use. */
#include "common.h"

/* FNV-1a over the bytes of numbers, lowest first, whatever the machine's order is. */
static uint64_t hash_number(uint64_t hash, uint64_t number, unsigned bytes)
{
    unsigned i;
    for (i = 0; i < bytes; i++) {
        hash ^= number & 0xFF;
        hash *= 0x100000001B3u;
        number >>= 8;
    }
    return hash;
}

static uint64_t hash_reals(uint64_t hash, const psurf_real *reals, size_t count)
{
    size_t i;
    for (i = 0; i < count; i++) {
        uint32_t narrow;
        uint64_t wide;
        if (IS_DOUBLE) memcpy(&wide, reals + i, sizeof wide);
        else memcpy(&narrow, reals + i, sizeof narrow), wide = narrow;
        hash = hash_number(hash, wide, sizeof(psurf_real));
    }
    return hash;
}

static uint64_t hash_indices(uint64_t hash, const uint32_t *indices, size_t count)
{
    size_t i;
    for (i = 0; i < count; i++) hash = hash_number(hash, indices[i], 4);
    return hash;
}

/* Control points kind by kind, in the order of patches. */
static uint64_t hash_patches(uint64_t hash, const surface *s)
{
    uint32_t i;
    for (i = 0; i < s->info.facets; i++) {
        psurf_patch patch = psurf_get_patch(&s->patches, i);
        hash = hash_reals(hash, patch.points, (size_t)patch.point_count * 3);
    }
    return hash;
}

/* Tessellates the mesh, in ranges of step faces, and hashes all of it. interleaved: p.xyz n.xyz,
   else positions, then normals. */
static uint64_t hash_tessellation(uint64_t hash, const surface *s, uint32_t rate, uint32_t flags,
                                  int interleaved, uint32_t step)
{
    psurf_tess_desc desc;
    psurf_tess_span span;
    psurf_tess_out out;
    uint32_t f;
    size_t reals;
    memset(&desc, 0, sizeof desc);
    memset(&out, 0, sizeof out);
    desc.rate = rate;
    desc.flags = flags;
    REQUIRE(psurf_tessellate_size(s->topology, &desc, 0, PSURF_NONE, &span) == PSURF_OK, "size\n");
    reals = (size_t)span.vertex_count * 6;
    out.p = (psurf_real *)grab(reals, sizeof *out.p);
    out.n = out.p + (interleaved ? 3 : reals / 2);
    out.p_stride = out.n_stride = interleaved ? 6 * sizeof *out.p : 0;
    out.indices = grab(span.index_count, sizeof(uint32_t));
    if (s->scheme != PSURF_PM) out.shade = (psurf_real *)grab(reals / 2, sizeof *out.p);
    for (f = 0; f < s->info.faces; f += step)
        REQUIRE(psurf_tessellate(&s->patches, &desc, f, step, &out) == PSURF_OK, "tessellate\n");
    hash = hash_reals(hash, out.p, reals);
    hash = hash_indices(hash, (const uint32_t *)out.indices, span.index_count);
    if (out.shade) hash = hash_reals(hash, out.shade, reals / 2);
    free(out.shade);
    free(out.p);
    free(out.indices);
    return hash;
}

/* Places on every face, on its edges, at its corners and anywhere; then some anywhere on the mesh,
   face after face at random. */
enum { GRID = 4, ANYWHERE = 300 };
static psurf_sample *make_samples(const mesh *m, uint32_t *count)
{
    const uint32_t most = m->face_count * MESH_MAX_CORNERS * (GRID + 1) * (GRID + 1) + ANYWHERE;
    psurf_sample *samples = (psurf_sample *)grab(most, sizeof *samples);
    uint64_t rng = 9;
    uint32_t f, sector, i, j, n = 0;
    for (f = 0; f < m->face_count; f++) {
        const uint32_t size = m->faces[f].size;
        for (sector = 0; sector < (size < 5 ? 1 : size); sector++)
            for (j = 0; j <= GRID; j++)
                for (i = 0; i <= GRID; i++)
                    if (size == 4 || i + j <= GRID)
                        samples[n++] = make_sample(f, sector, (double)i / GRID, (double)j / GRID);
        samples[n++] = random_sample_of(m, f, &rng);
    }
    for (i = 0; i < ANYWHERE; i++) samples[n++] = random_sample(m, &rng);
    *count = n;
    return samples;
}

/* All that psurf_eval gives, and curvature, where it exists: NaN has many forms. */
static uint64_t hash_points(uint64_t hash, const surface *s, const mesh *m, uint32_t step)
{
    enum { WIDTH = 23 };
    uint32_t count, i, k, block;
    psurf_sample *samples = make_samples(m, &count);
    psurf_real *points = (psurf_real *)grab((size_t)count * WIDTH, sizeof *points);
    psurf_real *shades = (psurf_real *)grab((size_t)count * WIDTH, sizeof *points);
    for (i = 0; i < count; i += block) {
        psurf_real *first = points + (size_t)i * WIDTH, gauss[64], mean[64];
        psurf_points out;
        block = step < 64 ? step : 64;
        block = block < count - i ? block : count - i;
        memset(&out, 0, sizeof out);
        out.p = first, out.n = first + 3, out.du = first + 6, out.dv = first + 9;
        out.duu = first + 12, out.duv = first + 15, out.dvv = first + 18;
        out.stride = WIDTH * sizeof *points;
        if (s->scheme != PSURF_PM) out.shade = shades + (size_t)i * WIDTH;
        psurf_eval(&s->patches, samples + i, block, &out);
        psurf_curvature(&s->patches, samples + i, block, gauss, mean);
        for (k = 0; k < block; k++) {
            first[k * WIDTH + 21] = isnan(gauss[k]) ? 0 : gauss[k];
            first[k * WIDTH + 22] = isnan(mean[k]) ? 0 : mean[k];
        }
    }
    hash = hash_reals(hash, points, (size_t)count * WIDTH);
    if (s->scheme != PSURF_PM) hash = hash_reals(hash, shades, (size_t)count * WIDTH);
    free(shades);
    free(points);
    free(samples);
    return hash;
}

/* Everything about a surface, made in passes and ranges of step items; tessellated up to a rate. */
static uint64_t hash_surface(surface *s, const mesh *m, uint32_t finest, uint32_t step)
{
    const uint32_t rates[] = {1, 5, finest};
    uint64_t hash = 0xCBF29CE484222325u;
    uint32_t pass, i, r, flags;
    for (pass = 0; pass < PSURF_PASS_COUNT; pass++)
        for (i = 0; i < s->patches.layout.pass_items[pass]; i += step)
            REQUIRE(psurf_construct_pass(&s->patches, &s->construct, (psurf_pass)pass, i, step)
                        == PSURF_OK, "construct\n");
    hash = hash_patches(hash, s);
    for (r = 0; r < COUNT_OF(rates); r++)
        for (flags = 0; flags <= PSURF_TESS_PER_FACE; flags++) {
            hash = hash_tessellation(hash, s, rates[r], flags, 0, step);
            if (r == 1) hash = hash_tessellation(hash, s, rates[r], flags, 1, step);
        }
    return hash_points(hash, s, m, step);
}

/* ---- scenes ---------------------------------------------------------------------------------- */

static mesh scene_dodecahedron(void)
{
    mesh m = make_dodecahedron();
    uint64_t rng = 1;
    mesh_jitter(&m, &rng, 0.125);
    return m;
}

static mesh scene_torus(void)
{
    mesh m = make_torus(9, 7);
    uint64_t rng = 2;
    mesh_jitter(&m, &rng, 0.25);
    return m;
}

/* Poles of every valence from 3 to 13, and one of 200. */
static mesh scene_poles(void)
{
    mesh m = make_latlong(200, 2);
    uint32_t n;
    for (n = 3; n <= 13; n++) {
        mesh ball = make_latlong(n, 1 + n % 3);
        mesh_append(&m, &ball, 4.0 * n);
        mesh_free(&ball);
    }
    return m;
}

static mesh scene_triangles(void)
{
    mesh m = make_torus(7, 6), ball;
    uint64_t rng = 3;
    uint32_t n;
    mesh_split_quads(&m, &rng, 60);
    mesh_jitter(&m, &rng, 0.125);
    for (n = 3; n <= 12; n++) {
        ball = make_triangle_ball(n);
        mesh_append(&m, &ball, 4.0 * n);
        mesh_free(&ball);
    }
    return m;
}

static mesh scene_creature(void)
{
    mesh m = make_creature();
    uint64_t rng = 4;
    mesh_jitter(&m, &rng, 0.0625);
    return m;
}

static mesh scene_random(void)
{
    mesh m = {0};
    uint64_t rng = 5;
    uint32_t k;
    for (k = 0; k < 8; k++) {
        mesh part = make_random_spindle(&rng, 10 * k, 9);
        mesh_jitter(&part, &rng, 0.0625);
        mesh_append(&m, &part, 4.0 * k);
        mesh_free(&part);
    }
    return m;
}

static mesh scene_blends(void)
{
    mesh m = make_creature();
    uint64_t rng = 6;
    mesh_random_tags(&m, &rng, 0);
    return m;
}

static mesh scene_open(void)
{
    mesh m = make_holed_grid();
    uint64_t rng = 7;
    uint32_t n;
    for (n = 3; n <= 9; n++) {
        mesh dome = make_dome(n, n % 4 + 1);
        mesh_corner(&dome, n);
        mesh_take(&m, dome, 4.0 * n);
        mesh_take(&m, with_holes(make_random_spindle(&rng, 30, 9), &rng, n), 4.0 * n + 32);
    }
    mesh_jitter(&m, &rng, 0.03125);
    return m;
}

/* Creases, darts, corners and wide wedges, with blend ratios for the edge ends. */
static mesh scene_hard(void)
{
    uint64_t rng = 8;
    mesh m = with_hard(make_creature(), &rng, 20);
    uint32_t n;
    for (n = 3; n <= 8; n++) {
        mesh torus = make_torus(n + 2, 7);
        mesh_split_quads(&torus, &rng, 40);
        mesh_take(&m, with_hard(torus, &rng, 5 * n), 10.0 * n);
    }
    mesh_take(&m, with_hard(make_holed_grid(), &rng, 25), 100);
    mesh_jitter(&m, &rng, 0.03125);
    mesh_random_tags(&m, &rng, 32);
    return m;
}

/* Faces split by their size, at a vertex of two edges, alone on their side of a crease. */
static mesh scene_split(void)
{
    mesh m = make_marked();
    uint32_t n;
    for (n = 6; n <= 12; n++) mesh_take(&m, make_cylinder(n, 1 + n % 3), 4.0 * n + 40);
    return m;
}

/* Every kind of patch once or a few times, to be cut fine. */
static mesh scene_fine(void)
{
    mesh m = make_latlong(5, 2);
    uint64_t rng = 9;
    uint32_t n;
    for (n = 3; n <= 6; n++) mesh_take(&m, make_cylinder(n, 1), 4.0 * n);
    mesh_jitter(&m, &rng, 0.0625);
    return m;
}

/* For the point-normal schemes: faces of 3 to 8 corners, boundaries, hard edges. */
static mesh scene_faces(void)
{
    uint64_t rng = 10;
    mesh m = with_hard(make_torus(5, 4), &rng, 12);
    uint32_t n;
    for (n = 5; n <= 8; n++) mesh_take(&m, make_cylinder(n, 1), 4.0 * n);
    mesh_take(&m, make_triangle_ball(5), 60);
    mesh_jitter(&m, &rng, 0.03125);
    return m;
}

enum { CLOSED_SCENES = 7, PM_SCENES = 11 };     /* first: of 3 to 5 corners a face, not marked */
typedef struct hash_case {
    const char *name;
    mesh (*make)(void);
    uint32_t finest;
    psurf_scheme scheme;
    psurf_normal_mode normals;
    psurf_variant variant;
    psurf_shading shading;
    uint32_t flags;
} hash_case;
#define PM_CASE(name, finest)                                                                      \
    {#name, scene_##name, finest, PSURF_PM, PSURF_NORMALS_AVERAGE, PSURF_N_G1,                     \
     PSURF_SHADE_LINEAR, 0}
#define CASE(name, scheme, normals, variant, shading, flags)                                       \
    {name, scene_faces, 9, PSURF_##scheme, PSURF_NORMALS_##normals, PSURF_N_##variant,            \
     PSURF_SHADE_##shading, flags}
static const hash_case scenes[] = {
    PM_CASE(dodecahedron, 8), PM_CASE(torus, 8), PM_CASE(poles, 8), PM_CASE(triangles, 8),
    PM_CASE(creature, 8), PM_CASE(random, 8), PM_CASE(blends, 8), PM_CASE(open, 8),
    PM_CASE(hard, 8), PM_CASE(split, 8), PM_CASE(fine, 75),
    CASE("pn", PN, AVERAGE, G1, LINEAR, 0),
    CASE("pn_coons", PN, LIMIT, G1, LINEAR, PSURF_COONS),
    CASE("smoothed_g1", SMOOTHED_N, AVERAGE, G1, QUADRATIC, 0),
    CASE("smoothed_final", SMOOTHED_N, AREA, FINAL, LINEAR, PSURF_FOLDS | PSURF_NEARLY_FLAT),
    CASE("smoothed_first", SMOOTHED_N, AVERAGE, INTERMEDIATE, EXACT, 0),
    CASE("hybrid", HYBRID, AVERAGE, G1, LINEAR, 0),
    CASE("hybrid_plane", HYBRID, AREA, G1, LINEAR, PSURF_PLANE_NORMALS),
    CASE("png1", PNG1, AVERAGE, G1, LINEAR, 0),
    CASE("wm", CUBIC_WM_B1, AVERAGE, G1, LINEAR, 0),
    CASE("cubic_pn_b1", CUBIC_PN_B1, LIMIT, G1, LINEAR, 0),
    CASE("cubic_wm_b2", CUBIC_WM_B2, AVERAGE, G1, LINEAR, 0),
    CASE("mixed", MIXED, AVERAGE, G1, LINEAR, 0)
};

static void build_case(surface *s, const hash_case *c, const mesh *m)
{
    static const unsigned char mix[3] = {PSURF_PN, PSURF_SMOOTHED_N, PSURF_CUBIC_PN_B1};
    unsigned char *schemes = (unsigned char *)grab(m->face_count, 1);
    uint32_t f;
    for (f = 0; f < m->face_count; f++) schemes[f] = mix[f % 3];
    surface_describe(s, m);
    s->scheme = c->scheme;
    s->desc.split = psurf_scheme_split(c->scheme);
    s->desc.face_schemes = c->scheme == PSURF_MIXED ? schemes : NULL;
    s->construct.normal_mode = c->normals;
    s->construct.variant = c->variant;
    s->construct.shading = c->shading;
    s->construct.flags = c->flags;
    surface_make(s);
    free(schemes);
}

static uint64_t hash_scene(uint32_t i, uint32_t step)
{
    mesh m = scenes[i].make();
    surface s;
    uint64_t hash;
    build_case(&s, &scenes[i], &m);
    hash = hash_surface(&s, &m, scenes[i].finest, step);
    surface_free(&s);
    mesh_free(&m);
    return hash;
}

static void hash_text(char *text, size_t size, uint64_t hash)
{
    snprintf(text, size, "%08lx%08lx", (unsigned long)(hash >> 32),
             (unsigned long)(hash & 0xFFFFFFFFu));
}

/* The hash on file; 0 and "missing" where there is none. */
static int stored_hash(const char *scene, char *text)
{
    char path[256], name[64];
    int found = 0;
    FILE *file;
    snprintf(path, sizeof path, "%s/%s.txt", PSURF_TEST_DATA,
             IS_DOUBLE ? "hashes_double" : "hashes");
    file = fopen(path, "r");
    while (file && !found && fscanf(file, "%63s %16s", name, text) == 2)
        found = !strcmp(name, scene);
    if (file) fclose(file);
    if (!found) snprintf(text, 20, "missing");
    return found;
}

/* Hashes every scene, in whole and in ranges; returns how many are not what they should be. */
static int compare_scenes(int print_only)
{
    static const uint32_t steps[] = {PSURF_NONE / 2, 1, 7};
    uint32_t i, k;
    int wrong = 0;
    for (i = 0; i < COUNT_OF(scenes); i++) {
        char ours[20], stored[20];
        uint64_t hash = hash_scene(i, steps[0]);
        hash_text(ours, sizeof ours, hash);
        printf("%s %s\n", scenes[i].name, ours);
        for (k = i < PM_SCENES ? 1 : 2; k < COUNT_OF(steps); k++)
            if (hash_scene(i, steps[k]) != hash) {
                fprintf(stderr, "%s: other bits in ranges of %u\n", scenes[i].name,
                        (unsigned)steps[k]);
                wrong++;
            }
        if (!print_only && (!stored_hash(scenes[i].name, stored) || strcmp(ours, stored))) {
            fprintf(stderr, "%s: %s expected\n", scenes[i].name, stored);
            wrong++;
        }
    }
    return wrong;
}

static void test_scenes(void **state)
{
    (void)state;
    assert_int_equal(psurf_exact(), 1);
    assert_int_equal(compare_scenes(0), 0);
}

/* The scenes together have every kind of patch, blend ratios, and everything that marks make. */
static void test_scenes_cover(void **state)
{
    uint32_t i, k, faces[PSURF_KIND_COUNT] = {0}, tags = 0, boundary = 0, hard = 0, split = 0;
    uint32_t wide = 0;
    (void)state;
    for (i = PM_SCENES; i < COUNT_OF(scenes); i++) {
        mesh m = scenes[i].make();
        surface s;
        build_case(&s, &scenes[i], &m);
        for (k = PM_KINDS; k < PSURF_KIND_COUNT; k++) faces[k] += s.patches.layout.kind[k].count;
        surface_free(&s);
        mesh_free(&m);
    }
    for (i = 0; i < PM_SCENES; i++) {
        mesh m = scenes[i].make();
        surface s;
        assert_true(i >= CLOSED_SCENES || mesh_is_valid(&m));
        for (k = 0; k < m.vertex_count; k++) {          /* positions are exact in float too */
            const vec p = m.positions[k];
            assert_true((double)(float)p.x == p.x && (double)(float)p.y == p.y
                        && (double)(float)p.z == p.z);
        }
        surface_build(&s, &m);
        for (k = 0; k < PM_KINDS; k++) faces[k] += s.info.kind_faces[k];
        boundary += s.info.boundary_edges;
        hard += s.info.hard_edges;
        split += s.info.ngon_faces;
        for (k = 0; k < s.info.rings; k++)
            wide += (((const psurf_ring *)s.tables.rings.data)[k].valence & PSURF_RING_WIDE) != 0;
        for (k = 0; k < m.tag_count; k++) tags += (m.tags[k].flags & PSURF_BLEND) != 0;
        surface_free(&s);
        mesh_free(&m);
    }
    for (k = 0; k < PSURF_KIND_COUNT; k++) assert_true(faces[k] >= 30);
    assert_true(tags > 20 && boundary > 100 && hard > 100 && split > 20 && wide > 10);
}

/* One bit of one control point: another hash, and psurf_check reports a crack. */
static void test_one_bit(void **state)
{
    mesh m = scene_creature();
    surface s;
    uint64_t hash;
    uint32_t i;
    psurf_check_result r;
    (void)state;
    surface_build(&s, &m);
    hash = hash_patches(0, &s);
    for (i = 0; i < s.info.facets; i++) {
        psurf_patch patch = psurf_get_patch(&s.patches, i);
        size_t at = (size_t)((const char *)(const void *)patch.points - s.memory);
        unsigned char *real = (unsigned char *)s.memory + at;
        const uint32_t one = 1;
        unsigned char *low = real + (*(const unsigned char *)&one ? 0 : sizeof(psurf_real) - 1);
        *low ^= 1;
        assert_true(hash_patches(0, &s) != hash);
        assert_int_equal(psurf_check(&s.patches, &s.construct, 3, 0, PSURF_NONE, &r), PSURF_OK);
        assert_true(r.cracks > 0);
        *low ^= 1;
    }
    assert_true(hash_patches(0, &s) == hash);
    assert_int_equal(psurf_check(&s.patches, &s.construct, 3, 0, PSURF_NONE, &r), PSURF_OK);
    assert_int_equal(r.cracks, 0);
    surface_free(&s);
    mesh_free(&m);
}

/* The instruction set that the compiler, its flags and the processor let the library use. */
static const char *expected_set(void)
{
#if defined(PSURF_NO_SIMD)
    return "scalar";
#elif defined(__SSE2__)
#ifndef PSURF_NO_AVX2
    if (!IS_DOUBLE && __builtin_cpu_supports("avx2")) return "avx2";
#endif
    return IS_DOUBLE ? "scalar" : "sse2";
#elif defined(__aarch64__)
    return IS_DOUBLE ? "scalar" : "neon";
#else
    return "scalar";
#endif
}

static void test_set_in_use(void **state)
{
    (void)state;
    assert_string_equal(psurf_simd_name(), expected_set());
}

int main(int argc, char **argv)
{
    const struct CMUnitTest tests[] = {cmocka_unit_test(test_set_in_use),
                                       cmocka_unit_test(test_scenes),
                                       cmocka_unit_test(test_scenes_cover),
                                       cmocka_unit_test(test_one_bit)};
    if (argc > 1 && !strcmp(argv[1], "--print")) return compare_scenes(1) != 0;
    if (argc > 2 && !strcmp(argv[1], "--set")) {
        if (!strcmp(argv[2], psurf_simd_name())) return compare_scenes(0) != 0;
        printf("%s is in use here, not %s\n", psurf_simd_name(), argv[2]);
        return 77;
    }
    return cmocka_run_group_tests_name("hash", tests, NULL, NULL);
}
