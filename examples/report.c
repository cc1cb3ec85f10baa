/* patchsurf report: the published tables, computed anew in double precision.

   The papers: [GB] M. Boschiroli, C. Fuenfzig, L. Romani, G. Albrecht: G1 rational blend
   interpolatory schemes: a comparative study. [PM] A. Myles, T. Ni, J. Peters: Fast parallel
   construction of smooth surfaces from meshes with tri/quad/pent facets, SGP 2008.

   From top to bottom: figures and how they are collected, meshes, surfaces, the tables of distances
   and curvature, the plot, operations, patches. */

#define PSURF_REAL double
#define PSURF_STATIC
#define PSURF_IMPLEMENTATION
#include "../patchsurf.h"
#include "tool.h"

#include <inttypes.h>
#include <math.h>
#include <string.h>

enum { SEGMENTS = 20 };                 /* per edge of a triangle, in all tables of [GB] */
enum { MAX_SPHERE = 8, MIN_TORUS = 3, MAX_TORUS = 1000 };   /* steps; 1.3 and 2 million triangles */

/* ---- figures --------------------------------------------------------------------------------- */

typedef struct stats {
    uint64_t count, undefined;          /* undefined: not finite, and left out */
    double min, max, mean, mean_size;   /* mean_size: of absolute values */
    double squares;                     /* sum of squared deviations from the mean */
} stats;

static void add_value(stats *s, double x)
{
    double step;
    if (!isfinite(x)) {
        s->undefined++;
        return;
    }
    s->min = s->count && s->min < x ? s->min : x;
    s->max = s->count && s->max > x ? s->max : x;
    step = x - s->mean;
    s->mean += step / (double)++s->count;
    s->squares += step * (x - s->mean);
    s->mean_size += (fabs(x) - s->mean_size) / (double)s->count;
}

/* The standard deviation, as [GB] prints it: the sum of squares divided by one less than the count.
   In Tables 3 and 4 deviations were taken from half the mean. */
static double deviation(const stats *s, bool from_half_mean)
{
    double variance = s->squares / ((double)s->count - 1);
    return sqrt(from_half_mean ? variance + s->mean * s->mean / 4 : variance);
}

typedef struct printed {
    const char *mesh;
    int64_t step;
    const char *scheme;
    double min, max, mean, std;
} printed;

static const printed distances[] = {    /* [GB] Tables 3 and 4 */
    {"sphere", 0, "hybrid", -0.00274014, 0.0131108, 0.00498299, 0.00479724},
    {"sphere", 0, "png1", -0.0111526, 0, -0.00695174, 0.00452694},
    {"sphere", 0, "wm", -0.0105214, 0, -0.00507952, 0.00375258},
    {"sphere", 0, "cubic_wm_b1", -0.0105212, 0, -0.0050795, 0.00375258},
    {"sphere", 1, "hybrid", -0.000161588, 0.00126064, 0.000440331, 0.000403261},
    {"sphere", 1, "png1", -0.00230867, 0, -0.000629614, 0.000615845},
    {"sphere", 1, "wm", -0.000817776, 0, -0.000329054, 0.000245696},
    {"sphere", 1, "cubic_wm_b1", -0.000817716, 0, -0.000329053, 0.000245695},
    {"torus", 5, "hybrid", -0.0227294, 0.0478425, 0.00720392, 0.015833},
    {"torus", 5, "png1", -0.158901, 0.044207, -0.00913514, 0.0326367},
    {"torus", 5, "wm", -0.0977793, 0.0493978, -0.00872526, 0.0304518},
    {"torus", 5, "cubic_wm_b1", -0.0977793, 0.0493978, -0.00872526, 0.0304518},
    {"torus", 10, "hybrid", -0.00262406, 0.00356019, 0.000410239, 0.000964081},
    {"torus", 10, "png1", -0.00952291, 0.00411868, -0.000726871, 0.00221538},
    {"torus", 10, "wm", -0.00544271, 0.00396627, -0.000399186, 0.00178612},
    {"torus", 10, "cubic_wm_b1", -0.00544268, 0.00396627, -0.000399186, 0.00178612},
    {"torus", 20, "hybrid", -0.000292093, 0.000354946, 2.6755e-05, 0.000100177},
    {"torus", 20, "png1", -0.000647008, 0.000430048, -4.78646e-05, 0.00017302},
    {"torus", 20, "wm", -0.000424266, 0.000427842, -1.60885e-05, 0.000150207},
    {"torus", 20, "cubic_wm_b1", -0.000424266, 0.000427842, -1.60887e-05, 0.000150205},
    {NULL, 0, NULL, 0, 0, 0, 0},
};

static const printed curvatures[] = {   /* [GB] Table 6 */
    {"sphere", 0, "hybrid", 0.327537, 1.83937, 0.901277, 0.414196},
    {"sphere", 0, "png1", 0.807412, 1.45757, 1.04739, 0.131043},
    {"sphere", 0, "cubic_wm_b1", 0.768408, 1.1719, 0.971776, 0.123817},
    {"torus", 5, "hybrid", -820.956, 63.2143, -2.50575, 29.3715},
    {"torus", 5, "png1", -8.33147, 8.23699, -0.585947, 2.33862},
    {"torus", 5, "cubic_wm_b1", -9.8852, 10.9848, -0.61218, 2.58269},
    {NULL, 0, NULL, 0, 0, 0, 0},
};

static const printed cosines[] = {      /* [GB] Table 5 */
    {"torus", 5, "normals", 0.620812, 0.826384, 0.726595, 0.0808356},
    {NULL, 0, NULL, 0, 0, 0, 0},
};

typedef struct row {
    const char *mesh;
    int64_t step;
    const char *scheme;
    stats s;
} row;

static const printed *find_printed(const printed *table, const row *r)
{
    for (; table->mesh; table++) {
        if (strcmp(table->mesh, r->mesh) == 0 && table->step == r->step
            && strcmp(table->scheme, r->scheme) == 0) return table;
    }
    return NULL;
}

static void put_text(FILE *file, const char *text)
{
    fputc('"', file);
    for (; *text; text++) {
        unsigned char c = (unsigned char)*text;
        if (c == '"' || c == '\\') fprintf(file, "\\%c", c);
        else if (c < ' ') fprintf(file, "\\u%04x", c);
        else fputc(c, file);
    }
    fputc('"', file);
}

static void put_member(FILE *file, const char *before, double value)
{
    fputs(before, file);
    if (isfinite(value)) fprintf(file, "%.15g", value);
    else fputs("null", file);
}

/* half: the printed deviations are from half the mean. */
static void print_json_rows(FILE *file, const array *rows, const printed *table, bool half)
{
    size_t i;
    for (i = 0; i < rows->count; i++) {
        const row *r = (const row *)rows->data + i;
        const printed *p = find_printed(table, r);
        bool none = r->s.count == 0;
        fputs(i ? ",\n{\"mesh\":" : "{\"mesh\":", file);
        put_text(file, r->mesh);
        fprintf(file, ",\"step\":%" PRId64 ",\"scheme\":\"%s\"", r->step, r->scheme);
        put_member(file, ",\"min\":", none ? nan("") : r->s.min);
        put_member(file, ",\"max\":", none ? nan("") : r->s.max);
        put_member(file, ",\"mean\":", none ? nan("") : r->s.mean);
        put_member(file, ",\"std\":", deviation(&r->s, false));
        put_member(file, ",\"std_printed\":", deviation(&r->s, half));
        if (p) {
            put_member(file, ",\"printed\":{\"min\":", p->min);
            put_member(file, ",\"max\":", p->max);
            put_member(file, ",\"mean\":", p->mean);
            put_member(file, ",\"std\":", p->std);
            fputc('}', file);
        }
        fputc('}', file);
    }
}

/* One line of figures; NaN: the column stays empty. */
static void print_figures(FILE *file, const char *name, const double figures[5])
{
    int i;
    fprintf(file, "%-14s", name);
    for (i = 0; i < 5; i++) {
        if (isnan(figures[i])) fprintf(file, "%14s", "");
        else fprintf(file, "%14.6g", figures[i]);
    }
    fputc('\n', file);
}

static void print_row(FILE *file, const row *r, const printed *p, bool half)
{
    double computed[5], known[5], difference[5];
    int i;
    computed[0] = r->s.count ? r->s.min : nan("");
    computed[1] = r->s.count ? r->s.max : nan("");
    computed[2] = r->s.count ? r->s.mean : nan("");
    computed[3] = deviation(&r->s, false);
    computed[4] = deviation(&r->s, half);
    fprintf(file, "%-12s %5" PRId64 "  ", r->mesh, r->step);
    print_figures(file, r->scheme, computed);
    if (r->s.undefined) fprintf(file, "%22s%" PRIu64 " samples have none\n", "", r->s.undefined);
    if (!p) return;
    known[0] = p->min;
    known[1] = p->max;
    known[2] = p->mean;
    known[3] = nan("");
    known[4] = p->std;
    for (i = 0; i < 5; i++) difference[i] = computed[i] - known[i];
    fprintf(file, "%20s", "");
    print_figures(file, "  printed", known);
    fprintf(file, "%20s", "");
    print_figures(file, "  difference", difference);
}

static void print_rows(FILE *file, const array *rows, const printed *table, bool half)
{
    size_t i;
    fprintf(file, "%-12s %5s  %-14s%14s%14s%14s%14s%14s\n", "mesh", "step", "scheme", "min", "max",
            "mean", "std", "std_printed");
    for (i = 0; i < rows->count; i++) {
        const row *r = (const row *)rows->data + i;
        print_row(file, r, find_printed(table, r), half);
    }
}

/* ---- meshes ---------------------------------------------------------------------------------- */

/* Triangles. Where a face corner or an edge has no number of its own, the vertices' are taken. */
typedef struct shape {
    array points;                       /* double[3] per vertex */
    array corners;                      /* uint32_t[3] per triangle */
    array normals;                      /* double[3] each, or none */
    array corner_normals;               /* uint32_t[3] per triangle, or none: that of the vertex */
    array edges;                        /* psurf_edge_tag */
    const uint32_t *fixed;              /* vertices that stay in place */
    uint32_t fixed_count;
} shape;

static void free_shape(shape *s)
{
    free(s->points.data);
    free(s->corners.data);
    free(s->normals.data);
    free(s->corner_normals.data);
    free(s->edges.data);
}

static const double *point_at(const array *points, size_t i)
{
    return (const double *)points->data + 3 * i;
}

static void push_point(array *points, double x, double y, double z)
{
    double *p = push(points, 3 * sizeof *p);
    p[0] = x;
    p[1] = y;
    p[2] = z;
}

static void push_number(array *numbers, uint32_t value)
{
    uint32_t *number = push(numbers, sizeof *number);
    *number = value;
}

static void push_triangle(shape *s, uint32_t a, uint32_t b, uint32_t c)
{
    push_number(&s->corners, a);
    push_number(&s->corners, b);
    push_number(&s->corners, c);
}

static double dot(const double a[3], const double b[3])
{
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}

static void normalize(double a[3])
{
    double length = sqrt(dot(a, a));
    int i;
    for (i = 0; i < 3 && length > 0; i++) a[i] /= length;
}

/* Unit normal of the triangle a b c. */
static void triangle_normal(const double *a, const double *b, const double *c, double n[3])
{
    double d[3], e[3];
    int i;
    for (i = 0; i < 3; i++) {
        d[i] = b[i] - a[i];
        e[i] = c[i] - a[i];
    }
    for (i = 0; i < 3; i++) {
        n[i] = d[(i + 1) % 3] * e[(i + 2) % 3] - d[(i + 2) % 3] * e[(i + 1) % 3];
    }
    normalize(n);
}

static void make_icosahedron(shape *s)
{
    static const double golden = 1.6180339887498949;
    static const uint32_t faces[20][3] = {
        {0, 2, 8}, {0, 9, 2}, {0, 4, 6}, {0, 8, 4}, {0, 6, 9}, {1, 10, 3}, {1, 3, 11}, {1, 6, 4},
        {1, 4, 10}, {1, 11, 6}, {2, 7, 5}, {2, 5, 8}, {2, 9, 7}, {3, 5, 7}, {3, 10, 5}, {3, 7, 11},
        {4, 8, 10}, {5, 10, 8}, {6, 11, 9}, {7, 9, 11}};
    int i;
    for (i = 0; i < 12; i++) {          /* (0, +-1, +-golden), and its two rotations */
        const int turn = i / 4;
        double p[3] = {0, 0, 0};
        p[(4 - turn) % 3] = i % 4 < 2 ? 1 : -1;
        p[2 - turn] = i % 2 ? -golden : golden;
        normalize(p);
        push_point(&s->points, p[0], p[1], p[2]);
    }
    for (i = 0; i < 20; i++) push_triangle(s, faces[i][0], faces[i][1], faces[i][2]);
}

/* A triangle's side: its lower and its higher vertex, and where it is in shape.corners. */
typedef struct triangle_side { uint32_t low, high, place; } triangle_side;

static int compare_sides(const void *left, const void *right)
{
    const triangle_side *a = left, *b = right;
    if (a->low != b->low) return a->low < b->low ? -1 : 1;
    if (a->high != b->high) return a->high < b->high ? -1 : 1;
    return a->place < b->place ? -1 : a->place > b->place;
}

/* Adds the middle of every edge, on the unit sphere. Returns its vertex for each side. */
static uint32_t *add_middles(shape *s)
{
    const uint32_t *corners = s->corners.data;
    size_t count = s->corners.count, i;
    uint32_t *middles = resize(NULL, count, sizeof *middles);
    triangle_side *sides = resize(NULL, count, sizeof *sides);
    for (i = 0; i < count; i++) {
        uint32_t a = corners[i], b = corners[i % 3 == 2 ? i - 2 : i + 1];
        sides[i].low = a < b ? a : b;
        sides[i].high = a < b ? b : a;
        sides[i].place = (uint32_t)i;
    }
    qsort(sides, count, sizeof *sides, compare_sides);
    for (i = 0; i < count; i++) {
        if (i == 0 || sides[i].low != sides[i - 1].low || sides[i].high != sides[i - 1].high) {
            const double *p = point_at(&s->points, sides[i].low);
            const double *q = point_at(&s->points, sides[i].high);
            double middle[3];
            int k;
            for (k = 0; k < 3; k++) middle[k] = p[k] + q[k];
            normalize(middle);
            push_point(&s->points, middle[0], middle[1], middle[2]);
        }
        middles[sides[i].place] = (uint32_t)s->points.count - 1;
    }
    free(sides);
    return middles;
}

static void split_in_four(shape *s)
{
    uint32_t *middles = add_middles(s);
    array old = s->corners;
    size_t i;
    memset(&s->corners, 0, sizeof s->corners);
    for (i = 0; i < old.count; i += 3) {
        const uint32_t *v = (const uint32_t *)old.data + i, *m = middles + i;
        push_triangle(s, v[0], m[0], m[2]);
        push_triangle(s, m[0], v[1], m[1]);
        push_triangle(s, m[2], m[1], v[2]);
        push_triangle(s, m[0], m[1], m[2]);
    }
    free(old.data);
    free(middles);
}

/* Normals are positions. */
static void make_sphere(shape *s, int64_t step)
{
    size_t i;
    memset(s, 0, sizeof *s);
    make_icosahedron(s);
    while (step-- > 0) split_in_four(s);
    for (i = 0; i < s->points.count; i++) {
        const double *p = point_at(&s->points, i);
        push_point(&s->normals, p[0], p[1], p[2]);
    }
}

static uint32_t torus_vertex(int64_t size, int64_t i, int64_t j)
{
    return (uint32_t)(i % size * size + j % size);
}

/* Radii 1 and 1/2; the tube begins at the inner equator. Normals: the library's mean. */
static void make_torus(shape *s, int64_t size)
{
    const double turn = 2 * acos(-1.0) / (double)size;
    int64_t i, j;
    memset(s, 0, sizeof *s);
    for (i = 0; i < size; i++) {
        for (j = 0; j < size; j++) {
            double around = (double)i * turn, tube = acos(-1.0) + (double)j * turn;
            double r = 1 + cos(tube) / 2;
            push_point(&s->points, r * cos(around), r * sin(around), sin(tube) / 2);
        }
    }
    for (i = 0; i < size; i++) {
        for (j = 0; j < size; j++) {
            uint32_t a = torus_vertex(size, i, j), b = torus_vertex(size, i + 1, j);
            uint32_t c = torus_vertex(size, i + 1, j + 1), d = torus_vertex(size, i, j + 1);
            push_triangle(s, a, b, c);
            push_triangle(s, a, c, d);
        }
    }
}

/* A polygon becomes a fan round its vertex of the lowest number, as in the library. */
static void push_fan(shape *s, const mesh *m, size_t first, uint32_t size, bool normals)
{
    const uint32_t *v = (const uint32_t *)m->corners.data + first;
    const uint32_t *n = (const uint32_t *)m->corner_normals.data + (normals ? first : 0);
    uint32_t low = 0, i, k;
    for (i = 1; i < size; i++) {
        if (v[i] < v[low]) low = i;
    }
    for (i = 1; i + 1 < size; i++) {
        const uint32_t at[3] = {low, (low + i) % size, (low + i + 1) % size};
        push_triangle(s, v[at[0]], v[at[1]], v[at[2]]);
        for (k = 0; k < 3 && normals; k++) push_number(&s->corner_normals, n[at[k]]);
    }
}

static void push_tags(shape *s, const mesh *m)
{
    size_t i;
    for (i = 0; i < m->creases.count; i++) {
        const tag *t = (const tag *)m->creases.data + i;
        psurf_edge_tag *e = push(&s->edges, sizeof *e);
        e->v0 = t->v0;
        e->v1 = t->v1;
        e->flags = t->sharpness >= HARD_FROM ? PSURF_HARD : PSURF_BLEND;
        e->blend0 = e->blend1 = 2.0 / 3.0 * exp2(-fmax(0.0, (double)t->sharpness));
    }
}

static void take_mesh(shape *s, const report_desc *desc)
{
    const mesh *m = desc->mesh;
    const float *p = m->positions.data, *n = m->normals.data;
    size_t face, first = 0, i;
    memset(s, 0, sizeof *s);
    for (i = 0; i < 3 * m->positions.count; i += 3) {
        push_point(&s->points, (double)p[i], (double)p[i + 1], (double)p[i + 2]);
    }
    for (i = 0; desc->file_normals && i < 3 * m->normals.count; i += 3) {
        push_point(&s->normals, (double)n[i], (double)n[i + 1], (double)n[i + 2]);
    }
    for (face = 0; face < m->sizes.count; face++) {
        uint32_t size = ((const uint32_t *)m->sizes.data)[face];
        push_fan(s, m, first, size, desc->file_normals);
        first += size;
    }
    push_tags(s, m);
    s->fixed = desc->corners;
    s->fixed_count = desc->corner_count;
}

/* ---- surfaces -------------------------------------------------------------------------------- */

typedef struct surface {
    psurf_topology *topology;
    psurf_patches patches;
    uint32_t faces;
} surface;

/* The meshes are valid, so what remains to go wrong is their size. */
static void must(const report_desc *desc, psurf_result result)
{
    if (result == PSURF_OK) return;
    fail(desc->mesh ? desc->mesh->name : "patchsurf", 0, "%s", psurf_result_string(result));
}

static psurf_scheme find_scheme(const char *name)
{
    int i;
    for (i = 0; i < PSURF_SCHEME_COUNT; i++) {
        if (strcmp(name, psurf_scheme_name((psurf_scheme)i)) == 0) return (psurf_scheme)i;
    }
    return PSURF_WM;                    /* the one name that is not the library's */
}

static void create_topology(surface *s, const shape *m, const report_desc *desc, psurf_split split)
{
    psurf_mesh_desc of;
    memset(&of, 0, sizeof of);
    of.vertex_count = (uint32_t)m->points.count;
    of.face_count = s->faces = (uint32_t)(m->corners.count / 3);
    of.uniform_size = 3;
    of.face_vertices = m->corners.data;
    of.edges = m->edges.data;
    of.edge_count = (uint32_t)m->edges.count;
    of.corners = m->fixed;
    of.corner_count = m->fixed_count;
    of.split = split;
    if (m->corner_normals.count) {
        of.face_normals = m->corner_normals.data;
        of.normal_count = (uint32_t)m->normals.count;
    }
    must(desc, psurf_topology_create(&of, &s->topology, NULL));
}

static void make_surface(surface *s, const shape *m, psurf_scheme scheme, const report_desc *desc)
{
    psurf_construct_desc construct;
    psurf_patches_layout layout;
    create_topology(s, m, desc, psurf_scheme_split(scheme));
    memset(&construct, 0, sizeof construct);
    construct.positions = m->points.data;
    construct.normals = m->normals.count ? m->normals.data : NULL;
    construct.normal_mode = (psurf_normal_mode)desc->normal_mode;
    construct.variant = (psurf_variant)desc->variant;
    construct.flags = desc->flags;
    construct.sigma = desc->sigma;
    must(desc, psurf_patches_size(s->topology, scheme, &layout));
    must(desc, psurf_patches_bind(&s->patches, s->topology, scheme,
                                  resize(NULL, layout.patch_bytes, 1),
                                  resize(NULL, layout.scratch_bytes, 1)));
    must(desc, psurf_construct(&s->patches, &construct));
}

static void free_surface(surface *s)
{
    free(s->patches.patches);
    free(s->patches.scratch);
    psurf_topology_destroy(s->topology);
}

/* ---- tables of distances and curvature ------------------------------------------------------- */

enum { POINTS = (SEGMENTS + 1) * (SEGMENTS + 2) / 2 };      /* of a triangle, its border included */

static double distance_to_sphere(const double p[3]) { return sqrt(dot(p, p)) - 1; }

static double distance_to_torus(const double p[3])
{
    double out = sqrt(p[0] * p[0] + p[1] * p[1]) - 1;
    return sqrt(out * out + p[2] * p[2]) - 0.5;
}

/* A mesh at a step, with all that is to be said of it. distance NULL: Gaussian curvature. */
typedef struct subject {
    const char *mesh;
    int64_t step;
    double (*distance)(const double p[3]);
    shape shape;
} subject;

static void sample_distances(const surface *s, const subject *of, uint32_t first, uint32_t count,
                             double *points, stats *result)
{
    psurf_tess_desc tess;
    psurf_tess_out out;
    uint32_t i;
    memset(&tess, 0, sizeof tess);
    memset(&out, 0, sizeof out);
    tess.rate = SEGMENTS;
    tess.flags = PSURF_TESS_PER_FACE;
    out.p = points;
    out.first_vertex = POINTS * first;
    psurf_tessellate(&s->patches, &tess, first, count, &out);
    for (i = 0; i < POINTS * count; i++) add_value(result, of->distance(points + 3 * (size_t)i));
}

/* Curvature is taken inside the triangles alone. */
static void sample_curvature(const surface *s, uint32_t face, uint32_t end, stats *result)
{
    psurf_sample samples[POINTS];
    double values[POINTS];
    for (; face < end; face++) {
        uint32_t count = 0, i, j;
        for (j = 1; j < SEGMENTS; j++) {
            for (i = 1; i + j < SEGMENTS; i++) {
                samples[count].face = face;
                samples[count].sector = 0;
                samples[count].u = (double)i / SEGMENTS;
                samples[count++].v = (double)j / SEGMENTS;
            }
        }
        psurf_curvature(&s->patches, samples, count, values, NULL);
        for (i = 0; i < count; i++) add_value(result, values[i]);
    }
}

/* Faces go together: the library evaluates eight at once. */
static void sample_surface(const surface *s, const subject *of, stats *result, uint64_t done,
                           uint64_t total)
{
    enum { AT_ONCE = 64 };
    double *points = resize(NULL, AT_ONCE * POINTS, 3 * sizeof *points);
    uint32_t face;
    memset(result, 0, sizeof *result);
    for (face = 0; face < s->faces; face += AT_ONCE) {
        uint32_t count = s->faces - face < AT_ONCE ? s->faces - face : AT_ONCE;
        if (of->distance) sample_distances(s, of, face, count, points, result);
        else sample_curvature(s, face, face + count, result);
        progress(done + face, total);
    }
    free(points);
}

static const char *const table_schemes[] = {"hybrid", "png1", "wm", "cubic_wm_b1"};
enum { TABLE_SCHEMES = sizeof table_schemes / sizeof *table_schemes };

/* One row a scheme: those of the tables, or that of the command line. */
static void add_rows(array *rows, const subject *of, const report_desc *desc)
{
    const uint64_t faces = of->shape.corners.count / 3;
    psurf_scheme before = PSURF_SCHEME_COUNT;
    uint64_t i, count = desc->scheme ? 1 : TABLE_SCHEMES;
    for (i = 0; i < count; i++) {
        const char *name = desc->scheme ? desc->scheme : table_schemes[i];
        const psurf_scheme scheme = find_scheme(name);
        row *r;
        surface s;
        if (!desc->scheme && !of->distance && strcmp(name, "wm") == 0) continue;   /* Table 6 */
        r = push(rows, sizeof *r);
        r->mesh = of->mesh;
        r->step = of->step;
        r->scheme = name;
        if (scheme == before) {         /* two names of one surface */
            r->s = r[-1].s;
            continue;
        }
        before = scheme;
        make_surface(&s, &of->shape, scheme, desc);
        sample_surface(&s, of, &r->s, i * faces, count * faces);
        free_surface(&s);
    }
}

/* The means of the normals of the quads around each vertex, against the triangles' normals. */
static void add_cosines(array *rows, const subject *of)
{
    const uint32_t *corners = of->shape.corners.data;
    const array *points = &of->shape.points;
    array normals = {NULL, 0, 0};
    row *r = push(rows, sizeof *r);
    size_t i, k;
    memset(r, 0, sizeof *r);
    r->mesh = of->mesh;
    r->step = of->step;
    r->scheme = "normals";
    for (i = 0; i < points->count; i++) push_point(&normals, 0, 0, 0);
    for (i = 0; i < of->shape.corners.count; i += 6) {      /* both triangles of a quad, flat */
        const uint32_t quad[4] = {corners[i], corners[i + 1], corners[i + 2], corners[i + 5]};
        double n[3];
        triangle_normal(point_at(points, quad[0]), point_at(points, quad[1]),
                        point_at(points, quad[2]), n);
        for (k = 0; k < 12; k++) {
            ((double *)normals.data)[3 * (size_t)quad[k / 3] + k % 3] += n[k % 3];
        }
    }
    for (i = 0; i < points->count; i++) normalize((double *)normals.data + 3 * i);
    for (i = 0; i < of->shape.corners.count; i++) {
        const uint32_t *v = corners + i / 3 * 3;
        double n[3];
        triangle_normal(point_at(points, v[0]), point_at(points, v[1]), point_at(points, v[2]), n);
        add_value(&r->s, dot(n, point_at(&normals, corners[i])));
    }
    free(normals.data);
}

static void start_subject(subject *of, const char *name, int64_t step, const report_desc *desc)
{
    const bool sphere = strcmp(name, "sphere") == 0;
    of->mesh = name;
    of->step = step;
    of->distance = sphere ? distance_to_sphere : distance_to_torus;
    if (sphere) make_sphere(&of->shape, step);
    else make_torus(&of->shape, step);
    if (desc->computed_normals) of->shape.normals.count = 0;
}

static void report_curvature(const report_desc *desc)
{
    const bool sphere = desc->step <= MAX_SPHERE, torus = desc->step < 0 || desc->step >= MIN_TORUS;
    array rows = {NULL, 0, 0};
    subject of;
    output out;
    if (sphere) {
        start_subject(&of, "sphere", desc->step < 0 ? 0 : desc->step, desc);
        of.distance = NULL;
        add_rows(&rows, &of, desc);
        free_shape(&of.shape);
    }
    if (torus) {
        start_subject(&of, "torus", desc->step < 0 ? 5 : desc->step, desc);
        of.distance = NULL;
        add_rows(&rows, &of, desc);
        free_shape(&of.shape);
    }
    if (desc->mesh) {
        of.mesh = desc->mesh->name;
        of.step = 0;
        of.distance = NULL;
        take_mesh(&of.shape, desc);
        add_rows(&rows, &of, desc);
        free_shape(&of.shape);
    }
    out = open_output(NULL);
    if (desc->json) {
        fputs("{\"rows\":[\n", out.file);
        print_json_rows(out.file, &rows, curvatures, false);
        fputs("\n]}\n", out.file);
    } else {
        fputs("Gaussian curvature at the 171 inner samples of each triangle ([GB] Table 6)\n\n",
              out.file);
        print_rows(out.file, &rows, curvatures, false);
    }
    close_output(&out);
    free(rows.data);
}

/* ---- distances, and their plot --------------------------------------------------------------- */

/* The rows of the tables at some steps, those that are printed and those that are plotted. */
typedef struct distance_report {
    const char *mesh;
    array steps;                        /* int64_t, ascending */
    array rows, cosine_rows;            /* per step: row per scheme; torus: row */
    int64_t last;                       /* of the plot */
} distance_report;

static void push_step(array *steps, int64_t step)
{
    int64_t *at;
    size_t i;
    for (i = 0; i < steps->count; i++) {
        if (((const int64_t *)steps->data)[i] == step) return;
    }
    at = push(steps, sizeof step);
    for (i = steps->count - 1; i > 0 && at[-1] > step; i--, at--) *at = at[-1];
    *at = step;
}

static bool is_printed(const report_desc *desc, const char *name, int64_t step)
{
    size_t i;
    if (desc->step >= 0) return step == desc->step;
    for (i = 0; distances[i].mesh; i++) {
        if (strcmp(distances[i].mesh, name) == 0 && distances[i].step == step) return true;
    }
    return false;
}

/* Spheres are split once more a step, tori doubled. */
static void list_steps(distance_report *d, const report_desc *desc)
{
    const bool sphere = strcmp(d->mesh, "sphere") == 0;
    int64_t step;
    size_t i;
    for (i = 0; distances[i].mesh && desc->step < 0; i++) {
        if (strcmp(distances[i].mesh, d->mesh) == 0) push_step(&d->steps, distances[i].step);
    }
    if (desc->step >= 0) push_step(&d->steps, desc->step);
    d->last = desc->step >= 0 ? desc->step : sphere ? 4 : 40;
    for (step = sphere ? 0 : 5; desc->svg && step <= d->last; step += sphere ? 1 : step) {
        push_step(&d->steps, step);
    }
}

/* The rows of one kind that are printed. */
static array select_rows(const array *rows, const report_desc *desc)
{
    array chosen = {NULL, 0, 0};
    size_t i;
    for (i = 0; i < rows->count; i++) {
        const row *r = (const row *)rows->data + i;
        row *copy;
        if (!is_printed(desc, r->mesh, r->step)) continue;
        copy = push(&chosen, sizeof *copy);
        *copy = *r;
    }
    return chosen;
}

static void print_distances(const distance_report *d, const report_desc *desc)
{
    const bool sphere = strcmp(d->mesh, "sphere") == 0;
    array rows = select_rows(&d->rows, desc), cosine_rows = select_rows(&d->cosine_rows, desc);
    output out = open_output(NULL);
    if (desc->json) {
        fputs("{\"rows\":[\n", out.file);
        print_json_rows(out.file, &rows, distances, true);
        if (!sphere) fputs("\n],\"cosines\":[\n", out.file);
        print_json_rows(out.file, &cosine_rows, cosines, false);
        fputs("\n]}\n", out.file);
    } else {
        fputs(sphere ? "Signed distance to the unit sphere; an icosahedron split in four step times"
              " ([GB] Table 3)\n\n" : "Signed distance to the torus of radii 1 and 1/2; step x step"
              " quads in halves ([GB] Table 4)\n\n", out.file);
        print_rows(out.file, &rows, distances, true);
        if (!sphere) fputs("\nCosine between vertex normals, here means of the four quads', and "
                           "triangle normals ([GB] Table 5)\n\n", out.file);
        if (!sphere) print_rows(out.file, &cosine_rows, cosines, false);
    }
    close_output(&out);
    free(rows.data);
    free(cosine_rows.data);
}

enum { LEFT = 90, RIGHT = 570, TOP = 50, BOTTOM = 420, WIDTH = 760, HEIGHT = 480 };

/* Where a step and a size of distances are in the plot: exponents of 10 from low to high. */
typedef struct plot { const distance_report *d; double first, last; int low, high; } plot;

static double place_of(const plot *p, int64_t step)
{
    return strcmp(p->d->mesh, "sphere") == 0 ? (double)step : log2((double)step);
}

static double plot_x(const plot *p, int64_t step)
{
    if (p->last <= p->first) return (LEFT + RIGHT) / 2.0;
    return LEFT + 20 + (RIGHT - LEFT - 40) * (place_of(p, step) - p->first) / (p->last - p->first);
}

static double plot_y(const plot *p, double value)
{
    return BOTTOM - (BOTTOM - TOP) * (log10(value) - p->low) / (p->high - p->low);
}

static void start_plot(plot *p, const distance_report *d)
{
    const int64_t *steps = d->steps.data;
    double low = HUGE_VAL, high = 0;
    size_t i, n = d->steps.count;
    p->d = d;
    while (n > 1 && steps[n - 1] > d->last) n--;
    p->first = place_of(p, steps[0]);
    p->last = place_of(p, steps[n - 1]);
    for (i = 0; i < d->rows.count; i++) {
        const row *r = (const row *)d->rows.data + i;
        if (r->step > d->last || !(r->s.mean_size > 0)) continue;
        low = fmin(low, r->s.mean_size);
        high = fmax(high, r->s.mean_size);
    }
    p->low = high > 0 ? (int)floor(log10(low)) : -1;
    p->high = high > 0 ? (int)ceil(log10(high)) : 0;
    if (p->high == p->low) p->high++;
}

static void draw_axes(FILE *file, const plot *p)
{
    const bool sphere = strcmp(p->d->mesh, "sphere") == 0;
    const int64_t *steps = p->d->steps.data;
    size_t i;
    int e, k;
    for (e = p->low; e <= p->high; e++) {
        double y = plot_y(p, pow(10, e));
        fprintf(file, "<path d=\"M%d %.1fH%d\" stroke=\"#ccc\"/>\n<text x=\"%d\" y=\"%.1f\" "
                "text-anchor=\"end\">10<tspan dy=\"-6\" font-size=\"10\">%d</tspan></text>\n",
                LEFT, y, RIGHT, LEFT - 10, y + 5, e);
        for (k = 2; k < 10 && e < p->high; k++) {
            fprintf(file, "<path d=\"M%d %.1fh5\"/>\n", LEFT, plot_y(p, k * pow(10, e)));
        }
    }
    for (i = 0; i < p->d->steps.count && steps[i] <= p->d->last; i++) {
        double x = plot_x(p, steps[i]);
        fprintf(file, "<path d=\"M%.1f %dv-6\"/>\n<text x=\"%.1f\" y=\"%d\" "
                "text-anchor=\"middle\">%" PRId64 "</text>\n", x, BOTTOM, x, BOTTOM + 20, steps[i]);
    }
    fprintf(file, "<rect x=\"%d\" y=\"%d\" width=\"%d\" height=\"%d\"/>\n", LEFT, TOP, RIGHT - LEFT,
            BOTTOM - TOP);
    fprintf(file, "<text x=\"%d\" y=\"%d\" text-anchor=\"middle\">%s</text>\n", (LEFT + RIGHT) / 2,
            BOTTOM + 45, sphere ? "step: times the icosahedron is split in four"
            : "step: quads around the torus and around its tube");
    fprintf(file, "<text transform=\"translate(%d %d) rotate(-90)\" text-anchor=\"middle\">mean "
            "absolute distance</text>\n", LEFT - 60, (TOP + BOTTOM) / 2);
    fprintf(file, "<text x=\"%d\" y=\"%d\" text-anchor=\"middle\" font-size=\"16\">Distance to the "
            "%s</text>\n", (LEFT + RIGHT) / 2, TOP - 20, p->d->mesh);
}

/* Marks differ in shape, lines in colour and dash: wm and cubic_wm_b1 lie on each other. */
static void draw_mark(FILE *file, int which, double x, double y)
{
    static const char *const marks[] = {"m-5 0a5 5 0 1 0 10 0a5 5 0 1 0-10 0", "m-5-5h10v10h-10z",
                                        "m-9 6h18l-9-15z", "m0-5l5 5l-5 5l-5-5z"};
    fprintf(file, "<path d=\"M%.1f %.1f%s\"/>\n", x, y, marks[which]);
}

static bool is_plotted(const plot *p, const row *r, const char *scheme)
{
    return strcmp(r->scheme, scheme) == 0 && r->step <= p->d->last && r->s.mean_size > 0;
}

static void draw_scheme(FILE *file, const plot *p, int which, const char *scheme)
{
    static const char *const styles[] = {"#0072b2\" stroke-width=\"2", "#d55e00\" stroke-width=\"2",
                                         "#009e73\" stroke-width=\"4",
                                         "#000000\" stroke-width=\"2\" stroke-dasharray=\"2 6"};
    const int legend = TOP + 20 + 28 * which;
    const char *join = "M";
    size_t i;
    fprintf(file, "<g stroke=\"%s\">\n<path d=\"M%d %dh40", styles[which], RIGHT + 20, legend);
    for (i = 0; i < p->d->rows.count; i++) {
        const row *r = (const row *)p->d->rows.data + i;
        if (!is_plotted(p, r, scheme)) continue;
        fprintf(file, "%s%.1f %.1f", join, plot_x(p, r->step), plot_y(p, r->s.mean_size));
        join = "L";
    }
    fputs("\"/>\n</g>\n", file);
    fprintf(file, "<g stroke=\"%.7s\" stroke-width=\"2\" fill=\"#fff\">\n", styles[which]);
    draw_mark(file, which, RIGHT + 40, legend);
    for (i = 0; i < p->d->rows.count; i++) {
        const row *r = (const row *)p->d->rows.data + i;
        if (!is_plotted(p, r, scheme)) continue;
        draw_mark(file, which, plot_x(p, r->step), plot_y(p, r->s.mean_size));
    }
    fprintf(file, "</g>\n<text x=\"%d\" y=\"%d\">%s</text>\n", RIGHT + 70, legend + 5, scheme);
}

static void draw_plot(const distance_report *d, const report_desc *desc)
{
    plot p;
    output out;
    int i;
    start_plot(&p, d);
    out = open_output(desc->svg);
    fprintf(out.file, "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"%d\" height=\"%d\" "
            "viewBox=\"0 0 %d %d\">\n<style>text{font-family:sans-serif;font-size:14px;fill:#000;"
            "stroke:none}</style>\n<rect width=\"100%%\" height=\"100%%\" fill=\"#fff\"/>\n"
            "<g fill=\"none\" stroke=\"#000\">\n", WIDTH, HEIGHT, WIDTH, HEIGHT);
    draw_axes(out.file, &p);
    if (desc->scheme) draw_scheme(out.file, &p, 0, desc->scheme);
    for (i = 0; i < TABLE_SCHEMES && !desc->scheme; i++) {
        draw_scheme(out.file, &p, i, table_schemes[i]);
    }
    fputs("</g>\n</svg>\n", out.file);
    close_output(&out);
}

static void report_distances(const report_desc *desc)
{
    distance_report d;
    size_t i;
    memset(&d, 0, sizeof d);
    d.mesh = desc->table;
    list_steps(&d, desc);
    for (i = 0; i < d.steps.count; i++) {
        subject of;
        start_subject(&of, d.mesh, ((const int64_t *)d.steps.data)[i], desc);
        add_rows(&d.rows, &of, desc);
        if (of.distance == distance_to_torus) add_cosines(&d.cosine_rows, &of);
        free_shape(&of.shape);
    }
    if (desc->svg) draw_plot(&d, desc);
    print_distances(&d, desc);
    free(d.steps.data);
    free(d.rows.data);
    free(d.cosine_rows.data);
}

/* ---- costs ----------------------------------------------------------------------------------- */

/* A number that counts what is done with it. */
typedef struct number { double value; } number;
typedef struct operations { int add, mul, div; } operations;
static operations counted;

static number as_number(double value)
{
    number n;
    n.value = value;
    return n;
}

static number add(number a, number b)
{
    counted.add++;
    return as_number(a.value + b.value);
}

static number sub(number a, number b)
{
    counted.add++;
    return as_number(a.value - b.value);
}

static number mul(number a, number b)
{
    counted.mul++;
    return as_number(a.value * b.value);
}

static number quotient(number a, number b)
{
    counted.div++;
    return as_number(a.value / b.value);
}

/* What a scheme's control points of one coordinate are blended from, at the weights t of the three
   corners. Edge e runs from corner e to the next; key [k][0] is the control point beside corner k
   on edge k, [k][1] that on the edge before. */
typedef struct blend {
    number t[3];
    number own[3][2], other[3][2];      /* per key: the two points */
    number inner[3][2];                 /* per edge: the points of its start and end, or one */
} blend;

static number one_less(number x) { return sub(as_number(1), x); }
static number square(number x) { return mul(x, x); }

/* (1-w) v^2 and the same with v and w exchanged weigh the points of the edges after and before. */
static number hybrid_key(const blend *b, int k, int side)
{
    const number v = b->t[(k + 1) % 3], w = b->t[(k + 2) % 3];
    return quotient(add(mul(mul(one_less(w), square(v)), b->own[k][side]),
                        mul(mul(one_less(v), square(w)), b->other[k][side])),
                    add(mul(one_less(w), square(v)), mul(one_less(v), square(w))));
}

/* (uv P + vw Q + wu R) / (uv + vw + wu) */
static number of_three_edges(const blend *b, number p, number q, number r)
{
    const number u = b->t[0], v = b->t[1], w = b->t[2];
    return quotient(add(add(mul(mul(u, v), p), mul(mul(v, w), q)), mul(mul(w, u), r)),
                    add(add(mul(u, v), mul(v, w)), mul(w, u)));
}

static number hybrid_centre(const blend *b)
{
    return of_three_edges(b, b->inner[0][0], b->inner[1][0], b->inner[2][0]);
}

/* The weight of the corner opposite the edge, squared, against one less it, squared. */
static number png1_key(const blend *b, int k, int side)
{
    const number t = b->t[(k + 2 - side) % 3];
    return quotient(add(mul(mul(one_less(t), one_less(t)), b->own[k][side]),
                        mul(square(t), b->other[k][side])),
                    add(mul(one_less(t), one_less(t)), square(t)));
}

/* B2 along an edge: (a (1-b) P + b (1-a) Q) / (a + b - 2 a b) */
static number along_edge(const blend *b, int e)
{
    const number x = b->t[e], y = b->t[(e + 1) % 3];
    return quotient(add(mul(mul(x, one_less(y)), b->inner[e][0]),
                        mul(mul(y, one_less(x)), b->inner[e][1])),
                    sub(add(x, y), mul(mul(as_number(2), x), y)));
}

static number png1_centre(const blend *b)
{
    return of_three_edges(b, along_edge(b, 0), along_edge(b, 1), along_edge(b, 2));
}

/* The inner point beside corner k of the quartic: (v P + w Q) / (v + w) */
static number quartic_inner(const blend *b, int k)
{
    const number v = b->t[(k + 1) % 3], w = b->t[(k + 2) % 3];
    return quotient(add(mul(v, b->inner[k][0]), mul(w, b->inner[(k + 2) % 3][1])), add(v, w));
}

/* B1: the sum of u (v P + w Q) / (v + w) over the corners */
static number ribbon_centre(const blend *b)
{
    return add(add(mul(b->t[0], quartic_inner(b, 0)), mul(b->t[1], quartic_inner(b, 1))),
               mul(b->t[2], quartic_inner(b, 2)));
}

/* A patch in one coordinate: what is blended, and what is not. */
typedef struct cubic {
    psurf_scheme scheme;
    bool quartic;                       /* wm: Walton-Meek's own form of the same surface */
    double corner[3], key[3][2];        /* key of hybrid and png1: blended by evaluate() */
    blend b;
} cubic;

/* The places of the keys among the points of a boundary. */
static const int key_places[3][2] = {{1, 4}, {5, 2}, {6, 7}};

static void take_hybrid(cubic *c, const double *points)
{
    int k;
    for (k = 0; k < 3; k++) {
        const double *set = points + 9 + 15 * k, *before = points + 9 + 15 * ((k + 2) % 3);
        c->corner[k] = points[3 * k];
        c->b.own[k][0].value = set[0];
        c->b.own[k][1].value = set[6];
        c->b.other[k][0].value = before[9];
        c->b.other[k][1].value = before[3];
        c->b.inner[k][0].value = set[12];
    }
}

/* png1, and the ribbons of cubic_wm_b1, which have no second points for the keys. */
static void take_boundary(cubic *c, const double *points)
{
    static const int corner_places[3] = {0, 3, 8};
    static const int other_places[3][2] = {{9, 11}, {12, 10}, {13, 14}};
    const int inner = c->scheme == PSURF_PNG1 ? 15 : 9;
    int k, side;
    for (k = 0; k < 3; k++) {
        c->corner[k] = points[3 * corner_places[k]];
        for (side = 0; side < 2; side++) {
            c->key[k][side] = c->b.own[k][side].value = points[3 * key_places[k][side]];
            if (inner == 15) c->b.other[k][side].value = points[3 * other_places[k][side]];
            c->b.inner[k][side].value = points[3 * (inner + 2 * k + side)];
        }
    }
}

/* The quartic's inner points, from those of the cubic: its end vectors, and with them the vectors
   across the edge, are 3/4 of the cubic's. */
static void raise_inner_points(cubic *c)
{
    int e;
    for (e = 0; e < 3; e++) {
        const int next = (e + 1) % 3;
        const double p = c->corner[e], q = c->corner[next];
        const double x = c->key[e][0], y = c->key[next][1], middle = (x + y) / 2;
        const double start = c->key[e][1] - (p + x) / 2, end = c->key[next][0] - (q + y) / 2;
        number *first = &c->b.inner[e][0], *last = &c->b.inner[e][1];
        first->value = (2 * (first->value - middle) + start) / 4 + ((p + 3 * x) / 4 + middle) / 2;
        last->value = (2 * (last->value - middle) + end) / 4 + ((q + 3 * y) / 4 + middle) / 2;
    }
}

static double evaluate_quartic(const cubic *c)
{
    double sum = 0;
    int k;
    for (k = 0; k < 3; k++) {
        const int next = (k + 1) % 3;
        const double t = c->b.t[k].value, u = c->b.t[next].value, v = c->b.t[(k + 2) % 3].value;
        sum += t * t * t * (t * c->corner[k] + u * (c->corner[k] + 3 * c->key[k][0])
                            + v * (c->corner[k] + 3 * c->key[k][1]));
        sum += 3 * t * t * u * u * (c->key[k][0] + c->key[next][1]);
        sum += 12 * t * t * u * v * quartic_inner(&c->b, k).value;
    }
    return sum;
}

/* The point at the weights b.t, by counted blends. */
static double evaluate(cubic *c)
{
    const bool hybrid = c->scheme == PSURF_HYBRID, png1 = c->scheme == PSURF_PNG1;
    double sum = 0, product = 6;
    int k, side;
    if (c->quartic) return evaluate_quartic(c);
    for (k = 0; k < 3; k++) {
        const double t = c->b.t[k].value;
        for (side = 0; side < 2; side++) {
            if (hybrid) c->key[k][side] = hybrid_key(&c->b, k, side).value;
            if (png1) c->key[k][side] = png1_key(&c->b, k, side).value;
        }
        sum += t * t * (t * c->corner[k] + 3 * c->b.t[(k + 1) % 3].value * c->key[k][0]
                        + 3 * c->b.t[(k + 2) % 3].value * c->key[k][1]);
        product *= t;
    }
    return sum + product * (hybrid ? hybrid_centre(&c->b) : png1 ? png1_centre(&c->b)
                            : ribbon_centre(&c->b)).value;
}

/* How far the counted formulas are from the library, on an icosahedron. */
static double compare_with_library(const char *name, const report_desc *desc)
{
    const double weights[][2] = {{0.2, 0.3}, {0.1, 0.8}, {0.45, 0.05}};
    subject of;
    surface s;
    psurf_points points;
    double p[3], largest = 0;
    cubic c;
    uint32_t i, k, axis;
    start_subject(&of, "sphere", 0, desc);
    make_surface(&s, &of.shape, find_scheme(name), desc);
    memset(&points, 0, sizeof points);
    points.p = p;
    for (i = 0; i < 3 * s.faces; i++) {
        const psurf_patch patch = psurf_get_patch(&s.patches, i / 3);
        psurf_sample sample = {0, 0, 0, 0};
        sample.face = patch.face;
        sample.u = weights[i % 3][0];
        sample.v = weights[i % 3][1];
        psurf_eval(&s.patches, &sample, 1, &points);
        for (axis = 0; axis < 3; axis++) {
            memset(&c, 0, sizeof c);
            c.scheme = s.patches.scheme;
            c.quartic = strcmp(name, "wm") == 0;
            if (c.scheme == PSURF_HYBRID) take_hybrid(&c, patch.points + axis);
            else take_boundary(&c, patch.points + axis);
            if (c.quartic) raise_inner_points(&c);
            for (k = 0; k < 3; k++) {
                c.b.t[k].value = k == 0 ? 1 - sample.u - sample.v : k == 1 ? sample.u : sample.v;
            }
            largest = fmax(largest, fabs(evaluate(&c) - p[axis]));
        }
    }
    free_surface(&s);
    free_shape(&of.shape);
    return largest;
}

/* [GB] Table 1. boundary: of the blended keys, else of the points inside. */
static const struct cost { const char *scheme; bool boundary; operations printed; } costs[] = {
    {"hybrid", true, {36, 60, 6}}, {"hybrid", false, {4, 9, 1}}, {"png1", true, {36, 36, 6}},
    {"png1", false, {19, 27, 4}}, {"wm", false, {6, 6, 3}}, {"cubic_wm_b1", false, {8, 9, 3}}};
enum { COSTS = sizeof costs / sizeof *costs };

static operations count_operations(const struct cost *cost)
{
    const bool hybrid = strcmp(cost->scheme, "hybrid") == 0;
    const bool png1 = strcmp(cost->scheme, "png1") == 0;
    blend b;
    int k, side;
    memset(&b, 0, sizeof b);
    memset(&counted, 0, sizeof counted);
    for (k = 0; k < 3 && cost->boundary; k++) {
        for (side = 0; side < 2 && hybrid; side++) hybrid_key(&b, k, side);
        for (side = 0; side < 2 && png1; side++) png1_key(&b, k, side);
    }
    if (cost->boundary) return counted;
    if (hybrid) hybrid_centre(&b);
    else if (png1) png1_centre(&b);
    else if (strcmp(cost->scheme, "wm") == 0) {
        for (k = 0; k < 3; k++) quartic_inner(&b, k);
    } else {
        ribbon_centre(&b);
    }
    return counted;
}

static void put_operations(FILE *file, const char *key, operations o)
{
    fprintf(file, "\"%s\":{\"add\":%d,\"mul\":%d,\"div\":%d}", key, o.add, o.mul, o.div);
}

static void print_cost(FILE *file, bool json, const char *scheme, const char *part, operations o,
                       operations p)
{
    if (json) {
        fprintf(file, "{\"scheme\":\"%s\",\"part\":\"%s\",", scheme, part);
        put_operations(file, "computed", o);
        fputc(',', file);
        put_operations(file, "printed", p);
        fputc('}', file);
    } else {
        fprintf(file, "%-14s %-10s %6d%6d%6d %10d%6d%6d %10d%6d%6d\n", scheme, part, o.add, o.mul,
                o.div, p.add, p.mul, p.div, o.add - p.add, o.mul - p.mul, o.div - p.div);
    }
}

static void print_costs(FILE *file, bool json)
{
    operations total = {0, 0, 0}, printed_total = {0, 0, 0};
    int i;
    for (i = 0; i < COSTS; i++) {
        const operations o = count_operations(&costs[i]), p = costs[i].printed;
        const bool first = i == 0 || strcmp(costs[i].scheme, costs[i - 1].scheme) != 0;
        const bool last = i + 1 == COSTS || strcmp(costs[i].scheme, costs[i + 1].scheme) != 0;
        total.add = o.add + (first ? 0 : total.add);
        total.mul = o.mul + (first ? 0 : total.mul);
        total.div = o.div + (first ? 0 : total.div);
        printed_total.add = p.add + (first ? 0 : printed_total.add);
        printed_total.mul = p.mul + (first ? 0 : printed_total.mul);
        printed_total.div = p.div + (first ? 0 : printed_total.div);
        if (json && i) fputs(",\n", file);
        print_cost(file, json, costs[i].scheme, costs[i].boundary ? "boundary" : "interior", o, p);
        if (json && last) fputs(",\n", file);
        if (last) print_cost(file, json, costs[i].scheme, "total", total, printed_total);
    }
}

static void report_costs(const report_desc *desc)
{
    double differences[TABLE_SCHEMES];
    output out;
    int i;
    for (i = 0; i < TABLE_SCHEMES; i++) {
        differences[i] = compare_with_library(table_schemes[i], desc);
    }
    out = open_output(NULL);
    if (desc->json) {
        fputs("{\"rows\":[\n", out.file);
        print_costs(out.file, true);
        fputs("\n],\"differences\":{", out.file);
        for (i = 0; i < TABLE_SCHEMES; i++) {
            fprintf(out.file, "%s\"%s\"", i ? "," : "", table_schemes[i]);
            put_member(out.file, ":", differences[i]);
        }
        fputs("}}\n", out.file);
    } else {
        fputs("Operations for the blended control points of a sample ([GB] Table 1): add or\n"
              "subtract, multiply, divide. Those of one coordinate; every formula is done as it\n"
              "is printed, so a square is a product, and nothing is kept to be used twice.\n\n",
              out.file);
        fprintf(out.file, "%-14s %-10s %18s %22s %22s\n", "scheme", "part", "computed", "printed",
                "difference");
        print_costs(out.file, false);
        fputs("\nThe counted formulas against the library's points, on an icosahedron:\n",
              out.file);
        for (i = 0; i < TABLE_SCHEMES; i++) {
            fprintf(out.file, "%-14s %.2g\n", table_schemes[i], differences[i]);
        }
    }
    close_output(&out);
}

/* ---- patches --------------------------------------------------------------------------------- */

typedef struct patch_counts {
    const char *mesh;
    int64_t vertices, faces, kinds[PSURF_P5 + 1], ngon;
    int64_t pieces;                     /* of the n-gons */
    int64_t points[PSURF_P5 + 1];       /* control points of a patch */
} patch_counts;

/* [PM] Table 2: ordinary, polar, p3, p4, p5. Of these meshes only the first is to be had. */
static const patch_counts printed_counts[] = {
    {"dodecahedra", 200, 120, {0, 0, 0, 0, 120}, 0, 0, {16, 13, 19, 25, 31}},
    {"frog", 1308, 1292, {528, 0, 0, 764, 0}, 0, 0, {16, 13, 19, 25, 31}},
    {"hand", 405, 417, {304, 32, 0, 74, 7}, 0, 0, {16, 13, 19, 25, 31}},
    {"monkey", 578, 590, {340, 16, 22, 210, 2}, 0, 0, {16, 13, 19, 25, 31}},
};
enum { PRINTED_COUNTS = sizeof printed_counts / sizeof *printed_counts };
static const int64_t printed_samples[] = {5, 9, 17, 33, 65};
static const char *const kind_keys[] = {"ordinary", "polar", "p3", "p4", "p5"};

/* Ten dodecahedra: their corners are the triangles of an icosahedron. */
static void make_dodecahedra(array *corners)
{
    static const uint32_t faces[12][5] = {
        {0, 3, 2, 4, 1}, {5, 6, 9, 7, 8}, {0, 1, 12, 10, 11}, {5, 14, 13, 15, 6}, {2, 3, 16, 8, 7},
        {10, 13, 14, 17, 11}, {2, 7, 9, 18, 4}, {10, 12, 19, 15, 13}, {0, 11, 17, 16, 3},
        {1, 4, 18, 19, 12}, {5, 8, 16, 17, 14}, {6, 15, 19, 18, 9}};
    uint32_t i;
    for (i = 0; i < 600; i++) push_number(corners, 20 * (i / 60) + faces[i % 60 / 5][i % 5]);
}

static patch_counts count_patches(const char *name, const psurf_mesh_desc *of,
                                  const report_desc *desc)
{
    psurf_topology *topology;
    psurf_patches_layout layout;
    psurf_info info;
    patch_counts c;
    int kind;
    must(desc, psurf_topology_create(of, &topology, NULL));
    psurf_topology_info(topology, &info);
    must(desc, psurf_patches_size(topology, PSURF_PM, &layout));
    psurf_topology_destroy(topology);
    c.mesh = name;
    c.vertices = info.vertices;
    c.faces = info.faces;
    c.ngon = info.ngon_faces;
    c.pieces = (int64_t)info.facets - (c.faces - c.ngon);
    for (kind = 0; kind <= PSURF_P5; kind++) {
        c.kinds[kind] = info.kind_faces[kind];
        c.points[kind] = layout.kind[kind].points;
    }
    return c;
}

static patch_counts count_dodecahedra(const report_desc *desc)
{
    array corners = {NULL, 0, 0};
    psurf_mesh_desc of;
    patch_counts c;
    make_dodecahedra(&corners);
    memset(&of, 0, sizeof of);
    of.vertex_count = 200;
    of.face_count = 120;
    of.uniform_size = 5;
    of.face_vertices = corners.data;
    c = count_patches("dodecahedra", &of, desc);
    free(corners.data);
    return c;
}

static patch_counts count_mesh(const report_desc *desc)
{
    const mesh *m = desc->mesh;
    shape s;
    psurf_mesh_desc of;
    patch_counts c;
    memset(&s, 0, sizeof s);
    memset(&of, 0, sizeof of);
    push_tags(&s, m);
    of.vertex_count = (uint32_t)m->positions.count;
    of.face_count = (uint32_t)m->sizes.count;
    of.face_sizes = m->sizes.data;
    of.face_vertices = m->corners.data;
    of.edges = s.edges.data;
    of.edge_count = (uint32_t)s.edges.count;
    of.corners = desc->corners;
    of.corner_count = desc->corner_count;
    c = count_patches(m->name, &of, desc);
    free_shape(&s);
    return c;
}

/* [PM]: N x N samples of a quad, N/2 x (N+1) of a triangle, and five triangles for a pentagon; so a
   triangle for every piece of a split face. */
static int64_t count_evaluations(const patch_counts *c, int64_t n)
{
    int64_t triangle = n * (n + 1) / 2;
    return (c->kinds[PSURF_BICUBIC] + c->kinds[PSURF_P4]) * n * n
           + (c->kinds[PSURF_POLAR] + c->kinds[PSURF_P3] + 5 * c->kinds[PSURF_P5] + c->pieces)
           * triangle;
}

static void put_counts(FILE *file, const patch_counts *c)
{
    int kind;
    fprintf(file, "\"vertices\":%" PRId64 ",\"faces\":%" PRId64, c->vertices, c->faces);
    for (kind = 0; kind <= PSURF_P5; kind++) {
        fprintf(file, ",\"%s\":%" PRId64, kind_keys[kind], c->kinds[kind]);
    }
    fprintf(file, ",\"ngon\":%" PRId64, c->ngon);
}

static void print_json_patches(FILE *file, const array *counts, const array *samples)
{
    const patch_counts *c = counts->data;
    size_t i, k;
    int kind;
    fputs("{\"rows\":[\n", file);
    for (i = 0; i < counts->count; i++) {
        for (k = 0; k < samples->count; k++) {
            int64_t n = ((const int64_t *)samples->data)[k];
            fputs(i + k ? ",\n{\"mesh\":" : "{\"mesh\":", file);
            put_text(file, c[i].mesh);
            fprintf(file, ",\"step\":%" PRId64 ",", n);
            put_counts(file, &c[i]);
            fprintf(file, ",\"evaluations\":%" PRId64, count_evaluations(&c[i], n));
            if (i == 0) {
                fputs(",\"printed\":{", file);
                put_counts(file, &printed_counts[0]);
                fputc('}', file);
            }
            fputc('}', file);
        }
    }
    fputs("\n],\"control_points\":[\n", file);
    for (kind = 0; kind <= PSURF_P5; kind++) {
        fprintf(file, "%s{\"kind\":\"%s\",\"computed\":%" PRId64 ",\"printed\":%" PRId64 "}",
                kind ? ",\n" : "", kind_keys[kind], c->points[kind],
                printed_counts[0].points[kind]);
    }
    fputs("\n]}\n", file);
}

static void print_counts(FILE *file, const patch_counts *c, const char *name, const char *remark)
{
    int kind;
    fprintf(file, "%-22s%9" PRId64 "%9" PRId64, name, c->vertices, c->faces);
    for (kind = 0; kind <= PSURF_P5; kind++) fprintf(file, "%9" PRId64, c->kinds[kind]);
    fprintf(file, "%9" PRId64 "%s\n", c->ngon, remark);
}

static void print_patch_kinds(FILE *file, const array *counts)
{
    const patch_counts *c = counts->data;
    size_t i;
    int kind;
    fputs("Control points of a patch ([PM] Table 1)\n\n", file);
    fprintf(file, "%-12s%10s%10s%12s\n", "kind", "computed", "printed", "difference");
    for (kind = 0; kind <= PSURF_P5; kind++) {
        int64_t known = printed_counts[0].points[kind];
        fprintf(file, "%-12s%10" PRId64 "%10" PRId64 "%12" PRId64 "\n", kind_keys[kind],
                c->points[kind], known, c->points[kind] - known);
    }
    fprintf(file, "\nFaces by kind ([PM] Table 2)\n\n%-22s%9s%9s%9s%9s%9s%9s%9s%9s\n", "mesh",
            "vertices", "faces", "ordinary", "polar", "p3", "p4", "p5", "ngon");
    for (i = 0; i < counts->count; i++) {
        patch_counts difference = c[i];
        print_counts(file, &c[i], c[i].mesh, "");
        if (i > 0) continue;
        print_counts(file, &printed_counts[0], "  printed", "");
        difference.vertices -= printed_counts[0].vertices;
        difference.faces -= printed_counts[0].faces;
        for (kind = 0; kind <= PSURF_P5; kind++) {
            difference.kinds[kind] -= printed_counts[0].kinds[kind];
        }
        print_counts(file, &difference, "  difference", "");
    }
    for (i = 1; i < PRINTED_COUNTS; i++) {
        print_counts(file, &printed_counts[i], printed_counts[i].mesh, "  printed; no mesh");
    }
}

static void print_evaluations(FILE *file, const array *counts, const array *samples)
{
    static const patch_counts single[] = {
        {"a quad", 0, 0, {1, 0, 0, 0, 0}, 0, 0, {0}},
        {"a triangle", 0, 0, {0, 0, 1, 0, 0}, 0, 0, {0}},
        {"a pentagon", 0, 0, {0, 0, 0, 0, 1}, 0, 0, {0}}};
    const int64_t *n = samples->data;
    size_t i, k;
    fprintf(file, "\nEvaluations at N samples an edge\n\n%-22s", "N");
    for (k = 0; k < samples->count; k++) fprintf(file, "%11" PRId64, n[k]);
    for (i = 0; i < 3 + counts->count; i++) {
        const patch_counts *c = i < 3 ? &single[i] : (const patch_counts *)counts->data + i - 3;
        fprintf(file, "\n%-22s", c->mesh);
        for (k = 0; k < samples->count; k++) {
            fprintf(file, "%11" PRId64, count_evaluations(c, n[k]));
        }
    }
    fputc('\n', file);
}

static void report_patches(const report_desc *desc)
{
    array counts = {NULL, 0, 0}, samples = {NULL, 0, 0};
    output out;
    size_t i;
    *(patch_counts *)push(&counts, sizeof(patch_counts)) = count_dodecahedra(desc);
    if (desc->mesh) *(patch_counts *)push(&counts, sizeof(patch_counts)) = count_mesh(desc);
    for (i = 0; i < sizeof printed_samples / sizeof *printed_samples && desc->step < 0; i++) {
        push_step(&samples, printed_samples[i]);
    }
    if (desc->step >= 0) push_step(&samples, desc->step);
    out = open_output(NULL);
    if (desc->json) {
        print_json_patches(out.file, &counts, &samples);
    } else {
        print_patch_kinds(out.file, &counts);
        print_evaluations(out.file, &counts, &samples);
    }
    close_output(&out);
    free(counts.data);
    free(samples.data);
}

/* ---- all tables ------------------------------------------------------------------------------ */

static const struct table {
    const char *name;
    void (*run)(const report_desc *desc);
    int64_t first, last;                /* steps; none: last < first */
    bool schemes, plot, mesh;           /* whether it takes --scheme, --svg, a mesh */
} tables[] = {
    {"sphere", report_distances, 0, MAX_SPHERE, true, true, false},
    {"torus", report_distances, MIN_TORUS, MAX_TORUS, true, true, false},
    {"curvature", report_curvature, 0, MAX_TORUS, true, false, true},
    {"costs", report_costs, 0, -1, false, false, false},
    {"patches", report_patches, 2, PSURF_MAX_RATE + 1, false, false, true},
};

static const struct table *find_table(const char *name)
{
    size_t i;
    for (i = 0; i < sizeof tables / sizeof *tables; i++) {
        if (strcmp(name, tables[i].name) == 0) return &tables[i];
    }
    fail("patchsurf", 0, "there is no report %s; there are sphere, torus, curvature, costs and "
         "patches", name);
}

void check_report(const report_desc *desc)
{
    const struct table *t = find_table(desc->table);
    if (desc->step >= 0 && t->last < t->first) {
        fail("patchsurf", 0, "report %s has no steps", t->name);
    }
    if (desc->step >= 0 && (desc->step < t->first || desc->step > t->last)) {
        fail("patchsurf", 0, "report %s has steps from %" PRId64 " to %" PRId64 ", not %" PRId64,
             t->name, t->first, t->last, desc->step);
    }
    if (desc->scheme && !t->schemes) fail("patchsurf", 0, "report %s takes no --scheme", t->name);
    if (desc->svg && strcmp(desc->svg, "-") == 0) fail("patchsurf", 0, "--svg needs a file name");
    if (desc->svg && !t->plot) fail("patchsurf", 0, "report %s has no plot for --svg", t->name);
    if (desc->has_mesh && !t->mesh) fail("patchsurf", 0, "report %s takes no mesh", t->name);
}

int report(const report_desc *desc)
{
    find_table(desc->table)->run(desc);
    return EXIT_SUCCESS;
}
