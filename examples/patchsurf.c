/* patchsurf: smooth surfaces from polygon meshes, on the command line.

       cc -O2 patchsurf.c report.c -o patchsurf -lm
       ./patchsurf --help

   From top to bottom: messages, memory, the readers of OBJ and PLY, the surface, output files, the
   writers, one function per command, the command line. A problem with the input ends the program in
   fail(): one line that names the file, the line and the cause, exit status 2, and no output file.
   Numbers are read and written by libc in the "C" locale: nothing here calls setlocale().
   report.c has the command report, in double precision; ELF programs link without it as well. */

#ifndef _WIN32
#define _POSIX_C_SOURCE 200809L         /* isatty, fileno, stat */
#endif

#include <errno.h>
#include <float.h>
#include <inttypes.h>
#include <math.h>
#include <signal.h>
#include <stdarg.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <time.h>

#ifdef _WIN32
#include <fcntl.h>
#include <io.h>
#define isatty _isatty
#define fileno _fileno
#else
#include <unistd.h>
#endif

#define PSURF_IMPLEMENTATION
#include "../patchsurf.h"
#include "tool.h"

#ifndef S_ISREG
#define S_ISREG(mode) (((mode) & S_IFMT) == S_IFREG)
#endif

#define TEXT_OF(x) #x
#define TEXT(x) TEXT_OF(x)
#define PROGRAM "patchsurf " TEXT(PSURF_VERSION_MAJOR) "." TEXT(PSURF_VERSION_MINOR) "." \
                TEXT(PSURF_VERSION_PATCH)

/* ---- messages -------------------------------------------------------------------------------- */

static struct { bool enabled, shown; clock_t next; } bar;
static bool quiet;
static char *volatile temporary;        /* the unfinished output file, if there is one */
static volatile sig_atomic_t opening;   /* it may be there already, but not yet in temporary */
static volatile sig_atomic_t pending;   /* a signal that came meanwhile */

static void clear_bar(void)
{
    if (bar.shown) fputs("\r\033[K", stderr);
    bar.shown = false;
}

void progress(uint64_t done, uint64_t total)
{
    static const char full[] = "########################################";
    const int width = (int)(sizeof full - 1);
    int filled;
    if (!bar.enabled || total == 0 || clock() < bar.next) return;
    bar.next = clock() + CLOCKS_PER_SEC / 10;
    bar.shown = true;
    filled = (int)((double)done / (double)total * width);
    fprintf(stderr, "\r[%.*s%*s] %3.0f %%", filled, full, width - filled, "",
            100.0 * (double)done / (double)total);
}

static PRINTF_LIKE(4, 0) void print_message(const char *name, uint32_t line, const char *kind,
                                            const char *format, va_list values)
{
    clear_bar();
    fprintf(stderr, "%s:", name);
    if (line) fprintf(stderr, "%" PRIu32 ":", line);
    fprintf(stderr, " %s", kind);
    vfprintf(stderr, format, values);
    fputc('\n', stderr);
}

void fail(const char *name, uint32_t line, const char *format, ...)
{
    va_list values;
    va_start(values, format);
    print_message(name, line, "", format, values);
    va_end(values);
    if (temporary) remove(temporary);
    exit(EXIT_BAD);
}

static PRINTF_LIKE(3, 4) void warn(const char *name, uint32_t line, const char *format, ...)
{
    va_list values;
    if (quiet) return;
    va_start(values, format);
    print_message(name, line, "warning: ", format, values);
    va_end(values);
}

static void on_signal(int number)
{
    if (opening) {
        pending = number;
        return;
    }
    if (temporary) remove(temporary);
    signal(number, SIG_DFL);
    raise(number);
}

/* ---- memory ---------------------------------------------------------------------------------- */

void *resize(void *memory, size_t count, size_t size)
{
    void *result = count > SIZE_MAX / size ? NULL : realloc(memory, count ? count * size : 1);
    if (!result) fail("patchsurf", 0, "out of memory");
    return result;
}

void *push(array *a, size_t size)
{
    if (a->count == a->room) {
        a->room = a->room ? a->room * 2 : 64;
        a->data = resize(a->data, a->room, size);
    }
    return (char *)a->data + a->count++ * size;
}

static void push_u32(array *a, uint32_t value)
{
    uint32_t *element = push(a, sizeof value);
    *element = value;
}

/* Room for count elements whose old values are not needed. */
static void *reserve(array *a, size_t count, size_t size)
{
    if (a->room < count) {
        a->data = resize(a->data, count, size);
        a->room = count;
    }
    a->count = count;
    return a->data;
}

/* ---- the input mesh -------------------------------------------------------------------------- */

static uint32_t u32_at(const array *a, size_t i) { return ((const uint32_t *)a->data)[i]; }
static const float *floats_at(const array *a, size_t i, size_t width)
{
    return (const float *)a->data + i * width;
}

static void free_mesh(mesh *m)
{
    free(m->positions.data);
    free(m->sizes.data);
    free(m->lines.data);
    free(m->corners.data);
    free(m->uvs.data);
    free(m->normals.data);
    free(m->normal_lines.data);
    free(m->corner_normals.data);
    free(m->creases.data);
    free(m->sharp_corners.data);
}

/* Ends the program with something about a face, found by its line or else by its number. */
static NORETURN void fail_face(const mesh *m, size_t face, const char *message)
{
    if (face < m->lines.count) fail(m->name, u32_at(&m->lines, face), "%s", message);
    fail(m->name, 0, "face %zu, counting from 0: %s", face, message);
}

/* The corners since the last face make one more; line 0: the file has no lines. */
static void end_face(mesh *m, size_t first_corner, uint32_t line)
{
    size_t size = m->corners.count - first_corner;
    char message[80];
    if (line) push_u32(&m->lines, line);
    if (size < 3 || size > PSURF_MAX_FACE_SIZE) {
        snprintf(message, sizeof message, "face has %zu corners; from 3 to %u will do", size,
                 PSURF_MAX_FACE_SIZE);
        fail_face(m, m->sizes.count, message);
    }
    push_u32(&m->sizes, (uint32_t)size);
}

/* The whole file, with a 0 behind it that stops strtof. */
static char *read_all(const char *name, const char *path, size_t *size)
{
    FILE *file = strcmp(path, "-") == 0 ? stdin : fopen(path, "rb");
    size_t room = 1 << 16, got;
    char *data;
    if (!file) fail(name, 0, "cannot open the file: %s", strerror(errno));
    data = resize(NULL, room, 1);
    *size = 0;
    while ((got = fread(data + *size, 1, room - 1 - *size, file)) > 0) {
        *size += got;
        if (*size == room - 1) data = resize(data, room *= 2, 1);
    }
    if (ferror(file)) fail(name, 0, "cannot read the file: %s", strerror(errno));
    if (file != stdin) fclose(file);
    data[*size] = 0;
    return data;
}

/* ---- words ----------------------------------------------------------------------------------- */

typedef struct word { const char *text, *end; } word;   /* empty: text == end */
typedef struct cursor { const char *at, *end; uint32_t line; } cursor;

static bool is_blank(char c) { return c == ' ' || c == '\t' || c == '\v' || c == '\f'; }
static bool is_break(char c) { return c == '\n' || c == '\r'; }

/* Steps over one line break: LF, CR LF or CR. */
static void skip_break(cursor *c)
{
    if (c->end - c->at >= 2 && c->at[0] == '\r' && c->at[1] == '\n') c->at++;
    c->at++;
    c->line++;
}

static bool word_is(word w, const char *text)
{
    size_t size = (size_t)(w.end - w.text);
    return size == strlen(text) && memcmp(w.text, text, size) == 0;
}

/* A word fit for a message: short, printable, and on one line. */
static const char *quoted(word w)
{
    static char text[44];
    size_t size = 0;
    if (w.text == w.end) return "the end of the line";
    text[size++] = '`';
    for (; w.text < w.end && size < sizeof text - 5; w.text++) {
        text[size++] = *w.text > ' ' && *w.text < 127 ? *w.text : '?';
    }
    memcpy(text + size, w.text < w.end ? "...`" : "`", w.text < w.end ? 5 : 2);
    return text;
}

/* A finite number and nothing else. as_float: rounded once, to a float, which must be finite. */
static bool scan_number(word w, bool as_float, double *value)
{
    char *end = NULL;
    *value = 0;
    /* strtod would also take hexadecimal numbers and names of infinities. */
    if (strspn(w.text, "+-.0123456789eE") >= (size_t)(w.end - w.text)) {
        *value = as_float ? (double)strtof(w.text, &end) : strtod(w.text, &end);
    }
    return w.text < w.end && end == w.end && isfinite(*value);
}

static double to_number(const mesh *m, uint32_t line, word w, bool as_float)
{
    double value;
    if (!scan_number(w, as_float, &value)) {
        fail(m->name, line, "%s is not a finite number", quoted(w));
    }
    return value;
}

/* A number of a normal, NaN where it is none: many files have bad normals that nobody misses, so
   this is said where they are asked for. */
static float to_normal(word w)
{
    double value;
    return scan_number(w, true, &value) ? (float)value : nanf("");
}

/* A decimal integer at *at, which it steps over; values too long to matter stay at 10^15. */
static bool scan_integer(const char **at, const char *end, int64_t *value)
{
    bool negative = *at < end && **at == '-';
    const char *digits = *at += *at < end && (**at == '-' || **at == '+');
    *value = 0;
    for (; *at < end && **at >= '0' && **at <= '9'; (*at)++) {
        if (*value < INT64_C(1000000000000000)) *value = *value * 10 + (**at - '0');
    }
    if (negative) *value = -*value;
    return *at > digits;
}

/* ---- Wavefront OBJ: statements --------------------------------------------------------------- */

/* What can be referred to before it is read: checked at the end of the file. */
enum { VERTEX, UV, NORMAL, CREASE_VERTEX, CORNER_VERTEX, REFERENCE_COUNT };
static const char *const reference_names[REFERENCE_COUNT] = {
    "face refers to vertex", "face refers to texture coordinate", "face refers to normal",
    "crease tag, where counting starts at 0, refers to vertex",
    "corner tag, where counting starts at 0, refers to vertex",
};

typedef struct obj_reader {
    mesh *mesh;
    cursor in;
    uint32_t statement;                 /* line where this statement began */
    array uvs, corner_uvs;              /* float[2] per vt; uint32_t per face corner, or NONE */
    struct { int64_t index; uint32_t line; } highest[REFERENCE_COUNT];  /* counted from 0 */
    uint32_t ignored_tags, ignored_tag_line;
} obj_reader;

static bool at_continuation(const cursor *c)
{
    return c->end - c->at >= 2 && c->at[0] == '\\' && is_break(c->at[1]);
}

/* The next word of the statement, empty at its end. A backslash at the end of a line joins the next
   line to it, except in a comment, where it is often the end of a path. */
static word next_word(obj_reader *r)
{
    cursor *c = &r->in;
    word w;
    while (c->at < c->end && (is_blank(*c->at) || at_continuation(c))) {
        bool joined = !is_blank(*c->at);
        c->at++;
        if (joined) skip_break(c);
    }
    if (c->at < c->end && *c->at == '#') {
        while (c->at < c->end && !is_break(*c->at)) c->at++;
    }
    w.text = c->at;
    while (c->at < c->end && !is_blank(*c->at) && !is_break(*c->at) && !at_continuation(c)) {
        c->at++;
    }
    w.end = c->at;
    return w;
}

static float to_float(const obj_reader *r, word w)
{
    return (float)to_number(r->mesh, r->statement, w, true);
}

static uint32_t refer(obj_reader *r, int what, int64_t index)
{
    if (index >= r->highest[what].index) {
        r->highest[what].index = index;
        r->highest[what].line = r->statement;
    }
    return (uint32_t)index;
}

/* From the numbers of a face, 1 for the first and -1 for the last so far, to 0, 1, 2 ... */
static uint32_t refer_from_face(obj_reader *r, int what, int64_t index, size_t so_far)
{
    int64_t resolved = index < 0 ? (int64_t)so_far + index : index - 1;
    if (resolved < 0) {
        fail(r->mesh->name, r->statement, "%s %" PRId64 ", the file has %zu so far",
             reference_names[what], index, so_far);
    }
    return refer(r, what, resolved);
}

/* v, v/vt, v//vn or v/vt/vn */
static void read_face_corner(obj_reader *r, word w)
{
    const char *at = w.text;
    int64_t index[3] = {0, 0, 0};
    bool present[3] = {false, false, false};
    int i;
    for (i = 0; i < 3; i++) {
        present[i] = scan_integer(&at, w.end, &index[i]);
        if (at == w.end || *at != '/') break;
        at++;
    }
    if (at != w.end || !present[0]) {
        fail(r->mesh->name, r->statement, "%s is not a face corner", quoted(w));
    }
    push_u32(&r->mesh->corners, refer_from_face(r, VERTEX, index[0], r->mesh->positions.count));
    push_u32(&r->corner_uvs,
             present[1] ? refer_from_face(r, UV, index[1], r->uvs.count) : PSURF_NONE);
    push_u32(&r->mesh->corner_normals,
             present[2] ? refer_from_face(r, NORMAL, index[2], r->mesh->normals.count)
             : PSURF_NONE);
}

static void read_face(obj_reader *r)
{
    size_t first = r->mesh->corners.count;
    word w;
    while (w = next_word(r), w.text < w.end) read_face_corner(r, w);
    end_face(r->mesh, first, r->statement);
}

static void read_position(obj_reader *r)
{
    float *p = push(&r->mesh->positions, 3 * sizeof *p);
    int i;
    for (i = 0; i < 3; i++) p[i] = to_float(r, next_word(r));
}

static void read_uv(obj_reader *r)
{
    float *uv = push(&r->uvs, 2 * sizeof *uv);
    word v;
    uv[0] = to_float(r, next_word(r));
    v = next_word(r);
    uv[1] = v.text < v.end ? to_float(r, v) : 0.0f;
}

static void read_normal(obj_reader *r)
{
    float *n = push(&r->mesh->normals, 3 * sizeof *n);
    int i;
    for (i = 0; i < 3; i++) n[i] = to_normal(next_word(r));
    push_u32(&r->mesh->normal_lines, r->statement);
}

static int64_t read_tag_integer(obj_reader *r)
{
    word w = next_word(r);
    const char *at = w.text;
    int64_t value;
    if (!scan_integer(&at, w.end, &value) || at != w.end || value < 0) {
        fail(r->mesh->name, r->statement, "%s is not a whole number from 0", quoted(w));
    }
    return value;
}

/* Tags of edges (ends 2) or vertices (ends 1), with one sharpness for all or one for each. */
static void read_sharpness(obj_reader *r, array *tags, int ends, int64_t vertices, int64_t values)
{
    size_t first = tags->count, i;
    int what = ends == 2 ? CREASE_VERTEX : CORNER_VERTEX;
    if (vertices < ends || vertices % ends || (values != 1 && values != vertices / ends)) {
        fail(r->mesh->name, r->statement, "%s, and one sharpness or one for each", ends == 2
             ? "crease tag needs two vertices an edge" : "corner tag needs vertices");
    }
    for (; vertices > 0; vertices -= ends) {
        uint32_t a = refer(r, what, read_tag_integer(r));
        uint32_t b = ends == 2 ? refer(r, what, read_tag_integer(r)) : a;
        tag *t = push(tags, sizeof *t);
        t->v0 = a < b ? a : b;
        t->v1 = a < b ? b : a;
        t->line = r->statement;
        t->order = (uint32_t)tags->count;
    }
    for (i = first; i < tags->count; i++) {
        tag *t = (tag *)tags->data + i;
        t->sharpness = i == first || values > 1 ? to_float(r, next_word(r)) : t[-1].sharpness;
    }
}

/* t NAME INTEGERS/FLOATS/STRINGS values: the tags of OpenSubdiv's regression shapes. What
   interpolateboundary asks for is what boundaries are here anyway: smooth, with corners at vertices
   of one face. */
static void read_tag(obj_reader *r)
{
    word name = next_word(r), counts = next_word(r);
    const char *at = counts.text;
    int64_t count[3] = {0, 0, 0};
    int i;
    bool valid = true;
    for (i = 0; i < 3 && valid; i++) {
        valid = scan_integer(&at, counts.end, &count[i]) && count[i] >= 0
                && (i == 2 ? at == counts.end : at < counts.end && *at++ == '/');
    }
    if (!valid) {
        fail(r->mesh->name, r->statement, "%s is not a tag's three counts, like 2/1/0",
             quoted(counts));
    }
    if (word_is(name, "crease")) {
        read_sharpness(r, &r->mesh->creases, 2, count[0], count[1]);
    } else if (word_is(name, "corner")) {
        read_sharpness(r, &r->mesh->sharp_corners, 1, count[0], count[1]);
    } else if (word_is(name, "interpolateboundary")) {
        if (count[0] != 1 || read_tag_integer(r) > 2) {
            fail(r->mesh->name, r->statement, "interpolateboundary takes one number: 0, 1 or 2");
        }
    } else if (r->ignored_tags++ == 0) {
        r->ignored_tag_line = r->statement;
    }
}

/* Groups, materials, lines and whatever else there may be are skipped; but not binary data. */
static void read_statement(obj_reader *r)
{
    word w = next_word(r);
    const char *c;
    r->statement = r->in.line;
    for (c = w.text; c < w.end; c++) {
        if (*c <= ' ' || *c > '~') {
            fail(r->mesh->name, r->statement, "%s: this is not a Wavefront OBJ file", quoted(w));
        }
    }
    if (word_is(w, "v")) read_position(r);
    else if (word_is(w, "vt")) read_uv(r);
    else if (word_is(w, "vn")) read_normal(r);
    else if (word_is(w, "f") || word_is(w, "fo")) read_face(r);
    else if (word_is(w, "t")) read_tag(r);
    while (w.text < w.end) w = next_word(r);
    if (r->in.at < r->in.end) skip_break(&r->in);
}

/* ---- Wavefront OBJ: the whole file ----------------------------------------------------------- */

static void check_references(const obj_reader *r)
{
    const size_t vertices = r->mesh->positions.count;
    const size_t counts[REFERENCE_COUNT] = {vertices, r->uvs.count, r->mesh->normals.count,
                                            vertices, vertices};
    int i;
    for (i = 0; i < REFERENCE_COUNT; i++) {
        if (r->highest[i].line && (uint64_t)r->highest[i].index >= counts[i]) {
            fail(r->mesh->name, r->highest[i].line, "%s %" PRId64 ", the file has %zu",
                 reference_names[i], r->highest[i].index + (i <= NORMAL), counts[i]);
        }
    }
}

static void collect_uvs(obj_reader *r)
{
    static const float zero[2] = {0, 0};
    size_t count = r->corner_uvs.count, bare = 0, i;
    for (i = 0; i < count; i++) bare += u32_at(&r->corner_uvs, i) == PSURF_NONE;
    if (bare == count) return;
    if (bare) {
        warn(r->mesh->name, 0, "%zu of %zu face corners have no texture coordinate and take 0 0",
             bare, count);
    }
    for (i = 0; i < count; i++) {
        uint32_t k = u32_at(&r->corner_uvs, i);
        float *uv = push(&r->mesh->uvs, sizeof zero);
        memcpy(uv, k == PSURF_NONE ? zero : floats_at(&r->uvs, k, 2), sizeof zero);
    }
}

static void read_obj(mesh *m, const char *data, size_t size)
{
    obj_reader r;
    memset(&r, 0, sizeof r);
    r.mesh = m;
    r.in.at = data;
    r.in.end = data + size;
    r.in.line = m->first = 1;
    if (size >= 3 && memcmp(data, "\xEF\xBB\xBF", 3) == 0) r.in.at += 3;   /* byte order mark */
    while (r.in.at < r.in.end) {
        read_statement(&r);
        progress((uint64_t)(r.in.at - data), size);
    }
    if (m->sizes.count == 0) fail(m->name, r.in.line, "the file ends and has no faces");
    check_references(&r);
    collect_uvs(&r);
    if (r.ignored_tags) {
        warn(m->name, r.ignored_tag_line, "%" PRIu32 " unknown tags ignored, this is the first",
             r.ignored_tags);
    }
    free(r.uvs.data);
    free(r.corner_uvs.data);
}

/* ---- PLY: header ----------------------------------------------------------------------------- */

/* What a property is read for. */
enum { PLY_X, PLY_Y, PLY_Z, PLY_U, PLY_V, PLY_NX, PLY_NY, PLY_NZ, PLY_CORNERS, PLY_IGNORED };
static const struct { const char *name; int use; } ply_names[] = {
    {"x", PLY_X}, {"y", PLY_Y}, {"z", PLY_Z}, {"s", PLY_U}, {"u", PLY_U}, {"texture_u", PLY_U},
    {"t", PLY_V}, {"v", PLY_V}, {"texture_v", PLY_V}, {"nx", PLY_NX}, {"ny", PLY_NY},
    {"nz", PLY_NZ}, {"vertex_indices", PLY_CORNERS}, {"vertex_index", PLY_CORNERS},
};

typedef struct ply_type { const char *name, *other; unsigned size; char kind; } ply_type;
static const ply_type ply_types[] = {   /* kind: unsigned, signed, float */
    {"uchar", "uint8", 1, 'u'}, {"ushort", "uint16", 2, 'u'}, {"uint", "uint32", 4, 'u'},
    {"char", "int8", 1, 's'}, {"short", "int16", 2, 's'}, {"int", "int32", 4, 's'},
    {"float", "float32", 4, 'f'}, {"double", "float64", 8, 'f'},
};

enum { PLY_VERTEX, PLY_FACE, PLY_OTHER };
static const char *const ply_elements[] = {"vertex", "face", "element"};

typedef struct ply_property { const ply_type *count, *type; int use; } ply_property;
typedef struct ply_element {
    int what;
    uint32_t count;
    unsigned uses;                      /* bit PLY_X: has an x, and so on */
    array properties;                   /* ply_property; those with a count are lists */
} ply_element;

enum { PLY_ASCII = 1, PLY_LITTLE, PLY_BIG };
static const char *const ply_formats[] = {"", "ascii", "binary_little_endian", "binary_big_endian"};

typedef struct ply_reader {
    mesh *mesh;
    cursor in;                          /* line 0: in binary data */
    int format;                         /* 0 or PLY_ASCII, ... */
    array elements;
    unsigned uses[PLY_OTHER + 1];       /* of the elements vertex and face; 0: there is none */
    const ply_element *element;         /* where we are in the data */
    uint32_t instance;
    array uvs;                          /* float[2] per vertex, or none */
} ply_reader;

/* The next word of this line or, in data, of the lines that follow. */
static word ply_word(ply_reader *r, bool across_lines)
{
    cursor *c = &r->in;
    word w;
    while (c->at < c->end && (is_blank(*c->at) || (across_lines && is_break(*c->at)))) {
        if (is_blank(*c->at)) c->at++;
        else skip_break(c);
    }
    w.text = c->at;
    while (c->at < c->end && !is_blank(*c->at) && !is_break(*c->at)) c->at++;
    w.end = c->at;
    return w;
}

static void start_ply_element(ply_reader *r)
{
    word name = ply_word(r, false), count = ply_word(r, false);
    const char *at = count.text;
    int64_t value;
    ply_element *e = push(&r->elements, sizeof *e);
    memset(e, 0, sizeof *e);
    while (e->what < PLY_OTHER && !word_is(name, ply_elements[e->what])) e->what++;
    if (!scan_integer(&at, count.end, &value) || at != count.end || value < 0
        || value >= PSURF_NONE) {
        fail(r->mesh->name, r->in.line, "%s is not a number of elements", quoted(count));
    }
    if (e->what < PLY_OTHER && r->uses[e->what]) {
        fail(r->mesh->name, r->in.line, "%s is there twice", quoted(name));
    }
    e->count = (uint32_t)value;
}

static const ply_type *find_ply_type(const ply_reader *r, word w)
{
    size_t i;
    for (i = 0; i < sizeof ply_types / sizeof *ply_types; i++) {
        if (word_is(w, ply_types[i].name) || word_is(w, ply_types[i].other)) return &ply_types[i];
    }
    fail(r->mesh->name, r->in.line, "%s is not a type of numbers", quoted(w));
}

/* property TYPE NAME, or property list TYPE TYPE NAME */
static void read_ply_property(ply_reader *r)
{
    ply_element *e;
    ply_property p = {NULL, NULL, PLY_IGNORED};
    word w = ply_word(r, false);
    size_t i;
    if (r->elements.count == 0) fail(r->mesh->name, r->in.line, "property without an element");
    e = (ply_element *)r->elements.data + r->elements.count - 1;
    if (word_is(w, "list")) {
        p.count = find_ply_type(r, ply_word(r, false));
        w = ply_word(r, false);
    }
    p.type = find_ply_type(r, w);
    w = ply_word(r, false);
    for (i = 0; i < sizeof ply_names / sizeof *ply_names; i++) {
        int use = ply_names[i].use;
        bool corners = use == PLY_CORNERS;
        if (word_is(w, ply_names[i].name) && e->what == (corners ? PLY_FACE : PLY_VERTEX)
            && corners == (p.count != NULL) && !(e->uses >> use & 1)) p.use = use;
    }
    e->uses |= 1u << p.use;
    r->uses[e->what] |= e->uses;
    *(ply_property *)push(&e->properties, sizeof p) = p;
}

static void read_ply_line(ply_reader *r, word w)
{
    if (word_is(w, "element")) {
        start_ply_element(r);
    } else if (word_is(w, "property")) {
        read_ply_property(r);
    } else if (word_is(w, "format")) {
        w = ply_word(r, false);
        for (r->format = PLY_BIG; r->format > 0; r->format--) {
            if (word_is(w, ply_formats[r->format])) break;
        }
        if (r->format == 0) {
            fail(r->mesh->name, r->in.line, "%s is not a format of PLY files", quoted(w));
        }
    } else if (w.text < w.end && !word_is(w, "ply") && !word_is(w, "comment")
               && !word_is(w, "obj_info")) {
        fail(r->mesh->name, r->in.line, "%s does not belong in a PLY header", quoted(w));
    }
}

static void read_ply_header(ply_reader *r)
{
    const unsigned xyz = 1u << PLY_X | 1u << PLY_Y | 1u << PLY_Z;
    /* Where lines end in CR alone, a LF behind the header is data. */
    bool lone_cr = r->in.at[3] == '\r' && r->in.at[4] != '\n';
    const char *end = r->in.end;
    uint32_t line;
    word w;
    do {
        line = r->in.line;
        w = ply_word(r, false);
        if (!word_is(w, "end_header")) read_ply_line(r, w);
        while (r->in.at < r->in.end && !is_break(*r->in.at)) r->in.at++;
        if (r->in.at == r->in.end) fail(r->mesh->name, line, "the file ends in its header");
        if (lone_cr) r->in.end = r->in.at + 1;
        skip_break(&r->in);
        r->in.end = end;
    } while (!word_is(w, "end_header"));
    if (r->format == 0) fail(r->mesh->name, line, "the header names no format");
    if ((r->uses[PLY_VERTEX] & xyz) != xyz) {
        fail(r->mesh->name, line, "there are no vertices with x, y and z");
    }
    if (!(r->uses[PLY_FACE] >> PLY_CORNERS & 1)) {
        fail(r->mesh->name, line, "there are no faces with a list vertex_indices");
    }
}

/* ---- PLY: data ------------------------------------------------------------------------------- */

static NORETURN void fail_ply(const ply_reader *r, const char *message)
{
    if (r->in.line) fail(r->mesh->name, r->in.line, "%s", message);
    fail(r->mesh->name, 0, "%s %" PRIu32 ", counting from 0: %s", ply_elements[r->element->what],
         r->instance, message);
}

/* The bytes of a binary value, the lowest in the lowest byte. */
static uint64_t ply_bits(ply_reader *r, const ply_type *type)
{
    uint64_t bits = 0;
    unsigned i;
    if ((size_t)(r->in.end - r->in.at) < type->size) fail_ply(r, "the file ends before its data");
    for (i = 0; i < type->size; i++) {
        unsigned shift = 8 * (r->format == PLY_BIG ? type->size - 1 - i : i);
        bits |= (uint64_t)(unsigned char)*r->in.at++ << shift;
    }
    return bits;
}

static word ply_text(ply_reader *r)
{
    word w = ply_word(r, true);
    if (w.text == w.end) fail_ply(r, "the file ends before its data");
    return w;
}

static double ply_number(ply_reader *r, const ply_type *type, bool as_float)
{
    uint64_t bits, sign = UINT64_C(1) << (8 * type->size - 1);
    uint32_t low;
    float narrow;
    double wide;
    if (r->format == PLY_ASCII) {
        word w = ply_text(r);
        return to_number(r->mesh, r->in.line, w, as_float);
    }
    bits = ply_bits(r, type);
    low = (uint32_t)bits;
    if (type->kind == 'u') return (double)bits;
    if (type->kind == 's') return (double)(bits & (sign - 1)) - (double)(bits & sign);
    memcpy(&narrow, &low, sizeof narrow);
    memcpy(&wide, &bits, sizeof wide);
    return type->size == 4 ? (double)narrow : wide;
}

static float ply_float(ply_reader *r, const ply_type *type)
{
    double value = ply_number(r, type, true);
    if (!(fabs(value) <= (double)FLT_MAX)) fail_ply(r, "a coordinate is not a finite number");
    return (float)value;
}

static float ply_normal(ply_reader *r, const ply_type *type)
{
    double value;
    if (r->format == PLY_ASCII) return to_normal(ply_text(r));
    value = ply_number(r, type, true);
    return fabs(value) <= (double)FLT_MAX ? (float)value : nanf("");
}

/* A count, or the number of a vertex. */
static uint32_t ply_whole(ply_reader *r, const ply_type *type)
{
    double value = ply_number(r, type, false);
    if (!(value >= 0 && value < PSURF_NONE && value == floor(value))) {
        fail_ply(r, "a count or an index is not a whole number from 0 to 2^32 - 2");
    }
    return (uint32_t)value;
}

static void skip_ply(ply_reader *r, const ply_type *type)
{
    if (r->format == PLY_ASCII) ply_text(r);
    else ply_bits(r, type);
}

static void read_ply_list(ply_reader *r, const ply_property *p)
{
    uint32_t size = ply_whole(r, p->count), line = r->in.line, i;
    size_t first = r->mesh->corners.count;
    for (i = 0; i < size; i++) {
        if (p->use == PLY_CORNERS) push_u32(&r->mesh->corners, ply_whole(r, p->type));
        else skip_ply(r, p->type);
    }
    if (p->use == PLY_CORNERS) end_face(r->mesh, first, line);
}

static void read_ply_instance(ply_reader *r)
{
    const ply_element *e = r->element;
    const unsigned uv = 1u << PLY_U | 1u << PLY_V, normal = 7u << PLY_NX;
    float value[PLY_NZ + 1] = {0, 0, 0, 0, 0, 0, 0, 0};
    size_t i;
    for (i = 0; i < e->properties.count; i++) {
        const ply_property *p = (const ply_property *)e->properties.data + i;
        if (p->count) read_ply_list(r, p);
        else if (p->use >= PLY_NX && p->use <= PLY_NZ) value[p->use] = ply_normal(r, p->type);
        else if (p->use != PLY_IGNORED) value[p->use] = ply_float(r, p->type);
        else skip_ply(r, p->type);
    }
    if (e->what != PLY_VERTEX) return;
    memcpy(push(&r->mesh->positions, 3 * sizeof *value), value, 3 * sizeof *value);
    if ((e->uses & uv) == uv) {
        memcpy(push(&r->uvs, 2 * sizeof *value), value + PLY_U, 2 * sizeof *value);
    }
    if ((e->uses & normal) == normal) {
        memcpy(push(&r->mesh->normals, 3 * sizeof *value), value + PLY_NX, 3 * sizeof *value);
        if (r->in.line) push_u32(&r->mesh->normal_lines, r->in.line);
    }
}

/* Faces may come before vertices, so their numbers are looked at when all is read. */
static void finish_ply(ply_reader *r)
{
    mesh *m = r->mesh;
    size_t face, corner = 0, end = 0;
    char message[80];
    for (face = 0; face < m->sizes.count; face++) {
        for (end += u32_at(&m->sizes, face); corner < end; corner++) {
            uint32_t v = u32_at(&m->corners, corner);
            if (v >= m->positions.count) {
                snprintf(message, sizeof message, "face refers to vertex %" PRIu32 ", counting "
                         "from 0, the file has %zu", v, m->positions.count);
                fail_face(m, face, message);
            }
            if (r->uvs.count) {
                float *uv = push(&m->uvs, 2 * sizeof *uv);
                memcpy(uv, floats_at(&r->uvs, v, 2), 2 * sizeof *uv);
            }
            if (m->normals.count) push_u32(&m->corner_normals, v);
        }
    }
}

static void read_ply(mesh *m, const char *data, size_t size)
{
    ply_reader r;
    size_t i;
    memset(&r, 0, sizeof r);
    r.mesh = m;
    r.in.at = data;
    r.in.end = data + size;
    r.in.line = 1;
    read_ply_header(&r);
    if (r.format != PLY_ASCII) r.in.line = 0;
    for (i = 0; i < r.elements.count; i++) {
        ply_element *e = (ply_element *)r.elements.data + i;
        r.element = e;
        for (r.instance = 0; e->properties.count && r.instance < e->count; r.instance++) {
            read_ply_instance(&r);
            progress((uint64_t)(r.in.at - data), size);
        }
        free(e->properties.data);
    }
    if (m->sizes.count == 0) fail(m->name, r.in.line, "the file has no faces");
    finish_ply(&r);
    free(r.elements.data);
    free(r.uvs.data);
}

/* What to subtract from all vertices, on one axis. Where they lie at least as far from the origin
   as they reach to either side of their middle, low <= high <= 3 low, it is the middle: at least
   half and at most twice every coordinate, so all differences are exact (Sterbenz), and none
   exceeds what it was. Elsewhere it is 0: details beside the origin may have digits that would not
   survive. */
static float find_middle(const array *positions, int axis)
{
    float low = FLT_MAX, high = -FLT_MAX;
    double distance;
    size_t i;
    for (i = 0; i < positions->count; i++) {
        float x = floats_at(positions, i, 3)[axis];
        if (x < low) low = x;
        if (x > high) high = x;
    }
    distance = fmax((double)low, -(double)high);
    if (distance <= 0 || distance < ((double)high - (double)low) / 2) return 0;
    return low / 2 + high / 2;
}

/* Floats far from the origin lose digits, and the surface between them its smooth normals: so it is
   constructed at the origin, and put_back() moves what is written. */
static void move_to_origin(mesh *m)
{
    float *p = m->positions.data;
    size_t i;
    int axis;
    for (axis = 0; axis < 3; axis++) m->middle[axis] = find_middle(&m->positions, axis);
    for (i = 0; i < 3 * m->positions.count; i++) p[i] -= m->middle[i % 3];
}

/* A coordinate of the surface, where the file has it; equal bits stay equal. 0 is not added: it
   would change the sign of -0. */
static float put_back(const mesh *m, float x, size_t axis)
{
    return m->middle[axis] != 0 ? x + m->middle[axis] : x;
}

static void read_mesh(mesh *m, const char *path)
{
    size_t size;
    char *data;
    memset(m, 0, sizeof *m);
    m->name = strcmp(path, "-") == 0 ? "stdin" : path;
    data = read_all(m->name, path, &size);
    if (size >= 4 && memcmp(data, "ply", 3) == 0 && is_break(data[3])) read_ply(m, data, size);
    else read_obj(m, data, size);
    if (m->positions.count >= PSURF_NONE || m->corners.count >= PSURF_NONE) {
        fail(m->name, 0, "more than 2^32 - 2 vertices or face corners");
    }
    move_to_origin(m);
    free(data);
}

/* ---- edges of the mesh ----------------------------------------------------------------------- */

static double dot(const double a[3], const double b[3])
{
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}

static void cross(const double a[3], const double b[3], double result[3])
{
    int i;
    for (i = 0; i < 3; i++) {
        result[i] = a[(i + 1) % 3] * b[(i + 2) % 3] - a[(i + 2) % 3] * b[(i + 1) % 3];
    }
}

static void normalize(double a[3])
{
    double length = sqrt(dot(a, a));
    int i;
    for (i = 0; i < 3 && length > 0; i++) a[i] /= length;
}

/* From vertex v to vertex w. */
static void difference(const mesh *m, uint32_t v, uint32_t w, double d[3])
{
    const float *p = floats_at(&m->positions, v, 3), *q = floats_at(&m->positions, w, 3);
    int i;
    for (i = 0; i < 3; i++) d[i] = (double)q[i] - (double)p[i];
}

/* Unit normals of the faces, zero where there is none: Newell's, the mean over a face's corners. */
static double *face_normals(const mesh *m)
{
    double *normals = resize(NULL, m->sizes.count, 3 * sizeof *normals), a[3], b[3], c[3];
    const uint32_t *corners = m->corners.data;
    size_t face, i, k;
    for (face = 0; face < m->sizes.count; face++) {
        double *n = normals + 3 * face;
        size_t size = u32_at(&m->sizes, face);
        n[0] = n[1] = n[2] = 0;
        for (i = 1; i + 1 < size; i++) {
            difference(m, corners[0], corners[i], a);
            difference(m, corners[0], corners[i + 1], b);
            cross(a, b, c);
            for (k = 0; k < 3; k++) n[k] += c[k];
        }
        normalize(n);
        corners += size;
    }
    return normals;
}

/* v0 < v1; the first two of the faces that use it, and their corners at v0 and at v1. */
typedef struct mesh_edge { uint32_t v0, v1, face[2], corner[2][2], uses; } mesh_edge;

static int compare_edges(const void *left, const void *right)
{
    const mesh_edge *a = left, *b = right;
    if (a->v0 != b->v0) return a->v0 < b->v0 ? -1 : 1;
    return a->v1 < b->v1 ? -1 : a->v1 > b->v1;
}

static mesh_edge *list_edges(const mesh *m, size_t *count)
{
    mesh_edge *edges = resize(NULL, m->corners.count, sizeof *edges);
    const uint32_t *corners = m->corners.data;
    size_t face, first = 0, i, n = 0;
    for (face = 0; face < m->sizes.count; face++) {
        size_t size = u32_at(&m->sizes, face);
        for (i = 0; i < size; i++) {
            uint32_t a = (uint32_t)(first + i), b = (uint32_t)(first + (i + 1) % size);
            bool ascending = corners[a] < corners[b];
            mesh_edge *e = &edges[n++];
            memset(e, 0, sizeof *e);
            e->uses = 1;
            e->face[0] = e->face[1] = (uint32_t)face;
            e->corner[0][0] = ascending ? a : b;
            e->corner[0][1] = ascending ? b : a;
            e->v0 = corners[e->corner[0][0]];
            e->v1 = corners[e->corner[0][1]];
        }
        first += size;
    }
    qsort(edges, n, sizeof *edges, compare_edges);
    for (*count = 0, i = 0; i < n; i++) {
        if (i == 0 || compare_edges(&edges[*count - 1], &edges[i]) != 0) {
            edges[(*count)++] = edges[i];
        } else if (edges[*count - 1].uses++ == 1) {
            edges[*count - 1].face[1] = edges[i].face[0];
            memcpy(edges[*count - 1].corner[1], edges[i].corner[0], sizeof edges[i].corner[0]);
        }
    }
    return edges;
}

/* ---- tags ------------------------------------------------------------------------------------ */

static int compare_tags(const void *left, const void *right)
{
    const tag *a = left, *b = right;
    if (a->v0 != b->v0) return a->v0 < b->v0 ? -1 : 1;
    if (a->v1 != b->v1) return a->v1 < b->v1 ? -1 : 1;
    return a->order < b->order ? -1 : a->order > b->order;
}

/* What is tagged twice keeps its last sharpness, as in OpenSubdiv. */
static void keep_last(array *tags)
{
    tag *t = tags->data;
    size_t n = tags->count, i;
    if (n) qsort(t, n, sizeof *t, compare_tags);
    for (tags->count = 0, i = 0; i < n; i++) {
        if (i + 1 < n && t[i].v0 == t[i + 1].v0 && t[i].v1 == t[i + 1].v1) continue;
        t[tags->count++] = t[i];
    }
}

/* Edges that the mesh folds more sharply than so many degrees become hard, whatever their tags. */
static void tag_folds(mesh *m, double degrees)
{
    double *normals = face_normals(m), c[3];
    size_t count, i;
    mesh_edge *edges = list_edges(m, &count);
    for (i = 0; i < count; i++) {
        const double *n0 = normals + 3 * (size_t)edges[i].face[0];
        const double *n1 = normals + 3 * (size_t)edges[i].face[1];
        tag *t;
        cross(n0, n1, c);
        if (!(atan2(sqrt(dot(c, c)), dot(n0, n1)) * (180 / acos(-1.0)) > degrees)) continue;
        t = push(&m->creases, sizeof *t);
        t->v0 = edges[i].v0;
        t->v1 = edges[i].v1;
        t->line = 0;
        t->order = (uint32_t)m->creases.count;
        t->sharpness = HARD_FROM;
    }
    free(edges);
    free(normals);
}

static psurf_edge_tag *make_edge_tags(const mesh *m)
{
    const tag *t = m->creases.data;
    psurf_edge_tag *tags = resize(NULL, m->creases.count, sizeof *tags);
    size_t i;
    for (i = 0; i < m->creases.count; i++) {
        double sharpness = fmax(0.0, (double)t[i].sharpness);
        tags[i].v0 = t[i].v0;
        tags[i].v1 = t[i].v1;
        tags[i].flags = t[i].sharpness >= HARD_FROM ? PSURF_HARD : PSURF_BLEND;
        tags[i].blend0 = tags[i].blend1 = (float)(2.0 / 3.0 * exp2(-sharpness));
    }
    return tags;
}

/* How many hard or boundary edges meet at each vertex. */
static uint32_t *count_sharp_edges(const mesh *m)
{
    uint32_t *sharp = resize(NULL, m->positions.count, sizeof *sharp);
    const tag *t = m->creases.data, *end = t + m->creases.count;
    size_t count, i;
    mesh_edge *edges = list_edges(m, &count);
    memset(sharp, 0, m->positions.count * sizeof *sharp);
    for (i = 0; i < count; i++) {
        const mesh_edge *e = &edges[i];
        while (t < end && (t->v0 < e->v0 || (t->v0 == e->v0 && t->v1 < e->v1))) t++;
        if (e->uses > 1 && (t == end || t->v0 != e->v0 || t->v1 != e->v1
                            || t->sharpness < HARD_FROM)) continue;
        sharp[e->v0]++;
        sharp[e->v1]++;
    }
    free(edges);
    return sharp;
}

/* The tagged corners that are corners. */
static uint32_t *make_corners(const mesh *m, uint32_t *count)
{
    const tag *t = m->sharp_corners.data, *first = NULL;
    size_t n = m->sharp_corners.count, i;
    uint32_t *corners, *sharp;
    *count = 0;
    if (n == 0) return NULL;
    corners = resize(NULL, n, sizeof *corners);
    sharp = count_sharp_edges(m);
    for (i = 0; i < n; i++) {
        if (t[i].sharpness >= HARD_FROM && sharp[t[i].v0] >= 2) corners[(*count)++] = t[i].v0;
        else if (!first || t[i].order < first->order) first = &t[i];
    }
    if (first) {
        warn(m->name, first->line, "%zu corners ignored, here is the first: its sharpness is below "
             "%d, or fewer than two hard or boundary edges meet there", n - *count, HARD_FROM);
    }
    free(sharp);
    return corners;
}

/* ---- options --------------------------------------------------------------------------------- */

/* --normals; those that are computed in the order of psurf_normal_mode. */
enum { NORMALS_INPUT_IF_ALL, NORMALS_INPUT, NORMALS_COMPUTED };

typedef struct options {                /* of the command line */
    const char *table, *input, *output, *svg, *scheme_name;
    psurf_scheme scheme;
    psurf_variant variant;
    psurf_shading shading;
    unsigned flags;                     /* of psurf_construct_desc */
    float sigma;
    int normals;
    uint32_t rate;
    int64_t step;                       /* negative: none */
    float blend;
    double crease_angle;                /* degrees */
    bool has_blend, has_crease_angle, json, curvature, help, version;
    unsigned given;                     /* bit i: option_table[i] is there */
} options;

/* ---- normals of the file --------------------------------------------------------------------- */

static NORETURN void fail_normal(const mesh *m, size_t normal)
{
    static const char message[] =
        "normal is not three finite numbers; --normals average needs none";
    if (normal < m->normal_lines.count) {
        fail(m->name, u32_at(&m->normal_lines, normal), "%s", message);
    }
    fail(m->name, 0, "vertex %zu, counting from 0: %s", normal, message);
}

/* A normal of length zero is none. */
static bool has_normal(const mesh *m, size_t corner)
{
    uint32_t k = corner < m->corner_normals.count ? u32_at(&m->corner_normals, corner) : PSURF_NONE;
    const float *n;
    if (k == PSURF_NONE) return false;
    n = floats_at(&m->normals, k, 3);
    if (isnan(n[0]) || isnan(n[1]) || isnan(n[2])) fail_normal(m, k);
    return n[0] != 0 || n[1] != 0 || n[2] != 0;
}

/* Whether to use the normals of the file: not where a corner has none. */
static bool takes_file_normals(const mesh *m, const options *o)
{
    size_t count = m->corners.count, bare = 0, i;
    if (o->normals >= NORMALS_COMPUTED) return false;
    for (i = 0; i < count; i++) bare += !has_normal(m, i);
    if (bare == 0) return true;
    if (bare < count || o->normals == NORMALS_INPUT) {
        warn(m->name, 0, "%zu of %zu face corners have no normal, so all normals are averaged",
             bare, count);
    }
    return false;
}

/* The normal of a face corner, and the set of corners it belongs to. */
typedef struct corner_normal { uint32_t set, corner; double n[3]; } corner_normal;

/* Less than one degree apart; both are unit vectors. */
static bool nearly_equal(const double a[3], const double b[3])
{
    return dot(a, b) > 0.99984769515639124;
}

static int compare_corner_normals(const void *left, const void *right)
{
    const corner_normal *a = left, *b = right;
    int i;
    if (a->set != b->set) return a->set < b->set ? -1 : 1;
    for (i = 0; i < 3; i++) {
        if (a->n[i] < b->n[i] || a->n[i] > b->n[i]) return a->n[i] < b->n[i] ? -1 : 1;
    }
    return 0;
}

static uint32_t find_set(corner_normal *list, uint32_t corner)
{
    while (list[corner].set != corner) {
        corner = list[corner].set = list[list[corner].set].set;
    }
    return corner;
}

/* The corners of a vertex, as far as edges join them across which the normal hardly changes, are a
   set: its name is the number of one of them. */
static void find_sets(const mesh *m, corner_normal *list)
{
    size_t count, i;
    mesh_edge *edges = list_edges(m, &count);
    int end;
    for (i = 0; i < count; i++) {
        for (end = 0; end < 2 && edges[i].uses > 1; end++) {
            uint32_t a = edges[i].corner[0][end], b = edges[i].corner[1][end];
            if (!nearly_equal(list[a].n, list[b].n)) continue;
            list[find_set(list, a)].set = find_set(list, b);
        }
    }
    for (i = 0; i < m->corners.count; i++) list[i].set = find_set(list, (uint32_t)i);
    free(edges);
}

/* Whether all normals from begin up to end are close to their mean. */
static bool find_mean(const corner_normal *begin, const corner_normal *end, double mean[3])
{
    const corner_normal *at;
    int i;
    mean[0] = mean[1] = mean[2] = 0;
    for (at = begin; at < end; at++) {
        for (i = 0; i < 3; i++) mean[i] += at->n[i];
    }
    normalize(mean);
    for (at = begin; at < end; at++) {
        if (!nearly_equal(at->n, mean)) return false;
    }
    return true;
}

static void push_normal(array *normals, const double n[3])
{
    float *result = push(normals, 3 * sizeof *result);
    int i;
    for (i = 0; i < 3; i++) result[i] = (float)n[i];
}

/* Edges are hard where the normals of their sides differ, so those that mean the same become the
   same: each set gets its mean, or, where it spreads too far, each of its values one normal. */
static void weld_normals(mesh *m)
{
    size_t count = m->corners.count, first, end, i;
    corner_normal *list = resize(NULL, count, sizeof *list);
    array welded = {NULL, 0, 0};
    double mean[3];
    for (i = 0; i < count; i++) {
        const float *n = floats_at(&m->normals, u32_at(&m->corner_normals, i), 3);
        int axis;
        list[i].set = list[i].corner = (uint32_t)i;
        for (axis = 0; axis < 3; axis++) list[i].n[axis] = (double)n[axis];
        normalize(list[i].n);
    }
    find_sets(m, list);
    qsort(list, count, sizeof *list, compare_corner_normals);
    for (first = 0; first < count; first = end) {
        bool close;
        for (end = first; end < count && list[end].set == list[first].set; end++) continue;
        close = find_mean(list + first, list + end, mean);
        for (i = first; i < end; i++) {
            if (i == first) push_normal(&welded, close ? mean : list[i].n);
            else if (!close && compare_corner_normals(&list[i - 1], &list[i]) != 0) {
                push_normal(&welded, list[i].n);
            }
            ((uint32_t *)m->corner_normals.data)[list[i].corner] = (uint32_t)welded.count - 1;
        }
    }
    free(list);
    free(m->normals.data);
    m->normals = welded;
}

/* ---- the surface ----------------------------------------------------------------------------- */

/* What the library is told of a mesh; scheme and split come later. */
typedef struct description {
    psurf_mesh_desc mesh;
    psurf_construct_desc construct;
    psurf_edge_tag *tags;
    uint32_t *corners;
} description;

typedef struct surface {
    const mesh *mesh;
    psurf_topology *topology;
    psurf_info info;
    psurf_construct_desc construct;
    psurf_patches patches;
} surface;

static void fail_crease(const mesh *m, uint32_t v, uint32_t w)
{
    size_t i;
    for (i = 0; i < m->creases.count; i++) {
        const tag *t = (const tag *)m->creases.data + i;
        if ((t->v0 != v || t->v1 != w) && (t->v0 != w || t->v1 != v)) continue;
        fail(m->name, t->line, "crease tag, where counting starts at 0, names no edge: %" PRIu32
             " %" PRIu32, t->v0, t->v1);
    }
}

/* Tells what the library found, in the numbers of the file. */
static NORETURN void fail_topology(const mesh *m, const psurf_error *error)
{
    uint32_t v = error->vertex + m->first, w = error->other + m->first;
    char message[200];
    if (error->result == PSURF_BAD_EDGE) fail_crease(m, error->vertex, error->other);
    if (error->vertex == PSURF_NONE) {
        snprintf(message, sizeof message, "%s", error->message);
    } else if (error->other == PSURF_NONE) {
        snprintf(message, sizeof message, "%s: vertex %" PRIu32, error->message, v);
    } else {
        snprintf(message, sizeof message, "%s: vertices %" PRIu32 " and %" PRIu32, error->message,
                 v, w);
    }
    if (error->face == PSURF_NONE) fail(m->name, 0, "%s", message);
    fail_face(m, error->face, message);
}

/* What remains to go wrong on a valid mesh is its size. */
static void must(const surface *s, psurf_result result)
{
    if (result != PSURF_OK) fail(s->mesh->name, 0, "%s", psurf_result_string(result));
}

/* Blend ratios are pm's alone. */
static void warn_of_blends(const mesh *m, const options *o)
{
    const tag *first = NULL, *t = m->creases.data;
    size_t count = 0, i;
    for (i = 0; i < m->creases.count; i++) {
        if (t[i].sharpness >= HARD_FROM || t[i].sharpness <= 0) continue;
        count++;
        if (!first || t[i].order < first->order) first = &t[i];
    }
    if (first) {
        warn(m->name, first->line, "%zu creases ignored, here is the first: %s has none of a "
             "sharpness below %d", count, o->scheme_name, HARD_FROM);
    }
}

static void describe(description *d, mesh *m, const options *o)
{
    memset(d, 0, sizeof *d);
    if (o->has_crease_angle) tag_folds(m, o->crease_angle);
    keep_last(&m->creases);
    keep_last(&m->sharp_corners);
    if (o->scheme != PSURF_PM) warn_of_blends(m, o);
    d->mesh.vertex_count = (uint32_t)m->positions.count;
    d->mesh.face_count = (uint32_t)m->sizes.count;
    d->mesh.face_sizes = m->sizes.data;
    d->mesh.face_vertices = m->corners.data;
    d->mesh.positions = d->construct.positions = m->positions.data;
    d->mesh.edges = d->tags = make_edge_tags(m);
    d->mesh.edge_count = (uint32_t)m->creases.count;
    d->mesh.corners = d->corners = make_corners(m, &d->mesh.corner_count);
    d->mesh.flags = o->has_blend ? PSURF_DEFAULT_BLEND : 0;
    d->mesh.default_blend = o->blend;
    d->construct.variant = o->variant;
    d->construct.shading = o->shading;
    d->construct.flags = o->flags;
    d->construct.sigma = o->sigma;
    if (o->normals >= NORMALS_COMPUTED) {
        d->construct.normal_mode = (psurf_normal_mode)(o->normals - NORMALS_COMPUTED);
    }
}

static void use_file_normals(description *d, mesh *m)
{
    weld_normals(m);
    d->mesh.face_normals = m->corner_normals.data;
    d->mesh.normal_count = (uint32_t)m->normals.count;
    d->construct.normals = m->normals.data;
}

static void free_description(description *d)
{
    free(d->tags);
    free(d->corners);
}

static psurf_topology *create_topology(const mesh *m, const description *d, psurf_split split)
{
    psurf_mesh_desc desc = d->mesh;
    psurf_topology *topology;
    psurf_error error;
    desc.split = split;
    if (psurf_topology_create(&desc, &topology, &error) != PSURF_OK) fail_topology(m, &error);
    return topology;
}

static void build_surface(surface *s, const mesh *m, const description *d, psurf_scheme scheme)
{
    psurf_patches_layout layout;
    memset(s, 0, sizeof *s);
    s->mesh = m;
    s->construct = d->construct;
    s->topology = create_topology(m, d, psurf_scheme_split(scheme));
    psurf_topology_info(s->topology, &s->info);
    must(s, psurf_patches_size(s->topology, scheme, &layout));
    must(s, psurf_patches_bind(&s->patches, s->topology, scheme,
                               resize(NULL, layout.patch_bytes, 1),
                               resize(NULL, layout.scratch_bytes, 1)));
    must(s, psurf_construct(&s->patches, &s->construct));
}

static void free_surface(surface *s)
{
    free(s->patches.patches);
    free(s->patches.scratch);
    psurf_topology_destroy(s->topology);
}

static bool splits_a_face(const mesh *m, psurf_split split)
{
    const uint32_t most = split == PSURF_SPLIT_TRIANGLES ? 3 : 4;
    size_t i;
    for (i = 0; i < m->sizes.count; i++) {
        if (u32_at(&m->sizes, i) > most) return true;
    }
    return false;
}

static psurf_sample sample_of_corner(size_t face, uint32_t size, uint32_t corner)
{
    static const float square[4][2] = {{0, 0}, {1, 0}, {1, 1}, {0, 1}};
    psurf_sample at;
    at.face = (uint32_t)face;
    at.sector = corner;
    at.u = size < 5 ? square[size == 3 && corner == 2 ? 3 : corner][0] : 1;
    at.v = size < 5 ? square[size == 3 && corner == 2 ? 3 : corner][1] : 0;
    return at;
}

/* The library takes limits from the facets of the scheme. Where these are not pm's, points and
   normals come from pm's surface and replace those of the mesh. */
static void use_limits(description *d, mesh *m, psurf_split split)
{
    surface s;
    psurf_points out;
    size_t face, first = 0;
    uint32_t i;
    build_surface(&s, m, d, PSURF_PM);
    if (s.info.ngon_faces == 0 && !splits_a_face(m, split)) {
        free_surface(&s);
        return;
    }
    memset(&out, 0, sizeof out);
    m->normals.count = m->corner_normals.count = 0;
    for (face = 0; face < m->sizes.count; face++) {
        uint32_t size = u32_at(&m->sizes, face);
        for (i = 0; i < size; i++) {
            psurf_sample at = sample_of_corner(face, size, i);
            uint32_t v = u32_at(&m->corners, first + i);
            out.p = (float *)m->positions.data + 3 * (size_t)v;
            out.n = push(&m->normals, 3 * sizeof *out.n);
            psurf_eval(&s.patches, &at, 1, &out);
            push_u32(&m->corner_normals, (uint32_t)(first + i));
        }
        first += size;
    }
    free_surface(&s);
    d->construct.normal_mode = PSURF_NORMALS_AVERAGE;
    use_file_normals(d, m);
}

/* Whether normals of its own come with the mesh to a scheme other than pm. */
static bool find_normals(description *d, mesh *m, const options *o, psurf_split split)
{
    if (takes_file_normals(m, o)) use_file_normals(d, m);
    else if (d->construct.normal_mode == PSURF_NORMALS_LIMIT) use_limits(d, m, split);
    return d->construct.normals != NULL;
}

/* The surface that the command line asks for. */
static void make_surface(surface *s, mesh *m, const options *o)
{
    description d;
    describe(&d, m, o);
    if (o->scheme != PSURF_PM) find_normals(&d, m, o, psurf_scheme_split(o->scheme));
    build_surface(s, m, &d, o->scheme);
    free_description(&d);
}


/* The tessellation of one face by itself, in memory that the next face uses again. */
typedef struct face_points {
    array p, n;                         /* float[3] per vertex */
    array where;                        /* psurf_sample per vertex */
    array indices;                      /* uint32_t, counted from the face's first vertex */
} face_points;

static void tessellate_face(const surface *s, uint32_t rate, uint32_t face, bool points,
                            face_points *f)
{
    psurf_tess_desc desc;
    psurf_tess_span span;
    psurf_tess_out out;
    memset(&desc, 0, sizeof desc);
    memset(&out, 0, sizeof out);
    desc.rate = rate;
    desc.flags = PSURF_TESS_PER_FACE;
    must(s, psurf_tessellate_size(s->topology, &desc, face, 1, &span));
    if (points) {
        out.p = reserve(&f->p, span.vertex_count, 3 * sizeof *out.p);
        out.n = reserve(&f->n, span.vertex_count, 3 * sizeof *out.n);
    }
    out.where = reserve(&f->where, span.vertex_count, sizeof *out.where);
    out.indices = reserve(&f->indices, span.index_count, sizeof(uint32_t));
    out.first_vertex = span.first_vertex;
    out.first_index = span.first_index;
    must(s, psurf_tessellate(&s->patches, &desc, face, 1, &out));
}

static void free_face_points(face_points *f)
{
    free(f->p.data);
    free(f->n.data);
    free(f->where.data);
    free(f->indices.data);
}

/* ---- output files ---------------------------------------------------------------------------- */

/* A file that is there and not an ordinary one, /dev/full for instance, is written in place. */
static FILE *open_file(const char *path)
{
    struct stat facts;
    size_t size = strlen(path) + 16;
    char *name;
    FILE *file = NULL;
    int i;
    if (stat(path, &facts) == 0 && !S_ISREG(facts.st_mode)) return fopen(path, "wb");
    name = resize(NULL, size, 1);
    opening = 1;
    for (i = 0; i < 1000 && !file; i++) {
        snprintf(name, size, "%s.tmp%d", path, i);
        file = fopen(name, "wbx");      /* x: never over a file that is there */
        if (!file && errno != EEXIST) break;
    }
    if (file) temporary = name;
    else free(name);
    opening = 0;
    if (pending) on_signal(pending);
    return file;
}

output open_output(const char *path)
{
    output out;
    out.path = path && strcmp(path, "-") != 0 ? path : NULL;
    if (!out.path) {
        out.file = stdout;
        clear_bar();
        if (isatty(fileno(stdout))) bar.enabled = false;
#ifdef _WIN32
        _setmode(_fileno(stdout), _O_BINARY);
#endif
    } else {
        out.file = open_file(path);
    }
    if (!out.file) fail(path, 0, "cannot write the file: %s", strerror(errno));
    return out;
}

static NORETURN void fail_output(const output *out)
{
    fail(out->path ? out->path : "stdout", 0, "cannot write: %s", strerror(errno));
}

/* Called now and then while writing, so that a full disk ends a long job early. */
static void written(const output *out, uint64_t done, uint64_t total)
{
    if (ferror(out->file)) fail_output(out);
    progress(done, total);
}

void close_output(output *out)
{
    char *name = temporary;
    if (ferror(out->file) || fflush(out->file) != 0) fail_output(out);
    if (out->path && fclose(out->file) != 0) fail_output(out);
    if (name) {
#ifdef _WIN32
        remove(out->path);              /* rename does not replace there */
#endif
        if (rename(name, out->path) != 0) fail_output(out);
        temporary = NULL;
        free(name);
    }
}

static void put_float(FILE *file, float value)
{
    if (isnan(value)) fputs("nan", file);   /* without a sign, which means nothing */
    else fprintf(file, "%.9g", (double)value);
}

/* What info and check print: a line each, or the members of one JSON object. NaN: there is none. */
typedef struct fact { const char *key; double value; } fact;

static void print_facts(FILE *file, const fact *facts, size_t count, bool json)
{
    size_t i;
    for (i = 0; i < count; i++) {
        if (json) fprintf(file, "%s\"%s\":", i ? "," : "{", facts[i].key);
        else fprintf(file, "%-18s  ", facts[i].key);
        if (isnan(facts[i].value)) fputs(json ? "null" : "none", file);
        else fprintf(file, "%.15g", facts[i].value);
        if (!json) fputc('\n', file);
    }
    if (json) fputs("}\n", file);
}

/* ---- triangles and their writers ------------------------------------------------------------- */

typedef struct triangles {
    uint32_t vertex_count;
    size_t index_count;
    float *p, *n, *uv;                  /* uv: NULL without texture coordinates */
    uint32_t *indices;
} triangles;

static void put_floats(FILE *file, const char *key, const float *values, int count)
{
    int i;
    fputs(key, file);
    for (i = 0; i < count; i++) {
        fputc(' ', file);
        put_float(file, values[i]);
    }
    fputc('\n', file);
}

static void write_obj(const output *out, const triangles *t)
{
    uint64_t total = (uint64_t)t->vertex_count + t->index_count / 3;
    size_t v, i;
    fprintf(out->file, "# %s\n", PROGRAM);
    for (v = 0; v < t->vertex_count; v++) {
        put_floats(out->file, "v", t->p + 3 * v, 3);
        if (t->uv) put_floats(out->file, "vt", t->uv + 2 * v, 2);
        put_floats(out->file, "vn", t->n + 3 * v, 3);
        if (v % 4096 == 0) written(out, v, total);
    }
    for (i = 0; i < t->index_count; i++) {
        uint32_t k = t->indices[i] + 1;
        if (i % 3 == 0) fputs("f", out->file);
        if (t->uv) fprintf(out->file, " %" PRIu32 "/%" PRIu32 "/%" PRIu32, k, k, k);
        else fprintf(out->file, " %" PRIu32 "//%" PRIu32, k, k);
        if (i % 3 == 2) fputs("\n", out->file);
        if (i % 12288 == 0) written(out, v + i / 3, total);
    }
}

static void put_u32(FILE *file, uint32_t value)
{
    unsigned char bytes[4];
    int i;
    for (i = 0; i < 4; i++) bytes[i] = (unsigned char)(value >> 8 * i);
    fwrite(bytes, 1, 4, file);
}

static void put_f32(FILE *file, float value)
{
    uint32_t bits;
    memcpy(&bits, &value, sizeof bits);
    put_u32(file, bits);
}

static void write_ply(const output *out, const triangles *t)
{
    uint64_t total = (uint64_t)t->vertex_count + t->index_count / 3;
    size_t v, i, k;
    fprintf(out->file, "ply\nformat binary_little_endian 1.0\ncomment %s\n"
            "element vertex %" PRIu32 "\nproperty float x\nproperty float y\nproperty float z\n"
            "property float nx\nproperty float ny\nproperty float nz\n%s"
            "element face %zu\nproperty list uchar %s vertex_indices\nend_header\n", PROGRAM,
            t->vertex_count, t->uv ? "property float s\nproperty float t\n" : "",
            t->index_count / 3, t->vertex_count > INT32_MAX ? "uint" : "int");
    for (v = 0; v < t->vertex_count; v++) {
        for (k = 0; k < 3; k++) put_f32(out->file, t->p[3 * v + k]);
        for (k = 0; k < 3; k++) put_f32(out->file, t->n[3 * v + k]);
        for (k = 0; t->uv && k < 2; k++) put_f32(out->file, t->uv[2 * v + k]);
        if (v % 65536 == 0) written(out, v, total);
    }
    for (i = 0; i < t->index_count; i++) {
        if (i % 3 == 0) fputc(3, out->file);
        put_u32(out->file, t->indices[i]);
        if (i % 196608 == 0) written(out, v + i / 3, total);
    }
}

/* glTF asks for unit normals everywhere: one that does not exist points up. */
static void put_normal(FILE *file, const float n[3])
{
    bool none = n[0] == 0 && n[1] == 0 && n[2] == 0;
    put_f32(file, n[0]);
    put_f32(file, n[1]);
    put_f32(file, none ? 1.0f : n[2]);
}

static void find_bounds(const triangles *t, float low[3], float high[3])
{
    size_t v;
    int i;
    memcpy(low, t->p, 3 * sizeof *low);
    memcpy(high, t->p, 3 * sizeof *high);
    for (v = 1; v < t->vertex_count; v++) {
        for (i = 0; i < 3; i++) {
            float x = t->p[3 * v + (size_t)i];
            if (x < low[i]) low[i] = x;
            if (x > high[i]) high[i] = x;
        }
    }
}

/* Accessor i reads bufferView i; the views follow one another, each 4-byte aligned. */
static int describe_glb(char *json, size_t room, const triangles *t, bool wide)
{
    uint64_t n = t->vertex_count, indices_at = n * (t->uv ? 32 : 24);
    uint64_t index_bytes = (uint64_t)t->index_count * (wide ? 4 : 2);
    float low[3], high[3];
    char uv_accessor[96] = "", uv_view[96] = "";
    find_bounds(t, low, high);
    if (t->uv) {
        snprintf(uv_accessor, sizeof uv_accessor, ",{\"bufferView\":3,\"componentType\":5126,"
                 "\"count\":%" PRIu64 ",\"type\":\"VEC2\"}", n);
        snprintf(uv_view, sizeof uv_view, ",{\"buffer\":0,\"byteOffset\":%" PRIu64
                 ",\"byteLength\":%" PRIu64 ",\"target\":34962}", n * 24, n * 8);
    }
    return snprintf(json, room,
        "{\"asset\":{\"version\":\"2.0\",\"generator\":\"%s\"},\"scene\":0,"
        "\"scenes\":[{\"nodes\":[0]}],\"nodes\":[{\"mesh\":0}],\"meshes\":[{\"primitives\":["
        "{\"attributes\":{\"POSITION\":1,\"NORMAL\":2%s},\"indices\":0}]}],\"accessors\":["
        "{\"bufferView\":0,\"componentType\":%d,\"count\":%zu,\"type\":\"SCALAR\"},"
        "{\"bufferView\":1,\"componentType\":5126,\"count\":%" PRIu64 ",\"type\":\"VEC3\","
        "\"min\":[%.9g,%.9g,%.9g],\"max\":[%.9g,%.9g,%.9g]},"
        "{\"bufferView\":2,\"componentType\":5126,\"count\":%" PRIu64 ",\"type\":\"VEC3\"}%s],"
        "\"bufferViews\":["
        "{\"buffer\":0,\"byteOffset\":%" PRIu64 ",\"byteLength\":%" PRIu64 ",\"target\":34963},"
        "{\"buffer\":0,\"byteOffset\":0,\"byteLength\":%" PRIu64 ",\"target\":34962},"
        "{\"buffer\":0,\"byteOffset\":%" PRIu64 ",\"byteLength\":%" PRIu64 ",\"target\":34962}%s],"
        "\"buffers\":[{\"byteLength\":%" PRIu64 "}]}",
        PROGRAM, t->uv ? ",\"TEXCOORD_0\":3" : "", wide ? 5125 : 5123, t->index_count, n,
        (double)low[0], (double)low[1], (double)low[2], (double)high[0], (double)high[1],
        (double)high[2], n, uv_accessor, indices_at, index_bytes, n * 12, n * 12, n * 12, uv_view,
        indices_at + index_bytes);
}

static void write_glb_data(const output *out, const triangles *t, bool wide)
{
    uint64_t total = 2 * (uint64_t)t->vertex_count + t->index_count, done = 0;
    size_t v, i;
    for (v = 0; v < t->vertex_count; v++) {
        for (i = 0; i < 3; i++) put_f32(out->file, t->p[3 * v + i]);
        if (done++ % 65536 == 0) written(out, done, total);
    }
    for (v = 0; v < t->vertex_count; v++) {
        put_normal(out->file, t->n + 3 * v);
        if (done++ % 65536 == 0) written(out, done, total);
    }
    for (v = 0; t->uv && v < t->vertex_count; v++) {
        put_f32(out->file, t->uv[2 * v]);
        put_f32(out->file, 1.0f - t->uv[2 * v + 1]);    /* glTF counts v from the top */
    }
    for (i = 0; i < t->index_count; i++) {
        uint32_t k = t->indices[i];
        if (wide) put_u32(out->file, k);
        else if (i % 2) put_u32(out->file, k << 16 | t->indices[i - 1]);
        if (done++ % 65536 == 0) written(out, done, total);
    }
    if (!wide && t->index_count % 2) put_u32(out->file, t->indices[t->index_count - 1]);
}

static void write_glb(const output *out, const triangles *t)
{
    bool wide = t->vertex_count > 65535;    /* 0xFFFF restarts primitives and is no index */
    uint64_t binary = (uint64_t)t->vertex_count * (t->uv ? 32 : 24)
                      + ((uint64_t)t->index_count * (wide ? 4 : 2) + 3) / 4 * 4;
    char json[2048];
    uint32_t size = (uint32_t)describe_glb(json, sizeof json, t, wide);
    while (size % 4) json[size++] = ' ';
    if (28 + size + binary > UINT32_MAX) {
        fail(out->path ? out->path : "stdout", 0, "a GLB file ends at 4 GiB; use a lower rate");
    }
    put_u32(out->file, 0x46546C67);     /* "glTF" */
    put_u32(out->file, 2);
    put_u32(out->file, (uint32_t)(28 + size + binary));
    put_u32(out->file, size);
    put_u32(out->file, 0x4E4F534A);     /* "JSON" */
    fwrite(json, 1, size, out->file);
    put_u32(out->file, (uint32_t)binary);
    put_u32(out->file, 0x004E4942);     /* "BIN" */
    write_glb_data(out, t, wide);
}

static const struct writer {
    const char *extension;
    void (*write)(const output *out, const triangles *t);
} writers[] = {{".obj", write_obj}, {".ply", write_ply}, {".glb", write_glb}};

static bool ends_with(const char *path, const char *extension)
{
    size_t size = strlen(path), tail = strlen(extension), i;
    if (size < tail) return false;
    for (i = 0; i < tail; i++) {
        char c = path[size - tail + i];
        if (c >= 'A' && c <= 'Z') c = (char)(c - 'A' + 'a');
        if (c != extension[i]) return false;
    }
    return true;
}

/* Standard output has no extension and takes the first format. */
static const struct writer *find_writer(const char *path)
{
    size_t i;
    if (strcmp(path, "-") == 0) return &writers[0];
    for (i = 0; i < sizeof writers / sizeof *writers; i++) {
        if (ends_with(path, writers[i].extension)) return &writers[i];
    }
    fail(path, 0, "unknown output format; the name must end in .obj, .ply or .glb");
}

/* ---- tessellate ------------------------------------------------------------------------------ */

static void tessellate_welded(const surface *s, uint32_t rate, triangles *t)
{
    enum { FACES_AT_ONCE = 256 };
    psurf_tess_desc desc;
    psurf_tess_span span;
    psurf_tess_out out;
    uint32_t face;
    memset(&desc, 0, sizeof desc);
    memset(&out, 0, sizeof out);
    desc.rate = rate;
    must(s, psurf_tessellate_size(s->topology, &desc, 0, s->info.faces, &span));
    t->vertex_count = span.vertex_count;
    t->index_count = span.index_count;
    t->p = out.p = resize(NULL, span.vertex_count, 3 * sizeof *t->p);
    t->n = out.shade = resize(NULL, span.vertex_count, 3 * sizeof *t->n);
    out.indices = t->indices = resize(NULL, span.index_count, sizeof *t->indices);
    for (face = 0; face < s->info.faces; face += FACES_AT_ONCE) {
        must(s, psurf_tessellate(&s->patches, &desc, face, FACES_AT_ONCE, &out));
        progress(face, s->info.faces);
        if (s->info.faces - face <= FACES_AT_ONCE) break;
    }
}

/* A vertex of the welded mesh with one of its texture coordinates; next: with another one. */
typedef struct uv_vertex { float uv[2]; uint32_t source, next; } uv_vertex;

/* How far the two sides of an edge may be apart that have the same texture coordinate: rounding. */
static float rounding_of(const float *values, uint32_t count)
{
    float largest = 0;
    uint32_t i;
    for (i = 0; i < 2 * count; i++) largest = fmaxf(largest, fabsf(values[i]));
    return largest * 8 * FLT_EPSILON;
}

/* The vertex with this texture coordinate: the welded one, or one split off it at a seam. */
static uint32_t find_uv_vertex(array *vertices, uint32_t welded, const float uv[2], float rounding)
{
    uint32_t k = welded, last = welded;
    uv_vertex *v = (uv_vertex *)vertices->data + k;
    if (v->source != PSURF_NONE) {
        for (; k != PSURF_NONE; last = k, k = v->next) {
            v = (uv_vertex *)vertices->data + k;
            if (fabsf(v->uv[0] - uv[0]) <= rounding && fabsf(v->uv[1] - uv[1]) <= rounding) {
                return k;
            }
        }
        if (vertices->count >= PSURF_NONE) fail("patchsurf", 0, "more than 2^32 - 2 vertices");
        k = (uint32_t)vertices->count;
        v = push(vertices, sizeof *v);
        ((uv_vertex *)vertices->data + last)->next = k;
    }
    memcpy(v->uv, uv, sizeof v->uv);
    v->source = welded;
    v->next = PSURF_NONE;
    return k;
}

/* Copies the split vertices and hands the coordinates over. */
static void take_uv_vertices(triangles *t, const array *vertices)
{
    const uv_vertex *v = vertices->data;
    size_t count = vertices->count, i;
    t->p = resize(t->p, count, 3 * sizeof *t->p);
    t->n = resize(t->n, count, 3 * sizeof *t->n);
    t->uv = resize(NULL, count, 2 * sizeof *t->uv);
    for (i = 0; i < count; i++) memcpy(t->uv + 2 * i, v[i].uv, sizeof v[i].uv);
    for (i = t->vertex_count; i < count; i++) {
        memcpy(t->p + 3 * i, t->p + 3 * (size_t)v[i].source, 3 * sizeof *t->p);
        memcpy(t->n + 3 * i, t->n + 3 * (size_t)v[i].source, 3 * sizeof *t->n);
    }
    t->vertex_count = (uint32_t)count;
}

/* A face has the same triangles in the same order in both numberings: of the whole mesh, and of the
   face alone. So the texture coordinate of each corner of each triangle is known. */
static void add_texture(const surface *s, uint32_t rate, triangles *t)
{
    const mesh *m = s->mesh;
    face_points f;
    array vertices = {NULL, 0, 0}, uvs = {NULL, 0, 0};
    uint32_t face, *index = t->indices;
    size_t corner = 0, i;
    memset(&f, 0, sizeof f);
    for (i = 0; i < t->vertex_count; i++) {
        uv_vertex *v = push(&vertices, sizeof *v);
        v->source = v->next = PSURF_NONE;
    }
    for (face = 0; face < s->info.faces; face++) {
        uint32_t size = u32_at(&m->sizes, face);
        float rounding = rounding_of(floats_at(&m->uvs, corner, 2), size), *uv;
        tessellate_face(s, rate, face, false, &f);
        uv = reserve(&uvs, f.where.count, 2 * sizeof *uv);
        psurf_interpolate(s->topology, f.where.data, (uint32_t)f.where.count, m->uvs.data, 2, uv,
                          0);
        for (i = 0; i < f.indices.count; i++, index++) {
            const float *own = uv + 2 * (size_t)u32_at(&f.indices, i);
            *index = find_uv_vertex(&vertices, *index, own, rounding);
        }
        corner += size;
        progress(face, s->info.faces);
    }
    take_uv_vertices(t, &vertices);
    free(vertices.data);
    free(uvs.data);
    free_face_points(&f);
}

static void put_vertices_back(const surface *s, triangles *t)
{
    size_t i;
    for (i = 0; i < 3 * (size_t)t->vertex_count; i++) t->p[i] = put_back(s->mesh, t->p[i], i % 3);
}

static void refuse_overflow(const surface *s, const triangles *t)
{
    size_t i;
    for (i = 0; i < 3 * (size_t)t->vertex_count; i++) {
        if (!isfinite(t->p[i]) || !isfinite(t->n[i])
            || (t->uv && i < 2 * (size_t)t->vertex_count && !isfinite(t->uv[i]))) {
            fail(s->mesh->name, 0, "coordinates are so large that the surface is not finite");
        }
    }
}

static int run_tessellate(mesh *m, const options *o)
{
    surface s;
    triangles t = {0, 0, NULL, NULL, NULL, NULL};
    output out;
    make_surface(&s, m, o);
    tessellate_welded(&s, o->rate, &t);
    if (m->uvs.count) add_texture(&s, o->rate, &t);
    put_vertices_back(&s, &t);
    refuse_overflow(&s, &t);
    out = open_output(o->output);
    find_writer(o->output)->write(&out, &t);
    close_output(&out);
    free(t.p);
    free(t.n);
    free(t.uv);
    free(t.indices);
    free_surface(&s);
    return EXIT_SUCCESS;
}

/* ---- patches --------------------------------------------------------------------------------- */

/* How many of the points that are stored are places; normals and marks follow them. */
static const size_t place_counts[PSURF_KIND_COUNT] = {16, 13, 19, 25, 31, 10, 16, 10, 18, 21, 15,
                                                      15};

static void write_patch(FILE *file, const mesh *m, const psurf_patch *patch)
{
    size_t i, axis;
    fprintf(file, "{\"face\":%" PRIu32 ",\"sector\":%" PRIu32 ",\"kind\":\"%s\",\"points\":[",
            patch->face, patch->sector, psurf_kind_name(patch->kind));
    for (i = 0; i < patch->point_count; i++) {
        fputs(i ? ",[" : "[", file);
        for (axis = 0; axis < 3; axis++) {
            float x = patch->points[3 * i + axis];
            if (i < place_counts[patch->kind]) x = put_back(m, x, axis);
            if (axis) fputc(',', file);
            if (isfinite(x)) put_float(file, x);
            else fputs("null", file);
        }
        fputc(']', file);
    }
    fputs("]}", file);
}

static int run_patches(mesh *m, const options *o)
{
    surface s;
    output out;
    uint32_t i;
    make_surface(&s, m, o);
    out = open_output(o->output);
    fprintf(out.file, "{\"scheme\":\"%s\",\"patches\":[\n", o->scheme_name);
    for (i = 0; i < s.info.facets; i++) {
        psurf_patch patch = psurf_get_patch(&s.patches, i);
        if (i) fputs(",\n", out.file);
        write_patch(out.file, m, &patch);
        if (i % 256 == 0) written(&out, i, s.info.facets);
    }
    fputs("\n]}\n", out.file);
    close_output(&out);
    free_surface(&s);
    return EXIT_SUCCESS;
}

/* ---- sample ---------------------------------------------------------------------------------- */

/* The samples of one face in the order of the table: sector by sector, v outer, u inner. */
typedef struct face_grid {
    uint32_t rate, sectors;
    bool round;                         /* the first sector is the next of the last */
    bool quads, last_quad;              /* the sectors are quads; the last one is */
    size_t per_sector;
    array samples;                      /* psurf_sample */
    array vertices;                     /* uint32_t: in the face's tessellation */
} face_grid;

static size_t grid_size(uint32_t rate, bool quad)
{
    size_t n = (size_t)rate + 1;
    return quad ? n * n : n * (n + 1) / 2;
}

/* Faces of up to four corners are one sector. Others are triangles round their centre with pm, fans
   of quads and a last triangle with pn, fans of triangles with all other schemes. */
static void start_grid(face_grid *g, psurf_split split, uint32_t size, uint32_t rate)
{
    size_t count;
    g->rate = rate;
    g->round = size >= 5 && split == PSURF_SPLIT_PM;
    if (size < 5) g->sectors = 1;
    else g->sectors = g->round ? size : split == PSURF_SPLIT_PN ? (size - 1) / 2 : size - 2;
    g->quads = size == 4 || (size >= 5 && split == PSURF_SPLIT_PN);
    g->last_quad = g->quads && size % 2 == 0;
    g->per_sector = grid_size(rate, g->quads);
    count = (g->sectors - 1) * g->per_sector + grid_size(rate, g->last_quad);
    reserve(&g->samples, count, sizeof(psurf_sample));
    reserve(&g->vertices, count, sizeof(uint32_t));
}

static void place(face_grid *g, psurf_sample sample, uint32_t vertex)
{
    size_t u = (size_t)(sample.u * (float)g->rate + 0.5f);
    size_t v = (size_t)(sample.v * (float)g->rate + 0.5f);
    size_t n = (size_t)g->rate + 1;
    bool quad = sample.sector + 1 == g->sectors ? g->last_quad : g->quads;
    size_t row = quad ? v * n : v * (2 * n + 1 - v) / 2;
    size_t k = sample.sector * g->per_sector + row + u;
    ((psurf_sample *)g->samples.data)[k] = sample;
    ((uint32_t *)g->vertices.data)[k] = vertex;
}

/* Sectors share lines, which the tessellation has once: the line with v = 0 of a sector is the one
   with u = 0 of the sector before it. */
static void place_shared(face_grid *g, psurf_sample sample, uint32_t vertex)
{
    psurf_sample other = sample;
    other.u = sample.v;
    other.v = sample.u;
    if (sample.u == 0 && sample.v == 0) {
        for (other.sector = 0; other.sector < g->sectors; other.sector++) place(g, other, vertex);
    } else if (sample.v == 0 && (g->round || sample.sector > 0)) {
        other.sector = (sample.sector + g->sectors - 1) % g->sectors;
        place(g, other, vertex);
    } else if (sample.u == 0 && (g->round || sample.sector + 1 < g->sectors)) {
        other.sector = (sample.sector + 1) % g->sectors;
        place(g, other, vertex);
    }
}

static void fill_grid(face_grid *g, const face_points *f)
{
    uint32_t i;
    for (i = 0; i < f->where.count; i++) {
        psurf_sample where = ((const psurf_sample *)f->where.data)[i];
        if (g->sectors == 1) where.sector = 0;
        place(g, where, i);
        if (g->sectors > 1) place_shared(g, where, i);
    }
}

static void write_samples(FILE *file, const mesh *m, const face_grid *g, const face_points *f,
                          const array curvatures[2])
{
    size_t i, k;
    for (i = 0; i < g->samples.count; i++) {
        const psurf_sample *at = (const psurf_sample *)g->samples.data + i;
        uint32_t vertex = u32_at(&g->vertices, i);
        fprintf(file, "%" PRIu32 ",%" PRIu32 ",%.9g,%.9g", at->face, at->sector, (double)at->u,
                (double)at->v);
        for (k = 0; k < 6; k++) {
            float x = floats_at(k < 3 ? &f->p : &f->n, vertex, 3)[k % 3];
            fputc(',', file);
            put_float(file, k < 3 ? put_back(m, x, k) : x);
        }
        for (k = 0; k < 2 && curvatures[k].data; k++) {
            float value = *floats_at(&curvatures[k], i, 1);
            fputc(',', file);
            if (isfinite(value)) put_float(file, value);
        }
        fputc('\n', file);
    }
}

static int run_sample(mesh *m, const options *o)
{
    surface s;
    output out;
    face_points f;
    face_grid g;
    array curvatures[2] = {{NULL, 0, 0}, {NULL, 0, 0}};     /* Gaussian, mean */
    uint32_t face;
    memset(&f, 0, sizeof f);
    memset(&g, 0, sizeof g);
    make_surface(&s, m, o);
    out = open_output(o->output);
    fprintf(out.file, "face,sector,u,v,x,y,z,nx,ny,nz%s\n", o->curvature ? ",gauss,mean" : "");
    for (face = 0; face < s.info.faces; face++) {
        tessellate_face(&s, o->rate, face, true, &f);
        start_grid(&g, psurf_scheme_split(o->scheme), u32_at(&m->sizes, face), o->rate);
        fill_grid(&g, &f);
        if (o->curvature) {
            psurf_curvature(&s.patches, g.samples.data, (uint32_t)g.samples.count,
                            reserve(&curvatures[0], g.samples.count, sizeof(float)),
                            reserve(&curvatures[1], g.samples.count, sizeof(float)));
        }
        write_samples(out.file, m, &g, &f, curvatures);
        written(&out, face, s.info.faces);
    }
    close_output(&out);
    free(curvatures[0].data);
    free(curvatures[1].data);
    free(g.samples.data);
    free(g.vertices.data);
    free_face_points(&f);
    free_surface(&s);
    return EXIT_SUCCESS;
}

/* ---- check ----------------------------------------------------------------------------------- */

enum { LISTED = 20 };

/* What is counted by edge and named as well. */
typedef struct named_edges {
    const char *name;
    bool (*concerns)(const psurf_check_result *part);
    array edges;                        /* uint32_t: at most LISTED and one more */
} named_edges;

static bool is_degenerate(const psurf_check_result *part) { return part->degenerate > 0; }
static bool is_fallback(const psurf_check_result *part) { return part->fallback_edges > 0; }

/* Finds the edges by halving the range, of which the result is known. */
static void find_edges(const surface *s, uint32_t rate, uint32_t first, uint32_t count,
                       const psurf_check_result *known, named_edges *named)
{
    uint32_t middle = count / 2, half;
    psurf_check_result part;
    if (!named->concerns(known)) return;
    if (count == 1) push_u32(&named->edges, first);
    for (half = 0; half < 2 && count > 1 && named->edges.count <= LISTED; half++) {
        uint32_t begin = half ? first + middle : first, size = half ? count - middle : middle;
        must(s, psurf_check(&s->patches, &s->construct, rate, begin, size, &part));
        find_edges(s, rate, begin, size, &part, named);
    }
}

static psurf_check_result check_all_edges(const surface *s, uint32_t rate, named_edges named[2])
{
    const uint32_t at_once = 1024 + s->info.edges / 64;     // every call reads all positions
    psurf_check_result sum, part;
    uint32_t edge;
    memset(&sum, 0, sizeof sum);
    sum.worst_face = sum.worst_edge = PSURF_NONE;
    for (edge = 0; edge < s->info.edges; edge += at_once) {
        uint32_t left = s->info.edges - edge, count = left < at_once ? left : at_once;
        must(s, psurf_check(&s->patches, &s->construct, rate, edge, count, &part));
        sum.samples += part.samples;
        sum.cracks += part.cracks;
        sum.nonfinite += part.nonfinite;
        sum.degenerate += part.degenerate;
        sum.sharp_edges += part.sharp_edges;
        sum.fallback_edges += part.fallback_edges;
        if (sum.worst_face == PSURF_NONE || part.max_normal_deg > sum.max_normal_deg) {
            sum.max_normal_deg = part.max_normal_deg;
            sum.worst_face = part.worst_face;
            sum.worst_edge = part.worst_edge;
        }
        find_edges(s, rate, edge, count, &part, &named[0]);
        find_edges(s, rate, edge, count, &part, &named[1]);
        progress(edge, s->info.edges);
        if (left <= at_once) break;
    }
    return sum;
}

/* The ends of an edge, in the numbers of the file, and the face that writes it. */
static void print_edge(FILE *file, const surface *s, const char *name, uint32_t edge)
{
    psurf_tables t;
    uint32_t corner, kind = 0, sides, facet, next, v, w;
    const psurf_corner *corners;
    const psurf_ring *rings;
    psurf_topology_tables(s->topology, &t);
    corners = t.corners.data;
    rings = t.rings.data;
    corner = ((const psurf_edge *)t.edges.data)[edge].corner;
    while (corner >= t.kind_first_corner[kind + 1]) kind++;
    sides = (t.kind_first_corner[kind + 1] - t.kind_first_corner[kind])
            / (t.kind_first[kind + 1] - t.kind_first[kind]);
    facet = (corner - t.kind_first_corner[kind]) / sides;
    next = t.kind_first_corner[kind] + facet * sides;
    next += (corner - next + 1) % sides;
    v = rings[corners[corner].ring & ~PSURF_WRITER].point + s->mesh->first;
    w = rings[corners[next].ring & ~PSURF_WRITER].point + s->mesh->first;
    fprintf(file, "%-18s  vertices %" PRIu32 " and %" PRIu32 ", face %" PRIu32 "\n", name, v, w,
            ((const psurf_facet *)t.facets.data)[t.kind_first[kind] + facet].face);
}

static void print_check(const surface *s, const psurf_check_result *c, const named_edges named[2],
                        bool json)
{
    const fact facts[] = {
        {"samples", (double)c->samples}, {"cracks", (double)c->cracks},
        {"max_normal_deg", c->max_normal_deg}, {"sharp_edges", c->sharp_edges},
        {"nonfinite", (double)c->nonfinite}, {"degenerate_normals", (double)c->degenerate},
        {"worst_face", c->worst_face == PSURF_NONE ? nan("") : c->worst_face},
        {"fallback_edges", c->fallback_edges},
    };
    output out = open_output(NULL);
    size_t i;
    int k;
    print_facts(out.file, facts, sizeof facts / sizeof *facts, json);
    for (k = 0; !json && k < 2; k++) {
        size_t count = named[k].edges.count;
        for (i = 0; i < count && i < LISTED; i++) {
            print_edge(out.file, s, named[k].name, u32_at(&named[k].edges, i));
        }
        if (count > LISTED) fprintf(out.file, "%-18s  ... and more\n", named[k].name);
    }
    close_output(&out);
}

static int run_check(mesh *m, const options *o)
{
    surface s;
    psurf_check_result result;
    named_edges named[2] = {{"degenerate edge", is_degenerate, {NULL, 0, 0}},
                            {"fallback edge", is_fallback, {NULL, 0, 0}}};
    make_surface(&s, m, o);
    result = check_all_edges(&s, o->rate, named);
    print_check(&s, &result, named, o->json);
    free(named[0].edges.data);
    free(named[1].edges.data);
    free_surface(&s);
    return result.cracks || result.nonfinite ? EXIT_CHECK : EXIT_SUCCESS;
}

/* ---- info ------------------------------------------------------------------------------------ */

/* What is said of triangle meshes: how far vertex normals and triangle normals are apart, and how
   the surface bends along its edges. */
typedef struct triangle_facts {
    bool exist;                         /* every face is a triangle */
    double mean, std, min, max;         /* cosine between the two normals, over all corners */
    size_t convex, concave, inflection; /* edges */
} triangle_facts;

/* A triangle mesh as the schemes see it that interpolate it: three corners a face. */
typedef struct triangle_mesh {
    double *points, *normals;           /* [corners][3] each */
    double *flat;                       /* [faces][3]: unit normals of the triangles, */
    double *areas;                      /* [faces]: and twice their areas */
    uint32_t *rings;                    /* [corners]: equal where corners share a normal */
    size_t corners, ring_count;
} triangle_mesh;

static void free_triangle_mesh(triangle_mesh *t)
{
    free(t->points);
    free(t->normals);
    free(t->flat);
    free(t->areas);
    free(t->rings);
}

/* Points, rings and, if they are the limit's, normals from the library, which has one patch a face
   here, in their order. */
static void take_triangles(triangle_mesh *t, const surface *s, bool limit)
{
    const mesh *m = s->mesh;
    const psurf_patches_layout *layout = &s->patches.layout;
    const char *scratch = s->patches.scratch;
    psurf_tables tables;
    size_t i, k;
    psurf_topology_tables(s->topology, &tables);
    t->corners = m->corners.count;
    t->ring_count = s->info.rings;
    t->rings = resize(NULL, t->corners, sizeof *t->rings);
    t->points = resize(NULL, t->corners, 3 * sizeof *t->points);
    t->normals = resize(NULL, t->corners, 3 * sizeof *t->normals);
    for (i = 0; i < t->corners; i++) {
        const psurf_corner *corner = (const psurf_corner *)tables.corners.data + i;
        size_t ring = t->rings[i] = corner->ring & ~PSURF_WRITER, v = u32_at(&m->corners, i);
        const void *points = scratch + layout->limit_offset, *normals = scratch
                             + layout->normal_offset;
        for (k = 0; k < 3; k++) {
            t->points[3 * i + k] = (double)(limit ? ((const float *)points)[3 * ring + k]
                                            : floats_at(&m->positions, v, 3)[k]);
            if (limit) t->normals[3 * i + k] = (double)((const float *)normals)[3 * ring + k];
        }
    }
}

static void measure_faces(triangle_mesh *t)
{
    size_t face, k;
    t->flat = resize(NULL, t->corners / 3, 3 * sizeof *t->flat);
    t->areas = resize(NULL, t->corners / 3, sizeof *t->areas);
    for (face = 0; face < t->corners / 3; face++) {
        const double *p = t->points + 9 * face;
        double a[3], b[3], *n = t->flat + 3 * face;
        for (k = 0; k < 3; k++) {
            a[k] = p[3 + k] - p[k];
            b[k] = p[6 + k] - p[k];
        }
        cross(a, b, n);
        t->areas[face] = sqrt(dot(n, n));
        normalize(n);
    }
}

/* The mean of the triangles' normals around each corner's ring. */
static void average_normals(triangle_mesh *t, bool by_area)
{
    double *sums = resize(NULL, t->ring_count, 3 * sizeof *sums);
    size_t i, k;
    for (i = 0; i < 3 * t->ring_count; i++) sums[i] = 0;
    for (i = 0; i < t->corners; i++) {
        double weight = by_area ? t->areas[i / 3] : 1, *sum = sums + 3 * (size_t)t->rings[i];
        for (k = 0; k < 3; k++) sum[k] += weight * t->flat[i / 3 * 3 + k];
    }
    for (i = 0; i < t->ring_count; i++) normalize(sums + 3 * i);
    for (i = 0; i < t->corners; i++) {
        memcpy(t->normals + 3 * i, sums + 3 * (size_t)t->rings[i], 3 * sizeof *sums);
    }
    free(sums);
}

static void take_file_normals(triangle_mesh *t, const mesh *m)
{
    size_t i, k;
    for (i = 0; i < t->corners; i++) {
        const float *n = floats_at(&m->normals, u32_at(&m->corner_normals, i), 3);
        for (k = 0; k < 3; k++) t->normals[3 * i + k] = (double)n[k];
        normalize(t->normals + 3 * i);
    }
}

static void measure_cosines(const triangle_mesh *t, triangle_facts *facts)
{
    double sum = 0;
    size_t i;
    int pass;
    facts->min = 2;
    facts->max = -2;
    for (pass = 0; pass < 2; pass++) {  /* the mean first, then the deviation from it */
        for (i = 0, sum = 0; i < t->corners; i++) {
            double cosine = dot(t->normals + 3 * i, t->flat + i / 3 * 3);
            facts->min = fmin(facts->min, cosine);
            facts->max = fmax(facts->max, cosine);
            sum += pass == 0 ? cosine : (cosine - facts->mean) * (cosine - facts->mean);
        }
        if (pass == 0) facts->mean = sum / (double)t->corners;
    }
    facts->std = sqrt(sum / ((double)t->corners - 1));
}

/* A hard edge has normals on either side: those of its first face count. */
static void count_bends(const mesh *m, const triangle_mesh *t, triangle_facts *facts)
{
    size_t count, i, k;
    mesh_edge *edges = list_edges(m, &count);
    for (i = 0; i < count; i++) {
        size_t a = 3 * (size_t)edges[i].corner[0][0], b = 3 * (size_t)edges[i].corner[0][1];
        double d[3], at_a, at_b;
        for (k = 0; k < 3; k++) d[k] = t->points[b + k] - t->points[a + k];
        at_a = dot(t->normals + a, d);
        at_b = -dot(t->normals + b, d);
        if (at_a < 0 && at_b < 0) facts->convex++;
        else if (at_a > 0 && at_b > 0) facts->concave++;
        else facts->inflection++;
    }
    free(edges);
}

/* s: the triangles with a patch each, from the normals that the command line asks for. */
static void measure_triangles(const surface *s, triangle_facts *facts)
{
    const mesh *m = s->mesh;
    const bool limit = s->construct.normals == NULL
                       && s->construct.normal_mode == PSURF_NORMALS_LIMIT;
    triangle_mesh t;
    memset(&t, 0, sizeof t);
    take_triangles(&t, s, limit);
    measure_faces(&t);
    if (s->construct.normals) take_file_normals(&t, m);
    else if (!limit) average_normals(&t, s->construct.normal_mode == PSURF_NORMALS_AREA);
    measure_cosines(&t, facts);
    count_bends(m, &t, facts);
    free_triangle_mesh(&t);
}

static double count_points(const psurf_patches_layout *layout)
{
    double points = 0;
    int kind;
    for (kind = 0; kind < PSURF_KIND_COUNT; kind++) {
        points += (double)layout->kind[kind].count * layout->kind[kind].points;
    }
    return points;
}

/* Counts by class are those of pm, memory is that of the scheme. */
static void print_info(const surface *s, const psurf_info *classes, const triangle_facts *t,
                       bool json)
{
    const psurf_info *i = &s->info;
    const uint32_t *faces = classes->kind_faces;
    const fact facts[] = {
        {"vertices", i->vertices}, {"faces", i->faces}, {"edges", i->edges},
        {"boundary_edges", i->boundary_edges}, {"hard_edges", i->hard_edges},
        {"components", i->components}, {"max_valence", i->max_valence},
        {"ordinary", faces[PSURF_BICUBIC]}, {"polar", faces[PSURF_POLAR]}, {"p3", faces[PSURF_P3]},
        {"p4", faces[PSURF_P4]}, {"p5", faces[PSURF_P5]}, {"ngon", classes->ngon_faces},
        {"valence2", i->valence2}, {"control_points", count_points(&s->patches.layout)},
        {"bytes", (double)i->bytes + (double)s->patches.layout.patch_bytes},
        {"cos_mean", t->mean}, {"cos_std", t->std}, {"cos_min", t->min}, {"cos_max", t->max},
        {"convex", (double)t->convex}, {"concave", (double)t->concave},
        {"inflection", (double)t->inflection},
    };
    output out = open_output(NULL);
    print_facts(out.file, facts, sizeof facts / sizeof *facts - (t->exist ? 0 : 7), json);
    close_output(&out);
}

static int run_info(mesh *m, const options *o)
{
    description d;
    surface pm, own, flat, *asked = o->scheme == PSURF_PM ? &pm : &own;
    triangle_facts facts;
    memset(&facts, 0, sizeof facts);
    memset(&own, 0, sizeof own);
    describe(&d, m, o);
    build_surface(&pm, m, &d, PSURF_PM);
    facts.exist = !splits_a_face(m, PSURF_SPLIT_TRIANGLES);
    if (asked == &own) find_normals(&d, m, o, psurf_scheme_split(o->scheme));
    else if (facts.exist && o->normals == NORMALS_INPUT) {
        find_normals(&d, m, o, PSURF_SPLIT_TRIANGLES);      /* pm itself ignores them */
    }
    if (asked == &own) build_surface(&own, m, &d, o->scheme);
    if (facts.exist) {
        build_surface(&flat, m, &d, PSURF_CUBIC_PN_B1);
        measure_triangles(&flat, &facts);
        free_surface(&flat);
    }
    print_info(asked, &pm.info, &facts, o->json);
    free_surface(&pm);
    free_surface(&own);
    free_description(&d);
    return EXIT_SUCCESS;
}

/* ---- report ---------------------------------------------------------------------------------- */

static report_desc describe_report(const options *o)
{
    report_desc r;
    memset(&r, 0, sizeof r);
    r.table = o->table;
    r.scheme = o->scheme_name;
    r.variant = (int)o->variant;
    r.flags = o->flags;
    r.sigma = (double)o->sigma;
    r.step = o->step;
    r.json = o->json;
    r.svg = o->svg;
    r.has_mesh = o->input != NULL;
    r.computed_normals = o->normals >= NORMALS_COMPUTED;
    if (r.computed_normals) r.normal_mode = o->normals - NORMALS_COMPUTED;
    return r;
}

/* m: NULL where the command line names none. What is wrong with a mesh is found here, where its
   lines are known. */
static int run_report(mesh *m, const options *o)
{
    report_desc r = describe_report(o);
    description d;
    int status;
    r.mesh = m;
    if (!m) return report(&r);
    describe(&d, m, o);
    psurf_topology_destroy(create_topology(m, &d, PSURF_SPLIT_PM));
    r.corners = d.mesh.corners;
    r.corner_count = d.mesh.corner_count;
    if (o->scheme_name == NULL || o->scheme != PSURF_PM) {
        r.file_normals = find_normals(&d, m, o, PSURF_SPLIT_TRIANGLES);
    }
    status = report(&r);
    free_description(&d);
    return status;
}

/* ---- commands -------------------------------------------------------------------------------- */

enum { INFO = 1, TESSELLATE = 2, PATCHES = 4, SAMPLE = 8, CHECK = 16, REPORT = 32,
       MESHES = 31, EVERY = 63 };

static const struct command {
    const char *name;
    unsigned bit;
    int (*run)(mesh *m, const options *o);
    const char *usage, *summary, *help;
} commands[] = {
    {"info", INFO, run_info, "MESH [--json]", "counts and classes of the mesh",
     "Counts the input mesh and its faces by class of the scheme pm: ordinary (bicubic), polar,\n"
     "p3 p4 p5 (triangles, quads and pentagons beside irregular vertices), ngon (split: six\n"
     "corners and more, at inner vertices of two edges, or alone on one side of a crease).\n"
     "bytes is what topology and patches occupy. For triangle meshes also the cosine between\n"
     "vertex normals and triangle normals (std: n - 1), and how many edges are convex, concave,\n"
     "or neither (inflection): by the normals that --normals names, averaged ones for pm.\n\n"
     "Examples:\n"
     "    patchsurf info spot.obj\n"
     "    patchsurf info cow.obj --normals input --json\n"},
    {"tessellate", TESSELLATE, run_tessellate, "MESH -o OUT", "the smooth surface as triangles",
     "Writes the smooth surface as a triangle mesh with normals, and with texture coordinates\n"
     "where the input has them; vertices on their seams and on hard edges are split. Normals\n"
     "are those that the scheme shades with: pn and smoothed_n have their own, the others the\n"
     "surface's. The name of OUT decides the format: .obj, .ply (binary) or .glb; - writes OBJ\n"
     "to standard output. OUT appears when it is complete.\n\n"
     "Examples:\n"
     "    patchsurf tessellate spot.obj -o smooth.glb\n"
     "    patchsurf tessellate spot.ply -o smooth.ply --rate 16 --blend 0.3\n"
     "    patchsurf tessellate part.obj -o smooth.glb --crease-angle 40\n"
     "    patchsurf tessellate cow.obj -o smooth.glb --scheme wm --normals average\n"
     "    patchsurf tessellate cow.obj -o smooth.glb --scheme smoothed_n --variant final\n"
     "    patchsurf tessellate - -o - < spot.obj > smooth.obj\n"},
    {"patches", PATCHES, run_patches, "MESH [-o OUT.json]", "control points of the patches",
     "Writes the patches as JSON: face, sector (piece of a split face), kind and all points that\n"
     "are stored, by kind, then by face. The header documents their order.\n\n"
     "Examples:\n"
     "    patchsurf patches spot.obj\n"
     "    patchsurf patches cow.obj --scheme hybrid\n"
     "    patchsurf patches spot.obj -o spot.json\n"},
    {"sample", SAMPLE, run_sample, "MESH [-o OUT.csv] [--curvature]",
     "points and normals as a table",
     "Writes positions and unit normals at R+1 samples per edge as CSV, face by face, v outer\n"
     "and u inner; faces of five and more corners sector by sector (triangles round the centre,\n"
     "for schemes but pm the pieces that the face is split into), lines that two sectors share\n"
     "in both. These are exactly the bits that tessellation writes. Curvature that does\n"
     "not exist, at poles for instance, is left empty; the mean curvature of a sphere seen from\n"
     "outside is negative. Normals are the surface's, whatever the scheme shades with.\n\n"
     "Examples:\n"
     "    patchsurf sample spot.obj --rate 4\n"
     "    patchsurf sample cow.obj --scheme png1 --curvature\n"
     "    patchsurf sample spot.obj --curvature -o spot.csv\n"},
    {"check", CHECK, run_check, "MESH [--json]", "compares shared edges from both sides",
     "Compares the samples of every edge as its two faces have them: positions must agree bit\n"
     "for bit; the largest angle between normals is printed. Normals are not compared on sharp\n"
     "edges, which are hard or have a blend ratio of 0 at an end, nor where they are degenerate:\n"
     "on edges shorter than 1e-5 of the bounding box diagonal, beside faces with an angle under\n"
     "0.5 degrees, at tips of slits, and where a normal is zero; such edges are listed, and so\n"
     "are fallback edges, where the scheme's construction is singular and fell back to a simpler\n"
     "one. Faces count from 0. Exit status 1 on a crack or a value that is not finite.\n\n"
     "Examples:\n"
     "    patchsurf check spot.obj\n"
     "    patchsurf check spot.obj --rate 33 --json\n"
     "    patchsurf check cow.obj --scheme hybrid\n"},
    {"report", REPORT, run_report, "TABLE [MESH] [--step N] [--json] [--svg FILE]",
     "the published tables, computed anew",
     "Reproduces the tables of the papers in double precision, beside the printed figures.\n"
     "    sphere     distance to the unit sphere: an icosahedron, each triangle split in four N\n"
     "               times; 231 samples a triangle\n"
     "    torus      distance to a torus of N x N quads in halves; and of its normals\n"
     "    curvature  Gaussian curvature at 171 inner samples a triangle: sphere, torus, and MESH\n"
     "    costs      operations that the blended control points of a sample take, counted\n"
     "    patches    control points a facet, patches by kind, evaluations at N samples an edge\n"
     "std is the standard deviation (n - 1), std_printed what the papers print as such: in the\n"
     "tables of distances, deviations are from half the mean.\n\n"
     "Examples:\n"
     "    patchsurf report sphere\n"
     "    patchsurf report torus --step 40 --json\n"
     "    patchsurf report sphere --step 4 --svg sphere.svg\n"
     "    patchsurf report curvature cow.obj --scheme png1\n"},
};

/* ---- options --------------------------------------------------------------------------------- */

static NORETURN void fail_option(const char *name, const char *takes, const char *value)
{
    fail("patchsurf", 0, "%s takes %s, not %s", name, takes, value);
}

static double to_option(const char *name, const char *takes, const char *value, double low,
                        double high)
{
    char *end;
    double number = strtod(value, &end);
    if (end == value || *end || !(number >= low && number <= high)) fail_option(name, takes, value);
    return number;
}

static int64_t to_whole_option(const char *name, const char *takes, const char *value, int64_t low,
                               int64_t high)
{
    const char *at = value, *end = value + strlen(value);
    int64_t number;
    if (!scan_integer(&at, end, &number) || at != end || number < low || number > high) {
        fail_option(name, takes, value);
    }
    return number;
}

/* The place of a value among names, of which NULL is the last. */
static int to_choice(const char *name, const char *takes, const char *const *names,
                     const char *value)
{
    int i;
    for (i = 0; names[i]; i++) {
        if (strcmp(value, names[i]) == 0) return i;
    }
    fail_option(name, takes, value);
}

static void set_output(options *o, const char *value) { o->output = value; }
static void set_svg(options *o, const char *value) { o->svg = value; }
static void set_json(options *o, const char *value) { (void)value; o->json = true; }
static void set_curvature(options *o, const char *value) { (void)value; o->curvature = true; }
static void set_quiet(options *o, const char *value) { (void)o; (void)value; quiet = true; }
static void set_help(options *o, const char *value) { (void)value; o->help = true; }
static void set_version(options *o, const char *value) { (void)value; o->version = true; }

/* wm is a second name of cubic_wm_b1; mixed needs a scheme for each face, which no file has. */
static void set_scheme(options *o, const char *value)
{
    char names[200] = "wm";
    int i;
    o->scheme_name = value;
    o->scheme = PSURF_WM;
    if (strcmp(value, "wm") == 0) return;
    for (i = 0; i < PSURF_MIXED; i++) {
        const char *name = psurf_scheme_name((psurf_scheme)i);
        o->scheme = (psurf_scheme)i;
        if (strcmp(value, name) == 0) return;
        snprintf(names + strlen(names), sizeof names - strlen(names), ", %s", name);
    }
    fail("patchsurf", 0, "unknown scheme %s; there are %s", value, names);
}

static void set_rate(options *o, const char *value)
{
    char takes[48];
    snprintf(takes, sizeof takes, "a whole number from 1 to %u", PSURF_MAX_RATE);
    o->rate = (uint32_t)to_whole_option("--rate", takes, value, 1, PSURF_MAX_RATE);
}

static void set_step(options *o, const char *value)
{
    o->step = to_whole_option("--step", "a whole number from 0", value, 0, 1000000);
}

static void set_blend(options *o, const char *value)
{
    o->blend = (float)to_option("--blend", "a number from 0 to 1", value, 0, 1);
    o->has_blend = true;
}

static void set_crease_angle(options *o, const char *value)
{
    o->crease_angle = to_option("--crease-angle", "degrees from 0 to 180", value, 0, 180);
    o->has_crease_angle = true;
}

static void set_normals(options *o, const char *value)
{
    static const char *const names[] = {"input", "average", "average-area", "limit", NULL};
    o->normals = NORMALS_INPUT + to_choice("--normals", "input, average, average-area or limit",
                                           names, value);
}

static void set_variant(options *o, const char *value)
{
    static const char *const names[] = {"g1", "final", "intermediate", NULL};
    o->variant = (psurf_variant)to_choice("--variant", "intermediate, final or g1", names, value);
}

static void set_shading(options *o, const char *value)
{
    static const char *const names[] = {"linear", "quadratic", "exact", NULL};
    o->shading = (psurf_shading)to_choice("--shading", "linear, quadratic or exact", names, value);
}

static void set_plane(options *o, const char *value)
{
    static const char *const names[] = {"bisector", "normals", NULL};
    if (to_choice("--plane", "bisector or normals", names, value)) o->flags |= PSURF_PLANE_NORMALS;
}

static void set_sigma(options *o, const char *value)
{
    o->sigma = (float)to_option("--sigma", "a finite number", value, -(double)FLT_MAX,
                                (double)FLT_MAX);
    o->flags |= PSURF_SIGMA;
}

static void set_coons(options *o, const char *value) { (void)value; o->flags |= PSURF_COONS; }
static void set_folds(options *o, const char *value) { (void)value; o->flags |= PSURF_FOLDS; }
static void set_flat(options *o, const char *value) { (void)value; o->flags |= PSURF_NEARLY_FLAT; }

enum { ANY_SCHEME = 0, OF_PM = 1u << PSURF_PM, OF_PN = 1u << PSURF_PN,
       OF_N = 1u << PSURF_SMOOTHED_N, OF_HYBRID = 1u << PSURF_HYBRID };

static const struct option {
    const char *name, *value;           /* value: what its argument is called, or NULL */
    unsigned commands, schemes;
    void (*set)(options *o, const char *value);
    const char *help;
} option_table[] = {
    {"-o", "OUT", TESSELLATE | PATCHES | SAMPLE, ANY_SCHEME, set_output,
     "file to write; - is standard output"},
    {"--json", NULL, INFO | CHECK | REPORT, ANY_SCHEME, set_json, "print one JSON object"},
    {"--step", "N", REPORT, ANY_SCHEME, set_step, "this refinement step, not those of the papers"},
    {"--svg", "FILE", REPORT, ANY_SCHEME, set_svg,
     "plot mean distances against the steps up to N (sphere, torus)"},
    {"--curvature", NULL, SAMPLE, ANY_SCHEME, set_curvature, "add Gaussian and mean curvature"},
    {"--scheme", "S", EVERY, ANY_SCHEME, set_scheme,
     "the surface: pm (default; report: those of the tables), pn, smoothed_n,\n"
     "                        hybrid, png1, wm = cubic_wm_b1, cubic_pn_b1, and for comparison\n"
     "                        cubic_wm_b2, cubic_pn_b2"},
    {"--variant", "V", EVERY, OF_N, set_variant, "smoothed_n: g1 (default), final or intermediate"},
    {"--sigma", "X", EVERY, OF_PN | OF_N, set_sigma,
     "pn, smoothed_n: how far the inside is drawn out (default 0.5)"},
    {"--coons", NULL, EVERY, OF_PN, set_coons, "pn: the inside of quads by the Coons rule"},
    {"--folds", NULL, EVERY, OF_N, set_folds,
     "smoothed_n final: folds beyond 90 degrees are not flat"},
    {"--nearly-flat", NULL, EVERY, OF_N, set_flat,
     "smoothed_n final: edges below 11 degrees count as flat"},
    {"--plane", "P", EVERY, OF_HYBRID, set_plane,
     "hybrid: bisector (default) of the faces, or normals"},
    {"--shading", "N", MESHES, OF_N, set_shading,
     "smoothed_n: linear (default), quadratic or exact normals"},
    {"--normals", "N", EVERY, ANY_SCHEME, set_normals,
     "input, average, average-area or limit (points and normals of pm's\n"
     "                        surface), for all schemes but pm; default: input where every\n"
     "                        corner has one, else average"},
    {"--rate", "R", MESHES, ANY_SCHEME, set_rate, "segments per edge, 1 to 16384 (default 8)"},
    {"--blend", "A", MESHES, OF_PM, set_blend,
     "pm: blend ratio of edges without a tag: 0 sharp, 2/3 (default)\n"
     "                        B-spline, 1 soft"},
    {"--crease-angle", "DEG", EVERY, ANY_SCHEME, set_crease_angle,
     "edges folded more sharply become hard"},
    {"--quiet", NULL, EVERY, ANY_SCHEME, set_quiet, "no warnings and no progress bar"},
    {"--help", NULL, EVERY, ANY_SCHEME, set_help, "this text"},
    {"--version", NULL, EVERY, ANY_SCHEME, set_version, "name and version"},
};

enum { COMMAND_COUNT = sizeof commands / sizeof *commands,
       OPTION_COUNT = sizeof option_table / sizeof *option_table };

/* Options that the scheme does not have. */
static void check_schemes(const options *o)
{
    int i, k;
    for (i = 0; i < OPTION_COUNT; i++) {
        char names[80] = "";
        const unsigned schemes = option_table[i].schemes;
        if (!(o->given >> i & 1) || !schemes || schemes >> o->scheme & 1) continue;
        for (k = 0; k < PSURF_SCHEME_COUNT; k++) {
            if (!(schemes >> k & 1)) continue;
            snprintf(names + strlen(names), sizeof names - strlen(names), "%s%s",
                     *names ? " and " : "", psurf_scheme_name((psurf_scheme)k));
        }
        fail("patchsurf", 0, "%s goes with %s, not with %s", option_table[i].name, names,
             psurf_scheme_name(o->scheme));
    }
    if (o->flags & (PSURF_FOLDS | PSURF_NEARLY_FLAT) && o->variant != PSURF_N_FINAL) {
        fail("patchsurf", 0, "%s goes with --variant final alone",
             o->flags & PSURF_FOLDS ? "--folds" : "--nearly-flat");
    }
}

static void print_help(FILE *file, const struct command *command)
{
    int i;
    fprintf(file, "Usage: patchsurf %s %s [options]\n\n%s\nOptions:\n", command->name,
            command->usage, command->help);
    for (i = 0; i < OPTION_COUNT; i++) {
        const struct option *option = &option_table[i];
        if (option->commands & command->bit) {
            fprintf(file, "    %-14s %-4s %s\n", option->name, option->value ? option->value : "",
                    option->help);
        }
    }
    fputs("\nMESH is a Wavefront OBJ or PLY file, or - for standard input: polygons of any size,\n"
          "counter-clockwise seen from outside, at most two at an edge. OBJ files may have tags.\n"
          "\"t crease\" of a sharpness s >= 10 makes an edge hard: a smooth curve with one normal\n"
          "on each side; below, it sets the blend ratio (2/3) 2^-s at both ends. \"t corner\" of\n"
          "s >= 10 keeps a vertex in place where two or more hard or boundary edges meet.\n"
          "Schemes other than pm take vertex normals: those of the file (vn; nx ny nz), which\n"
          "make an edge hard where its sides differ by a degree or more, or computed ones.\n"
          "Meshes far from the origin are computed about their middle and written where they are.\n"
          "Exit status: 0 done, 1 a check failed, 2 bad usage or bad input.\n", file);
}

static void print_overview(FILE *file)
{
    int i;
    fputs("Usage: patchsurf COMMAND MESH [options]\n"
          "       patchsurf report TABLE [MESH] [options]\n\n"
          "Turns a polygon mesh into a smooth surface.\n\nCommands:\n", file);
    for (i = 0; i < COMMAND_COUNT; i++) {
        fprintf(file, "    %-11s %s\n", commands[i].name, commands[i].summary);
    }
    fputs("\n    patchsurf COMMAND --help    options and examples\n    patchsurf --version\n\n"
          "Try:\n    patchsurf tessellate mesh.obj -o smooth.glb\n", file);
}

static const struct command *find_command(const char *name)
{
    int i;
    for (i = 0; i < COMMAND_COUNT; i++) {
        if (strcmp(commands[i].name, name) == 0) return &commands[i];
    }
    fail("patchsurf", 0, "unknown command %s; patchsurf --help lists them", name);
}

/* Takes --name VALUE and --name=VALUE. Returns how many arguments it used. */
static int read_option(const struct command *command, options *o, char **arguments)
{
    const char *name = arguments[0], *equals = strchr(name, '=');
    size_t size = equals ? (size_t)(equals - name) : strlen(name);
    int i;
    for (i = 0; i < OPTION_COUNT; i++) {
        const struct option *option = &option_table[i];
        const char *value = equals ? equals + 1 : arguments[1];
        if (!(option->commands & command->bit) || strlen(option->name) != size
            || memcmp(option->name, name, size) != 0) continue;
        if (option->value && !value) fail("patchsurf", 0, "%s needs a value", name);
        if (!option->value && equals) fail("patchsurf", 0, "%s takes no value", option->name);
        option->set(o, value);
        o->given |= 1u << i;
        return option->value && !equals ? 2 : 1;
    }
    fail("patchsurf", 0, "%s has no option %s; patchsurf %s --help lists them", command->name, name,
         command->name);
}

static void take_argument(const struct command *command, options *o, const char *argument)
{
    if (command->bit == REPORT && !o->table) {
        o->table = argument;
    } else {
        if (o->input) fail("patchsurf", 0, "one mesh at a time, not %s as well", argument);
        o->input = argument;
    }
}

/* What is missing, and what does not go together: before anything is computed. */
static void check_arguments(const struct command *command, const options *o)
{
    report_desc r;
    if (command->bit == REPORT) {
        if (!HAS_REPORT) fail("patchsurf", 0, "this program was built without report.c");
        if (!o->table) fail("patchsurf", 0, "report needs a table: report %s", command->usage);
        r = describe_report(o);
        check_report(&r);
    } else if (!o->input) {
        fail("patchsurf", 0, "%s needs a mesh: %s %s", command->name, command->name,
             command->usage);
    }
    check_schemes(o);
    if (command->bit == TESSELLATE) {
        if (!o->output) fail("patchsurf", 0, "tessellate needs -o OUT");
        find_writer(o->output);
    }
}

static void read_arguments(const struct command *command, options *o, char **arguments)
{
    while (*arguments) {
        if ((*arguments)[0] == '-' && (*arguments)[1]) {
            arguments += read_option(command, o, arguments);
        } else {
            take_argument(command, o, *arguments++);
        }
    }
    if (o->help || o->version) return;
    check_arguments(command, o);
    if (command->bit != REPORT && !o->scheme_name) o->scheme_name = psurf_scheme_name(o->scheme);
}

/* Help and version, which need no mesh. */
static int print_text(bool version, const struct command *command)
{
    output out = open_output(NULL);
    if (version) fprintf(out.file, "%s\n", PROGRAM);
    else if (command) print_help(out.file, command);
    else print_overview(out.file);
    close_output(&out);
    return EXIT_SUCCESS;
}

int main(int argc, char **argv)
{
    const struct command *command;
    options o;
    mesh m;
    int status;
    memset(&o, 0, sizeof o);
    o.rate = 8;
    o.step = -1;
    if (argc < 2) {
        print_overview(stderr);
        return EXIT_BAD;
    }
    if (strcmp(argv[1], "--version") == 0 || strcmp(argv[1], "--help") == 0) {
        return print_text(strcmp(argv[1], "--version") == 0, NULL);
    }
    command = find_command(argv[1]);
    read_arguments(command, &o, argv + 2);
    if (o.help || o.version) return print_text(!o.help, command);
    signal(SIGINT, on_signal);
    signal(SIGTERM, on_signal);
    bar.enabled = !quiet && isatty(fileno(stderr));
    bar.next = clock() + CLOCKS_PER_SEC / 2;
    if (o.input) read_mesh(&m, o.input);
    status = command->run(o.input ? &m : NULL, &o);
    clear_bar();
    if (o.input) free_mesh(&m);
    return status;
}
