/* What the two files of the command-line tool share. patchsurf.c has the library in float and every
   command but report; report.c has it once more, in double, and that command. No type of the
   library is here: each file has its own. */

#ifndef PATCHSURF_TOOL_H
#define PATCHSURF_TOOL_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>

#if defined(__GNUC__) || defined(__clang__)
#define PRINTF_LIKE(at, values) __attribute__((format(printf, at, values)))
#define NORETURN __attribute__((noreturn))
#else
#define PRINTF_LIKE(at, values)
#define NORETURN
#endif

enum { EXIT_CHECK = 1, EXIT_BAD = 2 };

/* ---- in patchsurf.c -------------------------------------------------------------------------- */

/* Ends the program with a line on standard error. line 0: the message is not about a line. */
NORETURN PRINTF_LIKE(3, 4) void fail(const char *name, uint32_t line, const char *format, ...);

/* Called often during long work; draws on a terminal at most ten times a second. */
void progress(uint64_t done, uint64_t total);

/* realloc() that ends the program where there is no memory. */
void *resize(void *memory, size_t count, size_t size);

typedef struct array { void *data; size_t count, room; } array;

/* A new element at the end; all elements of an array have the same size. */
void *push(array *a, size_t size);

/* path NULL or "-": standard output. A file appears when it is closed. */
typedef struct output { FILE *file; const char *path; } output;
output open_output(const char *path);
void close_output(output *out);

/* What the file says of an edge, or of a vertex: then v0 and v1 are the same. */
typedef struct tag { uint32_t v0, v1, line, order; float sharpness; } tag;
enum { HARD_FROM = 10 };                /* the sharpness that OpenSubdiv takes for infinite */

typedef struct mesh {
    const char *name;                   /* of the file, for messages */
    uint32_t first;                     /* number of the first vertex in the file: 0 or 1 */
    array positions;                    /* float[3] per vertex, less middle */
    float middle[3];                    /* see move_to_origin */
    array sizes, lines;                 /* uint32_t per face: corners; line of the file, or none */
    array corners;                      /* uint32_t per face corner: vertex */
    array uvs;                          /* float[2] per face corner, or none */
    array normals, normal_lines;        /* float[3], NaN where it is no number; uint32_t, or none */
    array corner_normals;               /* uint32_t per face corner: normal, or PSURF_NONE */
    array creases, sharp_corners;       /* tag per tagged edge and vertex */
} mesh;

/* ---- in report.c ----------------------------------------------------------------------------- */

typedef struct report_desc {
    const char *table;                  /* which one: sphere, torus, curvature, costs, patches */
    const char *scheme;                 /* NULL: those of the tables */
    int variant, normal_mode;           /* psurf_variant, psurf_normal_mode */
    unsigned flags;                     /* of psurf_construct_desc, with sigma */
    double sigma;
    int64_t step;                       /* negative: those of the tables */
    bool computed_normals;              /* normal_mode is asked for by name */
    bool json, has_mesh;
    const char *svg;                    /* file for a plot, or NULL */
    const mesh *mesh;                   /* with it: */
    const uint32_t *corners;            /* vertices that stay in place */
    uint32_t corner_count;
    bool file_normals;                  /* the mesh's, welded, count, and not normal_mode */
} report_desc;

/* ELF programs link without report.c too, and lack the command. */
#ifdef __ELF__
#define MAY_LACK __attribute__((weak))
#define HAS_REPORT (check_report && report)
#else
#define MAY_LACK
#define HAS_REPORT true
#endif

/* Ends the program where there is no such table, or it cannot be for this step or mesh. */
MAY_LACK void check_report(const report_desc *desc);

/* Prints the table. Returns the exit status. */
MAY_LACK int report(const report_desc *desc);

#endif
