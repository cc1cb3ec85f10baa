// Against OpenSubdiv: limit positions of vertices with quads only around them, of boundary, crease
// and corner vertices; positions and normals of ordinary faces whose corners have only quads around
// them. Catmull-Clark, edge-and-corner boundaries, infinitely sharp creases and corners.
//
//     g++ -std=c++14 -O2 -I. tests/osd_limit.cc -o osd_limit -lcmocka -losdCPU
//     ./osd_limit examples/meshes/*.obj
//
// -DPSURF_REAL=double compares to 1e-13 instead of float precision. Ends with 77, saying so, where
// it was compiled without OpenSubdiv's headers (libosd-dev), then without -losdCPU too.
//
// Left out because it is not Catmull-Clark's, by design: vertices where a crease ends in a smooth
// vertex, faces at those and at wide wedges, whatever touches a face that has to be split.
#define PSURF_IMPLEMENTATION
#include "common.h"

#if !__has_include(<opensubdiv/far/primvarRefiner.h>)

int main()
{
    puts("osd_limit: skipped, compiled without OpenSubdiv (libosd-dev)");
    return 77;
}

#else

#include <opensubdiv/far/primvarRefiner.h>
#include <opensubdiv/far/topologyDescriptor.h>
#include <opensubdiv/far/topologyRefinerFactory.h>

#include <memory>
#include <string>
#include <vector>

namespace Osd = OpenSubdiv;
using Refiner = Osd::Far::TopologyRefiner;

static const double tolerance = IS_DOUBLE ? 1e-13 : 1e-6;       // of the mesh's size

struct totals {
    unsigned smooth, boundary, crease, corner, faces, valences[16];
    double position, normal;
};

// A point as OpenSubdiv's refiner takes it.
struct primvar {
    double p[3];
    void Clear() { p[0] = p[1] = p[2] = 0; }
    void AddWithWeight(const primvar &other, double w)
    {
        for (int k = 0; k < 3; k++) p[k] += w * other.p[k];
    }
};

static std::unique_ptr<Refiner> make_refiner(const mesh &m)
{
    std::vector<int> sizes, vertices, creases, corners;
    for (uint32_t f = 0; f < m.face_count; f++) {
        sizes.push_back((int)m.faces[f].size);
        for (uint32_t k = 0; k < m.faces[f].size; k++) vertices.push_back((int)m.faces[f].v[k]);
    }
    for (uint32_t i = 0; i < m.tag_count; i++) {
        creases.push_back((int)m.tags[i].v0);
        creases.push_back((int)m.tags[i].v1);
    }
    for (uint32_t i = 0; i < m.corner_count; i++) corners.push_back((int)m.corners[i]);
    std::vector<float> sharp(m.tag_count + m.corner_count, Osd::Sdc::Crease::SHARPNESS_INFINITE);
    Osd::Far::TopologyDescriptor desc;
    desc.numVertices = (int)m.vertex_count;
    desc.numFaces = (int)m.face_count;
    desc.numVertsPerFace = sizes.data();
    desc.vertIndicesPerFace = vertices.data();
    desc.numCreases = (int)m.tag_count;
    desc.creaseVertexIndexPairs = creases.data();
    desc.creaseWeights = sharp.data();
    desc.numCorners = (int)m.corner_count;
    desc.cornerVertexIndices = corners.data();
    desc.cornerWeights = sharp.data();
    Osd::Sdc::Options options;
    options.SetVtxBoundaryInterpolation(Osd::Sdc::Options::VTX_BOUNDARY_EDGE_AND_CORNER);
    using Factory = Osd::Far::TopologyRefinerFactory<Osd::Far::TopologyDescriptor>;
    return std::unique_ptr<Refiner>(
        Factory::Create(desc, Factory::Options(Osd::Sdc::SCHEME_CATMARK, options)));
}

enum { steps = 3, cells = 1 << steps };         // of refinement; along an edge of a face

// Points of the limit surface, and its tangents, at the vertices of the last level.
struct limits {
    std::vector<primvar> p, du, dv;
    vec position(int i) const { return make_vec(p[i].p[0], p[i].p[1], p[i].p[2]); }
    vec normal(int i) const
    {
        return cross(make_vec(du[i].p[0], du[i].p[1], du[i].p[2]),
                     make_vec(dv[i].p[0], dv[i].p[1], dv[i].p[2]));
    }
};

static limits make_limits(const mesh &m, Refiner &refiner)
{
    Refiner::UniformOptions options(steps);
    options.fullTopologyInLastLevel = true;
    refiner.RefineUniform(options);
    std::vector<primvar> points(m.vertex_count);
    for (uint32_t i = 0; i < m.vertex_count; i++) {
        const vec v = m.positions[i];
        points[i].p[0] = v.x, points[i].p[1] = v.y, points[i].p[2] = v.z;
    }
    Osd::Far::PrimvarRefinerReal<double> primvars(refiner);
    for (int level = 1; level <= steps; level++) {
        std::vector<primvar> finer(refiner.GetLevel(level).GetNumVertices());
        primvars.Interpolate(level, points, finer);
        points.swap(finer);
    }
    limits l;
    l.p.resize(points.size()), l.du.resize(points.size()), l.dv.resize(points.size());
    primvars.Limit(points, l.p, l.du, l.dv);
    return l;
}

// The vertex of the last level that a vertex of the mesh becomes.
static int last_vertex(const Refiner &refiner, int v)
{
    for (int level = 0; level < steps; level++)
        v = refiner.GetLevel(level).GetVertexChildVertex(v);
    return v;
}

// Vertices of the last level on a quad, by their place in its square.
typedef int lattice[cells + 1][cells + 1];

// Notes the corners of a face at the last level; above it, goes on in the face's four quads.
// corner: its vertices, counter-clockwise; x, y: their places.
static void find_lattice(const Refiner &refiner, int depth, int face, const int corner[4],
                         const int x[4], const int y[4], lattice out)
{
    const Osd::Far::TopologyLevel &level = refiner.GetLevel(depth);
    if (depth == steps) {
        for (int k = 0; k < 4; k++) out[y[k]][x[k]] = corner[k];
        return;
    }
    const int centre = level.GetFaceChildVertex(face);
    const int cx = (x[0] + x[2]) / 2, cy = (y[0] + y[2]) / 2;
    for (int k = 0; k < 4; k++) {
        const int next = (k + 1) % 4, last = (k + 3) % 4;
        const int child[4] = {
            level.GetVertexChildVertex(corner[k]),
            level.GetEdgeChildVertex(level.FindEdge(corner[k], corner[next])), centre,
            level.GetEdgeChildVertex(level.FindEdge(corner[last], corner[k]))};
        const int child_x[4] = {x[k], (x[k] + x[next]) / 2, cx, (x[last] + x[k]) / 2};
        const int child_y[4] = {y[k], (y[k] + y[next]) / 2, cy, (y[last] + y[k]) / 2};
        for (int f : level.GetFaceChildFaces(face)) {
            const auto vertices = refiner.GetLevel(depth + 1).GetFaceVertices(f);
            if (vertices.FindIndex(child[0]) < 0) continue;
            find_lattice(refiner, depth + 1, f, child, child_x, child_y, out);
        }
    }
}

// What OpenSubdiv's own tables say of a vertex.
struct vertex_facts {
    bool manifold, boundary, flagged, quads;    // quads: only, and none that has to be split
    unsigned sharp, edges;
};

static bool is_sharp(const Osd::Far::TopologyLevel &level, int edge)
{
    return level.IsEdgeBoundary(edge) || level.GetEdgeSharpness(edge) >= 10;
}

static std::vector<vertex_facts> find_facts(const mesh &m, const Refiner &refiner)
{
    const Osd::Far::TopologyLevel &level = refiner.GetLevel(0);
    std::vector<vertex_facts> facts(m.vertex_count);
    std::vector<bool> split(m.face_count);
    for (int v = 0; v < (int)m.vertex_count; v++) {
        vertex_facts &fact = facts[(size_t)v];
        fact = vertex_facts();
        fact.manifold = !level.IsVertexNonManifold(v);
        fact.boundary = level.IsVertexBoundary(v);
        for (uint32_t i = 0; i < m.corner_count; i++) fact.flagged |= (int)m.corners[i] == v;
        for (int edge : level.GetVertexEdges(v)) fact.sharp += is_sharp(level, edge);
        fact.edges = (unsigned)level.GetVertexEdges(v).size();
        for (int face : level.GetVertexFaces(v)) {
            unsigned beside = 0;                // sharp edges of the face that end here
            for (int edge : level.GetFaceEdges(face)) {
                const auto ends = level.GetEdgeVertices(edge);
                beside += is_sharp(level, edge) && (ends[0] == v || ends[1] == v);
            }
            if (!fact.boundary && (fact.edges == 2 || (fact.sharp == 2 && !fact.flagged
                                                       && beside == 2)))
                split[(size_t)face] = true;
        }
    }
    for (int v = 0; v < (int)m.vertex_count; v++) {
        facts[(size_t)v].quads = true;
        for (int face : level.GetVertexFaces(v))
            if (level.GetFaceVertices(face).size() != 4 || split[(size_t)face])
                facts[(size_t)v].quads = false;
    }
    return facts;
}

static void compare_vertices(const mesh &m, const surface &s, const Refiner &refiner,
                             const limits &limit, const std::vector<vertex_facts> &facts,
                             double size, totals *t)
{
    std::vector<bool> counted(m.vertex_count);
    for (uint32_t f = 0; f < m.face_count; f++)
        for (uint32_t k = 0; k < m.faces[f].size; k++) {
            const uint32_t v = m.faces[f].v[k];
            const vertex_facts &fact = facts[v];
            if (!fact.manifold || fact.sharp == 1 || (fact.sharp == 0 && !fact.quads)) continue;
            const vec ours = eval_at(&s.patches, edge_sample(f, m.faces[f].size, k, 0)).p;
            const vec theirs = limit.position(last_vertex(refiner, (int)v));
            const double error = distance(ours, theirs) / size;
            REQUIRE(error <= tolerance, "vertex %u, %u sharp edges: off by %g of the size\n",
                    (unsigned)v, fact.sharp, error);
            t->position = fmax(t->position, error);
            if (counted[v]) continue;
            counted[v] = true;
            if (fact.sharp == 0) t->smooth++, t->valences[fact.edges < 15 ? fact.edges : 15]++;
            else if (fact.sharp > 2 || fact.flagged || fact.edges == 2) t->corner++;
            else if (fact.boundary) t->boundary++;
            else t->crease++;
        }
}

// One ordinary face on a lattice of 9 x 9; normals inside alone, where both have but one.
static void compare_face(const surface &s, uint32_t f, const lattice at, const limits &limit,
                         double size, totals *t)
{
    for (int j = 0; j <= cells; j++)
        for (int i = 0; i <= cells; i++) {
            const double u = (double)i / cells, v = (double)j / cells;
            const point ours = eval_at(&s.patches, make_sample(f, 0, u, v));
            const double error = distance(ours.p, limit.position(at[j][i])) / size;
            REQUIRE(error <= tolerance, "face %u at %g %g: off by %g of the size\n", (unsigned)f, u,
                    v, error);
            t->position = fmax(t->position, error);
            if (i % cells == 0 || j % cells == 0) continue;
            const vec n = limit.normal(at[j][i]);
            const double angle = angle_between(ours.n, n);
            // a step of rounding turns a normal the more the shorter the derivatives are
            const double sine = length(cross(ours.du, ours.dv)) / (size * size);
            REQUIRE(angle * sine <= 100 * tolerance && (sine < 1e-3 || angle < 1e3 * tolerance),
                    "face %u at %g %g: normals differ by %g\n", (unsigned)f, u, v, angle);
            if (sine >= 1e-3) t->normal = fmax(t->normal, angle);
        }
}

static void compare_faces(const mesh &m, const surface &s, const Refiner &refiner,
                          const limits &limit, std::vector<vertex_facts> facts, double size,
                          totals *t)
{
    static const int x[4] = {0, cells, cells, 0}, y[4] = {0, 0, cells, cells};
    const psurf_ring *rings = (const psurf_ring *)s.tables.rings.data;
    for (uint32_t i = 0; i < s.tables.rings.count; i++)
        if (rings[i].valence & PSURF_RING_WIDE) facts[rings[i].point].quads = false;
    for (uint32_t f = 0; f < m.face_count; f++) {
        bool compared = psurf_get_patch(&s.patches, patch_of(&s, f)).kind == PSURF_BICUBIC;
        int corners[4];
        lattice at;
        for (uint32_t k = 0; k < m.faces[f].size && compared; k++) {
            const vertex_facts &fact = facts[m.faces[f].v[k]];
            compared = fact.manifold && fact.quads && fact.sharp != 1;
            corners[k] = (int)m.faces[f].v[k];
        }
        if (!compared) continue;
        find_lattice(refiner, 0, (int)f, corners, x, y, at);
        compare_face(s, f, at, limit, size, t);
        t->faces++;
    }
}

static void compare(const std::string &name, const mesh &m, totals *sum)
{
    totals t = totals();
    surface s;
    double size = 0;
    surface_build(&s, &m);
    for (uint32_t i = 0; i < m.vertex_count; i++)
        size = fmax(size, distance(m.positions[i], m.positions[m.faces[0].v[0]]));
    const std::unique_ptr<Refiner> refiner = make_refiner(m);
    const std::vector<vertex_facts> facts = find_facts(m, *refiner);
    const limits limit = make_limits(m, *refiner);
    compare_vertices(m, s, *refiner, limit, facts, size, &t);
    compare_faces(m, s, *refiner, limit, facts, size, &t);
    printf("%s: %u smooth, %u boundary, %u crease, %u corner vertices, %u of %u faces; "
           "position %.2g of the size, normal %.2g rad\n", name.c_str(), t.smooth, t.boundary,
           t.crease, t.corner, t.faces, (unsigned)m.face_count, t.position, t.normal);
    sum->smooth += t.smooth, sum->boundary += t.boundary, sum->crease += t.crease;
    sum->corner += t.corner, sum->faces += t.faces;
    for (int i = 0; i < 16; i++) sum->valences[i] += t.valences[i];
    sum->position = fmax(sum->position, t.position);
    sum->normal = fmax(sum->normal, t.normal);
    surface_free(&s);
}

// ---- meshes ----

// Every face in quads: one per corner, by the middles of edges and faces.
static mesh quads_of(const mesh &m)
{
    mesh q = mesh();
    edge_map map = map_edges(&m);
    std::vector<uint32_t> middle(map.count, PSURF_NONE);
    for (uint32_t i = 0; i < m.vertex_count; i++) mesh_point(&q, m.positions[i]);
    for (uint32_t i = 0; i < map.count; i++) {
        const half_edge *twin = find_edge(&map, map.edges[i].to, map.edges[i].from);
        if (twin && twin < &map.edges[i]) middle[i] = middle[twin - map.edges];
        else middle[i] = mesh_point(&q, mul(0.5, add(m.positions[map.edges[i].from],
                                                     m.positions[map.edges[i].to])));
    }
    for (uint32_t f = 0; f < m.face_count; f++) {
        const mesh_face_data &face = m.faces[f];
        vec sum = make_vec(0, 0, 0);
        uint32_t mid[MESH_MAX_CORNERS], n = face.size;
        for (uint32_t k = 0; k < n; k++) {
            sum = add(sum, m.positions[face.v[k]]);
            mid[k] = middle[find_edge(&map, face.v[k], face.v[(k + 1) % n]) - map.edges];
        }
        const uint32_t centre = mesh_point(&q, mul(1.0 / n, sum));
        for (uint32_t k = 0; k < n; k++)
            mesh_quad(&q, face.v[k], mid[k], centre, mid[(k + n - 1) % n]);
    }
    free(map.edges);
    return q;
}

// About percent of the edges hard, some vertices corners, a few faces gone.
static void damage(mesh *m, uint64_t *rng, uint32_t percent, uint32_t holes)
{
    while (holes--) mesh_remove_face(m, random_below(rng, m->face_count));
    mesh_compact(m);
    edge_map map = map_edges(m);
    std::vector<uint32_t> sharp(m->vertex_count);
    for (uint32_t i = 0; i < map.count; i++) {
        const half_edge *e = &map.edges[i];
        const bool interior = find_edge(&map, e->to, e->from) != NULL;
        if (!is_first_side(&map, e)) continue;
        if (interior && random_below(rng, 100) >= percent) continue;
        if (interior) mesh_hard(m, e->from, e->to);
        sharp[e->from]++, sharp[e->to]++;
    }
    for (uint32_t v = 0; v < m->vertex_count; v++)
        if (sharp[v] >= 2 && random_below(rng, 4) == 0) mesh_corner(m, v);
    free(map.edges);
}

static mesh read_obj(const char *path)
{
    mesh m = mesh();
    char line[4096], *at;
    FILE *file = fopen(path, "r");
    REQUIRE(file, "cannot open %s\n", path);
    while (fgets(line, sizeof line, file)) {
        double p[3];
        if (sscanf(line, "v %lf %lf %lf", p, p + 1, p + 2) == 3)
            mesh_point(&m, make_vec((float)p[0], (float)p[1], (float)p[2]));
        if (strncmp(line, "f ", 2)) continue;
        uint32_t v[MESH_MAX_CORNERS], n = 0;
        for (at = strtok(line + 2, " \t\r\n"); at; at = strtok(NULL, " \t\r\n")) {
            const long index = strtol(at, NULL, 10);
            REQUIRE(n < MESH_MAX_CORNERS, "%s: a face of too many corners\n", path);
            v[n++] = (uint32_t)(index > 0 ? index - 1 : (long)m.vertex_count + index);
        }
        mesh_face(&m, n, v);
    }
    fclose(file);
    mesh_compact(&m);
    return m;
}

// A mesh as it is; shaken, with holes, hard edges and corners; consumes it.
static void compare_variants(const std::string &name, mesh m, uint64_t *rng, totals *sum)
{
    compare(name, m, sum);
    for (uint32_t percent = 0; percent <= 40; percent += percent < 10 ? 5 : 15) {
        mesh other = mesh_copy(&m);
        mesh_jitter(&other, rng, 0.05);
        damage(&other, rng, percent, percent % 10 ? 0 : m.face_count / 12);
        compare(name + ", " + std::to_string(percent) + " % hard", other, sum);
        mesh_free(&other);
    }
    mesh_free(&m);
}

// Creases that run on: two loops round a torus, two lines across a sheet that meet in the middle.
static void compare_creases(uint64_t *rng, totals *sum)
{
    mesh torus = make_torus(12, 8), sheet = make_grid(9, 8);
    for (uint32_t i = 0; i < 12; i++) {
        mesh_hard(&torus, 8 * i, 8 * ((i + 1) % 12));
        mesh_hard(&torus, 8 * i + 3, 8 * ((i + 1) % 12) + 3);
    }
    for (uint32_t i = 0; i < 8; i++) mesh_hard(&sheet, 10 * i + 4, 10 * i + 14);
    for (uint32_t i = 0; i < 9; i++) mesh_hard(&sheet, 40 + i, 41 + i);
    mesh_jitter(&torus, rng, 0.1);
    mesh_jitter(&sheet, rng, 0.1);
    compare("torus, two loops", torus, sum);
    compare("sheet, cross", sheet, sum);
    mesh_free(&torus);
    mesh_free(&sheet);
}

static void test_generated(totals *sum)
{
    uint64_t rng = 1;
    compare_creases(&rng, sum);
    compare_variants("grid", make_grid(9, 7), &rng, sum);
    compare_variants("torus", make_torus(12, 8), &rng, sum);
    compare_variants("ball", make_latlong(9, 7), &rng, sum);
    compare_variants("dome", make_dome(6, 5), &rng, sum);
    compare_variants("creature", make_creature(), &rng, sum);
    compare_variants("cube", make_cube(), &rng, sum);
    for (uint32_t n = 3; n <= 9; n++) {
        mesh polygon = make_polygon(n);         // split from six corners on, corners all the same
        compare("polygon", polygon, sum);
        mesh_free(&polygon);
        mesh coarse = make_latlong(n, 1), quads = quads_of(coarse);
        compare_variants("quads, valence " + std::to_string(n), quads_of(quads), &rng, sum);
        mesh_free(&coarse);
        mesh_free(&quads);
    }
}

int main(int argc, char **argv)
{
    totals sum = totals();
    uint64_t rng = 2;
    test_generated(&sum);
    for (int i = 1; i < argc; i++) {
        mesh m = read_obj(argv[i]), other = mesh_copy(&m);
        compare(argv[i], m, &sum);
        damage(&other, &rng, 10, 0);
        compare(std::string(argv[i]) + ", 10 % hard", other, &sum);
        mesh_free(&m);
        mesh_free(&other);
    }
    printf("together: %u smooth, %u boundary, %u crease, %u corner vertices, %u faces; position "
           "%.2g of the size (allowed %.2g), normal %.2g rad\n", sum.smooth, sum.boundary,
           sum.crease, sum.corner, sum.faces, sum.position, tolerance, sum.normal);
    for (int n = 3; n <= 9; n++)
        REQUIRE(sum.valences[n] >= 2, "valence %d: %u vertices\n", n, sum.valences[n]);
    REQUIRE(sum.boundary > 100 && sum.crease > 100 && sum.corner > 100 && sum.faces > 1000,
            "too little compared\n");
    return 0;
}

#endif
