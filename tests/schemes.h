/* What the tests of the point-normal schemes share: the schemes with their options, meshes with
   normals, the pieces of faces that are split, samples on them, files of the reference. */
#ifndef PSURF_TESTS_SCHEMES_H
#define PSURF_TESTS_SCHEMES_H

#include "common.h"

/* ---- schemes --------------------------------------------------------------------------------- */

typedef struct style {
    const char *name;
    psurf_scheme scheme;
    psurf_variant variant;
    psurf_shading shading;
    uint32_t flags;
    double sigma;
} style;

enum {
    PN, PN_COONS, N_G1, N_FINAL, N_FOLDS, N_BETWEEN, HYBRID, HYBRID_NORMALS, PNG1, WM, PN_B1, WM_B2,
    PN_B2, STYLES
};
static const UNUSED style styles[STYLES] = {
    {"pn", PSURF_PN, PSURF_N_G1, PSURF_SHADE_LINEAR, 0, 0},
    {"pn_coons", PSURF_PN, PSURF_N_G1, PSURF_SHADE_LINEAR, PSURF_COONS | PSURF_SIGMA, 0.25},
    {"n_g1", PSURF_SMOOTHED_N, PSURF_N_G1, PSURF_SHADE_LINEAR, 0, 0},
    {"n_final", PSURF_SMOOTHED_N, PSURF_N_FINAL, PSURF_SHADE_QUADRATIC, 0, 0},
    {"n_folds", PSURF_SMOOTHED_N, PSURF_N_FINAL, PSURF_SHADE_EXACT,
     PSURF_FOLDS | PSURF_NEARLY_FLAT, 0},
    {"n_intermediate", PSURF_SMOOTHED_N, PSURF_N_INTERMEDIATE, PSURF_SHADE_QUADRATIC,
     PSURF_SIGMA, 1},
    {"hybrid", PSURF_HYBRID, PSURF_N_G1, PSURF_SHADE_LINEAR, 0, 0},
    {"hybrid_normals", PSURF_HYBRID, PSURF_N_G1, PSURF_SHADE_LINEAR, PSURF_PLANE_NORMALS, 0},
    {"png1", PSURF_PNG1, PSURF_N_G1, PSURF_SHADE_LINEAR, 0, 0},
    {"wm", PSURF_WM, PSURF_N_G1, PSURF_SHADE_LINEAR, 0, 0},
    {"cubic_pn_b1", PSURF_CUBIC_PN_B1, PSURF_N_G1, PSURF_SHADE_LINEAR, 0, 0},
    {"cubic_wm_b2", PSURF_CUBIC_WM_B2, PSURF_N_G1, PSURF_SHADE_LINEAR, 0, 0},
    {"cubic_pn_b2", PSURF_CUBIC_PN_B2, PSURF_N_G1, PSURF_SHADE_LINEAR, 0, 0}};

/* Float alone, and without sanitizers, goes through everything; else some of it: time. */
static UNUSED int is_thorough(void)
{
#if defined(__SANITIZE_ADDRESS__)
    return 0;
#elif defined(__has_feature)
#if __has_feature(address_sanitizer) || __has_feature(memory_sanitizer)
    return 0;
#endif
#endif
    return !IS_DOUBLE;
}

/* ---- meshes with normals --------------------------------------------------------------------- */

typedef struct scene {
    mesh m;
    vec *normals;                       /* NULL: computed */
    uint32_t normal_count;
    uint32_t *corners;                  /* normal of every face corner; NULL: that of its vertex */
    unsigned char *schemes;             /* of every face, or NULL */
} scene;

/* Consumes the mesh. */
static UNUSED scene make_scene(mesh m)
{
    scene c;
    memset(&c, 0, sizeof c);
    c.m = m;
    return c;
}

static UNUSED void scene_free(scene *c)
{
    mesh_free(&c->m);
    free(c->normals);
    free(c->corners);
    free(c->schemes);
    memset(c, 0, sizeof *c);
}

static UNUSED uint32_t corner_count(const mesh *m)
{
    uint32_t f, n = 0;
    for (f = 0; f < m->face_count; f++) n += m->faces[f].size;
    return n;
}

/* Number of a face's corner 0 in all corners. */
static UNUSED uint32_t first_corner_of(const mesh *m, uint32_t face)
{
    uint32_t f, n = 0;
    for (f = 0; f < face; f++) n += m->faces[f].size;
    return n;
}

/* Unit normal of a polygon, by Newell's rule. */
static UNUSED vec face_normal(const mesh *m, uint32_t face)
{
    const mesh_face_data *f = &m->faces[face];
    vec n = make_vec(0, 0, 0);
    uint32_t k;
    for (k = 0; k < f->size; k++)
        n = add(n, cross(m->positions[f->v[k]], m->positions[f->v[(k + 1) % f->size]]));
    return unit(n);
}

/* Normals of the vertices: mean of the polygons' around, with noise. */
static UNUSED void scene_vertex_normals(scene *c, uint64_t *rng, double noise)
{
    const mesh *m = &c->m;
    uint32_t f, k;
    c->normal_count = m->vertex_count;
    c->normals = (vec *)grab(m->vertex_count, sizeof(vec));
    for (f = 0; f < m->face_count; f++)
        for (k = 0; k < m->faces[f].size; k++) {
            vec *n = &c->normals[m->faces[f].v[k]];
            *n = add(*n, face_normal(m, f));
        }
    for (k = 0; k < m->vertex_count; k++) {
        vec jitter = sub(random_vec(rng), make_vec(0.5, 0.5, 0.5));
        c->normals[k] = unit(mad(unit(c->normals[k]), noise, jitter));
    }
}

/* Each face its own normal at all its corners: every edge is hard. */
static UNUSED void scene_flat_normals(scene *c)
{
    const mesh *m = &c->m;
    uint32_t f, k, n = 0;
    c->normal_count = m->face_count;
    c->normals = (vec *)grab(m->face_count, sizeof(vec));
    c->corners = (uint32_t *)grab(corner_count(m), sizeof(uint32_t));
    for (f = 0; f < m->face_count; f++) {
        c->normals[f] = face_normal(m, f);
        for (k = 0; k < m->faces[f].size; k++) c->corners[n++] = f;
    }
}

/* On top of vertex normals: about percent of the corners get one of their own, that of the face
   with some noise. Ends of edges become hard, on one end alone as well. */
static UNUSED void scene_split_normals(scene *c, uint64_t *rng, uint32_t percent)
{
    const mesh *m = &c->m;
    const uint32_t corners = corner_count(m);
    vec *normals = (vec *)grab(m->vertex_count + corners, sizeof(vec));
    uint32_t f, k, n = 0;
    memcpy(normals, c->normals, m->vertex_count * sizeof(vec));
    free(c->normals);
    c->normals = normals;
    c->corners = (uint32_t *)grab(corners, sizeof(uint32_t));
    for (f = 0; f < m->face_count; f++)
        for (k = 0; k < m->faces[f].size; k++, n++) {
            vec jitter = sub(random_vec(rng), make_vec(0.5, 0.5, 0.5));
            c->corners[n] = m->faces[f].v[k];
            if (random_below(rng, 100) >= percent) continue;
            normals[c->normal_count] = unit(mad(face_normal(m, f), 0.5, jitter));
            c->corners[n] = c->normal_count++;
        }
}

/* On top of vertex normals: about percent of the corners get the vertex's turned by up to so many
   degrees, so that some differ from their neighbours' by less than the degree that makes an edge
   hard, some by more. */
static UNUSED void scene_turn_normals(scene *c, uint64_t *rng, uint32_t percent, double degrees)
{
    const mesh *m = &c->m;
    const uint32_t corners = corner_count(m);
    vec *normals = (vec *)grab((size_t)m->vertex_count + corners, sizeof(vec));
    uint32_t f, k, n = 0;
    memcpy(normals, c->normals, m->vertex_count * sizeof(vec));
    free(c->normals);
    c->normals = normals;
    c->corners = (uint32_t *)grab(corners, sizeof(uint32_t));
    for (f = 0; f < m->face_count; f++)
        for (k = 0; k < m->faces[f].size; k++, n++) {
            const vec own = c->normals[m->faces[f].v[k]];
            vec aside = sub(random_vec(rng), make_vec(0.5, 0.5, 0.5));
            const double angle = degrees * random_unit(rng) * PI / 180;
            c->corners[n] = m->faces[f].v[k];
            if (random_below(rng, 100) >= percent) continue;
            aside = unit(mad(aside, -dot(aside, own), own));
            normals[c->normal_count] = mad(mul(cos(angle), own), sin(angle), aside);
            c->corners[n] = c->normal_count++;
        }
}

/* Normals that have the same bits under every compiler: sums of products of positions, which are
   exact, with noise in multiples of 2^-16; not of unit length. Some corners have their own. */
static UNUSED void scene_exact_normals(scene *c, uint64_t *rng, uint32_t percent)
{
    const mesh *m = &c->m;
    const uint32_t corners = corner_count(m);
    uint32_t f, k, n = 0;
    c->normal_count = m->vertex_count;
    c->normals = (vec *)grab((size_t)m->vertex_count + corners, sizeof(vec));
    c->corners = (uint32_t *)grab(corners, sizeof(uint32_t));
    for (f = 0; f < m->face_count; f++) {
        const mesh_face_data *face = &m->faces[f];
        vec sum = make_vec(0, 0, 0);
        for (k = 0; k < face->size; k++) {              /* differences: no long products */
            const vec p = m->positions[face->v[0]];
            sum = add(sum, cross(sub(m->positions[face->v[k]], p),
                                 sub(m->positions[face->v[(k + 1) % face->size]], p)));
        }
        for (k = 0; k < face->size; k++, n++) {
            vec noise = make_vec(0, 0, 0), *own = &c->normals[face->v[k]];
            noise.x = ((double)random_below(rng, 16384) - 8192) / 65536.0;
            noise.y = ((double)random_below(rng, 16384) - 8192) / 65536.0;
            noise.z = ((double)random_below(rng, 16384) - 8192) / 65536.0;
            *own = add(*own, sum);
            c->corners[n] = face->v[k];
            if (random_below(rng, 100) >= percent) continue;
            c->normals[c->normal_count] = add(sum, noise);
            c->corners[n] = c->normal_count++;
        }
    }
}

/* Describes a scene to the library, in a style; calls nothing. */
static UNUSED void scene_describe(surface *s, const scene *c, const style *y,
                                  psurf_normal_mode mode)
{
    uint32_t i, j;
    surface_describe(s, &c->m);
    s->scheme = c->schemes ? PSURF_MIXED : y->scheme;
    s->desc.split = psurf_scheme_split(s->scheme);
    s->desc.face_schemes = c->schemes;
    if (c->corners) {
        s->desc.face_normals = c->corners;
        s->desc.normal_count = c->normal_count;
    }
    if (c->normals) {
        s->normals = (psurf_real *)grab((size_t)c->normal_count * 3, sizeof(psurf_real));
        for (i = 0; i < c->normal_count; i++) {
            const double n[3] = {c->normals[i].x, c->normals[i].y, c->normals[i].z};
            for (j = 0; j < 3; j++) s->normals[3 * i + j] = (psurf_real)n[j];
        }
        s->construct.normals = s->normals;
    }
    s->construct.normal_mode = mode;
    s->construct.variant = y->variant;
    s->construct.shading = y->shading;
    s->construct.flags = y->flags;
    s->construct.sigma = (psurf_real)y->sigma;
}

static UNUSED void scene_build(surface *s, const scene *c, const style *y, psurf_normal_mode mode)
{
    scene_describe(s, c, y, mode);
    surface_make(s);
}

/* Another style of the same scheme on the same memory. */
static UNUSED void scene_restyle(surface *s, const style *y, psurf_normal_mode mode)
{
    s->construct.normal_mode = mode;
    s->construct.variant = y->variant;
    s->construct.shading = y->shading;
    s->construct.flags = y->flags;
    s->construct.sigma = (psurf_real)y->sigma;
    REQUIRE(psurf_construct(&s->patches, &s->construct) == PSURF_OK, "construct\n");
}

/* ---- shapes that the formulas were measured on ----------------------------------------------- */

static UNUSED uint32_t middle_vertex(mesh *m, uint32_t a, uint32_t b)
{
    const vec p = unit(add(m->positions[a], m->positions[b]));
    uint32_t i;
    for (i = 0; i < m->vertex_count; i++)
        if (distance(m->positions[i], p) < 1e-9) return i;
    return mesh_point(m, p);
}

/* Icosahedron on the unit sphere, each triangle cut into four some times; normals = positions. */
static UNUSED scene make_sphere(uint32_t steps)
{
    const double golden = (1 + sqrt(5.0)) / 2;
    mesh m = {0};
    uint32_t i, j, k;
    scene c;
    for (i = 0; i < 12; i++) {
        double a = i & 1 ? 1 : -1, b = i & 2 ? golden : -golden;
        mesh_point(&m, unit(i < 4 ? make_vec(0, a, b) : i < 8 ? make_vec(a, b, 0)
                                                              : make_vec(b, 0, a)));
    }
    for (i = 0; i < 12; i++)
        for (j = i + 1; j < 12; j++)
            for (k = j + 1; k < 12; k++) {
                vec p = m.positions[i], q = m.positions[j], r = m.positions[k];
                if (distance(p, q) > 1.1 || distance(q, r) > 1.1 || distance(r, p) > 1.1) continue;
                if (dot(cross(sub(q, p), sub(r, p)), p) > 0) mesh_tri(&m, i, j, k);
                else mesh_tri(&m, i, k, j);
            }
    while (steps--) {
        const uint32_t count = m.face_count;
        for (i = 0; i < count; i++) {
            uint32_t v[3], e[3];
            memcpy(v, m.faces[i].v, sizeof v);
            for (k = 0; k < 3; k++) e[k] = middle_vertex(&m, v[k], v[(k + 1) % 3]);
            memcpy(m.faces[i].v, e, sizeof e);
            for (k = 0; k < 3; k++) mesh_tri(&m, v[k], e[k], e[(k + 2) % 3]);
        }
    }
    c = make_scene(m);
    c.normal_count = c.m.vertex_count;
    c.normals = (vec *)grab(c.m.vertex_count, sizeof(vec));
    memcpy(c.normals, c.m.positions, c.m.vertex_count * sizeof(vec));
    return c;
}

/* Radii 1 and 1/2, n by n quads cut by one diagonal, the tube's angle from the inner equator on;
   normals are left to the library: the mean of six. */
static UNUSED scene make_tube(uint32_t n)
{
    mesh m = {0};
    uint32_t i, j;
    for (i = 0; i < n; i++)
        for (j = 0; j < n; j++) {
            double a = 2 * PI * i / n, b = PI + 2 * PI * j / n, r = 1 + 0.5 * cos(b);
            mesh_point(&m, make_vec(r * cos(a), r * sin(a), 0.5 * sin(b)));
        }
    for (i = 0; i < n; i++)
        for (j = 0; j < n; j++) {
            uint32_t a = i * n + j, b = (i + 1) % n * n + j, c = (i + 1) % n * n + (j + 1) % n;
            mesh_tri(&m, a, b, c);
            mesh_tri(&m, a, c, i * n + (j + 1) % n);
        }
    return make_scene(m);
}

/* An octahedron cut once into 32 triangles, its vertices and radial normals shaken. */
static UNUSED scene make_noisy_octahedron(uint64_t *rng)
{
    mesh m = make_latlong(4, 1);
    uint32_t i, k, count = m.face_count;
    scene c;
    for (i = 0; i < m.vertex_count; i++) m.positions[i] = unit(m.positions[i]);
    for (i = 0; i < count; i++) {
        uint32_t v[3], e[3];
        memcpy(v, m.faces[i].v, sizeof v);
        for (k = 0; k < 3; k++) e[k] = middle_vertex(&m, v[k], v[(k + 1) % 3]);
        memcpy(m.faces[i].v, e, sizeof e);
        for (k = 0; k < 3; k++) mesh_tri(&m, v[k], e[k], e[(k + 2) % 3]);
    }
    c = make_scene(m);
    c.normal_count = c.m.vertex_count;
    c.normals = (vec *)grab(c.m.vertex_count, sizeof(vec));
    for (i = 0; i < c.m.vertex_count; i++) {
        vec noise = sub(random_vec(rng), make_vec(0.5, 0.5, 0.5));
        c.normals[i] = unit(mad(c.m.positions[i], 0.2, noise));
        noise = sub(random_vec(rng), make_vec(0.5, 0.5, 0.5));
        c.m.positions[i] = mad(c.m.positions[i], 0.2, noise);
    }
    return c;
}

/* A tube of n sides round the z axis with hard caps, a fan of triangles each; the side has the
   normals of a cylinder. quads: the side's; cap: one n-gon instead of a fan. */
static UNUSED scene make_can(uint32_t n, uint32_t bands, int quads, int polygons)
{
    mesh m = {0};
    scene c;
    uint32_t r, k, corner = 0, v[MESH_MAX_CORNERS] = {0}, cap;
    for (r = 0; r <= bands; r++)
        for (k = 0; k < n; k++) {
            double a = 2 * PI * k / n;
            mesh_point(&m, make_vec(cos(a), sin(a), 2.0 * r / bands - 1));
        }
    for (r = 0; r < bands; r++)
        for (k = 0; k < n; k++) {
            uint32_t a = r * n + k, b = r * n + (k + 1) % n;
            if (quads) mesh_quad(&m, a, b, b + n, a + n);
            else mesh_tri(&m, a, b, b + n), mesh_tri(&m, a, b + n, a + n);
        }
    for (cap = 0; cap < 2; cap++) {
        const uint32_t base = cap ? bands * n : 0;
        uint32_t middle = polygons ? 0 : mesh_point(&m, make_vec(0, 0, cap ? 1 : -1));
        for (k = 0; k < n; k++) {
            uint32_t a = base + k, b = base + (k + 1) % n;
            v[cap ? k : n - 1 - k] = a;
            if (!polygons) mesh_tri(&m, middle, cap ? a : b, cap ? b : a);
        }
        if (polygons) mesh_face(&m, n, v);
    }
    c = make_scene(m);
    c.normal_count = n + 2;
    c.normals = (vec *)grab(n + 2, sizeof(vec));
    for (k = 0; k < n; k++) c.normals[k] = make_vec(cos(2 * PI * k / n), sin(2 * PI * k / n), 0);
    c.normals[n] = make_vec(0, 0, -1), c.normals[n + 1] = make_vec(0, 0, 1);
    c.corners = (uint32_t *)grab(corner_count(&c.m), sizeof(uint32_t));
    for (r = 0; r < c.m.face_count; r++)
        for (k = 0; k < c.m.faces[r].size; k++) {
            const uint32_t side = (quads ? 1 : 2) * n * bands;
            c.corners[corner++] = r < side ? c.m.faces[r].v[k] % n
                                           : n + (c.m.positions[c.m.faces[r].v[0]].z > 0);
        }
    return c;
}

/* ---- pieces of split faces, by the rule in the header ---------------------------------------- */

/* The corner of the lowest vertex: fans begin there. */
static UNUSED uint32_t apex_of(const mesh_face_data *f)
{
    uint32_t k, apex = 0;
    for (k = 1; k < f->size; k++)
        if (f->v[k] < f->v[apex]) apex = k;
    return apex;
}

static UNUSED uint32_t pieces_of(psurf_split split, uint32_t size)
{
    return split == PSURF_SPLIT_PN ? size < 5 ? 1 : (size - 1) / 2 : size - 2;
}

/* The corners of a piece; returns how many. A face that is not split is its own piece, from its
   corner 0 on. */
static UNUSED uint32_t piece_corners(psurf_split split, const mesh_face_data *f, uint32_t piece,
                                     uint32_t corners[4])
{
    const uint32_t n = f->size, whole = pieces_of(split, n) == 1, a = whole ? 0 : apex_of(f);
    const uint32_t step = split == PSURF_SPLIT_PN && !whole ? 2 : 1;
    const uint32_t count = whole ? n : step == 2 && 2 * piece + 3 < n ? 4 : 3;
    uint32_t k;
    corners[0] = a;
    for (k = 1; k < count; k++) corners[k] = (a + step * piece + k) % n;
    return count;
}

/* Parameters of a corner of a piece, in the piece: of a triangle or a quad. */
static UNUSED void corner_place(uint32_t count, uint32_t corner, double *u, double *v)
{
    *u = corner == 1 || (count == 4 && corner == 2);
    *v = corner == 2 || corner == 3;
}

/* A place of a piece as the library takes it. Only the triangles of a split quad have parameters
   that are not their own: those of the quad. */
static UNUSED psurf_sample piece_sample(psurf_split split, const mesh *m, uint32_t face,
                                        uint32_t piece, double u, double v)
{
    static const double square[4][2] = {{0, 0}, {1, 0}, {1, 1}, {0, 1}};
    const mesh_face_data *f = &m->faces[face];
    uint32_t c[4];
    if (f->size != 4 || pieces_of(split, 4) == 1) return make_sample(face, piece, u, v);
    piece_corners(split, f, piece, c);
    return make_sample(face, 0,
                       (1 - u - v) * square[c[0]][0] + u * square[c[1]][0] + v * square[c[2]][0],
                       (1 - u - v) * square[c[0]][1] + u * square[c[1]][1] + v * square[c[2]][1]);
}

/* On edge i of a face, s of the way; s and 1-s exact from the two sides of an edge. */
static UNUSED psurf_sample side_sample(psurf_split split, const mesh *m, uint32_t face, uint32_t i,
                                       double s)
{
    const mesh_face_data *f = &m->faces[face];
    uint32_t piece, k, c[4], count;
    if (f->size < 5) return edge_sample(face, f->size, i, s);
    for (piece = 0; piece < pieces_of(split, f->size); piece++) {
        count = piece_corners(split, f, piece, c);
        for (k = 0; k < count; k++)
            if (c[k] == i && c[(k + 1) % count] == (i + 1) % f->size) {
                psurf_sample at = edge_sample(face, count, k, s);
                at.sector = piece;
                return at;
            }
    }
    REQUIRE(0, "face %u has no edge %u\n", (unsigned)face, (unsigned)i);
    return make_sample(0, 0, 0, 0);
}

/* The patch of a piece; kinds stand apart, so the pieces of a face need not follow each other. */
static UNUSED psurf_patch find_patch(const surface *s, uint32_t face, uint32_t piece)
{
    psurf_patch patch;
    uint32_t i;
    for (i = 0; i < s->info.facets; i++) {
        patch = psurf_get_patch(&s->patches, i);
        if (patch.face == face && patch.sector == piece) return patch;
    }
    REQUIRE(0, "face %u has no piece %u\n", (unsigned)face, (unsigned)piece);
    return patch;
}

/* ---- points ---------------------------------------------------------------------------------- */

static UNUSED vec shade_at(const psurf_patches *patches, psurf_sample sample)
{
    psurf_real r[3] = {0, 0, 0};
    psurf_points out;
    memset(&out, 0, sizeof out);
    out.shade = r;
    psurf_eval(patches, &sample, 1, &out);
    return load(r);
}

/* Angle between tangent planes, whichever way their normals point; radians. */
static UNUSED double plane_angle(vec a, vec b)
{
    return atan2(length(cross(a, b)), fabs(dot(a, b)));
}

#define DEGREES(radians) ((radians) * 180 / PI)

/* Angles between the tangent planes from the two sides of edges, in degrees. */
typedef struct kinks {
    double worst, sum;
    uint32_t pairs, edges;
    uint32_t worst_from, worst_to;
    double worst_at;
} kinks;

/* Positions or normals of many samples at once: the library works on eight at a time. */
enum { MAX_BATCH = 256 };
static UNUSED void eval_many(const psurf_patches *patches, const psurf_sample *samples,
                             uint32_t count, vec *p, vec *n)
{
    psurf_real points[MAX_BATCH][3], normals[MAX_BATCH][3];
    psurf_points out;
    uint32_t i;
    assert_true(count <= MAX_BATCH);
    memset(&out, 0, sizeof out);
    if (p) out.p = points[0];
    if (n) out.n = normals[0];
    psurf_eval(patches, samples, count, &out);
    for (i = 0; i < count; i++) {
        if (p) p[i] = load(points[i]);
        if (n) n[i] = load(normals[i]);
    }
}

/* The normal that a face's corner names. */
static UNUSED uint32_t normal_of(const scene *c, uint32_t face, uint32_t corner)
{
    const uint32_t size = c->m.faces[face].size;
    if (!c->corners) return c->m.faces[face].v[corner % size];
    return c->corners[first_corner_of(&c->m, face) + corner % size];
}

/* Whether the two sides of an edge name different normals at an end. */
static UNUSED int sides_differ(const scene *c, const half_edge *a, const half_edge *b)
{
    return normal_of(c, a->face, a->corner) != normal_of(c, b->face, b->corner + 1)
           || normal_of(c, a->face, a->corner + 1) != normal_of(c, b->face, b->corner);
}

/* At count places from first to last on every edge of two faces that is not hard nor left out. */
typedef int edge_test(const scene *c, const half_edge *a, const half_edge *b);
static UNUSED void measure_kinks(kinks *r, const surface *s, const scene *c, double first,
                                 double last, uint32_t count, edge_test *leave_out)
{
    const mesh *m = &c->m;
    const double slack = IS_DOUBLE ? 1e-9 : 1e-4;
    psurf_sample sa[MAX_BATCH], sb[MAX_BATCH];
    vec na[MAX_BATCH], nb[MAX_BATCH];
    edge_map map = map_edges(m);
    uint32_t i, k;
    for (i = 0; i < map.count; i++) {
        const half_edge *a = &map.edges[i], *b = find_edge(&map, a->to, a->from);
        if (!b || a->from > a->to || mesh_is_hard(m, a->from, a->to) || sides_differ(c, a, b)
            || (leave_out && leave_out(c, a, b)))
            continue;
        for (k = 0; k < count; k++) {
            const double t = first + (last - first) * k / (count - 1);
            sa[k] = side_sample(s->desc.split, m, a->face, a->corner, t);
            sb[k] = side_sample(s->desc.split, m, b->face, b->corner, 1 - t);
        }
        eval_many(&s->patches, sa, count, NULL, na);
        eval_many(&s->patches, sb, count, NULL, nb);
        for (k = 0; k < count; k++) {
            const double angle = DEGREES(plane_angle(na[k], nb[k]));
            REQUIRE(fabs(length(na[k]) - 1) < slack && fabs(length(nb[k]) - 1) < slack,
                    "edge %u-%u: not unit length\n", (unsigned)a->from, (unsigned)a->to);
            if (angle > r->worst) {
                r->worst = angle, r->worst_at = first + (last - first) * k / (count - 1);
                r->worst_from = a->from, r->worst_to = a->to;
            }
            r->sum += angle;
            r->pairs++;
        }
        r->edges++;
    }
    free(map.edges);
}

/* ---- files of the reference (tests/data, made by convert.py) --------------------------------- */

typedef struct golden_sample {
    uint32_t face, has_shade, has_gauss;
    double u, v, gauss;
    vec p, n, shade;
} golden_sample;

typedef struct golden_case {
    char name[64];
    scene c;
    uint32_t sample_count;
    golden_sample *samples;
} golden_case;

static UNUSED void golden_free(golden_case *g)
{
    scene_free(&g->c);
    free(g->samples);
}

static UNUSED void golden_word(FILE *file, const char *word)
{
    char text[64];
    REQUIRE(fscanf(file, "%63s", text) == 1 && !strcmp(text, word), "%s expected\n", word);
}

static UNUSED uint32_t golden_count(FILE *file)
{
    unsigned long value = 0;
    REQUIRE(fscanf(file, "%lu", &value) == 1, "count expected\n");
    return (uint32_t)value;
}

static UNUSED double golden_number(FILE *file)
{
    double value = 0;
    REQUIRE(fscanf(file, "%lf", &value) == 1, "number expected\n");
    return value;
}

static UNUSED vec golden_vec(FILE *file)
{
    double x = golden_number(file), y = golden_number(file), z = golden_number(file);
    return make_vec(x, y, z);
}

static UNUSED void golden_read_case(FILE *file, golden_case *g)
{
    uint32_t vertices, faces, i, k, rows, corner = 0;
    memset(g, 0, sizeof *g);
    golden_word(file, "case");
    REQUIRE(fscanf(file, "%63s", g->name) == 1, "name expected\n");
    golden_word(file, "mesh");
    vertices = golden_count(file);
    faces = golden_count(file);
    for (i = 0; i < vertices; i++) mesh_point(&g->c.m, golden_vec(file));
    for (i = 0; i < faces; i++) {
        uint32_t v[MESH_MAX_CORNERS], size = golden_count(file);
        REQUIRE(size <= MESH_MAX_CORNERS, "face %u\n", (unsigned)i);
        for (k = 0; k < size; k++) v[k] = golden_count(file);
        mesh_face(&g->c.m, size, v);
    }
    golden_word(file, "normals");
    g->c.normal_count = golden_count(file);
    g->c.normals = (vec *)grab(g->c.normal_count, sizeof(vec));
    for (i = 0; i < g->c.normal_count; i++) g->c.normals[i] = golden_vec(file);
    golden_word(file, "face_normals");
    rows = golden_count(file);
    if (rows) g->c.corners = (uint32_t *)grab(corner_count(&g->c.m), sizeof(uint32_t));
    for (i = 0; i < rows; i++)
        for (k = 0; k < g->c.m.faces[i].size; k++) g->c.corners[corner++] = golden_count(file);
    golden_word(file, "samples");
    g->sample_count = golden_count(file);
    g->samples = (golden_sample *)grab(g->sample_count, sizeof *g->samples);
    for (i = 0; i < g->sample_count; i++) {
        golden_sample *x = &g->samples[i];
        x->face = golden_count(file);
        x->u = golden_number(file), x->v = golden_number(file);
        x->p = golden_vec(file), x->n = golden_vec(file);
        x->has_shade = golden_count(file);
        if (x->has_shade) x->shade = golden_vec(file);
        x->has_gauss = golden_count(file);
        if (x->has_gauss) x->gauss = golden_number(file);
    }
}

/* The cases of a file; returns how many. */
enum { GOLDEN_MAX_CASES = 4 };
static UNUSED uint32_t golden_load(const char *name, golden_case cases[GOLDEN_MAX_CASES])
{
    char path[256];
    uint32_t count, i;
    FILE *file;
    snprintf(path, sizeof path, "%s/%s.txt", PSURF_TEST_DATA, name);
    file = fopen(path, "r");
    REQUIRE(file, "cannot open %s\n", path);
    golden_word(file, "schemes");
    REQUIRE(fscanf(file, "%*s") == 0, "%s: scheme\n", name);
    golden_word(file, "cases");
    count = golden_count(file);
    REQUIRE(count > 0 && count <= GOLDEN_MAX_CASES, "%s: cases\n", name);
    for (i = 0; i < count; i++) golden_read_case(file, &cases[i]);
    fclose(file);
    return count;
}

/* The mesh and normals of one case, the tetrahedron or the open grid of all triangle schemes. */
static UNUSED scene golden_scene(const char *name)
{
    golden_case cases[GOLDEN_MAX_CASES];
    uint32_t count = golden_load("pn_triangle", cases), i;
    scene c;
    memset(&c, 0, sizeof c);
    for (i = 0; i < count; i++) {
        if (strcmp(cases[i].name, name)) {
            golden_free(&cases[i]);
            continue;
        }
        c = cases[i].c;
        free(cases[i].samples);
    }
    REQUIRE(c.m.face_count > 0, "no case %s\n", name);
    return c;
}

#endif
