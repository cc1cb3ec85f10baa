/* patchsurf.h - v0.1.0 - smooth surfaces from polygon meshes, at run time. MIT or public domain.

   A polygon mesh goes in; smooth patches come out, one per face, without refinement; and from them
   points, normals, derivatives and curvature. One file, C99 or C++11, no dependency but sqrt.

   Do this, in one C or C++ file of your program:

       #define PSURF_IMPLEMENTATION
       #include "patchsurf.h"

   and include "patchsurf.h" without the define wherever else you need it.

   >>docs ========================================================================================

   CONTENTS            search for    what it is
     manual            >>docs        this text
     API               >>api         every type and call, in the order data flows
     1 arithmetic      >>1           points as values, own cosines
     2 memory          >>2           allocator, blocks
     3 topology        >>3           faces in, tables out: half-edges, rings, kinds of facet
     4 vertex data     >>4           limit points, tangent points, face points
     5 schemes         >>5           control points: pm; point-normal triangles and quads
     6 parameters      >>6           where a parameter lies on a patch
     7 kernels         >>7           points and derivatives, eight at a time
     8 points          >>8           samples at arbitrary places
     9 tessellation    >>9           lattices, numbering, triangles
     10 interrogation  >>10          curvature, gaps, bounds
     11 all at once    >>11          the one-call way; facts about this build

   A COMPLETE PROGRAM (cc program.c -lm), which prints a smooth cube as a Wavefront OBJ:

       #define PSURF_IMPLEMENTATION
       #include "patchsurf.h"
       #include <stdio.h>
       int main(void)
       {
           static const float position[8][3] = {{-1,-1,-1}, {1,-1,-1}, {1,1,-1}, {-1,1,-1},
                                                {-1,-1,1}, {1,-1,1}, {1,1,1}, {-1,1,1}};
           static const uint32_t face[6][4] = {{3,2,1,0}, {4,5,6,7}, {0,1,5,4},
                                               {1,2,6,5}, {2,3,7,6}, {3,0,4,7}};
           psurf_mesh_desc desc = {0};
           psurf_smooth_mesh mesh;
           psurf_error error;
           desc.vertex_count = 8;
           desc.face_count = 6;
           desc.uniform_size = 4;
           desc.face_vertices = face[0];
           desc.positions = position[0];
           if (psurf_smooth(&desc, 16, &mesh, &error) != PSURF_OK)
               return fprintf(stderr, "face %u: %s\n", (unsigned)error.face, error.message), 1;
           for (uint32_t i = 0; i < 3 * mesh.vertex_count; i += 3)
               printf("v %g %g %g\n", mesh.positions[i], mesh.positions[i + 1],
                      mesh.positions[i + 2]);
           for (size_t i = 0; i < mesh.index_count; i += 3)
               printf("f %u %u %u\n", mesh.indices[i] + 1u, mesh.indices[i + 1] + 1u,
                      mesh.indices[i + 2] + 1u);
           psurf_smooth_free(&mesh);
           return 0;
       }

   In C++ write psurf_mesh_desc desc = {}; so for every struct that is handed in.

   IN AN ENGINE. The same in the stages that run at different times:

       psurf_topology_create(&desc, &topology, &error);         once per connectivity; allocates
       psurf_patches_size(topology, PSURF_PM, &layout);         how much memory the patches take
       psurf_patches_bind(&patches, topology, PSURF_PM, memory, scratch);
       psurf_construct(&patches, &frame);                       every frame: positions, patches
       psurf_tessellate(&patches, &tess, 0, face_count, &out);  triangles of any range of faces, or
       psurf_eval(&patches, samples, count, &points);           points anywhere, with derivatives

   CONCEPTS
     mesh --> topology --> vertex data --> patches --> points
     * topology: all that follows from connectivity alone. Validated here and nowhere else;
       immutable afterwards, shared between threads and frames. A face is an input polygon, a facet
       what carries a patch: a face, or a piece of one that had to be split. A ring is a vertex with
       the fan of facets around it; a spoke is an edge seen from one of its ends. A vertex where two
       fans touch has two rings, one on hard edges has a ring for each side.
     * vertex data: per ring and spoke, in scratch memory that may be reused between meshes.
     * patches: one per facet, one tight array per kind:
         bicubic  quad whose corners all have four edges: C2 with its like on regular regions
         polar    triangle of a fan whose outer vertices have four edges, and are not the middle of
                  such a fan themselves: poles of any valence
         p3 4 5   every other triangle, quad, pentagon: sectors of degree 4 round a centre
       All meet G1, with one normal along every edge that is not hard. On a regular quad mesh the
       surface is the uniform bicubic B-spline, everywhere else close to the Catmull-Clark limit.
     * parameters: a triangle has the weights (u, v) of corners 1 and 2, a quad the unit square, a
       face of five or more corners a sector number and the weights of the sector's two corners.
       Derivatives are with respect to these.
     * rate: segments per edge. All faces of a tessellation have the same rate.
     * blend ratio, per end of an edge: 2/3 is the default, towards 0 the edge becomes sharp, 1 is
       softer. Exactly 0 is a crease: normals on it are one-sided, and positions still meet.
     * hard edges: two tangent planes along a smooth curve, one normal per side. A chain of them is
       a crease; where it ends, the surface is smooth (dart); where three or more meet, or at
       vertices in desc.corners, the vertex stays in place. On regular quad meshes this is
       Catmull-Clark's infinitely sharp crease. One hard edge between two darts changes nothing
       but a pole at its end into a plain vertex.
     * boundaries: a smooth curve through the boundary vertices, B-spline on regular ones. A vertex
       with one face is a corner.
     * split faces: with pm, a face of six corners or more, at an interior vertex of two edges, or
       alone on its side of a crease becomes a fan of triangles round its centre, a polar cap where
       its rim is regular. pn splits faces of five corners or more into quads and a triangle,
       all others split all but triangles, both from the corner with the lowest vertex on. Results
       are per input face all the same.
     * point-normal schemes (all but pm) make a patch from the corners of a facet and the normals
       there, some with a look at the facets across its edges; the surface passes through the
       vertices. Normals are the caller's, or computed. Blend ratios mean nothing here, corners only
       with PSURF_NORMALS_LIMIT.

   CHOOSING A SCHEME
     scheme        facets   across edges       needs    bytes  cost   best for
     pm            3 4 5 o  G1, mostly C2      rings    192+   1-1.2  animated characters: smooth,
                                                                      near Catmull-Clark
     pn            3 4      C0, shaded smooth  corners  192    1.05   the cheapest look; a quad 300
     smoothed_n    3        G1 (final: C0)     corners  228    5-10   PN's look without its creases
     hybrid        3        G1                 apexes   264    2.0    analytic shapes; unsafe where
                                                                      normals turn far
     png1          3        G1                 apexes   300    2.4    arbitrary meshes, a few dents
     cubic_wm_b1   3        G1                 corners  228    1.8    arbitrary meshes: safe, round
     cubic_pn_b1   3        G1                 corners  228    1.8    the same, beside pn in a mesh
     cubic_.._b2   3        nearly G1          corners  228    1.8    comparison alone
   Facets: o is a polar fan. Needs: corners and normals of the facet, or the facets across its edges
   too. Cost: of a point of a tessellation, a bicubic one is 1 (`make bench`).
   pm approximates its mesh, the others interpolate it (PSURF_NORMALS_LIMIT makes them approximate
   it, too). Largest distance to a sphere of 80 triangles: hybrid 1.3e-3, png1 2.3e-3, cubic_wm_b1
   8e-4; to a coarse torus (5 x 5) 0.05, 0.16, 0.10 (`patchsurf report`). Second derivatives do not
   exist at corners of point-normal patches; hybrid's curvature runs wild near them.
     * mixing: an object may have a scheme per face (face_schemes): pn where it is far or flat,
       smoothed_n or cubic_pn_b1 where it is seen; they share their boundary curves to the bit.
     * hard edges: tags, and edges whose two sides name different normals. Both sides share one
       curve that is tangent to both planes, so nothing gapes. Normals less than a degree apart
       count as equal: weld them before they come in.
     * where a formula has no answer (hybrid: a normal across its plane's; png1 and cubic_..:
       opposite normals, normals along an edge, edges of no length) the edge falls back to a form
       that has, on both sides alike. It may lose G1 there; psurf_check counts such edges between
       two facets as fallback_edges.
     * normals at corners are those given; those in between are the surface's (n), or what pn and
       smoothed_n shade with (shade). Where a coarse mesh folds sharply a patch that passes through
       its vertices may turn over: across such an edge the planes meet, but the normals oppose.

   INPUT RULES
     * Faces counter-clockwise seen from outside, 3 to 65535 corners, no vertex twice in a face.
     * An edge has one face or two, which run along it in opposite directions. Other edges are
       refused, or, with PSURF_CUT_BAD_EDGES, opened: each of their faces gets a boundary there.
     * Vertices without faces are ignored. Several components, and fans that touch at a vertex, are
       fine. A corner of 180 degrees (T-junction entered as a pentagon) is fine.
     * Normals per face corner by index: equal ones are told by equal indices. pm ignores them.
     * Corners in desc.corners where fewer than two hard or boundary edges meet are ignored. On a
       straight crease they make the normal vanish: flag corners that are corners.
     * Positions may be anything finite. Non-finite ones spread to the points they reach, never into
       an index; give desc.positions to have them refused.

   ERRORS. Calls that can fail return a psurf_result; psurf_topology_create and psurf_smooth also
   say where. The library never asserts, prints, aborts, or sets errno.
     PSURF_OK             all is well
     PSURF_BAD_DESC       a canary or unknown flag is set (the struct was not zero-initialised), a
                          pointer that must be there is NULL, patch or scratch memory is misaligned,
                          a stride is no multiple of the size of a real, one allocator function
                          without the other, a rate or default blend ratio out of range. No
                          location.
     PSURF_BAD_INDEX      a face names a vertex >= vertex_count: face, corner, vertex
     PSURF_BAD_FACE       fewer than 3 or more than 65535 corners (32767 but for pm): face. A vertex
                          twice: face, corner, vertex
     PSURF_BAD_EDGE       a tag on no edge of the mesh, a second tag on an edge, unknown flags, a
                          blend ratio outside 0..1: vertex and other are the tag's
     PSURF_BAD_WINDING    two faces run along an edge the same way: face, corner where the edge
                          starts in the later one, vertex, other
     PSURF_NON_MANIFOLD   an edge of three faces: face and corner of the third, vertex, other
     PSURF_BAD_CORNER     desc.corners names a vertex >= vertex_count: vertex
     PSURF_BAD_NORMAL     desc.face_normals names a normal >= normal_count: face, corner, vertex
     PSURF_BAD_SCHEME     desc.face_schemes has pm, an unknown scheme, or one that shares no
                          boundary curves with that of face 0: face
     PSURF_BAD_SPLIT      the scheme needs a topology of another split, or PSURF_MIXED one with
                          face_schemes. No location
     PSURF_NOT_FINITE     desc.positions has an infinity or NaN: vertex
     PSURF_TOO_LARGE      2^31-1 corners or vertices, 2^22 edges at a vertex (located), sizes or
                          numbers beyond what memory, 32-bit or 16-bit indices can hold
     PSURF_OUT_OF_MEMORY  the allocator returned NULL; nothing is leaked

   MEMORY. psurf_topology_create allocates three times and keeps one block; psurf_smooth allocates
   five times and keeps one block; nothing else allocates. Patches and scratch are the caller's:
   sizes first, memory after, mapped GPU memory included. Stack use stays below 64 KB with an
   instruction set's registers, 96 KB in plain C, 160 KB in double; no recursion.

   THREADS. No mutable globals. A topology may be used by any number of threads. Construction passes
   and tessellation run over ranges: give each job its own range; between two passes wait for all
   jobs. Any split gives the same bits.

   INSTRUCTION SETS. Evaluation works on eight facets or samples at once: with AVX2 or SSE2 on x86
   (the processor is asked at run time; MinGW's gcc and clang-cl have SSE2 alone), NEON on 64-bit
   little-endian ARM with gcc and clang, else in plain C; psurf_simd_name() tells. Vertices of
   24 bytes, n = p + 3 and both strides 24, are written fastest. Facets smaller than 1e-7 units or
   larger than 1e7 take a slower path to their normals.

   DETERMINISM. The same input gives the same bits with gcc and clang at any optimisation level,
   -march=native included, as C or C++, on 32- and 64-bit machines, little- and big-endian, with
   any split into ranges. The implementation switches contraction off for itself by pragmas that it
   undoes at its end (clang off x86: back to its default); it uses no libm function but sqrt, and
   one order of operations. Positions on a shared edge are bit-identical from both faces: every
   facet boundary is one cubic, evaluated in one order that is symmetric in its ends. Normals
   from two sides agree to rounding: displace along welded normals. In float the two differ by less
   than 0.01 degrees on most meshes, and by more on sharply folded edges a hundred times shorter
   than their distance from the origin, and at valences above some hundreds: keep meshes near their
   origin.
   Excluded: clang's -ffast-math and -ffp-contract=fast, which override the pragmas; x87 arithmetic
   (use -msse2 -mfpmath=sse); FTZ/DAZ modes; the payload of NaNs. psurf_exact() tells.

   THE GPU. Tables (psurf_topology_tables) and patches upload as they are: arrays of 32-bit words
   and tight floats. Their sizes are asserted at compile time; PSURF_TABLE_VERSION counts changes.

   LIMITS. Corners (three per corner of split faces) and vertices below 2^31-1, faces of 3 to 65535
   corners, valence up to 4194303, edges to centres of split faces included (one ring is one item of
   work: ranges do not divide it), rate 1 to 16384, tessellations below 2^32 vertices.

   COMPILE-TIME OPTIONS, the same in every file that includes the header:
     PSURF_IMPLEMENTATION  in one file: the code
     PSURF_STATIC          everything static: every file that includes the header defines
                           PSURF_IMPLEMENTATION too, and has a copy of its own
     PSURF_API             storage class and attributes of the calls (default: extern)
     PSURF_REAL            float (default) or double, for tests and reports
     PSURF_NO_STDLIB       no malloc: every descriptor needs an allocator
     PSURF_SQRT(x)         square root of a double, correctly rounded (default: sqrt of <math.h>)
     PSURF_NO_SIMD         plain C alone
     PSURF_NO_AVX2         on x86: SSE2 alone, without asking the processor for more
     PSURF_SELF            name of this file, if it is not "patchsurf.h": it includes itself

   SECURITY. psurf_topology_create and psurf_smooth take hostile meshes, psurf_eval and
   psurf_interpolate hostile samples: any bytes give a result or a result code. Pointers, counts and
   strides of the caller's own arrays are trusted.

   SOURCES. [PM] A. Myles, T. Ni, J. Peters: Fast Parallel Construction of Smooth Surfaces from
   Meshes with Tri/Quad/Pent Facets, Symposium on Geometry Processing 2008. "eq." is its equation.
   [PN] J. Peters: PN-quads, 2008. [N] H. Gruen: Smoothed N-patches. [GB] M. Boschiroli, C.
   Fuenfzig, L. Romani, G. Albrecht: G1 rational blend interpolatory schemes: a comparative study.

   LICENSE. MIT or public domain, your choice; the text is at the end of this file.
*/

/* >>api ======================================================================================= */

#ifndef PSURF_H_INCLUDED
#define PSURF_H_INCLUDED

#include <stddef.h>
#include <stdint.h>

#define PSURF_VERSION_MAJOR 0
#define PSURF_VERSION_MINOR 1
#define PSURF_VERSION_PATCH 0
#define PSURF_VERSION \
    (PSURF_VERSION_MAJOR * 10000 + PSURF_VERSION_MINOR * 100 + PSURF_VERSION_PATCH)
#define PSURF_TABLE_VERSION 1u     /* of the structs that the GPU reads, psurf_ring to psurf_trig */

#ifndef PSURF_REAL
#define PSURF_REAL float
#endif

#ifndef PSURF_API
#if defined(PSURF_STATIC) && (defined(__GNUC__) || defined(__clang__))
#define PSURF_API static __attribute__((unused))
#elif defined(PSURF_STATIC)
#define PSURF_API static
#else
#define PSURF_API extern
#endif
#endif

#ifdef __cplusplus
extern "C" {
#endif

/* ---- values ---------------------------------------------------------------------------------- */

typedef PSURF_REAL psurf_real;                  /* float, or double for tests and reports */
typedef struct psurf_topology psurf_topology;   /* opaque, immutable, shareable between threads */

#define PSURF_NONE 0xFFFFFFFFu                  /* an index that points nowhere */
#define PSURF_MAX_RATE 16384u                   /* segments per edge */
#define PSURF_MAX_FACE_SIZE 65535u              /* corners of a face; half that but for pm */
#define PSURF_MAX_VALENCE 4194303u              /* edges at a vertex */
#define PSURF_MAX_CORNERS 0x7FFFFFFFu           /* face corners; three per corner of split faces */

/* Every result: code, and what it says. The manual's ERRORS tells what provokes each. */
#define PSURF_RESULTS(X)                                                                           \
    X(OK,            "ok")                                                                         \
    X(BAD_DESC,      "descriptor is inconsistent or was not zero-initialised")                     \
    X(BAD_INDEX,     "face refers to a vertex that does not exist")                                \
    X(BAD_FACE,      "face has fewer than 3 corners, too many, or names a vertex twice")           \
    X(BAD_EDGE,      "edge tag names no edge, names one twice, or has a blend ratio out of 0..1")  \
    X(BAD_WINDING,   "two faces run along an edge in the same direction")                          \
    X(NON_MANIFOLD,  "more than two faces share an edge")                                          \
    X(NOT_FINITE,    "vertex position is not finite")                                              \
    X(TOO_LARGE,     "mesh or output exceeds a documented limit or the address space")             \
    X(OUT_OF_MEMORY, "allocator returned NULL")                                                    \
    X(BAD_CORNER,    "corner names a vertex that does not exist")                                  \
    X(BAD_NORMAL,    "face corner refers to a normal that does not exist")                         \
    X(BAD_SCHEME,    "face has an unknown scheme, or one that does not mix with those before it")  \
    X(BAD_SPLIT,     "topology splits its faces otherwise than the scheme needs")
typedef enum psurf_result {
#define PSURF__X(name, text) PSURF_##name,
    PSURF_RESULTS(PSURF__X)
#undef PSURF__X
    PSURF_RESULT_COUNT
} psurf_result;

/* A located result. Fields that do not apply are PSURF_NONE. The message is static text. */
typedef struct psurf_error {
    psurf_result result;
    uint32_t face, corner;      /* corner = position in the face, 0..size-1 */
    uint32_t vertex, other;     /* the vertex concerned; of an edge: both its ends */
    const char *message;
} psurf_error;

/* Memory for the few calls that allocate. Both functions set, or both NULL for malloc and free.
   alloc returns size bytes aligned to align (a power of two, at most 16), or NULL. release gets the
   size that alloc was asked for; it is never called with NULL. */
typedef struct psurf_allocator {
    void *(*alloc)(void *ctx, size_t size, size_t align);
    void (*release)(void *ctx, void *memory, size_t size);
    void *ctx;
} psurf_allocator;

/* How a surface is made from a mesh; the manual's CHOOSING A SCHEME compares them. */
typedef enum psurf_scheme {
    PSURF_PM,                           /* [PM]: tri, quad, pent, polar; the default */
    PSURF_PN,                           /* [PN]: point-normal triangles and quads */
    PSURF_SMOOTHED_N,                   /* [N]: smoothed N-patches; see psurf_variant */
    PSURF_HYBRID,                       /* [GB]: hybrid, Foley-Opitz */
    PSURF_PNG1,                         /* [GB]: PNG1 triangles */
    PSURF_CUBIC_WM_B1,                  /* [GB]: Walton-Meek, cubic form with blends B1 */
    PSURF_CUBIC_PN_B1,                  /* the same on the boundary curves of PN triangles */
    PSURF_CUBIC_WM_B2,                  /* blends B2: not G1, for comparison */
    PSURF_CUBIC_PN_B2,
    PSURF_MIXED,                        /* each face has the one that desc.face_schemes gives it */
    PSURF_SCHEME_COUNT,
    PSURF_WM = PSURF_CUBIC_WM_B1        /* Walton-Meek's quartic is this very surface */
} psurf_scheme;

/* The kinds of patch, in the order of their blocks in memory. Points stored per patch: 16, 13, 19,
   25, 31, 16, 25, 19, 22, 25, 19, 19. Their order within a patch:
     bicubic  g_ij at 4*j+i; i along corner 0 -> 1, j along corner 0 -> 3
     polar    h_ij at 4*j+i for j = 0, 1, 2; i along the base A -> B, j to the pole; then the pole
     p3 4 5   per sector i: v^i, t0^i, t1^(i+1), b211^i, b121^i, b112^i; last b004, the centre
   Bezier triangles run row by row, from the edge corner 0 -> 1 to corner 2: b300 b210 b120 b030,
   b201 b111 b021, b102 b012, b003; n200 n110 n020, n101 n011, n002. Edge e runs from corner e to
   the next.
     pn_tri   ten points; six normals
     pn_quad  g_ij at 4*j+i as bicubic; normals n_ij at 16+3*j+i
     npatch   ten points; six shading normals; per edge: how flat it is, 0..1; per edge: 1 where the
              blended normal is turned to be orthogonal to the curve (variant g1), else 0; 1 where
              flatness counts (final), 1 where the inside is drawn to the PN triangle, 1 where the
              shading normal is the surface's
     hybrid   three corners; per edge b210 b120 b201 b021 b111, as if it were the first; three
              normals; per edge a PSURF_EDGE_... as a real
     png1     the boundary, ten points without b111; the points that the six keys b210 b120 b201
              b021 b102 b012 are blended with; per edge two inner points, at its start and end;
              three normals; per edge a PSURF_EDGE_...
     ribbon   the boundary; per edge two inner points; three normals; per edge a PSURF_EDGE_... */
typedef enum psurf_kind {
    PSURF_BICUBIC, PSURF_POLAR, PSURF_P3, PSURF_P4, PSURF_P5,
    PSURF_PN_TRI, PSURF_PN_QUAD, PSURF_NPATCH, PSURF_HYBRID_TRI, PSURF_PNG1_TRI, PSURF_RIBBON,
    PSURF_RIBBON_B2,
    PSURF_KIND_COUNT
} psurf_kind;

/* How the construction of an edge went, in patches of kind hybrid, png1, ribbon. */
enum {
    PSURF_EDGE_SMOOTH = 0,
    PSURF_EDGE_HARD = 1,                /* the normals of its two sides differ */
    PSURF_EDGE_FALLBACK = 2             /* the formula is singular here: see the manual */
};

/* Which faces are split, and how; a scheme goes with one of them. */
typedef enum psurf_split {
    PSURF_SPLIT_PM,                     /* pm: fans round the centre, where a face has none */
    PSURF_SPLIT_PN,                     /* pn: five corners or more, into quads and a triangle */
    PSURF_SPLIT_TRIANGLES,              /* all others, and mixes: all faces, into triangles */
    PSURF_SPLIT_COUNT
} psurf_split;

/* ---- topology: once per connectivity --------------------------------------------------------- */

enum {                                  /* psurf_edge_tag.flags */
    PSURF_HARD = 1u,                    /* two tangent planes, one normal per side */
    PSURF_BLEND = 2u                    /* blend0 and blend1 count */
};
enum {                                  /* psurf_mesh_desc.flags */
    PSURF_DEFAULT_BLEND = 1u,           /* default_blend counts, else 2/3 */
    PSURF_CUT_BAD_EDGES = 2u            /* open edges of more than two faces, or of two that run the
                                           same way, instead of refusing them */
};

/* What the caller says of one edge. A blend ratio (alpha of paper eq. 14) sharpens the surface at
   one end of an edge: 2/3 is the uniform B-spline, 0 a crease, 1 softer than the B-spline. */
typedef struct psurf_edge_tag {
    uint32_t v0, v1, flags;
    psurf_real blend0, blend1;               /* 0..1, at the end v0 and at the end v1 */
} psurf_edge_tag;

/* The connectivity of a mesh. Zero-initialise it; nothing it points to is kept after the call. */
typedef struct psurf_mesh_desc {
    uint32_t _start_canary;
    uint32_t vertex_count, face_count;
    const uint32_t *face_sizes;      /* [face_count] corners of each face; NULL: all uniform_size */
    uint32_t uniform_size;              /* read only without face_sizes */
    const uint32_t *face_vertices;      /* [sum of sizes] counter-clockwise seen from outside */
    const psurf_edge_tag *edges;        /* [edge_count] or NULL */
    uint32_t edge_count;
    const uint32_t *corners;            /* [corner_count] or NULL: vertices that stay in place (if
                                           two or more hard or boundary edges meet there) */
    uint32_t corner_count;
    const uint32_t *face_normals;       /* [sum of sizes] normal of each face corner, or NULL: that
                                           of its vertex. Edges whose two sides name different ones
                                           at an end are hard; pm ignores them */
    uint32_t normal_count;              /* with face_normals: they are below it */
    psurf_split split;                  /* what the scheme asks for: psurf_scheme_split */
    const unsigned char *face_schemes;  /* [face_count] of psurf_scheme, or NULL. With it the scheme
                                           is PSURF_MIXED and the split PSURF_SPLIT_TRIANGLES; the
                                           schemes have boundary curves in common: pn, smoothed_n,
                                           cubic_pn_b1 and _b2; or wm and cubic_wm_b2; or one */
    uint32_t flags;
    psurf_real default_blend;           /* with PSURF_DEFAULT_BLEND: of edges without a tag */
    const psurf_real *positions;     /* [vertex_count][3] or NULL: only to refuse non-finite ones */
    size_t position_stride;             /* bytes between positions; 0 = 3 reals */
    psurf_allocator allocator;
    uint32_t _end_canary;
} psurf_mesh_desc;

/* Builds the topology of a mesh; validates every number it reads.
   desc: as above. topology: receives the object, or NULL unless PSURF_OK. error: receives the place
   of the offence, may be NULL.
   Returns any result of the list except what only other calls return. Allocates three times
   through desc->allocator, which is copied and must outlive the object, and keeps one block.
   Linear in the number of face corners; a tag adds the logarithm of that. Any thread; calls do
   not know of each other.
   Source: [PM] section 3 (rings), section 4 (kinds of facet). */
PSURF_API psurf_result psurf_topology_create(const psurf_mesh_desc *desc, psurf_topology **topology,
                                             psurf_error *error);

/* Releases a topology; NULL is fine. No thread may still use it. */
PSURF_API void psurf_topology_destroy(psurf_topology *topology);

/* Facts about a topology. Counts are of the input mesh. */
typedef struct psurf_info {
    uint32_t vertices, faces, edges, boundary_edges, hard_edges;
    uint32_t components;                /* sets of faces connected through vertices */
    uint32_t max_valence;               /* most edges at one vertex */
    uint32_t valence2;                  /* interior vertices with two edges */
    uint32_t kind_faces[PSURF_KIND_COUNT];
    uint32_t ngon_faces;                /* faces that are split */
    uint32_t edges_cut;                 /* opened by PSURF_CUT_BAD_EDGES */
    uint32_t rings, spokes, facets, centres;
    uint32_t edge_sides;                /* edges, hard ones twice */
    uint32_t inner_edges;               /* between pieces of split faces; pm: not counted */
    size_t bytes, peak_bytes;           /* kept by the object; most held while it was built */
} psurf_info;

/* Fills *info. Neither pointer may be NULL. No allocation; any number of threads. */
PSURF_API void psurf_topology_info(const psurf_topology *topology, psurf_info *info);

/* The tables that both processors read: std430 arrays without padding, uploaded as they are.
   A ring is a vertex with its fan of facets, or with one side of it where hard edges cut the fan.
   Spoke j runs along the edge to E_j; facet f_j lies between spokes j and j+1, counter-clockwise. A
   closed ring has as many spokes as facets, an open one a last spoke more. Ids >= vertex_count are
   centres of split faces. Facets stand in the order of their patches: by kind, then by face.
   Corners stand in the order of the facets: corner i of facet k, of a kind with m sides, is corner
   kind_first_corner + (k - kind_first) * m + i. */
typedef struct psurf_ring {
    uint32_t point;                     /* vertex */
    uint32_t first_spoke;
    uint32_t valence;                   /* bits 0-23: spokes; flags PSURF_RING_... */
    uint32_t trig;                    /* row of psurf_trig: scales, then cos and sin of j/n turns */
} psurf_ring;
typedef struct psurf_spoke {
    uint32_t end;                       /* E_j */
    uint32_t after, before;             /* facet f_j: vertex after E_j, vertex before E_(j+1). Last
                                           spoke of an open ring, which has no facet: after = the
                                           same spoke as first of the next ring, PSURF_NONE at a
                                           boundary; before = far spoke of a wide neighbour */
} psurf_spoke;
typedef struct psurf_corner {
    uint32_t ring;                      /* bit 31: this facet writes the welded vertex */
    uint32_t spoke;                  /* in the table of spokes: along the edge to the next corner */
    uint32_t edge;                  /* of that edge side; bit 31: this facet writes its samples */
} psurf_corner;
typedef struct psurf_facet {
    uint32_t face;
    uint32_t piece;                     /* bits 0-15: piece of a split face; 16-17: corner A of a
                                           polar facet; but for pm 16-30: corner of a split face
                                           where its pieces begin; 31: PSURF_SPLIT_FACE */
} psurf_facet;
typedef struct psurf_edge {             /* a side of an edge; the second sides of hard edges last */
    uint32_t corner, other;             /* the writer's; that across, PSURF_NONE at boundaries */
} psurf_edge;
/* Rows of a valence n, from psurf_ring.trig: first the scales 9/(n(n+5)) of the limit point and
   1/(2 n lambda_n) of the tangents, then cosine and sine of j/n turns, j = 0 .. n-1. */
typedef struct psurf_trig { psurf_real c, s; } psurf_trig;
#define PSURF_WRITER 0x80000000u        /* bit 31 of psurf_corner.ring and .edge */
#define PSURF_INNER_EDGE 0x7FFFFFFFu    /* psurf_corner.edge between pieces of a split face: of pm;
                                           else those have numbers, from edge_sides on */
#define PSURF_SPLIT_FACE 0x80000000u    /* bit 31 of psurf_facet.piece */
#define PSURF_RING_POLAR 0x80000000u    /* psurf_ring.valence: the facets are polar */
#define PSURF_RING_OPEN 0x40000000u     /* between two sharp spokes: crease or boundary, */
#define PSURF_RING_CORNER 0x20000000u   /* or corner, */
#define PSURF_RING_WIDE 0x10000000u     /* or the wide side of a corner */
#define PSURF_RING_WIDE_NEXT 0x08000000u        /* beyond the last spoke is the wide side, */
#define PSURF_RING_WIDE_LAST 0x04000000u        /* beyond the first spoke is the wide side */
#define PSURF_RING_VALENCE 0x00FFFFFFu

/* All tables lie in one block, each at a multiple of 256 bytes from its start: one copy uploads
   them. Shaders that read ring or edge of a corner, or valence of a ring, mask the flag bits. */
typedef struct psurf_table { const void *data; uint32_t count, stride; } psurf_table;
typedef struct psurf_tables {
    const void *block;
    size_t block_bytes;
    psurf_table rings, spokes, corners, facets, edges, trig;
    psurf_table blends;                 /* psurf_real per spoke; count 0 where all are 2/3 */
    psurf_table face_facet;             /* uint32_t per face: its first facet */
    psurf_table centres;                /* uint32_t per centre: its face */
    psurf_table ring_normals;           /* uint32_t per ring: its normal; count 0 without
                                           face_normals: the vertex */
    uint32_t kind_first[PSURF_KIND_COUNT + 1];          /* first facet of each kind */
    uint32_t kind_first_corner[PSURF_KIND_COUNT + 1];
    uint32_t version;                   /* PSURF_TABLE_VERSION */
} psurf_tables;

/* Views of the tables, valid until the topology is destroyed. Neither pointer may be NULL. */
PSURF_API void psurf_topology_tables(const psurf_topology *topology, psurf_tables *tables);

/* The spoke that leaves vertex v0 along the edge to v1: the index of its blend ratio in
   psurf_tables.blends and psurf_construct_desc.blends. Where two rings share a spoke, on a hard
   edge, it is the one whose ratio both read; of an edge that was cut, one of its parts.
   PSURF_NONE if there is no such edge.
   Logarithmic in the rings, linear in the valence and in the further fans of non-manifold vertices.
   No allocation; any number of threads. */
PSURF_API uint32_t psurf_find_spoke(const psurf_topology *topology, uint32_t v0, uint32_t v1);

/* ---- patches: once per frame ----------------------------------------------------------------- */

/* Construction runs in passes. Within a pass, items may be done in any order, in any ranges, by any
   threads; all of a pass must be done before the next one starts. */
typedef enum psurf_pass {
    PSURF_PASS_CENTRES,                 /* centres of split faces */
    PSURF_PASS_VERTICES,                /* per ring: limit point, tangent points, face points */
    PSURF_PASS_FACETS,                  /* per facet: control points */
    PSURF_PASS_COUNT
} psurf_pass;

/* One tight array of patches per kind, each patch of 3 * points reals. Offsets are in bytes: of the
   patches, and of what one pass hands to the next in the scratch. */
typedef struct psurf_kind_block { size_t offset; uint32_t count, points; } psurf_kind_block;
typedef struct psurf_patches_layout {
    size_t patch_bytes, scratch_bytes;
    uint32_t pass_items[PSURF_PASS_COUNT];
    psurf_kind_block kind[PSURF_KIND_COUNT];    /* in the patches; offsets are multiples of 256 */
    size_t centre_offset;               /* in the scratch: [centres][3]; all multiples of 256 */
    size_t limit_offset;                /* [rings][3] limit points v */
    size_t spoke_offset;                /* pm: [spokes][2][3] tangent point t_j, face point f_j */
    size_t normal_offset;               /* others: [rings][3] unit normals; limit points are the
                                           vertices then, unless PSURF_NORMALS_LIMIT moves them */
} psurf_patches_layout;

/* Patches of one mesh: a plain value that owns nothing. Fill it with psurf_patches_bind. The
   topology and the patch memory must outlive it; the scratch is read by construction alone. */
typedef struct psurf_patches {
    const psurf_topology *topology;
    psurf_scheme scheme;
    psurf_patches_layout layout;
    void *patches, *scratch;
} psurf_patches;

/* Where vertex normals come from, for the schemes that take them (all but pm). */
typedef enum psurf_normal_mode {
    PSURF_NORMALS_AVERAGE,              /* mean of the unit normals of the facets around */
    PSURF_NORMALS_AREA,                 /* the same, weighted by area */
    PSURF_NORMALS_LIMIT,                /* limit points and normals of the facets after splitting:
                                           Catmull and Clark's among quads, else pm's, but without
                                           the wide sides of corners. Positions move there too */
    PSURF_NORMALS_COUNT
} psurf_normal_mode;

typedef enum psurf_variant {            /* of smoothed_n */
    PSURF_N_G1,                         /* the repair that is smooth across edges */
    PSURF_N_FINAL,                      /* [N]'s second listing, its errors mended */
    PSURF_N_INTERMEDIATE,               /* [N]'s first */
    PSURF_N_COUNT
} psurf_variant;

typedef enum psurf_shading {            /* shading normals of smoothed_n */
    PSURF_SHADE_LINEAR,                 /* between the vertex normals, as [N] lists it */
    PSURF_SHADE_QUADRATIC,              /* as PN triangles */
    PSURF_SHADE_EXACT,                  /* the normal of the surface */
    PSURF_SHADE_COUNT
} psurf_shading;

enum {                                  /* psurf_construct_desc.flags: what else a scheme can do */
    PSURF_SIGMA = 1u,                   /* pn, smoothed_n: sigma counts, else 1/2 */
    PSURF_COONS = 2u,                   /* pn: inside of quads by the discrete Coons rule */
    PSURF_FOLDS = 4u,                   /* smoothed_n final: folds beyond 90 degrees are not flat */
    PSURF_NEARLY_FLAT = 8u,             /* smoothed_n final: edges whose facets' normals have a dot
                                           product above 0.98 count as flat: saves smoothing them */
    PSURF_PLANE_NORMALS = 16u           /* hybrid: plane from the vertex normals at the edge, not
                                           the bisector of its two facets */
};

typedef struct psurf_construct_desc {
    uint32_t _start_canary;
    const psurf_real *positions;        /* [vertex_count][3] */
    size_t position_stride;             /* bytes between positions; 0 = 3 reals */
    const psurf_real *blends;           /* pm: [spokes] 0..1, trusted; NULL = the topology's */
    const psurf_real *normals;          /* [normal_count of the mesh][3], or [vertex_count] where it
                                           has no face_normals; made unit length, where they are not
                                           zero. NULL: computed */
    size_t normal_stride;               /* bytes between normals; 0 = 3 reals */
    psurf_normal_mode normal_mode;      /* read only without normals */
    psurf_variant variant;
    psurf_shading shading;
    uint32_t flags;                     /* PSURF_SIGMA .. PSURF_PLANE_NORMALS */
    psurf_real sigma;                   /* how far inner points are drawn out; finite */
    uint32_t _end_canary;
} psurf_construct_desc;

/* How much memory the patches of a topology take, and how it is laid out.
   Returns PSURF_OK; BAD_DESC for an unknown scheme or NULL; BAD_SPLIT where the topology is split
   for other schemes; TOO_LARGE where it exceeds the address space. No allocation; any number of
   threads. */
PSURF_API psurf_result psurf_patches_size(const psurf_topology *topology, psurf_scheme scheme,
                                          psurf_patches_layout *layout);

/* Fills *out for memory of the caller: patches of layout.patch_bytes and scratch of
   layout.scratch_bytes, each aligned for psurf_real (mapped GPU memory is fine: it is written once,
   front to back within a range, and never read by construction).
   scratch may be NULL where patches are only evaluated.
   Returns as psurf_patches_size; BAD_DESC for NULL or misaligned memory. */
PSURF_API psurf_result psurf_patches_bind(psurf_patches *out, const psurf_topology *topology,
                                          psurf_scheme scheme, void *patches, void *scratch);

/* Runs items first..first+count-1 of one pass; a range beyond the last item is cut there.
   Non-finite positions flow to the points they reach and nowhere else.
   Returns PSURF_OK, or BAD_DESC for canaries, NULL positions, a misaligned stride, unknown flags,
   modes or variants, a sigma that is not finite, or no scratch.
   No allocation. Threads: disjoint ranges of one pass run concurrently.
   Source: [PM] eqs. 13-16 (vertices), 17-22 (facets); [PN] 2; [N] 1.1; [GB] 2, with hard edges,
   the variant g1 and the fall-backs of ours. */
PSURF_API psurf_result psurf_construct_pass(const psurf_patches *patches,
                                            const psurf_construct_desc *desc, psurf_pass pass,
                                            uint32_t first, uint32_t count);

/* All passes over the whole mesh, on this thread. Returns as psurf_construct_pass. */
PSURF_API psurf_result psurf_construct(const psurf_patches *patches,
                                       const psurf_construct_desc *desc);

/* One patch as it lies in memory. */
typedef struct psurf_patch {
    psurf_kind kind;
    uint32_t face, sector;              /* sector: the piece of a split face, else 0 */
    uint32_t point_count;
    const psurf_real *points;           /* [point_count][3] */
} psurf_patch;

/* Patch number index, 0 .. psurf_info.facets-1, in the order of kinds, then faces. An index out of
   range gives point_count 0. No allocation; any number of threads. */
PSURF_API psurf_patch psurf_get_patch(const psurf_patches *patches, uint32_t index);

/* ---- points: per sample ---------------------------------------------------------------------- */

/* A place on the surface. Triangles: u, v are the weights of corner 1 and corner 2. Quads: the unit
   square, corners at (0,0) (1,0) (1,1) (0,1). Both ignore the sector. Faces with m >= 5 corners:
   with pm, sector i spans corner i, corner i+1 and the centre; u, v are the weights of the two
   corners. Else a sector is a piece, counted round the corner with the lowest vertex, which is its
   corner 0: (m-2)/2 quads, rounded down, and where m is odd a last triangle (pn), or m-2
   triangles; u, v are as above. */
typedef struct psurf_sample {
    uint32_t face, sector;
    psurf_real u, v;
} psurf_sample;

/* Where results go; NULL = skip. Element k of an array lies k * stride bytes from its start; stride
   0 = 3 reals, else a multiple of the size of a real; all arrays share it. n has unit length, or is
   zero where no direction exists (all control points of the patch on one line). shade is the unit
   normal that the scheme shades with: pn and smoothed_n have one of their own, for all others it is
   n. du .. dvv are with respect to the sample's u and v. */
typedef struct psurf_points {
    psurf_real *p, *n, *shade, *du, *dv, *duu, *duv, *dvv;
    size_t stride;
} psurf_points;

/* Evaluates count samples.
   Faces and sectors out of range are clamped to the last one, parameters to the domain, NaN to 0:
   any bytes are safe. Of a mesh without faces nothing is written. At a pole du and dv are those of
   the line from the middle of the base, and second derivatives do not exist: they are written as 0;
   towards it they grow without bound.
   On facet boundaries p comes from the one cubic that both facets share: bit-identical from both
   sides where the edge parameters are exactly s and 1-s.
   At corners of point-normal patches, from weights of 1 - 1e-6 on, n is the normal that was given
   there, unless that was zero; second derivatives do not exist and are written as 0.
   No allocation; any number of threads; no pointer but those inside out may be NULL.
   Source: [PM] eqs. 2, 3, 17-19; at a pole the rows are weighted by B_j(v)/(1-v). [PN] 2, [N] 1.1,
   [GB] 2 and (1), (10). */
PSURF_API void psurf_eval(const psurf_patches *patches, const psurf_sample *samples, uint32_t count,
                          const psurf_points *out);

/* Gaussian and mean curvature at count samples; either output may be NULL. [count] reals each, NaN
   where curvature does not exist (poles, corners of point-normal patches, vanishing normals). Mean
   curvature is negative where the surface bends away from its normal (a sphere: mean = -1/r,
   gauss = 1/r^2).
   Samples are treated as in psurf_eval. No allocation; any number of threads. */
PSURF_API void psurf_curvature(const psurf_patches *patches, const psurf_sample *samples,
                               uint32_t count, psurf_real *gauss, psurf_real *mean);

enum {
    PSURF_TESS_PER_FACE = 1u,           /* every face has vertices of its own; default: welded */
    PSURF_TESS_INDEX16 = 2u             /* uint16_t indices; default: uint32_t */
};
typedef struct psurf_tess_desc {
    uint32_t _start_canary;
    uint32_t rate;                      /* segments per edge, 1..PSURF_MAX_RATE */
    uint32_t flags;
    uint32_t _end_canary;
} psurf_tess_desc;

/* The part of a whole mesh's tessellation that a range of faces writes. Per face: its vertices and
   indices. Welded: vertices are those of the whole mesh, indices those of the range. */
typedef struct psurf_tess_span {
    uint32_t first_vertex, vertex_count;
    size_t first_index, index_count;
} psurf_tess_span;

/* Where a tessellation goes; NULL = skip. The arrays begin at vertex first_vertex and index
   first_index of the whole mesh's tessellation (0 and 0: they hold all of it), so a range can be
   written to memory of its own size: take both from the range's psurf_tess_span. Indices count from
   first_vertex. Strides in bytes, multiples of the size of a real; 0 = tight. */
typedef struct psurf_tess_out {
    psurf_real *p, *n, *shade;          /* n and shade as in psurf_points */
    size_t p_stride, n_stride, shade_stride;
    psurf_sample *where;                /* place of each vertex, for psurf_interpolate; psurf_eval
                                           there gives the same point to rounding, not to the bit */
    void *indices;                      /* triangles, counter-clockwise */
    uint32_t first_vertex;
    size_t first_index;
} psurf_tess_out;

/* Sizes of the tessellation of faces first_face .. first_face+face_count-1; a range beyond the last
   face is cut there. Welded vertices are numbered: one per ring but centres, then rate-1 per edge
   side from the start of its writer on, then the insides face by face. Per face they run
   along corner 0 -> 1 first, then towards the other side; faces of m >= 5 corners sector by sector,
   their centre last, pieces without the line that the one before has. A face has the same triangles
   in the same order either way.
   Returns PSURF_OK; BAD_DESC for canaries, a rate out of range, unknown flags or NULL; TOO_LARGE
   where numbers do not fit 32 bits (16 bits with PSURF_TESS_INDEX16: at most 65535 vertices, so
   0xFFFF never occurs). No allocation; any number of threads. */
PSURF_API psurf_result psurf_tessellate_size(const psurf_topology *topology,
                                             const psurf_tess_desc *desc, uint32_t first_face,
                                             uint32_t face_count, psurf_tess_span *span);

/* Writes the tessellation of a range of faces. Welded, a shared sample is written by the lowest
   face that touches it, whichever range that face is in: all ranges together write every vertex
   once.
   Returns as psurf_tessellate_size. No allocation. Threads: disjoint ranges run concurrently.
   Vertices are not written front to back: what goes to write-combined memory is better made
   elsewhere and copied.
   Positions on shared edges are bit-identical from both sides at every rate. */
PSURF_API psurf_result psurf_tessellate(const psurf_patches *patches, const psurf_tess_desc *desc,
                                        uint32_t first_face, uint32_t face_count,
                                        const psurf_tess_out *out);

/* Interpolates any attribute given per face corner, texture coordinates for instance: linear on
   triangles and sectors (their centre takes the mean of the corners), bilinear on quads.
   corner_values: [sum of face sizes][width] floats in input order. out: [count] times width floats,
   out_stride bytes apart, a multiple of 4; 0 = width floats.
   Samples are treated as in psurf_eval. No allocation; any number of threads. */
PSURF_API void psurf_interpolate(const psurf_topology *topology, const psurf_sample *samples,
                                 uint32_t count, const float *corner_values, uint32_t width,
                                 float *out, size_t out_stride);

/* ---- interrogation --------------------------------------------------------------------------- */

typedef struct psurf_check_result {
    uint64_t samples;                   /* pairs compared */
    uint64_t cracks;                    /* pairs whose positions are not bit-identical */
    uint64_t nonfinite;                 /* samples with a non-finite position or normal */
    uint64_t degenerate;                /* pairs left out of max_normal_deg: see psurf_check */
    double max_normal_deg;              /* largest angle between the two normals of a pair */
    uint32_t worst_face, worst_edge;    /* where it is; PSURF_NONE if nothing was compared */
    uint32_t sharp_edges;               /* edges compared for cracks alone */
    uint32_t fallback_edges;            /* PSURF_EDGE_FALLBACK in a facet beside them */
} psurf_check_result;

/* Compares edges first_edge .. first_edge+edge_count-1 (of psurf_info.edges, then inner_edges) from
   both sides, at rate+1 samples each, exactly as per-face tessellation writes them.
   desc: what the patches were constructed from. Pairs count as degenerate on edges shorter than
   1e-5 of the bounding box diagonal, beside faces with a corner angle below 0.5 degrees, at tips of
   slits (the two sharp edges of a ring less than 0.5 degrees apart), and where a normal is
   zero. Hard edges, and for pm those with a blend ratio of 0 at an end, are compared for cracks
   alone and counted as sharp_edges. Boundary edges have one side and are passed over.
   Returns PSURF_OK, or BAD_DESC as psurf_construct_pass and psurf_tessellate_size. No allocation.
   Threads: any; sums over ranges add up, maxima combine. Every call reads all positions once, for
   the diagonal: few large ranges are cheaper than many small ones. Beyond rate 128 the time grows
   with the square of the rate. */
PSURF_API psurf_result psurf_check(const psurf_patches *patches, const psurf_construct_desc *desc,
                                   uint32_t rate, uint32_t first_edge, uint32_t edge_count,
                                   psurf_check_result *result);

/* Boxes that hold every point psurf_eval and psurf_tessellate give on a range of faces, from the
   convex hull of the Bezier points. min_max: [face_count][6] min x, y, z, max x, y, z. Faces out of
   range are not written. No allocation; any number of threads. */
PSURF_API void psurf_bounds(const psurf_patches *patches, uint32_t first_face, uint32_t face_count,
                            psurf_real *min_max);

/* ---- all at once ----------------------------------------------------------------------------- */

/* A welded triangle mesh of the smooth surface. */
typedef struct psurf_smooth_mesh {
    uint32_t vertex_count;
    size_t index_count;
    psurf_real *positions, *normals;    /* [vertex_count][3] */
    uint32_t *indices;                  /* [index_count] triangles, counter-clockwise */
    psurf_sample *where;                /* [vertex_count] */
    size_t bytes;                       /* of the one block that holds them */
    psurf_allocator allocator;
} psurf_smooth_mesh;

/* For small programs: mesh in, triangles of the scheme pm out. desc->positions must be set, the
   split be PSURF_SPLIT_PM; rate: 1..PSURF_MAX_RATE.
   Returns what the calls it is made of return; *mesh is all zero unless PSURF_OK. Allocates through
   desc->allocator; keeps one block. Any thread. */
PSURF_API psurf_result psurf_smooth(const psurf_mesh_desc *desc, uint32_t rate,
                                    psurf_smooth_mesh *mesh, psurf_error *error);

/* Releases what psurf_smooth returned and zeroes it; NULL and all-zero are fine. */
PSURF_API void psurf_smooth_free(psurf_smooth_mesh *mesh);

/* ---- build facts ----------------------------------------------------------------------------- */

PSURF_API const char *psurf_result_string(psurf_result result);     /* static text, never NULL */
PSURF_API const char *psurf_scheme_name(psurf_scheme scheme);       /* "pm"; NULL if out of range */
PSURF_API psurf_split psurf_scheme_split(psurf_scheme scheme);      /* what it needs; else PM */
PSURF_API const char *psurf_kind_name(psurf_kind kind);             /* "bicubic" ...; or NULL */
PSURF_API const char *psurf_simd_name(void);    /* the instruction set in use: "avx2", "sse2",
                                                   "neon", "scalar"; all give the same bits */
PSURF_API uint32_t psurf_version(void);         /* PSURF_VERSION of the implementation */
PSURF_API uint32_t psurf_abi(void);             /* PSURF_VERSION << 8 | sizeof(psurf_real) */

/* 1 where this build and thread give the bits that every other does; 0 under fast-math, fused
   contraction that the compiler would not give up, x87 registers, or FTZ/DAZ. It asks the
   arithmetic itself. */
PSURF_API int psurf_exact(void);

#ifdef __cplusplus
}
#endif
#endif /* PSURF_H_INCLUDED */

/* >>impl ====================================================================================== */

#if defined(PSURF_IMPLEMENTATION) && !defined(PSURF_IMPLEMENTATION_DONE)
#define PSURF_IMPLEMENTATION_DONE
#define PSURF__IMPLEMENTING
#define PSURF__ONCE                     /* but chapter 7: that once per instruction set */
#endif
#ifdef PSURF__ONCE

#ifndef PSURF_NO_STDLIB
#include <stdlib.h>
#endif
#ifdef PSURF_SQRT
#define PSURF__SQRT(x) PSURF_SQRT(x)
#else
#include <math.h>
#define PSURF__SQRT(x) sqrt(x)     /* of a double; rounded to float it is the float square root */
#endif

/* Instruction sets: float alone is evaluated with more than plain C. */
#define PSURF__IS_float 1
#define PSURF__IS_double 0
#define PSURF__IS_OF(real) PSURF__IS_##real
#define PSURF__IS(real) PSURF__IS_OF(real)
#if !defined(PSURF_NO_SIMD) && PSURF__IS(PSURF_REAL)
#if defined(__SSE2__) || defined(_M_X64)
#define PSURF__SIMD
#define PSURF__SIMD_X86
#include <immintrin.h>
#if defined(_MSC_VER)
#include <intrin.h>
#endif
#elif defined(__aarch64__) && defined(__ARM_NEON) && !defined(__AARCH64EB__)
#define PSURF__SIMD
#include <arm_neon.h>
#endif
#endif

/* Always, but where nothing is optimised: there every copy would take stack of its own. */
#if defined(__has_feature)
#if __has_feature(address_sanitizer) || __has_feature(memory_sanitizer)
#define PSURF__SANITIZED
#endif
#elif defined(__SANITIZE_ADDRESS__)
#define PSURF__SANITIZED
#endif
#if defined(_MSC_VER)
#define PSURF__INLINE __forceinline
#elif defined(__GNUC__) && defined(__OPTIMIZE__) && !defined(PSURF__SANITIZED)
#define PSURF__INLINE inline __attribute__((always_inline))
#else
#define PSURF__INLINE inline
#endif
#if defined(__GNUC__) && !defined(__clang__) && __GNUC__ >= 8
#define PSURF__UNROLL _Pragma("GCC unroll 5")   /* gcc -O2 would not; other compilers know best */
#else
#define PSURF__UNROLL
#endif
/* Sums that fit in registers, and would not if several steps were mixed. */
#if defined(__clang__)
#define PSURF__ROLLED _Pragma("clang loop unroll(disable)")
#elif defined(__GNUC__) && __GNUC__ >= 8
#define PSURF__ROLLED _Pragma("GCC unroll 1")
#else
#define PSURF__ROLLED
#endif
#if defined(__GNUC__)
#define PSURF__LIKELY(condition) __builtin_expect(!!(condition), 1)
#else
#define PSURF__LIKELY(condition) (condition)
#endif

#ifdef PSURF_SELF
#define PSURF__SELF PSURF_SELF
#else
#define PSURF__SELF "patchsurf.h"
#endif

/* The promise of equal bits needs every product rounded before it is added. Compilers may not fuse
   the two here, whatever flags the rest of the program is built with; the state is restored at the
   end of the file. (clang ignores this under -ffast-math and -ffp-contract=fast: psurf_exact.) */
#if defined(__clang__)
#if defined(__x86_64__) || defined(__i386__)
#pragma float_control(push)
#pragma float_control(precise, on)
#endif
#pragma STDC FP_CONTRACT OFF
#elif defined(__GNUC__)
#pragma GCC push_options
#pragma GCC optimize("fp-contract=off", "no-fast-math")
#ifdef __s390__                         /* where -std=c99 would compute floats in double */
#pragma GCC optimize("excess-precision=fast")
#endif
#elif defined(_MSC_VER)
#pragma float_control(precise, on, push)
#pragma fp_contract(off)
#endif

/* The GPU reads these structs as arrays of uint: no padding, fixed order. */
#define PSURF__ASSERT_SIZE(type, size) \
    typedef char psurf__size_of_##type[sizeof(type) == (size) ? 1 : -1]
PSURF__ASSERT_SIZE(psurf_ring, 16);
PSURF__ASSERT_SIZE(psurf_spoke, 12);
PSURF__ASSERT_SIZE(psurf_corner, 12);
PSURF__ASSERT_SIZE(psurf_facet, 8);
PSURF__ASSERT_SIZE(psurf_edge, 8);
PSURF__ASSERT_SIZE(psurf_trig, 2 * sizeof(psurf_real));
PSURF__ASSERT_SIZE(psurf_sample, 8 + 2 * sizeof(psurf_real));

/* >>1 ARITHMETIC ==============================================================================
   Points as values. Every function rounds after every operation and in the order written. */

#define PSURF__R(x) ((psurf_real)(x))

/* A square of a length below which the length needs scaling, and the product of two such squares
   above which it does. */
#define PSURF__SHORT PSURF__R(1e-33)
#define PSURF__LONG PSURF__R(1e36)

typedef struct psurf__v3 { psurf_real x, y, z; } psurf__v3;

static psurf__v3 psurf__get(const psurf_real *p)
{
    psurf__v3 a;
    a.x = p[0];
    a.y = p[1];
    a.z = p[2];
    return a;
}

static void psurf__put(psurf_real *p, psurf__v3 a)
{
    p[0] = a.x;
    p[1] = a.y;
    p[2] = a.z;
}

static psurf__v3 psurf__zero(void)
{
    psurf__v3 a;
    a.x = a.y = a.z = 0;
    return a;
}

static psurf__v3 psurf__add(psurf__v3 a, psurf__v3 b)
{
    a.x += b.x;
    a.y += b.y;
    a.z += b.z;
    return a;
}

static psurf__v3 psurf__sub(psurf__v3 a, psurf__v3 b)
{
    a.x -= b.x;
    a.y -= b.y;
    a.z -= b.z;
    return a;
}

static psurf__v3 psurf__mul(psurf__v3 a, psurf_real s)
{
    a.x *= s;
    a.y *= s;
    a.z *= s;
    return a;
}

/* a + s b */
static psurf__v3 psurf__mad(psurf__v3 a, psurf_real s, psurf__v3 b)
{
    return psurf__add(a, psurf__mul(b, s));
}

/* s a + t b */
static psurf__v3 psurf__mix(psurf_real s, psurf__v3 a, psurf_real t, psurf__v3 b)
{
    return psurf__add(psurf__mul(a, s), psurf__mul(b, t));
}

static psurf_real psurf__dot(psurf__v3 a, psurf__v3 b)
{
    return (a.x * b.x + a.y * b.y) + a.z * b.z;
}

static psurf__v3 psurf__cross(psurf__v3 a, psurf__v3 b)
{
    psurf__v3 c;
    c.x = a.y * b.z - a.z * b.y;
    c.y = a.z * b.x - a.x * b.z;
    c.z = a.x * b.y - a.y * b.x;
    return c;
}

static psurf_real psurf__sqrt(psurf_real x)
{
    return (psurf_real)PSURF__SQRT((double)x);
}

static psurf_real psurf__abs(psurf_real x)
{
    return x < 0 ? -x : x;
}

static int psurf__finite(psurf_real x)
{
    return x - x <= 0 && x - x >= 0;
}

static int psurf__finite3(psurf__v3 a)
{
    return psurf__finite(a.x) && psurf__finite(a.y) && psurf__finite(a.z);
}

/* The same points once more, in vector registers where the compiler can say so, for construction:
   its time goes into adding points. Floats lie in lanes 0 to 2; what lane 3 holds is never stored.
   Doubles, and machines without such registers, take psurf__v3: equal operations, equal bits. */
#if defined(PSURF__SIMD) && defined(__GNUC__)

typedef psurf_real psurf__v4 __attribute__((vector_size(16)));
typedef psurf_real psurf__v4_in_memory __attribute__((vector_size(16), aligned(4), may_alias));
typedef int64_t psurf__pairs __attribute__((vector_size(16)));
typedef int32_t psurf__places __attribute__((vector_size(16)));
typedef int64_t psurf__pair_in_memory __attribute__((aligned(4), may_alias));

/* Four of the lanes of a, 0 to 3, and of b, 4 to 7. */
#if defined(__clang__)
#define PSURF__SHUFFLE(a, b, i, j, k, l) __builtin_shufflevector(a, b, i, j, k, l)
#else
static PSURF__INLINE psurf__places psurf__places_of(int i, int j, int k, int l)
{
    const psurf__places places = {i, j, k, l};
    return places;
}
#define PSURF__SHUFFLE(a, b, i, j, k, l) __builtin_shuffle(a, b, psurf__places_of(i, j, k, l))
#endif

static PSURF__INLINE psurf__v4 psurf__get4(const psurf_real *p)
{
    const psurf__v4 z = {p[2], 0, 0, 0};
    const psurf__pairs a = {*(const psurf__pair_in_memory *)p, ((psurf__pairs)z)[0]};
    return (psurf__v4)a;
}

static PSURF__INLINE void psurf__put4(psurf_real *p, psurf__v4 a)
{
    *(psurf__pair_in_memory *)p = ((psurf__pairs)a)[0];
    p[2] = a[2];
}

/* In one piece, where a fourth real may be read. */
static PSURF__INLINE psurf__v4 psurf__get4_over(const psurf_real *p)
{
    return *(const psurf__v4_in_memory *)p;
}

/* The same where a real before may be read. */
static PSURF__INLINE psurf__v4 psurf__get4_after(const psurf_real *p)
{
    const psurf__v4 a = *(const psurf__v4_in_memory *)(p - 1);
    return PSURF__SHUFFLE(a, a, 1, 2, 3, 3);
}

/* Two points side by side, in two pieces instead of four. */
static PSURF__INLINE void psurf__put4_pair(psurf_real *p, psurf__v4 a, psurf__v4 b)
{
    const psurf__v4 middle = PSURF__SHUFFLE(a, b, 2, 2, 4, 4);
    const psurf__v4 last = PSURF__SHUFFLE(b, b, 1, 2, 1, 2);
    *(psurf__v4_in_memory *)p = PSURF__SHUFFLE(a, middle, 0, 1, 4, 6);
    *(psurf__pair_in_memory *)(p + 4) = ((psurf__pairs)last)[0];
}

static PSURF__INLINE psurf__v4 psurf__add4(psurf__v4 a, psurf__v4 b) { return a + b; }
static PSURF__INLINE psurf__v4 psurf__sub4(psurf__v4 a, psurf__v4 b) { return a - b; }
static PSURF__INLINE psurf__v4 psurf__mul4(psurf__v4 a, psurf_real s) { return a * s; }

#else

typedef psurf__v3 psurf__v4;

static PSURF__INLINE psurf__v4 psurf__get4(const psurf_real *p) { return psurf__get(p); }
static PSURF__INLINE void psurf__put4(psurf_real *p, psurf__v4 a) { psurf__put(p, a); }
static PSURF__INLINE psurf__v4 psurf__get4_over(const psurf_real *p) { return psurf__get(p); }
static PSURF__INLINE psurf__v4 psurf__add4(psurf__v4 a, psurf__v4 b) { return psurf__add(a, b); }
static PSURF__INLINE psurf__v4 psurf__sub4(psurf__v4 a, psurf__v4 b) { return psurf__sub(a, b); }
static PSURF__INLINE psurf__v4 psurf__mul4(psurf__v4 a, psurf_real s) { return psurf__mul(a, s); }

static PSURF__INLINE psurf__v4 psurf__get4_after(const psurf_real *p) { return psurf__get(p); }

static PSURF__INLINE void psurf__put4_pair(psurf_real *p, psurf__v4 a, psurf__v4 b)
{
    psurf__put(p, a);
    psurf__put(p + 3, b);
}

#endif

static PSURF__INLINE psurf__v4 psurf__zero4(void)
{
    const psurf_real zero[4] = {0, 0, 0, 0};
    return psurf__get4(zero);
}

/* a + s b */
static PSURF__INLINE psurf__v4 psurf__mad4(psurf__v4 a, psurf_real s, psurf__v4 b)
{
    return psurf__add4(a, psurf__mul4(b, s));
}

/* s a + t b */
static PSURF__INLINE psurf__v4 psurf__mix4(psurf_real s, psurf__v4 a, psurf_real t, psurf__v4 b)
{
    return psurf__add4(psurf__mul4(a, s), psurf__mul4(b, t));
}

/* a scaled so that its largest component is 1: lengths and products of what follows neither
   overflow nor vanish. Zero and NaN stay what they are. */
static psurf__v3 psurf__scaled(psurf__v3 a)
{
    psurf_real m = psurf__abs(a.x);
    if (psurf__abs(a.y) > m) m = psurf__abs(a.y);
    if (psurf__abs(a.z) > m) m = psurf__abs(a.z);
    if (!(m > 0)) return a;
    a.x /= m;
    a.y /= m;
    a.z /= m;
    return a;
}

/* a at unit length; zero where it has no direction. NaN spreads. */
static psurf__v3 psurf__unit(psurf__v3 a)
{
    psurf_real q = psurf__dot(a, a);
    if (!(q > PSURF__SHORT && q < PSURF__LONG)) {
        a = psurf__scaled(a);
        q = psurf__dot(a, a);
    }
    if (q <= 0) return psurf__zero();
    return psurf__mul(a, 1 / psurf__sqrt(q));
}

/* The sine at which two directions count as parallel. */
#define PSURF__PARALLEL (sizeof(psurf_real) == 4 ? PSURF__R(4e-6) : PSURF__R(8e-15))

/* du x dv at unit length; 0 where the two are parallel to working precision. The common case is one
   cross product and one square root; extreme lengths take the scaled path. */
static psurf__v3 psurf__unit_cross(psurf__v3 du, psurf__v3 dv)
{
    const psurf_real eps = PSURF__PARALLEL;
    psurf__v3 n = psurf__cross(du, dv);
    psurf_real q = psurf__dot(n, n), lengths = psurf__dot(du, du) * psurf__dot(dv, dv);
    if (!(q > PSURF__SHORT && lengths < PSURF__LONG)) {
        du = psurf__scaled(du);
        dv = psurf__scaled(dv);
        n = psurf__cross(du, dv);
        q = psurf__dot(n, n);
        lengths = psurf__dot(du, du) * psurf__dot(dv, dv);
    }
    if (q <= eps * eps * lengths) return psurf__zero();
    return psurf__mul(n, 1 / psurf__sqrt(q));
}

/* Cosine and sine of j/n turns, 0 <= j < n, within a unit in the last place of double. The octant
   is found in integers, so quarter turns are exact and no argument is ever reduced. */
static void psurf__cos_sin(uint32_t j, uint32_t n, double *cosine, double *sine)
{
    static const unsigned char swap[8] = {0, 1, 1, 0, 0, 1, 1, 0};
    static const signed char sign_c[8] = {1, 1, -1, -1, -1, -1, 1, 1};
    static const signed char sign_s[8] = {1, 1, 1, 1, -1, -1, -1, -1};
    uint64_t eighths = (uint64_t)j * 8;
    uint32_t octant = (uint32_t)(eighths / n), rest = (uint32_t)(eighths % n);
    double x, y, c = 0, s = 0;
    int k;
    if (octant & 1) rest = n - rest;                   /* odd octants are measured from their end */
    x = 0.78539816339744830962 * ((double)rest / (double)n);
    y = x * x;
    for (k = 20; k >= 2; k -= 2) {                  /* Taylor: x^20/20! < 4e-21 at an eighth turn */
        c = (1 + c) * (-y / (double)(k * (k - 1)));
        s = (1 + s) * (-y / (double)(k * (k + 1)));
    }
    c = 1 + c;
    s = x + x * s;
    *cosine = (double)sign_c[octant] * (swap[octant] ? s : c);
    *sine = (double)sign_s[octant] * (swap[octant] ? c : s);
}

/* arcsin of 0 <= x <= 1 in radians: three halvings of the angle, then the series. */
static double psurf__asin(double x)
{
    double y;
    int k;
    for (k = 0; k < 3; k++) {
        double rest = 1 - x * x;
        x = x / PSURF__SQRT(2 * (1 + PSURF__SQRT(rest > 0 ? rest : 0)));
    }
    y = x * x;
    return 8 * x * (1 + y * (1.0 / 6 + y * (3.0 / 40 + y * (15.0 / 336 + y * (105.0 / 3456 +
           y * (945.0 / 42240 + y * (10395.0 / 599040)))))));
}

/* >>2 MEMORY ==================================================================================
   The caller's allocator, and blocks that are measured first and carved after. */

static psurf_error psurf__no_error(psurf_result result)
{
    psurf_error e;
    e.result = result;
    e.face = e.corner = e.vertex = e.other = PSURF_NONE;
    e.message = psurf_result_string(result);
    return e;
}

#ifndef PSURF_NO_STDLIB
static void *psurf__malloc(void *ctx, size_t size, size_t align)
{
    (void)ctx;
    (void)align;                                        /* malloc aligns for every type */
    return malloc(size);
}

static void psurf__free(void *ctx, void *memory, size_t size)
{
    (void)ctx;
    (void)size;
    free(memory);
}
#endif

/* The allocator of a descriptor, the default filled in; 0 if it is half set or there is none. */
static int psurf__allocator(const psurf_allocator *given, psurf_allocator *out)
{
    *out = *given;
    if ((given->alloc == NULL) != (given->release == NULL)) return 0;
#ifndef PSURF_NO_STDLIB
    if (given->alloc == NULL) {
        out->alloc = psurf__malloc;
        out->release = psurf__free;
    }
#endif
    return out->alloc != NULL;
}

static void psurf__clear(void *memory, size_t size)
{
    unsigned char *bytes = (unsigned char *)memory;
    size_t i;
    for (i = 0; i < size; i++) bytes[i] = 0;
}

/* A block that holds several arrays. Carving with base NULL only measures; the same calls with
   memory hand out the arrays. A size beyond the address space sticks at SIZE_MAX. */
typedef struct psurf__block {
    char *base;
    size_t used;
} psurf__block;

static void *psurf__carve(psurf__block *block, uint64_t count, size_t size, size_t align)
{
    size_t at = block->used;
    void *array;
    if (at > SIZE_MAX - align || count > (SIZE_MAX - align - at) / size) {
        block->used = SIZE_MAX;
        return NULL;
    }
    at = (at + align - 1) / align * align;
    block->used = at + (size_t)count * size;
    array = block->base ? block->base + at : NULL;
    return array;
}

#define PSURF__CARVE(block, type, count) ((type *)psurf__carve(block, count, sizeof(type), 16))
#define PSURF__CARVE_TABLE(block, type, count) \
    ((type *)psurf__carve(block, count, sizeof(type), 256))

/* Allocates a block that was measured, and rewinds it; at least one byte, so NULL is a failure. */
static psurf_result psurf__allocate(const psurf_allocator *allocator, psurf__block *block,
                                    size_t *bytes)
{
    if (block->used == SIZE_MAX) return PSURF_TOO_LARGE;
    *bytes = block->used ? block->used : 1;
    block->used = 0;
    block->base = (char *)allocator->alloc(allocator->ctx, *bytes, 16);
    return block->base ? PSURF_OK : PSURF_OUT_OF_MEMORY;
}

/* >>3 TOPOLOGY ================================================================================
   Faces in, tables out: pair the half-edges, walk the rings, sort the facets by kind. An input
   corner stands for the half-edge from its vertex to the next corner's. Everything after this
   chapter trusts the tables. */

/* Boundary curves that schemes have in common: those with equal ones go together on one object. */
typedef enum psurf__curves {
    PSURF__NO_CURVES, PSURF__PN_CURVES, PSURF__WM_CURVES, PSURF__HYBRID_CURVES, PSURF__PNG1_CURVES
} psurf__curves;

typedef struct psurf__start { uint32_t corner, triangles, quads; } psurf__start;

struct psurf_topology {
    psurf_allocator allocator;
    psurf_info info;
    psurf_ring *rings;
    psurf_spoke *spokes;
    psurf_corner *corners;
    psurf_facet *facets;
    psurf_edge *edges;
    psurf_trig *trig;
    psurf_real *blends;                 /* NULL where all are 2/3 */
    uint32_t *face_facet;
    uint32_t *centres;
    uint32_t *ring_normals;             /* NULL without face_normals */
    psurf__start *starts;             /* what lies before each face; NULL where all have one size */
    psurf_split split;
    int mixed;                          /* facets are filed under the kinds of their schemes */
    psurf__curves curves;               /* of a mix */
    uint32_t uniform_size;
    uint32_t corner_count, trig_count;
    size_t table_bytes;                 /* from rings to the end of the last table */
    uint32_t vertex_rings;              /* rings in the order of vertices; further fans follow */
    uint32_t kind_first[PSURF_KIND_COUNT + 1];
    uint32_t kind_first_corner[PSURF_KIND_COUNT + 1];
};

/* Corners, triangles and quads before a face; the rest of the faces before it have 5 or more. */
static psurf__start psurf__face_start(const psurf_topology *t, uint32_t face)
{
    psurf__start s;
    if (t->starts) return t->starts[face];
    s.corner = face * t->uniform_size;
    s.triangles = t->uniform_size == 3 ? face : 0;
    s.quads = t->uniform_size == 4 ? face : 0;
    return s;
}

static uint32_t psurf__face_size(const psurf_topology *t, uint32_t face)
{
    if (!t->starts) return t->uniform_size;
    return t->starts[face + 1].corner - t->starts[face].corner;
}

/* The kind that a facet is filed under: that of its patch, but for triangles of point-normal
   schemes, which are all filed as PSURF_PN_TRI unless they are mixed. See psurf__patch_kind. */
static psurf_kind psurf__facet_kind(const psurf_topology *t, uint32_t facet)
{
    uint32_t k = 0;
    while (facet >= t->kind_first[k + 1]) k++;
    return (psurf_kind)k;
}

/* The corner of a face that is split from an apex. */
static uint32_t psurf__face_apex(const psurf_topology *t, uint32_t face)
{
    return t->facets[t->face_facet[face]].piece >> 16 & 0x7FFFu;
}

static int psurf__is_split(const psurf_topology *t, uint32_t face)
{
    return (t->facets[t->face_facet[face]].piece & PSURF_SPLIT_FACE) != 0;
}

/* What the chapters share about kinds; how they are evaluated stands in chapter 6. */
typedef struct psurf__kind_facts { const char *name; uint32_t sides, points; } psurf__kind_facts;

static const psurf__kind_facts psurf__kind_table[PSURF_KIND_COUNT] = {
    {"bicubic", 4, 16}, {"polar", 3, 13}, {"p3", 3, 19}, {"p4", 4, 25}, {"p5", 5, 31},
    {"pn_tri", 3, 16}, {"pn_quad", 4, 25}, {"npatch", 3, 19}, {"hybrid", 3, 22}, {"png1", 3, 25},
    {"ribbon", 3, 19}, {"ribbon_b2", 3, 19}
};

static uint32_t psurf__kind_sides(psurf_kind kind) { return psurf__kind_table[kind].sides; }

/* The spokes of a ring, and the one after a spoke: PSURF_NONE beyond the end of an open ring. */
static uint32_t psurf__valence(const psurf_ring *ring)
{
    return ring->valence & PSURF_RING_VALENCE;
}

static uint32_t psurf__next_spoke(const psurf_ring *ring, uint32_t spoke)
{
    if (spoke - ring->first_spoke + 1 < psurf__valence(ring)) return spoke + 1;
    return ring->valence & PSURF_RING_OPEN ? PSURF_NONE : ring->first_spoke;
}

/* The spoke whose blend ratio counts: that of the next ring where two rings share one. */
static uint32_t psurf__ratio_spoke(const psurf_topology *t, const psurf_ring *ring, uint32_t spoke)
{
    if (psurf__next_spoke(ring, spoke) != PSURF_NONE || t->spokes[spoke].after == PSURF_NONE)
        return spoke;
    return t->spokes[spoke].after;
}

/* The facet that a corner of the facet tables belongs to, and which of its edges starts there. */
static uint32_t psurf__corner_facet(const psurf_topology *t, uint32_t corner, uint32_t *edge)
{
    uint32_t k = 0, place;
    while (corner >= t->kind_first_corner[k + 1]) k++;
    place = corner - t->kind_first_corner[k];
    *edge = place % psurf__kind_sides((psurf_kind)k);
    return t->kind_first[k] + place / psurf__kind_sides((psurf_kind)k);
}

/* The corner whose half-edge runs along the same edge the other way, or PSURF_NONE. Not for edges
   between the pieces of pm's split faces, which are in no table. */
static uint32_t psurf__corner_across(const psurf_topology *t, uint32_t corner)
{
    const psurf_edge *edge = &t->edges[t->corners[corner].edge & ~PSURF_WRITER];
    return edge->corner == corner ? edge->other : edge->corner;
}

/* First corner of a facet of a known kind. */
static uint32_t psurf__facet_corner(const psurf_topology *t, psurf_kind kind, uint32_t facet)
{
    return t->kind_first_corner[kind] + (facet - t->kind_first[kind]) * psurf__kind_sides(kind);
}

/* From the table of schemes in chapter 5; no curves if scheme is out of range. */
static psurf__curves psurf__scheme_curves(uint32_t scheme);
static psurf_kind psurf__scheme_triangle(uint32_t scheme);

/* What a topology is made from. Built in two steps, each with memory of its own: the faces as they
   came in, then the facets that they or their pieces became. */
typedef struct psurf__builder {
    const psurf_mesh_desc *desc;
    psurf_error error;
    uint32_t vertices, faces, edges, hard_edges, boundary_edges, edges_cut, valence2;
    uint32_t uniform_size;              /* of all faces, or 0 */
    uint32_t splits, centres, inner_edges;      /* split faces, and what that makes */
    uint32_t facets, corners;           /* of the facets once they are known */
    uint32_t ring_count, vertex_rings, spoke_count, max_valence, trig_count;

    const uint32_t *vertex;             /* per corner */
    const uint32_t *normal;             /* per corner, or NULL */
    uint32_t *next, *prev;              /* per corner: corner of the same facet */
    uint32_t *twin;                     /* per corner: the half-edge that runs the other way */
    uint32_t *edge;                     /* per corner: number of the edge */
    uint32_t *order;                    /* per corner: sorted by edge; then the face of each */
    uint32_t *first_corner;             /* per vertex and centre */
    uint32_t *edge_tag;                 /* per edge: number of its tag, or PSURF_NONE */
    unsigned char *edge_hard;           /* per edge */
    unsigned char *vertex_flag;         /* per vertex: named in desc->corners */
    unsigned char *face_split;          /* per face */
    uint32_t *face_corner;              /* per face: first corner of its facets */
    uint32_t *face_apex;                /* per face: the corner where its pieces begin */

    uint32_t *count;                    /* work space: per corner, vertex, edge or valence */
    uint32_t *ring, *spoke;             /* per corner: number of each in the tables */
    psurf_ring *rings;                  /* per ring */
    uint32_t *ring_corner;              /* per ring: the corner at its first spoke */
    unsigned char *ring_flag;           /* per ring */
    unsigned char *face_kind;           /* per face */
} psurf__builder;

static psurf_result psurf__fail(psurf__builder *b, psurf_result result, uint32_t face,
                                uint32_t corner, uint32_t vertex, uint32_t other)
{
    b->error.result = result;
    b->error.face = face;
    b->error.corner = corner;
    b->error.vertex = vertex;
    b->error.other = other;
    b->error.message = psurf_result_string(result);
    return result;
}

/* As psurf__fail, where no place in the mesh is to blame. */
static psurf_result psurf__fail_nowhere(psurf__builder *b, psurf_result result)
{
    return psurf__fail(b, result, PSURF_NONE, PSURF_NONE, PSURF_NONE, PSURF_NONE);
}

static uint32_t psurf__size_of_face(const psurf_mesh_desc *desc, uint32_t face)
{
    return desc->face_sizes ? desc->face_sizes[face] : desc->uniform_size;
}

/* As psurf__fail, at an input corner, naming the edge that starts there. */
static psurf_result psurf__fail_edge(psurf__builder *b, psurf_result result, uint32_t corner)
{
    uint32_t face = 0, first = 0;
    while (corner - first >= psurf__size_of_face(b->desc, face))
        first += psurf__size_of_face(b->desc, face++);
    return psurf__fail(b, result, face, corner - first, b->vertex[corner],
                       b->vertex[b->next[corner]]);
}

/* ---- the faces ---- */

/* Counts vertices, faces and corners. */
static psurf_result psurf__count_mesh(psurf__builder *b)
{
    const psurf_mesh_desc *d = b->desc;
    const uint32_t sizes = d->face_sizes ? d->face_count : d->face_count > 0;
    const uint32_t times = d->face_sizes ? 1 : d->face_count;   /* equal sizes are looked at once */
    const uint32_t most = d->split == PSURF_SPLIT_PM ? PSURF_MAX_FACE_SIZE
                                                     : PSURF_MAX_FACE_SIZE / 2;
    uint64_t corners = 0;
    uint32_t f;
    b->uniform_size = sizes ? psurf__size_of_face(d, 0) : 0;
    for (f = 0; f < sizes; f++) {
        const uint32_t size = psurf__size_of_face(d, f);
        if (size < 3 || size > most)
            return psurf__fail(b, PSURF_BAD_FACE, f, PSURF_NONE, PSURF_NONE, PSURF_NONE);
        if (size != b->uniform_size) b->uniform_size = 0;
        corners += (uint64_t)size * times;
    }
    if (corners >= PSURF_MAX_CORNERS || d->vertex_count >= PSURF_MAX_CORNERS)
        return psurf__fail_nowhere(b, PSURF_TOO_LARGE);
    b->vertices = d->vertex_count;
    b->faces = d->face_count;
    b->corners = (uint32_t)corners;
    return PSURF_OK;
}

/* Pointers, canaries and flags, then the counts. Reads no index yet. */
static psurf_result psurf__check_desc(psurf__builder *b)
{
    const psurf_mesh_desc *d = b->desc;
    const uint32_t known = PSURF_DEFAULT_BLEND | PSURF_CUT_BAD_EDGES;
    const psurf_real blend = d->default_blend;
    if (d->_start_canary || d->_end_canary || (d->flags & ~known) ||
        (d->face_count && !d->face_vertices) || (d->edge_count && !d->edges) ||
        (d->corner_count && !d->corners) || d->position_stride % sizeof(psurf_real) ||
        (uint32_t)d->split >= PSURF_SPLIT_COUNT ||
        (d->face_schemes && d->split != PSURF_SPLIT_TRIANGLES) ||
        ((d->flags & PSURF_DEFAULT_BLEND) && !(blend >= 0 && blend <= 1)))
        return psurf__fail_nowhere(b, PSURF_BAD_DESC);
    return psurf__count_mesh(b);
}

static psurf_result psurf__check_schemes(psurf__builder *b)
{
    const unsigned char *schemes = b->desc->face_schemes;
    uint32_t f;
    for (f = 0; schemes && f < b->faces; f++)
        if (psurf__scheme_curves(schemes[f]) == PSURF__NO_CURVES ||
            psurf__scheme_curves(schemes[f]) != psurf__scheme_curves(schemes[0]))
            return psurf__fail(b, PSURF_BAD_SCHEME, f, PSURF_NONE, PSURF_NONE, PSURF_NONE);
    return PSURF_OK;
}

static void psurf__carve_faces(psurf__builder *b, psurf__block *block)
{
    const uint64_t c = b->corners, v = b->vertices;
    b->next = PSURF__CARVE(block, uint32_t, c);
    b->prev = PSURF__CARVE(block, uint32_t, c);
    b->twin = PSURF__CARVE(block, uint32_t, c);
    b->edge = PSURF__CARVE(block, uint32_t, c);
    b->order = PSURF__CARVE(block, uint32_t, c);
    b->ring = PSURF__CARVE(block, uint32_t, c);
    b->edge_tag = PSURF__CARVE(block, uint32_t, c);
    b->first_corner = PSURF__CARVE(block, uint32_t, v);
    b->count = PSURF__CARVE(block, uint32_t, (c > v ? c : v) + 1);
    b->edge_hard = PSURF__CARVE(block, unsigned char, c);
    b->vertex_flag = PSURF__CARVE(block, unsigned char, v);
    b->face_split = PSURF__CARVE(block, unsigned char, b->faces);
    b->face_corner = PSURF__CARVE(block, uint32_t, b->faces);
    if (b->desc->split != PSURF_SPLIT_PM) b->face_apex = PSURF__CARVE(block, uint32_t, b->faces);
    b->face_kind = PSURF__CARVE(block, unsigned char, b->faces);
}

static psurf_result psurf__check_positions(psurf__builder *b)
{
    const psurf_mesh_desc *d = b->desc;
    size_t stride = d->position_stride ? d->position_stride / sizeof(psurf_real) : 3;
    uint32_t v;
    if (!d->positions) return PSURF_OK;
    for (v = 0; v < b->vertices; v++)
        if (b->first_corner[v] != PSURF_NONE &&
            !psurf__finite3(psurf__get(d->positions + v * stride)))
            return psurf__fail(b, PSURF_NOT_FINITE, PSURF_NONE, PSURF_NONE, v, PSURF_NONE);
    return PSURF_OK;
}

/* Validates the indices and links the corners of each face. */
static psurf_result psurf__link_faces(psurf__builder *b)
{
    uint32_t *seen = b->count;                          /* per vertex: last face that named it */
    uint32_t f, v, c = 0;
    for (v = 0; v < b->vertices; v++) {
        seen[v] = PSURF_NONE;
        b->first_corner[v] = PSURF_NONE;
    }
    for (f = 0; f < b->faces; f++) {
        uint32_t first = c, end = c + psurf__size_of_face(b->desc, f);
        for (; c < end; c++) {
            v = b->vertex[c];
            if (v >= b->vertices)
                return psurf__fail(b, PSURF_BAD_INDEX, f, c - first, v, PSURF_NONE);
            if (seen[v] == f) return psurf__fail(b, PSURF_BAD_FACE, f, c - first, v, PSURF_NONE);
            seen[v] = f;
            if (b->normal && b->normal[c] >= b->desc->normal_count)
                return psurf__fail(b, PSURF_BAD_NORMAL, f, c - first, v, PSURF_NONE);
            if (b->first_corner[v] == PSURF_NONE) b->first_corner[v] = c;
            b->next[c] = c + 1 == end ? first : c + 1;
            b->prev[c] = c == first ? end - 1 : c - 1;
        }
    }
    return PSURF_OK;
}

/* The lower (which = 0) or higher vertex of a corner's half-edge. */
static uint32_t psurf__edge_end(const psurf__builder *b, uint32_t corner, int which)
{
    uint32_t v = b->vertex[corner], w = b->vertex[b->next[corner]];
    return (v < w) == (which == 0) ? v : w;
}

/* Stable counting sort of corners by one end of their half-edge; from NULL = all in order. */
static void psurf__sort_corners(psurf__builder *b, const uint32_t *from, uint32_t *to, int which)
{
    uint32_t *count = b->count, v, c, sum = 0;
    for (v = 0; v < b->vertices; v++) count[v] = 0;
    for (c = 0; c < b->corners; c++) count[psurf__edge_end(b, c, which)]++;
    for (v = 0; v < b->vertices; v++) {
        uint32_t n = count[v];
        count[v] = sum;
        sum += n;
    }
    for (c = 0; c < b->corners; c++) {
        uint32_t corner = from ? from[c] : c;
        to[count[psurf__edge_end(b, corner, which)]++] = corner;
    }
}

static int psurf__same_edge(const psurf__builder *b, uint32_t c, uint32_t other)
{
    return psurf__edge_end(b, c, 0) == psurf__edge_end(b, other, 0) &&
           psurf__edge_end(b, c, 1) == psurf__edge_end(b, other, 1);
}

/* Makes edges of the n half-edges at a place in order, all between the same two vertices. */
static psurf_result psurf__pair(psurf__builder *b, const uint32_t *half_edges, uint32_t n)
{
    const uint32_t c = half_edges[0], other = n > 1 ? half_edges[1] : PSURF_NONE;
    const int bad = n > 2 || (n == 2 && b->vertex[c] == b->vertex[other]);
    uint32_t i;
    if (n == 2 && !bad) {
        b->twin[c] = other;
        b->twin[other] = c;
        b->edge[c] = b->edge[other] = b->edges++;
        return PSURF_OK;
    }
    if (bad && !(b->desc->flags & PSURF_CUT_BAD_EDGES))
        return psurf__fail_edge(b, n > 2 ? PSURF_NON_MANIFOLD : PSURF_BAD_WINDING,
                                half_edges[n > 2 ? 2 : 1]);
    for (i = 0; i < n; i++) {                           /* open: every face keeps an edge */
        b->twin[half_edges[i]] = PSURF_NONE;
        b->edge[half_edges[i]] = b->edges++;
    }
    b->boundary_edges += n;
    b->edges_cut += (uint32_t)bad;
    return PSURF_OK;
}

/* Pairs half-edges by sorting them by (lower, higher) vertex: linear, whatever the valences. Edges
   are numbered in that order, which does not depend on the order of the faces. */
static psurf_result psurf__pair_half_edges(psurf__builder *b)
{
    psurf_result result = PSURF_OK;
    uint32_t i, n;
    psurf__sort_corners(b, NULL, b->ring, 1);           /* ring: not yet in use */
    psurf__sort_corners(b, b->ring, b->order, 0);
    for (i = 0; i < b->corners && result == PSURF_OK; i += n) {
        n = 1;
        while (i + n < b->corners && psurf__same_edge(b, b->order[i], b->order[i + n])) n++;
        result = psurf__pair(b, b->order + i, n);
    }
    return result;
}

/* The place in order of the first half-edge between two vertices, or PSURF_NONE. */
static uint32_t psurf__find_edge(const psurf__builder *b, uint32_t v, uint32_t w)
{
    uint32_t lower = v < w ? v : w, higher = v < w ? w : v, low = 0, high = b->corners;
    while (low < high) {
        uint32_t middle = low + (high - low) / 2, c = b->order[middle];
        uint32_t x = psurf__edge_end(b, c, 0), y = psurf__edge_end(b, c, 1);
        if (x < lower || (x == lower && y < higher)) low = middle + 1;
        else high = middle;
    }
    if (low == b->corners || psurf__edge_end(b, b->order[low], 0) != lower ||
        psurf__edge_end(b, b->order[low], 1) != higher) return PSURF_NONE;
    return low;
}

static int psurf__tag_ok(const psurf_edge_tag *tag)
{
    if (tag->flags & ~(uint32_t)(PSURF_HARD | PSURF_BLEND)) return 0;
    if (!(tag->flags & PSURF_BLEND)) return 1;
    return tag->blend0 >= 0 && tag->blend0 <= 1 && tag->blend1 >= 0 && tag->blend1 <= 1;
}

/* What the caller says of edges and vertices. */
static psurf_result psurf__apply_tags(psurf__builder *b)
{
    const psurf_mesh_desc *d = b->desc;
    uint32_t i, v;
    for (i = 0; i < b->edges; i++) {
        b->edge_tag[i] = PSURF_NONE;
        b->edge_hard[i] = 0;
    }
    for (v = 0; v < b->vertices; v++) b->vertex_flag[v] = 0;
    for (i = 0; i < d->edge_count; i++) {
        const psurf_edge_tag *tag = &d->edges[i];
        uint32_t at = psurf__find_edge(b, tag->v0, tag->v1), first = at;
        if (at == PSURF_NONE || b->edge_tag[b->edge[b->order[at]]] != PSURF_NONE ||
            !psurf__tag_ok(tag))
            return psurf__fail(b, PSURF_BAD_EDGE, PSURF_NONE, PSURF_NONE, tag->v0, tag->v1);
        for (; at < b->corners && psurf__same_edge(b, b->order[first], b->order[at]); at++) {
            const uint32_t c = b->order[at];            /* all parts of an edge that was cut */
            b->edge_tag[b->edge[c]] = i;
            b->edge_hard[b->edge[c]] = (tag->flags & PSURF_HARD) && b->twin[c] != PSURF_NONE;
        }
        b->hard_edges += b->edge_hard[b->edge[b->order[first]]];
    }
    for (i = 0; i < d->corner_count; i++) {
        if (d->corners[i] >= b->vertices)
            return psurf__fail(b, PSURF_BAD_CORNER, PSURF_NONE, PSURF_NONE, d->corners[i],
                               PSURF_NONE);
        b->vertex_flag[d->corners[i]] = 1;
    }
    return PSURF_OK;
}

/* Edges whose sides name different normals are hard, but to pm. */
static void psurf__find_folds(psurf__builder *b)
{
    const uint32_t *normal = b->normal;
    uint32_t c;
    if (!normal || b->desc->split == PSURF_SPLIT_PM) return;
    for (c = 0; c < b->corners; c++) {
        const uint32_t twin = b->twin[c];
        if (twin == PSURF_NONE || twin < c || b->edge_hard[b->edge[c]]) continue;
        if (normal[c] == normal[b->next[twin]] && normal[b->next[c]] == normal[twin]) continue;
        b->edge_hard[b->edge[c]] = 1;
        b->hard_edges++;
    }
}

static void psurf__count_valences(psurf__builder *b)
{
    uint32_t *count = b->count, v, c;
    for (v = 0; v < b->vertices; v++) count[v] = 0;
    for (c = 0; c < b->corners; c++)
        if (b->twin[c] == PSURF_NONE || b->twin[c] > c) {
            count[b->vertex[c]]++;
            count[b->vertex[b->next[c]]]++;
        }
    for (v = 0; v < b->vertices; v++)
        if (count[v] > b->max_valence) b->max_valence = count[v];
}

/* ---- fans ---- */

/* The next corner of a vertex clockwise, counter-clockwise; PSURF_NONE beyond a boundary. */
static uint32_t psurf__clockwise(const psurf__builder *b, uint32_t c)
{
    return b->twin[c] == PSURF_NONE ? PSURF_NONE : b->next[b->twin[c]];
}

static uint32_t psurf__counter_clockwise(const psurf__builder *b, uint32_t c)
{
    return b->twin[b->prev[c]];
}

/* Whether the half-edge at a corner lies between two pieces of a face. */
static int psurf__is_inner(const psurf__builder *b, uint32_t c) { return b->edge[c] >= b->edges; }

/* Whether the spoke at a corner separates two sides of a fan. Between pieces nothing does. */
static int psurf__sharp(const psurf__builder *b, uint32_t c)
{
    return b->twin[c] == PSURF_NONE || (!psurf__is_inner(b, c) && b->edge_hard[b->edge[c]]);
}

/* All facets around a vertex that are connected through edges. */
typedef struct psurf__fan {
    uint32_t start;                     /* at a sharp spoke if there is one */
    uint32_t facets, sharp;             /* sharp spokes, both boundary edges among them */
    int open;
} psurf__fan;

static psurf__fan psurf__find_fan(const psurf__builder *b, uint32_t corner)
{
    psurf__fan fan;
    uint32_t c = corner;
    do {
        fan.start = c;
        c = psurf__clockwise(b, c);
    } while (c != PSURF_NONE && c != corner);
    fan.open = c == PSURF_NONE;
    if (!fan.open) fan.start = corner;
    fan.facets = 0;
    fan.sharp = (uint32_t)fan.open;
    c = fan.start;
    do {
        fan.facets++;
        if (psurf__sharp(b, c)) {
            if (!fan.open && fan.sharp == 0) fan.start = c;
            fan.sharp++;
        }
        c = psurf__counter_clockwise(b, c);
    } while (c != PSURF_NONE && c != (fan.open ? PSURF_NONE : corner));
    return fan;
}

/* ---- faces that are split: in pm round their centre ([PM] has no rule for them: ours), else
   into quads and triangles that all begin at the corner of the lowest vertex ([PN] 2: "by
   splitting"; the order is ours) ---- */

/* Corners from which on every face is split. */
static uint32_t psurf__split_size(psurf_split split)
{
    return split == PSURF_SPLIT_PM ? 6 : split == PSURF_SPLIT_PN ? 5 : 4;
}

/* Pieces of a split face, and corners of piece p. */
static uint32_t psurf__piece_count(psurf_split split, uint32_t size)
{
    if (split == PSURF_SPLIT_PM) return size;
    return split == PSURF_SPLIT_PN ? (size - 1) / 2 : size - 2;
}

static uint32_t psurf__piece_size(psurf_split split, uint32_t size, uint32_t p)
{
    return split == PSURF_SPLIT_PN && 2 * p + 3 < size ? 4 : 3;
}

/* Marks faces to be split: by their corners; for pm, at interior vertices of two edges and alone on
   their side of a crease too. Splitting only adds facets to vertices. */
static void psurf__mark_splits(psurf__builder *b)
{
    const psurf_split split = b->desc->split;
    uint32_t *face = b->order, f, c = 0, v, i;          /* the order has served its purpose */
    for (f = 0; f < b->faces; f++) {
        const uint32_t size = psurf__size_of_face(b->desc, f);
        b->face_split[f] = size >= psurf__split_size(split);
        for (i = 0; i < size; i++) face[c++] = f;
    }
    for (c = 0; c < b->corners; c++) b->ring[c] = 0;    /* ring: visited */
    for (c = 0; c < b->corners; c++) {
        psurf__fan fan;
        if (b->ring[c]) continue;
        fan = psurf__find_fan(b, c);
        v = b->vertex[c];
        b->valence2 += !fan.open && fan.facets == 2;
        i = fan.start;
        do {
            const uint32_t next = psurf__counter_clockwise(b, i);
            b->ring[i] = 1;
            if (split == PSURF_SPLIT_PM && !fan.open &&
                (fan.facets == 2 || (fan.sharp == 2 && !b->vertex_flag[v] &&
                                     psurf__sharp(b, i) && psurf__sharp(b, next))))
                b->face_split[face[i]] = 1;
            i = next;
        } while (i != PSURF_NONE && i != fan.start);
    }
}

static uint32_t psurf__face_pieces(const psurf__builder *b, uint32_t face)
{
    if (!b->face_split[face]) return 1;
    return psurf__piece_count(b->desc->split, psurf__size_of_face(b->desc, face));
}

static uint32_t psurf__facet_size(const psurf__builder *b, uint32_t face, uint32_t piece)
{
    const uint32_t size = psurf__size_of_face(b->desc, face);
    return b->face_split[face] ? psurf__piece_size(b->desc->split, size, piece) : size;
}

/* Where the facets of each face begin among the corners, and how many there are of everything. */
static psurf_result psurf__count_facets(psurf__builder *b)
{
    uint64_t corners = 0;
    uint32_t f;
    for (f = 0; f < b->faces; f++) {
        const uint32_t size = psurf__size_of_face(b->desc, f), pieces = psurf__face_pieces(b, f);
        b->face_corner[f] = (uint32_t)corners;
        b->splits += b->face_split[f];
        b->facets += pieces;
        if (b->desc->split == PSURF_SPLIT_PM) {
            corners += b->face_split[f] ? 3 * size : size;
        } else {                                        /* each inner edge gives two corners more */
            corners += size + 2 * (pieces - 1);
            b->inner_edges += pieces - 1;
        }
        if (corners >= PSURF_MAX_CORNERS) return psurf__fail_nowhere(b, PSURF_TOO_LARGE);
    }
    b->centres = b->desc->split == PSURF_SPLIT_PM ? b->splits : 0;
    b->corners = (uint32_t)corners;
    return PSURF_OK;
}

/* First corner of a piece of a face. */
static uint32_t psurf__piece_start(const psurf__builder *b, uint32_t face, uint32_t piece)
{
    return b->face_corner[face] + piece * psurf__facet_size(b, face, 0);
}

/* Where half-edge j of a face lies that is split from its apex, counted from there: the piece, and
   the corner of the piece. */
static uint32_t psurf__fan_corner(psurf_split split, uint32_t size, uint32_t j, uint32_t *piece)
{
    const uint32_t last = psurf__piece_count(split, size) - 1;
    const uint32_t per_piece = psurf__piece_size(split, size, 0) - 2;
    *piece = j == 0 ? 0 : j == size - 1 ? last : (j - 1) / per_piece;
    if (j == 0) return 0;
    return j == size - 1 ? psurf__piece_size(split, size, last) - 1 : 1 + (j - 1) % per_piece;
}

/* The corner of a face where its fan of pieces begins: that of the lowest vertex. */
static uint32_t psurf__apex(const uint32_t *vertices, uint32_t size)
{
    uint32_t i, apex = 0;
    for (i = 1; i < size; i++)
        if (vertices[i] < vertices[apex]) apex = i;
    return apex;
}

/* The corner that the input corner number i of a split face becomes: that of the piece where its
   half-edge lies. */
static uint32_t psurf__piece_corner(const psurf__builder *b, uint32_t face, uint32_t apex,
                                    uint32_t i)
{
    const uint32_t size = psurf__size_of_face(b->desc, face);
    uint32_t piece = i, corner = 0;
    if (b->desc->split != PSURF_SPLIT_PM)
        corner = psurf__fan_corner(b->desc->split, size, (i + size - apex) % size, &piece);
    return psurf__piece_start(b, face, piece) + corner;
}

/* New arrays of the builder, per corner. */
typedef struct psurf__pieces { uint32_t *vertex, *normal; } psurf__pieces;

/* An inner edge: half-edges c and twin, each the other's. */
static void psurf__join(psurf__builder *b, uint32_t c, uint32_t twin, uint32_t edge)
{
    b->twin[c] = twin;
    b->twin[twin] = c;
    b->edge[c] = b->edge[twin] = edge;
}

static void psurf__link_piece(psurf__builder *b, uint32_t first, uint32_t size)
{
    uint32_t k;
    for (k = 0; k < size; k++) {
        b->next[first + k] = first + (k + 1) % size;
        b->prev[first + k] = first + (k + size - 1) % size;
    }
}

/* Pieces of a face in a fan round its centre; in: its first input corner. */
static void psurf__split_round(psurf__builder *b, const psurf__pieces *to, uint32_t face,
                               uint32_t centre)
{
    const uint32_t size = psurf__size_of_face(b->desc, face), first = b->face_corner[face];
    uint32_t i;
    for (i = 0; i < size; i++) {
        const uint32_t c = first + 3 * i;
        to->vertex[c + 1] = to->vertex[first + 3 * ((i + 1) % size)];
        to->vertex[c + 2] = centre;
        psurf__join(b, c + 1, first + (3 * i + 5) % (3 * size), PSURF_INNER_EDGE);
        psurf__link_piece(b, c, 3);
    }
    b->first_corner[centre] = first + 2;
}

/* Pieces of a face in a fan from its apex. Half-edges that were there before have their vertices
   already; new ones leave the apex, or end there. */
static void psurf__split_fan(psurf__builder *b, const psurf__pieces *to, uint32_t face,
                             uint32_t *inner)
{
    const uint32_t pieces = psurf__face_pieces(b, face);
    uint32_t p, last = 0;
    for (p = 0; p < pieces; p++) {
        const uint32_t first = psurf__piece_start(b, face, p);
        const uint32_t size = psurf__facet_size(b, face, p);
        psurf__link_piece(b, first, size);
        if (p > 0) {
            to->vertex[first] = to->vertex[b->face_corner[face]];
            to->vertex[last] = to->vertex[first + 1];
            if (to->normal) {
                to->normal[first] = to->normal[b->face_corner[face]];
                to->normal[last] = to->normal[first + 1];
            }
            psurf__join(b, first, last, b->edges + b->hard_edges + (*inner)++);
        }
        last = first + size - 1;
    }
}

/* Links the facets into new arrays of the builder, from the faces in the old ones. */
static void psurf__split_faces(psurf__builder *b, const psurf__builder *old,
                               const psurf__pieces *to)
{
    uint32_t f, i, in = 0, centre = b->vertices, inner = 0;
    uint32_t *renamed = old->ring;                      /* per input corner */
    for (f = 0; f < b->faces; f++) {
        const uint32_t size = psurf__size_of_face(b->desc, f), first = in;
        const uint32_t apex = b->centres ? 0 : psurf__apex(old->vertex + first, size);
        if (!b->centres) b->face_apex[f] = apex;
        for (i = 0; i < size; i++)
            renamed[in++] = b->face_split[f] ? psurf__piece_corner(b, f, apex, i)
                                             : b->face_corner[f] + i;
    }
    for (f = 0, in = 0; f < b->faces; f++) {
        const uint32_t size = psurf__size_of_face(b->desc, f);
        for (i = 0; i < size; i++, in++) {
            const uint32_t c = renamed[in], twin = old->twin[in];
            to->vertex[c] = old->vertex[in];
            if (to->normal) to->normal[c] = old->normal[in];
            b->edge[c] = old->edge[in];
            b->twin[c] = twin == PSURF_NONE ? PSURF_NONE : renamed[twin];
        }
        if (!b->face_split[f]) psurf__link_piece(b, b->face_corner[f], size);
        else if (b->centres) psurf__split_round(b, to, f, centre++);
        else psurf__split_fan(b, to, f, &inner);
    }
    for (i = 0; i < b->vertices; i++)
        b->first_corner[i] = old->first_corner[i] == PSURF_NONE ? PSURF_NONE
                                                                : renamed[old->first_corner[i]];
}

static void psurf__carve_facets(psurf__builder *b, psurf__block *block, psurf__pieces *pieces)
{
    const uint64_t c = b->corners, v = (uint64_t)b->vertices + b->centres;
    const uint64_t nominal = c + c / 2;                 /* corners of k facets count 4k; k <= c/3 */
    b->count = PSURF__CARVE(block, uint32_t, (nominal > v ? nominal : v) + 2);
    b->ring = PSURF__CARVE(block, uint32_t, c);
    b->spoke = PSURF__CARVE(block, uint32_t, c);
    b->rings = PSURF__CARVE(block, psurf_ring, c);
    b->ring_corner = PSURF__CARVE(block, uint32_t, c);
    b->ring_flag = PSURF__CARVE(block, unsigned char, c);
    if (!b->splits) return;
    b->first_corner = PSURF__CARVE(block, uint32_t, v);
    b->next = PSURF__CARVE(block, uint32_t, c);
    b->prev = PSURF__CARVE(block, uint32_t, c);
    b->twin = PSURF__CARVE(block, uint32_t, c);
    b->edge = PSURF__CARVE(block, uint32_t, c);
    pieces->vertex = PSURF__CARVE(block, uint32_t, c);
    if (b->normal) pieces->normal = PSURF__CARVE(block, uint32_t, c);
}

/* ---- rings ---- */

static uint32_t psurf__ring_facets(const psurf_ring *ring)
{
    return (ring->valence & PSURF_RING_VALENCE) - ((ring->valence & PSURF_RING_OPEN) != 0);
}

/* The valence that formulas see: of the closed ring that an open one is a part of. A crease spans
   half a turn, a corner a quarter. */
static uint32_t psurf__nominal_valence(const psurf_ring *ring)
{
    const uint32_t n = psurf__ring_facets(ring);
    if (!(ring->valence & PSURF_RING_OPEN)) return n;
    return ring->valence & PSURF_RING_CORNER ? 4 * n : 2 * n;
}

/* Makes a ring of the corners from start on: all of a closed fan, or those before the next sharp
   spoke. Returns the first corner beyond, PSURF_NONE at a boundary. */
static uint32_t psurf__make_ring(psurf__builder *b, uint32_t start, uint32_t flags)
{
    psurf_ring *ring = &b->rings[b->ring_count];
    uint32_t c = start, n = 0;
    do {
        b->ring[c] = b->ring_count;
        b->spoke[c] = b->spoke_count + n++;
        c = psurf__counter_clockwise(b, c);
    } while (c != PSURF_NONE && c != start && !((flags & PSURF_RING_OPEN) && psurf__sharp(b, c)));
    if (flags & PSURF_RING_OPEN) n++;
    ring->point = b->vertex[start];
    ring->first_spoke = b->spoke_count;
    ring->valence = n | flags;
    ring->trig = 0;
    b->ring_corner[b->ring_count++] = start;
    b->spoke_count += n;
    return c;
}

/* Nominal angle of the face at a corner, in units of 6 degrees. A split face counts as it came in,
   at the first of its two pieces there; six pieces or more are taken for a hexagon. */
static uint32_t psurf__corner_angle(const psurf__builder *b, uint32_t c)
{
    static const unsigned char angle[7] = {0, 0, 0, 10, 15, 18, 20};
    const uint32_t third = b->next[b->next[c]];
    uint32_t size = b->next[third] == c ? 3 : b->next[b->next[third]] == c ? 4 : 5, at;
    if (psurf__is_inner(b, c)) return 0;
    if (psurf__is_inner(b, b->prev[c])) {               /* the third corner is the centre */
        at = psurf__counter_clockwise(b, third);
        for (size = 1; at != third && size < 6; size++) at = psurf__counter_clockwise(b, at);
    }
    return angle[size];
}

/* Nominal angle of the faces from start to the next sharp spoke. */
static uint64_t psurf__wedge_weight(const psurf__builder *b, uint32_t start)
{
    uint64_t weight = 0;
    uint32_t c = start;
    do {
        weight += psurf__corner_angle(b, c);
        c = psurf__counter_clockwise(b, c);
    } while (c != PSURF_NONE && c != start && !psurf__sharp(b, c));
    return weight;
}

/* The wedge that a T-junction leaves straight: at least half of the vertex and half a turn, and the
   only such one. Returns its first corner, or PSURF_NONE. */
static uint32_t psurf__wide_wedge(const psurf__builder *b, const psurf__fan *fan)
{
    uint64_t total = 0, widest = 0;
    uint32_t c = fan->start, wide = PSURF_NONE, ties = 0;
    do {
        if (psurf__sharp(b, c)) {
            const uint64_t weight = psurf__wedge_weight(b, c);
            total += weight;
            if (weight == widest) ties++;
            if (weight > widest) {
                widest = weight;
                wide = c;
                ties = 0;
            }
        }
        c = psurf__counter_clockwise(b, c);
    } while (c != PSURF_NONE && c != fan->start);
    if (widest < 30 || 2 * widest < total || (ties && 2 * widest == total)) return PSURF_NONE;
    return wide;
}

/* Whether a fan is one face at a boundary, or the pieces of one that was split. */
static int psurf__has_one_face(const psurf__builder *b, const psurf__fan *fan)
{
    uint32_t c = fan->start, i;
    if (!fan->open) return 0;
    for (i = 1; i < fan->facets; i++) {
        c = psurf__counter_clockwise(b, c);
        if (!psurf__is_inner(b, c)) return 0;
    }
    return 1;
}

/* The rings of one fan: a closed one, or one per wedge between sharp spokes. */
static psurf_result psurf__walk_fan(psurf__builder *b, uint32_t corner)
{
    const psurf__fan fan = psurf__find_fan(b, corner);
    const uint32_t v = b->vertex[corner];
    const int flagged = v < b->vertices && b->vertex_flag[v];
    const int is_corner = fan.sharp > 2 || flagged || psurf__has_one_face(b, &fan);
    uint32_t c = fan.start, edges = fan.facets + (uint32_t)fan.open, wide = PSURF_NONE;
    if (edges > PSURF_MAX_VALENCE)
        return psurf__fail(b, PSURF_TOO_LARGE, PSURF_NONE, PSURF_NONE, v, PSURF_NONE);
    if (fan.sharp < 2) {
        psurf__make_ring(b, c, 0);
        return PSURF_OK;
    }
    if (fan.sharp > 2 && !flagged && b->desc->split == PSURF_SPLIT_PM)
        wide = psurf__wide_wedge(b, &fan);
    do {
        uint32_t flags = PSURF_RING_OPEN;
        if (is_corner) flags |= c == wide ? PSURF_RING_WIDE : PSURF_RING_CORNER;
        c = psurf__make_ring(b, c, flags);
    } while (c != PSURF_NONE && c != fan.start);
    return PSURF_OK;
}

/* Rings in the order of vertices, then those of the further fans of non-manifold vertices, last
   those of the centres. */
static psurf_result psurf__walk_rings(psurf__builder *b)
{
    psurf_result result = PSURF_OK;
    uint32_t v, c;
    for (c = 0; c < b->corners; c++) b->ring[c] = PSURF_NONE;
    for (v = 0; v < b->vertices && result == PSURF_OK; v++)
        if (b->first_corner[v] != PSURF_NONE) result = psurf__walk_fan(b, b->first_corner[v]);
    b->vertex_rings = b->ring_count;
    for (c = 0; c < b->corners && result == PSURF_OK; c++)
        if (b->ring[c] == PSURF_NONE && b->vertex[c] < b->vertices) result = psurf__walk_fan(b, c);
    for (; v < b->vertices + b->centres && result == PSURF_OK; v++)
        result = psurf__walk_fan(b, b->first_corner[v]);
    return result;
}

/* Rows of trigonometry: one run per nominal valence that occurs, in increasing order. */
static psurf_result psurf__assign_trig(psurf__builder *b)
{
    uint64_t rows = 0;
    uint32_t n, r, most = 0;
    for (r = 0; r < b->ring_count; r++) {
        n = psurf__nominal_valence(&b->rings[r]);
        if (n > most) most = n;
    }
    for (n = 0; n <= most; n++) b->count[n] = 0;
    for (r = 0; r < b->ring_count; r++) b->count[psurf__nominal_valence(&b->rings[r])] = 1;
    for (n = 0; n <= most; n++)
        if (b->count[n]) {
            b->count[n] = (uint32_t)rows;
            rows += (uint64_t)n + 1;
        }
    if (rows > 0xFFFFFFFFu) return psurf__fail_nowhere(b, PSURF_TOO_LARGE);
    b->trig_count = (uint32_t)rows;
    for (r = 0; r < b->ring_count; r++)
        b->rings[r].trig = b->count[psurf__nominal_valence(&b->rings[r])];
    return PSURF_OK;
}

/* Polar vertices: no sharp spoke, all facets triangles, all neighbours of nominal valence 4;
   neither of two neighbours that both qualify (they are 4-valent themselves, and make good P3
   corners). The pieces of a split face must be of one kind, so of their corners only the centre
   can be a pole. */
static void psurf__find_poles(psurf__builder *b)
{
    enum { NOT_CANDIDATE = 1, BESIDE_CANDIDATE = 2 };
    uint32_t c, r;
    if (b->desc->split != PSURF_SPLIT_PM) return;
    for (r = 0; r < b->ring_count; r++)
        b->ring_flag[r] = b->rings[r].valence & PSURF_RING_OPEN ? NOT_CANDIDATE : 0;
    for (c = 0; c < b->corners; c++) {
        const uint32_t end = b->next[c], third = b->next[end];
        const int in_piece = psurf__is_inner(b, c) || psurf__is_inner(b, third);
        if (b->next[third] != c || psurf__nominal_valence(&b->rings[b->ring[end]]) != 4 ||
            psurf__sharp(b, c) || (in_piece && b->vertex[c] < b->vertices))
            b->ring_flag[b->ring[c]] |= NOT_CANDIDATE;
    }
    for (c = 0; c < b->corners; c++)
        if (!(b->ring_flag[b->ring[b->next[c]]] & NOT_CANDIDATE))
            b->ring_flag[b->ring[c]] |= BESIDE_CANDIDATE;
    for (r = 0; r < b->ring_count; r++)
        if (!b->ring_flag[r]) b->rings[r].valence |= PSURF_RING_POLAR;
}

/* ---- facets and tables ---- */

/* What triangles of a face are filed under, in the split families of point-normal schemes. */
static psurf_kind psurf__triangle_kind(const psurf__builder *b, uint32_t face)
{
    const unsigned char *schemes = b->desc->face_schemes;
    return schemes ? psurf__scheme_triangle(schemes[face]) : PSURF_PN_TRI;
}

/* The kind of a facet of pm, of size corners from first on, and in *pole the corner that is the
   pole. */
static psurf_kind psurf__classify_pm(const psurf__builder *b, uint32_t first, uint32_t size,
                                     uint32_t *pole)
{
    uint32_t i, regular = 0;
    for (i = 0; i < size; i++) {
        const psurf_ring *ring = &b->rings[b->ring[first + i]];
        if (ring->valence & PSURF_RING_POLAR) {
            *pole = i;
            return PSURF_POLAR;
        }
        regular += psurf__nominal_valence(ring) == 4;
    }
    if (size == 4 && regular == 4) return PSURF_BICUBIC;
    return (psurf_kind)(PSURF_P3 + (size - 3));
}

/* The kind that a piece of a face is filed under. In pm all pieces of a face are of one. */
static psurf_kind psurf__classify(const psurf__builder *b, uint32_t face, uint32_t piece,
                                  uint32_t *pole)
{
    const uint32_t size = psurf__facet_size(b, face, piece);
    if (b->desc->split == PSURF_SPLIT_PM)
        return psurf__classify_pm(b, psurf__piece_start(b, face, piece), size, pole);
    return size == 4 ? PSURF_PN_QUAD : psurf__triangle_kind(b, face);
}

static void psurf__sort_facets(psurf__builder *b, psurf_topology *t)
{
    uint32_t count[PSURF_KIND_COUNT] = {0}, f, k, pole = 0;
    for (f = 0; f < b->faces; f++) {
        const uint32_t pieces = psurf__face_pieces(b, f);
        const psurf_kind kind = psurf__classify(b, f, 0, &pole);
        const psurf_kind last = b->centres ? kind : psurf__classify(b, f, pieces - 1, &pole);
        b->face_kind[f] = (unsigned char)kind;
        count[kind] += pieces - 1;
        count[last]++;
        if (b->face_split[f]) t->info.ngon_faces++;
        else t->info.kind_faces[kind]++;
    }
    for (k = 0; k < PSURF_KIND_COUNT; k++) {
        t->kind_first[k + 1] = t->kind_first[k] + count[k];
        t->kind_first_corner[k + 1] =
            t->kind_first_corner[k] + count[k] * psurf__kind_sides((psurf_kind)k);
    }
}

/* Components: union of the vertices of each face, with path halving. */
static uint32_t psurf__find_root(uint32_t *parent, uint32_t v)
{
    while (parent[v] != v) v = parent[v] = parent[parent[v]];
    return v;
}

static uint32_t psurf__count_components(psurf__builder *b)
{
    const uint32_t vertices = b->vertices + b->centres;
    uint32_t *parent = b->count, v, c, n = 0;
    for (v = 0; v < vertices; v++) parent[v] = v;
    for (c = 0; c < b->corners; c++) {
        uint32_t r = psurf__find_root(parent, b->vertex[c]);
        uint32_t s = psurf__find_root(parent, b->vertex[b->next[c]]);
        if (r < s) parent[s] = r;
        else parent[r] = s;
    }
    for (v = 0; v < vertices; v++) n += parent[v] == v && b->first_corner[v] != PSURF_NONE;
    return n;
}

static int psurf__has_blends(const psurf_mesh_desc *desc)
{
    uint32_t i;
    if (desc->flags & PSURF_DEFAULT_BLEND) return 1;
    for (i = 0; i < desc->edge_count; i++)
        if (desc->edges[i].flags & PSURF_BLEND) return 1;
    return 0;
}

/* The object, and the tables behind it in one block for upload. */
static void psurf__carve_topology(const psurf__builder *b, psurf_topology *t, psurf__block *block)
{
    if (!b->uniform_size) t->starts = PSURF__CARVE(block, psurf__start, (uint64_t)b->faces + 1);
    psurf__carve(block, 0, 1, 256);
    t->table_bytes = block->used;
    t->rings = PSURF__CARVE_TABLE(block, psurf_ring, b->ring_count);
    t->spokes = PSURF__CARVE_TABLE(block, psurf_spoke, b->spoke_count);
    t->corners = PSURF__CARVE_TABLE(block, psurf_corner, b->corners);
    t->facets = PSURF__CARVE_TABLE(block, psurf_facet, b->facets);
    t->edges = PSURF__CARVE_TABLE(block, psurf_edge,
                                  (uint64_t)b->edges + b->hard_edges + b->inner_edges);
    t->trig = PSURF__CARVE_TABLE(block, psurf_trig, b->trig_count);
    t->face_facet = PSURF__CARVE_TABLE(block, uint32_t, b->faces);
    t->centres = PSURF__CARVE_TABLE(block, uint32_t, b->centres);
    if (b->normal && b->desc->split != PSURF_SPLIT_PM)
        t->ring_normals = PSURF__CARVE_TABLE(block, uint32_t, b->ring_count);
    if (psurf__has_blends(b->desc))
        t->blends = PSURF__CARVE_TABLE(block, psurf_real, b->spoke_count);
    t->table_bytes = block->used - t->table_bytes;
}

static void psurf__fill_trig(const psurf__builder *b, psurf_topology *t)
{
    uint32_t r, j;
    for (r = 0; r < b->ring_count; r++) {
        const uint32_t n = psurf__nominal_valence(&b->rings[r]);
        psurf_trig *rows = t->trig + b->rings[r].trig;
        double c, s, lambda;
        if (rows[0].c > 0) continue;                /* this valence is done: the block was zeroed */
        for (j = 0; j < n; j++) {
            psurf__cos_sin(j, n, &c, &s);
            rows[1 + j].c = (psurf_real)c;
            rows[1 + j].s = (psurf_real)s;
        }
        psurf__cos_sin(1, n, &c, &s);
        lambda = (c + 5 + PSURF__SQRT((c + 9) * (c + 1))) / 16;                  /* eq. 15 */
        rows[0].c = (psurf_real)(9 / ((double)n * ((double)n + 5)));            /* eq. 13 */
        rows[0].s = (psurf_real)(1 / (2 * (double)n * lambda));                 /* eq. 15 */
    }
}

static void psurf__fill_starts(const psurf__builder *b, psurf_topology *t)
{
    psurf__start s = {0, 0, 0};
    uint32_t f;
    t->uniform_size = b->uniform_size;
    if (!t->starts) return;
    for (f = 0; f < b->faces; f++) {
        uint32_t size = psurf__size_of_face(b->desc, f);
        t->starts[f] = s;
        s.corner += size;
        s.triangles += size == 3;
        s.quads += size == 4;
    }
    t->starts[b->faces] = s;
}

/* The side of its edge that a corner lies on: hard edges have a second one, numbered after all
   edges in the order of faces. Inner edges of fans from an apex come last. */
static void psurf__fill_edge(psurf__builder *b, psurf_topology *t, uint32_t c, uint32_t at)
{
    const uint32_t e = b->edge[c], twin = b->twin[c];
    uint32_t side = e;
    if (e == PSURF_INNER_EDGE) {
        t->corners[at].edge = e;
        return;
    }
    if (twin != PSURF_NONE && twin < c) {
        t->edges[e].other = at;
        if (psurf__is_inner(b, c) || !b->edge_hard[e]) {
            t->corners[at].edge = e;
            return;
        }
        side = b->edges + t->info.hard_edges++;
        t->edges[side].other = t->edges[e].corner;
    } else {
        t->edges[side].other = PSURF_NONE;
    }
    t->edges[side].corner = at;
    t->corners[at].edge = side | PSURF_WRITER;
}

/* One corner of the facet tables from corner c of the builder; at: its place in the table. */
static void psurf__fill_corner(psurf__builder *b, psurf_topology *t, uint32_t c, uint32_t at)
{
    psurf_spoke *spoke = &t->spokes[b->spoke[c]];
    t->corners[at].ring = b->ring[c];
    t->corners[at].spoke = b->spoke[c];
    psurf__fill_edge(b, t, c, at);
    spoke->end = b->vertex[b->next[c]];
    spoke->after = b->vertex[b->next[b->next[c]]];
    spoke->before = b->vertex[b->prev[b->prev[c]]];
}

/* Faces come in order, so the first face at a ring is the lowest: it writes the welded vertex. */
static void psurf__fill_writer(psurf__builder *b, psurf_topology *t, uint32_t c, uint32_t at)
{
    if (b->count[b->ring[c]]++ == 0) t->corners[at].ring |= PSURF_WRITER;
}

/* One piece of a face, to the next place of its kind. */
static void psurf__fill_facet(psurf__builder *b, psurf_topology *t, uint32_t face, uint32_t piece,
                              uint32_t *next)
{
    uint32_t i, pole = 0;
    const psurf_kind kind = psurf__classify(b, face, piece, &pole);
    const uint32_t facet = next[kind]++, size = psurf__kind_sides(kind);
    const uint32_t c = psurf__piece_start(b, face, piece), at = psurf__facet_corner(t, kind, facet);
    t->facets[facet].face = face;
    t->facets[facet].piece = piece | (b->face_split[face] ? PSURF_SPLIT_FACE : 0);
    if (kind == PSURF_POLAR) t->facets[facet].piece |= (pole + 1) % 3 << 16;
    if (b->face_split[face] && !b->centres) t->facets[facet].piece |= b->face_apex[face] << 16;
    for (i = 0; i < size; i++) {
        psurf__fill_corner(b, t, c + i, at + i);
        if (!psurf__is_inner(b, c + i)) psurf__fill_writer(b, t, c + i, at + i);
    }
}

static void psurf__fill_facets(psurf__builder *b, psurf_topology *t)
{
    uint32_t next[PSURF_KIND_COUNT], f, i, p, r, centre = 0;
    for (i = 0; i < PSURF_KIND_COUNT; i++) next[i] = t->kind_first[i];
    for (r = 0; r < b->ring_count; r++) b->count[r] = 0;
    for (f = 0; f < b->faces; f++) {
        const uint32_t pieces = psurf__face_pieces(b, f);
        t->face_facet[f] = next[b->face_kind[f]];
        if (b->face_split[f] && b->centres) t->centres[centre++] = f;
        for (p = 0; p < pieces; p++) psurf__fill_facet(b, t, f, p, next);
    }
}

/* All corners of a ring name the same normal: else an edge between them were hard. */
static void psurf__fill_normals(const psurf__builder *b, psurf_topology *t)
{
    uint32_t r;
    if (!t->ring_normals) return;
    for (r = 0; r < b->ring_count; r++) t->ring_normals[r] = b->normal[b->ring_corner[r]];
}

static int psurf__is_wide(const psurf__builder *b, uint32_t c)
{
    return c != PSURF_NONE && (b->rings[b->ring[c]].valence & PSURF_RING_WIDE);
}

/* The last spoke of an open ring starts no facet of it. Its other fields name the spoke that
   carries the blend ratio of both, and the far spoke of a wide neighbour, whose tangents shared
   spokes have. A fan has one wide side at most, and then never just one other side in a closed
   fan: so no ring has it on both sides. */
static void psurf__fill_last_spokes(psurf__builder *b, psurf_topology *t)
{
    uint32_t r, i;
    for (r = 0; r < b->ring_count; r++) {
        psurf_ring *ring = &t->rings[r];
        const uint32_t n = psurf__ring_facets(ring);
        uint32_t c = b->ring_corner[r], before, after;
        psurf_spoke *last;
        if (!(ring->valence & PSURF_RING_OPEN)) continue;
        before = psurf__clockwise(b, c);
        for (i = 1; i < n; i++) c = psurf__counter_clockwise(b, c);
        after = psurf__counter_clockwise(b, c);
        last = &t->spokes[ring->first_spoke + n];
        last->end = b->vertex[b->prev[c]];
        last->after = after == PSURF_NONE ? PSURF_NONE : b->spoke[after];
        last->before = PSURF_NONE;
        if (psurf__is_wide(b, after)) {
            ring->valence |= PSURF_RING_WIDE_NEXT;
            last->before = last->after + psurf__ring_facets(&b->rings[b->ring[after]]);
        } else if (psurf__is_wide(b, before)) {
            ring->valence |= PSURF_RING_WIDE_LAST;
            last->before = b->rings[b->ring[before]].first_spoke;
        }
    }
}

/* The blend ratio at vertex v of the edge with number e. */
static psurf_real psurf__blend_of(const psurf__builder *b, uint32_t e, uint32_t v)
{
    const psurf_mesh_desc *d = b->desc;
    const psurf_edge_tag *tag = NULL;
    if (e < b->edges && b->edge_tag[e] != PSURF_NONE) tag = &d->edges[b->edge_tag[e]];
    if (tag && (tag->flags & PSURF_BLEND)) return tag->v0 == v ? tag->blend0 : tag->blend1;
    return d->flags & PSURF_DEFAULT_BLEND ? d->default_blend : PSURF__R(2.0 / 3.0);
}

static void psurf__fill_blends(const psurf__builder *b, psurf_topology *t)
{
    uint32_t c;
    if (!t->blends) return;
    for (c = 0; c < b->corners; c++) {
        const psurf_ring *ring = &b->rings[b->ring[c]];
        const uint32_t spoke = b->spoke[c], v = b->vertex[c];
        t->blends[spoke] = psurf__blend_of(b, b->edge[c], v);
        if ((ring->valence & PSURF_RING_OPEN) &&
            spoke - ring->first_spoke + 1 == psurf__ring_facets(ring))
            t->blends[spoke + 1] = psurf__blend_of(b, b->edge[b->prev[c]], v);
    }
}

static void psurf__fill_info(psurf__builder *b, psurf_topology *t, size_t bytes, size_t scratch)
{
    psurf_info *info = &t->info;
    info->vertices = b->vertices;
    info->faces = b->faces;
    info->edges = b->edges;
    info->boundary_edges = b->boundary_edges;
    info->edges_cut = b->edges_cut;
    info->components = psurf__count_components(b);
    info->max_valence = b->max_valence;
    info->valence2 = b->valence2;
    info->rings = b->ring_count;
    info->spokes = b->spoke_count;
    info->facets = b->facets;
    info->centres = b->centres;
    info->edge_sides = b->edges + b->hard_edges;
    info->inner_edges = b->inner_edges;
    info->bytes = bytes;
    info->peak_bytes = bytes + scratch;
    t->corner_count = b->corners;
    t->trig_count = b->trig_count;
    t->vertex_rings = b->vertex_rings;
    t->split = b->desc->split;
    t->mixed = b->desc->face_schemes != NULL;
    if (t->mixed && b->faces) t->curves = psurf__scheme_curves(b->desc->face_schemes[0]);
}

/* ---- the steps ---- */

/* From faces to connected faces. */
static psurf_result psurf__connect(psurf__builder *b)
{
    psurf_result result = psurf__link_faces(b);
    if (result == PSURF_OK) result = psurf__check_schemes(b);
    if (result == PSURF_OK) result = psurf__check_positions(b);
    if (result == PSURF_OK) result = psurf__pair_half_edges(b);
    if (result == PSURF_OK) result = psurf__apply_tags(b);
    if (result != PSURF_OK) return result;
    psurf__find_folds(b);
    psurf__count_valences(b);
    psurf__mark_splits(b);
    return psurf__count_facets(b);
}

/* Allocates the topology and fills it from a builder with rings; scratch: bytes held meanwhile. */
static psurf_result psurf__make_topology(psurf__builder *b, const psurf_allocator *allocator,
                                         size_t scratch, psurf_topology **out)
{
    psurf_topology sizes, *t;
    psurf__block block = {NULL, 0};
    psurf_result result;
    size_t bytes;
    uint32_t r;
    PSURF__CARVE(&block, psurf_topology, 1);
    psurf__carve_topology(b, &sizes, &block);
    result = psurf__allocate(allocator, &block, &bytes);
    if (result != PSURF_OK) return psurf__fail_nowhere(b, result);
    psurf__clear(block.base, bytes);
    t = PSURF__CARVE(&block, psurf_topology, 1);
    psurf__carve_topology(b, t, &block);
    t->allocator = *allocator;
    for (r = 0; r < b->ring_count; r++) t->rings[r] = b->rings[r];
    psurf__sort_facets(b, t);
    psurf__fill_starts(b, t);
    psurf__fill_trig(b, t);
    psurf__fill_facets(b, t);
    psurf__fill_last_spokes(b, t);
    psurf__fill_blends(b, t);
    psurf__fill_normals(b, t);
    psurf__fill_info(b, t, bytes, scratch);
    *out = t;
    return PSURF_OK;
}

/* From connected faces to the topology, in a scratch block of its own. held: bytes of the other. */
static psurf_result psurf__build_facets(psurf__builder *b, const psurf_allocator *allocator,
                                        size_t held, psurf_topology **topology)
{
    const psurf__builder faces = *b;
    psurf__block block = {NULL, 0};
    psurf_result result;
    psurf__pieces pieces = {NULL, NULL};
    size_t bytes;
    psurf__carve_facets(b, &block, &pieces);
    result = psurf__allocate(allocator, &block, &bytes);
    if (result != PSURF_OK) return psurf__fail_nowhere(b, result);
    psurf__carve_facets(b, &block, &pieces);
    if (b->splits) {
        psurf__split_faces(b, &faces, &pieces);
        b->vertex = pieces.vertex;
        if (b->normal) b->normal = pieces.normal;
    }
    result = psurf__walk_rings(b);
    if (result == PSURF_OK) result = psurf__assign_trig(b);
    if (result == PSURF_OK) {
        psurf__find_poles(b);
        result = psurf__make_topology(b, allocator, held + bytes, topology);
    }
    allocator->release(allocator->ctx, block.base, bytes);
    return result;
}

/* Runs a checked builder. */
static psurf_result psurf__build(psurf__builder *b, const psurf_allocator *allocator,
                                 psurf_topology **topology)
{
    psurf__block block = {NULL, 0};
    psurf_result result;
    size_t bytes;
    psurf__carve_faces(b, &block);
    result = psurf__allocate(allocator, &block, &bytes);
    if (result != PSURF_OK) return psurf__fail_nowhere(b, result);
    psurf__carve_faces(b, &block);
    b->vertex = b->desc->face_vertices;
    b->normal = b->desc->face_normals;
    result = psurf__connect(b);
    if (result == PSURF_OK) result = psurf__build_facets(b, allocator, bytes, topology);
    allocator->release(allocator->ctx, block.base, bytes);
    return result;
}

/* The first facet of a kind whose face is not before one. */
static uint32_t psurf__first_facet(const psurf_topology *t, psurf_kind kind, uint32_t face)
{
    uint32_t low = t->kind_first[kind], high = t->kind_first[kind + 1];
    while (low < high) {
        const uint32_t middle = low + (high - low) / 2;
        if (t->facets[middle].face < face) low = middle + 1;
        else high = middle;
    }
    return low;
}

/* The facet of a piece of a split face. Pieces follow each other; but where quads leave a last
   triangle, that stands among the triangles. */
static uint32_t psurf__piece_facet(const psurf_topology *t, uint32_t face, uint32_t size,
                                   uint32_t piece)
{
    const uint32_t first = t->face_facet[face];
    if (piece > 0 && psurf__piece_size(t->split, size, piece) !=
                         psurf__piece_size(t->split, size, 0))
        return psurf__first_facet(t, PSURF_PN_TRI, face);
    return first + piece;
}

/* The corner where half-edge j starts of a face that is split from its apex, counted from there. */
static const psurf_corner *psurf__find_fan_corner(const psurf_topology *t, uint32_t face,
                                                  uint32_t size, uint32_t j)
{
    uint32_t piece;
    const uint32_t corner = psurf__fan_corner(t->split, size, j, &piece);
    const uint32_t facet = psurf__piece_facet(t, face, size, piece);
    return t->corners + psurf__facet_corner(t, psurf__facet_kind(t, facet), facet) + corner;
}

PSURF_API psurf_result psurf_topology_create(const psurf_mesh_desc *desc, psurf_topology **topology,
                                             psurf_error *error)
{
    psurf__builder b;
    psurf_allocator allocator;
    psurf_result result = PSURF_BAD_DESC;
    psurf__clear(&b, sizeof(b));
    b.error = psurf__no_error(PSURF_BAD_DESC);
    b.desc = desc;
    if (topology) *topology = NULL;
    if (desc && topology && psurf__allocator(&desc->allocator, &allocator)) {
        result = psurf__check_desc(&b);
        if (result == PSURF_OK) result = psurf__build(&b, &allocator, topology);
    }
    if (error) *error = result == PSURF_OK ? psurf__no_error(PSURF_OK) : b.error;
    return result;
}

PSURF_API void psurf_topology_destroy(psurf_topology *topology)
{
    psurf_allocator allocator;
    if (!topology) return;
    allocator = topology->allocator;
    allocator.release(allocator.ctx, topology, topology->info.bytes);
}

PSURF_API void psurf_topology_info(const psurf_topology *topology, psurf_info *info)
{
    *info = topology->info;
}

static psurf_table psurf__table(const void *data, uint32_t count, size_t stride)
{
    psurf_table table;
    table.data = data;
    table.count = data ? count : 0;
    table.stride = (uint32_t)stride;
    return table;
}

PSURF_API void psurf_topology_tables(const psurf_topology *topology, psurf_tables *tables)
{
    const psurf_topology *t = topology;
    uint32_t k;
    tables->block = t->rings;
    tables->block_bytes = t->table_bytes;
    tables->rings = psurf__table(t->rings, t->info.rings, sizeof(psurf_ring));
    tables->spokes = psurf__table(t->spokes, t->info.spokes, sizeof(psurf_spoke));
    tables->corners = psurf__table(t->corners, t->corner_count, sizeof(psurf_corner));
    tables->facets = psurf__table(t->facets, t->info.facets, sizeof(psurf_facet));
    tables->edges = psurf__table(t->edges, t->info.edge_sides + t->info.inner_edges,
                                 sizeof(psurf_edge));
    tables->trig = psurf__table(t->trig, t->trig_count, sizeof(psurf_trig));
    tables->blends = psurf__table(t->blends, t->info.spokes, sizeof(psurf_real));
    tables->face_facet = psurf__table(t->face_facet, t->info.faces, sizeof(uint32_t));
    tables->centres = psurf__table(t->centres, t->info.centres, sizeof(uint32_t));
    tables->ring_normals = psurf__table(t->ring_normals, t->info.rings, sizeof(uint32_t));
    for (k = 0; k <= PSURF_KIND_COUNT; k++) {
        tables->kind_first[k] = t->kind_first[k];
        tables->kind_first_corner[k] = t->kind_first_corner[k];
    }
    tables->version = PSURF_TABLE_VERSION;
}

static uint32_t psurf__spoke_in_ring(const psurf_topology *t, uint32_t ring, uint32_t end)
{
    const psurf_ring *r = &t->rings[ring];
    uint32_t j, n = psurf__valence(r);
    for (j = 0; j < n; j++)
        if (t->spokes[r->first_spoke + j].end == end)
            return psurf__ratio_spoke(t, r, r->first_spoke + j);
    return PSURF_NONE;
}

PSURF_API uint32_t psurf_find_spoke(const psurf_topology *topology, uint32_t v0, uint32_t v1)
{
    const psurf_topology *t = topology;
    uint32_t low = 0, high = t->vertex_rings, r, spoke = PSURF_NONE;
    while (low < high) {
        uint32_t middle = low + (high - low) / 2;
        if (t->rings[middle].point < v0) low = middle + 1;
        else high = middle;
    }
    for (; low < t->vertex_rings && t->rings[low].point == v0 && spoke == PSURF_NONE; low++)
        spoke = psurf__spoke_in_ring(t, low, v1);
    for (r = t->vertex_rings; r < t->info.rings - t->info.centres && spoke == PSURF_NONE; r++)
        if (t->rings[r].point == v0) spoke = psurf__spoke_in_ring(t, r, v1);
    return spoke;
}

/* >>4 VERTEX DATA =============================================================================
   Per ring, into the scratch: v, and per spoke t_j and f_j. Whatever two facets share comes from
   here: computed once, read by both. */

static psurf_real *psurf__scratch(const psurf_patches *p, size_t offset, size_t index)
{
    return (psurf_real *)(void *)((char *)p->scratch + offset) + index;
}

static psurf_real *psurf__centre(const psurf_patches *p, uint32_t centre)
{
    return psurf__scratch(p, p->layout.centre_offset, 3 * (size_t)centre);
}

static psurf_real *psurf__limit(const psurf_patches *p, uint32_t ring)
{
    return psurf__scratch(p, p->layout.limit_offset, 3 * (size_t)ring);
}

static psurf_real *psurf__vertex_normal(const psurf_patches *p, uint32_t ring)
{
    return psurf__scratch(p, p->layout.normal_offset, 3 * (size_t)ring);
}

static psurf_real *psurf__tangent(const psurf_patches *p, uint32_t spoke)
{
    return psurf__scratch(p, p->layout.spoke_offset, 6 * (size_t)spoke);
}

/* What a construction desc says to the schemes. */
typedef struct psurf__options {
    psurf_real sigma;
    psurf_variant variant;
    psurf_shading shading;
    uint32_t flags;
} psurf__options;

/* The control mesh of a frame. */
typedef struct psurf__control {
    const psurf_real *positions;
    size_t stride;                                      /* in reals */
    const psurf_real *centres;                          /* of split faces: ids from vertices on */
    uint32_t vertices;
    const psurf_real *blends;                           /* per spoke, or NULL */
    const psurf_real *normals;                          /* given ones, or NULL */
    size_t normal_stride;                               /* in reals */
    psurf_normal_mode normal_mode;
    psurf__options options;
} psurf__control;

static psurf__control psurf__control_of(const psurf_patches *p, const psurf_construct_desc *desc)
{
    psurf__control control;
    control.positions = desc->positions;
    control.stride = desc->position_stride ? desc->position_stride / sizeof(psurf_real) : 3;
    control.centres = p->scratch ? psurf__centre(p, 0) : NULL;
    control.vertices = p->topology->info.vertices;
    control.blends = desc->blends ? desc->blends : p->topology->blends;
    if (p->topology->split != PSURF_SPLIT_PM) control.blends = NULL;
    control.normals = desc->normals;
    control.normal_stride = desc->normal_stride ? desc->normal_stride / sizeof(psurf_real) : 3;
    control.normal_mode = desc->normal_mode;
    control.options.sigma = desc->flags & PSURF_SIGMA ? desc->sigma : PSURF__R(0.5);
    control.options.variant = desc->variant;
    control.options.shading = desc->shading;
    control.options.flags = desc->flags;
    return control;
}

static PSURF__INLINE const psurf_real *psurf__point_at(const psurf__control *control,
                                                       uint32_t point)
{
    if (point >= control->vertices)
        return control->centres + 3 * (size_t)(point - control->vertices);
    return control->positions + point * control->stride;
}

static psurf__v3 psurf__position(const psurf__control *control, uint32_t point)
{
    return psurf__get(psurf__point_at(control, point));
}

static psurf_real psurf__blend(const psurf_topology *t, const psurf__control *control,
                               const psurf_ring *ring, uint32_t spoke)
{
    if (!control->blends) return PSURF__R(2.0 / 3.0);
    return control->blends[psurf__ratio_spoke(t, ring, spoke)];
}

/* The mean of the corners of a split face: corner 0 of each of its pieces. */
static psurf__v3 psurf__face_centre(const psurf_topology *t, const psurf__control *control,
                                    uint32_t face)
{
    const uint32_t facet = t->face_facet[face], size = psurf__face_size(t, face);
    const psurf_corner *corners =
        t->corners + psurf__facet_corner(t, psurf__facet_kind(t, facet), facet);
    const psurf__v3 first = psurf__position(control, t->rings[corners->ring & ~PSURF_WRITER].point);
    psurf__v3 sum = psurf__zero();
    uint32_t i;
    for (i = 1; i < size; i++) {
        const psurf_ring *ring = &t->rings[corners[3 * i].ring & ~PSURF_WRITER];
        sum = psurf__add(sum, psurf__sub(psurf__position(control, ring->point), first));
    }
    return psurf__mad(first, 1 / PSURF__R(size), sum);
}

static void psurf__centre_pass(const psurf_patches *p, const psurf__control *control,
                               uint32_t index)
{
    psurf__put(psurf__centre(p, index),
               psurf__face_centre(p->topology, control, p->topology->centres[index]));
}

/* A point relative to p. */
static PSURF__INLINE psurf__v4 psurf__offset(const psurf__control *control, uint32_t point,
                                             psurf__v4 p)
{
    return psurf__sub4(psurf__get4(psurf__point_at(control, point)), p);
}

/* A spoke of a ring: E_j - p, and the blend ratio there. */
typedef struct psurf__ring_edge { psurf__v4 end; psurf_real blend; } psurf__ring_edge;

static PSURF__INLINE psurf__ring_edge psurf__read_edge(const psurf_topology *t,
                                                       const psurf__control *control,
                                                       const psurf_ring *ring, psurf__v4 p,
                                                       uint32_t spoke)
{
    psurf__ring_edge edge;
    edge.end = psurf__offset(control, t->spokes[spoke].end, p);
    edge.blend = psurf__blend(t, control, ring, spoke);
    return edge;
}

/* The sum of a facet's vertices after and before, relative to p. In a quad they are one. */
static PSURF__INLINE psurf__v4 psurf__across(const psurf__control *control,
                                             const psurf_spoke *spoke, psurf__v4 p)
{
    const psurf__v4 after = psurf__offset(control, spoke->after, p);
    if (spoke->before == spoke->after) return psurf__add4(after, after);
    return psurf__add4(after, psurf__offset(control, spoke->before, p));
}

/* f_j - p of the facet between two spokes, where all blend ratios are 2/3: eq. 13. */
static PSURF__INLINE psurf__v4 psurf__face_offset(psurf__v4 end, psurf__v4 next_end,
                                                  psurf__v4 across)
{
    return psurf__mix4(PSURF__R(2.0 / 9.0), psurf__add4(end, next_end), PSURF__R(0.5 / 9.0),
                       across);
}

/* The same with the blend ratios of both spokes: eq. 14. */
static PSURF__INLINE psurf__v4 psurf__face_offset_blended(const psurf__ring_edge *edge,
                                                          const psurf__ring_edge *next,
                                                          psurf__v4 across)
{
    const psurf_real a = edge->blend, b = next->blend, both = a * b * PSURF__R(0.25);
    psurf__v4 along = psurf__mix4((1 - a) * b * PSURF__R(0.5) + both, edge->end,
                                  a * (1 - b) * PSURF__R(0.5) + both, next->end);
    return psurf__add4(along, psurf__mul4(across, both * PSURF__R(0.5)));
}

static PSURF__INLINE psurf__v4 psurf__ring_face_point(const psurf__control *control,
                                                      const psurf_spoke *spoke, psurf__v4 p,
                                                      const psurf__ring_edge *edge,
                                                      const psurf__ring_edge *next)
{
    const psurf__v4 across = psurf__across(control, spoke, p);
    if (control->blends) return psurf__face_offset_blended(edge, next, across);
    return psurf__face_offset(edge->end, next->end, across);
}

/* Limit point, and tangents T1 and T2 there. */
typedef struct psurf__ring_frame { psurf__v4 v, t1, t2; } psurf__ring_frame;

/* The frame of a closed ring, and its face points to out unless that is NULL. Sums run over offsets
   from p, so that they keep their digits far from the origin. */
static PSURF__INLINE psurf__ring_frame psurf__closed_frame(const psurf_topology *t,
                                                      const psurf__control *control,
                                                      const psurf_ring *ring, psurf_real *out)
{
    const psurf_trig *rows = t->trig + ring->trig;
    const uint32_t n = psurf__valence(ring), first = ring->first_spoke;
    const psurf__v4 zero = psurf__zero4(), p = psurf__get4(psurf__point_at(control, ring->point));
    const psurf__ring_edge first_edge = psurf__read_edge(t, control, ring, p, first);
    psurf__v4 sum = zero, f;
    psurf__ring_edge edge = first_edge, next;
    psurf__ring_frame frame;
    uint32_t j;
    frame.t1 = frame.t2 = zero;
    for (j = 0; j < n; j++, edge = next) {
        const psurf_trig here = rows[1 + j], there = rows[j + 1 == n ? 1 : 2 + j];
        next = j + 1 == n ? first_edge : psurf__read_edge(t, control, ring, p, first + j + 1);
        f = psurf__ring_face_point(control, &t->spokes[first + j], p, &edge, &next);
        sum = psurf__add4(sum, f);
        frame.t1 = psurf__mad4(frame.t1, here.c + there.c, f);  /* sum of c_j e_j, by parts */
        frame.t2 = psurf__mad4(frame.t2, here.s + there.s, f);
        if (out) psurf__put4(out + 6 * (size_t)j + 3, psurf__add4(p, f));
    }
    frame.v = psurf__mad4(p, rows[0].c, sum);           /* eq. 13 */
    frame.t1 = psurf__mul4(frame.t1, rows[0].s);        /* eq. 15 */
    frame.t2 = psurf__mul4(frame.t2, rows[0].s);
    return frame;
}

/* A closed ring: face points, limit point, tangent points. */
static void psurf__closed_ring(const psurf_patches *patches, const psurf__control *control,
                               const psurf_ring *ring, psurf_real *limit)
{
    const psurf_trig *rows = patches->topology->trig + ring->trig;
    psurf_real *out = psurf__tangent(patches, ring->first_spoke);
    const psurf__ring_frame frame = psurf__closed_frame(patches->topology, control, ring, out);
    uint32_t j;
    psurf__put4(limit, frame.v);
    for (j = 0; j < psurf__valence(ring); j++)          /* eq. 16 */
        psurf__put4(out + 6 * (size_t)j,
                    psurf__add4(frame.v, psurf__mix4(rows[1 + j].c, frame.t1,
                                                     rows[1 + j].s, frame.t2)));
}

/* The same where four facets meet and all blend ratios are 2/3: all cosines and sines are 0, 1 or
   -1, and both scales 1/4. */
static void psurf__regular_ring(const psurf_patches *patches, const psurf__control *control,
                                const psurf_ring *ring, psurf_real *limit)
{
    const psurf_spoke *spokes = patches->topology->spokes + ring->first_spoke;
    const psurf__v4 p = psurf__get4(psurf__point_at(control, ring->point));
    psurf_real *out = psurf__tangent(patches, ring->first_spoke);
    psurf__v4 end[5], f[4], v, t1, t2;
    uint32_t j;
    PSURF__UNROLL
    for (j = 0; j < 4; j++) end[j] = psurf__offset(control, spokes[j].end, p);
    end[4] = end[0];
    PSURF__UNROLL
    for (j = 0; j < 4; j++)
        f[j] = psurf__face_offset(end[j], end[j + 1], psurf__across(control, &spokes[j], p));
    v = psurf__add4(psurf__add4(psurf__add4(f[0], f[1]), f[2]), f[3]);
    t1 = psurf__add4(psurf__sub4(psurf__sub4(f[0], f[1]), f[2]), f[3]);
    t2 = psurf__sub4(psurf__sub4(psurf__add4(f[0], f[1]), f[2]), f[3]);
    v = psurf__mad4(p, PSURF__R(0.25), v);              /* eq. 13 */
    t1 = psurf__mul4(t1, PSURF__R(0.25));               /* eq. 15 */
    t2 = psurf__mul4(t2, PSURF__R(0.25));
    psurf__put4(limit, v);
    psurf__put4_pair(out + 0, psurf__add4(v, t1), psurf__add4(p, f[0]));     /* eq. 16 */
    psurf__put4_pair(out + 6, psurf__add4(v, t2), psurf__add4(p, f[1]));
    psurf__put4_pair(out + 12, psurf__sub4(v, t1), psurf__add4(p, f[2]));
    psurf__put4_pair(out + 18, psurf__sub4(v, t2), psurf__add4(p, f[3]));
}

/* The end point e_s - p of the crease curve on a sharp spoke. */
static psurf__v4 psurf__sharp_offset(const psurf__ring_edge *edge)
{
    return psurf__mul4(edge->end, edge->blend * PSURF__R(0.5));
}

/* The same of the far spoke of a wide neighbour. */
static psurf__v4 psurf__wide_offset(const psurf_topology *t, const psurf__control *control,
                                    const psurf_ring *ring, psurf__v4 p)
{
    const uint32_t spoke = t->spokes[ring->first_spoke + psurf__valence(ring) - 1].before;
    uint32_t ratio = spoke;                             /* it ends the wide ring, or begins it */
    psurf__ring_edge edge;
    if ((ring->valence & PSURF_RING_WIDE_NEXT) && t->spokes[spoke].after != PSURF_NONE)
        ratio = t->spokes[spoke].after;
    edge.end = psurf__offset(control, t->spokes[spoke].end, p);
    edge.blend = control->blends ? control->blends[ratio] : PSURF__R(2.0 / 3.0);
    return psurf__sharp_offset(&edge);
}

/* Limit point v of an open ring, and the offsets d from it of the tangent points on its two sharp
   spokes. Both sides of a spoke compute these from the same numbers, and differ only in the order
   of operands of commutative operations: same bits. */
static void psurf__sharp_ends(const psurf_topology *t, const psurf__control *control,
                              const psurf_ring *ring, psurf__v4 p, psurf__v4 *v, psurf__v4 d[2])
{
    const uint32_t first = ring->first_spoke, last = first + psurf__valence(ring) - 1;
    const psurf__ring_edge edge_a = psurf__read_edge(t, control, ring, p, first);
    const psurf__ring_edge edge_b = psurf__read_edge(t, control, ring, p, last);
    const psurf__v4 a = psurf__sharp_offset(&edge_a), b = psurf__sharp_offset(&edge_b);
    const psurf_real half = PSURF__R(0.5);
    psurf__v4 wide;
    *v = p;
    d[0] = a;
    d[1] = b;
    if (!(ring->valence & PSURF_RING_CORNER)) {         /* straight through the vertex */
        if (!(ring->valence & PSURF_RING_WIDE)) *v = psurf__mad4(p, half, psurf__add4(a, b));
        d[0] = psurf__mul4(psurf__sub4(a, b), half);
        d[1] = psurf__mul4(psurf__sub4(b, a), half);
    } else if (t->spokes[last].before != PSURF_NONE) {  /* a wide neighbour runs straight */
        wide = psurf__wide_offset(t, control, ring, p);
        if (ring->valence & PSURF_RING_WIDE_LAST) d[0] = psurf__mul4(psurf__sub4(a, wide), half);
        else d[1] = psurf__mul4(psurf__sub4(b, wide), half);
    }
}

/* The frame of an open ring: a boundary, or one side of hard edges (ours; the cut's own row enters
   no interior edge, so eq. 7 holds at all of them). d: as psurf__sharp_ends; its face points to out
   unless that is NULL. */
static PSURF__INLINE psurf__ring_frame psurf__open_frame(const psurf_topology *t,
                                                    const psurf__control *control,
                                                    const psurf_ring *ring, psurf__v4 d[2],
                                                    psurf_real *out)
{
    const psurf_trig *rows = t->trig + ring->trig;
    const uint32_t k = psurf__valence(ring) - 1, first = ring->first_spoke;
    const psurf__v4 p = psurf__get4(psurf__point_at(control, ring->point));
    psurf__v4 offset, e, f, before = psurf__zero4(), t2 = before;
    psurf__ring_edge edge = psurf__read_edge(t, control, ring, p, first), next;
    psurf__ring_frame frame;
    uint32_t j;
    psurf__sharp_ends(t, control, ring, p, &frame.v, d);
    offset = psurf__sub4(frame.v, p);
    for (j = 0; j < k; j++, before = f, edge = next) {
        next = psurf__read_edge(t, control, ring, p, first + j + 1);
        f = psurf__ring_face_point(control, &t->spokes[first + j], p, &edge, &next);
        e = psurf__sub4(psurf__mul4(psurf__add4(before, f), PSURF__R(0.5)), offset);
        if (j > 0) t2 = psurf__mad4(t2, 4 * rows[0].s * rows[1 + j].s, e);
        if (out) psurf__put4(out + 6 * (size_t)j + 3, psurf__add4(p, f));
    }
    frame.t1 = d[0];
    frame.t2 = ring->valence & PSURF_RING_CORNER ? d[1] : t2;
    return frame;
}

/* An open ring: face points, limit point, tangent points. */
static void psurf__open_ring(const psurf_patches *patches, const psurf__control *control,
                             const psurf_ring *ring, psurf_real *limit)
{
    const psurf_trig *rows = patches->topology->trig + ring->trig;
    const uint32_t k = psurf__valence(ring) - 1;
    psurf_real *out = psurf__tangent(patches, ring->first_spoke);
    psurf__v4 d[2];
    const psurf__ring_frame frame = psurf__open_frame(patches->topology, control, ring, d, out);
    uint32_t j;
    psurf__put4(limit, frame.v);
    psurf__put4(out, psurf__add4(frame.v, d[0]));
    psurf__put4(out + 6 * (size_t)k, psurf__add4(frame.v, d[1]));
    psurf__put4(out + 6 * (size_t)k + 3, frame.v);      /* never used, yet defined */
    for (j = 1; j < k; j++)
        psurf__put4(out + 6 * (size_t)j,
                    psurf__add4(frame.v, psurf__mix4(rows[1 + j].c, frame.t1,
                                                     rows[1 + j].s, frame.t2)));
}

/* ---- points and normals, for the schemes that know no more of a vertex ---- */

/* Normals of the facets of a ring, added up: unit ones, or, by area, twice the area long. A quad's
   is that of its diagonals. */
static psurf__v3 psurf__facet_normals(const psurf_topology *t, const psurf__control *control,
                                      const psurf_ring *ring, int by_area)
{
    const uint32_t facets = psurf__ring_facets(ring), n = psurf__valence(ring);
    const psurf_spoke *spokes = t->spokes + ring->first_spoke;
    const psurf__v3 p = psurf__position(control, ring->point);
    psurf__v3 sum = psurf__zero();
    uint32_t j;
    for (j = 0; j < facets; j++) {
        const uint32_t next = spokes[j + 1 == n ? 0 : j + 1].end;
        const psurf__v3 e = psurf__sub(psurf__position(control, spokes[j].end), p);
        const psurf__v3 f = psurf__sub(psurf__position(control, next), p);
        psurf__v3 normal = psurf__cross(e, f);
        if (spokes[j].after != next)
            normal = psurf__cross(psurf__sub(psurf__position(control, spokes[j].after), p),
                                  psurf__sub(f, e));
        sum = psurf__add(sum, by_area ? normal : psurf__unit(normal));
    }
    return sum;
}

/* Turns pm's tangents at a closed ring of quads, E_k and F_k around, into those of Catmull and
   Clark's limit, sum of A c_k E_k + (c_k + c_(k+1)) F_k with A = 1 + c + sqrt((1+c)(9+c)), c = c_1:
   pm has 4 (1+c) in place of A, which is the same where four quads meet. */
static void psurf__turn_to_limit(const psurf_topology *t, const psurf__control *control,
                                 const psurf_ring *ring, psurf__ring_frame *frame)
{
    const psurf_spoke *spokes = t->spokes + ring->first_spoke;
    const psurf_trig *rows = t->trig + ring->trig;
    const psurf__v4 p = psurf__get4(psurf__point_at(control, ring->point));
    const psurf_real c = rows[2].c;
    const psurf_real a = 1 + c + psurf__sqrt((1 + c) * (9 + c)) - 4 * (1 + c);
    const psurf_real scale = rows[0].s * a * PSURF__R(1.0 / 9.0);
    const uint32_t n = psurf__valence(ring);
    uint32_t j;
    for (j = 0; j < n; j++)
        if (spokes[j].after == spokes[j + 1 == n ? 0 : j + 1].end) return;     /* a triangle */
    for (j = 0; j < n; j++) {
        const psurf__v4 e = psurf__offset(control, spokes[j].end, p);
        frame->t1 = psurf__mad4(frame->t1, scale * rows[1 + j].c, e);
        frame->t2 = psurf__mad4(frame->t2, scale * rows[1 + j].s, e);
    }
}

static psurf__v3 psurf__from4(psurf__v4 a)
{
    psurf_real p[3];
    psurf__put4(p, a);
    return psurf__get(p);
}

/* Point and normal of a ring: given, averaged, or of the limit ([PN] 1: feed limit data). */
static void psurf__point_normal_pass(const psurf_patches *patches, const psurf__control *control,
                                     uint32_t index)
{
    const psurf_topology *t = patches->topology;
    const psurf_ring *ring = &t->rings[index];
    psurf__v3 p = psurf__position(control, ring->point), n = psurf__zero();
    if (control->normals) {
        const size_t which = t->ring_normals ? t->ring_normals[index] : ring->point;
        n = psurf__unit(psurf__get(control->normals + which * control->normal_stride));
    } else if (control->normal_mode == PSURF_NORMALS_LIMIT) {
        const int open = (ring->valence & PSURF_RING_OPEN) != 0;
        psurf__v4 d[2];
        psurf__ring_frame frame = open ? psurf__open_frame(t, control, ring, d, NULL)
                                       : psurf__closed_frame(t, control, ring, NULL);
        if (!open) psurf__turn_to_limit(t, control, ring, &frame);
        p = psurf__from4(frame.v);
        n = psurf__unit_cross(psurf__from4(frame.t1), psurf__from4(frame.t2));
    }
    if (!control->normals && psurf__dot(n, n) <= 0)
        n = psurf__unit(psurf__facet_normals(t, control, ring,
                                             control->normal_mode == PSURF_NORMALS_AREA));
    psurf__put(psurf__limit(patches, index), p);
    psurf__put(psurf__vertex_normal(patches, index), n);
}

static void psurf__vertex_pass(const psurf_patches *patches, const psurf__control *control,
                               uint32_t index)
{
    const psurf_ring *ring = &patches->topology->rings[index];
    psurf_real *limit = psurf__limit(patches, index);
    if (patches->topology->split != PSURF_SPLIT_PM)
        psurf__point_normal_pass(patches, control, index);
    else if (ring->valence & PSURF_RING_OPEN) psurf__open_ring(patches, control, ring, limit);
    else if (psurf__valence(ring) == 4 && !control->blends)
        psurf__regular_ring(patches, control, ring, limit);
    else psurf__closed_ring(patches, control, ring, limit);
}

/* >>5 SCHEMES =================================================================================
   A scheme turns vertex data into control points, facet by facet; it is one function here and one
   row in the table below. */

/* Where facets read: the tables, and what the vertices pass left. */
typedef struct psurf__vertex_data {
    const psurf_corner *corners;
    const psurf_ring *rings;
    const psurf_trig *trig;
    const psurf_real *limits, *spokes;
} psurf__vertex_data;

static psurf__vertex_data psurf__vertex_data_of(const psurf_patches *p)
{
    psurf__vertex_data data;
    data.corners = p->topology->corners;
    data.rings = p->topology->rings;
    data.trig = p->topology->trig;
    data.limits = psurf__limit(p, 0);
    data.spokes = psurf__tangent(p, 0);
    return data;
}

/* Where a facet reads at one of its corners. A face point follows every tangent point. */
typedef struct psurf__corner_data {
    const psurf_real *v, *t0, *t1;    /* limit point; tangent points to the next, previous corner */
    const psurf_real *f, *fr, *fl;      /* face points: own facet, across edge i, across edge i-1 */
    const psurf_ring *ring;
    uint32_t spoke, after;              /* to the next corner, to the previous one */
} psurf__corner_data;

/* Without branches. Where the ring ends, fr and fl lead to some face point that does not count. */
static PSURF__INLINE psurf__corner_data psurf__read_corner(const psurf__vertex_data *data,
                                                           uint32_t corner)
{
    psurf__corner_data c;
    const uint32_t index = data->corners[corner].ring & ~PSURF_WRITER;
    uint32_t n, j;
    c.ring = &data->rings[index];
    c.spoke = data->corners[corner].spoke;
    n = c.ring->valence & PSURF_RING_VALENCE;
    j = c.spoke - c.ring->first_spoke;
    c.after = c.spoke + 1 - (j + 1 == n ? n : 0);
    c.v = data->limits + 3 * (size_t)index;
    c.t0 = data->spokes + 6 * (size_t)c.spoke;
    c.t1 = data->spokes + 6 * (size_t)c.after;
    c.f = c.t0 + 3;
    c.fr = data->spokes + 6 * (size_t)(c.spoke + (j == 0 ? n : 0) - 1) + 3;
    c.fl = c.t1 + 3;
    return c;
}

/* ---- pm: [PM], whose equation numbers are given ---- */

/* Two limit or tangent points, behind which the scratch goes on. */
static PSURF__INLINE void psurf__copy_pair(psurf_real *to, const psurf_real *a, const psurf_real *b)
{
    psurf__put4_pair(to, psurf__get4_over(a), psurf__get4_over(b));
}

/* Ordinary facet: the vertex data as they are make a bicubic Bezier patch. */
static PSURF__INLINE void psurf__pm_bicubic(const psurf__vertex_data *data, uint32_t first,
                                            psurf_real *g)
{
    psurf__corner_data c[4];
    c[0] = psurf__read_corner(data, first);
    c[1] = psurf__read_corner(data, first + 1);
    c[2] = psurf__read_corner(data, first + 2);
    c[3] = psurf__read_corner(data, first + 3);
    psurf__copy_pair(g + 0, c[0].v, c[0].t0);
    psurf__copy_pair(g + 6, c[1].t1, c[1].v);
    psurf__put4_pair(g + 12, psurf__get4_over(c[0].t1), psurf__get4_after(c[0].f));
    psurf__put4_pair(g + 18, psurf__get4_after(c[1].f), psurf__get4_over(c[1].t0));
    psurf__put4_pair(g + 24, psurf__get4_over(c[3].t0), psurf__get4_after(c[3].f));
    psurf__put4_pair(g + 30, psurf__get4_after(c[2].f), psurf__get4_over(c[2].t1));
    psurf__copy_pair(g + 36, c[3].v, c[3].t1);
    psurf__copy_pair(g + 42, c[2].t0, c[2].v);
}

/* 3/2 of the blend ratio at the pole on the spoke of a polar facet's corner. */
static psurf_real psurf__pole_ratio(const psurf__control *control, uint32_t spoke)
{
    return control->blends ? PSURF__R(1.5) * control->blends[spoke] : PSURF__R(1);
}

/* Polar facet: bicubic with one side shrunk to the pole. Corners a, b of the base, pole o, which
   turn says; qa and qb are 3/2 of the blend ratios at the pole. Eqs. 18 and 19. */
static void psurf__pm_polar(const psurf__vertex_data *data, const psurf__control *control,
                            uint32_t first, uint32_t turn, psurf_real *h)
{
    const psurf__corner_data a = psurf__read_corner(data, first + turn);
    const psurf__corner_data b = psurf__read_corner(data, first + (turn + 1) % 3);
    const psurf__corner_data o = psurf__read_corner(data, first + (turn + 2) % 3);
    const psurf_real qa = psurf__pole_ratio(control, o.spoke);
    const psurf_real qb = psurf__pole_ratio(control, o.after);
    const psurf_real scale = 1 / (2 + data->trig[o.ring->trig + 2].c);
    const psurf__v4 pole = psurf__get4(o.v);
    psurf__v4 h02 = psurf__sub4(psurf__get4(o.t0), pole);       /* offsets from the pole, */
    psurf__v4 h32 = psurf__sub4(psurf__get4(o.t1), pole);       /* whose weights sum to 1 */
    psurf__v4 h12 = psurf__mul4(psurf__mad4(h32, 2, h02), scale);
    psurf__v4 h22 = psurf__mul4(psurf__mad4(h02, 2, h32), scale);
    h12 = psurf__mix4(qa, h12, 1 - qa, h02);
    h22 = psurf__mix4(qb, h22, 1 - qb, h32);
    psurf__copy_pair(h + 0, a.v, a.t0);
    psurf__copy_pair(h + 6, b.t1, b.v);
    psurf__put4_pair(h + 12, psurf__get4_over(a.t1), psurf__get4_after(a.f));
    psurf__put4_pair(h + 18, psurf__get4_after(b.f), psurf__get4_over(b.t0));
    psurf__put4_pair(h + 24, psurf__get4_over(o.t0), psurf__add4(pole, h12));
    psurf__put4_pair(h + 30, psurf__add4(pole, h22), psurf__get4_over(o.t1));
    psurf__put4(h + 36, pole);
}

/* What eqs. 3 and 20 need of m = 3, 4, 5: mu = 1 - c_m, k1, k2, and the weight w of the centre.
   G1 does not depend on w. */
typedef struct psurf__sides { psurf_real mu, k1, k2, w; } psurf__sides;

static const psurf__sides psurf__sides_table[6] = {
    {0, 0, 0, 0}, {0, 0, 0, 0}, {0, 0, 0, 0},
    {PSURF__R(1.5), PSURF__R(1.0 / 3.0), PSURF__R(1.0 / 3.0), PSURF__R(2)},
    {PSURF__R(1), PSURF__R(0), PSURF__R(0.5), PSURF__R(1)},
    {PSURF__R(0.69098300562505257590), PSURF__R(-0.44721359549995793928),
     PSURF__R(0.72360679774997896964), PSURF__R(1.0 / 3.0)}
};

/* A corner of a facet of sectors: v from an origin near by and differences of what is read there,
   so that all that follows keeps its digits. */
typedef struct psurf__pm_corner {
    psurf__v4 v, t0, t1, f;             /* the others from v */
    psurf__v4 across0, across1;         /* f from fr and fl */
    psurf_real chi, s;                  /* (1 + c_n)/(4 mu), s_n */
} psurf__pm_corner;

/* Where a ring ends, the face point across is that of the facet, reflected. */
static PSURF__INLINE void psurf__pm_reflect(const psurf__corner_data *at, psurf__pm_corner *c)
{
    const uint32_t last = at->ring->first_spoke + psurf__valence(at->ring) - 1;
    if (at->spoke == at->ring->first_spoke)
        c->across0 = psurf__mul4(psurf__sub4(c->f, c->t0), 2);
    if (at->after == last) c->across1 = psurf__mul4(psurf__sub4(c->f, c->t1), 2);
}

static PSURF__INLINE psurf__pm_corner psurf__pm_read(const psurf__vertex_data *data,
                                                     const psurf__corner_data *at, psurf__v4 origin,
                                                     psurf_real mu)
{
    const psurf_trig row = data->trig[at->ring->trig + 2];
    const psurf__v4 v = psurf__get4(at->v), f = psurf__get4_after(at->f);
    psurf__pm_corner c;
    c.v = psurf__sub4(v, origin);
    c.t0 = psurf__sub4(psurf__get4_over(at->t0), v);
    c.t1 = psurf__sub4(psurf__get4_over(at->t1), v);
    c.f = psurf__sub4(f, v);
    c.across0 = psurf__sub4(f, psurf__get4_after(at->fr));
    c.across1 = psurf__sub4(f, psurf__get4_after(at->fl));
    if (at->ring->valence & PSURF_RING_OPEN) psurf__pm_reflect(at, &c);
    c.chi = (1 + row.c) * (PSURF__R(0.25) / mu);
    c.s = row.s;
    return c;
}

/* b211 and b121 of the sector on the edge from corner a to corner b: eq. 20 in differences, with
   3/4 + (2 mu - chi)/(8 mu) = 1 - chi/(8 mu). along: from the tangent point of a to that of b. */
static PSURF__INLINE void psurf__pm_first_row(const psurf__pm_corner *a, const psurf__pm_corner *b,
                                              psurf__v4 along, psurf_real mu, psurf__v4 *b211,
                                              psurf__v4 *b121)
{
    const psurf_real tau = PSURF__R(0.375) / mu / (a->s + b->s), half = PSURF__R(0.5);
    *b211 = psurf__add4(psurf__mad4(a->v, 1 - half * b->chi, a->t0),
                        psurf__mix4(a->chi, along, tau, a->across0));
    *b121 = psurf__add4(psurf__mad4(b->v, 1 - half * a->chi, b->t1),
                        psurf__mix4(-b->chi, along, tau, b->across1));
}

/* The points of a sector that are stored, as places in a patch. */
enum { PSURF__V, PSURF__T0, PSURF__T1, PSURF__B211, PSURF__B121, PSURF__B112, PSURF__SECTOR };

static uint32_t psurf__following(uint32_t i, uint32_t m) { return i + 1 == m ? 0 : i + 1; }
static uint32_t psurf__preceding(uint32_t i, uint32_t m) { return i == 0 ? m - 1 : i - 1; }

/* b004 from an origin: eq. 20. */
static PSURF__INLINE psurf__v4 psurf__pm_centre(const psurf__pm_corner *c, uint32_t m)
{
    const psurf_real w = psurf__sides_table[m].w;
    psurf__v4 sum = psurf__zero4(), inner = psurf__zero4();
    uint32_t i;
    PSURF__UNROLL
    for (i = 0; i < m; i++) {
        psurf__v4 tangents = psurf__add4(c[i].t0, c[i].t1);
        sum = psurf__add4(sum, c[i].v);
        inner = psurf__add4(inner, psurf__mix4(3 * w, tangents, 9, c[i].f));
    }
    return psurf__mix4(1 / PSURF__R(m), sum, 1 / (PSURF__R(m) * (7 * w + 9)), inner);
}

/* b202 on the line from corner i to the centre: eq. 3. */
static PSURF__INLINE psurf__v4 psurf__pm_b202(const psurf__pm_corner *c, const psurf__sides *sides,
                                              psurf__v4 b211, psurf__v4 b121_before)
{
    psurf__v4 b301 = psurf__mad4(c->v, PSURF__R(0.75) * sides->k2, psurf__add4(c->t0, c->t1));
    return psurf__mix4(sides->k1, b301, sides->k2, psurf__add4(b211, b121_before));
}

/* b112 for m = 3 and 5: eqs. 21, 22. */
static PSURF__INLINE void psurf__pm_b112_odd(const psurf__pm_corner *c, psurf__v4 centre,
                                             const psurf__v4 *b211, const psurf__v4 *b121,
                                             uint32_t m, psurf__v4 *b112)
{
    psurf__v4 b202[5], near_edge, beside;
    uint32_t i;
    PSURF__UNROLL
    for (i = 0; i < m; i++)
        b202[i] = psurf__pm_b202(&c[i], &psurf__sides_table[m], b211[i],
                                 b121[psurf__preceding(i, m)]);
    PSURF__UNROLL
    for (i = 0; i < m; i++) {
        if (m == 3) {
            b112[i] = psurf__mix4(PSURF__R(1.5), centre, PSURF__R(-0.5), b202[(i + 2) % 3]);
            continue;
        }
        near_edge = psurf__add4(b202[i], b202[(i + 1) % 5]);
        beside = psurf__add4(b202[(i + 2) % 5], b202[(i + 4) % 5]);
        b112[i] = psurf__add4(psurf__mix4(PSURF__R(0.69098300562505257590), centre,
                                          PSURF__R(0.13819660112501051518), b202[(i + 3) % 5]),
                              psurf__mix4(PSURF__R(0.44721359549995793928), near_edge,
                                          PSURF__R(-0.36180339887498948482), beside));
    }
}

/* b112 for m = 4: eq. 21, by differences of sectors that meet. */
static PSURF__INLINE void psurf__pm_b112_even(psurf__v4 centre, const psurf__v4 *b211,
                                              const psurf__v4 *b121, psurf__v4 *b112)
{
    psurf__v4 d[4];
    uint32_t i;
    PSURF__UNROLL
    for (i = 0; i < 4; i++)
        d[i] = psurf__add4(psurf__sub4(b211[i], b211[(i + 3) & 3]),
                           psurf__sub4(b121[i], b121[(i + 1) & 3]));
    PSURF__UNROLL
    for (i = 0; i < 4; i++)
        b112[i] = psurf__add4(centre, psurf__mix4(PSURF__R(3.0 / 16.0), d[i],
                                                  PSURF__R(-1.0 / 16.0), d[(i + 2) & 3]));
}

/* P3, P4, P5: m sectors of degree 4 round a centre. */
static PSURF__INLINE void psurf__pm_sectors(const psurf__vertex_data *data, uint32_t first,
                                            uint32_t m, psurf_real *out)
{
    const psurf_real mu = psurf__sides_table[m].mu;
    psurf__corner_data at[5];
    psurf__pm_corner c[5];
    psurf__v4 origin, along, b211[5], b121[5], b112[5], centre;
    uint32_t i, j;
    PSURF__UNROLL
    for (i = 0; i < m; i++) at[i] = psurf__read_corner(data, first + i);
    origin = psurf__get4(at[0].v);
    PSURF__UNROLL
    for (i = 0; i < m; i++) c[i] = psurf__pm_read(data, &at[i], origin, mu);
    PSURF__UNROLL
    for (i = 0; i < m; i++) {
        j = psurf__following(i, m);
        along = psurf__sub4(psurf__get4_over(at[j].t1), psurf__get4_over(at[i].t0));
        psurf__pm_first_row(&c[i], &c[j], along, mu, &b211[i], &b121[i]);
    }
    centre = psurf__pm_centre(c, m);
    if (m == 4) psurf__pm_b112_even(centre, b211, b121, b112);
    else psurf__pm_b112_odd(c, centre, b211, b121, m, b112);
    PSURF__UNROLL
    for (i = 0; i < m; i++, out += 3 * PSURF__SECTOR) {
        psurf__copy_pair(out + 3 * PSURF__V, at[i].v, at[i].t0);
        psurf__put4_pair(out + 3 * PSURF__T1, psurf__get4_over(at[psurf__following(i, m)].t1),
                         psurf__add4(origin, b211[i]));
        psurf__put4_pair(out + 3 * PSURF__B121, psurf__add4(origin, b121[i]),
                         psurf__add4(origin, b112[i]));
    }
    psurf__put4(out, psurf__add4(origin, centre));
}

/* The corner that a facet's parameters start from: A of a polar facet, else 0. */
static uint32_t psurf__turn(const psurf_topology *t, uint32_t facet)
{
    return t->split == PSURF_SPLIT_PM ? t->facets[facet].piece >> 16 & 3 : 0;
}

/* Facets first to end-1, all of one kind, into consecutive patches. In each case the number of
   sides is a constant: the compiler works out what depends on it alone. */
static void psurf__pm_facets(const psurf_patches *p, const psurf__control *control, psurf_kind kind,
                             uint32_t first, uint32_t end, psurf_real *out)
{
    const psurf__vertex_data data = psurf__vertex_data_of(p);
    const uint32_t sides = psurf__kind_sides(kind), reals = 3 * psurf__kind_table[kind].points;
    uint32_t corner = psurf__facet_corner(p->topology, kind, first), i;
    for (i = first; i < end; i++, corner += sides, out += reals) switch (kind) {
        case PSURF_BICUBIC: psurf__pm_bicubic(&data, corner, out); break;
        case PSURF_POLAR:
            psurf__pm_polar(&data, control, corner, psurf__turn(p->topology, i), out);
            break;
        case PSURF_P3: psurf__pm_sectors(&data, corner, 3, out); break;
        case PSURF_P4: psurf__pm_sectors(&data, corner, 4, out); break;
        case PSURF_P5: psurf__pm_sectors(&data, corner, 5, out); break;
        case PSURF_PN_TRI: case PSURF_PN_QUAD: case PSURF_NPATCH: case PSURF_HYBRID_TRI:
        case PSURF_PNG1_TRI: case PSURF_RIBBON: case PSURF_RIBBON_B2: case PSURF_KIND_COUNT: break;
    }
}

/* ---- point-normal schemes: what they are told of a facet ---- */

/* An edge of a facet, which runs from its corner of the same number to the next. */
typedef struct psurf__local_edge {
    psurf__v3 begin, end;               /* normals that the facet across has at its two ends */
    psurf__v3 apex, apex_normal;        /* of the triangle across: corner off the edge */
    psurf__v3 normal;                   /* of the triangle across, unit */
    int border;                         /* nothing is across: all of these are the facet's own */
    int turned;                         /* begins at the higher vertex */
} psurf__local_edge;

typedef struct psurf__local {
    psurf__v3 p[4], n[4];               /* corners, and their unit normals on this side */
    psurf__v3 normal;                   /* of the triangle, unit */
    psurf__local_edge edge[4];
} psurf__local;

/* From a facet to the points of its patch, in the order that psurf_kind tells. */
typedef void psurf__local_rule(const psurf__local *l, const psurf__options *options,
                               psurf_real *out);

/* ---- point-normal schemes: boundary curves ---- */

/* Of squares: sines and ratios below 1e-5 count as 0. In float they are little but rounding. */
#define PSURF__SLIGHT PSURF__R(1e-10)

/* d without its part along n. */
static psurf__v3 psurf__tangential(psurf__v3 d, psurf__v3 n)
{
    return psurf__mad(d, -psurf__dot(d, n), n);
}

/* How an inner point of a boundary curve follows from the normals at its ends. Each rule's number
   is the mu that goes with it on hard edges. */
typedef enum psurf__curve_rule {
    PSURF__BY_PROJECTION,               /* [PN] (1), [N] 1.1.5 */
    PSURF__BY_LENGTH,                   /* [GB] 2.2: a third of the chord long */
    PSURF__BY_WM                        /* [GB] 2.3: Walton and Meek's */
} psurf__curve_rule;

/* The boundary curve of an edge: p0, p0 + h0, p1 + h1, p1. Both facets compute it, with the ends
   and the sides swapped, and must get the same bits. So one function makes either handle, from a
   chord that leads from the near end to the far one, and it is even in whatever changes its sign
   where the normals of the two sides are swapped. */
typedef struct psurf__curve {
    psurf__v3 chord, handle[2];
    psurf__v3 normal[2];                /* of both sides, or their mean; no use at hard ends */
    int hard;
} psurf__curve;

/* From an end of a smooth edge to its inner point; d leads to the far end. */
static psurf__v3 psurf__smooth_handle(psurf__curve_rule rule, psurf__v3 d, psurf__v3 near_normal,
                                      psurf__v3 far_normal)
{
    const psurf__v3 t = psurf__tangential(d, near_normal);
    const psurf_real third = PSURF__R(1.0 / 3.0);
    psurf_real a, a0, a1, scale;
    if (rule == PSURF__BY_PROJECTION) return psurf__mul(t, third);
    if (rule == PSURF__BY_LENGTH) {
        if (!(psurf__dot(t, t) > PSURF__SLIGHT * psurf__dot(d, d))) return psurf__zero();
        return psurf__mul(psurf__unit(t), third * psurf__dot(d, psurf__unit(d)));
    }
    a = psurf__dot(near_normal, far_normal);
    a0 = psurf__dot(d, near_normal);
    a1 = psurf__dot(d, far_normal);
    scale = 1 / (4 - a * a);                                              /* in 1/4 .. 1/3 */
    d = psurf__mad(d, -2 * scale * (2 * a0 + a * a1), near_normal);
    return psurf__mul(psurf__mad(d, scale * (2 * a1 + a * a0), far_normal), third);
}

/* The same on a hard edge, whose curve has to start along the line e; length and sign of e do not
   matter. About a third of the chord long, never more than 1.061 times that; on a circular arc mu =
   2 gives exactly what Walton and Meek's rule does. */
static psurf__v3 psurf__line_handle(psurf__curve_rule rule, psurf__v3 d, psurf__v3 e)
{
    const psurf_real mu = (psurf_real)rule;
    const psurf__v3 u = psurf__unit(e);
    const psurf_real k = psurf__dot(psurf__unit(d), u);
    return psurf__mul(u, (1 + mu) * psurf__dot(d, u) / (3 * (1 + mu * k * k)));
}

/* The line along which a curve starts that has the normals m and n beside it: the intersection of
   the two tangent planes. (m-n) x (m+n) is 2 m x n with all its digits near m = n, and changes
   exactly its sign where m and n are swapped. From 1 degree on, the end is hard. */
static psurf__v3 psurf__end_line(psurf__v3 d, psurf__v3 m, psurf__v3 n, int *hard)
{
    const psurf__v3 difference = psurf__sub(m, n), sum = psurf__add(m, n);
    const psurf__v3 e = psurf__cross(difference, sum);
    const int apart = psurf__dot(e, e) >= PSURF__R(4 * 3.05e-4), ahead = psurf__dot(m, n) > 0;
    if (apart || !ahead) *hard = 1;
    if (apart) return e;
    return psurf__tangential(d, psurf__unit(ahead ? sum : difference));
}

static int psurf__is_same(psurf__v3 a, psurf__v3 b)
{
    return a.x >= b.x && a.x <= b.x && a.y >= b.y && a.y <= b.y && a.z >= b.z && a.z <= b.z;
}

static psurf__v3 psurf__common_normal(psurf__v3 m, psurf__v3 n)
{
    return psurf__is_same(m, n) ? m : psurf__unit(psurf__add(m, n));
}

/* The curve of edge e, from corner e to corner f. */
static psurf__curve psurf__make_curve(const psurf__local *l, uint32_t e, uint32_t f,
                                      psurf__curve_rule rule)
{
    const psurf__v3 begin = l->edge[e].begin, end = l->edge[e].end;
    const psurf__v3 back = psurf__sub(l->p[e], l->p[f]);
    const int same = psurf__is_same(l->n[e], begin) && psurf__is_same(l->n[f], end);
    psurf__v3 line[2];
    psurf__curve c;
    c.chord = psurf__sub(l->p[f], l->p[e]);
    c.normal[0] = psurf__common_normal(l->n[e], begin);
    c.normal[1] = psurf__common_normal(l->n[f], end);
    c.hard = 0;
    if (!same) {
        line[0] = psurf__end_line(c.chord, l->n[e], begin, &c.hard);
        line[1] = psurf__end_line(back, l->n[f], end, &c.hard);
    }
    if (!c.hard) {
        c.handle[0] = psurf__smooth_handle(rule, c.chord, c.normal[0], c.normal[1]);
        c.handle[1] = psurf__smooth_handle(rule, back, c.normal[1], c.normal[0]);
        return c;
    }
    c.handle[0] = psurf__line_handle(rule, c.chord, line[0]);
    c.handle[1] = psurf__line_handle(rule, back, line[1]);
    return c;
}

/* The keys of a triangle are the six inner points of its edges, b210 b120 b201 b021 b102 b012: each
   has a corner beside it, and is on the way to the next corner, 0, or to the previous one, 1. */
static const unsigned char psurf__key[3][2] = {{0, 2}, {3, 1}, {4, 5}};
static const unsigned char psurf__key_corner[6] = {0, 1, 0, 1, 2, 2};
static const unsigned char psurf__key_way[6] = {0, 1, 1, 0, 0, 1};

/* The three curves of a triangle, and their handles once more, by key. */
typedef struct psurf__frame {
    psurf__curve curve[3];
    psurf__v3 handle[6];
} psurf__frame;

static void psurf__make_frame(const psurf__local *l, psurf__curve_rule rule, psurf__frame *frame)
{
    uint32_t e, f;
    for (e = 0; e < 3; e++) {
        f = (e + 1) % 3;
        frame->curve[e] = psurf__make_curve(l, e, f, rule);
        frame->handle[psurf__key[e][0]] = frame->curve[e].handle[0];
        frame->handle[psurf__key[f][1]] = frame->curve[e].handle[1];
    }
}

/* b111: the mean E of the keys, drawn away from the mean V of the corners; (1+s) E - s V is V and
   (1+s) times the mean of the handles. [PN] (3); sigma = 1/2 keeps quadratics. */
static psurf__v3 psurf__centre_point(const psurf__local *l, const psurf__v3 *handle,
                                     psurf_real sigma)
{
    const psurf__v3 corners = psurf__add(psurf__add(l->p[0], l->p[1]), l->p[2]);
    psurf__v3 sum = handle[0];
    uint32_t k;
    for (k = 1; k < 6; k++) sum = psurf__add(sum, handle[k]);
    return psurf__mix(PSURF__R(1.0 / 3.0), corners, (1 + sigma) * PSURF__R(1.0 / 6.0), sum);
}

/* The boundary to its places in a patch: those of the corners, then those of the keys. */
static void psurf__put_boundary(const psurf__local *l, const psurf__v3 *handle,
                                const unsigned char *place, psurf_real *out)
{
    uint32_t k;
    for (k = 0; k < 3; k++) psurf__put(out + 3 * place[k], l->p[k]);
    for (k = 0; k < 6; k++)
        psurf__put(out + 3 * place[3 + k], psurf__add(l->p[psurf__key_corner[k]], handle[k]));
}

static void psurf__put_nine(const psurf__local *l, const psurf__v3 *handle, psurf_real *out)
{
    static const unsigned char place[9] = {0, 3, 8, 1, 2, 4, 5, 6, 7};
    psurf__put_boundary(l, handle, place, out);
}

/* What hybrid, png1 and ribbon patches end with: normals, and how the edges went. */
static void psurf__put_end(const psurf__local *l, uint32_t e, int how, psurf_real *out)
{
    psurf__put(out + 3 * e, l->n[e]);
    out[9 + e] = PSURF__R(how);
}

/* ---- pn: [PN] ---- */

/* The normal in the middle of an edge: the sum of those at its ends, reflected in the plane across
   the edge: [PN] (2), with the factor 2. The sum of opposite normals is nothing: then other. */
static psurf__v3 psurf__middle_normal(psurf__v3 d, psurf__v3 m, psurf__v3 n, psurf__v3 other)
{
    const psurf__v3 sum = psurf__add(m, n), along = psurf__unit(d);
    if (!(psurf__dot(sum, sum) > PSURF__SLIGHT)) return other;
    return psurf__unit(psurf__mad(sum, -2 * psurf__dot(along, sum), along));
}

/* The ten points of a PN triangle. */
static void psurf__put_pn(const psurf__local *l, const psurf__v3 *handle, psurf_real sigma,
                          psurf_real *out)
{
    static const unsigned char place[9] = {0, 3, 9, 1, 2, 4, 6, 7, 8};
    psurf__put_boundary(l, handle, place, out);
    psurf__put(out + 3 * 5, psurf__centre_point(l, handle, sigma));
}

/* Six normals of a quadratic patch. linear: as if it were of degree 1. */
static void psurf__put_normals(const psurf__local *l, const psurf__curve *curve, int linear,
                               psurf_real *out)
{
    static const unsigned char corner[3] = {0, 2, 5}, middle[3] = {1, 4, 3};
    uint32_t e;
    for (e = 0; e < 3; e++) {
        const psurf__v3 m = l->n[e], n = l->n[(e + 1) % 3];
        psurf__put(out + 3 * corner[e], m);
        psurf__put(out + 3 * middle[e],
                   linear ? psurf__mul(psurf__add(m, n), PSURF__R(0.5))
                          : psurf__middle_normal(curve[e].chord, m, n, l->normal));
    }
}

static void psurf__pn_triangle(const psurf__local *l, const psurf__options *options,
                               psurf_real *out)
{
    psurf__frame frame;
    psurf__make_frame(l, PSURF__BY_PROJECTION, &frame);
    psurf__put_pn(l, frame.handle, options->sigma, out);
    psurf__put_normals(l, frame.curve, 0, out + 3 * 10);
}

/* The inner point of a quad beside corner i; handles lead to the next corner, 0, and to the
   previous one, 1. [PN] (4), whose weights must sum to 18, so that the last sign is a minus. Its E
   and V hold the same mean of the corners: (1+s) E - s V is that mean, and (1+s) times the handles
   in E. The discrete Coons rule, written the same way, has no sigma. */
static psurf__v3 psurf__quad_inner(const psurf__local *l, psurf__v3 handle[4][2], uint32_t i,
                                   const psurf__options *options)
{
    const uint32_t next = (i + 1) & 3, far_corner = (i + 2) & 3, previous = (i + 3) & 3;
    const psurf__v3 beside = psurf__add(l->p[next], l->p[previous]);
    const psurf__v3 own = psurf__add(handle[i][0], handle[i][1]);
    const psurf__v3 across = psurf__add(handle[far_corner][0], handle[far_corner][1]);
    const psurf_real ninth = PSURF__R(1.0 / 9.0);
    const psurf__v3 back = psurf__add(handle[next][0], handle[previous][1]);
    const psurf__v3 ahead = psurf__add(handle[next][1], handle[previous][0]);
    psurf__v3 corners, edges;
    if (options->flags & PSURF_COONS) {
        corners = psurf__sub(psurf__mad(beside, 8, l->p[i]), l->p[far_corner]);
        edges = psurf__mix(6, own, 3, back);
        return psurf__mul(psurf__add(corners, edges), ninth);
    }
    corners = psurf__add(psurf__mix(4, l->p[i], 2, beside), l->p[far_corner]);
    edges = psurf__add(psurf__mix(4, own, 2, psurf__add(back, ahead)), across);
    return psurf__mix(ninth, corners, (1 + options->sigma) * PSURF__R(1.0 / 18.0), edges);
}

/* Nine normals of a biquadratic patch: [PN] (5). */
static void psurf__put_quad_normals(const psurf__local *l, const psurf__curve *curve,
                                    psurf_real *out)
{
    static const unsigned char corner[4] = {0, 2, 8, 6}, middle[4] = {1, 5, 7, 3};
    psurf__v3 sum = psurf__zero();
    uint32_t i;
    for (i = 0; i < 4; i++) {
        const psurf__v3 n = psurf__middle_normal(curve[i].chord, l->n[i], l->n[(i + 1) & 3],
                                                 l->normal);
        psurf__put(out + 3 * corner[i], l->n[i]);
        psurf__put(out + 3 * middle[i], n);
        sum = psurf__add(sum, psurf__mad(l->n[i], 2, n));
    }
    psurf__put(out + 3 * 4, psurf__mul(sum, PSURF__R(1.0 / 12.0)));
}

static void psurf__pn_quad(const psurf__local *l, const psurf__options *options, psurf_real *out)
{
    static const unsigned char corner[4] = {0, 3, 15, 12}, inner[4] = {5, 6, 10, 9};
    static const unsigned char edge[4][2] = {{1, 4}, {7, 2}, {14, 11}, {8, 13}};
    psurf__v3 handle[4][2];
    psurf__curve curve[4];
    uint32_t i, k;
    for (i = 0; i < 4; i++) {
        curve[i] = psurf__make_curve(l, i, (i + 1) & 3, PSURF__BY_PROJECTION);
        handle[i][0] = curve[i].handle[0];
        handle[(i + 1) & 3][1] = curve[i].handle[1];
    }
    for (i = 0; i < 4; i++) {
        psurf__put(out + 3 * corner[i], l->p[i]);
        for (k = 0; k < 2; k++)
            psurf__put(out + 3 * edge[i][k], psurf__add(l->p[i], handle[i][k]));
        psurf__put(out + 3 * inner[i], psurf__quad_inner(l, handle, i, options));
    }
    psurf__put_quad_normals(l, curve, out + 3 * 16);
}

/* ---- smoothed_n: [N] ---- */

/* How flat an edge is; 1: it need not be smoothed. [N] takes the absolute value, which counts sharp
   folds as flat. */
static psurf_real psurf__flatness(const psurf__local *l, uint32_t e, int hard,
                                  const psurf__options *options)
{
    psurf_real dot = psurf__dot(l->normal, l->edge[e].normal);
    if (options->variant != PSURF_N_FINAL) return 0;
    if (l->edge[e].border || hard) return 1;
    if (dot < 0) dot = options->flags & PSURF_FOLDS ? PSURF__R(0) : -dot;
    if ((options->flags & PSURF_NEARLY_FLAT) && dot > PSURF__R(0.98)) return 1;
    return dot < 1 ? dot : PSURF__R(1);
}

static void psurf__smoothed_n(const psurf__local *l, const psurf__options *options, psurf_real *out)
{
    const int is_final = options->variant == PSURF_N_FINAL, g1 = options->variant == PSURF_N_G1;
    psurf__frame frame;
    uint32_t e;
    psurf__make_frame(l, PSURF__BY_PROJECTION, &frame);
    psurf__put_pn(l, frame.handle, options->sigma, out);
    psurf__put_normals(l, frame.curve, options->shading != PSURF_SHADE_QUADRATIC, out + 3 * 10);
    out += 3 * 16;
    for (e = 0; e < 3; e++) {
        out[e] = psurf__flatness(l, e, frame.curve[e].hard, options);
        out[3 + e] = PSURF__R(g1 && !frame.curve[e].hard);
    }
    out[6] = out[7] = PSURF__R(is_final);               /* its listing alone draws the inside */
    out[8] = PSURF__R(options->shading == PSURF_SHADE_EXACT);
}

/* ---- cubic_wm, cubic_pn: ribbons, [GB] 2.3 and 2.4 ---- */

/* An edge's curve as three legs, from point to point, and a vector across each. What leads into the
   triangle at either end is measured along and across the leg there, and carried to the others: so
   cross derivatives stay in planes that both facets know. */
typedef struct psurf__legs {
    psurf__v3 leg[3], across[3];
    psurf__v3 into[2];                  /* from start and end to the point off the edge */
    psurf_real slight;                  /* a leg with no greater square has no length */
    int singular;
} psurf__legs;

static psurf__legs psurf__legs_of(const psurf__frame *frame, uint32_t e)
{
    const psurf__curve *c = &frame->curve[e];
    psurf__legs s;
    s.leg[0] = c->handle[0];
    s.leg[1] = psurf__sub(psurf__add(c->chord, c->handle[1]), c->handle[0]);
    s.leg[2] = psurf__sub(psurf__zero(), c->handle[1]);
    s.into[0] = frame->handle[psurf__key[e][1]];
    s.into[1] = frame->handle[psurf__key[(e + 1) % 3][0]];
    s.slight = PSURF__SLIGHT * psurf__dot(c->chord, c->chord);
    s.singular = !(psurf__dot(s.leg[0], s.leg[0]) > s.slight &&
                   psurf__dot(s.leg[2], s.leg[2]) > s.slight);
    return s;
}

/* How often w is in v; 0 where w is nothing. */
static psurf_real psurf__part(psurf__v3 v, psurf__v3 w, psurf_real slight)
{
    const psurf_real q = psurf__dot(w, w);
    return q > slight ? psurf__dot(v, w) / q : PSURF__R(0);
}

typedef struct psurf__parts { psurf_real along, across; } psurf__parts;

static psurf__v3 psurf__carried(const psurf__legs *s, psurf__parts x, uint32_t leg)
{
    return psurf__mix(x.along, s->leg[leg], x.across, s->across[leg]);
}

/* The inner points of a hard edge, where nothing has to be smooth and the formulas go wild. */
static void psurf__plain_inside(const psurf__local *l, const psurf__frame *frame, psurf__v3 *inner)
{
    inner[0] = inner[1] = psurf__centre_point(l, frame->handle, PSURF__R(0.5));
}

/* In the tangent plane, across leg k at unit length: [GB] (4). Where the leg has no length, because
   the normal points along the edge, across the chord. */
static psurf__v3 psurf__across_leg(psurf__v3 normal, const psurf__legs *s, uint32_t k,
                                   psurf__v3 chord)
{
    const int none = !(psurf__dot(s->leg[k], s->leg[k]) > s->slight);
    return psurf__cross(normal, psurf__unit(none ? chord : s->leg[k]));
}

/* The two inner points that edge e asks for: its cross derivative, a cubic from d[0] to d[1], stays
   in the planes of the ribbon that both facets share. [GB] 2.4, where al1 and be1 take Delta_3. */
static int psurf__ribbon_edge(const psurf__local *l, const psurf__frame *frame, uint32_t e,
                              psurf__v3 *inner)
{
    const psurf__curve *c = &frame->curve[e];
    const psurf_real half = PSURF__R(0.5);
    psurf__legs s = psurf__legs_of(frame, e);
    psurf__v3 d[2], r[2], middle;
    psurf__parts x[2];
    uint32_t k;
    if (c->hard) {
        psurf__plain_inside(l, frame, inner);
        return PSURF_EDGE_HARD;
    }
    s.across[0] = psurf__across_leg(c->normal[0], &s, 0, c->chord);
    s.across[2] = psurf__across_leg(c->normal[1], &s, 2, c->chord);
    middle = psurf__add(s.across[0], s.across[2]);
    if (!(psurf__dot(middle, middle) > PSURF__SLIGHT)) {                  /* opposite normals */
        middle = s.across[0];
        s.singular = 1;
    }
    s.across[1] = psurf__unit(middle);
    d[0] = psurf__mad(s.into[0], -half, s.leg[0]);
    d[1] = psurf__mad(s.into[1], half, s.leg[2]);
    for (k = 0; k < 2; k++) {
        x[k].along = psurf__part(d[k], s.leg[2 * k], s.slight);
        x[k].across = psurf__part(d[k], s.across[2 * k], PSURF__SLIGHT);
    }
    r[0] = psurf__mad(psurf__carried(&s, x[1], 0), 2, psurf__carried(&s, x[0], 1));
    r[1] = psurf__mad(psurf__carried(&s, x[0], 2), 2, psurf__carried(&s, x[1], 1));
    middle = psurf__mul(psurf__add(psurf__add(l->p[e], c->handle[0]),
                                   psurf__add(l->p[(e + 1) % 3], c->handle[1])), half);
    for (k = 0; k < 2; k++)                                        /* (3 R - D)/2, R = r/3 */
        inner[k] = psurf__mad(middle, half, psurf__sub(r[k], d[k]));
    return s.singular ? PSURF_EDGE_FALLBACK : PSURF_EDGE_SMOOTH;
}

static void psurf__ribbons(const psurf__local *l, psurf__curve_rule rule, psurf_real *out)
{
    psurf__frame frame;
    psurf__v3 inner[2];
    uint32_t e, k;
    psurf__make_frame(l, rule, &frame);
    psurf__put_nine(l, frame.handle, out);
    for (e = 0; e < 3; e++) {
        psurf__put_end(l, e, psurf__ribbon_edge(l, &frame, e, inner), out + 3 * 15);
        for (k = 0; k < 2; k++) psurf__put(out + 3 * (9 + 2 * e + k), inner[k]);
    }
}

static void psurf__cubic_wm(const psurf__local *l, const psurf__options *options, psurf_real *out)
{
    (void)options;
    psurf__ribbons(l, PSURF__BY_WM, out);
}

static void psurf__cubic_pn(const psurf__local *l, const psurf__options *options, psurf_real *out)
{
    (void)options;
    psurf__ribbons(l, PSURF__BY_PROJECTION, out);
}

/* ---- png1: [GB] 2.2 ---- */

/* The inner points of edge e, and handles of two keys off it, from a similarity per leg. Any map
   that is linear in a leg and its across makes the edge G1; that it is this the paper's tables
   tell. */
static int psurf__png1_edge(const psurf__local *l, const psurf__frame *frame, uint32_t e,
                            psurf__v3 *inner, psurf__v3 *alt)
{
    const psurf__curve *c = &frame->curve[e];
    const psurf__v3 normals = psurf__add(l->normal, l->edge[e].normal);
    psurf__legs s = psurf__legs_of(frame, e);
    psurf__parts x[2];
    psurf__v3 normal[3];
    uint32_t k;
    if (c->hard) {
        psurf__plain_inside(l, frame, inner);
        return PSURF_EDGE_HARD;
    }
    normal[0] = c->normal[0];
    normal[1] = psurf__unit(psurf__tangential(normals, psurf__unit(s.leg[1])));
    normal[2] = c->normal[1];
    for (k = 0; k < 3; k++) s.across[k] = psurf__cross(normal[k], s.leg[k]);
    for (k = 0; k < 2; k++) {
        x[k].along = psurf__part(s.into[k], s.leg[2 * k], s.slight);
        x[k].across = psurf__part(s.into[k], s.across[2 * k], s.slight);
        inner[k] = psurf__add(psurf__add(l->p[(e + k) % 3], c->handle[k]),
                              psurf__carried(&s, x[k], 1));
    }
    alt[psurf__key[e][1]] = psurf__add(c->handle[0], psurf__carried(&s, x[1], 0));
    alt[psurf__key[(e + 1) % 3][0]] = psurf__add(c->handle[1], psurf__carried(&s, x[0], 2));
    if (!(psurf__dot(normals, normals) > PSURF__SLIGHT)) s.singular = 1;
    if (psurf__dot(normal[0], normal[2]) <= -1 + PSURF__SLIGHT) s.singular = 1;       /* opposite */
    return s.singular ? PSURF_EDGE_FALLBACK : PSURF_EDGE_SMOOTH;
}

static void psurf__png1(const psurf__local *l, const psurf__options *options, psurf_real *out)
{
    psurf__frame frame;
    psurf__v3 alt[6], inner[2];
    uint32_t e, k;
    (void)options;
    psurf__make_frame(l, PSURF__BY_LENGTH, &frame);
    for (k = 0; k < 6; k++) alt[k] = frame.handle[k];
    psurf__put_nine(l, frame.handle, out);
    for (e = 0; e < 3; e++) {
        psurf__put_end(l, e, psurf__png1_edge(l, &frame, e, inner, alt), out + 3 * 21);
        for (k = 0; k < 2; k++) psurf__put(out + 3 * (15 + 2 * e + k), inner[k]);
    }
    for (k = 0; k < 6; k++)
        psurf__put(out + 3 * (9 + k), psurf__add(l->p[psurf__key_corner[k]], alt[k]));
}

/* ---- hybrid: [GB] 2.1 ---- */

/* An edge from a to b with its two triangles, whose other corners are c and, across, one more;
   places are seen from a. */
typedef struct psurf__hinge {
    psurf__v3 b, c, across;
    psurf__v3 normal[4];                /* at a, b, c, and across */
    psurf__v3 m;                        /* the direction that points are lifted along */
    int alone;                          /* nothing to be smooth with: a border, or hard */
    int lifted;                         /* lifting works */
} psurf__hinge;

/* Whether a direction is fit to lift along: no tangent plane stands too steep. */
static int psurf__can_lift(const psurf__hinge *h, uint32_t normals)
{
    uint32_t i;
    for (i = 0; i < normals; i++)
        if (!(psurf__abs(psurf__dot(h->normal[i], h->m)) >= PSURF__R(0.1))) return 0;
    return 1;
}

/* Finds the direction of a smooth edge, and whether the formula holds: with the two triangles, seen
   along m, on different sides of the edge, and neither of them too thin. Both facets must decide
   alike, so they look at the edge the same way round. */
static int psurf__open_hinge(const psurf__local *l, uint32_t e, uint32_t flags, psurf__hinge *h)
{
    const psurf__local_edge *edge = &l->edge[e];
    const psurf__v3 own = l->p[(e + 2) % 3];
    const psurf__v3 from = l->p[edge->turned ? (e + 1) % 3 : e];
    const psurf__v3 side = psurf__sub(l->p[edge->turned ? e : (e + 1) % 3], from);
    const psurf__v3 to_left = psurf__sub(edge->turned ? edge->apex : own, from);
    const psurf__v3 to_right = psurf__sub(edge->turned ? own : edge->apex, from);
    const psurf__v3 left = psurf__cross(side, to_left), right = psurf__cross(to_right, side);
    const psurf_real reach = psurf__dot(side, side) + psurf__dot(to_left, to_left) +
                             psurf__dot(to_right, to_right);
    const psurf_real least = PSURF__R(1e-4) * reach;
    psurf_real a, b;
    if (flags & PSURF_PLANE_NORMALS)
        h->m = psurf__unit(psurf__tangential(psurf__add(h->normal[0], h->normal[1]),
                                             psurf__unit(side)));
    else
        h->m = psurf__unit(psurf__add(psurf__unit(left), psurf__unit(right)));
    a = psurf__dot(left, h->m);
    b = psurf__dot(right, h->m);
    return ((a > least && b > least) || (-a > least && -b > least)) && psurf__can_lift(h, 4);
}

static psurf__hinge psurf__hinge_of(const psurf__local *l, const psurf__frame *wm, uint32_t e,
                                    uint32_t flags)
{
    const uint32_t f = (e + 1) % 3, g = (e + 2) % 3;
    const psurf__curve *curve = &wm->curve[e];
    psurf__hinge h;
    h.b = psurf__sub(l->p[f], l->p[e]);
    h.c = psurf__sub(l->p[g], l->p[e]);
    h.across = psurf__sub(l->edge[e].apex, l->p[e]);
    h.alone = curve->hard || l->edge[e].border;
    h.normal[0] = h.alone ? l->n[e] : curve->normal[0];
    h.normal[1] = h.alone ? l->n[f] : curve->normal[1];
    h.normal[2] = l->n[g];
    h.normal[3] = l->edge[e].apex_normal;
    h.m = l->normal;
    h.lifted = h.alone ? psurf__can_lift(&h, 3) : psurf__open_hinge(l, e, flags, &h);
    return h;
}

/* A third of the way d from a point, moved along m into its tangent plane. */
static psurf__v3 psurf__lift(psurf__v3 d, psurf__v3 n, psurf__v3 m)
{
    const psurf_real s = -(psurf__dot(n, d) / psurf__dot(n, m));
    return psurf__mul(psurf__mad(d, s, m), PSURF__R(1.0 / 3.0));
}

/* All six handles by lifting, in the order of the keys: a to b, b to a, a to c, ... */
static void psurf__lift_all(const psurf__hinge *h, psurf__v3 *handle)
{
    const psurf__v3 zero = psurf__zero(), *n = h->normal;
    handle[0] = psurf__lift(h->b, n[0], h->m);
    handle[1] = psurf__lift(psurf__sub(zero, h->b), n[1], h->m);
    handle[2] = psurf__lift(h->c, n[0], h->m);
    handle[3] = psurf__lift(psurf__sub(h->c, h->b), n[1], h->m);
    handle[4] = psurf__lift(psurf__sub(zero, h->c), n[2], h->m);
    handle[5] = psurf__lift(psurf__sub(h->b, h->c), n[2], h->m);
}

/* The height of b111 over a along m: the two conditions for C2 across the edge, added, which has
   cubic precision. r, s, t: barycentric coordinates of the far corner, seen along m. */
static psurf_real psurf__hybrid_height(const psurf__hinge *h, const psurf__v3 *handle)
{
    const psurf__v3 m = h->m, n = h->normal[3], to_a = psurf__sub(psurf__zero(), h->across);
    const psurf__v3 to_b = psurf__sub(h->b, h->across);
    const psurf_real k = psurf__dot(psurf__cross(h->b, h->c), m);
    const psurf_real s = psurf__dot(psurf__cross(h->across, h->c), m) / k;
    const psurf_real t = psurf__dot(psurf__cross(h->b, h->across), m) / k, r = 1 - s - t;
    const psurf_real b = psurf__dot(h->b, m), c = psurf__dot(h->c, m), d = psurf__dot(h->across, m);
    const psurf_real b210 = psurf__dot(handle[0], m), b120 = b + psurf__dot(handle[1], m);
    const psurf_real b201 = psurf__dot(handle[2], m), b021 = b + psurf__dot(handle[3], m);
    const psurf_real b102 = c + psurf__dot(handle[4], m), b012 = c + psurf__dot(handle[5], m);
    const psurf_real c102 = d + psurf__dot(psurf__lift(to_a, n, m), m);
    const psurf_real c012 = d + psurf__dot(psurf__lift(to_b, n, m), m);
    const psurf_real edge = r * r * b210 + 2 * r * s * (b210 + b120) + s * s * (b120 + b);
    const psurf_real inside = 2 * t * (r * b201 + s * b021) + t * t * (b102 + b012);
    return (c102 + c012 - edge - inside) / (2 * t * (r + s));
}

/* b111 of a set: by the formula; a PN triangle's, where there is nothing to be smooth with; where
   lifting fails, what the two inner points of Walton and Meek's ribbon have in the middle. */
static psurf__v3 psurf__hybrid_centre(const psurf__local *l, const psurf__frame *wm, uint32_t e,
                                      const psurf__hinge *h, const psurf__v3 *handle)
{
    const psurf__v3 middle = psurf__mul(psurf__add(h->b, h->c), PSURF__R(1.0 / 3.0));
    psurf__v3 inner[2];
    if (h->alone) return psurf__centre_point(l, handle, PSURF__R(0.5));
    if (h->lifted)
        return psurf__mad(psurf__add(l->p[e], middle),
                          psurf__hybrid_height(h, handle) - psurf__dot(middle, h->m), h->m);
    psurf__ribbon_edge(l, wm, e, inner);
    return psurf__mul(psurf__add(inner[0], inner[1]), PSURF__R(0.5));
}

/* The set of edge e: b210 b120 b201 b021 b111, as if it were the first. Its own two keys are those
   of the hard curve where it is hard; all are Walton and Meek's where lifting fails. */
static int psurf__hybrid_set(const psurf__local *l, const psurf__frame *wm, uint32_t e,
                             uint32_t flags, psurf__v3 *set)
{
    const psurf__curve *curve = &wm->curve[e];
    const psurf__hinge h = psurf__hinge_of(l, wm, e, flags);
    psurf__v3 handle[6];
    uint32_t k;
    for (k = 0; k < 6; k++)
        handle[k] = wm->handle[psurf__key[(e + psurf__key_corner[k]) % 3][psurf__key_way[k]]];
    if (h.lifted) psurf__lift_all(&h, handle);
    if (curve->hard) {
        handle[0] = curve->handle[0];
        handle[1] = curve->handle[1];
    }
    for (k = 0; k < 4; k++) set[k] = psurf__add(l->p[(e + k % 2) % 3], handle[k]);
    set[4] = psurf__hybrid_centre(l, wm, e, &h, handle);
    if (curve->hard) return PSURF_EDGE_HARD;
    return h.lifted ? PSURF_EDGE_SMOOTH : PSURF_EDGE_FALLBACK;
}

static void psurf__hybrid(const psurf__local *l, const psurf__options *options, psurf_real *out)
{
    psurf__frame wm;
    psurf__v3 set[5];
    uint32_t e, k;
    psurf__make_frame(l, PSURF__BY_WM, &wm);
    for (e = 0; e < 3; e++) {
        psurf__put(out + 3 * e, l->p[e]);
        psurf__put_end(l, e, psurf__hybrid_set(l, &wm, e, options->flags, set), out + 3 * 18);
        for (k = 0; k < 5; k++) psurf__put(out + 3 * (3 + 5 * e + k), set[k]);
    }
}

/* ---- point-normal schemes: from the tables to the rules ---- */

/* The kind of patch of facets filed under a kind. */
static psurf_kind psurf__patch_kind(const psurf_patches *p, psurf_kind kind);

/* A corner: its point, its normal on this side. Returns the vertex. */
static uint32_t psurf__read_point_normal(const psurf_patches *p, uint32_t corner, psurf__v3 *point,
                                         psurf__v3 *normal)
{
    const uint32_t ring = p->topology->corners[corner].ring & ~PSURF_WRITER;
    *point = psurf__get(psurf__limit(p, ring));
    *normal = psurf__get(psurf__vertex_normal(p, ring));
    return p->topology->rings[ring].point;
}

static psurf__v3 psurf__triangle_normal(psurf__v3 a, psurf__v3 b, psurf__v3 c)
{
    return psurf__unit(psurf__cross(psurf__sub(b, a), psurf__sub(c, a)));
}

/* What lies across edge i of a facet of size corners. The facet across runs the other way: its
   half-edge starts where ours ends. Its normal is made as it makes it itself: same bits. Across a
   smooth edge the normals at its ends are our own. */
static void psurf__read_across(const psurf_patches *p, uint32_t corner, uint32_t size, uint32_t i,
                               int apexes, psurf__local *l)
{
    const psurf_topology *t = p->topology;
    const uint32_t other = psurf__corner_across(t, corner), next = psurf__following(i, size);
    psurf__local_edge *edge = &l->edge[i];
    uint32_t place, first, sides, k;
    psurf__v3 p3[4], n3[4];
    edge->border = other == PSURF_NONE;
    edge->begin = l->n[i];
    edge->end = l->n[next];
    edge->apex = l->p[psurf__following(next, size)];
    edge->apex_normal = l->n[psurf__following(next, size)];
    edge->normal = l->normal;
    if (edge->border ||
        (!apexes && !((t->corners[other].edge ^ t->corners[corner].edge) & ~PSURF_WRITER)))
        return;
    sides = psurf__kind_sides(psurf__facet_kind(t, psurf__corner_facet(t, other, &place)));
    first = other - place;
    for (k = 0; k < sides; k++) psurf__read_point_normal(p, first + k, &p3[k], &n3[k]);
    edge->end = n3[place];
    place = psurf__following(place, sides);
    edge->begin = n3[place];
    place = psurf__following(place, sides);
    edge->apex = p3[place];
    edge->apex_normal = n3[place];
    edge->normal = psurf__triangle_normal(p3[0], p3[1], p3[2]);
}

/* A facet of size corners from first on. */
static void psurf__read_local(const psurf_patches *p, uint32_t first, uint32_t size, int apexes,
                              psurf__local *l)
{
    uint32_t vertex[4], i;
    for (i = 0; i < size; i++)
        vertex[i] = psurf__read_point_normal(p, first + i, &l->p[i], &l->n[i]);
    l->normal = psurf__triangle_normal(l->p[0], l->p[1], l->p[2]);
    for (i = 0; i < size; i++) {
        psurf__read_across(p, first + i, size, i, apexes, l);
        l->edge[i].turned = vertex[i] > vertex[psurf__following(i, size)];
    }
}

/* Runs a rule over facets first to end-1. */
static void psurf__run_rule(const psurf_patches *p, const psurf__control *control, psurf_kind kind,
                            uint32_t first, uint32_t end, psurf__local_rule *rule, int apexes,
                            psurf_real *out)
{
    const uint32_t sides = psurf__kind_sides(kind);
    const size_t reals = 3 * (size_t)psurf__kind_table[psurf__patch_kind(p, kind)].points;
    uint32_t corner = psurf__facet_corner(p->topology, kind, first), i;
    psurf__local local;
    for (i = first; i < end; i++, corner += sides, out += reals) {
        psurf__read_local(p, corner, sides, apexes, &local);
        rule(&local, &control->options, out);
    }
}

/* Finds the rule in the table below. */
static void psurf__local_facets(const psurf_patches *p, const psurf__control *control,
                                psurf_kind kind, uint32_t first, uint32_t end, psurf_real *out);

/* ---- the table of schemes, and the passes that run them ---- */

typedef struct psurf__scheme_row {
    const char *name;
    psurf_split split;
    psurf_kind triangle;                /* of facets that the topology files as PSURF_PN_TRI */
    psurf__curves curves;
    void (*facets)(const psurf_patches *, const psurf__control *, psurf_kind, uint32_t first,
                   uint32_t end, psurf_real *out);
    psurf__local_rule *rule, *quad;     /* what psurf__local_facets asks */
    int apexes;                         /* rule looks at the facets across */
} psurf__scheme_row;

static const psurf__scheme_row psurf__schemes[PSURF_SCHEME_COUNT] = {
    {"pm", PSURF_SPLIT_PM, PSURF_PN_TRI, PSURF__NO_CURVES, psurf__pm_facets, NULL, NULL, 0},
    {"pn", PSURF_SPLIT_PN, PSURF_PN_TRI, PSURF__PN_CURVES, psurf__local_facets,
     psurf__pn_triangle, psurf__pn_quad, 0},
    {"smoothed_n", PSURF_SPLIT_TRIANGLES, PSURF_NPATCH, PSURF__PN_CURVES, psurf__local_facets,
     psurf__smoothed_n, NULL, 1},
    {"hybrid", PSURF_SPLIT_TRIANGLES, PSURF_HYBRID_TRI, PSURF__HYBRID_CURVES, psurf__local_facets,
     psurf__hybrid, NULL, 1},
    {"png1", PSURF_SPLIT_TRIANGLES, PSURF_PNG1_TRI, PSURF__PNG1_CURVES, psurf__local_facets,
     psurf__png1, NULL, 1},
    {"cubic_wm_b1", PSURF_SPLIT_TRIANGLES, PSURF_RIBBON, PSURF__WM_CURVES, psurf__local_facets,
     psurf__cubic_wm, NULL, 0},
    {"cubic_pn_b1", PSURF_SPLIT_TRIANGLES, PSURF_RIBBON, PSURF__PN_CURVES, psurf__local_facets,
     psurf__cubic_pn, NULL, 0},
    {"cubic_wm_b2", PSURF_SPLIT_TRIANGLES, PSURF_RIBBON_B2, PSURF__WM_CURVES, psurf__local_facets,
     psurf__cubic_wm, NULL, 0},
    {"cubic_pn_b2", PSURF_SPLIT_TRIANGLES, PSURF_RIBBON_B2, PSURF__PN_CURVES, psurf__local_facets,
     psurf__cubic_pn, NULL, 0},
    {"mixed", PSURF_SPLIT_TRIANGLES, PSURF_PN_TRI, PSURF__NO_CURVES, psurf__local_facets, NULL,
     NULL, 0}
};

static psurf__curves psurf__scheme_curves(uint32_t scheme)
{
    return scheme < PSURF_SCHEME_COUNT ? psurf__schemes[scheme].curves : PSURF__NO_CURVES;
}

static psurf_kind psurf__scheme_triangle(uint32_t scheme)
{
    return psurf__schemes[scheme].triangle;
}

static psurf_kind psurf__patch_kind(const psurf_patches *p, psurf_kind kind)
{
    return kind == PSURF_PN_TRI ? psurf__schemes[p->scheme].triangle : kind;
}

/* In a mix, it is that which makes this kind from the curves that the mix has. */
static void psurf__local_facets(const psurf_patches *p, const psurf__control *control,
                                psurf_kind kind, uint32_t first, uint32_t end, psurf_real *out)
{
    const psurf__scheme_row *row = &psurf__schemes[p->scheme];
    if (p->scheme == PSURF_MIXED)
        for (row = psurf__schemes; row->triangle != kind || row->curves != p->topology->curves;)
            row++;
    psurf__run_rule(p, control, kind, first, end, kind == PSURF_PN_QUAD ? row->quad : row->rule,
                    row->apexes, out);
}

static psurf_real *psurf__patch_points(const psurf_patches *p, psurf_kind kind, uint32_t facet)
{
    const size_t index = facet - p->topology->kind_first[kind];
    const psurf_kind_block *at = &p->layout.kind[psurf__patch_kind(p, kind)];
    psurf_real *block = (psurf_real *)(void *)((char *)p->patches + at->offset);
    return block + index * 3 * at->points;
}

static uint32_t psurf__count_patches(const psurf_topology *t, psurf_scheme scheme, uint32_t kind)
{
    const uint32_t triangle = (uint32_t)psurf__schemes[scheme].triangle;
    const uint32_t filed = kind == triangle ? (uint32_t)PSURF_PN_TRI : kind;
    if (kind == (uint32_t)PSURF_PN_TRI && kind != triangle) return 0;
    return t->kind_first[filed + 1] - t->kind_first[filed];
}

PSURF_API psurf_result psurf_patches_size(const psurf_topology *topology, psurf_scheme scheme,
                                          psurf_patches_layout *layout)
{
    psurf__block patches = {NULL, 0}, scratch = {NULL, 0};
    uint32_t k;
    int pm;
    if (!topology || !layout || (uint32_t)scheme >= PSURF_SCHEME_COUNT) return PSURF_BAD_DESC;
    if (psurf__schemes[scheme].split != topology->split ||
        (scheme == PSURF_MIXED) != topology->mixed) return PSURF_BAD_SPLIT;
    pm = topology->split == PSURF_SPLIT_PM;
    for (k = 0; k < PSURF_KIND_COUNT; k++) {
        psurf_kind_block *block = &layout->kind[k];
        block->count = psurf__count_patches(topology, scheme, k);
        block->points = psurf__kind_table[k].points;
        psurf__carve(&patches, 0, 1, 256);
        block->offset = patches.used;
        psurf__carve(&patches, block->count, 3 * block->points * sizeof(psurf_real), 1);
    }
    layout->centre_offset = 0;
    psurf__carve(&scratch, topology->info.centres, 3 * sizeof(psurf_real), 1);
    psurf__carve(&scratch, 0, 1, 256);
    layout->limit_offset = scratch.used;
    psurf__carve(&scratch, topology->info.rings, 3 * sizeof(psurf_real), 1);
    psurf__carve(&scratch, 0, 1, 256);
    layout->spoke_offset = scratch.used;
    psurf__carve(&scratch, pm ? topology->info.spokes : 0, 6 * sizeof(psurf_real), 1);
    psurf__carve(&scratch, 0, 1, pm ? 1 : 256);
    layout->normal_offset = scratch.used;
    psurf__carve(&scratch, pm ? 0 : topology->info.rings, 3 * sizeof(psurf_real), 1);
    layout->patch_bytes = patches.used;
    layout->scratch_bytes = scratch.used;
    layout->pass_items[PSURF_PASS_CENTRES] = topology->info.centres;
    layout->pass_items[PSURF_PASS_VERTICES] = topology->info.rings;
    layout->pass_items[PSURF_PASS_FACETS] = topology->info.facets;
    return patches.used == SIZE_MAX || scratch.used == SIZE_MAX ? PSURF_TOO_LARGE : PSURF_OK;
}

PSURF_API psurf_result psurf_patches_bind(psurf_patches *out, const psurf_topology *topology,
                                          psurf_scheme scheme, void *patches, void *scratch)
{
    psurf_result result;
    if (!out) return PSURF_BAD_DESC;
    result = psurf_patches_size(topology, scheme, &out->layout);
    if (result != PSURF_OK) return result;
    if ((!patches && out->layout.patch_bytes) || (uintptr_t)patches % sizeof(psurf_real) ||
        (uintptr_t)scratch % sizeof(psurf_real)) return PSURF_BAD_DESC;
    out->topology = topology;
    out->scheme = scheme;
    out->patches = patches;
    out->scratch = scratch;
    return PSURF_OK;
}

static uint32_t psurf__range_end(uint32_t first, uint32_t count, uint32_t items)
{
    if (first >= items) return first;
    return count > items - first ? items : first + count;
}

static int psurf__construct_desc_ok(const psurf_construct_desc *desc)
{
    const uint32_t known = PSURF_SIGMA | PSURF_COONS | PSURF_FOLDS | PSURF_NEARLY_FLAT |
                           PSURF_PLANE_NORMALS;
    return desc && !desc->_start_canary && !desc->_end_canary && desc->positions &&
           desc->position_stride % sizeof(psurf_real) == 0 &&
           desc->normal_stride % sizeof(psurf_real) == 0 && !(desc->flags & ~known) &&
           (uint32_t)desc->normal_mode < PSURF_NORMALS_COUNT &&
           (uint32_t)desc->variant < PSURF_N_COUNT &&
           (uint32_t)desc->shading < PSURF_SHADE_COUNT &&
           (!(desc->flags & PSURF_SIGMA) || psurf__finite(desc->sigma));
}

PSURF_API psurf_result psurf_construct_pass(const psurf_patches *patches,
                                            const psurf_construct_desc *desc, psurf_pass pass,
                                            uint32_t first, uint32_t count)
{
    const psurf_topology *t;
    psurf__control control;
    uint32_t i, end, kind_end;
    if (!patches || !psurf__construct_desc_ok(desc) || (uint32_t)pass >= PSURF_PASS_COUNT ||
        (!patches->scratch && patches->layout.scratch_bytes)) return PSURF_BAD_DESC;
    t = patches->topology;
    control = psurf__control_of(patches, desc);
    end = psurf__range_end(first, count, patches->layout.pass_items[pass]);
    if (pass == PSURF_PASS_CENTRES)
        for (i = first; i < end; i++) psurf__centre_pass(patches, &control, i);
    if (pass == PSURF_PASS_VERTICES)
        for (i = first; i < end; i++) psurf__vertex_pass(patches, &control, i);
    if (pass == PSURF_PASS_FACETS)
        for (i = first; i < end; i = kind_end) {
            const psurf_kind kind = psurf__facet_kind(t, i);
            kind_end = t->kind_first[kind + 1] < end ? t->kind_first[kind + 1] : end;
            psurf__schemes[patches->scheme].facets(patches, &control, kind, i, kind_end,
                                                   psurf__patch_points(patches, kind, i));
        }
    return PSURF_OK;
}

PSURF_API psurf_result psurf_construct(const psurf_patches *patches,
                                       const psurf_construct_desc *desc)
{
    uint32_t pass;
    psurf_result result = PSURF_OK;
    for (pass = 0; pass < PSURF_PASS_COUNT && result == PSURF_OK; pass++)
        result = psurf_construct_pass(patches, desc, (psurf_pass)pass, 0, PSURF_NONE);
    return result;
}

PSURF_API psurf_patch psurf_get_patch(const psurf_patches *patches, uint32_t index)
{
    const psurf_topology *t = patches->topology;
    psurf_patch patch;
    psurf_kind filed;
    patch.kind = PSURF_BICUBIC;
    patch.face = patch.sector = PSURF_NONE;
    patch.point_count = 0;
    patch.points = NULL;
    if (index >= t->info.facets) return patch;
    filed = psurf__facet_kind(t, index);
    patch.kind = psurf__patch_kind(patches, filed);
    patch.face = t->facets[index].face;
    patch.sector = t->facets[index].piece & 0xFFFFu;
    patch.point_count = psurf__kind_table[patch.kind].points;
    patch.points = psurf__patch_points(patches, filed, index);
    return patch;
}

/* >>6 PARAMETERS ==============================================================================
   Where a parameter lies on a patch (locate), and derivatives of the patch turned into those of the
   face (pull): one row per kind at the end of the chapter. What chapter 7 is asked for, and how.

   Parameters enter as weights w over a common denominator d: a face parameter with d = 1, or the
   integers of a tessellation lattice with d = rate. Sums and differences of such integers are
   exact, and every weight is divided once, at the end: so both sides of an edge get the same r, s.
   Triangles: w = weights of the three corners. Quads: 1-u, u, 1-v, v. Sectors: weights of corner i,
   corner i+1, centre. */

enum {
    PSURF__MAX_SECTORS = 5, PSURF__MAX_POINTS = 31, PSURF__MAX_NET = 16,
    PSURF__MAX_TRIANGLE = 25, PSURF__MAX_BLENDS = 12    /* of point-normal triangles */
};

typedef struct psurf__spot {
    uint32_t sector;                    /* of a Pm-patch */
    uint32_t edge;                      /* edge of the patch it lies on, or PSURF_NONE */
    psurf_real x;                       /* on an edge: -1/2 at its beginning, 1/2 at its end */
    psurf_real w[4];                    /* tensor: 1-u, u, 1-v, v; sector: corner i, i+1, centre */
} psurf__spot;

typedef struct psurf__jet {
    psurf__v3 p, n, shade, du, dv, duu, duv, dvv;
    int curved;                         /* second derivatives exist here */
} psurf__jet;

static void psurf__set_edge(psurf__spot *spot, uint32_t edge, psurf_real r, psurf_real s,
                            psurf_real d)
{
    spot->edge = edge;
    spot->x = (s - r) / (2 * d);
}

static void psurf__set_weights(psurf__spot *spot, psurf_real a, psurf_real b, psurf_real c,
                               psurf_real d)
{
    spot->w[0] = a / d;
    spot->w[1] = b / d;
    spot->w[2] = c / d;
}

/* The edge of a triangle or of the unit square that weights lie on, if any. */
static void psurf__find_triangle_edge(psurf__spot *spot, const psurf_real *w, psurf_real d)
{
    spot->edge = PSURF_NONE;
    if (w[2] <= 0) psurf__set_edge(spot, 0, w[0], w[1], d);
    else if (w[0] <= 0) psurf__set_edge(spot, 1, w[1], w[2], d);
    else if (w[1] <= 0) psurf__set_edge(spot, 2, w[2], w[0], d);
}

static void psurf__find_quad_edge(psurf__spot *spot, const psurf_real *w, psurf_real d)
{
    spot->edge = PSURF_NONE;
    if (w[3] <= 0) psurf__set_edge(spot, 0, w[0], w[1], d);
    else if (w[0] <= 0) psurf__set_edge(spot, 1, w[2], w[3], d);
    else if (w[2] <= 0) psurf__set_edge(spot, 2, w[1], w[0], d);
    else if (w[1] <= 0) psurf__set_edge(spot, 3, w[3], w[2], d);
}

/* ---- bicubic ---- */

static void psurf__bicubic_locate(uint32_t turn, uint32_t sector, const psurf_real *w, psurf_real d,
                                  psurf__spot *spot)
{
    uint32_t k;
    (void)turn;
    (void)sector;
    spot->sector = 0;
    for (k = 0; k < 4; k++) spot->w[k] = w[k] / d;
    psurf__find_quad_edge(spot, w, d);
}

static void psurf__bicubic_pull(const psurf__spot *spot, uint32_t turn, psurf__jet *jet)
{
    (void)spot;
    (void)turn;
    (void)jet;                                        /* the patch has the parameters of the face */
}

/* ---- polar ---- */

static void psurf__polar_locate(uint32_t turn, uint32_t sector, const psurf_real *w, psurf_real d,
                                psurf__spot *spot)
{
    psurf_real turned[3], base;
    uint32_t k;
    (void)sector;
    for (k = 0; k < 3; k++) turned[k] = w[(turn + k) % 3];
    base = turned[0] + turned[1];
    spot->sector = 0;
    spot->w[0] = base > 0 ? turned[0] / base : PSURF__R(0.5);
    spot->w[1] = base > 0 ? turned[1] / base : PSURF__R(0.5);
    spot->w[2] = base / d;
    spot->w[3] = turned[2] / d;
    psurf__find_triangle_edge(spot, turned, d);
}

/* How fast the weight of a corner of a triangle changes with u (which = 0) or v (1). */
static psurf_real psurf__weight_slope(uint32_t corner, uint32_t which)
{
    if (corner == 0) return -1;
    return corner == which + 1 ? PSURF__R(1) : PSURF__R(0);
}

/* The jet has S = S_u/(1-v), and duu, duv likewise. Per direction, o = change of the pole's weight,
   q = change of B's weight + u o: D = S q + S_v o, and
   D_xy = S_u q_x q_y/(1-v) + S_v (q_x o_y + o_x q_y) + S_vv o_x o_y. */
static void psurf__polar_pull(const psurf__spot *spot, uint32_t turn, psurf__jet *jet)
{
    const psurf__jet in = *jet;
    const psurf_real u = spot->w[1], rest = spot->w[2];
    psurf_real o[2], q[2];
    uint32_t k;
    for (k = 0; k < 2; k++) {
        o[k] = psurf__weight_slope((turn + 2) % 3, k);
        q[k] = psurf__weight_slope((turn + 1) % 3, k) + u * o[k];
    }
    jet->du = psurf__mix(q[0], in.du, o[0], in.dv);
    jet->dv = psurf__mix(q[1], in.du, o[1], in.dv);
    if (!(rest > 0)) {
        jet->curved = 0;
        jet->duu = jet->duv = jet->dvv = psurf__zero();
        return;
    }
    jet->duu = psurf__add(psurf__mix(q[0] * q[0] / rest, in.duu, 2 * q[0] * o[0], in.duv),
                          psurf__mul(in.dvv, o[0] * o[0]));
    jet->duv = psurf__add(psurf__mix(q[0] * q[1] / rest, in.duu, q[0] * o[1] + o[0] * q[1], in.duv),
                          psurf__mul(in.dvv, o[0] * o[1]));
    jet->dvv = psurf__add(psurf__mix(q[1] * q[1] / rest, in.duu, 2 * q[1] * o[1], in.duv),
                          psurf__mul(in.dvv, o[1] * o[1]));
}

/* ---- P3, P4, P5: sectors ---- */

/* The sector of a triangle is that of the edge opposite the least weight; lower ones win ties. */
static void psurf__p3_locate(uint32_t turn, uint32_t sector, const psurf_real *w, psurf_real d,
                             psurf__spot *spot)
{
    const uint32_t i = w[2] <= w[0] && w[2] <= w[1] ? 0 : w[0] <= w[1] ? 1 : 2;
    const psurf_real a = w[i], b = w[(i + 1) % 3], least = w[(i + 2) % 3];
    (void)turn;
    (void)sector;
    spot->sector = i;
    psurf__set_weights(spot, a - least, b - least, 3 * least, d);
    psurf__find_triangle_edge(spot, w, d);
}

/* The sector of the unit square is that of the nearest side; lower ones win ties. */
static void psurf__p4_locate(uint32_t turn, uint32_t sector, const psurf_real *w, psurf_real d,
                             psurf__spot *spot)
{
    const psurf_real u0 = w[0], u1 = w[1], v0 = w[2], v1 = w[3];
    (void)turn;
    (void)sector;
    if (v1 <= u0 && v1 <= u1) {
        spot->sector = 0;
        psurf__set_weights(spot, u0 - v1, u1 - v1, 2 * v1, d);
    } else if (u0 <= v0 && u0 <= v1) {
        spot->sector = 1;
        psurf__set_weights(spot, v0 - u0, v1 - u0, 2 * u0, d);
    } else if (v0 <= u0 && v0 <= u1) {
        spot->sector = 2;
        psurf__set_weights(spot, u1 - v0, u0 - v0, 2 * v0, d);
    } else {
        spot->sector = 3;
        psurf__set_weights(spot, v1 - u1, v0 - u1, 2 * u1, d);
    }
    psurf__find_quad_edge(spot, w, d);
}

static void psurf__p5_locate(uint32_t turn, uint32_t sector, const psurf_real *w, psurf_real d,
                             psurf__spot *spot)
{
    (void)turn;
    spot->sector = sector;
    spot->edge = PSURF_NONE;
    psurf__set_weights(spot, w[0], w[1], w[2], d);
    if (w[2] <= 0) psurf__set_edge(spot, sector, w[0], w[1], d);
}

/* Chain rule for linear parameters: rows of j are the sector's u, v per unit of the face's u, v. */
static void psurf__linear_pull(psurf_real uu, psurf_real vu, psurf_real uv, psurf_real vv,
                               psurf__jet *jet)
{
    const psurf__jet in = *jet;
    jet->du = psurf__mix(uu, in.du, vu, in.dv);
    jet->dv = psurf__mix(uv, in.du, vv, in.dv);
    jet->duu =
        psurf__add(psurf__mix(uu * uu, in.duu, 2 * uu * vu, in.duv), psurf__mul(in.dvv, vu * vu));
    jet->duv = psurf__add(psurf__mix(uu * uv, in.duu, uu * vv + vu * uv, in.duv),
                          psurf__mul(in.dvv, vu * vv));
    jet->dvv =
        psurf__add(psurf__mix(uv * uv, in.duu, 2 * uv * vv, in.duv), psurf__mul(in.dvv, vv * vv));
}

static void psurf__p3_pull(const psurf__spot *spot, uint32_t turn, psurf__jet *jet)
{
    const uint32_t j = (spot->sector + 1) % 3, k = (spot->sector + 2) % 3;
    (void)turn;
    psurf__linear_pull(psurf__weight_slope(j, 0) - psurf__weight_slope(k, 0),
                       3 * psurf__weight_slope(k, 0),
                       psurf__weight_slope(j, 1) - psurf__weight_slope(k, 1),
                       3 * psurf__weight_slope(k, 1), jet);
}

static void psurf__p4_pull(const psurf__spot *spot, uint32_t turn, psurf__jet *jet)
{
    static const signed char j[4][4] = {
        {1, 0, -1, 2}, {1, -2, 1, 0}, {-1, 0, 1, -2}, {-1, 2, -1, 0}};
    const signed char *row = j[spot->sector];
    (void)turn;
    psurf__linear_pull(PSURF__R(row[0]), PSURF__R(row[1]), PSURF__R(row[2]), PSURF__R(row[3]), jet);
}

static void psurf__p5_pull(const psurf__spot *spot, uint32_t turn, psurf__jet *jet)
{
    (void)spot;
    (void)turn;
    psurf__linear_pull(0, -1, 1, -1, jet);              /* face: weights of corner i and i+1 */
}

/* ---- triangles ---- */

static void psurf__triangle_locate(uint32_t turn, uint32_t sector, const psurf_real *w,
                                   psurf_real d, psurf__spot *spot)
{
    (void)turn;
    (void)sector;
    spot->sector = 0;
    psurf__set_weights(spot, w[0], w[1], w[2], d);
    psurf__find_triangle_edge(spot, w, d);
}

/* ---- the table of kinds ---- */

/* A triangle as a cubic, and points that are blended in: both told by places of stored points. A
   blend is a point, or the way to it from a point of the cubic that it takes the place of. */
typedef struct psurf__net_row {
    unsigned char net[10];              /* row by row, as Bezier triangles are stored */
    unsigned char blends;
    unsigned char blend[PSURF__MAX_BLENDS][2];  /* place to, place from */
    unsigned char mirror[PSURF__MAX_BLENDS];    /* its like where corners 0 and 1 change places */
} psurf__net_row;

#define PSURF__ORIGIN 255               /* instead of a place: the zero of local coordinates */

static const psurf__net_row psurf__bezier_net = {
    {0, 1, 2, 3, 4, 5, 6, 7, 8, 9}, 0, {{0, 0}}, {0}
};
static const psurf__net_row psurf__hybrid_net = {
    {0, 3, 4, 1, 14, PSURF__ORIGIN, 8, 13, 9, 2}, 9,
    {{16, 3}, {5, 14}, {6, 8}, {10, 4}, {11, 13}, {15, 9},
     {7, PSURF__ORIGIN}, {12, PSURF__ORIGIN}, {17, PSURF__ORIGIN}},
    {3, 2, 1, 0, 5, 4, 6, 8, 7}
};
static const psurf__net_row psurf__png1_net = {
    {0, 1, 2, 3, 4, PSURF__ORIGIN, 5, 6, 7, 8}, 12,
    {{9, 1}, {10, 2}, {11, 4}, {12, 5}, {13, 6}, {14, 7},
     {15, PSURF__ORIGIN}, {16, PSURF__ORIGIN}, {17, PSURF__ORIGIN},
     {18, PSURF__ORIGIN}, {19, PSURF__ORIGIN}, {20, PSURF__ORIGIN}},
    {1, 0, 3, 2, 5, 4, 7, 6, 11, 10, 9, 8}
};
static const psurf__net_row psurf__ribbon_net = {
    {0, 1, 2, 3, 4, PSURF__ORIGIN, 5, 6, 7, 8}, 6,
    {{9, PSURF__ORIGIN}, {10, PSURF__ORIGIN}, {11, PSURF__ORIGIN},
     {12, PSURF__ORIGIN}, {13, PSURF__ORIGIN}, {14, PSURF__ORIGIN}},
    {1, 0, 5, 4, 3, 2}
};

typedef struct psurf__kind_row {
    uint32_t sectors, weights;          /* weights: 4 of the tensor kinds, else 3 */
    uint32_t control;                   /* stored points before normals and the like; sectors: 0 */
    int shaded;                         /* has shading normals of its own */
    const psurf__net_row *net;          /* of point-normal triangles, else NULL */
    void (*locate)(uint32_t turn, uint32_t sector, const psurf_real *w, psurf_real d,
                   psurf__spot *spot);
    void (*pull)(const psurf__spot *spot, uint32_t turn, psurf__jet *jet);
    unsigned char edge[5][4];           /* the cubic of each edge: places of v0, t0, t1, v1 */
    unsigned char normal[4];            /* places of the corners' normals; 0: it has none */
} psurf__kind_row;

/* Of four by four points; of a Bezier triangle's ten; of the nine of its boundary. */
#define PSURF__TENSOR_EDGES \
    {{0, 1, 2, 3}, {3, 7, 11, 15}, {15, 14, 13, 12}, {12, 8, 4, 0}, {0, 0, 0, 0}}
#define PSURF__BEZIER_EDGES {{0, 1, 2, 3}, {3, 6, 8, 9}, {9, 7, 4, 0}, {0, 0, 0, 0}, {0, 0, 0, 0}}
#define PSURF__BOUNDARY_EDGES {{0, 1, 2, 3}, {3, 5, 7, 8}, {8, 6, 4, 0}, {0, 0, 0, 0}, {0, 0, 0, 0}}

static const psurf__kind_row psurf__kinds[PSURF_KIND_COUNT] = {
    {1, 4, 16, 0, NULL, psurf__bicubic_locate, psurf__bicubic_pull, PSURF__TENSOR_EDGES,
     {0, 0, 0, 0}},
    {1, 4, 13, 0, NULL, psurf__polar_locate, psurf__polar_pull,
     {{0, 1, 2, 3}, {3, 7, 11, 12}, {12, 8, 4, 0}, {0, 0, 0, 0}, {0, 0, 0, 0}}, {0, 0, 0, 0}},
    {3, 3, 0, 0, NULL, psurf__p3_locate, psurf__p3_pull,
     {{0, 1, 2, 6}, {6, 7, 8, 12}, {12, 13, 14, 0}, {0, 0, 0, 0}, {0, 0, 0, 0}}, {0, 0, 0, 0}},
    {4, 3, 0, 0, NULL, psurf__p4_locate, psurf__p4_pull,
     {{0, 1, 2, 6}, {6, 7, 8, 12}, {12, 13, 14, 18}, {18, 19, 20, 0}, {0, 0, 0, 0}}, {0, 0, 0, 0}},
    {5, 3, 0, 0, NULL, psurf__p5_locate, psurf__p5_pull,
     {{0, 1, 2, 6}, {6, 7, 8, 12}, {12, 13, 14, 18}, {18, 19, 20, 24}, {24, 25, 26, 0}},
     {0, 0, 0, 0}},
    {1, 3, 10, 1, &psurf__bezier_net, psurf__triangle_locate, psurf__bicubic_pull,
     PSURF__BEZIER_EDGES, {10, 12, 15, 0}},
    {1, 4, 16, 1, NULL, psurf__bicubic_locate, psurf__bicubic_pull, PSURF__TENSOR_EDGES,
     {16, 18, 24, 22}},
    {1, 3, 10, 1, &psurf__bezier_net, psurf__triangle_locate, psurf__bicubic_pull,
     PSURF__BEZIER_EDGES, {10, 12, 15, 0}},
    {1, 3, 18, 0, &psurf__hybrid_net, psurf__triangle_locate, psurf__bicubic_pull,
     {{0, 3, 4, 1}, {1, 8, 9, 2}, {2, 13, 14, 0}, {0, 0, 0, 0}, {0, 0, 0, 0}}, {18, 19, 20, 0}},
    {1, 3, 21, 0, &psurf__png1_net, psurf__triangle_locate, psurf__bicubic_pull,
     PSURF__BOUNDARY_EDGES, {21, 22, 23, 0}},
    {1, 3, 15, 0, &psurf__ribbon_net, psurf__triangle_locate, psurf__bicubic_pull,
     PSURF__BOUNDARY_EDGES, {15, 16, 17, 0}},
    {1, 3, 15, 0, &psurf__ribbon_net, psurf__triangle_locate, psurf__bicubic_pull,
     PSURF__BOUNDARY_EDGES, {15, 16, 17, 0}}
};

/* ---- quads of two triangles, from corner turn on ---- */

/* Weights of the unit square, turned so that the apex is its origin; then piece 0 lies below the
   diagonal from there, piece 1 above. */
static void psurf__halves_locate(uint32_t turn, uint32_t sector, const psurf_real *w, psurf_real d,
                                 psurf__spot *spot)
{
    static const unsigned char u0[4] = {0, 2, 1, 3}, u1[4] = {1, 3, 0, 2};
    static const unsigned char v0[4] = {2, 1, 3, 0}, v1[4] = {3, 0, 2, 1};
    const psurf_real x = w[u1[turn]], y = w[v1[turn]];
    (void)sector;
    spot->sector = y > x;
    spot->edge = PSURF_NONE;
    if (y > x) psurf__set_weights(spot, w[v0[turn]], x, y - x, d);
    else psurf__set_weights(spot, w[u0[turn]], x - y, y, d);
}

static void psurf__halves_pull(const psurf__spot *spot, uint32_t turn, psurf__jet *jet)
{
    static const signed char cosine[4] = {1, 0, -1, 0}, sine[4] = {0, 1, 0, -1};
    const psurf_real xu = cosine[turn], xv = sine[turn], yu = -sine[turn], yv = cosine[turn];
    if (spot->sector) psurf__linear_pull(xu, yu - xu, xv, yv - xv, jet);
    else psurf__linear_pull(xu - yu, yu, xv - yv, yv, jet);
}

static const psurf__kind_row psurf__halves = {
    2, 3, 0, 0, NULL, psurf__halves_locate, psurf__halves_pull, PSURF__BEZIER_EDGES, {0, 0, 0, 0}
};

/* How many points are blended into the cubic of a point-normal triangle. */
static uint32_t psurf__blend_count(psurf_kind kind) { return psurf__kinds[kind].net->blends; }

/* ---- what the kernels are asked for ---- */

/* Eight spots on patches of one kind. Those from count on repeat the first. */
typedef struct psurf__batch {
    psurf_kind kind;
    uint32_t count;
    const psurf_real *points[8];
    psurf__spot spot[8];
} psurf__batch;

/* What a line of a sector takes of its rows: p[i][l] = C(4,l) c^l g^(4-l-i), w and q the same of
   degrees 3 and 2; c = (rate - n)/rate, g = n/(2 rate). */
typedef struct psurf__weights { psurf_real p[4][4], w[3][4], q[2][3]; } psurf__weights;

static psurf__weights psurf__weights_of(uint32_t n, uint32_t rate)
{
    const psurf_real c = PSURF__R(rate - n) / PSURF__R(rate), cc = c * c;
    const psurf_real g = PSURF__R(n) / PSURF__R(2 * rate), gg = g * g;
    psurf__weights at;
    at.p[0][0] = gg * gg;
    at.p[0][1] = 4 * (c * (gg * g));
    at.p[0][2] = 6 * (cc * gg);
    at.p[0][3] = 4 * (cc * c * g);
    at.p[1][0] = gg * g;
    at.p[1][1] = 4 * (c * gg);
    at.p[1][2] = 6 * (cc * g);
    at.p[1][3] = 4 * (cc * c);
    at.p[2][0] = gg;
    at.p[2][1] = 4 * (c * g);
    at.p[2][2] = 6 * cc;
    at.p[3][0] = g;
    at.p[3][1] = 4 * c;
    at.w[0][0] = gg * g;
    at.w[0][1] = 3 * (c * gg);
    at.w[0][2] = 3 * (cc * g);
    at.w[0][3] = cc * c;
    at.w[1][0] = gg;
    at.w[1][1] = 3 * (c * g);
    at.w[1][2] = 3 * cc;
    at.w[2][0] = g;
    at.w[2][1] = 3 * c;
    at.q[0][0] = gg;
    at.q[0][1] = 2 * (c * g);
    at.q[0][2] = cc;
    at.q[1][0] = g;
    at.q[1][1] = 2 * c;
    return at;
}

/* Where samples go, in reals: p[i] + p_at the next one of lane i, and how far from it the one
   after; the steps grow by bends where lines run across the rows of a triangle. */
typedef struct psurf__cursor {
    psurf_real *const *p, *const *n;    /* of eight lanes */
    ptrdiff_t p_at, n_at, p_step, n_step, p_bend, n_bend;
    int interleaved;                    /* p.xyz n.xyz, all through p */
} psurf__cursor;

static PSURF__INLINE void psurf__advance(psurf__cursor *c)
{
    c->p_at += c->p_step;
    c->n_at += c->n_step;
    c->p_step += c->p_bend;
    c->n_step += c->n_bend;
}

/* Samples with places of their own, some of them together: that is how their weights are made. */
enum { PSURF__HELD = 8 };
typedef struct psurf__held {
    psurf_real sample[2][PSURF__HELD][8][6];            /* of each end of a line; lanes */
    psurf_real *p[2][8], *n[2][8];
} psurf__held;

static void psurf__hold_cursors(psurf__held *held, int normals, psurf__cursor c[2])
{
    int side, i;
    for (side = 0; side < 2; side++) {
        for (i = 0; i < 8; i++) {
            held->p[side][i] = held->sample[side][0][i];
            held->n[side][i] = held->sample[side][0][i] + 3;
        }
        c[side].p = held->p[side];
        c[side].n = held->n[side];
        c[side].p_at = c[side].n_at = c[side].p_bend = c[side].n_bend = 0;
        c[side].p_step = c[side].n_step = 8 * 6;
        c[side].interleaved = normals;
    }
}

/* Which normals go with positions: none, those of the surface, those to shade with. */
typedef enum psurf__normals { PSURF__NO_NORMALS, PSURF__SURFACE, PSURF__SHADING } psurf__normals;

/* Which samples have places of their own, to which no cursor moves. */
typedef enum psurf__apart {
    PSURF__NONE_APART, PSURF__BORDER_APART, PSURF__ALL_APART
} psurf__apart;

/* Memory that the next group is going to use, asked for while this group is in work, and bit by
   bit: more at once would hold up the arithmetic. */
typedef struct psurf__ahead {
    const psurf_real *to[8];            /* of each lane */
    ptrdiff_t at, end, step;            /* in reals */
} psurf__ahead;

/* Its samples: even pairs of this group's ask for the first, odd ones for the second. Its patches:
   each line asks. */
enum { PSURF__AHEAD_EVEN, PSURF__AHEAD_ODD, PSURF__AHEAD_PATCHES, PSURF__AHEADS };

/* Up to eight facets of one kind and turn, of which the same samples are wanted, and where they
   go. */
typedef struct psurf__run psurf__run;
typedef struct psurf__group {
    psurf_kind kind;
    uint32_t count, rate;               /* facets from count on repeat the first */
    uint32_t turn;
    const psurf_real *points[8];
    psurf__normals normals;
    int border_only;                    /* samples on the facets' edges alone */
    psurf__apart apart;
    int fetched;                        /* where they go has been asked for */
    psurf__ahead *ahead;                /* [PSURF__AHEADS] */
    void (*aim)(const psurf__run *run, uint32_t first, uint32_t last, psurf__cursor cursors[2]);
    void (*put)(const psurf__run *run, uint32_t lane, uint32_t k, const psurf_real *sample);
    void *to;
} psurf__group;

/* A line of samples in work: see chapter 7, lattices. */
struct psurf__run {
    const psurf__group *group;
    uint32_t sector, d, n;
    uint32_t begin, end;                /* samples begin <= k < end are wanted */
    psurf_real span;                    /* sample k lies (2k - n)/span from the middle */
    int tensor, edge;                   /* not of sectors; on an edge of the facets */
};

/* How many steps a line of a Pm-patch has less than the line before. */
static uint32_t psurf__line_step(uint32_t m) { return 6 - m; }

/* The lattice point of a facet's domain at step k of a line, and the way to the next. */
typedef struct psurf__point { uint32_t x, y; int to_x, to_y; } psurf__point;

static psurf__point psurf__triangle_point(const psurf__run *r, uint32_t first, uint32_t k,
                                          uint32_t least)
{
    uint32_t w[3];
    int to[3];
    psurf__point at;
    w[first] = least + r->n - k;
    w[(first + 1) % 3] = least + k;
    w[(first + 2) % 3] = r->d;
    to[first] = -1;
    to[(first + 1) % 3] = 1;
    to[(first + 2) % 3] = 0;
    at.x = w[1];
    at.y = w[2];
    at.to_x = to[1];
    at.to_y = to[2];
    return at;
}

static psurf__point psurf__line_point(const psurf__run *r, uint32_t k)
{
    static const signed char way[4][2] = {{1, 0}, {0, 1}, {-1, 0}, {0, -1}};
    const psurf__group *g = r->group;
    const uint32_t across = g->rate - r->d, i = r->sector, at_k = r->d + k;
    psurf__point at;
    if (g->kind == PSURF_POLAR) return psurf__triangle_point(r, g->turn, k, 0);
    if (g->kind == PSURF_P3) return psurf__triangle_point(r, i, k, r->d);
    at.x = k;
    at.y = r->d;
    at.to_x = 1;
    at.to_y = 0;
    if (g->kind != PSURF_P4) return at;
    at.x = i == 0 ? at_k : i == 1 ? across : i == 2 ? g->rate - at_k : r->d;
    at.y = i == 0 ? r->d : i == 1 ? at_k : i == 2 ? across : g->rate - at_k;
    at.to_x = way[i][0];
    at.to_y = way[i][1];
    return at;
}

#define PSURF__EIGHTH PSURF__R(0.125)

/* Squares of lengths of normals that are looked at more closely. */
#define PSURF__VANISHING PSURF__R(1e-12)

static void psurf__mend_normal(const psurf__run *run, uint32_t k, uint32_t lane, int direction,
                               psurf_real (*u)[8], psurf_real (*w)[8], psurf_real (*n)[8]);

/* How many reals of a face are asked for ahead at most: they have to stay till they are written. */
enum { PSURF__FAR_AHEAD = 32768 };

/* Pairs of samples whose distances from the middle of a line are worked out together. */
enum { PSURF__STRETCH = 24 };

/* Rows of the 15 points of a sector: where the points of constant distance from the edge begin. */
static const unsigned char psurf__row[5] = {0, 5, 9, 12, 14};

/* The same of the 10 points of a cubic triangle. */
static const unsigned char psurf__cubic_row[4] = {0, 4, 7, 9};

/* Places of second derivatives by three weights. */
static const unsigned char psurf__second[3][3] = {{0, 1, 2}, {1, 3, 4}, {2, 4, 5}};

/* What an instruction set has to offer; all give the same bits. */
typedef struct psurf__kernels {
    const char *name;
    unsigned (*jets)(const psurf__batch *batch, int second, psurf__jet jets[8]);
    void (*hull)(const psurf__batch *batch, psurf_real low[3][8], psurf_real high[3][8]);
    void (*lattice)(const psurf__group *group);
} psurf__kernels;

/* >>7 KERNELS =================================================================================
   The arithmetic of evaluation, eight facets or samples side by side: a lane each. This chapter is
   compiled once per instruction set that may be wanted at run time, by including this file again;
   what exists once per set has PSURF__K round its name. Lanes never mix, and every set does the
   same operations in the same order: all give the same bits. */

#endif /* PSURF__ONCE */
#ifdef PSURF__IMPLEMENTING

/* ---- lanes: the eight reals of an instruction set ---- */

#if !defined(PSURF__ONCE)
#define PSURF__SET avx2
#define PSURF__SET_AVX2
#if defined(__clang__)
#pragma clang attribute push(__attribute__((target("avx2"))), apply_to = function)
#elif defined(__GNUC__)
#pragma GCC push_options
#pragma GCC target("avx2")
#endif
#elif defined(PSURF__SIMD) && defined(__AVX2__) && !defined(PSURF_NO_AVX2)
#define PSURF__SET avx2
#define PSURF__SET_AVX2
#elif defined(PSURF__SIMD_X86)
#define PSURF__SET sse2
#define PSURF__SET_SSE2
#elif defined(PSURF__SIMD)
#define PSURF__SET neon
#define PSURF__SET_NEON
#else
#define PSURF__SET scalar
#undef PSURF__INLINE                    /* eight numbers each: always inlined they are no faster, */
#define PSURF__INLINE inline            /* and compilers take minutes instead of seconds */
#endif

#ifdef PSURF__ONCE
#define PSURF__TEXT(x) #x
#define PSURF__NAME_OF(x) PSURF__TEXT(x)
#define PSURF__PASTE(name, set) psurf__##name##_##set
#define PSURF__PASTE_SET(name, set) PSURF__PASTE(name, set)
#define PSURF__K(name) PSURF__PASTE_SET(name, PSURF__SET)
#define psurf__lanes PSURF__K(lanes)
#define psurf__l_load PSURF__K(l_load)          /* eight reals from memory, */
#define psurf__l_store PSURF__K(l_store)        /* and back */
#define psurf__l_all PSURF__K(l_all)            /* one real in every lane */
#define psurf__l_add PSURF__K(l_add)
#define psurf__l_sub PSURF__K(l_sub)
#define psurf__l_mul PSURF__K(l_mul)
#define psurf__l_div PSURF__K(l_div)
#define psurf__l_sqrt PSURF__K(l_sqrt)
#define psurf__l_max PSURF__K(l_max)            /* a > b ? a : b */
#define psurf__l_select PSURF__K(l_select)      /* a > b ? x : y; y if one of a, b is NaN */
#define psurf__l_greater PSURF__K(l_greater)    /* bit i: a > b in lane i */
#define psurf__l_columns PSURF__K(l_columns)    /* lane i of out[k] = p[i][k], k < count >= 4 */
#define psurf__l_fetch PSURF__K(l_fetch)        /* memory that is soon written */
#define psurf__l_write3 PSURF__K(l_write3)      /* lane i of x, y, z to to[i] + at */
#define psurf__l_write6 PSURF__K(l_write6)      /* the same of six */
#define psurf__l3 PSURF__K(l3)
#define psurf__l3_add PSURF__K(l3_add)
#define psurf__l3_sub PSURF__K(l3_sub)
#define psurf__l3_mul PSURF__K(l3_mul)
#define psurf__l3_mad PSURF__K(l3_mad)
#define psurf__l3_mix PSURF__K(l3_mix)
#define psurf__l3_cross PSURF__K(l3_cross)
#define psurf__l3_dot PSURF__K(l3_dot)
#define psurf__l3_select PSURF__K(l3_select)
#define psurf__l3_zero PSURF__K(l3_zero)
#define psurf__l3_put PSURF__K(l3_put)
#define psurf__l3_store PSURF__K(l3_store)
#endif

#if defined(PSURF__SET_AVX2)

typedef __m256 psurf__lanes;

static PSURF__INLINE psurf__lanes psurf__l_load(const float *p) { return _mm256_loadu_ps(p); }
static PSURF__INLINE void psurf__l_store(float *p, psurf__lanes a) { _mm256_storeu_ps(p, a); }
static PSURF__INLINE psurf__lanes psurf__l_all(float x) { return _mm256_set1_ps(x); }
static PSURF__INLINE psurf__lanes psurf__l_add(psurf__lanes a, psurf__lanes b)
{
    return _mm256_add_ps(a, b);
}
static PSURF__INLINE psurf__lanes psurf__l_sub(psurf__lanes a, psurf__lanes b)
{
    return _mm256_sub_ps(a, b);
}
static PSURF__INLINE psurf__lanes psurf__l_mul(psurf__lanes a, psurf__lanes b)
{
    return _mm256_mul_ps(a, b);
}
static PSURF__INLINE psurf__lanes psurf__l_div(psurf__lanes a, psurf__lanes b)
{
    return _mm256_div_ps(a, b);
}
static PSURF__INLINE psurf__lanes psurf__l_sqrt(psurf__lanes a) { return _mm256_sqrt_ps(a); }
static PSURF__INLINE psurf__lanes psurf__l_max(psurf__lanes a, psurf__lanes b)
{
    return _mm256_max_ps(a, b);
}
static PSURF__INLINE psurf__lanes psurf__l_select(psurf__lanes a, psurf__lanes b, psurf__lanes x,
                                                  psurf__lanes y)
{
    return _mm256_blendv_ps(y, x, _mm256_cmp_ps(a, b, _CMP_GT_OQ));
}
static PSURF__INLINE unsigned psurf__l_greater(psurf__lanes a, psurf__lanes b)
{
    return (unsigned)_mm256_movemask_ps(_mm256_cmp_ps(a, b, _CMP_GT_OQ));
}

static PSURF__INLINE void psurf__l_fetch(const float *p)
{
    _mm_prefetch((const char *)p, _MM_HINT_T1);         /* a group is more than the first cache */
}

/* Four reals of lanes i and i+4, side by side. */
static PSURF__INLINE __m256 PSURF__K(pair)(const float *low, const float *high)
{
    return _mm256_insertf128_ps(_mm256_castps128_ps256(_mm_loadu_ps(low)), _mm_loadu_ps(high), 1);
}

/* Rows of four to columns, in both halves. */
static PSURF__INLINE void PSURF__K(turn)(__m256 a, __m256 b, __m256 c, __m256 d, psurf__lanes *out)
{
    const __m256 ab0 = _mm256_unpacklo_ps(a, b), ab2 = _mm256_unpackhi_ps(a, b);
    const __m256 cd0 = _mm256_unpacklo_ps(c, d), cd2 = _mm256_unpackhi_ps(c, d);
    out[0] = _mm256_shuffle_ps(ab0, cd0, 0x44);
    out[1] = _mm256_shuffle_ps(ab0, cd0, 0xEE);
    out[2] = _mm256_shuffle_ps(ab2, cd2, 0x44);
    out[3] = _mm256_shuffle_ps(ab2, cd2, 0xEE);
}

static void psurf__l_columns(const float *const p[8], uint32_t count, psurf__lanes *out)
{
    uint32_t i, k;
    for (i = 0; i < count; i += 4) {
        k = i + 4 <= count ? i : count - 4;
        PSURF__K(turn)(PSURF__K(pair)(p[0] + k, p[4] + k), PSURF__K(pair)(p[1] + k, p[5] + k),
                       PSURF__K(pair)(p[2] + k, p[6] + k), PSURF__K(pair)(p[3] + k, p[7] + k),
                       out + k);
    }
}

/* Both parts of a lane one after the other: a processor may take two to one line at a time. */
static PSURF__INLINE void PSURF__K(write3_half)(__m128 xy0, __m128 xy2, __m128 z,
                                                float *const to[4], ptrdiff_t at)
{
    _mm_storel_pi((__m64 *)(void *)(to[0] + at), xy0);
    _mm_store_ss(to[0] + at + 2, z);
    _mm_storeh_pi((__m64 *)(void *)(to[1] + at), xy0);
    _mm_store_ss(to[1] + at + 2, _mm_movehdup_ps(z));
    _mm_storel_pi((__m64 *)(void *)(to[2] + at), xy2);
    _mm_store_ss(to[2] + at + 2, _mm_unpackhi_ps(z, z));
    _mm_storeh_pi((__m64 *)(void *)(to[3] + at), xy2);
    _mm_store_ss(to[3] + at + 2, _mm_shuffle_ps(z, z, 0xFF));
}

static PSURF__INLINE void psurf__l_write3(psurf__lanes x, psurf__lanes y, psurf__lanes z,
                                          float *const to[8], ptrdiff_t at)
{
    const __m256 low = _mm256_unpacklo_ps(x, y), high = _mm256_unpackhi_ps(x, y);
    PSURF__K(write3_half)(_mm256_castps256_ps128(low), _mm256_castps256_ps128(high),
                          _mm256_castps256_ps128(z), to, at);
    PSURF__K(write3_half)(_mm256_extractf128_ps(low, 1), _mm256_extractf128_ps(high, 1),
                          _mm256_extractf128_ps(z, 1), to + 4, at);
}

/* Two lanes: the halves of abcd, then the first or second two reals of ef0 and ef4. */
static PSURF__INLINE void PSURF__K(write6_two)(__m256d abcd, __m128 ef0, __m128 ef4, int second,
                                               float *low, float *high)
{
    _mm_storeu_ps(low, _mm256_castps256_ps128(_mm256_castpd_ps(abcd)));
    if (second) _mm_storeh_pi((__m64 *)(void *)(low + 4), ef0);
    else _mm_storel_pi((__m64 *)(void *)(low + 4), ef0);
    _mm_storeu_ps(high, _mm256_extractf128_ps(_mm256_castpd_ps(abcd), 1));
    if (second) _mm_storeh_pi((__m64 *)(void *)(high + 4), ef4);
    else _mm_storel_pi((__m64 *)(void *)(high + 4), ef4);
}

static PSURF__INLINE void psurf__l_write6(psurf__lanes a, psurf__lanes b, psurf__lanes c,
                                          psurf__lanes d, psurf__lanes e, psurf__lanes f,
                                          float *const to[8], ptrdiff_t at)
{
    const __m256d ab0 = _mm256_castps_pd(_mm256_unpacklo_ps(a, b));
    const __m256d ab2 = _mm256_castps_pd(_mm256_unpackhi_ps(a, b));
    const __m256d cd0 = _mm256_castps_pd(_mm256_unpacklo_ps(c, d));
    const __m256d cd2 = _mm256_castps_pd(_mm256_unpackhi_ps(c, d));
    const __m256 ef0 = _mm256_unpacklo_ps(e, f), ef2 = _mm256_unpackhi_ps(e, f);
    const __m128 low0 = _mm256_castps256_ps128(ef0), low2 = _mm256_castps256_ps128(ef2);
    const __m128 high0 = _mm256_extractf128_ps(ef0, 1), high2 = _mm256_extractf128_ps(ef2, 1);
    PSURF__K(write6_two)(_mm256_unpacklo_pd(ab0, cd0), low0, high0, 0, to[0] + at, to[4] + at);
    PSURF__K(write6_two)(_mm256_unpackhi_pd(ab0, cd0), low0, high0, 1, to[1] + at, to[5] + at);
    PSURF__K(write6_two)(_mm256_unpacklo_pd(ab2, cd2), low2, high2, 0, to[2] + at, to[6] + at);
    PSURF__K(write6_two)(_mm256_unpackhi_pd(ab2, cd2), low2, high2, 1, to[3] + at, to[7] + at);
}

#elif defined(PSURF__SET_SSE2)

typedef struct psurf__lanes { __m128 low, high; } psurf__lanes;

static PSURF__INLINE psurf__lanes PSURF__K(both)(__m128 low, __m128 high)
{
    psurf__lanes a;
    a.low = low;
    a.high = high;
    return a;
}

static PSURF__INLINE psurf__lanes psurf__l_load(const float *p)
{
    return PSURF__K(both)(_mm_loadu_ps(p), _mm_loadu_ps(p + 4));
}
static PSURF__INLINE void psurf__l_store(float *p, psurf__lanes a)
{
    _mm_storeu_ps(p, a.low);
    _mm_storeu_ps(p + 4, a.high);
}
static PSURF__INLINE psurf__lanes psurf__l_all(float x)
{
    return PSURF__K(both)(_mm_set1_ps(x), _mm_set1_ps(x));
}
static PSURF__INLINE psurf__lanes psurf__l_add(psurf__lanes a, psurf__lanes b)
{
    return PSURF__K(both)(_mm_add_ps(a.low, b.low), _mm_add_ps(a.high, b.high));
}
static PSURF__INLINE psurf__lanes psurf__l_sub(psurf__lanes a, psurf__lanes b)
{
    return PSURF__K(both)(_mm_sub_ps(a.low, b.low), _mm_sub_ps(a.high, b.high));
}
static PSURF__INLINE psurf__lanes psurf__l_mul(psurf__lanes a, psurf__lanes b)
{
    return PSURF__K(both)(_mm_mul_ps(a.low, b.low), _mm_mul_ps(a.high, b.high));
}
static PSURF__INLINE psurf__lanes psurf__l_div(psurf__lanes a, psurf__lanes b)
{
    return PSURF__K(both)(_mm_div_ps(a.low, b.low), _mm_div_ps(a.high, b.high));
}
static PSURF__INLINE psurf__lanes psurf__l_sqrt(psurf__lanes a)
{
    return PSURF__K(both)(_mm_sqrt_ps(a.low), _mm_sqrt_ps(a.high));
}
static PSURF__INLINE psurf__lanes psurf__l_max(psurf__lanes a, psurf__lanes b)
{
    return PSURF__K(both)(_mm_max_ps(a.low, b.low), _mm_max_ps(a.high, b.high));
}
static PSURF__INLINE psurf__lanes psurf__l_select(psurf__lanes a, psurf__lanes b, psurf__lanes x,
                                                  psurf__lanes y)
{
    const __m128 low = _mm_cmpgt_ps(a.low, b.low), high = _mm_cmpgt_ps(a.high, b.high);
    return PSURF__K(both)(_mm_or_ps(_mm_and_ps(low, x.low), _mm_andnot_ps(low, y.low)),
                          _mm_or_ps(_mm_and_ps(high, x.high), _mm_andnot_ps(high, y.high)));
}
static PSURF__INLINE unsigned psurf__l_greater(psurf__lanes a, psurf__lanes b)
{
    return (unsigned)_mm_movemask_ps(_mm_cmpgt_ps(a.low, b.low)) |
           (unsigned)_mm_movemask_ps(_mm_cmpgt_ps(a.high, b.high)) << 4;
}

static PSURF__INLINE void psurf__l_fetch(const float *p)
{
    _mm_prefetch((const char *)p, _MM_HINT_T1);         /* a group is more than the first cache */
}

/* Rows of four to columns: one half of the lanes. */
static PSURF__INLINE void PSURF__K(turn)(const float *const p[4], uint32_t k, __m128 out[4])
{
    out[0] = _mm_loadu_ps(p[0] + k);
    out[1] = _mm_loadu_ps(p[1] + k);
    out[2] = _mm_loadu_ps(p[2] + k);
    out[3] = _mm_loadu_ps(p[3] + k);
    _MM_TRANSPOSE4_PS(out[0], out[1], out[2], out[3]);
}

static void psurf__l_columns(const float *const p[8], uint32_t count, psurf__lanes *out)
{
    uint32_t i, j, k;
    for (i = 0; i < count; i += 4) {
        __m128 low[4], high[4];
        k = i + 4 <= count ? i : count - 4;
        PSURF__K(turn)(p, k, low);
        PSURF__K(turn)(p + 4, k, high);
        for (j = 0; j < 4; j++) out[k + j] = PSURF__K(both)(low[j], high[j]);
    }
}

static PSURF__INLINE void PSURF__K(write3_half)(__m128 x, __m128 y, __m128 z, float *const to[4],
                                                ptrdiff_t at)
{
    const __m128 low = _mm_unpacklo_ps(x, y), high = _mm_unpackhi_ps(x, y);
    _mm_storel_pi((__m64 *)(void *)(to[0] + at), low);
    _mm_storeh_pi((__m64 *)(void *)(to[1] + at), low);
    _mm_storel_pi((__m64 *)(void *)(to[2] + at), high);
    _mm_storeh_pi((__m64 *)(void *)(to[3] + at), high);
    _mm_store_ss(to[0] + at + 2, z);
    _mm_store_ss(to[1] + at + 2, _mm_shuffle_ps(z, z, 1));
    _mm_store_ss(to[2] + at + 2, _mm_shuffle_ps(z, z, 2));
    _mm_store_ss(to[3] + at + 2, _mm_shuffle_ps(z, z, 3));
}

static PSURF__INLINE void psurf__l_write3(psurf__lanes x, psurf__lanes y, psurf__lanes z,
                                          float *const to[8], ptrdiff_t at)
{
    PSURF__K(write3_half)(x.low, y.low, z.low, to, at);
    PSURF__K(write3_half)(x.high, y.high, z.high, to + 4, at);
}

static PSURF__INLINE void PSURF__K(write6_half)(__m128 a, __m128 b, __m128 c, __m128 d, __m128 e,
                                                __m128 f, float *const to[4], ptrdiff_t at)
{
    const __m128 last = _mm_unpacklo_ps(e, f), last2 = _mm_unpackhi_ps(e, f);
    _MM_TRANSPOSE4_PS(a, b, c, d);
    _mm_storeu_ps(to[0] + at, a);
    _mm_storeu_ps(to[1] + at, b);
    _mm_storeu_ps(to[2] + at, c);
    _mm_storeu_ps(to[3] + at, d);
    _mm_storel_pi((__m64 *)(void *)(to[0] + at + 4), last);
    _mm_storeh_pi((__m64 *)(void *)(to[1] + at + 4), last);
    _mm_storel_pi((__m64 *)(void *)(to[2] + at + 4), last2);
    _mm_storeh_pi((__m64 *)(void *)(to[3] + at + 4), last2);
}

static PSURF__INLINE void psurf__l_write6(psurf__lanes a, psurf__lanes b, psurf__lanes c,
                                          psurf__lanes d, psurf__lanes e, psurf__lanes f,
                                          float *const to[8], ptrdiff_t at)
{
    PSURF__K(write6_half)(a.low, b.low, c.low, d.low, e.low, f.low, to, at);
    PSURF__K(write6_half)(a.high, b.high, c.high, d.high, e.high, f.high, to + 4, at);
}

#elif defined(PSURF__SET_NEON)

typedef struct psurf__lanes { float32x4_t low, high; } psurf__lanes;

static PSURF__INLINE psurf__lanes PSURF__K(both)(float32x4_t low, float32x4_t high)
{
    psurf__lanes a;
    a.low = low;
    a.high = high;
    return a;
}

static PSURF__INLINE psurf__lanes psurf__l_load(const float *p)
{
    return PSURF__K(both)(vld1q_f32(p), vld1q_f32(p + 4));
}
static PSURF__INLINE void psurf__l_store(float *p, psurf__lanes a)
{
    vst1q_f32(p, a.low);
    vst1q_f32(p + 4, a.high);
}
static PSURF__INLINE psurf__lanes psurf__l_all(float x)
{
    return PSURF__K(both)(vdupq_n_f32(x), vdupq_n_f32(x));
}
static PSURF__INLINE psurf__lanes psurf__l_add(psurf__lanes a, psurf__lanes b)
{
    return PSURF__K(both)(vaddq_f32(a.low, b.low), vaddq_f32(a.high, b.high));
}
static PSURF__INLINE psurf__lanes psurf__l_sub(psurf__lanes a, psurf__lanes b)
{
    return PSURF__K(both)(vsubq_f32(a.low, b.low), vsubq_f32(a.high, b.high));
}
static PSURF__INLINE psurf__lanes psurf__l_mul(psurf__lanes a, psurf__lanes b)
{
    return PSURF__K(both)(vmulq_f32(a.low, b.low), vmulq_f32(a.high, b.high));
}
static PSURF__INLINE psurf__lanes psurf__l_div(psurf__lanes a, psurf__lanes b)
{
    return PSURF__K(both)(vdivq_f32(a.low, b.low), vdivq_f32(a.high, b.high));
}
static PSURF__INLINE psurf__lanes psurf__l_sqrt(psurf__lanes a)
{
    return PSURF__K(both)(vsqrtq_f32(a.low), vsqrtq_f32(a.high));
}
static PSURF__INLINE psurf__lanes psurf__l_max(psurf__lanes a, psurf__lanes b)
{
    return PSURF__K(both)(vbslq_f32(vcgtq_f32(a.low, b.low), a.low, b.low),
                          vbslq_f32(vcgtq_f32(a.high, b.high), a.high, b.high));
}
static PSURF__INLINE psurf__lanes psurf__l_select(psurf__lanes a, psurf__lanes b, psurf__lanes x,
                                                  psurf__lanes y)
{
    return PSURF__K(both)(vbslq_f32(vcgtq_f32(a.low, b.low), x.low, y.low),
                          vbslq_f32(vcgtq_f32(a.high, b.high), x.high, y.high));
}
static PSURF__INLINE unsigned psurf__l_greater(psurf__lanes a, psurf__lanes b)
{
    static const uint32_t bits[4] = {1, 2, 4, 8};
    const uint32x4_t bit = vld1q_u32(bits);
    return vaddvq_u32(vandq_u32(vcgtq_f32(a.low, b.low), bit)) |
           vaddvq_u32(vandq_u32(vcgtq_f32(a.high, b.high), bit)) << 4;
}

static PSURF__INLINE void psurf__l_fetch(const float *p) { __builtin_prefetch(p, 1, 2); }

/* Rows of four to columns: one half of the lanes. */
static PSURF__INLINE void PSURF__K(turn)(float32x4_t *a)
{
    const float64x2_t ab0 = vreinterpretq_f64_f32(vtrn1q_f32(a[0], a[1]));
    const float64x2_t ab1 = vreinterpretq_f64_f32(vtrn2q_f32(a[0], a[1]));
    const float64x2_t cd0 = vreinterpretq_f64_f32(vtrn1q_f32(a[2], a[3]));
    const float64x2_t cd1 = vreinterpretq_f64_f32(vtrn2q_f32(a[2], a[3]));
    a[0] = vreinterpretq_f32_f64(vtrn1q_f64(ab0, cd0));
    a[1] = vreinterpretq_f32_f64(vtrn1q_f64(ab1, cd1));
    a[2] = vreinterpretq_f32_f64(vtrn2q_f64(ab0, cd0));
    a[3] = vreinterpretq_f32_f64(vtrn2q_f64(ab1, cd1));
}

static void psurf__l_columns(const float *const p[8], uint32_t count, psurf__lanes *out)
{
    uint32_t i, j, k;
    for (i = 0; i < count; i += 4) {
        float32x4_t low[4], high[4];
        k = i + 4 <= count ? i : count - 4;
        for (j = 0; j < 4; j++) {
            low[j] = vld1q_f32(p[j] + k);
            high[j] = vld1q_f32(p[j + 4] + k);
        }
        PSURF__K(turn)(low);
        PSURF__K(turn)(high);
        for (j = 0; j < 4; j++) out[k + j] = PSURF__K(both)(low[j], high[j]);
    }
}

static PSURF__INLINE void PSURF__K(write3_half)(float32x4_t x, float32x4_t y, float32x4_t z,
                                                float *const to[4], ptrdiff_t at)
{
    const float32x4_t low = vzip1q_f32(x, y), high = vzip2q_f32(x, y);
    vst1_f32(to[0] + at, vget_low_f32(low));
    vst1_f32(to[1] + at, vget_high_f32(low));
    vst1_f32(to[2] + at, vget_low_f32(high));
    vst1_f32(to[3] + at, vget_high_f32(high));
    vst1q_lane_f32(to[0] + at + 2, z, 0);
    vst1q_lane_f32(to[1] + at + 2, z, 1);
    vst1q_lane_f32(to[2] + at + 2, z, 2);
    vst1q_lane_f32(to[3] + at + 2, z, 3);
}

static PSURF__INLINE void psurf__l_write3(psurf__lanes x, psurf__lanes y, psurf__lanes z,
                                          float *const to[8], ptrdiff_t at)
{
    PSURF__K(write3_half)(x.low, y.low, z.low, to, at);
    PSURF__K(write3_half)(x.high, y.high, z.high, to + 4, at);
}

static PSURF__INLINE void PSURF__K(write6_half)(float32x4_t *a, float32x4_t e, float32x4_t f,
                                                float *const to[4], ptrdiff_t at)
{
    const float32x4_t last = vzip1q_f32(e, f), last2 = vzip2q_f32(e, f);
    uint32_t i;
    PSURF__K(turn)(a);
    for (i = 0; i < 4; i++) vst1q_f32(to[i] + at, a[i]);
    vst1_f32(to[0] + at + 4, vget_low_f32(last));
    vst1_f32(to[1] + at + 4, vget_high_f32(last));
    vst1_f32(to[2] + at + 4, vget_low_f32(last2));
    vst1_f32(to[3] + at + 4, vget_high_f32(last2));
}

static PSURF__INLINE void psurf__l_write6(psurf__lanes a, psurf__lanes b, psurf__lanes c,
                                          psurf__lanes d, psurf__lanes e, psurf__lanes f,
                                          float *const to[8], ptrdiff_t at)
{
    float32x4_t low[4], high[4];
    low[0] = a.low, low[1] = b.low, low[2] = c.low, low[3] = d.low;
    high[0] = a.high, high[1] = b.high, high[2] = c.high, high[3] = d.high;
    PSURF__K(write6_half)(low, e.low, f.low, to, at);
    PSURF__K(write6_half)(high, e.high, f.high, to + 4, at);
}

#else

typedef struct psurf__lanes { psurf_real a[8]; } psurf__lanes;

static PSURF__INLINE psurf__lanes psurf__l_load(const psurf_real *p)
{
    psurf__lanes out;
    int i;
    out.a[0] = p[0];
    for (i = 1; i < 8; i++) out.a[i] = p[i];
    return out;
}
static PSURF__INLINE void psurf__l_store(psurf_real *p, psurf__lanes a)
{
    int i;
    for (i = 0; i < 8; i++) p[i] = a.a[i];
}
static PSURF__INLINE psurf__lanes psurf__l_all(psurf_real x)
{
    psurf__lanes out;
    int i;
    out.a[0] = x;
    for (i = 1; i < 8; i++) out.a[i] = x;
    return out;
}
static PSURF__INLINE psurf__lanes psurf__l_add(psurf__lanes a, psurf__lanes b)
{
    int i;
    for (i = 0; i < 8; i++) a.a[i] += b.a[i];
    return a;
}
static PSURF__INLINE psurf__lanes psurf__l_sub(psurf__lanes a, psurf__lanes b)
{
    int i;
    for (i = 0; i < 8; i++) a.a[i] -= b.a[i];
    return a;
}
static PSURF__INLINE psurf__lanes psurf__l_mul(psurf__lanes a, psurf__lanes b)
{
    int i;
    for (i = 0; i < 8; i++) a.a[i] *= b.a[i];
    return a;
}
static PSURF__INLINE psurf__lanes psurf__l_div(psurf__lanes a, psurf__lanes b)
{
    int i;
    for (i = 0; i < 8; i++) a.a[i] /= b.a[i];
    return a;
}
static PSURF__INLINE psurf__lanes psurf__l_sqrt(psurf__lanes a)
{
    int i;
    for (i = 0; i < 8; i++) a.a[i] = psurf__sqrt(a.a[i]);
    return a;
}
static PSURF__INLINE psurf__lanes psurf__l_max(psurf__lanes a, psurf__lanes b)
{
    int i;
    for (i = 0; i < 8; i++) a.a[i] = a.a[i] > b.a[i] ? a.a[i] : b.a[i];
    return a;
}
static PSURF__INLINE psurf__lanes psurf__l_select(psurf__lanes a, psurf__lanes b, psurf__lanes x,
                                                  psurf__lanes y)
{
    int i;
    for (i = 0; i < 8; i++) y.a[i] = a.a[i] > b.a[i] ? x.a[i] : y.a[i];
    return y;
}
static PSURF__INLINE unsigned psurf__l_greater(psurf__lanes a, psurf__lanes b)
{
    unsigned bits = 0;
    int i;
    for (i = 0; i < 8; i++) bits |= (unsigned)(a.a[i] > b.a[i]) << i;
    return bits;
}

static PSURF__INLINE void psurf__l_fetch(const psurf_real *p) { (void)p; }

static void psurf__l_columns(const psurf_real *const p[8], uint32_t count, psurf__lanes *out)
{
    uint32_t k, i;
    for (k = 0; k < count; k++)
        for (i = 0; i < 8; i++) out[k].a[i] = p[i][k];
}

static PSURF__INLINE void psurf__l_write3(psurf__lanes x, psurf__lanes y, psurf__lanes z,
                                          psurf_real *const to[8], ptrdiff_t at)
{
    int i;
    for (i = 0; i < 8; i++) {
        to[i][at + 0] = x.a[i];
        to[i][at + 1] = y.a[i];
        to[i][at + 2] = z.a[i];
    }
}

static PSURF__INLINE void psurf__l_write6(psurf__lanes a, psurf__lanes b, psurf__lanes c,
                                          psurf__lanes d, psurf__lanes e, psurf__lanes f,
                                          psurf_real *const to[8], ptrdiff_t at)
{
    psurf__l_write3(a, b, c, to, at);
    psurf__l_write3(d, e, f, to, at + 3);
}

#endif

/* ---- points, one in every lane ---- */

typedef struct psurf__l3 { psurf__lanes x, y, z; } psurf__l3;

static PSURF__INLINE psurf__l3 psurf__l3_zero(void)
{
    psurf__l3 a;
    a.x = a.y = a.z = psurf__l_all(0);
    return a;
}

static PSURF__INLINE psurf__l3 psurf__l3_add(psurf__l3 a, psurf__l3 b)
{
    a.x = psurf__l_add(a.x, b.x);
    a.y = psurf__l_add(a.y, b.y);
    a.z = psurf__l_add(a.z, b.z);
    return a;
}

static PSURF__INLINE psurf__l3 psurf__l3_sub(psurf__l3 a, psurf__l3 b)
{
    a.x = psurf__l_sub(a.x, b.x);
    a.y = psurf__l_sub(a.y, b.y);
    a.z = psurf__l_sub(a.z, b.z);
    return a;
}

static PSURF__INLINE psurf__l3 psurf__l3_mul(psurf__l3 a, psurf__lanes s)
{
    a.x = psurf__l_mul(a.x, s);
    a.y = psurf__l_mul(a.y, s);
    a.z = psurf__l_mul(a.z, s);
    return a;
}

/* a + s b */
static PSURF__INLINE psurf__l3 psurf__l3_mad(psurf__l3 a, psurf__lanes s, psurf__l3 b)
{
    return psurf__l3_add(a, psurf__l3_mul(b, s));
}

/* s a + t b */
static PSURF__INLINE psurf__l3 psurf__l3_mix(psurf__lanes s, psurf__l3 a, psurf__lanes t,
                                             psurf__l3 b)
{
    return psurf__l3_add(psurf__l3_mul(a, s), psurf__l3_mul(b, t));
}

static PSURF__INLINE psurf__lanes psurf__l3_dot(psurf__l3 a, psurf__l3 b)
{
    return psurf__l_add(psurf__l_add(psurf__l_mul(a.x, b.x), psurf__l_mul(a.y, b.y)),
                        psurf__l_mul(a.z, b.z));
}

static PSURF__INLINE psurf__l3 psurf__l3_cross(psurf__l3 a, psurf__l3 b)
{
    psurf__l3 c;
    c.x = psurf__l_sub(psurf__l_mul(a.y, b.z), psurf__l_mul(a.z, b.y));
    c.y = psurf__l_sub(psurf__l_mul(a.z, b.x), psurf__l_mul(a.x, b.z));
    c.z = psurf__l_sub(psurf__l_mul(a.x, b.y), psurf__l_mul(a.y, b.x));
    return c;
}

/* a > b ? x : y */
static PSURF__INLINE psurf__l3 psurf__l3_select(psurf__lanes a, psurf__lanes b, psurf__l3 x,
                                                psurf__l3 y)
{
    x.x = psurf__l_select(a, b, x.x, y.x);
    x.y = psurf__l_select(a, b, x.y, y.y);
    x.z = psurf__l_select(a, b, x.z, y.z);
    return x;
}

/* Copies by components, in the pieces they are read in: compilers that copy structs in smaller ones
   make the processor wait for the parts. */
static PSURF__INLINE void psurf__l3_put(psurf__l3 *to, psurf__l3 a)
{
    to->x = a.x;
    to->y = a.y;
    to->z = a.z;
}

/* As rows x, y, z of eight. */
static void psurf__l3_store(psurf_real out[3][8], psurf__l3 a)
{
    psurf__l_store(out[0], a.x);
    psurf__l_store(out[1], a.y);
    psurf__l_store(out[2], a.z);
}

/* Columns 3 k .. 3 k + 2 of p as points, k < count; 3 count is at least 4. */
static void PSURF__K(points)(const psurf_real *const p[8], uint32_t count, psurf__l3 *out)
{
    /* x, y, z of one point, then of the next */
    psurf__l_columns(p, 3 * count, (psurf__lanes *)(void *)out);
}

/* ---- nets: the Bezier points of a patch, and of the sectors of a Pm-patch ---- */

/* The points of b301, b202, b103 on the line from a corner to the centre, eq. 3: from the stored
   points of the sectors that begin and end there. */
static void PSURF__K(inner_line)(const psurf__l3 *begins, const psurf__l3 *ends, uint32_t m,
                                 psurf__l3 line[3])
{
    const psurf__lanes k1 = psurf__l_all(psurf__sides_table[m].k1);
    const psurf__lanes k2 = psurf__l_all(psurf__sides_table[m].k2);
    const psurf__lanes half = psurf__l_all(PSURF__R(0.5)), most = psurf__l_all(PSURF__R(0.75));
    const psurf__l3 spokes = psurf__l3_add(begins[PSURF__T0], ends[PSURF__T1]);
    const psurf__l3 b310 = psurf__l3_mix(half, begins[PSURF__V], most, spokes);
    line[0] = psurf__l3_mix(k1, begins[PSURF__V], k2, b310);
    line[1] = psurf__l3_mix(k1, line[0], k2,
                            psurf__l3_add(begins[PSURF__B211], ends[PSURF__B121]));
    line[2] = psurf__l3_mix(k1, line[1], k2,
                            psurf__l3_add(begins[PSURF__B112], ends[PSURF__B112]));
}

/* The 15 points of a sector, rows of constant distance from the edge: b_jkl at row l, place k.
   v: the vertex where the next sector begins; from, to: the inner lines at both ends. */
static void PSURF__K(sector_net)(const psurf__l3 *sector, const psurf__l3 *v,
                                 const psurf__l3 from[3], const psurf__l3 to[3], psurf__l3 net[15])
{
    const psurf__lanes quarter = psurf__l_all(PSURF__R(0.25)), most = psurf__l_all(PSURF__R(0.75));
    uint32_t l;
    psurf__l3_put(&net[0], sector[PSURF__V]);                                   /* eq. 2 */
    net[1] = psurf__l3_mix(quarter, sector[PSURF__V], most, sector[PSURF__T0]);
    net[2] = psurf__l3_mul(psurf__l3_add(sector[PSURF__T0], sector[PSURF__T1]),
                           psurf__l_all(PSURF__R(0.5)));
    net[3] = psurf__l3_mix(quarter, *v, most, sector[PSURF__T1]);
    psurf__l3_put(&net[4], *v);
    psurf__l3_put(&net[6], sector[PSURF__B211]);
    psurf__l3_put(&net[7], sector[PSURF__B121]);
    psurf__l3_put(&net[10], sector[PSURF__B112]);
    for (l = 1; l < 4; l++) {
        psurf__l3_put(&net[psurf__row[l]], from[l - 1]);
        psurf__l3_put(&net[psurf__row[l] + 4 - l], to[l - 1]);
    }
    net[14] = psurf__l3_zero();
}

/* ---- samples: a patch, a sector and weights of its own in every lane ---- */

/* A psurf__jet in every lane; normals follow from it. */
typedef struct PSURF__K(jet) { psurf__l3 p, shade, du, dv, duu, duv, dvv; } PSURF__K(jet);

/* Bernstein polynomials of degree 3 and 2 at the weights t0 = 1-t and t1 = t. */
static void PSURF__K(bernstein)(psurf__lanes t0, psurf__lanes t1, psurf__lanes b3[4],
                                psurf__lanes b2[3])
{
    const psurf__lanes three = psurf__l_all(3), two = psurf__l_all(2);
    b2[0] = psurf__l_mul(t0, t0);
    b2[1] = psurf__l_mul(two, psurf__l_mul(t0, t1));
    b2[2] = psurf__l_mul(t1, t1);
    b3[0] = psurf__l_mul(b2[0], t0);
    b3[1] = psurf__l_mul(three, psurf__l_mul(b2[0], t1));
    b3[2] = psurf__l_mul(three, psurf__l_mul(b2[2], t0));
    b3[3] = psurf__l_mul(b2[2], t1);
}

/* Value, derivative and, if asked for, second derivative of a cubic. Derivatives come from
   differences of points, which keep their digits far from the origin. */
static void PSURF__K(cubic)(const psurf__l3 p[4], const psurf__lanes *b3, const psurf__lanes *b2,
                            const psurf__lanes t[2], int second, psurf__l3 out[3])
{
    const psurf__l3 d0 = psurf__l3_sub(p[1], p[0]), d1 = psurf__l3_sub(p[2], p[1]);
    const psurf__l3 d2 = psurf__l3_sub(p[3], p[2]);
    out[0] = psurf__l3_add(psurf__l3_mix(b3[0], p[0], b3[3], p[3]),
                           psurf__l3_mix(b3[1], p[1], b3[2], p[2]));
    out[1] = psurf__l3_mul(psurf__l3_mad(psurf__l3_mix(b2[0], d0, b2[1], d1), b2[2], d2),
                           psurf__l_all(3));
    if (second)
        out[2] = psurf__l3_mul(psurf__l3_mix(t[0], psurf__l3_sub(d1, d0),
                                             t[1], psurf__l3_sub(d2, d1)), psurf__l_all(6));
}

static void PSURF__K(bicubic_jet)(const psurf__l3 *g, const psurf__lanes w[4], int second,
                                  PSURF__K(jet) *jet)
{
    psurf__lanes u3[4], u2[3], v3[4], v2[3];
    psurf__l3 rows[3][4], along[3], across[3];
    uint32_t j;
    PSURF__K(bernstein)(w[0], w[1], u3, u2);
    PSURF__K(bernstein)(w[2], w[3], v3, v2);
    for (j = 0; j < 4; j++) {                           /* rows along u: value and derivatives */
        PSURF__K(cubic)(g + 4 * j, u3, u2, w, second, along);
        rows[0][j] = along[0];
        rows[1][j] = along[1];
        if (second) rows[2][j] = along[2];
    }
    PSURF__K(cubic)(rows[0], v3, v2, w + 2, second, across);
    jet->p = across[0];
    jet->dv = across[1];
    if (second) jet->dvv = across[2];
    PSURF__K(cubic)(rows[1], v3, v2, w + 2, 0, across);
    jet->du = across[0];
    jet->duv = across[1];
    if (!second) return;
    PSURF__K(cubic)(rows[2], v3, v2, w + 2, 0, across);
    jet->duu = across[0];
}

/* du and its derivatives are divided by 1-v: that is regular up to the pole, where u loses its
   meaning. So du = S_u/(1-v), duu = S_uu/(1-v), duv = (S_u/(1-v))_v here; psurf__polar_pull knows
   it. */
static void PSURF__K(polar_jet)(const psurf__l3 *h, const psurf__lanes w[4], int second,
                                PSURF__K(jet) *jet)
{
    const psurf__lanes two = psurf__l_all(2), three = psurf__l_all(3), six = psurf__l_all(6);
    psurf__lanes u3[4], u2[3], v3[4], v2[3], weight[3], slope[3];
    psurf__l3 row[3][3], d0, d1, d2;
    uint32_t j;
    PSURF__K(bernstein)(w[0], w[1], u3, u2);
    PSURF__K(bernstein)(w[2], w[3], v3, v2);
    weight[0] = v2[0];                                  /* B_j(v)/(1-v), */
    weight[1] = psurf__l_mul(three, psurf__l_mul(w[2], w[3]));
    weight[2] = psurf__l_mul(three, v2[2]);
    slope[0] = psurf__l_mul(psurf__l_all(-2), w[2]);    /* and its derivative */
    slope[1] = psurf__l_mul(three, psurf__l_sub(w[2], w[3]));
    slope[2] = psurf__l_mul(six, w[3]);
    for (j = 0; j < 3; j++) PSURF__K(cubic)(h + 4 * j, u3, u2, w, second, row[j]);
    d0 = psurf__l3_sub(row[1][0], row[0][0]);
    d1 = psurf__l3_sub(row[2][0], row[1][0]);
    d2 = psurf__l3_sub(h[12], row[2][0]);
    jet->p = psurf__l3_add(psurf__l3_mix(v3[0], row[0][0], v3[3], h[12]),
                           psurf__l3_mix(v3[1], row[1][0], v3[2], row[2][0]));
    jet->du = psurf__l3_mad(psurf__l3_mix(weight[0], row[0][1], weight[1], row[1][1]),
                            weight[2], row[2][1]);
    jet->dv = psurf__l3_mul(psurf__l3_mad(psurf__l3_mix(v2[0], d0, v2[1], d1), v2[2], d2), three);
    if (!second) return;
    jet->duu = psurf__l3_mad(psurf__l3_mix(weight[0], row[0][2], weight[1], row[1][2]),
                             weight[2], row[2][2]);
    jet->duv = psurf__l3_mad(psurf__l3_mix(slope[0], row[0][1], slope[1], row[1][1]),
                             slope[2], row[2][1]);
    jet->dvv = psurf__l3_mul(psurf__l3_mix(w[2], psurf__l3_sub(d1, d0),
                                           w[3], psurf__l3_sub(d2, d1)), psurf__l_mul(two, three));
}

/* Bernstein polynomials of a triangle, row by row as in psurf__row, degree n = 2, 3 or 4. */
static void PSURF__K(triangle_basis)(const psurf__lanes *w, uint32_t n, psurf__lanes *out)
{
    static const unsigned char factor[3][15] = {
        {1, 2, 1, 2, 2, 1}, {1, 3, 3, 1, 3, 6, 3, 3, 3, 1},
        {1, 4, 6, 4, 1, 4, 12, 12, 4, 6, 12, 6, 4, 4, 1}
    };
    psurf__lanes a[5], b[5], c[5];
    uint32_t k, l, at = 0;
    a[0] = b[0] = c[0] = psurf__l_all(1);
    for (k = 1; k <= n; k++) {
        a[k] = psurf__l_mul(a[k - 1], w[0]);
        b[k] = psurf__l_mul(b[k - 1], w[1]);
        c[k] = psurf__l_mul(c[k - 1], w[2]);
    }
    for (l = 0; l <= n; l++)
        for (k = 0; k + l <= n; k++, at++)
            out[at] = psurf__l_mul(psurf__l_all(PSURF__R(factor[n - 2][at])),
                                   psurf__l_mul(psurf__l_mul(a[n - k - l], b[k]), c[l]));
}

/* The difference of net points from place (k, l) of the next lower degree, along the edge (0) or
   away from it (1). */
static PSURF__INLINE psurf__l3 PSURF__K(step_of)(const unsigned char *row, const psurf__l3 *net,
                                                 uint32_t k, uint32_t l, int across)
{
    const psurf__l3 *from = net + row[l] + k;
    return psurf__l3_sub(across ? net[row[l + 1] + k] : from[1], *from);
}

static PSURF__INLINE psurf__l3 PSURF__K(step)(const psurf__l3 *net, uint32_t k, uint32_t l,
                                              int across)
{
    return PSURF__K(step_of)(psurf__row, net, k, l, across);
}

static void PSURF__K(sector_second)(const psurf__l3 *net, const psurf__lanes *w,
                                    PSURF__K(jet) *jet)
{
    psurf__lanes b2[6];
    uint32_t k, l, at = 0;
    PSURF__K(triangle_basis)(w, 2, b2);
    jet->duu = jet->duv = jet->dvv = psurf__l3_zero();
    for (l = 0; l < 3; l++)
        for (k = 0; k + l < 3; k++, at++) {
            const psurf__lanes weight = psurf__l_mul(psurf__l_all(12), b2[at]);
            const psurf__l3 u = PSURF__K(step)(net, k, l, 0), v = PSURF__K(step)(net, k, l, 1);
            const psurf__l3 next = PSURF__K(step)(net, k + 1, l, 0);
            const psurf__l3 above = PSURF__K(step)(net, k, l + 1, 0);
            const psurf__l3 beyond = PSURF__K(step)(net, k, l + 1, 1);
            jet->duu = psurf__l3_mad(jet->duu, weight, psurf__l3_sub(next, u));
            jet->duv = psurf__l3_mad(jet->duv, weight, psurf__l3_sub(above, u));
            jet->dvv = psurf__l3_mad(jet->dvv, weight, psurf__l3_sub(beyond, v));
        }
}

/* Parameters of a sector: u = weight of corner i+1, v = weight of the centre, relative to which the
   net is given. */
static void PSURF__K(sector_jet)(const psurf__l3 *net, psurf__l3 centre, const psurf__lanes *w,
                                 int second, PSURF__K(jet) *jet)
{
    const psurf__lanes four = psurf__l_all(4);
    psurf__lanes b4[15], b3[10];
    uint32_t k, l, at = 0;
    PSURF__K(triangle_basis)(w, 4, b4);
    PSURF__K(triangle_basis)(w, 3, b3);
    jet->p = jet->du = jet->dv = psurf__l3_zero();
    for (k = 0; k < 15; k++) jet->p = psurf__l3_mad(jet->p, b4[k], net[k]);
    jet->p = psurf__l3_add(jet->p, centre);
    for (l = 0; l < 4; l++)
        for (k = 0; k + l < 4; k++, at++) {
            const psurf__lanes weight = psurf__l_mul(four, b3[at]);
            jet->du = psurf__l3_mad(jet->du, weight, PSURF__K(step)(net, k, l, 0));
            jet->dv = psurf__l3_mad(jet->dv, weight, PSURF__K(step)(net, k, l, 1));
        }
    if (second) PSURF__K(sector_second)(net, w, jet);
}

/* The net of the sector that each lane's spot lies in, relative to the centre. */
static psurf__l3 PSURF__K(spot_net)(const psurf__batch *b, uint32_t m, psurf__l3 net[15])
{
    const psurf_real *p[8], *last[8];
    psurf__l3 sector[3][PSURF__SECTOR], tail[2], from[3], to[3];
    uint32_t i, j;
    for (i = 0; i < 8; i++) last[i] = b->points[i] + 3 * (PSURF__SECTOR * m - 1);
    PSURF__K(points)(last, 2, tail);
    for (j = 0; j < 3; j++) {                           /* sectors i, i+1 and i-1 */
        for (i = 0; i < 8; i++) {
            const uint32_t s = b->spot[i].sector;
            p[i] = b->points[i] + 3 * PSURF__SECTOR * (j == 0   ? s
                                                       : j == 1 ? psurf__following(s, m)
                                                                : psurf__preceding(s, m));
        }
        PSURF__K(points)(p, PSURF__SECTOR, sector[j]);
        for (i = 0; i < PSURF__SECTOR; i++)
            sector[j][i] = psurf__l3_sub(sector[j][i], tail[1]);
    }
    PSURF__K(inner_line)(sector[0], sector[2], m, from);
    PSURF__K(inner_line)(sector[1], sector[0], m, to);
    PSURF__K(sector_net)(sector[0], &sector[1][PSURF__V], from, to, net);
    return tail[1];
}

/* ---- rational triangles: a cubic, and points blended in ----

   All of them are linear in their points: S = sum of B_ijk(t) net_ijk + sum of W_n(t) X_n, with
   weights that depend on the parameter alone. t: the weights of the three corners. Every 0/0 of the
   formulas is at a corner, where what it is multiplied by vanishes faster; near one, all is written
   in ratios between 0 and 1, so nothing cancels and nothing overflows. */

/* The weight of a point: value, first and second derivatives by t0, t1, t2, each taken as
   independent. Second ones: 00 01 02 11 12 22. */
typedef struct PSURF__K(weight) { psurf__lanes v, d[3], dd[6]; } PSURF__K(weight);

/* A function of two of them, x and y: by x, y; xx, xy, yy. */
typedef struct PSURF__K(form) { psurf__lanes v, d[2], dd[3]; } PSURF__K(form);

/* 1/s, but 1e12 at most, whose cube is a float. Where s is less, what is divided by it is too. */
static PSURF__INLINE psurf__lanes PSURF__K(inverse)(psurf__lanes s)
{
    return psurf__l_div(psurf__l_all(1), psurf__l_max(s, psurf__l_all(PSURF__R(1e-12))));
}

static PSURF__INLINE psurf__lanes PSURF__K(twice)(psurf__lanes a) { return psurf__l_add(a, a); }

static PSURF__INLINE psurf__lanes PSURF__K(rest)(psurf__lanes a)
{
    return psurf__l_sub(psurf__l_all(1), a);
}

/* [GB] (10): x^2 y/(x+y), of the nearer point of an edge; with X = x/(x+y) and Y = y/(x+y). */
static void PSURF__K(b1_form)(psurf__lanes x, psurf__lanes y, int second, PSURF__K(form) *f)
{
    const psurf__lanes r = PSURF__K(inverse)(psurf__l_add(x, y)), one = psurf__l_all(1);
    const psurf__lanes xr = psurf__l_mul(x, r), yr = psurf__l_mul(y, r);
    const psurf__lanes xx = psurf__l_mul(xr, xr), yy = psurf__l_mul(yr, yr);
    f->v = psurf__l_mul(x, psurf__l_mul(x, yr));
    f->d[0] = psurf__l_mul(psurf__l_mul(x, yr), psurf__l_add(one, yr));
    f->d[1] = psurf__l_mul(x, xx);
    if (!second) return;
    f->dd[0] = PSURF__K(twice)(psurf__l_mul(yy, yr));
    f->dd[1] = psurf__l_mul(xx, psurf__l_add(one, PSURF__K(twice)(yr)));
    f->dd[2] = psurf__l_mul(psurf__l_mul(xx, xr), psurf__l_all(-2));
}

/* [GB] (1): x y l with l = x(1-y)/D, D = x(1-y) + y(1-x); X = x/D and Y = y/D are at most 2. */
static void PSURF__K(b2_form)(psurf__lanes x, psurf__lanes y, int second, PSURF__K(form) *f)
{
    const psurf__lanes x1 = PSURF__K(rest)(x), y1 = PSURF__K(rest)(y), one = psurf__l_all(1);
    const psurf__lanes d = psurf__l_add(psurf__l_mul(x, y1), psurf__l_mul(y, x1));
    const psurf__lanes r = PSURF__K(inverse)(d);
    const psurf__lanes xr = psurf__l_mul(x, r), yr = psurf__l_mul(y, r);
    const psurf__lanes l = psurf__l_mul(xr, y1), k = psurf__l_mul(yr, x1);
    const psurf__lanes fall = psurf__l_sub(l, psurf__l_mul(xr, k)), more = psurf__l_add(one, yr);
    psurf__lanes x2, y2;
    f->v = psurf__l_mul(psurf__l_mul(x, y), l);
    f->d[0] = psurf__l_mul(psurf__l_mul(y, l), more);
    f->d[1] = psurf__l_mul(x, fall);
    if (!second) return;
    x2 = PSURF__K(rest)(PSURF__K(twice)(x));
    y2 = PSURF__K(rest)(PSURF__K(twice)(y));
    f->dd[0] = psurf__l_mul(psurf__l_mul(yr, yr),
                            psurf__l_sub(psurf__l_mul(y1, more), psurf__l_mul(l, y2)));
    f->dd[1] = psurf__l_mul(psurf__l_mul(l, yr), PSURF__K(rest)(psurf__l_mul(yr, x2)));
    f->dd[1] = psurf__l_add(psurf__l_mul(fall, more), f->dd[1]);
    f->dd[2] = psurf__l_mul(psurf__l_mul(xr, xr),
                            psurf__l_sub(psurf__l_mul(x2, k),
                                         psurf__l_mul(x1, psurf__l_add(one, xr))));
}

/* [GB] 2.2: x L(y) with L = y^2/N, N = y^2 + (1-y)^2, which is never below 1/2. */
static void PSURF__K(png1_form)(psurf__lanes x, psurf__lanes y, int second, PSURF__K(form) *f)
{
    const psurf__lanes y1 = PSURF__K(rest)(y), yy = psurf__l_mul(y, y), one = psurf__l_all(1);
    const psurf__lanes r = psurf__l_div(one, psurf__l_add(yy, psurf__l_mul(y1, y1)));
    const psurf__lanes half = psurf__l_mul(y, y1);
    const psurf__lanes value = psurf__l_mul(yy, r);
    const psurf__lanes slope = psurf__l_mul(PSURF__K(twice)(half), psurf__l_mul(r, r));
    psurf__lanes bend;
    f->v = psurf__l_mul(x, value);
    f->d[0] = value;
    f->d[1] = psurf__l_mul(x, slope);
    if (!second) return;
    bend = psurf__l_mul(PSURF__K(twice)(psurf__l_sub(y1, y)),
                        psurf__l_add(one, PSURF__K(twice)(half)));
    f->dd[0] = psurf__l_all(0);
    f->dd[1] = slope;
    f->dd[2] = psurf__l_mul(x, psurf__l_mul(bend, psurf__l_mul(r, psurf__l_mul(r, r))));
}

/* [GB] 2.1: x times the weight m = B/(A+B) of the other edge, A = (1-y) x^2, B = (1-x) y^2. All is
   divided by powers of x+y: A+B is 1/4 or more then, but at the corner itself. */
static void PSURF__K(hybrid_form)(psurf__lanes x, psurf__lanes y, int second, PSURF__K(form) *f)
{
    const psurf__lanes s = psurf__l_add(x, y), r = PSURF__K(inverse)(s);
    const psurf__lanes x1 = PSURF__K(rest)(x), y1 = PSURF__K(rest)(y);
    const psurf__lanes xr = psurf__l_mul(x, r), yr = psurf__l_mul(y, r);
    const psurf__lanes xx = psurf__l_mul(xr, xr), yy = psurf__l_mul(yr, yr);
    const psurf__lanes a = psurf__l_mul(y1, xx), b = psurf__l_mul(x1, yy);
    const psurf__lanes sum = psurf__l_max(psurf__l_add(a, b), psurf__l_all(PSURF__EIGHTH));
    const psurf__lanes n = psurf__l_div(psurf__l_all(1), sum), nn = psurf__l_mul(n, n);
    const psurf__lanes m = psurf__l_mul(b, n);
    const psurf__lanes ax = psurf__l_mul(PSURF__K(twice)(xr), y1);  /* their slopes, over x+y */
    const psurf__lanes by = psurf__l_mul(PSURF__K(twice)(yr), x1);
    const psurf__lanes fall = psurf__l_add(psurf__l_mul(ax, b),
                                           psurf__l_mul(s, psurf__l_mul(a, yy)));
    const psurf__lanes rise = psurf__l_add(psurf__l_mul(by, a),
                                           psurf__l_mul(s, psurf__l_mul(b, xx)));
    const psurf__lanes mx = psurf__l_mul(psurf__l_mul(fall, nn), psurf__l_all(-1));
    const psurf__lanes my = psurf__l_mul(rise, nn);     /* those of m, times x+y */
    psurf__lanes sx, sy, mxx, mxy, myy;
    f->v = psurf__l_mul(x, m);
    f->d[0] = psurf__l_add(m, psurf__l_mul(xr, mx));
    f->d[1] = psurf__l_mul(xr, my);
    if (!second) return;
    sx = psurf__l_sub(ax, psurf__l_mul(y, yr));         /* slopes of A+B, over x+y; */
    sy = psurf__l_sub(by, psurf__l_mul(x, xr));
    mxx = psurf__l_add(psurf__l_mul(mx, sx), psurf__l_mul(m, y1));  /* of m (A+B) = B, twice */
    mxx = psurf__l_mul(psurf__l_mul(mxx, n), psurf__l_all(-2));
    mxy = psurf__l_add(psurf__l_mul(mx, sy), psurf__l_mul(my, sx));
    mxy = psurf__l_sub(PSURF__K(twice)(psurf__l_sub(psurf__l_mul(m, s), y)), mxy);
    mxy = psurf__l_mul(mxy, n);
    myy = psurf__l_sub(psurf__l_mul(x1, PSURF__K(rest)(m)), psurf__l_mul(my, sy));
    myy = psurf__l_mul(PSURF__K(twice)(myy), n);
    f->dd[0] = psurf__l_mul(r, psurf__l_add(PSURF__K(twice)(mx), psurf__l_mul(xr, mxx)));
    f->dd[1] = psurf__l_mul(r, psurf__l_add(my, psurf__l_mul(xr, mxy)));
    f->dd[2] = psurf__l_mul(r, psurf__l_mul(xr, myy));
}

/* x y */
static void PSURF__K(product_form)(psurf__lanes x, psurf__lanes y, int second, PSURF__K(form) *f)
{
    f->v = psurf__l_mul(x, y);
    f->d[0] = y;
    f->d[1] = x;
    if (!second) return;
    f->dd[0] = f->dd[2] = psurf__l_all(0);
    f->dd[1] = psurf__l_all(1);
}

/* The weight c t_i^2 f(t_j, t_k), as everything that belongs to a corner i has it. */
static void PSURF__K(corner_weight)(psurf_real c, const psurf__lanes t[3], uint32_t i, uint32_t j,
                                    uint32_t k, const PSURF__K(form) *f, int second,
                                    PSURF__K(weight) *w)
{
    const psurf__lanes line = psurf__l_mul(psurf__l_all(2 * c), t[i]);
    const psurf__lanes square = psurf__l_mul(psurf__l_mul(psurf__l_all(c), t[i]), t[i]);
    w->v = psurf__l_mul(square, f->v);
    w->d[i] = psurf__l_mul(line, f->v);
    w->d[j] = psurf__l_mul(square, f->d[0]);
    w->d[k] = psurf__l_mul(square, f->d[1]);
    if (!second) return;
    w->dd[psurf__second[i][i]] = psurf__l_mul(psurf__l_all(2 * c), f->v);
    w->dd[psurf__second[i][j]] = psurf__l_mul(line, f->d[0]);
    w->dd[psurf__second[i][k]] = psurf__l_mul(line, f->d[1]);
    w->dd[psurf__second[j][j]] = psurf__l_mul(square, f->dd[0]);
    w->dd[psurf__second[j][k]] = psurf__l_mul(square, f->dd[1]);
    w->dd[psurf__second[k][k]] = psurf__l_mul(square, f->dd[2]);
}

/* q = t0 t1 t2/s2 with s2 = t0 t1 + t1 t2 + t2 t0; part[i] = what s2 has without t_i, over s2. */
static void PSURF__K(share)(const psurf__lanes t[3], int second, PSURF__K(weight) *q)
{
    const psurf__lanes t12 = psurf__l_mul(t[1], t[2]), t20 = psurf__l_mul(t[2], t[0]);
    const psurf__lanes t01 = psurf__l_mul(t[0], t[1]);
    const psurf__lanes r = PSURF__K(inverse)(psurf__l_add(psurf__l_add(t01, t12), t20));
    psurf__lanes part[3];
    uint32_t i, j, k;
    part[0] = psurf__l_mul(t12, r);
    part[1] = psurf__l_mul(t20, r);
    part[2] = psurf__l_mul(t01, r);
    q->v = psurf__l_mul(t[0], part[0]);
    for (i = 0; i < 3; i++) {
        j = psurf__following(i, 3);
        k = psurf__preceding(i, 3);
        q->d[i] = psurf__l_mul(part[i], part[i]);
        if (!second) continue;
        q->dd[psurf__second[i][i]] =
            psurf__l_mul(psurf__l_mul(q->d[i], psurf__l_all(-2)),
                         psurf__l_mul(psurf__l_add(t[j], t[k]), r));
        q->dd[psurf__second[i][j]] = psurf__l_mul(PSURF__K(twice)(psurf__l_mul(part[i], part[j])),
                                                psurf__l_mul(t[k], r));
    }
}

/* The weight 6 q f(t_i, t_j), as everything that belongs to an edge from i to j has it. */
static void PSURF__K(edge_weight)(const PSURF__K(weight) *q, uint32_t i, uint32_t j, uint32_t k,
                                  const PSURF__K(form) *f, int second, PSURF__K(weight) *w)
{
    const psurf__lanes six = psurf__l_all(6), q6 = psurf__l_mul(six, q->v);
    const psurf__lanes f6 = psurf__l_mul(six, f->v), *qq = q->dd;
    psurf__lanes fi, fj;
    w->v = psurf__l_mul(q6, f->v);
    w->d[i] = psurf__l_add(psurf__l_mul(q->d[i], f6), psurf__l_mul(q6, f->d[0]));
    w->d[j] = psurf__l_add(psurf__l_mul(q->d[j], f6), psurf__l_mul(q6, f->d[1]));
    w->d[k] = psurf__l_mul(q->d[k], f6);
    if (!second) return;
    fi = psurf__l_mul(six, f->d[0]);
    fj = psurf__l_mul(six, f->d[1]);
    w->dd[psurf__second[i][i]] = psurf__l_add(psurf__l_mul(qq[psurf__second[i][i]], f6),
        psurf__l_add(PSURF__K(twice)(psurf__l_mul(q->d[i], fi)), psurf__l_mul(q6, f->dd[0])));
    w->dd[psurf__second[i][j]] = psurf__l_add(
        psurf__l_add(psurf__l_mul(qq[psurf__second[i][j]], f6), psurf__l_mul(q6, f->dd[1])),
        psurf__l_add(psurf__l_mul(q->d[i], fj), psurf__l_mul(q->d[j], fi)));
    w->dd[psurf__second[j][j]] = psurf__l_add(psurf__l_mul(qq[psurf__second[j][j]], f6),
        psurf__l_add(PSURF__K(twice)(psurf__l_mul(q->d[j], fj)), psurf__l_mul(q6, f->dd[2])));
    w->dd[psurf__second[i][k]] = psurf__l_add(psurf__l_mul(qq[psurf__second[i][k]], f6),
                                            psurf__l_mul(q->d[k], fi));
    w->dd[psurf__second[j][k]] = psurf__l_add(psurf__l_mul(qq[psurf__second[j][k]], f6),
                                            psurf__l_mul(q->d[k], fj));
    w->dd[psurf__second[k][k]] = psurf__l_mul(qq[psurf__second[k][k]], f6);
}

/* Of an edge's inner points, n = 2 e at its start, 2 e + 1 at its end: B1 or B2. q: see share. */
static void PSURF__K(inner_weight)(const psurf__lanes t[3], const PSURF__K(weight) *q, uint32_t n,
                                   int b2, int second, PSURF__K(weight) *w)
{
    const uint32_t e = n / 2, b = psurf__following(e, 3);
    const uint32_t i = n & 1 ? b : e, j = n & 1 ? e : b, k = 3 - i - j;     /* nearer corner: i */
    PSURF__K(form) f;
    if (b2) {
        PSURF__K(b2_form)(t[i], t[j], second, &f);
        PSURF__K(edge_weight)(q, i, j, k, &f, second, w);
    } else {
        PSURF__K(b1_form)(t[j], t[k], second, &f);
        PSURF__K(corner_weight)(6, t, i, j, k, &f, second, w);
    }
}

/* Of the six keys' other points, n in the order b210 b120 b201 b021 b102 b012. */
static void PSURF__K(png1_weight)(const psurf__lanes t[3], uint32_t n, int second,
                                  PSURF__K(weight) *w)
{
    static const unsigned char key[6][2] = {{0, 1}, {1, 0}, {0, 2}, {1, 2}, {2, 0}, {2, 1}};
    const uint32_t i = key[n][0], j = key[n][1], k = 3 - i - j;
    PSURF__K(form) f;
    PSURF__K(png1_form)(t[j], t[k], second, &f);
    PSURF__K(corner_weight)(3, t, i, j, k, &f, second, w);
}

/* Of the other edge's points: n = 2 i for the key from corner i towards the next, 2 i + 1 towards
   the preceding one; and 6 + e for an edge's b111, which [GB] (1) blends. */
static void PSURF__K(hybrid_weight)(const psurf__lanes t[3], const PSURF__K(weight) *q, uint32_t n,
                                    int second, PSURF__K(weight) *w)
{
    const uint32_t i = n < 6 ? n / 2 : n - 6, next = psurf__following(i, 3);
    const uint32_t last = psurf__preceding(i, 3), j = n < 6 && n & 1 ? last : next, k = 3 - i - j;
    PSURF__K(form) f;
    if (n < 6) {
        PSURF__K(hybrid_form)(t[j], t[k], second, &f);
        PSURF__K(corner_weight)(3, t, i, j, k, &f, second, w);
    } else {
        PSURF__K(product_form)(t[i], t[j], second, &f);
        PSURF__K(edge_weight)(q, i, j, k, &f, second, w);
    }
}

/* The weight of blend n of a kind; second derivatives if asked for. q: see share. */
static void PSURF__K(blend_weight)(psurf_kind kind, const psurf__lanes t[3],
                                   const PSURF__K(weight) *q, uint32_t n, int second,
                                   PSURF__K(weight) *w)
{
    if (kind == PSURF_HYBRID_TRI) PSURF__K(hybrid_weight)(t, q, n, second, w);
    else if (kind != PSURF_PNG1_TRI)
        PSURF__K(inner_weight)(t, q, n, kind == PSURF_RIBBON_B2, second, w);
    else if (n < 6) PSURF__K(png1_weight)(t, n, second, w);
    else PSURF__K(inner_weight)(t, q, n - 6, 1, second, w);
}

/* The weights of all blends. */
static PSURF__INLINE void PSURF__K(blend_weights)(psurf_kind kind, const psurf__lanes t[3],
                                                  int second, PSURF__K(weight) *w)
{
    PSURF__K(weight) q;
    uint32_t n;
    PSURF__K(share)(t, second, &q);
    for (n = 0; n < psurf__blend_count(kind); n++)
        PSURF__K(blend_weight)(kind, t, &q, n, second, &w[n]);
}

/* Stored points with positions relative to the first; normals and the like stay what they are. */
static void PSURF__K(localise)(psurf_kind kind, const psurf__l3 *stored, psurf__l3 *local)
{
    const psurf__l3 origin = stored[0];
    uint32_t i;
    for (i = 0; i < psurf__kind_table[kind].points; i++)
        if (i < psurf__kinds[kind].control) local[i] = psurf__l3_sub(stored[i], origin);
        else psurf__l3_put(&local[i], stored[i]);
}

/* Out of local points: the cubic, and what is blended into it. */
static void PSURF__K(base_net)(psurf_kind kind, const psurf__l3 *local, psurf__l3 net[10])
{
    const psurf__net_row *row = psurf__kinds[kind].net;
    uint32_t k;
    for (k = 0; k < 10; k++)
        if (row->net[k] == PSURF__ORIGIN) net[k] = psurf__l3_zero();
        else psurf__l3_put(&net[k], local[row->net[k]]);
}

static psurf__l3 PSURF__K(blend_point)(psurf_kind kind, const psurf__l3 *local, uint32_t n)
{
    const unsigned char *blend = psurf__kinds[kind].net->blend[n];
    const psurf__l3 zero = psurf__l3_zero();
    return psurf__l3_sub(local[blend[0]], blend[1] == PSURF__ORIGIN ? zero : local[blend[1]]);
}

static PSURF__INLINE void PSURF__K(blend_points)(psurf_kind kind, const psurf__l3 *local,
                                                 psurf__l3 *x)
{
    uint32_t n;
    for (n = 0; n < psurf__blend_count(kind); n++) x[n] = PSURF__K(blend_point)(kind, local, n);
}

/* A cubic triangle; order: how many derivatives. u = weight of corner 1, v = weight of corner 2. */
static PSURF__INLINE void PSURF__K(net_jet)(const psurf__l3 net[10], const psurf__lanes t[3],
                                            int order, PSURF__K(jet) *jet)
{
    const unsigned char *row = psurf__cubic_row;
    psurf__lanes b3[10], b2[6];
    uint32_t k, l, at = 0;
    PSURF__K(triangle_basis)(t, 3, b3);
    jet->p = psurf__l3_zero();
    for (k = 0; k < 10; k++) jet->p = psurf__l3_mad(jet->p, b3[k], net[k]);
    if (order < 1) return;
    PSURF__K(triangle_basis)(t, 2, b2);
    jet->du = jet->dv = psurf__l3_zero();
    for (l = 0; l < 3; l++)
        for (k = 0; k + l < 3; k++, at++) {
            const psurf__lanes weight = psurf__l_mul(psurf__l_all(3), b2[at]);
            jet->du = psurf__l3_mad(jet->du, weight, PSURF__K(step_of)(row, net, k, l, 0));
            jet->dv = psurf__l3_mad(jet->dv, weight, PSURF__K(step_of)(row, net, k, l, 1));
        }
    if (order < 2) return;
    jet->duu = jet->duv = jet->dvv = psurf__l3_zero();
    for (at = 0; at < 3; at++) {
        const psurf__lanes weight = psurf__l_mul(psurf__l_all(6), t[at]);
        const psurf__l3 u = PSURF__K(step_of)(row, net, at == 1, at == 2, 0);
        const psurf__l3 v = PSURF__K(step_of)(row, net, at == 1, at == 2, 1);
        const psurf__l3 next = PSURF__K(step_of)(row, net, (at == 1) + 1, at == 2, 0);
        const psurf__l3 above = PSURF__K(step_of)(row, net, at == 1, (at == 2) + 1, 0);
        const psurf__l3 beyond = PSURF__K(step_of)(row, net, at == 1, (at == 2) + 1, 1);
        jet->duu = psurf__l3_mad(jet->duu, weight, psurf__l3_sub(next, u));
        jet->duv = psurf__l3_mad(jet->duv, weight, psurf__l3_sub(above, u));
        jet->dvv = psurf__l3_mad(jet->dvv, weight, psurf__l3_sub(beyond, v));
    }
}

/* Second derivatives by u and v, out of those by t0, t1, t2: along 1 - 0 and 2 - 0. */
static PSURF__INLINE psurf__lanes PSURF__K(along_uu)(const psurf__lanes dd[6])
{
    return psurf__l_add(psurf__l_sub(dd[0], dd[1]), psurf__l_sub(dd[3], dd[1]));
}
static PSURF__INLINE psurf__lanes PSURF__K(along_uv)(const psurf__lanes dd[6])
{
    return psurf__l_add(psurf__l_sub(dd[0], dd[1]), psurf__l_sub(dd[4], dd[2]));
}
static PSURF__INLINE psurf__lanes PSURF__K(along_vv)(const psurf__lanes dd[6])
{
    return psurf__l_add(psurf__l_sub(dd[0], dd[2]), psurf__l_sub(dd[5], dd[2]));
}

/* Adds w x. */
static PSURF__INLINE void PSURF__K(add_blend)(const PSURF__K(weight) *w, psurf__l3 x, int second,
                                              PSURF__K(jet) *jet)
{
    jet->p = psurf__l3_mad(jet->p, w->v, x);
    jet->du = psurf__l3_mad(jet->du, psurf__l_sub(w->d[1], w->d[0]), x);
    jet->dv = psurf__l3_mad(jet->dv, psurf__l_sub(w->d[2], w->d[0]), x);
    if (!second) return;
    jet->duu = psurf__l3_mad(jet->duu, PSURF__K(along_uu)(w->dd), x);
    jet->duv = psurf__l3_mad(jet->duv, PSURF__K(along_uv)(w->dd), x);
    jet->dvv = psurf__l3_mad(jet->dvv, PSURF__K(along_vv)(w->dd), x);
}

/* A triangle of any kind but npatch, from local points; p is relative to their origin. */
static void PSURF__K(triangle_jet)(psurf_kind kind, const psurf__l3 *local,
                                   const psurf__lanes t[3], int second, PSURF__K(jet) *jet)
{
    PSURF__K(weight) q, w;
    psurf__l3 net[10];
    uint32_t n;
    PSURF__K(base_net)(kind, local, net);
    PSURF__K(net_jet)(net, t, second ? 2 : 1, jet);
    PSURF__K(share)(t, second, &q);
    for (n = 0; n < psurf__blend_count(kind); n++) {
        PSURF__K(blend_weight)(kind, t, &q, n, second, &w);
        PSURF__K(add_blend)(&w, PSURF__K(blend_point)(kind, local, n), second, jet);
    }
}

/* ---- smoothed N-patches: curves from an edge to the opposite corner ----

   [N]: P = N + sum of w_e (P_e - N), where N is the cubic of the ten points and P_e sweeps the
   triangle by PN curves from the edge's curve to the opposite corner. All is taken from the flat
   triangle of the corners upwards: what is left vanishes at every corner as fast as derivatives of
   the weights grow there. Each edge, from a to b, has parameters of its own: x is the weight t_b, y
   that of the opposite corner, t_c; tau = t_b/(t_a+t_b) tells where on the edge's curve. */

/* Bends are points of the cubic less those of the flat triangle; all is relative to corner 0. */
typedef struct PSURF__K(smoothed) {
    psurf__l3 bend[10], corner[3], normal[3];
    psurf__lanes flat[3], turned[3];            /* of edges */
    psurf__lanes least[3];                      /* squares of slopes below it are no direction */
    psurf__lanes counts, drawn;                 /* flatness counts; the inside is drawn to N */
} PSURF__K(smoothed);

/* How an edge contributes: along x and y; then xx, xy, yy. Sums over edges; by t0, t1, t2. */
typedef struct PSURF__K(edge_lift) { psurf__l3 v, d[2], dd[3]; } PSURF__K(edge_lift);
typedef struct PSURF__K(lift) {
    PSURF__K(weight) w;
    psurf__l3 v, d[3], dd[6];
} PSURF__K(lift);

/* From local points. */
static void PSURF__K(open_smoothed)(const psurf__l3 *local, PSURF__K(smoothed) *s)
{
    const psurf__kind_row *row = &psurf__kinds[PSURF_NPATCH];
    const psurf__lanes thirds[4] = {psurf__l_all(0), psurf__l_all(PSURF__R(1.0 / 3.0)),
                                    psurf__l_all(PSURF__R(2.0 / 3.0)), psurf__l_all(1)};
    uint32_t k, l, at = 0;
    for (k = 0; k < 3; k++) {
        psurf__l3_put(&s->corner[k], local[row->edge[k][0]]);
        psurf__l3_put(&s->normal[k], local[row->normal[k]]);
    }
    for (l = 0; l < 4; l++)
        for (k = 0; k + l < 4; k++, at++) {
            const psurf__l3 flat = psurf__l3_mix(thirds[k], s->corner[1], thirds[l], s->corner[2]);
            s->bend[at] = psurf__l3_sub(local[at], flat);
        }
    s->bend[0] = s->bend[3] = s->bend[9] = psurf__l3_zero();
    for (k = 0; k < 3; k++) {
        const psurf__l3 chord = psurf__l3_sub(s->corner[psurf__following(k, 3)], s->corner[k]);
        const psurf__l3 b0 = s->bend[row->edge[k][1]], b1 = s->bend[row->edge[k][2]];
        const psurf__lanes bends = psurf__l_add(psurf__l3_dot(b0, b0), psurf__l3_dot(b1, b1));
        const psurf__lanes size = psurf__l_add(psurf__l3_dot(chord, chord), bends);
        s->least[k] = psurf__l_add(psurf__l_mul(psurf__l_all(PSURF__R(1e-12)), size),
                                   psurf__l_all(PSURF__R(1e-30)));
    }
    s->flat[0] = local[16].x;
    s->flat[1] = local[16].y;
    s->flat[2] = local[16].z;
    s->turned[0] = local[17].x;
    s->turned[1] = local[17].y;
    s->turned[2] = local[17].z;
    s->counts = local[18].x;
    s->drawn = local[18].y;
}

/* An edge's curve above its chord, from its two bends, and derivatives by tau; rest = 1 - tau. */
static PSURF__INLINE void PSURF__K(curve)(const psurf__l3 *b0, const psurf__l3 *b1,
                                          psurf__lanes rest, psurf__lanes tau, int order,
                                          psurf__l3 c[4])
{
    const psurf__lanes rest3 = psurf__l_mul(psurf__l_all(3), rest), six = psurf__l_all(6);
    const psurf__lanes tau3 = psurf__l_mul(psurf__l_all(3), tau), both = psurf__l_mul(rest3, tau);
    const psurf__lanes fall = psurf__l_sub(rest, PSURF__K(twice)(tau));
    const psurf__lanes rise = psurf__l_sub(PSURF__K(twice)(rest), tau);
    c[0] = psurf__l3_mix(psurf__l_mul(both, rest), *b0, psurf__l_mul(both, tau), *b1);
    if (order < 1) return;
    c[1] = psurf__l3_mix(psurf__l_mul(rest3, fall), *b0, psurf__l_mul(tau3, rise), *b1);
    if (order < 2) return;
    c[2] = psurf__l3_mul(psurf__l3_sub(psurf__l3_mul(*b1, fall), psurf__l3_mul(*b0, rise)), six);
    if (order < 3) return;
    c[3] = psurf__l3_mul(psurf__l3_sub(*b0, *b1), psurf__l_all(18));
}

/* raw less its part along g, both with derivatives by tau; factor: 1 where that is wanted. */
static PSURF__INLINE void PSURF__K(turn_away)(const psurf__l3 *g, psurf__lanes factor,
                                              psurf__lanes least, int order, psurf__l3 raw[3])
{
    const psurf__lanes r =
        psurf__l_div(psurf__l_all(1), psurf__l_max(psurf__l3_dot(g[0], g[0]), least));
    const psurf__lanes minus = psurf__l_mul(factor, psurf__l_all(-1));
    psurf__lanes q1, q2, k0, k1, k2;
    psurf__l3 l1 = raw[0];
    k0 = psurf__l_mul(psurf__l_mul(psurf__l3_dot(raw[0], g[0]), r), minus);
    raw[0] = psurf__l3_mad(raw[0], k0, g[0]);
    if (order < 1) return;
    q1 = PSURF__K(twice)(psurf__l3_dot(g[0], g[1]));
    k1 = psurf__l_add(psurf__l3_dot(raw[1], g[0]), psurf__l3_dot(l1, g[1]));
    k1 = psurf__l_mul(psurf__l_sub(psurf__l_mul(k1, minus), psurf__l_mul(k0, q1)), r);
    if (order >= 2) {
        q2 = PSURF__K(twice)(psurf__l_add(psurf__l3_dot(g[1], g[1]), psurf__l3_dot(g[0], g[2])));
        k2 = psurf__l_add(PSURF__K(twice)(psurf__l3_dot(raw[1], g[1])), psurf__l3_dot(l1, g[2]));
        k2 = psurf__l_sub(psurf__l_mul(k2, minus), PSURF__K(twice)(psurf__l_mul(k1, q1)));
        k2 = psurf__l_mul(psurf__l_sub(k2, psurf__l_mul(k0, q2)), r);
        raw[2] = psurf__l3_mad(psurf__l3_mul(g[0], k2), PSURF__K(twice)(k1), g[1]);
        raw[2] = psurf__l3_mad(raw[2], k0, g[2]);
    }
    raw[1] = psurf__l3_mad(psurf__l3_mad(raw[1], k1, g[0]), k0, g[1]);
}

/* raw at unit length with its derivatives, in place; where nothing is left of it, instead. */
static PSURF__INLINE void PSURF__K(make_unit)(psurf__l3 instead, int order, psurf__l3 raw[3])
{
    const psurf__lanes q = psurf__l3_dot(raw[0], raw[0]), least = psurf__l_all(PSURF__R(1e-12));
    const psurf__lanes r = psurf__l_select(
        q, least, psurf__l_div(psurf__l_all(1), psurf__l_sqrt(q)), psurf__l_all(0));
    const psurf__l3 m = psurf__l3_select(q, least, psurf__l3_mul(raw[0], r), instead);
    psurf__lanes grows, bends;
    psurf__l3 m1;
    raw[0] = m;
    if (order < 1) return;
    grows = psurf__l3_dot(m, raw[1]);                   /* of the length of raw */
    m1 = psurf__l3_mul(psurf__l3_sub(raw[1], psurf__l3_mul(m, grows)), r);
    if (order >= 2) {
        bends = psurf__l_add(psurf__l3_dot(m, raw[2]), psurf__l3_dot(m1, raw[1]));
        raw[2] = psurf__l3_sub(raw[2], psurf__l3_mix(PSURF__K(twice)(grows), m1, bends, m));
        raw[2] = psurf__l3_mul(raw[2], r);
    }
    raw[1] = m1;
}

/* The part of d along the unit normal m, with derivatives by tau; those of d are -g. */
static PSURF__INLINE void PSURF__K(part_along)(psurf__l3 d, const psurf__l3 *g, const psurf__l3 *m,
                                               int order, psurf__l3 out[3])
{
    const psurf__lanes f0 = psurf__l3_dot(d, m[0]);
    psurf__lanes f1, f2;
    out[0] = psurf__l3_mul(m[0], f0);
    if (order < 1) return;
    f1 = psurf__l_sub(psurf__l3_dot(d, m[1]), psurf__l3_dot(g[0], m[0]));
    out[1] = psurf__l3_mix(f1, m[0], f0, m[1]);
    if (order < 2) return;
    f2 = psurf__l_sub(psurf__l3_dot(d, m[2]), PSURF__K(twice)(psurf__l3_dot(g[0], m[1])));
    f2 = psurf__l_sub(f2, psurf__l3_dot(g[1], m[0]));
    out[2] = psurf__l3_mad(psurf__l3_mix(f2, m[0], f0, m[2]), PSURF__K(twice)(f1), m[1]);
}

/* What is swept along an edge, by tau: the curve C above its chord; and with d, the way from the
   curve to the opposite corner, (d.m) m of the normal m along the edge and (d.n) n of that at the
   corner. turn: in some lanes m is turned to be orthogonal to the curve. */
typedef struct PSURF__K(swept) { psurf__l3 c[4], m[3], n[3]; } PSURF__K(swept);

static PSURF__INLINE void PSURF__K(sweep)(const PSURF__K(smoothed) *p, uint32_t e,
                                          psurf__lanes rest, psurf__lanes tau, int turn, int order,
                                          PSURF__K(swept) *out)
{
    const unsigned char *places = psurf__kinds[PSURF_NPATCH].edge[e];
    const uint32_t b = psurf__following(e, 3), o = psurf__preceding(e, 3);
    const psurf__l3 n = p->normal[o];
    psurf__l3 g[3], m[3], d;
    PSURF__K(curve)(&p->bend[places[1]], &p->bend[places[2]], rest, tau, order + turn, out->c);
    d = psurf__l3_mix(rest, p->corner[e], tau, p->corner[b]);
    d = psurf__l3_sub(p->corner[o], psurf__l3_add(d, out->c[0]));
    g[0] = g[1] = g[2] = m[2] = psurf__l3_zero();
    if (order + turn >= 1)
        g[0] = psurf__l3_add(psurf__l3_sub(p->corner[b], p->corner[e]), out->c[1]);
    if (order + turn >= 2) g[1] = out->c[2];
    if (order + turn >= 3) g[2] = out->c[3];
    m[0] = psurf__l3_mix(rest, p->normal[e], tau, p->normal[b]);
    m[1] = psurf__l3_sub(p->normal[b], p->normal[e]);
    if (turn) PSURF__K(turn_away)(g, p->turned[e], p->least[e], order, m);
    PSURF__K(make_unit)(p->normal[e], order, m);
    PSURF__K(part_along)(d, g, m, order, out->m);
    out->n[0] = psurf__l3_mul(n, psurf__l3_dot(d, n));
    if (order >= 1)
        out->n[1] = psurf__l3_sub(psurf__l3_zero(), psurf__l3_mul(n, psurf__l3_dot(g[0], n)));
    if (order >= 2)
        out->n[2] = psurf__l3_sub(psurf__l3_zero(), psurf__l3_mul(n, psurf__l3_dot(g[1], n)));
}

/* P_e above the flat triangle, [N] 1.1.7 and 1.1.5: s C - s^2 t (d.m) m + s t^2 (d.n) n, where
   s = t_a + t_b and t = t_c. With tau_x = 1/s and tau_y = tau/s most divisions by s cancel. */
static PSURF__INLINE void PSURF__K(edge_patch)(const PSURF__K(smoothed) *p, uint32_t e,
                                               const psurf__lanes w[3], int turn, int order,
                                               PSURF__K(edge_lift) *out)
{
    const psurf__lanes a = w[e], b = w[psurf__following(e, 3)], t = w[psurf__preceding(e, 3)];
    const psurf__lanes s = psurf__l_add(a, b), r = PSURF__K(inverse)(s);
    const psurf__lanes tau = psurf__l_mul(b, r), st = psurf__l_mul(s, t);
    const psurf__lanes s2 = PSURF__K(twice)(s), t2 = PSURF__K(twice)(t);
    const psurf__lanes tt = psurf__l_mul(t, t), st2 = PSURF__K(twice)(st);
    PSURF__K(swept) f;
    psurf__l3 cross;
    PSURF__K(sweep)(p, e, psurf__l_mul(a, r), tau, turn, order, &f);
    out->v = psurf__l3_mix(s, f.c[0], psurf__l_mul(st, t), f.n[0]);
    out->v = psurf__l3_sub(out->v, psurf__l3_mul(f.m[0], psurf__l_mul(st, s)));
    if (order < 1) return;
    out->d[0] = psurf__l3_mad(psurf__l3_sub(f.c[1], psurf__l3_mul(f.m[1], st)), tt, f.n[1]);
    out->d[1] = psurf__l3_mix(psurf__l_sub(st2, psurf__l_mul(s, s)), f.m[0],
                              psurf__l_sub(st2, tt), f.n[0]);
    out->d[1] = psurf__l3_add(psurf__l3_sub(out->d[1], f.c[0]), psurf__l3_mul(out->d[0], tau));
    if (order < 2) return;
    out->dd[0] = psurf__l3_mad(psurf__l3_sub(f.c[2], psurf__l3_mul(f.m[2], st)), tt, f.n[2]);
    out->dd[0] = psurf__l3_mul(out->dd[0], r);
    cross = psurf__l3_mix(psurf__l_sub(t, s), f.m[1], t2, f.n[1]);
    out->dd[1] = psurf__l3_mad(cross, tau, out->dd[0]);
    out->dd[2] = psurf__l3_mix(psurf__l_sub(s2, t), f.m[0], psurf__l_sub(s, t2), f.n[0]);
    cross = psurf__l3_add(psurf__l3_mul(cross, tau), out->dd[2]);
    out->dd[2] = psurf__l3_mad(psurf__l3_mul(cross, psurf__l_all(2)), psurf__l_mul(tau, tau),
                               out->dd[0]);
}

/* [N] 1.1.6: g = t_a t_b/(t0 t1 + t1 t2 + t2 t0), r = 1 over that sum. */
static PSURF__INLINE void PSURF__K(edge_share)(psurf__lanes a, psurf__lanes b, psurf__lanes c,
                                               psurf__lanes r, int order, PSURF__K(form) *g)
{
    const psurf__lanes ar = psurf__l_mul(a, r), br = psurf__l_mul(b, r), cr = psurf__l_mul(c, r);
    const psurf__lanes s = psurf__l_add(a, b), sr = psurf__l_add(ar, br), ab = psurf__l_mul(ar, br);
    const psurf__lanes aa = psurf__l_mul(ar, ar), bb = psurf__l_mul(br, br);
    psurf__lanes by_aa, by_ab, by_ac, by_bc, by_cc;
    g->v = psurf__l_mul(a, br);
    if (order < 1) return;
    g->d[0] = psurf__l_mul(c, psurf__l_mul(psurf__l_sub(ar, br), sr));
    g->d[1] = psurf__l_mul(psurf__l_add(psurf__l_mul(ab, s), psurf__l_mul(c, bb)),
                           psurf__l_all(-1));
    if (order < 2) return;
    by_aa = psurf__l_mul(psurf__l_mul(psurf__l_mul(bb, psurf__l_add(b, c)), cr), psurf__l_all(-2));
    by_ab = psurf__l_mul(PSURF__K(twice)(psurf__l_mul(ab, c)), cr);
    by_ac = psurf__l_mul(bb, psurf__l_sub(psurf__l_mul(ar, b), psurf__l_mul(cr, s)));
    by_bc = psurf__l_mul(aa, psurf__l_sub(psurf__l_mul(br, a), psurf__l_mul(cr, s)));
    by_cc = psurf__l_mul(PSURF__K(twice)(psurf__l_mul(ab, sr)), s);
    g->dd[0] = psurf__l_add(psurf__l_mul(aa, a), psurf__l_mul(bb, b));
    g->dd[0] = psurf__l_add(g->dd[0], psurf__l_mul(c, psurf__l_mul(sr, sr)));
    g->dd[0] = psurf__l_mul(psurf__l_mul(g->dd[0], cr), psurf__l_all(-2));
    g->dd[1] = psurf__l_add(psurf__l_sub(by_bc, by_ab), psurf__l_sub(by_aa, by_ac));
    g->dd[2] = psurf__l_add(psurf__l_sub(by_cc, by_ac), psurf__l_sub(by_aa, by_ac));
}

/* How far an edge is from being flat: 1 - bf, [N] 1.1.10, of bf before it is capped; counts: 0
   where flatness does not. */
static PSURF__INLINE psurf__lanes PSURF__K(openness)(psurf__lanes bf, psurf__lanes counts)
{
    const psurf__lanes one = psurf__l_all(1);
    return PSURF__K(rest)(psurf__l_mul(counts, psurf__l_select(one, bf, bf, one)));
}

/* The weight of P_e: g (1 - bf) (1 - drawn bl), bl = 27 t0 t1 t2. r as edge_share has it. */
static PSURF__INLINE void PSURF__K(edge_form)(const PSURF__K(smoothed) *p, uint32_t e,
                                              const psurf__lanes t[3], psurf__lanes r,
                                              psurf__lanes bl, psurf__lanes open, int order,
                                              PSURF__K(form) *w)
{
    const psurf__lanes a = t[e], b = t[psurf__following(e, 3)], c = t[psurf__preceding(e, 3)];
    const psurf__lanes left = PSURF__K(rest)(psurf__l_mul(p->drawn, bl)), zero = psurf__l_all(0);
    const psurf__lanes k = psurf__l_mul(open, left), full = psurf__l_all(27);
    psurf__lanes slope, k1, k2, x, y, gk1, gk2, xx, yy;
    PSURF__K(form) g;
    PSURF__K(edge_share)(a, b, c, r, order, &g);
    w->v = psurf__l_mul(g.v, k);
    if (order < 1) return;
    slope = psurf__l_select(open, zero, p->counts, zero);
    k1 = psurf__l_add(psurf__l_mul(slope, left), psurf__l_mul(p->drawn, open));
    k1 = psurf__l_mul(k1, psurf__l_all(-1));            /* k by bl */
    x = psurf__l_mul(psurf__l_mul(full, c), psurf__l_sub(a, b));        /* bl by x and y */
    y = psurf__l_mul(psurf__l_mul(full, b), psurf__l_sub(a, c));
    gk1 = psurf__l_mul(g.v, k1);
    w->d[0] = psurf__l_add(psurf__l_mul(g.d[0], k), psurf__l_mul(gk1, x));
    w->d[1] = psurf__l_add(psurf__l_mul(g.d[1], k), psurf__l_mul(gk1, y));
    if (order < 2) return;
    k2 = psurf__l_mul(PSURF__K(twice)(slope), p->drawn);
    gk2 = psurf__l_mul(g.v, k2);
    xx = psurf__l_sub(psurf__l_mul(gk2, psurf__l_mul(x, x)),
                      psurf__l_mul(psurf__l_mul(gk1, psurf__l_all(54)), c));
    yy = psurf__l_sub(psurf__l_mul(gk2, psurf__l_mul(y, y)),
                      psurf__l_mul(psurf__l_mul(gk1, psurf__l_all(54)), b));
    w->dd[0] = psurf__l_add(xx, psurf__l_mul(PSURF__K(twice)(k1), psurf__l_mul(g.d[0], x)));
    w->dd[2] = psurf__l_add(yy, psurf__l_mul(PSURF__K(twice)(k1), psurf__l_mul(g.d[1], y)));
    w->dd[1] = psurf__l_mul(gk1, psurf__l_mul(full, psurf__l_sub(psurf__l_sub(a, b), c)));
    w->dd[1] = psurf__l_add(w->dd[1], psurf__l_mul(gk2, psurf__l_mul(x, y)));
    w->dd[1] = psurf__l_add(w->dd[1], psurf__l_mul(k1, psurf__l_add(psurf__l_mul(g.d[0], y),
                                                                    psurf__l_mul(g.d[1], x))));
    w->dd[0] = psurf__l_add(w->dd[0], psurf__l_mul(g.dd[0], k));
    w->dd[1] = psurf__l_add(w->dd[1], psurf__l_mul(g.dd[1], k));
    w->dd[2] = psurf__l_add(w->dd[2], psurf__l_mul(g.dd[2], k));
}

/* Adds w and w times x. Derivatives along an edge's x and y are as if those by t_a were 0: only
   their differences count. */
static PSURF__INLINE void PSURF__K(add_lift)(const PSURF__K(form) *w, const PSURF__K(edge_lift) *x,
                                             uint32_t e, int order, PSURF__K(lift) *sum)
{
    const uint32_t at[2] = {psurf__following(e, 3), psurf__preceding(e, 3)};
    uint32_t i, j, k;
    sum->w.v = psurf__l_add(sum->w.v, w->v);
    sum->v = psurf__l3_mad(sum->v, w->v, x->v);
    for (i = 0; i < 2 && order >= 1; i++) {
        const psurf__l3 d = psurf__l3_mix(w->d[i], x->v, w->v, x->d[i]);
        sum->w.d[at[i]] = psurf__l_add(sum->w.d[at[i]], w->d[i]);
        sum->d[at[i]] = psurf__l3_add(sum->d[at[i]], d);
    }
    for (k = 0; k < 3 && order >= 2; k++) {
        i = k == 2;                                     /* xx, xy, yy */
        j = k > 0;
        {
            const uint32_t to = psurf__second[at[i]][at[j]];
            const psurf__l3 ends = psurf__l3_mix(w->dd[k], x->v, w->v, x->dd[k]);
            const psurf__l3 mixed = psurf__l3_mix(w->d[i], x->d[j], w->d[j], x->d[i]);
            sum->w.dd[to] = psurf__l_add(sum->w.dd[to], w->dd[k]);
            sum->dd[to] = psurf__l3_add(sum->dd[to], psurf__l3_add(ends, mixed));
        }
    }
}

static PSURF__INLINE void PSURF__K(clear_lift)(int order, PSURF__K(lift) *sum)
{
    uint32_t i;
    sum->w.v = psurf__l_all(0);
    sum->v = psurf__l3_zero();
    for (i = 0; i < 3 && order >= 1; i++) {
        sum->w.d[i] = psurf__l_all(0);
        sum->d[i] = psurf__l3_zero();
    }
    for (i = 0; i < 6 && order >= 2; i++) {
        sum->w.dd[i] = psurf__l_all(0);
        sum->dd[i] = psurf__l3_zero();
    }
}

/* Lanes whose edge is flat here get nothing, whatever it would be: so an edge that is flat in all
   of them can be passed over, and no lane shows what the others are. */
static PSURF__INLINE void PSURF__K(keep_open)(psurf__lanes open, int order,
                                              PSURF__K(edge_lift) *x)
{
    const psurf__lanes none = psurf__l_all(0);
    const psurf__l3 zero = psurf__l3_zero();
    uint32_t i;
    x->v = psurf__l3_select(open, none, x->v, zero);
    for (i = 0; i < 2 && order >= 1; i++) x->d[i] = psurf__l3_select(open, none, x->d[i], zero);
    for (i = 0; i < 3 && order >= 2; i++) x->dd[i] = psurf__l3_select(open, none, x->dd[i], zero);
}

/* Sum of the weights w_e, and of w_e times what P_e is above the flat triangle. */
static PSURF__INLINE void PSURF__K(sum_edges)(const PSURF__K(smoothed) *p, const psurf__lanes t[3],
                                              int order, PSURF__K(lift) *sum)
{
    const psurf__lanes t01 = psurf__l_mul(t[0], t[1]), zero = psurf__l_all(0);
    const psurf__lanes t12 = psurf__l_mul(t[1], t[2]), t20 = psurf__l_mul(t[2], t[0]);
    const psurf__lanes r = PSURF__K(inverse)(psurf__l_add(psurf__l_add(t01, t12), t20));
    const psurf__lanes bl = psurf__l_mul(psurf__l_all(27), psurf__l_mul(t01, t[2]));
    uint32_t e;
    PSURF__K(clear_lift)(order, sum);
    for (e = 0; e < 3; e++) {
        const psurf__lanes open = PSURF__K(openness)(psurf__l_add(p->flat[e], bl), p->counts);
        PSURF__K(edge_lift) x;
        PSURF__K(form) w;
        if (!psurf__l_greater(open, zero)) continue;
        if (psurf__l_greater(p->turned[e], zero)) PSURF__K(edge_patch)(p, e, t, 1, order, &x);
        else PSURF__K(edge_patch)(p, e, t, 0, order, &x);
        PSURF__K(keep_open)(open, order, &x);
        PSURF__K(edge_form)(p, e, t, r, bl, open, order, &w);
        PSURF__K(add_lift)(&w, &x, e, order, sum);
    }
}

/* f (1 - w) + sum, where f is the cubic above the flat triangle, which is added: in place. */
static PSURF__INLINE void PSURF__K(finish_lift)(const PSURF__K(smoothed) *p,
                                                const psurf__lanes t[3], int order,
                                                const PSURF__K(lift) *sum, PSURF__K(jet) *f)
{
    const PSURF__K(weight) *w = &sum->w;
    const psurf__l3 *dd = sum->dd, v = f->p;
    const psurf__lanes rest = PSURF__K(rest)(w->v), two = psurf__l_all(2);
    psurf__l3 change[3];
    psurf__lanes u1, v1;
    f->p = psurf__l3_add(psurf__l3_mul(v, rest), sum->v);
    f->p = psurf__l3_add(psurf__l3_mix(t[1], p->corner[1], t[2], p->corner[2]), f->p);
    if (order < 1) return;
    u1 = psurf__l_sub(w->d[0], w->d[1]);                /* of 1 - w */
    v1 = psurf__l_sub(w->d[0], w->d[2]);
    if (order >= 2) {
        change[0] = psurf__l3_mul(psurf__l3_mul(f->du, u1), two);
        change[1] = psurf__l3_mix(u1, f->dv, v1, f->du);
        change[2] = psurf__l3_mul(psurf__l3_mul(f->dv, v1), two);
        f->duu = psurf__l3_add(psurf__l3_mul(f->duu, rest), change[0]);
        f->duv = psurf__l3_add(psurf__l3_mul(f->duv, rest), change[1]);
        f->dvv = psurf__l3_add(psurf__l3_mul(f->dvv, rest), change[2]);
        change[0] = psurf__l3_add(psurf__l3_sub(dd[0], dd[1]), psurf__l3_sub(dd[3], dd[1]));
        change[1] = psurf__l3_add(psurf__l3_sub(dd[0], dd[1]), psurf__l3_sub(dd[4], dd[2]));
        change[2] = psurf__l3_add(psurf__l3_sub(dd[0], dd[2]), psurf__l3_sub(dd[5], dd[2]));
        change[0] = psurf__l3_sub(change[0], psurf__l3_mul(v, PSURF__K(along_uu)(w->dd)));
        change[1] = psurf__l3_sub(change[1], psurf__l3_mul(v, PSURF__K(along_uv)(w->dd)));
        change[2] = psurf__l3_sub(change[2], psurf__l3_mul(v, PSURF__K(along_vv)(w->dd)));
        f->duu = psurf__l3_add(f->duu, change[0]);
        f->duv = psurf__l3_add(f->duv, change[1]);
        f->dvv = psurf__l3_add(f->dvv, change[2]);
    }
    f->du = psurf__l3_add(psurf__l3_mix(rest, f->du, u1, v), psurf__l3_sub(sum->d[1], sum->d[0]));
    f->dv = psurf__l3_add(psurf__l3_mix(rest, f->dv, v1, v), psurf__l3_sub(sum->d[2], sum->d[0]));
    f->du = psurf__l3_add(f->du, p->corner[1]);
    f->dv = psurf__l3_add(f->dv, p->corner[2]);
}

/* An N-patch with derivatives up to an order that is known when this is compiled; p is relative to
   corner 0. Where all edges count as flat it is the cubic N, to the bit. */
static PSURF__INLINE void PSURF__K(npatch)(const PSURF__K(smoothed) *p, const psurf__lanes t[3],
                                           int order, PSURF__K(jet) *jet)
{
    PSURF__K(lift) sum;
    PSURF__K(sum_edges)(p, t, order, &sum);
    PSURF__K(net_jet)(p->bend, t, order, jet);
    PSURF__K(finish_lift)(p, t, order, &sum, jet);
}

/* Points of all lanes, less the first of them, which is returned. */
static psurf__l3 PSURF__K(local_points)(const psurf__batch *b, psurf__l3 *local)
{
    psurf__l3 origin;
    PSURF__K(points)(b->points, psurf__kind_table[b->kind].points, local);
    psurf__l3_put(&origin, local[0]);
    PSURF__K(localise)(b->kind, local, local);
    return origin;
}

static psurf__l3 PSURF__K(open_batch)(const psurf__batch *b, PSURF__K(smoothed) *p)
{
    psurf__l3 local[PSURF__MAX_TRIANGLE];
    const psurf__l3 origin = PSURF__K(local_points)(b, local);
    PSURF__K(open_smoothed)(local, p);
    return origin;
}

static void PSURF__K(npatch_jet)(const psurf__batch *b, const psurf__lanes t[3], int second,
                                 PSURF__K(jet) *jet)
{
    PSURF__K(smoothed) p;
    const psurf__l3 origin = PSURF__K(open_batch)(b, &p);
    if (second) PSURF__K(npatch)(&p, t, 2, jet);
    else PSURF__K(npatch)(&p, t, 1, jet);
    jet->p = psurf__l3_add(jet->p, origin);
}

static void PSURF__K(rational_jet)(const psurf__batch *b, const psurf__lanes t[3], int second,
                                   PSURF__K(jet) *jet)
{
    psurf__l3 local[PSURF__MAX_TRIANGLE];
    const psurf__l3 origin = PSURF__K(local_points)(b, local);
    PSURF__K(triangle_jet)(b->kind, local, t, second, jet);
    jet->p = psurf__l3_add(jet->p, origin);
}

/* a at unit length; zero where nothing is left of it, or NaN. */
static psurf__l3 PSURF__K(unit_or_zero)(psurf__l3 a)
{
    const psurf__lanes q = psurf__l3_dot(a, a), least = psurf__l_all(PSURF__R(1e-12));
    const psurf__l3 n = psurf__l3_mul(a, psurf__l_div(psurf__l_all(1), psurf__l_sqrt(q)));
    return psurf__l3_select(q, least, n, psurf__l3_zero());
}

/* [PN]: shading normals by the six normals of a triangle, quadratic, or the nine of a quad; w as
   jets has it. Zero where they cancel. */
static psurf__l3 PSURF__K(triangle_shade)(const psurf__l3 normals[6], const psurf__lanes t[3])
{
    psurf__l3 sum = psurf__l3_zero();
    psurf__lanes b2[6];
    uint32_t k;
    PSURF__K(triangle_basis)(t, 2, b2);
    for (k = 0; k < 6; k++) sum = psurf__l3_mad(sum, b2[k], normals[k]);
    return PSURF__K(unit_or_zero)(sum);
}

static psurf__l3 PSURF__K(quad_shade)(const psurf__l3 normals[9], const psurf__lanes w[4])
{
    psurf__l3 row[3];
    psurf__lanes u3[4], u2[3], v3[4], v2[3];
    uint32_t j;
    PSURF__K(bernstein)(w[0], w[1], u3, u2);
    PSURF__K(bernstein)(w[2], w[3], v3, v2);
    for (j = 0; j < 3; j++) {
        const psurf__l3 *n = normals + 3 * j;
        row[j] = psurf__l3_mad(psurf__l3_mix(u2[0], n[0], u2[1], n[1]), u2[2], n[2]);
    }
    return PSURF__K(unit_or_zero)(
        psurf__l3_mad(psurf__l3_mix(v2[0], row[0], v2[1], row[1]), v2[2], row[2]));
}

/* Zero where the surface's normal is meant. */
static psurf__l3 PSURF__K(batch_shade)(const psurf__batch *b, const psurf__lanes w[4])
{
    const psurf__kind_row *row = &psurf__kinds[b->kind];
    const psurf_real *p[8];
    psurf__l3 normals[9], shade;
    uint32_t i;
    if (!row->shaded) return psurf__l3_zero();
    for (i = 0; i < 8; i++) p[i] = b->points[i] + 3 * row->control;
    PSURF__K(points)(p, psurf__kind_table[b->kind].points - row->control, normals);
    if (row->weights == 4) return PSURF__K(quad_shade)(normals, w);
    shade = PSURF__K(triangle_shade)(normals, w);
    if (b->kind != PSURF_NPATCH) return shade;
    return psurf__l3_select(normals[8].z, psurf__l_all(PSURF__R(0.5)), psurf__l3_zero(), shade);
}

static void PSURF__K(batch_jet)(const psurf__batch *b, const psurf__lanes w[4], int second,
                                PSURF__K(jet) *jet)
{
    psurf__l3 net[PSURF__MAX_NET], centre;
    if (b->kind == PSURF_NPATCH) {
        PSURF__K(npatch_jet)(b, w, second, jet);
    } else if (psurf__kinds[b->kind].net) {
        PSURF__K(rational_jet)(b, w, second, jet);
    } else if (b->kind == PSURF_BICUBIC || b->kind == PSURF_PN_QUAD) {
        PSURF__K(points)(b->points, 16, net);
        PSURF__K(bicubic_jet)(net, w, second, jet);
    } else if (b->kind == PSURF_POLAR) {
        PSURF__K(points)(b->points, 13, net);
        PSURF__K(polar_jet)(net, w, second, jet);
    } else {
        centre = PSURF__K(spot_net)(b, psurf__kind_sides(b->kind), net);
        PSURF__K(sector_jet)(net, centre, w, second, jet);
    }
}

static void PSURF__K(scatter)(psurf__l3 a, psurf__jet *jets, size_t place)
{
    psurf_real rows[3][8];
    uint32_t i;
    psurf__l3_store(rows, a);
    for (i = 0; i < 8; i++) {
        psurf__v3 *to = (psurf__v3 *)(void *)((char *)&jets[i] + place);
        to->x = rows[0][i];
        to->y = rows[1][i];
        to->z = rows[2][i];
    }
}

/* du x dv at unit length. Returns the lanes (bits) where psurf__unit_cross has to look closer. */
static unsigned PSURF__K(unit_cross)(psurf__l3 du, psurf__l3 dv, psurf__l3 *n)
{
    const psurf_real eps = PSURF__PARALLEL;
    const psurf__l3 cross = psurf__l3_cross(du, dv);
    const psurf__lanes q = psurf__l3_dot(cross, cross);
    const psurf__lanes lengths = psurf__l_mul(psurf__l3_dot(du, du), psurf__l3_dot(dv, dv));
    *n = psurf__l3_mul(cross, psurf__l_div(psurf__l_all(1), psurf__l_sqrt(q)));
    return ~(psurf__l_greater(q, psurf__l_mul(psurf__l_all(eps * eps), lengths)) &
             psurf__l_greater(q, psurf__l_all(PSURF__SHORT)) &
             psurf__l_greater(psurf__l_all(PSURF__LONG), lengths)) & 0xFFu;
}

/* What the surface does at eight spots of one kind of patch; shade is zero where it is the normal.
   Returns the lanes (bits) whose normal is not told by du and dv alone. */
static unsigned PSURF__K(jets)(const psurf__batch *b, int second, psurf__jet jets[8])
{
    psurf_real weights[4][8];
    psurf__lanes w[4];
    psurf__l3 normal;
    PSURF__K(jet) jet;
    unsigned unsure;
    uint32_t i, k;
    for (k = 0; k < 4; k++) {
        for (i = 0; i < 8; i++) weights[k][i] = b->spot[i].w[k];
        w[k] = psurf__l_load(weights[k]);
    }
    jet.duu = jet.duv = jet.dvv = psurf__l3_zero();
    PSURF__K(batch_jet)(b, w, second, &jet);
    jet.shade = PSURF__K(batch_shade)(b, w);
    unsure = PSURF__K(unit_cross)(jet.du, jet.dv, &normal);
    PSURF__K(scatter)(normal, jets, offsetof(psurf__jet, n));
    PSURF__K(scatter)(jet.p, jets, offsetof(psurf__jet, p));
    PSURF__K(scatter)(jet.shade, jets, offsetof(psurf__jet, shade));
    PSURF__K(scatter)(jet.du, jets, offsetof(psurf__jet, du));
    PSURF__K(scatter)(jet.dv, jets, offsetof(psurf__jet, dv));
    if (!second) return unsure;
    PSURF__K(scatter)(jet.duu, jets, offsetof(psurf__jet, duu));
    PSURF__K(scatter)(jet.duv, jets, offsetof(psurf__jet, duv));
    PSURF__K(scatter)(jet.dvv, jets, offsetof(psurf__jet, dvv));
    return unsure;
}

/* How far an N-patch leaves the hull of its ten points. It is a mean of N, which does not, and of
   the P_e, with weights up to g_e (1 - bf). A P_e lies on a PN curve from a point of its edge to
   the opposite corner: on the line between the two, which does not, and away from it by
   s^2 t (d.m) m and s t^2 (d.n) n, together at most s t |d|, a quarter of the way. */
static psurf__lanes PSURF__K(npatch_reach)(const psurf__l3 *stored)
{
    const psurf__kind_row *row = &psurf__kinds[PSURF_NPATCH];
    const psurf__lanes flat[3] = {stored[16].x, stored[16].y, stored[16].z};
    psurf__lanes reach = psurf__l_all(0), far_off, open;
    uint32_t e, k;
    for (e = 0; e < 3; e++) {
        const psurf__l3 corner = stored[row->edge[psurf__preceding(e, 3)][0]];
        far_off = psurf__l_all(0);
        for (k = 0; k < 4; k++) {
            const psurf__l3 d = psurf__l3_sub(stored[row->edge[e][k]], corner);
            far_off = psurf__l_max(far_off, psurf__l3_dot(d, d));
        }
        open = PSURF__K(openness)(flat[e], stored[18].x);
        far_off = psurf__l_mul(psurf__l_sqrt(far_off), psurf__l_all(PSURF__R(0.25)));
        reach = psurf__l_max(reach, psurf__l_mul(far_off, open));
    }
    return reach;
}

/* The box of the points round each lane's spot: of all but normals and the like, or of a sector's
   net. It holds the patch, as every point of it is a sum of them with weights that are not negative
   and sum to 1: Bernstein polynomials; B1 and B2, which share the weight of b111 between the inner
   points, [GB] (10) and (1); and the weights of two points at a time that a key is mixed of.
   N-patches reach beyond it. */
static void PSURF__K(hull)(const psurf__batch *b, psurf_real low[3][8], psurf_real high[3][8])
{
    const uint32_t control = psurf__kinds[b->kind].control, count = control ? control : 15;
    psurf_real p[3][8], reach[8];
    psurf__l3 net[PSURF__MAX_POINTS], origin = psurf__l3_zero();
    uint32_t i, j, k;
    if (control) PSURF__K(points)(b->points, psurf__kind_table[b->kind].points, net);
    else origin = PSURF__K(spot_net)(b, psurf__kind_sides(b->kind), net);
    for (j = 0; j < count; j++) {
        psurf__l3_store(p, psurf__l3_add(net[j], origin));
        for (k = 0; k < 3; k++)
            for (i = 0; i < 8; i++) {
                if (j == 0 || p[k][i] < low[k][i]) low[k][i] = p[k][i];
                if (j == 0 || p[k][i] > high[k][i]) high[k][i] = p[k][i];
            }
    }
    if (b->kind != PSURF_NPATCH) return;
    psurf__l_store(reach, PSURF__K(npatch_reach)(net));
    for (k = 0; k < 3; k++)
        for (i = 0; i < 8; i++) {
            low[k][i] -= reach[i];
            high[k][i] += reach[i];
        }
}

/* ---- lattices: eight patches of one kind, the same samples of each ----

   Samples are made line by line. A line d has one weight in common: d/rate towards the far side of
   a quad or the pole, (rate - n)/rate towards the centre of a Pm-patch; n is its number of steps k
   along the edge. What depends on d alone becomes three polynomials in the distance from the middle
   of the line, positive and negative alike: p that of positions, u and w those of derivatives along
   and across. Two samples at the same distance share their even and odd parts, and an edge gives
   the same bits from either end: reversed, the odd coefficients change their signs, no more. */

/* Eight patches with what their lines have in common. */
typedef struct PSURF__K(facets) {
    psurf__l3 points[PSURF__MAX_POINTS];        /* as they are stored */
    psurf__l3 local[PSURF__MAX_POINTS];         /* relative to the origin */
    psurf__l3 origin;
    psurf__lanes parallel;                      /* normals whose square is not above need a look */
    psurf__l3 edges[2][4], sides[2][4];         /* on the first and last line; where lines end */
    psurf__l3 inner[PSURF__MAX_SECTORS][3];     /* lines from the corners to the centre */
    psurf__l3 rows[5][4], steps[4][4];          /* by power along a line, then across: see below */
    psurf__l3 blends[PSURF__MAX_BLENDS];        /* points that rational weights go with */
    PSURF__K(smoothed) smoothed;                /* of N-patches */
    uint32_t corners[4];                        /* places of the corners' normals; 0: none */
} PSURF__K(facets);

/* A line of theirs. On an edge of the patch p and ends are the edge's. */
typedef struct PSURF__K(line) {
    const PSURF__K(facets) *facets;
    const psurf__l3 *p, *ends[2];               /* ends: where it ends on sides of the patch */
    const psurf__l3 *normals[2];                /* there, where they are corners that have one */
    psurf__l3 inside[5], u[4], w[4], on_sides[2];
} PSURF__K(line);

/* Where du and dv may be parallel: q <= eps^2 |du|^2 |dv|^2. With a bound of the lengths, told by
   how far the points lie apart, most samples need no closer look; see psurf__unit_cross. */
static void PSURF__K(find_parallel)(PSURF__K(facets) *f, uint32_t count)
{
    const psurf_real eps = PSURF__PARALLEL, zero = 0;
    psurf__lanes extent = psurf__l3_dot(f->local[0], f->local[0]);
    psurf_real bound[8];
    uint32_t i;
    for (i = 1; i < count; i++)
        extent = psurf__l_max(extent, psurf__l3_dot(f->local[i], f->local[i]));
    psurf__l_store(bound, extent);
    for (i = 0; i < 8; i++) {                           /* |u| |w| <= 128 times the extent */
        const psurf_real lengths = 16384 * (bound[i] * bound[i]), q = eps * eps * lengths;
        bound[i] = !(lengths < PSURF__LONG) ? 1 / zero : q > PSURF__SHORT ? q : PSURF__SHORT;
    }
    f->parallel = psurf__l_load(bound);
}

/* The Bezier points of a cubic to powers of t - 1/2. Reversed: c[1] and c[3] change their signs. */
static PSURF__INLINE void PSURF__K(centred)(psurf__l3 p0, psurf__l3 p1, psurf__l3 p2, psurf__l3 p3,
                                            psurf__l3 c[4])
{
    const psurf__l3 outer = psurf__l3_add(p0, p3), inner = psurf__l3_add(p1, p2);
    const psurf__l3 across = psurf__l3_sub(p3, p0), middle = psurf__l3_sub(p2, p1);
    const psurf__l3 bend = psurf__l3_add(psurf__l3_sub(p0, p1), psurf__l3_sub(p3, p2));
    c[0] = psurf__l3_mul(psurf__l3_mad(outer, psurf__l_all(3), inner), psurf__l_all(PSURF__EIGHTH));
    c[1] = psurf__l3_mul(psurf__l3_add(across, middle), psurf__l_all(PSURF__R(0.75)));
    c[2] = psurf__l3_mul(bend, psurf__l_all(PSURF__R(1.5)));
    c[3] = psurf__l3_mad(across, psurf__l_all(-3), middle);
}

/* The same of a quadratic, whose points lie so many apart. */
static PSURF__INLINE void PSURF__K(centred_quadratic)(const psurf__l3 *p, uint32_t apart,
                                                      psurf__l3 c[3])
{
    const psurf__l3 outer = psurf__l3_add(p[0], p[2 * apart]);
    c[0] = psurf__l3_mul(psurf__l3_mad(outer, psurf__l_all(2), p[apart]),
                         psurf__l_all(PSURF__R(0.25)));
    c[1] = psurf__l3_sub(p[2 * apart], p[0]);
    c[2] = psurf__l3_sub(outer, psurf__l3_mul(p[apart], psurf__l_all(2)));
}

/* An edge, from points as they are stored. A zero of either sign becomes +0: then none is left
   whose sign could tell the two ends apart. */
static void PSURF__K(edge)(const psurf__l3 *v0, const psurf__l3 *t0, const psurf__l3 *t1,
                           const psurf__l3 *v1, psurf__l3 c[4])
{
    PSURF__K(centred)(*v0, *t0, *t1, *v1, c);
    c[0] = psurf__l3_add(c[0], psurf__l3_zero());
}

/* rows[i][j]: power i along, power j across a line; steps: the derivative across. */
static void PSURF__K(open_bicubic)(PSURF__K(facets) *f)
{
    const psurf__l3 *g = f->local, *a = f->points;
    psurf__l3 along[4][4];
    uint32_t i, j;
    PSURF__K(edge)(a, a + 1, a + 2, a + 3, f->edges[0]);
    PSURF__K(edge)(a + 12, a + 13, a + 14, a + 15, f->edges[1]);
    PSURF__K(edge)(a, a + 4, a + 8, a + 12, f->sides[0]);
    PSURF__K(edge)(a + 3, a + 7, a + 11, a + 15, f->sides[1]);
    for (j = 0; j < 4; j++)
        PSURF__K(centred)(g[4 * j], g[4 * j + 1], g[4 * j + 2], g[4 * j + 3], along[j]);
    for (i = 0; i < 4; i++) {
        PSURF__K(centred)(along[0][i], along[1][i], along[2][i], along[3][i], f->rows[i]);
        psurf__l3_put(&f->steps[i][0], f->rows[i][1]);
        f->steps[i][1] = psurf__l3_mul(f->rows[i][2], psurf__l_all(2));
        f->steps[i][2] = psurf__l3_mul(f->rows[i][3], psurf__l_all(3));
    }
}

/* rows[i][j]: power i along row j of the net; steps: three times the way to the next row. The pole
   is the origin. */
static void PSURF__K(open_polar)(PSURF__K(facets) *f)
{
    const psurf__l3 *h = f->local, *a = f->points;
    const psurf__lanes three = psurf__l_all(3);
    psurf__l3 along[3][4];
    uint32_t i, j;
    PSURF__K(edge)(a, a + 1, a + 2, a + 3, f->edges[0]);
    PSURF__K(edge)(a, a + 4, a + 8, a + 12, f->sides[0]);
    PSURF__K(edge)(a + 3, a + 7, a + 11, a + 12, f->sides[1]);
    for (j = 0; j < 3; j++)
        PSURF__K(centred)(h[4 * j], h[4 * j + 1], h[4 * j + 2], h[4 * j + 3], along[j]);
    for (i = 0; i < 4; i++) {
        for (j = 0; j < 3; j++) f->rows[i][j] = along[j][i];
        f->steps[i][0] = psurf__l3_mul(psurf__l3_sub(along[1][i], along[0][i]), three);
        f->steps[i][1] = psurf__l3_mul(psurf__l3_sub(along[2][i], along[1][i]), three);
        f->steps[i][2] = psurf__l3_mul(psurf__l3_sub(h[12], along[2][i]), three);
    }
    for (i = 1; i < 4; i++)                             /* the pole is a point: of power 0 */
        f->steps[i][2] = psurf__l3_mul(along[2][i], psurf__l_all(-3));
}

/* Row l of a triangular net, from a form in the weights a = g - x, b = g + x to powers of x and g:
   to[i][l] stands with x^i g^(n-l-i). Degree of the row: 4, 3, 2, 1, 0. */
static void PSURF__K(quartic_row)(const psurf__l3 p[5], psurf__l3 to[5][4])
{
    const psurf__lanes two = psurf__l_all(2), four = psurf__l_all(4), six = psurf__l_all(6);
    const psurf__l3 outer = psurf__l3_sub(p[4], p[0]), inner = psurf__l3_sub(p[3], p[1]);
    const psurf__l3 bend = psurf__l3_add(psurf__l3_sub(p[0], p[2]), psurf__l3_sub(p[4], p[2]));
    const psurf__l3 dent = psurf__l3_add(psurf__l3_sub(p[1], p[2]), psurf__l3_sub(p[3], p[2]));
    to[0][0] = psurf__l3_mad(psurf__l3_add(p[0], p[4]), four, psurf__l3_add(p[1], p[3]));
    to[0][0] = psurf__l3_mad(to[0][0], six, p[2]);
    to[1][0] = psurf__l3_mul(psurf__l3_mad(outer, two, inner), four);
    to[2][0] = psurf__l3_mul(bend, six);
    to[3][0] = psurf__l3_mul(psurf__l3_mad(outer, psurf__l_all(-2), inner), four);
    to[4][0] = psurf__l3_mad(bend, psurf__l_all(-4), dent);
}

static void PSURF__K(cubic_row)(const psurf__l3 p[4], uint32_t l, psurf__l3 (*to)[4])
{
    const psurf__lanes three = psurf__l_all(3);
    const psurf__l3 outer = psurf__l3_sub(p[3], p[0]), inner = psurf__l3_sub(p[2], p[1]);
    const psurf__l3 bend = psurf__l3_add(psurf__l3_sub(p[0], p[1]), psurf__l3_sub(p[3], p[2]));
    to[0][l] = psurf__l3_mad(psurf__l3_add(p[0], p[3]), three, psurf__l3_add(p[1], p[2]));
    to[1][l] = psurf__l3_mul(psurf__l3_add(outer, inner), three);
    to[2][l] = psurf__l3_mul(bend, three);
    to[3][l] = psurf__l3_mad(outer, psurf__l_all(-3), inner);
}

static void PSURF__K(quadratic_row)(const psurf__l3 p[3], uint32_t l, psurf__l3 (*to)[4])
{
    const psurf__lanes two = psurf__l_all(2);
    to[0][l] = psurf__l3_mad(psurf__l3_add(p[0], p[2]), two, p[1]);
    to[1][l] = psurf__l3_mul(psurf__l3_sub(p[2], p[0]), two);
    to[2][l] = psurf__l3_add(psurf__l3_sub(p[0], p[1]), psurf__l3_sub(p[2], p[1]));
}

static void PSURF__K(linear_row)(const psurf__l3 p[2], uint32_t l, psurf__l3 (*to)[4])
{
    to[0][l] = psurf__l3_add(p[0], p[1]);
    to[1][l] = psurf__l3_sub(p[1], p[0]);
}

/* The way from row to row of a sector's net, half way between the ends of each step along. */
static PSURF__INLINE psurf__l3 PSURF__K(rise)(const psurf__l3 *net, uint32_t l, uint32_t k)
{
    const psurf__l3 *from = net + psurf__row[l] + k, *to = net + psurf__row[l + 1] + k;
    const psurf__l3 sum = psurf__l3_add(psurf__l3_sub(*to, from[0]), psurf__l3_sub(*to, from[1]));
    return psurf__l3_mul(sum, psurf__l_all(PSURF__R(0.5)));
}

/* rows and steps of a sector: those of its net and of the net's derivative towards the centre. */
static void PSURF__K(open_sector)(PSURF__K(facets) *f, uint32_t m, uint32_t i)
{
    const uint32_t j = psurf__following(i, m);
    const psurf__l3 *stored = f->points + PSURF__SECTOR * i;
    psurf__l3 net[15], step[4];
    uint32_t k;
    PSURF__K(edge)(stored + PSURF__V, stored + PSURF__T0, stored + PSURF__T1,
                   f->points + PSURF__SECTOR * j, f->edges[0]);
    PSURF__K(sector_net)(f->local + PSURF__SECTOR * i, f->local + PSURF__SECTOR * j, f->inner[i],
                         f->inner[j], net);
    PSURF__K(quartic_row)(net, f->rows);
    PSURF__K(cubic_row)(net + psurf__row[1], 1, f->rows);
    PSURF__K(quadratic_row)(net + psurf__row[2], 2, f->rows);
    PSURF__K(linear_row)(net + psurf__row[3], 3, f->rows);
    for (k = 0; k < 4; k++) step[k] = PSURF__K(rise)(net, 0, k);
    PSURF__K(cubic_row)(step, 0, f->steps);
    for (k = 0; k < 3; k++) step[k] = PSURF__K(rise)(net, 1, k);
    PSURF__K(quadratic_row)(step, 1, f->steps);
    for (k = 0; k < 2; k++) step[k] = PSURF__K(rise)(net, 2, k);
    PSURF__K(linear_row)(step, 2, f->steps);
    f->steps[0][3] = PSURF__K(rise)(net, 3, 0);
}

/* The normals of a PN quad in place of its steps: biquadratic, by power along, then across. */
static void PSURF__K(open_shading_quad)(PSURF__K(facets) *f)
{
    const psurf__l3 *n = f->points + 16;
    psurf__l3 along[3][3], across[3];
    uint32_t i, j;
    for (j = 0; j < 3; j++) PSURF__K(centred_quadratic)(n + 3 * j, 1, along[j]);
    for (i = 0; i < 3; i++) {
        PSURF__K(centred_quadratic)(along[0] + i, 3, across);
        for (j = 0; j < 3; j++) psurf__l3_put(&f->steps[i][j], across[j]);
    }
    for (j = 0; j < 3; j++) f->steps[3][j] = psurf__l3_zero();
}

/* Steps of a triangle: a quadratic form, whose six points are the ways from row to row of its
   cubic net, half way between the ends of each step along, three times; or its normals. */
static void PSURF__K(triangle_steps)(const psurf__l3 net[10], psurf__l3 step[6])
{
    static const unsigned char from[6] = {0, 1, 2, 4, 5, 7}, to[6] = {4, 5, 6, 7, 8, 9};
    uint32_t k;
    for (k = 0; k < 6; k++) {
        const psurf__l3 sum = psurf__l3_add(psurf__l3_sub(net[to[k]], net[from[k]]),
                                            psurf__l3_sub(net[to[k]], net[from[k] + 1]));
        step[k] = psurf__l3_mul(sum, psurf__l_all(PSURF__R(1.5)));
    }
}

/* rows and steps of a triangle, as those of a sector: of its cubic net and the net's derivative
   towards corner 2, or of its normals. */
static void PSURF__K(open_triangle)(PSURF__K(facets) *f, const psurf__group *g)
{
    const unsigned char (*e)[4] = psurf__kinds[g->kind].edge;
    const psurf__l3 *a = f->points;
    psurf__l3 net[10], step[6];
    PSURF__K(edge)(a + e[0][0], a + e[0][1], a + e[0][2], a + e[0][3], f->edges[0]);
    PSURF__K(edge)(a + e[2][3], a + e[2][2], a + e[2][1], a + e[2][0], f->sides[0]);
    PSURF__K(edge)(a + e[1][0], a + e[1][1], a + e[1][2], a + e[1][3], f->sides[1]);
    PSURF__K(base_net)(g->kind, f->local, net);
    PSURF__K(blend_points)(g->kind, f->local, f->blends);
    if (g->kind == PSURF_NPATCH) PSURF__K(open_smoothed)(f->local, &f->smoothed);
    PSURF__K(cubic_row)(net, 0, f->rows);
    PSURF__K(quadratic_row)(net + 4, 1, f->rows);
    PSURF__K(linear_row)(net + 7, 2, f->rows);
    psurf__l3_put(&f->rows[0][3], net[9]);
    PSURF__K(triangle_steps)(net, step);
    if (g->normals == PSURF__SHADING) a += 10;
    else a = step;
    PSURF__K(quadratic_row)(a, 0, f->steps);
    PSURF__K(linear_row)(a + 3, 1, f->steps);
    psurf__l3_put(&f->steps[0][2], a[5]);
}

static void PSURF__K(open_facets)(const psurf__group *g, PSURF__K(facets) *f)
{
    const uint32_t count = psurf__kind_table[g->kind].points, m = psurf__kind_sides(g->kind);
    const psurf__kind_row *row = &psurf__kinds[g->kind];
    const uint32_t control = row->sectors > 1 ? count : row->control;
    const int centred = row->sectors > 1 || g->kind == PSURF_POLAR;
    uint32_t i;
    PSURF__K(points)(g->points, count, f->points);
    psurf__l3_put(&f->origin, f->points[centred ? count - 1 : 0]);
    for (i = 0; i < control; i++) f->local[i] = psurf__l3_sub(f->points[i], f->origin);
    for (; i < count; i++) psurf__l3_put(&f->local[i], f->points[i]);
    for (i = 0; i < 4; i++) f->corners[i] = row->normal[i];
    PSURF__K(find_parallel)(f, control);
    if (g->kind == PSURF_BICUBIC || g->kind == PSURF_PN_QUAD) {
        PSURF__K(open_bicubic)(f);
        if (g->normals == PSURF__SHADING) PSURF__K(open_shading_quad)(f);
    } else if (g->kind == PSURF_POLAR) {
        PSURF__K(open_polar)(f);
    } else if (psurf__kinds[g->kind].sectors == 1) {
        PSURF__K(open_triangle)(f, g);
    } else
        for (i = 0; i < m; i++)
            PSURF__K(inner_line)(f->local + PSURF__SECTOR * i,
                                 f->local + PSURF__SECTOR * psurf__preceding(i, m), m,
                                 f->inner[i]);
}

/* A cubic at x from the middle, as samples has it. */
static PSURF__INLINE psurf__l3 PSURF__K(cubic_at)(const psurf__l3 c[4], psurf_real x)
{
    const psurf__lanes xx = psurf__l_all(x * x);
    return psurf__l3_add(psurf__l3_mad(c[0], xx, c[2]),
                         psurf__l3_mul(psurf__l3_mad(c[1], xx, c[3]), psurf__l_all(x)));
}

static PSURF__INLINE psurf__l3 PSURF__K(quadratic_sum)(const psurf_real b[3], const psurf__l3 *p)
{
    return psurf__l3_mad(psurf__l3_mix(psurf__l_all(b[0]), p[0], psurf__l_all(b[1]), p[1]),
                         psurf__l_all(b[2]), p[2]);
}

static PSURF__INLINE psurf__l3 PSURF__K(sum)(const psurf_real *b, const psurf__l3 *p,
                                             uint32_t count)
{
    psurf__l3 sum = psurf__l3_mul(p[0], psurf__l_all(b[0]));
    uint32_t l;
    PSURF__UNROLL
    for (l = 1; l < count; l++) sum = psurf__l3_mad(sum, psurf__l_all(b[l]), p[l]);
    return sum;
}

/* The normals at the ends of a line between corners i and j, where patches store them. */
static PSURF__INLINE void PSURF__K(take_corners)(const PSURF__K(facets) *f, uint32_t i, uint32_t j,
                                                 PSURF__K(line) *line)
{
    line->normals[0] = f->corners[0] ? f->points + f->corners[i] : NULL;
    line->normals[1] = f->corners[0] ? f->points + f->corners[j] : NULL;
}

/* A line inside has points of its own, and ends on sides unless there are none; */
static void PSURF__K(take_inside)(const psurf__l3 (*sides)[4], psurf_real x, PSURF__K(line) *line)
{
    line->p = line->inside;
    line->ends[0] = &line->on_sides[0];
    line->ends[1] = &line->on_sides[1];
    line->normals[0] = line->normals[1] = NULL;
    if (!sides) return;
    line->on_sides[0] = PSURF__K(cubic_at)(sides[0], x);
    line->on_sides[1] = PSURF__K(cubic_at)(sides[1], x);
}

/* one on an edge has the edge's. */
static void PSURF__K(take_edge)(const psurf__l3 edge[4], const psurf__l3 *v0, const psurf__l3 *v1,
                                PSURF__K(line) *line)
{
    line->p = edge;
    line->ends[0] = v0;
    line->ends[1] = v1;
    line->normals[0] = line->normals[1] = NULL;
}

static void PSURF__K(bicubic_line)(const PSURF__K(facets) *f, const psurf__run *r,
                                   PSURF__K(line) *line)
{
    const psurf_real rate = PSURF__R(r->group->rate), x = (2 * PSURF__R(r->d) - rate) / (2 * rate);
    const psurf__lanes at = psurf__l_all(x);
    const psurf__l3 *a = f->points;
    psurf__l3 *p = line->inside;
    uint32_t i;
    for (i = 0; i < 4; i++) {
        const psurf__l3 *row = f->rows[i], *step = f->steps[i];
        p[i] = psurf__l3_mad(row[0], at, psurf__l3_mad(row[1], at,
                                                       psurf__l3_mad(row[2], at, row[3])));
        line->w[i] = psurf__l3_mad(step[0], at, psurf__l3_mad(step[1], at, step[2]));
    }
    psurf__l3_put(&line->u[0], p[1]);
    line->u[1] = psurf__l3_mul(p[2], psurf__l_all(2));
    line->u[2] = psurf__l3_mul(p[3], psurf__l_all(3));
    if (!r->edge) PSURF__K(take_inside)(f->sides, x, line);
    else if (r->d == 0) PSURF__K(take_edge)(f->edges[0], a, a + 3, line);
    else PSURF__K(take_edge)(f->edges[1], a + 12, a + 15, line);
    if (r->edge) PSURF__K(take_corners)(f, r->d ? 3 : 0, r->d ? 2 : 1, line);
}

/* u is divided by 1-v, as in polar_jet. The line at the pole is the pole. */
static void PSURF__K(polar_line)(const PSURF__K(facets) *f, const psurf__run *r,
                                 PSURF__K(line) *line)
{
    const psurf_real rate = PSURF__R(r->group->rate), v1 = PSURF__R(r->d) / rate;
    const psurf_real v0 = (rate - PSURF__R(r->d)) / rate;
    const psurf_real x = (2 * PSURF__R(r->d) - rate) / (2 * rate);
    const psurf_real over[3] = {v0 * v0, 3 * (v0 * v1), 3 * (v1 * v1)};
    const psurf_real square[3] = {v0 * v0, 2 * (v0 * v1), v1 * v1};
    const psurf__l3 *a = f->points;
    psurf__l3 p[4];
    uint32_t i;
    for (i = 0; i < 4; i++) {
        p[i] = PSURF__K(quadratic_sum)(over, f->rows[i]);
        line->inside[i] = psurf__l3_mul(p[i], psurf__l_all(v0));
        line->w[i] = PSURF__K(quadratic_sum)(square, f->steps[i]);
    }
    psurf__l3_put(&line->u[0], p[1]);
    line->u[1] = psurf__l3_mul(p[2], psurf__l_all(2));
    line->u[2] = psurf__l3_mul(p[3], psurf__l_all(3));
    if (!r->edge) PSURF__K(take_inside)(f->sides, x, line);
    else if (r->d == 0) PSURF__K(take_edge)(f->edges[0], a, a + 3, line);
    else PSURF__K(take_edge)(line->inside, a + 12, a + 12, line);
}

/* A line inside the open sector, from rows[i][l] by c^l g^(4-l-i): c the weight of the centre,
   which is the origin, g half of the rest. */
static void PSURF__K(sector_inside)(const PSURF__K(facets) *f, const psurf__run *r,
                                    PSURF__K(line) *line)
{
    const psurf__weights at = psurf__weights_of(r->n, r->group->rate);
    psurf__l3 *p = line->inside;
    uint32_t i;
    p[0] = PSURF__K(sum)(at.p[0], f->rows[0], 4);
    p[1] = PSURF__K(sum)(at.p[1], f->rows[1], 4);
    p[2] = PSURF__K(sum)(at.p[2], f->rows[2], 3);
    p[3] = PSURF__K(sum)(at.p[3], f->rows[3], 2);
    psurf__l3_put(&p[4], f->rows[4][0]);
    line->w[0] = PSURF__K(sum)(at.w[0], f->steps[0], 4);
    line->w[1] = PSURF__K(sum)(at.w[1], f->steps[1], 3);
    line->w[2] = PSURF__K(sum)(at.w[2], f->steps[2], 2);
    psurf__l3_put(&line->w[3], f->steps[3][0]);
    psurf__l3_put(&line->u[0], p[1]);
    for (i = 1; i < 4; i++) line->u[i] = psurf__l3_mul(p[i + 1], psurf__l_all(PSURF__R(i + 1)));
    PSURF__K(take_inside)(NULL, 0, line);
}

/* A line of a triangle, from rows[i][l] by c^l g^(3-l-i), as those of sectors are. */
static void PSURF__K(triangle_line)(const PSURF__K(facets) *f, const psurf__run *r,
                                    PSURF__K(line) *line)
{
    const psurf_real rate = PSURF__R(r->group->rate), x = (2 * PSURF__R(r->d) - rate) / (2 * rate);
    const psurf__weights at = psurf__weights_of(r->n, r->group->rate);
    const unsigned char (*e)[4] = psurf__kinds[r->group->kind].edge;
    const psurf__l3 *a = f->points + e[0][0], *b = f->points + e[0][3], *c = f->points + e[2][0];
    psurf__l3 *p = line->inside;
    p[0] = PSURF__K(sum)(at.w[0], f->rows[0], 4);
    p[1] = PSURF__K(sum)(at.w[1], f->rows[1], 3);
    p[2] = PSURF__K(sum)(at.w[2], f->rows[2], 2);
    psurf__l3_put(&p[3], f->rows[3][0]);
    line->w[0] = PSURF__K(sum)(at.q[0], f->steps[0], 3);
    line->w[1] = PSURF__K(sum)(at.q[1], f->steps[1], 2);
    psurf__l3_put(&line->w[2], f->steps[2][0]);
    line->w[3] = psurf__l3_zero();
    psurf__l3_put(&line->u[0], p[1]);
    line->u[1] = psurf__l3_mul(p[2], psurf__l_all(2));
    line->u[2] = psurf__l3_mul(p[3], psurf__l_all(3));
    if (!r->edge) PSURF__K(take_inside)(f->sides, x, line);
    else if (r->d == 0) PSURF__K(take_edge)(f->edges[0], a, b, line);
    else PSURF__K(take_edge)(line->inside, c, c, line);
    if (r->edge) PSURF__K(take_corners)(f, r->d ? 2 : 0, r->d ? 2 : 1, line);
}

/* The line on the sector's edge, where c is 0 and g is 1/2. */
static void PSURF__K(sector_edge)(const PSURF__K(facets) *f, const psurf__run *r, uint32_t m,
                                  PSURF__K(line) *line)
{
    static const psurf_real power[4] = {PSURF__EIGHTH, PSURF__R(0.25), PSURF__R(0.5), 1};
    const psurf__l3 *v0 = f->points + PSURF__SECTOR * r->sector;
    const psurf__l3 *v1 = f->points + PSURF__SECTOR * psurf__following(r->sector, m);
    uint32_t i;
    for (i = 0; i < 4; i++) {
        const psurf__lanes g = psurf__l_all(power[i]);
        line->u[i] = psurf__l3_mul(psurf__l3_mul(f->rows[i + 1][0], g),
                                   psurf__l_all(PSURF__R(i + 1)));
        line->w[i] = psurf__l3_mul(f->steps[i][0], g);
    }
    PSURF__K(take_edge)(f->edges[0], v0, v1, line);
}

/* Looks closer at the normals of some lanes, bits of unsure. direction: u and w do not count. */
static psurf__l3 PSURF__K(mend)(const psurf__run *r, uint32_t k, int direction, psurf__l3 u,
                                psurf__l3 w, psurf__l3 n, unsigned unsure)
{
    psurf_real us[3][8], ws[3][8], ns[3][8];
    uint32_t i;
    psurf__l3_store(us, u);
    psurf__l3_store(ws, w);
    psurf__l3_store(ns, n);
    for (i = 0; i < 8; i++)                             /* those that repeat the first as well */
        if (unsure >> i & 1) psurf__mend_normal(r, k, i, direction, us, ws, ns);
    n.x = psurf__l_load(ns[0]);
    n.y = psurf__l_load(ns[1]);
    n.z = psurf__l_load(ns[2]);
    return n;
}

/* A polynomial at h before and behind the middle: its even and odd parts, apart and together. */
static PSURF__INLINE void PSURF__K(both_sides)(const psurf__l3 *c, int degree, psurf__lanes h,
                                               psurf__lanes hh, psurf__l3 *before,
                                               psurf__l3 *behind)
{
    const psurf__l3 high = degree == 4 ? psurf__l3_mad(c[2], hh, c[4]) : c[2];
    const psurf__l3 even = psurf__l3_mad(c[0], hh, high);
    const psurf__l3 odd = psurf__l3_mul(degree == 2 ? c[1] : psurf__l3_mad(c[1], hh, c[3]), h);
    *before = psurf__l3_sub(even, odd);
    *behind = psurf__l3_add(even, odd);
}

/* One sample of all lanes to where the cursor points. The normal has the direction of u x w, or of
   w where that is a normal itself. */
static PSURF__INLINE void PSURF__K(write)(const psurf__run *r, const PSURF__K(line) *line,
                                          uint32_t k, psurf__l3 p, psurf__l3 u, psurf__l3 w,
                                          int normals, int direction, psurf__cursor *c)
{
    psurf__lanes q;
    psurf__l3 n;
    unsigned sure;
    if (!normals) {
        psurf__l_write3(p.x, p.y, p.z, c->p, c->p_at);
        psurf__advance(c);
        return;
    }
    n = direction ? w : psurf__l3_cross(u, w);
    q = psurf__l3_dot(n, n);
    sure = psurf__l_greater(q, direction ? psurf__l_all(PSURF__VANISHING) : line->facets->parallel);
    n = psurf__l3_mul(n, psurf__l_div(psurf__l_all(1), psurf__l_sqrt(q)));
    if (!PSURF__LIKELY(sure == 0xFFu)) n = PSURF__K(mend)(r, k, direction, u, w, n, ~sure);
    if (c->interleaved) {
        psurf__l_write6(p.x, p.y, p.z, n.x, n.y, n.z, c->p, c->p_at);
    } else {
        psurf__l_write3(p.x, p.y, p.z, c->p, c->p_at);
        psurf__l_write3(n.x, n.y, n.z, c->n, c->n_at);
    }
    psurf__advance(c);
}

/* The ends of a line that are corners with normals of their own: "at a corner" [GB] has the normal
   that it was given, whatever the patch has around it. */
static void PSURF__K(put_corners)(const psurf__run *r, const PSURF__K(line) *line, psurf__l3 first,
                                  psurf__l3 last, psurf__cursor cursors[2])
{
    const psurf__l3 *n = line->normals[0];
    if (r->begin == 0) PSURF__K(write)(r, line, 0, first, *n, *n, 1, 1, &cursors[0]);
    n = line->normals[1];
    if (r->n < r->end && r->n > 0)
        PSURF__K(write)(r, line, r->n, last, *n, *n, 1, 1, &cursors[1]);
}

static PSURF__INLINE void PSURF__K(fetch_ahead)(psurf__ahead *a)
{
    uint32_t i;
    if (a->at >= a->end) return;
    for (i = 0; i < 8; i++) psurf__l_fetch(a->to[i] + a->at);
    a->at += a->step;
}

/* How far from the middle of a line its samples lie, k0 <= k < k1, and the squares: eight quotients
   at a time, and none between the samples. */
typedef struct PSURF__K(distances) {
    psurf_real h[PSURF__STRETCH], hh[PSURF__STRETCH];
} PSURF__K(distances);

static PSURF__INLINE void PSURF__K(find_distances)(const psurf__run *r, uint32_t k0, uint32_t k1,
                                                   PSURF__K(distances) *to)
{
    static const psurf_real twice[8] = {0, 2, 4, 6, 8, 10, 12, 14};
    const psurf__lanes twice_k = psurf__l_load(twice), span = psurf__l_all(r->span);
    uint32_t i;
    for (i = 0; k0 + i < k1; i += 8) {
        const psurf_real first = PSURF__R(r->n) - PSURF__R(2 * (k0 + i));       /* exact */
        const psurf__lanes x = psurf__l_div(psurf__l_sub(psurf__l_all(first), twice_k), span);
        psurf__l_store(to->h + i, x);
        psurf__l_store(to->hh + i, psurf__l_mul(x, x));
    }
}

/* Samples k and n-k of a line, k0 <= k < k1, as far as they are wanted: forth from its beginning
   and back from its end. quartic: p is, else cubic; edge: p is cubic and without origin. */
static PSURF__INLINE void PSURF__K(samples)(const psurf__run *r, const PSURF__K(line) *line,
                                            const PSURF__K(distances) *x, uint32_t k0, uint32_t k1,
                                            int quartic, int edge, int normals,
                                            psurf__cursor cursors[2])
{
    const psurf__l3 *origin = &line->facets->origin;
    uint32_t k;
    for (k = k0; k < k1; k++) {
        const psurf__lanes h = psurf__l_all(x->h[k - k0]), hh = psurf__l_all(x->hh[k - k0]);
        psurf__l3 first, last, u_first, u_last, w_first, w_last;
        if ((edge || !quartic) && k == 0) {
            psurf__l3_put(&first, *line->ends[0]);
            psurf__l3_put(&last, *line->ends[1]);
        } else {
            PSURF__K(both_sides)(line->p, quartic && !edge ? 4 : 3, h, hh, &first, &last);
            if (!edge) first = psurf__l3_add(*origin, first);
            if (!edge) last = psurf__l3_add(*origin, last);
        }
        PSURF__K(fetch_ahead)(&r->group->ahead[k & 1 ? PSURF__AHEAD_ODD : PSURF__AHEAD_EVEN]);
        u_first = u_last = w_first = w_last = first;
        if (normals) PSURF__K(both_sides)(line->w, 3, h, hh, &w_first, &w_last);
        if (normals == PSURF__SURFACE)
            PSURF__K(both_sides)(line->u, quartic ? 3 : 2, h, hh, &u_first, &u_last);
        if (edge && !quartic && normals && k == 0 && line->normals[0]) {
            PSURF__K(put_corners)(r, line, first, last, cursors);
            continue;
        }
        if (PSURF__LIKELY(k >= r->begin))
            PSURF__K(write)(r, line, k, first, u_first, w_first, normals,
                            normals == PSURF__SHADING, &cursors[0]);
        if (PSURF__LIKELY(r->n - k < r->end && 2 * k != r->n))
            PSURF__K(write)(r, line, r->n - k, last, u_last, w_last, normals,
                            normals == PSURF__SHADING, &cursors[1]);
    }
}

/* Weights of the blends of eight samples of a line: value, and derivatives along and across. */
typedef struct PSURF__K(blended) {
    psurf_real p[PSURF__MAX_BLENDS][8], u[PSURF__MAX_BLENDS][8], w[PSURF__MAX_BLENDS][8];
} PSURF__K(blended);

/* Of samples k .. k+7, as far as the line goes, and of those as far from its end. At the other end
   of a line corners 0 and 1, and what goes with them, change places. */
static void PSURF__K(weigh)(const psurf__run *r, uint32_t k, PSURF__K(blended) *forth,
                            PSURF__K(blended) *back)
{
    const psurf_real rate = PSURF__R(r->group->rate);
    const psurf__net_row *net = psurf__kinds[r->group->kind].net;
    const psurf__lanes half = psurf__l_all(PSURF__R(0.5)), zero = psurf__l_all(0);
    PSURF__K(weight) weight[PSURF__MAX_BLENDS];
    psurf_real at[2][8];
    psurf__lanes t[3];
    uint32_t i;
    for (i = 0; i < 8; i++) {
        at[0][i] = PSURF__R(r->n - k) / rate;
        at[1][i] = PSURF__R(k) / rate;
        k += k < r->n;
    }
    t[0] = psurf__l_load(at[0]);
    t[1] = psurf__l_load(at[1]);
    t[2] = psurf__l_all(PSURF__R(r->d) / rate);
    PSURF__K(blend_weights)(r->group->kind, t, 0, weight);
    for (i = 0; i < net->blends; i++) {
        const psurf__lanes *d = weight[i].d, u = psurf__l_sub(d[1], d[0]);
        const psurf__lanes w = psurf__l_sub(d[2], psurf__l_mul(half, psurf__l_add(d[0], d[1])));
        const uint32_t m = net->mirror[i];
        psurf__l_store(forth->p[i], weight[i].v);
        psurf__l_store(forth->u[i], u);
        psurf__l_store(forth->w[i], w);
        psurf__l_store(back->p[m], weight[i].v);
        psurf__l_store(back->u[m], psurf__l_sub(zero, u));
        psurf__l_store(back->w[m], w);
    }
}

/* A sample in work: point, and derivatives along and across. */
typedef struct PSURF__K(sample) { psurf__l3 p, u, w; } PSURF__K(sample);

/* What the blends add to sample i of those eight, each point read once. */
static PSURF__INLINE void PSURF__K(blend)(const PSURF__K(blended) *weights, uint32_t i,
                                          const psurf__l3 *points, uint32_t blends,
                                          PSURF__K(sample) *s)
{
    psurf__l3 p = s->p, u = s->u, w = s->w;
    uint32_t b;
    PSURF__ROLLED
    for (b = 0; b < blends; b++) {
        const psurf__l3 x = points[b];
        p = psurf__l3_mad(p, psurf__l_all(weights->p[b][i]), x);
        u = psurf__l3_mad(u, psurf__l_all(weights->u[b][i]), x);
        w = psurf__l3_mad(w, psurf__l_all(weights->w[b][i]), x);
    }
    psurf__l3_put(&s->p, p);
    psurf__l3_put(&s->u, u);
    psurf__l3_put(&s->w, w);
}

/* The same of triangles: a cubic, and what is blended into it. They have no shading normals. */
static PSURF__INLINE void PSURF__K(triangle_pairs)(const psurf__run *r, const PSURF__K(line) *line,
                                                   const PSURF__K(distances) *x, uint32_t k0,
                                                   uint32_t k1, uint32_t blends, int normals,
                                                   psurf__cursor cursors[2])
{
    const PSURF__K(facets) *f = line->facets;
    PSURF__K(blended) forth, back;
    PSURF__K(sample) first, last;
    uint32_t k, i = 0;
    for (k = k0; k < k1; k++, i = (i + 1) % 8) {
        const psurf__lanes h = psurf__l_all(x->h[k - k0]), hh = psurf__l_all(x->hh[k - k0]);
        if (i == 0) PSURF__K(weigh)(r, k, &forth, &back);
        PSURF__K(both_sides)(line->p, 3, h, hh, &first.p, &last.p);
        PSURF__K(fetch_ahead)(&r->group->ahead[k & 1 ? PSURF__AHEAD_ODD : PSURF__AHEAD_EVEN]);
        first.u = last.u = first.w = last.w = first.p;
        if (normals) PSURF__K(both_sides)(line->w, 2, h, hh, &first.w, &last.w);
        if (normals) PSURF__K(both_sides)(line->u, 2, h, hh, &first.u, &last.u);
        PSURF__K(blend)(&forth, i, f->blends, blends, &first);
        PSURF__K(blend)(&back, i, f->blends, blends, &last);
        if (k == 0) {
            psurf__l3_put(&first.p, *line->ends[0]);
            psurf__l3_put(&last.p, *line->ends[1]);
        } else if (r->edge) {                           /* nothing is blended in on an edge */
            PSURF__K(both_sides)(line->p, 3, h, hh, &first.p, &last.p);
        } else {
            first.p = psurf__l3_add(f->origin, first.p);
            last.p = psurf__l3_add(f->origin, last.p);
        }
        if (normals && k == 0 && line->normals[0]) {
            PSURF__K(put_corners)(r, line, first.p, last.p, cursors);
            continue;
        }
        PSURF__K(write)(r, line, k, first.p, first.u, first.w, normals, 0, &cursors[0]);
        if (2 * k != r->n)
            PSURF__K(write)(r, line, r->n - k, last.p, last.u, last.w, normals, 0, &cursors[1]);
    }
}

static void PSURF__K(triangle_samples)(const psurf__run *r, const PSURF__K(line) *line,
                                       const PSURF__K(distances) *x, uint32_t k0, uint32_t k1,
                                       psurf__cursor cursors[2])
{
    const uint32_t blends = psurf__blend_count(r->group->kind);
    if (r->group->normals) PSURF__K(triangle_pairs)(r, line, x, k0, k1, blends, 1, cursors);
    else PSURF__K(triangle_pairs)(r, line, x, k0, k1, blends, 0, cursors);
}

/* The same of smoothed N-patches, whose blended normals are made unit length: sample by sample.
   exactly: some lane shades with the normal of its surface. */
static PSURF__INLINE void PSURF__K(npatch_pairs)(const psurf__run *r, const PSURF__K(line) *line,
                                                 const PSURF__K(distances) *x, uint32_t k0,
                                                 uint32_t k1, int order, int exactly,
                                                 psurf__cursor cursors[2])
{
    const PSURF__K(facets) *f = line->facets;
    const psurf__lanes half = psurf__l_all(PSURF__R(0.5)), exact = f->local[18].z;
    const psurf_real rate = PSURF__R(r->group->rate);
    const int normals = r->group->normals != PSURF__NO_NORMALS, corners = line->normals[0] != NULL;
    const int shading = r->group->normals == PSURF__SHADING;
    uint32_t k, side;
    for (k = k0; k < k1; k++) {
        const psurf__lanes h = psurf__l_all(x->h[k - k0]), hh = psurf__l_all(x->hh[k - k0]);
        psurf__l3 p[2], w[2];
        PSURF__K(fetch_ahead)(&r->group->ahead[k & 1 ? PSURF__AHEAD_ODD : PSURF__AHEAD_EVEN]);
        PSURF__K(both_sides)(line->p, 3, h, hh, &p[0], &p[1]);
        PSURF__K(both_sides)(line->w, 2, h, hh, &w[0], &w[1]);
        for (side = 0; side < 2; side++) {
            const uint32_t at = side ? r->n - k : k;
            PSURF__K(jet) jet;
            psurf__lanes t[3];
            if (side && 2 * k == r->n) continue;
            t[0] = psurf__l_all(PSURF__R(r->n - at) / rate);
            t[1] = psurf__l_all(PSURF__R(at) / rate);
            t[2] = psurf__l_all(PSURF__R(r->d) / rate);
            PSURF__K(npatch)(&f->smoothed, t, order, &jet);
            if (k == 0) psurf__l3_put(&p[side], *line->ends[side]);
            else if (!r->edge) p[side] = psurf__l3_add(f->origin, jet.p);
            if (order == 0) jet.du = jet.dv = w[side];
            else if (shading && exactly)
                jet.dv = psurf__l3_select(exact, half, psurf__l3_cross(jet.du, jet.dv), w[side]);
            if (k == 0 && corners) jet.dv = *line->normals[side];
            PSURF__K(write)(r, line, at, p[side], jet.du, jet.dv, normals,
                            shading || (k == 0 && corners), &cursors[side]);
        }
    }
}

static void PSURF__K(npatch_samples)(const psurf__run *r, const PSURF__K(line) *line,
                                     const PSURF__K(distances) *x, uint32_t k0, uint32_t k1,
                                     psurf__cursor cursors[2])
{
    const psurf__lanes half = psurf__l_all(PSURF__R(0.5));
    const int exactly = psurf__l_greater(line->facets->local[18].z, half) != 0;
    if (r->group->normals == PSURF__SURFACE || (r->group->normals == PSURF__SHADING && exactly))
        PSURF__K(npatch_pairs)(r, line, x, k0, k1, 1, exactly, cursors);
    else PSURF__K(npatch_pairs)(r, line, x, k0, k1, 0, 0, cursors);
}

static void PSURF__K(any_samples)(const psurf__run *r, const PSURF__K(line) *line, uint32_t k0,
                                  uint32_t k1, psurf__cursor cursors[2])
{
    const psurf_kind kind = r->group->kind;
    const int blended = psurf__kinds[kind].net && psurf__blend_count(kind) > 0;
    const int which = kind == PSURF_NPATCH ? 12 : blended ? 13
                    : (r->tensor ? 0 : 6) + (r->edge ? 3 : 0) + (int)r->group->normals;
    PSURF__K(distances) x;
    uint32_t k;
    for (; k0 < k1; k0 = k) {
        k = k1 - k0 > PSURF__STRETCH ? k0 + PSURF__STRETCH : k1;
        PSURF__K(find_distances)(r, k0, k, &x);
        switch (which) {
        case 0: PSURF__K(samples)(r, line, &x, k0, k, 0, 0, PSURF__NO_NORMALS, cursors); break;
        case 1: PSURF__K(samples)(r, line, &x, k0, k, 0, 0, PSURF__SURFACE, cursors); break;
        case 2: PSURF__K(samples)(r, line, &x, k0, k, 0, 0, PSURF__SHADING, cursors); break;
        case 3: PSURF__K(samples)(r, line, &x, k0, k, 0, 1, PSURF__NO_NORMALS, cursors); break;
        case 4: PSURF__K(samples)(r, line, &x, k0, k, 0, 1, PSURF__SURFACE, cursors); break;
        case 5: PSURF__K(samples)(r, line, &x, k0, k, 0, 1, PSURF__SHADING, cursors); break;
        case 6: PSURF__K(samples)(r, line, &x, k0, k, 1, 0, PSURF__NO_NORMALS, cursors); break;
        case 7: PSURF__K(samples)(r, line, &x, k0, k, 1, 0, PSURF__SURFACE, cursors); break;
        case 12: PSURF__K(npatch_samples)(r, line, &x, k0, k, cursors); break;
        case 13: PSURF__K(triangle_samples)(r, line, &x, k0, k, cursors); break;
        case 9: PSURF__K(samples)(r, line, &x, k0, k, 1, 1, PSURF__NO_NORMALS, cursors); break;
        default: PSURF__K(samples)(r, line, &x, k0, k, 1, 1, PSURF__SURFACE, cursors); break;
        }
    }
}

/* Samples that have places of their own: a few pairs at a time, lane by lane. */
static void PSURF__K(put_apart)(const psurf__run *r, const PSURF__K(line) *line, uint32_t k0,
                                uint32_t k1)
{
    psurf__held held;
    psurf__cursor cursors[2];
    uint32_t i, k, last, forth, back;
    for (; k0 < k1; k0 = last) {
        last = k1 - k0 > PSURF__HELD ? k0 + PSURF__HELD : k1;
        psurf__hold_cursors(&held, r->group->normals != PSURF__NO_NORMALS, cursors);
        PSURF__K(any_samples)(r, line, k0, last, cursors);
        for (i = 0; i < r->group->count; i++) {
            for (k = k0, forth = back = 0; k < last; k++) {
                if (k >= r->begin) r->group->put(r, i, k, held.sample[0][forth++][i]);
                if (r->n - k < r->end && 2 * k != r->n)
                    r->group->put(r, i, r->n - k, held.sample[1][back++][i]);
            }
        }
    }
}

/* Asks for the memory that a cursor is going to write: half of a line's samples come from its end,
   which no processor foresees. */
static void PSURF__K(fetch)(psurf_real *const p[8], ptrdiff_t at, ptrdiff_t step, ptrdiff_t bend,
                            uint32_t count)
{
    const ptrdiff_t width = step < 0 ? -step : step;
    const uint32_t jump = bend == 0 && width > 0 && width < 16 ? (uint32_t)(16 / width) : 1;
    uint32_t i, k;
    if (count > 64) count = 64;                         /* the rest is long enough to be foreseen */
    for (k = 0; k < count && step != 0; k += jump) {
        for (i = 0; i < 8; i++) psurf__l_fetch(p[i] + at);
        at += step * (ptrdiff_t)jump;
        step += bend;
    }
}

/* All samples of a line that are wanted, to their places. */
static void PSURF__K(put_line)(const psurf__run *r, const PSURF__K(line) *line)
{
    const psurf__apart apart = r->group->apart;
    const uint32_t pairs = r->group->border_only && !r->edge ? 1 : r->n / 2 + 1;
    const int all = apart == PSURF__ALL_APART || (apart == PSURF__BORDER_APART && r->edge);
    const uint32_t k0 = all ? pairs : apart == PSURF__BORDER_APART && r->tensor ? 1 : 0;
    const uint32_t first = k0 >= r->begin ? k0 : r->begin;
    const uint32_t last = r->n - k0 < r->end ? r->n - k0 : r->end - 1;
    psurf__cursor cursors[2];
    if (k0 > 0) PSURF__K(put_apart)(r, line, 0, k0);
    PSURF__K(fetch_ahead)(&r->group->ahead[PSURF__AHEAD_PATCHES]);
    if (k0 >= pairs) return;
    r->group->aim(r, first, last, cursors);
    if (!r->group->fetched)
        PSURF__K(fetch)(cursors->p, cursors->p_at, cursors->p_step, cursors->p_bend,
                        last + 1 - first);
    if (!r->group->fetched && !cursors->interleaved)
        PSURF__K(fetch)(cursors->n, cursors->n_at, cursors->n_step, cursors->n_bend,
                        last + 1 - first);
    PSURF__K(any_samples)(r, line, k0, pairs, cursors);
}

static void PSURF__K(put_tensor_line)(const PSURF__K(facets) *f, psurf__run *r)
{
    const uint32_t rate = r->group->rate;
    const int polar = r->group->kind == PSURF_POLAR;
    const int three = psurf__kind_sides(r->group->kind) == 3;
    PSURF__K(line) line;
    r->n = three ? rate - r->d : rate;
    r->span = PSURF__R(three && !polar ? 2 * rate : r->n ? 2 * r->n : 1);
    r->edge = r->d == 0 || r->d == rate;
    r->begin = 0;
    r->end = r->n + 1;
    line.facets = f;
    if (polar) PSURF__K(polar_line)(f, r, &line);
    else if (three) PSURF__K(triangle_line)(f, r, &line);
    else PSURF__K(bicubic_line)(f, r, &line);
    PSURF__K(put_line)(r, &line);
}

/* Triangles and quads give what two sectors share to the lower one, faces of five corners to that
   which begins there; the centre belongs to the first. */
static void PSURF__K(put_sector_line)(const PSURF__K(facets) *f, psurf__run *r, uint32_t m)
{
    const uint32_t rate = r->group->rate;
    PSURF__K(line) line;
    r->n = rate - psurf__line_step(m) * r->d;
    r->span = PSURF__R(2 * rate);
    r->edge = r->d == 0;
    r->begin = m < 5 && r->sector > 0;
    r->end = m < 5 ? r->n + (r->sector + 1 < m) : r->n > 0 ? r->n : r->sector == 0;
    if (r->begin >= r->end) return;
    line.facets = f;
    if (r->edge) PSURF__K(sector_edge)(f, r, m, &line);
    else PSURF__K(sector_inside)(f, r, &line);
    PSURF__K(put_line)(r, &line);
}

/* All samples of eight facets, or those on their borders. */
static void PSURF__K(lattice)(const psurf__group *g)
{
    const uint32_t m = psurf__kind_sides(g->kind), step = psurf__line_step(m);
    PSURF__K(facets) f;
    psurf__run r;
    r.group = g;
    r.sector = 0;
    r.tensor = psurf__kinds[g->kind].sectors == 1;
    PSURF__K(open_facets)(g, &f);
    for (r.d = 0; r.tensor && r.d <= g->rate; r.d++) PSURF__K(put_tensor_line)(&f, &r);
    for (; !r.tensor && r.sector < m; r.sector++) {
        PSURF__K(open_sector)(&f, m, r.sector);
        for (r.d = 0; step * r.d <= (g->border_only ? 0 : g->rate); r.d++)
            PSURF__K(put_sector_line)(&f, &r, m);
    }
}

/* ---- what an instruction set has to offer ---- */

static const psurf__kernels PSURF__K(kernels) = {
    PSURF__NAME_OF(PSURF__SET), PSURF__K(jets), PSURF__K(hull), PSURF__K(lattice)
};

#ifdef PSURF__ONCE
static const psurf__kernels *psurf__base_kernels(void) { return &PSURF__K(kernels); }
#else                                   /* the end of the second reading */
#if defined(__clang__)
#pragma clang attribute pop
#elif defined(__GNUC__)
#pragma GCC pop_options
#endif
#endif
#undef PSURF__SET_AVX2
#undef PSURF__SET_SSE2
#undef PSURF__SET_NEON

#endif /* PSURF__IMPLEMENTING */

/* Not with clang in MSVC's place, which hides AVX2, nor MinGW's gcc, whose stack it would need
   aligned (gcc bug 54412). */
#if defined(PSURF__ONCE) && defined(PSURF__SIMD_X86) && !defined(PSURF_NO_AVX2) && \
    !defined(__AVX2__) && !(defined(_MSC_VER) && defined(__clang__)) && \
    !(defined(__MINGW32__) && !defined(__clang__))
#undef PSURF__ONCE
#undef PSURF__SET
#include PSURF__SELF                    /* this chapter once more, for AVX2 */
#define PSURF__ONCE
#define PSURF__DISPATCH
#endif

#ifdef PSURF__ONCE

#ifdef PSURF__DISPATCH
static int psurf__has_avx2(void)
{
#if defined(_MSC_VER)
    int leaf[4];
    __cpuid(leaf, 0);
    if (leaf[0] < 7) return 0;
    __cpuid(leaf, 1);
    if ((leaf[2] & 0x18000000) != 0x18000000 || (_xgetbv(0) & 6) != 6) return 0;
    __cpuidex(leaf, 7, 0);
    return leaf[1] >> 5 & 1;
#else
    return __builtin_cpu_supports("avx2") != 0;
#endif
}
#endif

/* The fastest kernels of this processor. */
static const psurf__kernels *psurf__best_kernels(void)
{
#ifdef PSURF__DISPATCH
    if (psurf__has_avx2()) return &psurf__kernels_avx2;
#endif
    return psurf__base_kernels();
}

/* >>8 POINTS ==================================================================================
   Samples at arbitrary places: sorted by kind of patch, eight at a time through the kernels. */

/* The cubic that every facet boundary is, eq. 17, by powers of the distance x from its middle.
   Swapping its ends changes the signs of x and of the odd coefficients, no more, so both sides get
   the same bits; an end is returned as it is. The order is that of chapter 7: edge, cubic_at. */
static psurf__v3 psurf__edge_point(psurf__v3 v0, psurf__v3 t0, psurf__v3 t1, psurf__v3 v1,
                                   psurf_real x)
{
    const psurf_real xx = x * x;
    const psurf__v3 across = psurf__sub(v1, v0), middle = psurf__sub(t1, t0);
    const psurf__v3 bend = psurf__add(psurf__sub(v0, t0), psurf__sub(v1, t1));
    psurf__v3 c[4];
    if (x <= PSURF__R(-0.5)) return v0;
    if (x >= PSURF__R(0.5)) return v1;
    c[0] = psurf__mul(psurf__mad(psurf__add(v0, v1), 3, psurf__add(t0, t1)), PSURF__EIGHTH);
    c[0] = psurf__add(c[0], psurf__zero());             /* -0 becomes 0 */
    c[1] = psurf__mul(psurf__add(across, middle), PSURF__R(0.75));
    c[2] = psurf__mul(bend, PSURF__R(1.5));
    c[3] = psurf__mad(across, -3, middle);
    return psurf__add(psurf__mad(c[0], xx, c[2]), psurf__mul(psurf__mad(c[1], xx, c[3]), x));
}

/* A facet ready to be evaluated. */
typedef struct psurf__view {
    psurf_kind kind;
    const psurf__kind_row *row;
    const psurf_real *points;
    uint32_t turn;
} psurf__view;

static psurf__view psurf__view_facet(const psurf_patches *p, uint32_t facet)
{
    const psurf_kind filed = psurf__facet_kind(p->topology, facet);
    psurf__view view;
    view.kind = psurf__patch_kind(p, filed);
    view.row = &psurf__kinds[view.kind];
    view.points = psurf__patch_points(p, filed, facet);
    view.turn = psurf__turn(p->topology, facet);
    return view;
}

/* Moves a spot a little towards the middle of its domain. */
static void psurf__move_inside(psurf_kind kind, psurf__spot *spot)
{
    const uint32_t count = psurf__kinds[kind].weights;
    const psurf_real middle = count == 4 ? PSURF__R(0.5) : PSURF__R(1.0 / 3.0);
    uint32_t k;
    for (k = 0; k < count; k++)
        spot->w[k] = spot->w[k] + PSURF__R(1.0 / 1024.0) * (middle - spot->w[k]);
}

/* A batch of one spot. */
static void psurf__lone_batch(psurf__batch *b, psurf_kind kind, const psurf_real *points,
                              const psurf__spot *spot)
{
    uint32_t i;
    b->kind = kind;
    b->count = 1;
    for (i = 0; i < 8; i++) {
        b->points[i] = points;
        b->spot[i] = *spot;
    }
}

/* First derivatives at a spot. */
static void psurf__slopes(psurf_kind kind, const psurf_real *points, const psurf__spot *spot,
                          psurf__v3 *du, psurf__v3 *dv)
{
    psurf__jet jets[8];
    psurf__batch batch;
    psurf__lone_batch(&batch, kind, points, spot);
    psurf__best_kernels()->jets(&batch, 0, jets);
    *du = jets[0].du;
    *dv = jets[0].dv;
}

/* The unit normal. Where du and dv are parallel, as on a crease of blend ratio 0, it is the
   one-sided normal a little inside; 0 if there is none either. */
static psurf__v3 psurf__normal(psurf_kind kind, const psurf_real *points, const psurf__spot *spot,
                               psurf__v3 du, psurf__v3 dv)
{
    psurf__v3 n = psurf__unit_cross(du, dv);
    psurf__spot inside = *spot;
    if (psurf__dot(n, n) > 0) return n;
    psurf__move_inside(kind, &inside);
    psurf__slopes(kind, points, &inside, &du, &dv);
    return psurf__unit_cross(du, dv);
}

/* direction: the normal that was to be written vanishes; that of the surface takes its place. */
static void psurf__mend_normal(const psurf__run *run, uint32_t k, uint32_t lane, int direction,
                               psurf_real (*u)[8], psurf_real (*w)[8], psurf_real (*n)[8])
{
    const psurf__group *g = run->group;
    const psurf_real rate = PSURF__R(g->rate), steps = PSURF__R(run->n);
    psurf__v3 du, dv, normal;
    psurf__spot spot;
    du.x = u[0][lane];
    du.y = u[1][lane];
    du.z = u[2][lane];
    dv.x = w[0][lane];
    dv.y = w[1][lane];
    dv.z = w[2][lane];
    spot.sector = run->sector;
    spot.edge = PSURF_NONE;
    spot.x = 0;
    if (psurf__kinds[g->kind].weights == 4) {
        spot.w[0] = run->n ? (steps - PSURF__R(k)) / steps : PSURF__R(0.5);
        spot.w[1] = run->n ? PSURF__R(k) / steps : PSURF__R(0.5);
        spot.w[2] = (rate - PSURF__R(run->d)) / rate;
        spot.w[3] = PSURF__R(run->d) / rate;
    } else {
        spot.w[0] = (steps - PSURF__R(k)) / rate;
        spot.w[1] = PSURF__R(k) / rate;
        spot.w[2] = (rate - steps) / rate;
        spot.w[3] = 0;
    }
    if (direction) psurf__slopes(g->kind, g->points[lane], &spot, &du, &dv);
    normal = psurf__normal(g->kind, g->points[lane], &spot, du, dv);
    n[0][lane] = normal.x;
    n[1][lane] = normal.y;
    n[2][lane] = normal.z;
}

/* ---- samples ---- */

static psurf_real psurf__clamp(psurf_real x)
{
    if (!(x > 0)) return 0;                             /* NaN too */
    return x < 1 ? x : PSURF__R(1);
}

/* A place on a face: weights w over the denominator d, as chapter 6 takes them. */
typedef struct psurf__place {
    uint32_t face, size, sector;
    uint32_t shape;                     /* what w are: of a triangle 3, a square 4, a sector 5 */
    psurf_real w[4], d;
} psurf__place;

/* What the parameters of a sector of a face are: pieces of faces that are split from an apex, of
   five corners or more, have those of a triangle or a square. */
static uint32_t psurf__shape_of(const psurf_topology *t, uint32_t size, uint32_t sector)
{
    if (size < 5) return size;
    return t->split == PSURF_SPLIT_PM ? 5 : psurf__piece_size(t->split, size, sector);
}

static uint32_t psurf__sectors_of(const psurf_topology *t, uint32_t size)
{
    return size < 5 ? 1 : psurf__piece_count(t->split, size);
}

/* The place of a sample of any bytes. */
static psurf__place psurf__find_place(const psurf_topology *t, const psurf_sample *sample)
{
    psurf__place place;
    psurf_real u = psurf__clamp(sample->u), v = psurf__clamp(sample->v), rest;
    uint32_t sectors;
    place.d = 1;
    place.face = sample->face < t->info.faces ? sample->face : t->info.faces - 1;
    place.size = psurf__face_size(t, place.face);
    sectors = psurf__sectors_of(t, place.size);
    place.sector = place.size < 5 ? 0 : sample->sector < sectors ? sample->sector : sectors - 1;
    place.shape = psurf__shape_of(t, place.size, place.sector);
    place.w[3] = v;
    if (place.shape == 4) {
        place.w[0] = 1 - u;
        place.w[1] = u;
        place.w[2] = 1 - v;
        return place;
    }
    rest = 1 - u - v;
    if (rest < 0) {                                     /* beyond the third side: back onto it */
        psurf_real sum = u + v;
        u = u / sum;
        v = 1 - u;
        rest = 0;
    }
    place.w[0] = place.shape == 3 ? rest : u;
    place.w[1] = place.shape == 3 ? u : v;
    place.w[2] = place.shape == 3 ? v : rest;
    return place;
}

/* The row that cuts a split face into its pieces, and how it is turned: that of P3, P4, P5 for pm.
   NULL where parameters are those of the pieces. */
static const psurf__kind_row *psurf__split_row(const psurf_topology *t, uint32_t face,
                                               uint32_t size, uint32_t *turn)
{
    *turn = 0;
    if (!psurf__is_split(t, face)) return NULL;
    if (t->split == PSURF_SPLIT_PM) return &psurf__kinds[PSURF_P3 + (size < 5 ? size : 5) - 3];
    *turn = psurf__face_apex(t, face);
    return size == 4 ? &psurf__halves : NULL;
}

/* Places become batches in blocks of this many. */
#define PSURF__BLOCK 32u

/* A place on its facet. Of a split face it lies on a piece: outer keeps where. */
typedef struct psurf__target {
    psurf__view view;
    const psurf__kind_row *outer_row;   /* that cut the face, or NULL */
    uint32_t outer_turn;
    psurf__spot spot, outer;
} psurf__target;

static void psurf__find_target(const psurf_patches *p, psurf__place place, psurf__target *target)
{
    const psurf_topology *t = p->topology;
    uint32_t piece = psurf__shape_of(t, place.size, 0) == 5 ? 0 : place.sector, k;
    target->outer_row = psurf__split_row(t, place.face, place.size, &target->outer_turn);
    if (target->outer_row) {
        target->outer_row->locate(target->outer_turn, place.sector, place.w, 1, &target->outer);
        piece = target->outer.sector;
        place.sector = 0;
        for (k = 0; k < 3; k++) place.w[k] = target->outer.w[k];
    }
    target->view = psurf__view_facet(p, psurf__piece_facet(t, place.face, place.size, piece));
    target->view.row->locate(target->view.turn, place.sector, place.w, place.d, &target->spot);
}

/* The corner with a stored normal that a spot lies at, or PSURF_NONE. */
static uint32_t psurf__spot_corner(const psurf__kind_row *row, const psurf_real *w)
{
    static const unsigned char both[4][2] = {{0, 2}, {1, 2}, {1, 3}, {0, 3}};   /* of a square */
    const psurf_real most = PSURF__R(1 - 1e-6);
    uint32_t k;
    for (k = 0; row->normal[0] && k < row->weights; k++) {
        const uint32_t i = row->weights == 3 ? k : both[k][0];
        const uint32_t j = row->weights == 3 ? k : both[k][1];
        if (w[i] >= most && w[j] >= most) return k;
    }
    return PSURF_NONE;
}

/* At a corner all point-normal patches have the normal they were given, and no curvature: the
   rational ones tend to the one, but not to the other. */
static void psurf__meet_corner(const psurf__target *t, psurf__jet *jet)
{
    const uint32_t k = psurf__spot_corner(t->view.row, t->spot.w);
    psurf__v3 n;
    if (k == PSURF_NONE) return;
    n = psurf__get(t->view.points + 3 * t->view.row->normal[k]);
    if (psurf__dot(n, n) > 0) jet->n = n;
    jet->curved = 0;
    jet->duu = jet->duv = jet->dvv = psurf__zero();
}

/* From the patch to the face: on an edge the position is that of the edge; derivatives are with
   respect to the face's parameters. */
static void psurf__finish_jet(const psurf__target *t, int second, psurf__jet *jet)
{
    jet->curved = 1;
    if (t->spot.edge != PSURF_NONE) {
        const unsigned char *e = t->view.row->edge[t->spot.edge];
        const psurf_real *c = t->view.points;
        jet->p = psurf__edge_point(psurf__get(c + 3 * e[0]), psurf__get(c + 3 * e[1]),
                                   psurf__get(c + 3 * e[2]), psurf__get(c + 3 * e[3]), t->spot.x);
    }
    if (!second) jet->duu = jet->duv = jet->dvv = psurf__zero();
    psurf__meet_corner(t, jet);
    if (!(psurf__dot(jet->shade, jet->shade) > 0)) jet->shade = jet->n;
    t->view.row->pull(&t->spot, t->view.turn, jet);
    if (t->outer_row) t->outer_row->pull(&t->outer, t->outer_turn, jet);
}

/* Evaluates up to PSURF__BLOCK places; all lanes of a batch have one kind of patch. */
static void psurf__eval_places(const psurf_patches *p, const psurf__place *places, uint32_t count,
                               int second, psurf__jet *jets)
{
    const psurf__kernels *kernels = psurf__best_kernels();
    psurf__target targets[PSURF__BLOCK];
    psurf__batch batch;
    psurf__jet out[8];
    uint32_t i, j, kind, index[8];
    for (i = 0; i < count; i++) psurf__find_target(p, places[i], &targets[i]);
    for (kind = 0; kind < PSURF_KIND_COUNT; kind++)
        for (i = 0, batch.count = 0; i <= count; i++) {
            unsigned unsure;
            if (i < count && targets[i].view.kind == (psurf_kind)kind) {
                if (batch.count == 0)
                    psurf__lone_batch(&batch, (psurf_kind)kind, targets[i].view.points,
                                      &targets[i].spot);
                else batch.count++;
                batch.points[batch.count - 1] = targets[i].view.points;
                batch.spot[batch.count - 1] = targets[i].spot;
                index[batch.count - 1] = i;
            }
            if (batch.count == 0 || (batch.count < 8 && i < count)) continue;
            unsure = kernels->jets(&batch, second, out);
            for (j = 0; j < batch.count; j++) {
                const psurf__target *target = &targets[index[j]];
                psurf__jet *jet = &jets[index[j]];
                *jet = out[j];
                if (unsure >> j & 1)
                    jet->n = psurf__normal(target->view.kind, target->view.points, &target->spot,
                                           jet->du, jet->dv);
                psurf__finish_jet(target, second, jet);
            }
            batch.count = 0;
        }
}

/* The same of samples. */
static void psurf__eval_block(const psurf_patches *p, const psurf_sample *samples, uint32_t count,
                              int second, psurf__jet *jets)
{
    psurf__place places[PSURF__BLOCK];
    uint32_t i;
    for (i = 0; i < count; i++) places[i] = psurf__find_place(p->topology, &samples[i]);
    psurf__eval_places(p, places, count, second, jets);
}

static void psurf__put_at(psurf_real *array, size_t stride, size_t index, psurf__v3 a)
{
    if (array) psurf__put(array + index * stride, a);
}

/* A byte stride in reals; 0 = tight. */
static size_t psurf__stride(size_t bytes, size_t tight)
{
    return bytes ? bytes / sizeof(psurf_real) : tight;
}

static void psurf__put_jet(const psurf_points *out, size_t stride, size_t i, const psurf__jet *jet)
{
    psurf__put_at(out->p, stride, i, jet->p);
    psurf__put_at(out->n, stride, i, jet->n);
    psurf__put_at(out->shade, stride, i, jet->shade);
    psurf__put_at(out->du, stride, i, jet->du);
    psurf__put_at(out->dv, stride, i, jet->dv);
    psurf__put_at(out->duu, stride, i, jet->duu);
    psurf__put_at(out->duv, stride, i, jet->duv);
    psurf__put_at(out->dvv, stride, i, jet->dvv);
}

PSURF_API void psurf_eval(const psurf_patches *patches, const psurf_sample *samples, uint32_t count,
                          const psurf_points *out)
{
    const size_t stride = psurf__stride(out->stride, 3);
    const int second = out->duu || out->duv || out->dvv;
    psurf__jet jets[PSURF__BLOCK];
    uint32_t i, k, block;
    if (!patches->topology->info.faces) return;
    for (i = 0; i < count; i += block) {
        block = count - i < PSURF__BLOCK ? count - i : PSURF__BLOCK;
        psurf__eval_block(patches, samples + i, block, second, jets);
        for (k = 0; k < block; k++) psurf__put_jet(out, stride, i + k, &jets[k]);
    }
}

PSURF_API const char *psurf_simd_name(void) { return psurf__best_kernels()->name; }

/* >>9 TESSELLATION ============================================================================
   Every face carries a lattice of integer points: (x, y) along corner 0 -> 1 and away from it, on
   faces of five or more corners once per sector. A lattice point has a number in the output and
   weights for the evaluators: facets of one kind go through the kernels eight at a time. */

typedef struct psurf__lattice {
    const psurf_topology *topology;
    const psurf_corner *corners;        /* of the face, each the first of step; but for fans */
    uint32_t face, size, rate, step;
    uint32_t apex;                      /* of faces that are split there, else PSURF_NONE */
    uint32_t edge_base;                 /* welded: number of the first edge sample */
    uint64_t base;                      /* first vertex of the face; welded: its first inside */
    int welded;
} psurf__lattice;

/* Points on all faces before one, from the points of a triangle, a quad, a sector, a centre. */
static uint64_t psurf__points_before(const psurf_topology *t, uint32_t face, uint64_t per_triangle,
                                     uint64_t per_quad, uint64_t per_sector, uint64_t per_centre)
{
    const psurf__start s = psurf__face_start(t, face);
    const uint64_t sectors = s.corner - 3 * (uint64_t)s.triangles - 4 * (uint64_t)s.quads;
    return s.triangles * per_triangle + s.quads * per_quad + sectors * per_sector +
           (face - s.triangles - s.quads) * per_centre;     /* may be negative: modulo 2^64 */
}

/* What a face of five corners or more has besides its sectors: its centre; but one that is split
   from an apex has a triangle less at two of its corners, and the lines to those. */
static uint64_t psurf__more_points(const psurf_topology *t, uint64_t r)
{
    return t->split == PSURF_SPLIT_PM ? 1 : 1 - r * r;
}

static uint64_t psurf__face_points_before(const psurf_topology *t, uint32_t face, uint64_t r)
{
    return psurf__points_before(t, face, (r + 1) * (r + 2) / 2, (r + 1) * (r + 1), r * (r + 1) / 2,
                                psurf__more_points(t, r));
}

static uint64_t psurf__insides_before(const psurf_topology *t, uint32_t face, uint64_t r)
{
    return psurf__points_before(t, face, r > 1 ? (r - 1) * (r - 2) / 2 : 0, (r - 1) * (r - 1),
                                r * (r - 1) / 2, psurf__more_points(t, r));
}

/* Welded vertices on edges and corners: all before the insides. Centres are insides. */
static uint64_t psurf__insides_base(const psurf_topology *t, uint64_t r)
{
    return t->info.rings - t->info.centres + t->info.edge_sides * (r - 1);
}

static uint64_t psurf__triangles_before(const psurf_topology *t, uint32_t face, uint64_t r)
{
    return psurf__points_before(t, face, r * r, 2 * r * r, r * r,
                                t->split == PSURF_SPLIT_PM ? 0 : 0 - 2 * r * r);
}

static void psurf__face_lattice(const psurf_topology *t, uint32_t face, uint32_t rate, int welded,
                                psurf__lattice *l)
{
    const uint32_t facet = t->face_facet[face];
    const int split = psurf__is_split(t, face), fan = split && t->split != PSURF_SPLIT_PM;
    l->topology = t;
    l->corners = t->corners + psurf__facet_corner(t, psurf__facet_kind(t, facet), facet);
    l->step = split ? 3 : 1;
    l->apex = fan ? psurf__face_apex(t, face) : PSURF_NONE;
    l->face = face;
    l->size = psurf__face_size(t, face);
    l->rate = rate;
    l->welded = welded;
    l->edge_base = t->info.rings - t->info.centres;
    l->base = welded ? psurf__insides_base(t, rate) + psurf__insides_before(t, face, rate)
                     : psurf__face_points_before(t, face, rate);
}

/* The corner where edge i of the face starts. */
static const psurf_corner *psurf__lattice_corner(const psurf__lattice *l, uint32_t i)
{
    if (l->apex == PSURF_NONE) return &l->corners[l->step * i];
    return psurf__find_fan_corner(l->topology, l->face, l->size, (i + l->size - l->apex) % l->size);
}

/* Number of the sample at step k of edge i, and whether this face writes it. */
static uint32_t psurf__edge_vertex(const psurf__lattice *l, uint32_t i, uint32_t k, int *writes)
{
    const psurf_corner *corner = psurf__lattice_corner(l, i);
    const int forward = (corner->edge & PSURF_WRITER) != 0;
    uint32_t edge;
    if (k == 0 || k == l->rate) {
        const uint32_t at = k ? psurf__following(i, l->size) : i;
        const uint32_t ring = psurf__lattice_corner(l, at)->ring;
        *writes = (ring & PSURF_WRITER) != 0;
        return ring & ~PSURF_WRITER;
    }
    edge = corner->edge & ~PSURF_WRITER;
    *writes = forward;
    return l->edge_base + edge * (l->rate - 1) + (forward ? k : l->rate - k) - 1;
}

/* Points in rows 0 .. y-1 where row 0 has n and each row one less. */
static uint32_t psurf__rows(uint32_t y, uint32_t n)
{
    return (uint32_t)((uint64_t)y * n - (uint64_t)y * (y - 1) / 2 * (y > 0));
}

static uint32_t psurf__triangle_vertex(const psurf__lattice *l, uint32_t x, uint32_t y, int *writes)
{
    const uint32_t r = l->rate;
    if (!l->welded) return (uint32_t)l->base + psurf__rows(y, r + 1) + x;
    if (y == 0) return psurf__edge_vertex(l, 0, x, writes);
    if (x + y == r) return psurf__edge_vertex(l, 1, y, writes);
    if (x == 0) return psurf__edge_vertex(l, 2, r - y, writes);
    return (uint32_t)l->base + psurf__rows(y - 1, r - 2) + x - 1;
}

static uint32_t psurf__quad_vertex(const psurf__lattice *l, uint32_t x, uint32_t y, int *writes)
{
    const uint32_t r = l->rate;
    if (!l->welded) return (uint32_t)l->base + y * (r + 1) + x;
    if (y == 0) return psurf__edge_vertex(l, 0, x, writes);
    if (x == r) return psurf__edge_vertex(l, 1, y, writes);
    if (y == r) return psurf__edge_vertex(l, 2, r - x, writes);
    if (x == 0) return psurf__edge_vertex(l, 3, r - y, writes);
    return (uint32_t)l->base + (y - 1) * (r - 1) + x - 1;
}

/* A sector owns its points with weight on its first corner: the line to the second belongs to the
   next sector, the centre to none. */
static uint32_t psurf__sector_vertex(const psurf__lattice *l, uint32_t sector, uint32_t x,
                                     uint32_t y, int *writes)
{
    const uint32_t r = l->rate, first_row = l->welded ? 1 : 0;
    const uint32_t per_sector = psurf__rows(r, r) - first_row * r;
    if (l->welded && y == 0) return psurf__edge_vertex(l, sector, x, writes);
    if (y == r) return (uint32_t)l->base + l->size * per_sector;
    if (x + y == r) {
        sector = psurf__following(sector, l->size);
        x = 0;
    }
    return (uint32_t)l->base + sector * per_sector + psurf__rows(y, r) - first_row * r + x;
}

/* Number of the sample at step k of half-edge j, counted from the apex. */
static uint32_t psurf__fan_edge_vertex(const psurf__lattice *l, uint32_t j, uint32_t k, int *writes)
{
    return psurf__edge_vertex(l, (l->apex + j) % l->size, k, writes);
}

/* Faces of five corners or more that are split from an apex: piece by piece. The line between two
   pieces belongs to the lower one. */
static uint32_t psurf__fan_vertex(const psurf__lattice *l, uint32_t piece, uint32_t x, uint32_t y,
                                  int *writes)
{
    const psurf_split split = l->topology->split;
    const uint32_t r = l->rate, last = psurf__piece_count(split, l->size) - 1;
    const uint32_t whole = psurf__piece_size(split, l->size, 0) == 4 ? 2 : 1;   /* in halves */
    uint32_t quad, base = (uint32_t)l->base, first, j;
    if (y == 0 && piece > 0) {
        piece = x ? piece - 1 : 0;
        y = x;
        x = 0;
    }
    quad = psurf__piece_size(split, l->size, piece) == 4;
    if (!l->welded)
        return base + piece * whole * (r * (r + 1) / 2) +
               (quad ? y * (r + 1) : psurf__rows(y, r + 1)) + x;
    j = 1 + piece * whole;                              /* half-edge from the piece's corner 1 */
    if (y == 0) return psurf__fan_edge_vertex(l, 0, x, writes);
    if (quad ? x == r : x + y == r) return psurf__fan_edge_vertex(l, j, y, writes);
    if (quad && y == r) return psurf__fan_edge_vertex(l, j + 1, r - x, writes);
    if (piece == last && x == 0) return psurf__fan_edge_vertex(l, l->size - 1, r - y, writes);
    base += piece * whole * (r * (r - 1) / 2);
    first = piece == last;                              /* x of the first point of a row */
    return base + (quad ? (y - 1) * (r - first) : psurf__rows(y - 1, r - 1 - first)) + x - first;
}

static uint32_t psurf__lattice_vertex(const psurf__lattice *l, uint32_t sector, uint32_t x,
                                      uint32_t y, int *writes)
{
    *writes = 1;
    if (l->size == 3) return psurf__triangle_vertex(l, x, y, writes);
    if (l->size == 4) return psurf__quad_vertex(l, x, y, writes);
    if (l->apex != PSURF_NONE) return psurf__fan_vertex(l, sector, x, y, writes);
    return psurf__sector_vertex(l, sector, x, y, writes);
}

static void psurf__lattice_weights(uint32_t size, uint32_t rate, uint32_t x, uint32_t y,
                                   psurf_real *w)
{
    if (size == 4) {
        w[0] = PSURF__R(rate - x);
        w[1] = PSURF__R(x);
        w[2] = PSURF__R(rate - y);
        w[3] = PSURF__R(y);
    } else {
        w[0] = PSURF__R(rate - x - y);
        w[1] = PSURF__R(x);
        w[2] = PSURF__R(y);
    }
}

/* Where each lattice point lies, for psurf_interpolate. */
static void psurf__write_place(const psurf__lattice *l, uint32_t sector, uint32_t x, uint32_t y,
                               const psurf_tess_out *out)
{
    int writes;
    const size_t index = psurf__lattice_vertex(l, sector, x, y, &writes) - out->first_vertex;
    const uint32_t shape = psurf__shape_of(l->topology, l->size, sector);
    const psurf_real rate = PSURF__R(l->rate);
    psurf_sample *where = &out->where[index];
    if (!writes) return;
    where->face = l->face;
    where->sector = sector;
    where->u = PSURF__R(shape < 5 ? x : l->rate - x - y) / rate;
    where->v = PSURF__R(shape < 5 ? y : x) / rate;
}

static void psurf__write_places(const psurf__lattice *l, const psurf_tess_out *out)
{
    const uint32_t r = l->rate, sectors = psurf__sectors_of(l->topology, l->size);
    uint32_t s, x, y;
    for (s = 0; s < sectors; s++) {
        const uint32_t shape = psurf__shape_of(l->topology, l->size, s);
        for (y = shape < 5 && s > 0; y <= r; y++) {
            const uint32_t row = shape == 4 ? r + 1 : shape == 3 ? r - y + 1 : r - y;
            for (x = 0; x < row; x++) psurf__write_place(l, s, x, y, out);
        }
    }
    if (l->size >= 5 && l->apex == PSURF_NONE) psurf__write_place(l, 0, 0, r, out);
}

/* ---- positions and normals: groups of facets ---- */

/* The output of a group's facets. */
typedef struct psurf__output {
    psurf_kind filed;                   /* the kind that they are filed under */
    const psurf_tess_out *out;
    size_t p_stride, n_stride;          /* in reals */
    psurf_real *p[8], *n[8];            /* of the first vertex of each face, its first inside */
    psurf__ahead ahead[PSURF__AHEADS];
    psurf_real sink[3];                 /* for positions that are not wanted */
    psurf__lattice lattice[8];
    uint32_t piece[8];                  /* of a split face, or PSURF_NONE */
} psurf__output;

static void psurf__store_vertex(const psurf_tess_out *out, size_t index, const psurf_real *p,
                                const psurf_real *n)
{
    uint32_t i;
    psurf_real *to_p = out->p, *to_n = out->n;
    index -= out->first_vertex;
    if (to_p) to_p += index * psurf__stride(out->p_stride, 3);
    if (to_n) to_n += index * psurf__stride(out->n_stride, 3);
    for (i = 0; i < 3 && to_p; i++) to_p[i] = p[i];
    for (i = 0; i < 3 && to_n; i++) to_n[i] = n[i];
}

/* From a lattice point of a piece to that of its face. Returns whether this piece writes it. Pieces
   round a centre are triangles with the centre as third corner; the first writes that. */
static int psurf__leave_piece(const psurf__lattice *l, uint32_t piece, psurf__point *at,
                              uint32_t *sector)
{
    const uint32_t r = l->rate;
    uint32_t u, v;
    *sector = piece;
    if (l->apex == PSURF_NONE) return at->x + at->y < r || (at->x == 0 && piece == 0);
    if (at->y == 0 && piece > 0) return 0;
    if (l->size > 4) return 1;
    u = piece ? at->x : at->x + at->y;                  /* as psurf__halves_locate */
    v = piece ? at->x + at->y : at->y;
    *sector = 0;
    at->x = l->apex == 0 ? u : l->apex == 1 ? r - v : l->apex == 2 ? r - u : v;
    at->y = l->apex == 0 ? v : l->apex == 1 ? u : l->apex == 2 ? r - v : r - u;
    return 1;
}

/* A sample with a place of its own: it may belong to another face, or to another piece. */
static void psurf__put_vertex(const psurf__run *r, uint32_t lane, uint32_t k,
                              const psurf_real *sample)
{
    const psurf__output *o = (const psurf__output *)r->group->to;
    const psurf__lattice *l = &o->lattice[lane];
    const uint32_t piece = o->piece[lane];
    psurf__point at = psurf__line_point(r, k);
    uint32_t sector = r->group->kind == PSURF_P5 ? r->sector : 0, vertex;
    int writes;
    if (piece != PSURF_NONE && !psurf__leave_piece(l, piece, &at, &sector)) return;
    vertex = psurf__lattice_vertex(l, sector, at.x, at.y, &writes);
    if (writes) psurf__store_vertex(o->out, vertex, sample, sample + 3);
}

/* How far the numbers of a face's own points lie apart along a line; and by how much that grows. */
static ptrdiff_t psurf__vertex_step(const psurf__lattice *l, const psurf__point *at,
                                    ptrdiff_t *bend)
{
    const ptrdiff_t row = (ptrdiff_t)l->rate + (l->size > 4 ? 0 : l->welded ? -1 : 1);
    const ptrdiff_t here = l->size == 4 ? row : row - (ptrdiff_t)at->y;     /* length of the row */
    *bend = l->size != 4 && at->to_y != 0 ? -1 : 0;
    if (at->to_y < 0) return at->to_x - here + *bend;
    return at->to_x + at->to_y * here;
}

/* A cursor of places that lie so many vertices apart, offset from the first of each face. */
static void psurf__place_cursor(const psurf__output *o, ptrdiff_t offset, ptrdiff_t step,
                                ptrdiff_t bend, psurf__cursor *c)
{
    const ptrdiff_t p_stride = o->out->p ? (ptrdiff_t)o->p_stride : 0;
    const ptrdiff_t n_stride = o->out->n ? (ptrdiff_t)o->n_stride : 0;
    c->p = o->p;
    c->n = o->n;
    c->p_at = offset * p_stride;
    c->n_at = offset * n_stride;
    c->p_step = step * p_stride;
    c->n_step = step * n_stride;
    c->p_bend = bend * p_stride;
    c->n_bend = bend * n_stride;
    c->interleaved = o->out->p && o->out->n == o->out->p + 3 && p_stride == n_stride;
}

/* Points cursors at the places of a line: forth from its step first, and back from its step last.
   Faces of one kind and turn have their own points in the same order. */
static void psurf__aim_line(const psurf__run *r, uint32_t first, uint32_t last,
                            psurf__cursor cursors[2])
{
    const psurf__output *o = (const psurf__output *)r->group->to;
    const psurf__lattice *l = &o->lattice[0];
    const psurf__point at = psurf__line_point(r, first);
    const uint32_t sector = r->group->kind == PSURF_P5 ? r->sector : 0;
    const ptrdiff_t steps = (ptrdiff_t)last - (ptrdiff_t)first;
    ptrdiff_t offset, step, bend;
    int writes;
    offset = (ptrdiff_t)psurf__lattice_vertex(l, sector, at.x, at.y, &writes) -
             (ptrdiff_t)l->base;
    step = psurf__vertex_step(l, &at, &bend);
    psurf__place_cursor(o, offset, step, bend, &cursors[0]);
    offset += steps * step + steps * (steps - 1) / 2 * bend;
    psurf__place_cursor(o, offset, -(step + (steps - 1) * bend), bend, &cursors[1]);
}

typedef struct psurf__job {             /* of one psurf_tessellate */
    const psurf_patches *patches;
    const psurf_tess_out *out;
    const psurf__kernels *kernels;
    uint32_t rate, end;                 /* end: of the range of faces */
    int welded;
    psurf__normals normals;             /* that out->n gets */
} psurf__job;

/* The first vertex that a face owns alone: its first; welded, its first inside. */
static uint64_t psurf__own_vertices(const psurf__job *job, uint32_t face)
{
    const psurf_topology *t = job->patches->topology;
    if (!job->welded) return psurf__face_points_before(t, face, job->rate);
    return psurf__insides_base(t, job->rate) + psurf__insides_before(t, face, job->rate);
}

static void psurf__open_group(const psurf__job *job, psurf_kind filed, uint32_t turn, int split,
                              psurf__group *g, psurf__output *o)
{
    const psurf_kind kind = psurf__patch_kind(job->patches, filed);
    o->filed = filed;
    g->kind = kind;
    g->turn = turn;
    g->count = 0;
    g->rate = job->rate;
    g->normals = job->normals;
    if (job->normals == PSURF__SHADING && !psurf__kinds[kind].shaded) g->normals = PSURF__SURFACE;
    g->border_only = 0;
    g->fetched = 0;
    g->ahead = o->ahead;
    g->apart = split ? PSURF__ALL_APART : job->welded ? PSURF__BORDER_APART : PSURF__NONE_APART;
    g->aim = psurf__aim_line;
    g->put = psurf__put_vertex;
    g->to = o;
    o->out = job->out;
    o->p_stride = psurf__stride(job->out->p_stride, 3);
    o->n_stride = psurf__stride(job->out->n_stride, 3);
}

static void psurf__copy_lane(psurf__group *g, psurf__output *o, uint32_t from, uint32_t to)
{
    g->points[to] = g->points[from];
    o->p[to] = o->p[from];
    o->n[to] = o->n[from];
}

/* Opens a way ahead through so many places, every step of them from one on. */
static void psurf__open_ahead(psurf__ahead *a, uint32_t count, ptrdiff_t first, ptrdiff_t step,
                              ptrdiff_t places, ptrdiff_t stride)
{
    uint32_t lane;
    for (lane = count; lane < 8; lane++) a->to[lane] = a->to[0];
    a->at = first * stride;
    a->end = count > 0 ? places * stride : 0;
    a->step = step * stride;
}

/* Up to eight facets from one on, as far as their faces are in the range and of one size: most
   likely the next group. Two pairs of samples ask for what four write. */
static void psurf__look_ahead(const psurf__job *job, uint32_t facet, uint32_t end, ptrdiff_t reals,
                              psurf__output *o)
{
    const psurf_topology *t = job->patches->topology;
    const psurf_tess_out *out = job->out;
    const ptrdiff_t p_stride = out->p ? (ptrdiff_t)o->p_stride : 0;
    const ptrdiff_t n_stride = out->n ? (ptrdiff_t)o->n_stride : 0;
    psurf__ahead *even = &o->ahead[PSURF__AHEAD_EVEN], *odd = &o->ahead[PSURF__AHEAD_ODD];
    psurf__ahead *patches = &o->ahead[PSURF__AHEAD_PATCHES];
    uint32_t count = 0, size = 0;
    ptrdiff_t points = 0;
    for (; count < 8 && facet < end && t->facets[facet].face < job->end; facet++, count++) {
        const uint32_t face = t->facets[facet].face;
        const uint64_t first = psurf__own_vertices(job, face);
        if (count > 0 && psurf__face_size(t, face) != size) break;
        size = psurf__face_size(t, face);
        points = (ptrdiff_t)(psurf__own_vertices(job, face + 1) - first);
        patches->to[count] = psurf__patch_points(job->patches, o->filed, facet);
        if (out->p) even->to[count] = out->p + (first - out->first_vertex) * o->p_stride;
        if (out->n) odd->to[count] = out->n + (first - out->first_vertex) * o->n_stride;
    }
    if (points * (p_stride > n_stride ? p_stride : n_stride) > PSURF__FAR_AHEAD) points = 0;
    psurf__open_ahead(patches, count, 0, 16, reals, 1);
    psurf__open_ahead(even, count, 0, 4, points, p_stride);
    psurf__open_ahead(odd, count, 0, 4, points, n_stride);
    if (out->p && out->n == out->p + 3 && p_stride == n_stride) odd->at = 2 * n_stride;
}

/* next: the first facet that is not in a group yet. */
static void psurf__run_group(psurf__job *job, psurf__group *g, psurf__output *o, uint32_t next)
{
    const uint32_t *kind_first = job->patches->topology->kind_first;
    const uint32_t end = g->apart == PSURF__ALL_APART ? 0 : kind_first[o->filed + 1];
    uint32_t i;
    if (g->count == 0) return;
    for (i = g->count; i < 8; i++) psurf__copy_lane(g, o, 0, i);
    psurf__look_ahead(job, next, end, 3 * (ptrdiff_t)psurf__kind_table[g->kind].points, o);
    job->kernels->lattice(g);
    g->count = 0;
    g->fetched = o->ahead[PSURF__AHEAD_EVEN].end > 0 || o->ahead[PSURF__AHEAD_ODD].end > 0;
}

static void psurf__add_facet(psurf__job *job, psurf__group *g, psurf__output *o, uint32_t facet)
{
    const psurf_topology *t = job->patches->topology;
    const uint32_t lane = g->count++, piece = t->facets[facet].piece;
    psurf__lattice *l = &o->lattice[lane];
    psurf__face_lattice(t, t->facets[facet].face, job->rate, job->welded, l);
    o->piece[lane] = piece & PSURF_SPLIT_FACE ? piece & 0xFFFFu : PSURF_NONE;
    o->p[lane] = o->sink;
    o->n[lane] = o->sink;
    if (job->out->p) o->p[lane] = job->out->p + (l->base - job->out->first_vertex) * o->p_stride;
    if (job->out->n) o->n[lane] = job->out->n + (l->base - job->out->first_vertex) * o->n_stride;
    g->points[lane] = psurf__view_facet(job->patches, facet).points;
    if (g->count == 8) psurf__run_group(job, g, o, facet + 1);
}

/* A triangle or quad that is split round its centre: its lattice runs across its pieces, which lie
   where they may. */
static void psurf__write_split_face(const psurf__job *job, uint32_t face)
{
    psurf__lattice l;
    psurf__place places[PSURF__BLOCK];
    psurf__jet jets[PSURF__BLOCK];
    uint32_t vertex[PSURF__BLOCK], count = 0, i, x, y;
    psurf__face_lattice(job->patches->topology, face, job->rate, job->welded, &l);
    for (y = 0; y <= l.rate; y++) {
        const uint32_t last = l.size == 4 ? l.rate : l.rate - y;
        for (x = 0; x <= last; x++) {
            int writes;
            vertex[count] = psurf__lattice_vertex(&l, 0, x, y, &writes);
            places[count].face = face;
            places[count].size = l.size;
            places[count].sector = 0;
            places[count].shape = l.size;
            places[count].d = PSURF__R(l.rate);
            psurf__lattice_weights(l.size, l.rate, x, y, places[count].w);
            count += (uint32_t)writes;
            if (count < PSURF__BLOCK && (x < last || y < l.rate)) continue;
            psurf__eval_places(job->patches, places, count, 0, jets);
            for (i = 0; i < count; i++)
                psurf__store_vertex(job->out, vertex[i], &jets[i].p.x, &jets[i].n.x);
            count = 0;
        }
    }
}

/* Facets filed under a kind. Whole faces of each turn, and pieces of split ones, gather in groups
   of their own. */
static void psurf__tessellate_kind(psurf__job *job, psurf_kind kind, uint32_t first_face)
{
    const psurf_topology *t = job->patches->topology;
    psurf__output outputs[4];
    psurf__group groups[4];
    uint32_t i = psurf__first_facet(t, kind, first_face), k;
    if (i >= t->kind_first[kind + 1]) return;
    for (k = 0; k < 4; k++)
        psurf__open_group(job, kind, k % 3, k == 3, &groups[k], &outputs[k]);
    for (; i < t->kind_first[kind + 1] && t->facets[i].face < job->end; i++) {
        const psurf_facet *facet = &t->facets[i];
        if (!(facet->piece & PSURF_SPLIT_FACE)) {
            k = psurf__turn(t, i);
        } else if (t->split != PSURF_SPLIT_PM || psurf__face_size(t, facet->face) > 4) {
            k = 3;
        } else {
            if ((facet->piece & 0xFFFFu) == 0) psurf__write_split_face(job, facet->face);
            continue;
        }
        if (k == 3 && psurf__turn(t, i) != groups[k].turn) {
            psurf__run_group(job, &groups[k], &outputs[k], i);
            groups[k].turn = psurf__turn(t, i);
        }
        psurf__add_facet(job, &groups[k], &outputs[k], i);
    }
    for (k = 0; k < 4; k++) psurf__run_group(job, &groups[k], &outputs[k], i);
}

static void psurf__tessellate_kinds(psurf__job *job, uint32_t first_face)
{
    uint32_t k;
    for (k = 0; k < PSURF_KIND_COUNT; k++)
        psurf__tessellate_kind(job, (psurf_kind)k, first_face);
}

/* ---- triangles ---- */

/* Indices go out one by one, in either width. */
typedef struct psurf__indices {
    const psurf__lattice *lattice;
    uint32_t *wide;
    uint16_t *narrow;
    size_t at;
    uint32_t first_vertex;
} psurf__indices;

static void psurf__write_index(psurf__indices *out, uint32_t sector, uint32_t x, uint32_t y)
{
    int writes;
    const uint32_t vertex = psurf__lattice_vertex(out->lattice, sector, x, y, &writes);
    if (out->wide) out->wide[out->at++] = vertex - out->first_vertex;
    else out->narrow[out->at++] = (uint16_t)(vertex - out->first_vertex);
}

/* The one or two triangles of the cell at (x, y); triangular lattices end in cells with one. A quad
   of two triangles may be cut along the other diagonal: rising. */
static void psurf__write_cell(psurf__indices *out, uint32_t sector, uint32_t x, uint32_t y,
                              int both, uint32_t rising)
{
    psurf__write_index(out, sector, x, y);
    psurf__write_index(out, sector, x + 1, y);
    psurf__write_index(out, sector, x + rising, y + 1);
    if (!both) return;
    psurf__write_index(out, sector, x + 1 - rising, y);
    psurf__write_index(out, sector, x + 1, y + 1);
    psurf__write_index(out, sector, x, y + 1);
}

static void psurf__write_indices(psurf__indices *out)
{
    const psurf__lattice *l = out->lattice;
    const uint32_t r = l->rate, sectors = psurf__sectors_of(l->topology, l->size);
    const uint32_t rising = l->size == 4 && l->apex != PSURF_NONE && l->apex % 2 == 0;
    uint32_t s, x, y;
    for (s = 0; s < sectors; s++) {
        const int quad = psurf__shape_of(l->topology, l->size, s) == 4;
        for (y = 0; y < r; y++) {
            const uint32_t cells = quad ? r : r - y;
            for (x = 0; x < cells; x++)
                psurf__write_cell(out, s, x, y, quad || x + 1 < cells, rising);
        }
    }
}

PSURF_API psurf_result psurf_tessellate_size(const psurf_topology *topology,
                                             const psurf_tess_desc *desc, uint32_t first_face,
                                             uint32_t face_count, psurf_tess_span *span)
{
    const uint32_t known = PSURF_TESS_PER_FACE | PSURF_TESS_INDEX16;
    uint64_t first = 0, end, first_index, end_index;
    uint32_t faces, first_f, end_f;
    if (!topology || !desc || !span || desc->_start_canary || desc->_end_canary || desc->rate < 1 ||
        desc->rate > PSURF_MAX_RATE || (desc->flags & ~known)) return PSURF_BAD_DESC;
    faces = topology->info.faces;
    first_f = first_face < faces ? first_face : faces;
    end_f = psurf__range_end(first_f, face_count, faces);
    if (desc->flags & PSURF_TESS_PER_FACE) {
        first = psurf__face_points_before(topology, first_f, desc->rate);
        end = psurf__face_points_before(topology, end_f, desc->rate);
    } else {
        end = psurf__insides_base(topology, desc->rate) +
              psurf__insides_before(topology, faces, desc->rate);
    }
    first_index = 3 * psurf__triangles_before(topology, first_f, desc->rate);
    end_index = 3 * psurf__triangles_before(topology, end_f, desc->rate);
    if (end > 0xFFFFFFFFu || end_index > SIZE_MAX / sizeof(uint32_t) ||
        ((desc->flags & PSURF_TESS_INDEX16) && end - first > 0xFFFFu)) return PSURF_TOO_LARGE;
    span->first_vertex = (uint32_t)first;
    span->vertex_count = (uint32_t)(end - first);
    span->first_index = (size_t)first_index;
    span->index_count = (size_t)(end_index - first_index);
    return PSURF_OK;
}

/* What follows from numbering alone: places and indices. */
static void psurf__number_face(const psurf_patches *patches, const psurf_tess_desc *desc,
                               uint32_t face, const psurf_tess_out *out)
{
    const psurf_topology *t = patches->topology;
    psurf__lattice lattice;
    psurf__indices to;
    psurf__face_lattice(t, face, desc->rate, !(desc->flags & PSURF_TESS_PER_FACE), &lattice);
    if (out->where) psurf__write_places(&lattice, out);
    if (!out->indices) return;
    to.lattice = &lattice;
    to.wide = (desc->flags & PSURF_TESS_INDEX16) ? NULL : (uint32_t *)out->indices;
    to.narrow = (uint16_t *)out->indices;
    to.at = (size_t)(3 * psurf__triangles_before(t, face, desc->rate)) - out->first_index;
    to.first_vertex = out->first_vertex;
    psurf__write_indices(&to);
}

PSURF_API psurf_result psurf_tessellate(const psurf_patches *patches, const psurf_tess_desc *desc,
                                        uint32_t first_face, uint32_t face_count,
                                        const psurf_tess_out *out)
{
    psurf_tess_span span;
    psurf_result result;
    psurf_tess_out to;
    psurf__job job;
    uint32_t f;
    if (!patches || !out || out->p_stride % sizeof(psurf_real) ||
        out->n_stride % sizeof(psurf_real) || out->shade_stride % sizeof(psurf_real))
        return PSURF_BAD_DESC;
    to = *out;
    result = psurf_tessellate_size(patches->topology, desc, first_face, face_count, &span);
    if (result != PSURF_OK) return result;
    if (out->first_vertex > span.first_vertex || out->first_index > span.first_index)
        return PSURF_BAD_DESC;
    if ((desc->flags & PSURF_TESS_INDEX16) &&
        (uint64_t)span.first_vertex + span.vertex_count - out->first_vertex > 0xFFFFu)
        return PSURF_TOO_LARGE;
    job.patches = patches;
    job.out = &to;
    job.kernels = psurf__best_kernels();
    job.rate = desc->rate;
    job.end = psurf__range_end(first_face, face_count, patches->topology->info.faces);
    job.welded = !(desc->flags & PSURF_TESS_PER_FACE);
    job.normals = out->n ? PSURF__SURFACE : PSURF__NO_NORMALS;
    if (out->n || (out->p && !out->shade)) psurf__tessellate_kinds(&job, first_face);
    if (out->shade) {                                   /* in place of n, in a run of its own */
        to.n = out->shade;
        to.n_stride = out->shade_stride;
        if (out->n) to.p = NULL;
        job.normals = PSURF__SHADING;
        psurf__tessellate_kinds(&job, first_face);
    }
    for (f = first_face; f < job.end && (out->where || out->indices); f++)
        psurf__number_face(patches, desc, f, out);
    return PSURF_OK;
}

/* The weight of corner c of the face at a place; of a piece, its corner 0 is the apex, and the
   others follow those of the pieces before. */
static psurf_real psurf__corner_weight(const psurf_topology *t, const psurf__place *place,
                                       uint32_t c)
{
    const psurf_real *w = place->w;
    psurf_real weight;
    if (place->size > 4 && place->shape < 5) {
        const uint32_t from_apex = c + place->size - psurf__face_apex(t, place->face);
        const uint32_t before = place->sector * (psurf__piece_size(t->split, place->size, 0) - 2);
        c = from_apex % place->size;
        if (c > 0 && (c <= before || c - before >= place->shape)) return 0;
        c -= c ? before : 0;
    }
    if (place->shape == 3) return w[c];
    if (place->shape == 4) return (c == 1 || c == 2 ? w[1] : w[0]) * (c < 2 ? w[2] : w[3]);
    weight = w[2] / PSURF__R(place->size);
    if (c == place->sector) weight += w[0];
    if (c == psurf__following(place->sector, place->size)) weight += w[1];
    return weight;
}

PSURF_API void psurf_interpolate(const psurf_topology *topology, const psurf_sample *samples,
                                 uint32_t count, const float *corner_values, uint32_t width,
                                 float *out, size_t out_stride)
{
    const psurf_topology *t = topology;
    const size_t step = out_stride ? out_stride / sizeof(float) : width;
    uint32_t i, c, k;
    if (!t->info.faces) return;
    for (i = 0; i < count; i++, out += step) {
        const psurf__place place = psurf__find_place(t, &samples[i]);
        const size_t first = psurf__face_start(t, place.face).corner;
        const float *values = corner_values + first * width;
        for (k = 0; k < width; k++) out[k] = 0;
        for (c = 0; c < place.size; c++, values += width) {
            const float weight = (float)psurf__corner_weight(t, &place, c);
            for (k = 0; k < width; k++) out[k] += weight * values[k];
        }
    }
}

/* >>10 INTERROGATION ==========================================================================
   Curvature, gaps and normal jumps, bounds: reads what the chapters before made. */

/* In double, where fourth powers of lengths neither overflow nor vanish. */
static double psurf__wide_dot(psurf__v3 a, psurf__v3 b)
{
    return ((double)a.x * (double)b.x + (double)a.y * (double)b.y) + (double)a.z * (double)b.z;
}

/* From the fundamental forms; NaN where curvature does not exist. */
static void psurf__jet_curvature(const psurf__jet *j, psurf_real *gauss, psurf_real *mean)
{
    const double e = psurf__wide_dot(j->du, j->du), f = psurf__wide_dot(j->du, j->dv);
    const double g = psurf__wide_dot(j->dv, j->dv), l = psurf__wide_dot(j->duu, j->n);
    const double m = psurf__wide_dot(j->duv, j->n), n = psurf__wide_dot(j->dvv, j->n);
    const double area = e * g - f * f, zero = 0;
    const int exists = j->curved && area > 0 && psurf__dot(j->n, j->n) > 0;
    if (gauss) *gauss = PSURF__R(exists ? (l * n - m * m) / area : zero / zero);
    if (mean) *mean = PSURF__R(exists ? (e * n - 2 * (f * m) + g * l) / (2 * area) : zero / zero);
}

PSURF_API void psurf_curvature(const psurf_patches *patches, const psurf_sample *samples,
                               uint32_t count, psurf_real *gauss, psurf_real *mean)
{
    psurf__jet jets[PSURF__BLOCK];
    uint32_t i, k, block;
    if (!patches->topology->info.faces) return;
    for (i = 0; i < count; i += block) {
        block = count - i < PSURF__BLOCK ? count - i : PSURF__BLOCK;
        psurf__eval_block(patches, samples + i, block, 1, jets);
        for (k = 0; k < block; k++)
            psurf__jet_curvature(&jets[k], gauss ? gauss + i + k : NULL,
                                 mean ? mean + i + k : NULL);
    }
}

/* Samples of an edge are compared in chunks of this many. */
#define PSURF__PROBES 128u

/* One side of an edge under check, and a chunk of its samples: positions and normals. */
typedef struct psurf__side {
    const psurf_patches *patches;
    uint32_t facet, first, size, edge;
    uint32_t chunk;
    psurf_real sample[PSURF__PROBES][6];
} psurf__side;

static void psurf__open_side(psurf__side *side, const psurf_patches *p, uint32_t corner)
{
    side->patches = p;
    side->facet = psurf__corner_facet(p->topology, corner, &side->edge);
    side->first = corner - side->edge;
    side->size = psurf__kind_sides(psurf__facet_kind(p->topology, side->facet));
}

/* The step along an edge of its domain at which a facet has a lattice point, or PSURF_NONE. */
static uint32_t psurf__edge_step(uint32_t size, uint32_t rate, uint32_t edge, uint32_t sector,
                                 uint32_t x, uint32_t y)
{
    if (size == 5) {
        if (sector == psurf__following(edge, 5) && x == 0 && y == 0) return rate;
        return sector == edge && y == 0 ? x : PSURF_NONE;
    }
    if (edge == 0) return y == 0 ? x : PSURF_NONE;
    if (edge == 1) return (size == 3 ? x + y : x) == rate ? y : PSURF_NONE;
    if (size == 4 && edge == 2) return y == rate ? rate - x : PSURF_NONE;
    return x == 0 ? rate - y : PSURF_NONE;
}

/* Takes a sample of the facet's border, if it lies in the chunk of the edge. */
static void psurf__put_probe(const psurf__run *r, uint32_t lane, uint32_t k,
                             const psurf_real *sample)
{
    psurf__side *side = (psurf__side *)r->group->to;
    const psurf__point at = psurf__line_point(r, k);
    const uint32_t step = psurf__edge_step(side->size, r->group->rate, side->edge, r->sector, at.x,
                                           at.y);
    uint32_t i;
    (void)lane;                                         /* there is one */
    if (step == PSURF_NONE || step < side->chunk || step - side->chunk >= PSURF__PROBES) return;
    for (i = 0; i < 6; i++) side->sample[step - side->chunk][i] = sample[i];
}

/* Fills the samples of a side from step chunk on, counted from its own first corner. */
static void psurf__probe_side(psurf__side *side, uint32_t rate, uint32_t chunk)
{
    const psurf__view view = psurf__view_facet(side->patches, side->facet);
    psurf__ahead ahead[PSURF__AHEADS];
    psurf__group g;
    uint32_t i;
    side->chunk = chunk;
    g.kind = view.kind;
    g.count = 1;
    g.rate = rate;
    g.turn = view.turn;
    g.normals = PSURF__SURFACE;
    g.border_only = 1;
    g.apart = PSURF__ALL_APART;
    g.fetched = 1;
    g.ahead = ahead;
    g.aim = NULL;
    g.put = psurf__put_probe;
    g.to = side;
    for (i = 0; i < 8; i++) g.points[i] = view.points;
    for (i = 0; i < PSURF__AHEADS; i++) ahead[i].at = ahead[i].end = 0;
    psurf__best_kernels()->lattice(&g);
}

static psurf__v3 psurf__point_position(const psurf_topology *t, const psurf__control *control,
                                       uint32_t point)
{
    if (point < t->info.vertices) return psurf__position(control, point);
    return psurf__face_centre(t, control, t->centres[point - t->info.vertices]);
}

static const psurf_ring *psurf__corner_ring(const psurf_topology *t, uint32_t corner)
{
    return &t->rings[t->corners[corner].ring & ~PSURF_WRITER];
}

static psurf__v3 psurf__corner_position(const psurf_topology *t, const psurf__control *control,
                                        uint32_t corner)
{
    return psurf__point_position(t, control, psurf__corner_ring(t, corner)->point);
}

/* Whether the angle at p between a and b is less than half a degree. */
static int psurf__is_needle(psurf__v3 p, psurf__v3 a, psurf__v3 b)
{
    const psurf_real tangent = PSURF__R(0.0087268677907587893);
    psurf__v3 n;
    psurf_real dot;
    a = psurf__scaled(psurf__sub(a, p));
    b = psurf__scaled(psurf__sub(b, p));
    n = psurf__cross(a, b);
    dot = psurf__dot(a, b);
    return dot >= 0 && psurf__dot(n, n) <= tangent * tangent * (dot * dot);
}

/* Whether an open ring ends where it begins: the tip of a slit, which has no tangent plane. */
static int psurf__is_slit(const psurf_topology *t, const psurf__control *control, uint32_t corner)
{
    const psurf_ring *ring = psurf__corner_ring(t, corner);
    const uint32_t first = ring->first_spoke, last = first + psurf__valence(ring) - 1;
    if (!(ring->valence & PSURF_RING_OPEN)) return 0;
    return psurf__is_needle(psurf__point_position(t, control, ring->point),
                            psurf__point_position(t, control, t->spokes[first].end),
                            psurf__point_position(t, control, t->spokes[last].end));
}

/* Whether a facet has a needle corner, or the edge of this side an end at a slit. */
static int psurf__is_degenerate(const psurf_topology *t, const psurf__control *control,
                                const psurf__side *side)
{
    const uint32_t end = psurf__following(side->edge, side->size);
    uint32_t i;
    for (i = 0; i < side->size; i++) {
        const uint32_t next = psurf__following(i, side->size);
        const uint32_t last = psurf__preceding(i, side->size);
        if (psurf__is_needle(psurf__corner_position(t, control, side->first + i),
                             psurf__corner_position(t, control, side->first + next),
                             psurf__corner_position(t, control, side->first + last)))
            return 1;
    }
    return psurf__is_slit(t, control, side->first + side->edge) ||
           psurf__is_slit(t, control, side->first + end);
}

static psurf_real psurf__distance(psurf__v3 a, psurf__v3 b)
{
    psurf__v3 d = psurf__sub(a, b);
    return psurf__sqrt(psurf__dot(d, d));
}

static psurf_real psurf__mesh_diagonal(const psurf_topology *t, const psurf__control *control)
{
    psurf__v3 low = psurf__zero(), high = psurf__zero();
    uint32_t r;
    for (r = 0; r < t->info.rings - t->info.centres; r++) {
        psurf__v3 p = psurf__position(control, t->rings[r].point);
        if (r == 0) low = high = p;
        if (p.x < low.x) low.x = p.x;
        if (p.y < low.y) low.y = p.y;
        if (p.z < low.z) low.z = p.z;
        if (p.x > high.x) high.x = p.x;
        if (p.y > high.y) high.y = p.y;
        if (p.z > high.z) high.z = p.z;
    }
    return psurf__distance(low, high);
}

static int psurf__same_bits(psurf__v3 a, psurf__v3 b)
{
    union { psurf__v3 v; unsigned char bytes[sizeof(psurf__v3)]; } x, y;
    size_t i;
    x.v = a;
    y.v = b;
    for (i = 0; i < sizeof(psurf__v3); i++)
        if (x.bytes[i] != y.bytes[i]) return 0;
    return 1;
}

/* Angle between unit normals in degrees, from their chord: exact for small angles too. */
static double psurf__angle(psurf__v3 a, psurf__v3 b)
{
    double x = (double)a.x - (double)b.x, y = (double)a.y - (double)b.y,
           z = (double)a.z - (double)b.z;
    double half = PSURF__SQRT(x * x + y * y + z * z) / 2;
    return 2 * psurf__asin(half < 1 ? half : 1) * 57.295779513082320877;
}

/* What two sides say of one sample. */
static void psurf__compare(const psurf_real *a, const psurf_real *b, int sharp, int degenerate,
                           uint32_t edge, uint32_t face, psurf_check_result *r)
{
    const psurf__v3 p = psurf__get(a), q = psurf__get(b);
    const psurf__v3 m = psurf__get(a + 3), n = psurf__get(b + 3);
    double angle;
    r->samples++;
    r->cracks += !psurf__same_bits(p, q);
    if (!psurf__finite3(p) || !psurf__finite3(q) || !psurf__finite3(m) || !psurf__finite3(n)) {
        r->nonfinite++;
        return;
    }
    if (sharp) return;
    if (degenerate || psurf__dot(m, m) <= 0 || psurf__dot(n, n) <= 0) {
        r->degenerate++;
        return;
    }
    angle = psurf__angle(m, n);
    if (angle > r->max_normal_deg || r->worst_edge == PSURF_NONE) {
        r->max_normal_deg = angle;
        r->worst_edge = edge;
        r->worst_face = face;
    }
}

/* Whether the construction of the edge fell back, as a facet beside it noted. */
static int psurf__fell_back(const psurf__side *side)
{
    const psurf__view view = psurf__view_facet(side->patches, side->facet);
    const uint32_t flags = psurf__kind_table[view.kind].points - 1;     /* the last point */
    return view.row->net && !view.row->shaded &&
           view.points[3 * flags + side->edge] > PSURF__R((int)PSURF_EDGE_HARD);
}

/* Edges that two faces share; from psurf_info.edges on, those between pieces of one face. */
static void psurf__check_edge(const psurf_patches *patches, const psurf__control *control,
                              psurf_real shortest, uint32_t rate, uint32_t edge,
                              psurf_check_result *r)
{
    const psurf_topology *t = patches->topology;
    const uint32_t second_sides = t->info.edge_sides - t->info.edges;
    const psurf_edge corners = t->edges[edge < t->info.edges ? edge : edge + second_sides];
    const psurf_corner *ends[2];
    psurf__side a, b;
    uint32_t k, first, count;
    int sharp, degenerate;
    if (corners.other == PSURF_NONE) return;
    psurf__open_side(&a, patches, corners.corner);
    psurf__open_side(&b, patches, corners.other);
    ends[0] = &t->corners[corners.corner];
    ends[1] = &t->corners[corners.other];
    sharp = ((ends[0]->edge ^ ends[1]->edge) & ~PSURF_WRITER) != 0 ||
            (control->blends && (control->blends[ends[0]->spoke] <= 0 ||
                                 control->blends[ends[1]->spoke] <= 0));
    degenerate = psurf__is_degenerate(t, control, &a) || psurf__is_degenerate(t, control, &b) ||
                 psurf__distance(psurf__corner_position(t, control, corners.corner),
                                 psurf__corner_position(t, control, corners.other)) < shortest;
    r->sharp_edges += (uint32_t)sharp;
    r->fallback_edges += (uint32_t)(psurf__fell_back(&a) || psurf__fell_back(&b));
    for (first = 0; first <= rate; first += PSURF__PROBES) {
        count = rate + 1 - first < PSURF__PROBES ? rate + 1 - first : PSURF__PROBES;
        psurf__probe_side(&a, rate, first);
        psurf__probe_side(&b, rate, rate + 1 - first - count);
        for (k = 0; k < count; k++)
            psurf__compare(a.sample[k], b.sample[count - 1 - k], sharp, degenerate, edge,
                           t->facets[a.facet].face, r);
    }
}

PSURF_API psurf_result psurf_check(const psurf_patches *patches, const psurf_construct_desc *desc,
                                   uint32_t rate, uint32_t first_edge, uint32_t edge_count,
                                   psurf_check_result *result)
{
    const psurf_check_result none = {0, 0, 0, 0, 0, PSURF_NONE, PSURF_NONE, 0, 0};
    psurf__control control;
    psurf_real shortest;
    uint32_t e, end;
    if (!patches || !result || !psurf__construct_desc_ok(desc) || rate < 1 || rate > PSURF_MAX_RATE)
        return PSURF_BAD_DESC;
    *result = none;
    control = psurf__control_of(patches, desc);
    shortest = PSURF__R(1e-5) * psurf__mesh_diagonal(patches->topology, &control);
    end = psurf__range_end(first_edge, edge_count, patches->topology->info.edges +
                                                       patches->topology->info.inner_edges);
    for (e = first_edge; e < end; e++)
        psurf__check_edge(patches, &control, shortest, rate, e, result);
    return PSURF_OK;
}

/* The box of a facet's Bezier points; a lane per sector. */
static void psurf__facet_box(const psurf_patches *patches, uint32_t facet, psurf_real *box)
{
    const psurf__view view = psurf__view_facet(patches, facet);
    psurf_real low[3][8], high[3][8];
    psurf__batch batch;
    psurf__spot spot;
    uint32_t i, k;
    psurf__clear(&spot, sizeof spot);
    psurf__lone_batch(&batch, view.kind, view.points, &spot);
    batch.count = view.row->sectors;
    for (i = 0; i < batch.count; i++) batch.spot[i].sector = i;
    psurf__best_kernels()->hull(&batch, low, high);
    for (i = 0; i < batch.count; i++)
        for (k = 0; k < 3; k++) {
            if (low[k][i] < box[k]) box[k] = low[k][i];
            if (high[k][i] > box[k + 3]) box[k + 3] = high[k][i];
        }
}

static void psurf__face_box(const psurf_patches *patches, uint32_t face, psurf_real *box)
{
    const psurf_topology *t = patches->topology;
    const psurf_real eps = sizeof(psurf_real) == 4 ? PSURF__R(1e-6) : PSURF__R(2e-15);
    const uint32_t first = t->face_facet[face], corners = psurf__face_size(t, face);
    const uint32_t pieces = psurf__is_split(t, face) ? psurf__piece_count(t->split, corners) : 1;
    psurf_real size = 0;
    uint32_t p, k;
    for (k = 0; k < 6; k++) box[k] = psurf__view_facet(patches, first).points[k % 3];
    for (p = 0; p < pieces; p++)
        psurf__facet_box(patches, psurf__piece_facet(t, face, corners, p), box);
    for (k = 0; k < 6; k++)
        if (psurf__abs(box[k]) > size) size = psurf__abs(box[k]);
    for (k = 0; k < 6; k++) box[k] += (k < 3 ? -eps : eps) * size;              /* for rounding */
}

PSURF_API void psurf_bounds(const psurf_patches *patches, uint32_t first_face, uint32_t face_count,
                            psurf_real *min_max)
{
    const uint32_t end = psurf__range_end(first_face, face_count, patches->topology->info.faces);
    uint32_t f;
    for (f = first_face; f < end; f++)
        psurf__face_box(patches, f, min_max + 6 * (size_t)(f - first_face));
}

/* >>11 ALL AT ONCE, AND BUILD FACTS =========================================================== */

static void psurf__carve_smooth(psurf_smooth_mesh *mesh, psurf__block *block)
{
    mesh->positions = PSURF__CARVE(block, psurf_real, 3 * (uint64_t)mesh->vertex_count);
    mesh->normals = PSURF__CARVE(block, psurf_real, 3 * (uint64_t)mesh->vertex_count);
    mesh->indices = PSURF__CARVE(block, uint32_t, mesh->index_count);
    mesh->where = PSURF__CARVE(block, psurf_sample, mesh->vertex_count);
}

/* Tessellates constructed patches into memory of the mesh. */
static psurf_result psurf__fill_smooth(const psurf_patches *patches, uint32_t rate,
                                       psurf_smooth_mesh *mesh)
{
    psurf_tess_desc tess = {0, 0, 0, 0};
    psurf_tess_out out;
    psurf__block block = {NULL, 0};
    psurf_tess_span span;
    psurf_result result;
    psurf__clear(&out, sizeof out);
    tess.rate = rate;
    result = psurf_tessellate_size(patches->topology, &tess, 0, PSURF_NONE, &span);
    if (result != PSURF_OK) return result;
    mesh->vertex_count = span.vertex_count;
    mesh->index_count = span.index_count;
    psurf__carve_smooth(mesh, &block);
    result = psurf__allocate(&mesh->allocator, &block, &mesh->bytes);
    if (result != PSURF_OK) return result;
    psurf__carve_smooth(mesh, &block);
    out.p = mesh->positions;
    out.n = mesh->normals;
    out.indices = mesh->indices;
    out.where = mesh->where;
    return psurf_tessellate(patches, &tess, 0, PSURF_NONE, &out);
}

/* Constructs the patches in a block that lives only here. */
static psurf_result psurf__make_smooth(const psurf_topology *t, const psurf_mesh_desc *desc,
                                       uint32_t rate, psurf_smooth_mesh *mesh)
{
    psurf_construct_desc construct;
    psurf__block block = {NULL, 0};
    psurf_patches_layout layout;
    psurf_patches patches;
    size_t bytes = 0;
    psurf_result result = psurf_patches_size(t, PSURF_PM, &layout);
    if (result != PSURF_OK) return result;
    psurf__clear(&construct, sizeof construct);
    psurf__carve(&block, layout.patch_bytes, 1, 16);
    psurf__carve(&block, layout.scratch_bytes, 1, 16);
    result = psurf__allocate(&t->allocator, &block, &bytes);
    if (result != PSURF_OK) return result;
    patches.patches = psurf__carve(&block, layout.patch_bytes, 1, 16);
    patches.scratch = psurf__carve(&block, layout.scratch_bytes, 1, 16);
    construct.positions = desc->positions;
    construct.position_stride = desc->position_stride;
    result = psurf_patches_bind(&patches, t, PSURF_PM, patches.patches, patches.scratch);
    if (result == PSURF_OK) result = psurf_construct(&patches, &construct);
    if (result == PSURF_OK) result = psurf__fill_smooth(&patches, rate, mesh);
    t->allocator.release(t->allocator.ctx, block.base, bytes);
    return result;
}

PSURF_API psurf_result psurf_smooth(const psurf_mesh_desc *desc, uint32_t rate,
                                    psurf_smooth_mesh *mesh, psurf_error *error)
{
    psurf_topology *t = NULL;
    psurf_result result = PSURF_BAD_DESC;
    if (error) *error = psurf__no_error(PSURF_BAD_DESC);
    if (!mesh) return result;
    psurf__clear(mesh, sizeof(*mesh));
    if (!desc || !desc->positions || rate < 1 || rate > PSURF_MAX_RATE) return result;
    result = psurf_topology_create(desc, &t, error);
    if (result != PSURF_OK) return result;
    mesh->allocator = t->allocator;
    result = psurf__make_smooth(t, desc, rate, mesh);
    if (result != PSURF_OK) psurf__clear(mesh, sizeof(*mesh));
    if (error) *error = psurf__no_error(result);
    psurf_topology_destroy(t);
    return result;
}

PSURF_API void psurf_smooth_free(psurf_smooth_mesh *mesh)
{
    if (!mesh) return;
    if (mesh->bytes) mesh->allocator.release(mesh->allocator.ctx, mesh->positions, mesh->bytes);
    psurf__clear(mesh, sizeof(*mesh));
}

PSURF_API const char *psurf_result_string(psurf_result result)
{
    static const char *const text[PSURF_RESULT_COUNT] = {
#define PSURF__X(name, text) text,
        PSURF_RESULTS(PSURF__X)
#undef PSURF__X
    };
    return (uint32_t)result < PSURF_RESULT_COUNT ? text[result] : "unknown result";
}

PSURF_API const char *psurf_scheme_name(psurf_scheme scheme)
{
    return (uint32_t)scheme < PSURF_SCHEME_COUNT ? psurf__schemes[scheme].name : NULL;
}

PSURF_API psurf_split psurf_scheme_split(psurf_scheme scheme)
{
    return (uint32_t)scheme < PSURF_SCHEME_COUNT ? psurf__schemes[scheme].split : PSURF_SPLIT_PM;
}

PSURF_API const char *psurf_kind_name(psurf_kind kind)
{
    return (uint32_t)kind < PSURF_KIND_COUNT ? psurf__kind_table[kind].name : NULL;
}

PSURF_API uint32_t psurf_version(void) { return PSURF_VERSION; }

PSURF_API uint32_t psurf_abi(void)
{
    return (uint32_t)PSURF_VERSION << 8 | (uint32_t)sizeof(psurf_real);
}

/* Asks the arithmetic itself, through volatile values that no compiler can fold. */
PSURF_API int psurf_exact(void)
{
#ifdef __FAST_MATH__
    return 0;
#else
    const int narrow = sizeof(psurf_real) == 4;
    volatile psurf_real one = 1, slight = PSURF__R(narrow ? 1.0 / 4096 : 1.0 / 134217728);
    volatile psurf_real tiny = PSURF__R(narrow ? 1.17549435e-38 : 2.2250738585072014e-308), half,
                        sum;
    psurf_real square = 1 + slight;
    volatile psurf_real minus = -(1 + 2 * slight);
    sum = square * square + minus;                     /* slight^2 if fused, 0 if rounded between */
    if (sum > 0 || sum < 0) return 0;
    sum = (one + slight * slight / 2) - one;              /* lost, unless registers are wider */
    if (sum > 0) return 0;
    half = tiny / 2;                                    /* subnormal: 0 under FTZ */
    sum = half * 2;                                     /* 0 under DAZ */
    return half > 0 && sum >= tiny;
#endif
}

#undef PSURF__R
#undef PSURF__SQRT
#undef PSURF__INLINE
#undef PSURF__UNROLL
#undef PSURF__SHUFFLE
#undef PSURF__ROLLED
#undef PSURF__LIKELY
#undef PSURF__CARVE
#undef PSURF__CARVE_TABLE
#undef PSURF__ASSERT_SIZE
#undef PSURF__SANITIZED
#undef PSURF__SELF
#undef PSURF__IS_float
#undef PSURF__IS_double
#undef PSURF__IS_OF
#undef PSURF__IS
#undef PSURF__SIMD
#undef PSURF__SIMD_X86
#undef PSURF__DISPATCH
#undef PSURF__EIGHTH
#undef PSURF__VANISHING
#undef PSURF__SLIGHT
#undef PSURF__ORIGIN
#undef PSURF__TENSOR_EDGES
#undef PSURF__BEZIER_EDGES
#undef PSURF__BOUNDARY_EDGES
#undef PSURF__BLOCK
#undef PSURF__PROBES
#undef PSURF__PARALLEL
#undef PSURF__SHORT
#undef PSURF__LONG
#undef PSURF__SET
#undef PSURF__TEXT
#undef PSURF__NAME_OF
#undef PSURF__PASTE
#undef PSURF__PASTE_SET
#undef PSURF__K
#undef psurf__lanes
#undef psurf__l_load
#undef psurf__l_store
#undef psurf__l_all
#undef psurf__l_add
#undef psurf__l_sub
#undef psurf__l_mul
#undef psurf__l_div
#undef psurf__l_sqrt
#undef psurf__l_max
#undef psurf__l_select
#undef psurf__l_greater
#undef psurf__l_columns
#undef psurf__l_fetch
#undef psurf__l_write3
#undef psurf__l_write6
#undef psurf__l3
#undef psurf__l3_select
#undef psurf__l3_zero
#undef psurf__l3_add
#undef psurf__l3_sub
#undef psurf__l3_mul
#undef psurf__l3_mad
#undef psurf__l3_mix
#undef psurf__l3_dot
#undef psurf__l3_cross
#undef psurf__l3_store
#undef psurf__l3_put
#if defined(__clang__)
#if defined(__x86_64__) || defined(__i386__)
#pragma float_control(pop)
#else
#pragma STDC FP_CONTRACT DEFAULT
#endif
#elif defined(__GNUC__)
#pragma GCC pop_options
#elif defined(_MSC_VER)
#pragma float_control(pop)
#endif
#undef PSURF__IMPLEMENTING
#undef PSURF__ONCE
#endif /* PSURF__ONCE */

/*
This software is available under two licences: take whichever you prefer.

------------------------------------------------------------------------------
ALTERNATIVE A - MIT License

Copyright (c) 2026 the patchsurf authors

Permission is hereby granted, free of charge, to any person obtaining a copy of
this software and associated documentation files (the "Software"), to deal in
the Software without restriction, including without limitation the rights to
use, copy, modify, merge, publish, distribute, sublicense, and/or sell copies
of the Software, and to permit persons to whom the Software is furnished to do
so, subject to the following conditions:

The above copyright notice and this permission notice shall be included in all
copies or substantial portions of the Software.

THE SOFTWARE IS PROVIDED "AS IS", WITHOUT WARRANTY OF ANY KIND, EXPRESS OR
IMPLIED, INCLUDING BUT NOT LIMITED TO THE WARRANTIES OF MERCHANTABILITY,
FITNESS FOR A PARTICULAR PURPOSE AND NONINFRINGEMENT. IN NO EVENT SHALL THE
AUTHORS OR COPYRIGHT HOLDERS BE LIABLE FOR ANY CLAIM, DAMAGES OR OTHER
LIABILITY, WHETHER IN AN ACTION OF CONTRACT, TORT OR OTHERWISE, ARISING FROM,
OUT OF OR IN CONNECTION WITH THE SOFTWARE OR THE USE OR OTHER DEALINGS IN THE
SOFTWARE.

------------------------------------------------------------------------------
ALTERNATIVE B - Public Domain (Unlicense, www.unlicense.org)

This is free and unencumbered software released into the public domain.

Anyone is free to copy, modify, publish, use, compile, sell, or distribute this
software, either in source code form or as a compiled binary, for any purpose,
commercial or non-commercial, and by any means.

In jurisdictions that recognize copyright laws, the author or authors of this
software dedicate any and all copyright interest in the software to the public
domain. We make this dedication for the benefit of the public at large and to
the detriment of our heirs and successors. We intend this dedication to be an
overt act of relinquishment in perpetuity of all present and future rights to
this software under copyright law.

THE SOFTWARE IS PROVIDED "AS IS", WITHOUT WARRANTY OF ANY KIND, EXPRESS OR
IMPLIED, INCLUDING BUT NOT LIMITED TO THE WARRANTIES OF MERCHANTABILITY,
FITNESS FOR A PARTICULAR PURPOSE AND NONINFRINGEMENT. IN NO EVENT SHALL THE
AUTHORS BE LIABLE FOR ANY CLAIM, DAMAGES OR OTHER LIABILITY, WHETHER IN AN
ACTION OF CONTRACT, TORT OR OTHERWISE, ARISING FROM, OUT OF OR IN CONNECTION
WITH THE SOFTWARE OR THE USE OR OTHER DEALINGS IN THE SOFTWARE.
*/
