/* surface.c - patchsurf's stages as runners; the implementation of patchsurf.h is compiled here. */

#define PSURF_IMPLEMENTATION
#include "patchsurf.h"              /* first: its names may be anything */

#include "surface.h"

#include <stdlib.h>
#include <string.h>

/* ---- an allocator that counts ---------------------------------------------------------------- */

static void *counted_alloc(void *ctx, size_t size, size_t align)
{
    counter *c = (counter *)ctx;
    (void)align;                        /* at most 16: malloc's own on the machines benched */
    c->calls++;
    c->held += size;
    if (c->held > c->peak) c->peak = c->held;
    return malloc(size);
}

static void counted_release(void *ctx, void *memory, size_t size)
{
    ((counter *)ctx)->held -= size;
    free(memory);
}

/* ---- stages ---------------------------------------------------------------------------------- */

static psurf_topology *create_topology(const psurf_mesh_desc *desc)
{
    psurf_topology *topology;
    if (psurf_topology_create(desc, &topology, NULL)) fail("a topology was refused");
    return topology;
}

/* Patches and their memory, which the caller frees. */
static psurf_patches make_patches(const psurf_topology *topology, psurf_scheme scheme)
{
    psurf_patches_layout layout;
    psurf_patches patches;
    memset(&patches, 0, sizeof patches);
    if (psurf_patches_size(topology, scheme, &layout) ||
        psurf_patches_bind(&patches, topology, scheme, allocate(layout.patch_bytes),
                           allocate(layout.scratch_bytes)))
        fail("patches were refused");
    return patches;
}

void surface_open_as(surface *s, const mesh *m, psurf_scheme scheme,
                     const psurf_construct_desc *options)
{
    psurf_mesh_desc counted;
    memset(s, 0, sizeof *s);
    s->m = m;
    s->desc.split = psurf_scheme_split(scheme);
    s->desc.vertex_count = m->vertices;
    s->desc.face_count = m->faces;
    s->desc.face_sizes = m->face_sizes;
    s->desc.face_vertices = m->face_vertices;
    counted = s->desc;
    counted.allocator.alloc = counted_alloc;
    counted.allocator.release = counted_release;
    counted.allocator.ctx = &s->memory;
    s->topology = create_topology(&counted);
    psurf_topology_info(s->topology, &s->info);
    s->patches = make_patches(s->topology, scheme);
    s->construct = *options;
    s->construct.positions = m->positions;
    run_refresh(s);
}

void surface_open(surface *s, const mesh *m)
{
    psurf_construct_desc none;
    memset(&none, 0, sizeof none);
    surface_open_as(s, m, PSURF_PM, &none);
}

void surface_close(surface *s)
{
    psurf_topology_destroy(s->topology);
    if (s->memory.held) fail("a topology left memory behind");
    free(s->patches.patches);
    free(s->patches.scratch);
}

double run_build(void *what)
{
    const surface *s = (const surface *)what;
    const double start = work_time();
    psurf_topology *topology = create_topology(&s->desc);
    psurf_patches patches = make_patches(topology, s->patches.scheme);
    const double seconds = work_time() - start;
    free(patches.patches);
    free(patches.scratch);
    psurf_topology_destroy(topology);
    return seconds;
}

double run_refresh(void *what)
{
    const surface *s = (const surface *)what;
    const double start = work_time();
    if (psurf_construct(&s->patches, &s->construct)) fail("construction failed");
    return work_time() - start;
}

static double run_pass(const surface *s, psurf_pass pass)
{
    const double start = work_time();
    if (psurf_construct_pass(&s->patches, &s->construct, pass, 0, UINT32_MAX))
        fail("construction failed");
    return work_time() - start;
}

double run_vertices(void *s) { return run_pass((const surface *)s, PSURF_PASS_VERTICES); }
double run_facets(void *s) { return run_pass((const surface *)s, PSURF_PASS_FACETS); }

/* ---- tessellation ---------------------------------------------------------------------------- */

static psurf_tess_span span_of(const tessellation *t, uint32_t first, uint32_t faces)
{
    psurf_tess_span span;
    if (psurf_tessellate_size(t->s->topology, &t->desc, first, faces, &span))
        fail("a tessellation was refused");
    return span;
}

void tessellation_open(tessellation *t, surface *s, uint32_t n, point_normals normals, float *out)
{
    const size_t point = normals ? 24 : 12;
    size_t most = STORE_BYTES / (point * n * n);
    memset(t, 0, sizeof *t);
    t->s = s;
    t->desc.rate = n - 1;
    t->desc.flags = PSURF_TESS_PER_FACE;
    t->normals = normals;
    t->out = out;
    if (s->info.kind_faces[PSURF_P5]) most = most * 2 / 5;      /* they have 2.5 times the points */
    t->faces = s->m->faces < most ? s->m->faces : (uint32_t)most;
    t->points = span_of(t, 0, t->faces).vertex_count;
    if (t->points * (double)point > STORE_BYTES) fail("a tessellation does not fit its memory");
}

void tessellation_resize(tessellation *t, double points)
{
    const double faces = points / span_of(t, 0, 1).vertex_count;
    t->faces = t->s->m->faces < faces ? t->s->m->faces : (uint32_t)faces;
    t->points = span_of(t, 0, t->faces).vertex_count;
    if (t->points > points) fail("the faces of a mesh have unlike numbers of samples");
}

void tessellate(const tessellation *t, uint32_t first, uint32_t faces, float *p)
{
    const psurf_tess_span span = span_of(t, first, faces);
    psurf_tess_out out;
    memset(&out, 0, sizeof out);
    out.p = p;
    out.first_vertex = span.first_vertex;
    if (t->normals != NO_NORMALS) out.p_stride = out.n_stride = out.shade_stride = 24;
    if (t->normals == SURFACE_NORMALS) out.n = p + 3;
    if (t->normals == SHADING_NORMALS) out.shade = p + 3;
    if (psurf_tessellate(&t->s->patches, &t->desc, first, faces, &out)) fail("tessellation failed");
}

double run_frame(void *what)
{
    const tessellation *t = (const tessellation *)what;
    const double start = work_time();
    if (psurf_construct(&t->s->patches, &t->s->construct)) fail("construction failed");
    tessellate(t, 0, t->faces, t->out);
    return work_time() - start;
}

double run_tessellation(void *what)
{
    tessellation *t = (tessellation *)what;
    const double start = work_time();
    double seconds;
    tessellate(t, t->first, t->faces, t->out);
    seconds = work_time() - start;
    t->first = t->first + 2 * t->faces <= t->s->m->faces ? t->first + t->faces : 0;
    return seconds;
}
