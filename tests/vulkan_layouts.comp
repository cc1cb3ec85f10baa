#version 450
/* The passes of patchsurf.h over the very arrays of patchsurf.h: vertices, bicubic and P4 facets,
   evaluation of both. One SPIR-V module; PASS chooses. See vulkan_layouts.c. */

layout(local_size_x = 64) in;
layout(constant_id = 0) const uint PASS = 0u;   /* enum pass in vulkan_layouts.c */

const uint BICUBIC = 0u, P4 = 3u;               /* psurf_kind */
const uint P4_POINTS = 25u;
const uint WRITER = 0x80000000u;                /* PSURF_WRITER */
const uint VALENCE = 0x00FFFFFFu;               /* PSURF_RING_VALENCE */

struct ring_t { uint point, first_spoke, valence, trig; };
struct spoke_t { uint end, after, before; };
struct corner_t { uint ring, spoke, edge; };
struct facet_t { uint face, piece; };
struct trig_t { float c, s; };
struct sample_t { uint face, sector; float u, v; };

layout(std430, binding = 0) readonly buffer rings_b { ring_t rings[]; };
layout(std430, binding = 1) readonly buffer spokes_b { spoke_t spokes[]; };
layout(std430, binding = 2) readonly buffer corners_b { corner_t corners[]; };
layout(std430, binding = 3) readonly buffer facets_b { facet_t facets[]; };
layout(std430, binding = 4) readonly buffer trig_b { trig_t trig[]; };
layout(std430, binding = 5) readonly buffer blends_b { float blends[]; };
layout(std430, binding = 6) readonly buffer face_facet_b { uint face_facet[]; };
layout(std430, binding = 7) readonly buffer positions_b { float positions[]; };
layout(std430, binding = 8) readonly buffer samples_b { sample_t samples[]; };
layout(std430, binding = 9) buffer limit_b { float limits[]; };            /* scratch */
layout(std430, binding = 10) buffer spoke_points_b { float spoke_points[]; };
layout(std430, binding = 11) buffer bicubic_b { float bicubic[]; };        /* patches */
layout(std430, binding = 12) buffer p4_b { float p4[]; };
layout(std430, binding = 13) writeonly buffer result_b { float result[]; };

layout(push_constant) uniform push_b {
    uint count;                     /* of invocations with something to do */
    uint blend_count;               /* 0: every blend ratio is 2/3 */
    uint kind_first[6], kind_first_corner[6];
};

vec3 position(uint i)
{
    return vec3(positions[3u * i], positions[3u * i + 1u], positions[3u * i + 2u]);
}

vec3 limit_point(uint ring)
{
    return vec3(limits[3u * ring], limits[3u * ring + 1u], limits[3u * ring + 2u]);
}

/* t_j (which = 0) and f_j (which = 1) of a spoke. */
vec3 spoke_point(uint spoke, uint which)
{
    uint i = 6u * spoke + 3u * which;
    return vec3(spoke_points[i], spoke_points[i + 1u], spoke_points[i + 2u]);
}

void store_spoke_point(uint spoke, uint which, vec3 p)
{
    uint i = 6u * spoke + 3u * which;
    spoke_points[i] = p.x;
    spoke_points[i + 1u] = p.y;
    spoke_points[i + 2u] = p.z;
}

/* ---- vertices: [PM] eqs. 14 to 16 ------------------------------------------------------------ */

/* f_j - p */
vec3 face_offset(vec3 p, uint spoke, uint next_spoke)
{
    float a = 2.0 / 3.0, b = 2.0 / 3.0;
    if (blend_count != 0u) {
        a = blends[spoke];
        b = blends[next_spoke];
    }
    vec3 e0 = position(spokes[spoke].end) - p, e1 = position(spokes[next_spoke].end) - p;
    vec3 far = position(spokes[spoke].after) + position(spokes[spoke].before) - 2.0 * p;
    return 0.5 * ((1.0 - a) * b * e0 + a * (1.0 - b) * e1) + 0.25 * a * b * (e0 + e1 + 0.5 * far);
}

void construct_vertex(uint r)
{
    ring_t ring = rings[r];
    uint n = ring.valence & VALENCE;
    trig_t scales = trig[ring.trig];            /* 9 / (n (n + 5)), 1 / (2 n lambda_n) */
    vec3 p = position(ring.point);
    vec3 sum = vec3(0.0), t1 = vec3(0.0), t2 = vec3(0.0);
    for (uint j = 0u; j < n; j++) {
        uint next = (j + 1u) % n;
        trig_t a = trig[ring.trig + 1u + j], b = trig[ring.trig + 1u + next];
        vec3 f = face_offset(p, ring.first_spoke + j, ring.first_spoke + next);
        sum += f;
        t1 += (a.c + b.c) * f;
        t2 += (a.s + b.s) * f;
        store_spoke_point(ring.first_spoke + j, 1u, p + f);
    }
    vec3 v = p + scales.c * sum;
    t1 *= scales.s;
    t2 *= scales.s;
    limits[3u * r] = v.x;
    limits[3u * r + 1u] = v.y;
    limits[3u * r + 2u] = v.z;
    for (uint j = 0u; j < n; j++) {
        trig_t a = trig[ring.trig + 1u + j];
        store_spoke_point(ring.first_spoke + j, 0u, v + (a.c * t1 + a.s * t2));
    }
}

/* ---- facets: [PM] eqs. 17, 20, 21 ------------------------------------------------------------ */

struct corner_data { vec3 v, t0, t1, f, fr, fl; float chi, s; };

corner_data load_corner(uint corner)
{
    uint r = corners[corner].ring & ~WRITER, spoke = corners[corner].spoke;
    ring_t ring = rings[r];
    uint n = ring.valence & VALENCE, j = spoke - ring.first_spoke;
    uint next = ring.first_spoke + (j + 1u) % n, previous = ring.first_spoke + (j + n - 1u) % n;
    corner_data d;
    d.v = limit_point(r);
    d.t0 = spoke_point(spoke, 0u);
    d.t1 = spoke_point(next, 0u);
    d.f = spoke_point(spoke, 1u);
    d.fr = spoke_point(previous, 1u);
    d.fl = spoke_point(next, 1u);
    d.chi = 1.0 + trig[ring.trig + 2u].c;
    d.s = trig[ring.trig + 2u].s;
    return d;
}

void store_bicubic(uint patch_index, uint point, vec3 p)
{
    uint i = 3u * (16u * patch_index + point);
    bicubic[i] = p.x;
    bicubic[i + 1u] = p.y;
    bicubic[i + 2u] = p.z;
}

void construct_bicubic(uint k)
{
    /* Where v, t0, f, t1 of the four corners lie among the points 4 * j + i. */
    const uint v_at[4] = uint[4](0u, 3u, 15u, 12u), t0_at[4] = uint[4](1u, 7u, 14u, 8u);
    const uint f_at[4] = uint[4](5u, 6u, 10u, 9u), t1_at[4] = uint[4](4u, 2u, 11u, 13u);
    for (uint i = 0u; i < 4u; i++) {
        corner_data d = load_corner(kind_first_corner[BICUBIC] + 4u * k + i);
        store_bicubic(k, v_at[i], d.v);
        store_bicubic(k, t0_at[i], d.t0);
        store_bicubic(k, t1_at[i], d.t1);
        store_bicubic(k, f_at[i], d.f);
    }
}

void store_p4(uint patch_index, uint point, vec3 p)
{
    uint i = 3u * (P4_POINTS * patch_index + point);
    p4[i] = p.x;
    p4[i + 1u] = p.y;
    p4[i + 2u] = p.z;
}

void construct_p4(uint k)       /* mu = 1, w = 1 */
{
    corner_data d[4];
    vec3 b211[4], b121[4], centre = vec3(0.0);
    for (uint i = 0u; i < 4u; i++) {
        d[i] = load_corner(kind_first_corner[P4] + 4u * k + i);
        centre += d[i].v + 3.0 * (d[i].t0 + d[i].t1) + 9.0 * d[i].f;
    }
    centre /= 64.0;
    for (uint i = 0u; i < 4u; i++) {
        corner_data a = d[i], b = d[(i + 1u) % 4u];
        float tau = 3.0 / (8.0 * (a.s + b.s));
        vec3 b310 = 0.25 * a.v + 0.75 * a.t0, b130 = 0.75 * b.t1 + 0.25 * b.v;
        b211[i] = b310 + 0.25 * a.chi * (b.t1 - a.t0) + 0.125 * (2.0 - b.chi) * (a.t0 - a.v)
                + tau * (a.f - a.fr);
        b121[i] = b130 + 0.25 * b.chi * (a.t0 - b.t1) + 0.125 * (2.0 - a.chi) * (b.t1 - b.v)
                + tau * (b.f - b.fl);
    }
    for (uint i = 0u; i < 4u; i++) {
        uint i1 = (i + 1u) % 4u, i2 = (i + 2u) % 4u, i3 = (i + 3u) % 4u;
        vec3 b112 = centre + 0.1875 * (b211[i] + b121[i] - b121[i1] - b211[i3])
                  + 0.0625 * (b211[i1] + b121[i3] - b211[i2] - b121[i2]);
        store_p4(k, 6u * i, d[i].v);
        store_p4(k, 6u * i + 1u, d[i].t0);
        store_p4(k, 6u * i + 2u, d[i1].t1);
        store_p4(k, 6u * i + 3u, b211[i]);
        store_p4(k, 6u * i + 4u, b121[i]);
        store_p4(k, 6u * i + 5u, b112);
    }
    store_p4(k, 24u, centre);
}

/* ---- evaluation ------------------------------------------------------------------------------ */

struct surface_point { vec3 p, du, dv; };

/* The one function behind every facet boundary, for both kinds: the same operations from both
   sides, hence the same bits. s + r = 1. */
vec3 boundary(vec3 v0, vec3 t0, vec3 t1, vec3 v1, float s, float r)
{
    precise vec3 p = (v0 * ((r * r) * r) + v1 * ((s * s) * s))
                   + (t0 * (3.0 * ((r * r) * s)) + t1 * (3.0 * ((s * s) * r)));
    return p;
}

vec3 g(uint patch_index, uint point)
{
    uint i = 3u * (16u * patch_index + point);
    return vec3(bicubic[i], bicubic[i + 1u], bicubic[i + 2u]);
}

surface_point eval_bicubic(uint k, float u, float v)
{
    float ru = 1.0 - u, rv = 1.0 - v;
    float bu[4] = float[4](ru * ru * ru, 3.0 * ru * ru * u, 3.0 * ru * u * u, u * u * u);
    float bv[4] = float[4](rv * rv * rv, 3.0 * rv * rv * v, 3.0 * rv * v * v, v * v * v);
    float du[4] = float[4](-3.0 * ru * ru, 3.0 * ru * (ru - 2.0 * u), 3.0 * u * (2.0 * ru - u),
                           3.0 * u * u);
    float dv[4] = float[4](-3.0 * rv * rv, 3.0 * rv * (rv - 2.0 * v), 3.0 * v * (2.0 * rv - v),
                           3.0 * v * v);
    surface_point o = surface_point(vec3(0.0), vec3(0.0), vec3(0.0));
    for (uint j = 0u; j < 4u; j++)
        for (uint i = 0u; i < 4u; i++) {
            vec3 c = g(k, 4u * j + i);
            o.p += bu[i] * bv[j] * c;
            o.du += du[i] * bv[j] * c;
            o.dv += bu[i] * dv[j] * c;
        }
    if (v == 0.0) o.p = boundary(g(k, 0u), g(k, 1u), g(k, 2u), g(k, 3u), u, ru);
    else if (u == 1.0) o.p = boundary(g(k, 3u), g(k, 7u), g(k, 11u), g(k, 15u), v, rv);
    else if (v == 1.0) o.p = boundary(g(k, 15u), g(k, 14u), g(k, 13u), g(k, 12u), ru, u);
    else if (u == 0.0) o.p = boundary(g(k, 12u), g(k, 8u), g(k, 4u), g(k, 0u), rv, v);
    return o;
}

/* Stored point of sector i (mod 4): 0 to 5 are v, t0, t1, b211, b121, b112. */
vec3 h(uint patch_index, uint i, uint point)
{
    uint k = 3u * (P4_POINTS * patch_index + 6u * (i % 4u) + point);
    return vec3(p4[k], p4[k + 1u], p4[k + 2u]);
}

vec3 p4_centre(uint patch_index)
{
    uint k = 3u * (P4_POINTS * patch_index + 24u);
    return vec3(p4[k], p4[k + 1u], p4[k + 2u]);
}

vec3 b310(uint k, uint i) { return 0.25 * h(k, i, 0u) + 0.75 * h(k, i, 1u); }
vec3 b130(uint k, uint i) { return 0.75 * h(k, i, 2u) + 0.25 * h(k, i + 1u, 0u); }

/* b301, b202, b103 of sector i, on its line to the centre; i >= 1, m = 4: plain means. */
vec3 b301(uint k, uint i) { return 0.5 * (b310(k, i) + b130(k, i - 1u)); }
vec3 b202(uint k, uint i) { return 0.5 * (h(k, i, 3u) + h(k, i - 1u, 4u)); }
vec3 b103(uint k, uint i) { return 0.5 * (h(k, i, 5u) + h(k, i - 1u, 5u)); }

/* Sector i of a P4 patch at weights (a, b, c) of corner i, corner i+1 and the centre: the 25 stored
   points make its 15, row by row towards the centre; de Casteljau in place. */
surface_point eval_sector(uint k, uint i, float a, float b, float c)
{
    vec3 q[5][5];
    uint i1 = i + 1u, i4 = i + 4u;          /* i again, but i4 - 1 exists */
    q[0][0] = h(k, i, 0u);
    q[0][1] = b310(k, i);
    q[0][2] = 0.5 * (h(k, i, 1u) + h(k, i, 2u));
    q[0][3] = b130(k, i);
    q[0][4] = h(k, i1, 0u);
    q[1][0] = b301(k, i4);
    q[1][1] = h(k, i, 3u);
    q[1][2] = h(k, i, 4u);
    q[1][3] = b301(k, i1);
    q[2][0] = b202(k, i4);
    q[2][1] = h(k, i, 5u);
    q[2][2] = b202(k, i1);
    q[3][0] = b103(k, i4);
    q[3][1] = b103(k, i1);
    q[4][0] = p4_centre(k);
    for (int d = 4; d > 1; d--)
        for (int y = 0; y < d; y++)
            for (int x = 0; x < d - y; x++)
                q[y][x] = a * q[y][x] + b * q[y][x + 1] + c * q[y + 1][x];
    surface_point o;
    o.p = a * q[0][0] + b * q[0][1] + c * q[1][0];
    o.du = q[0][1] - q[0][0];
    o.dv = q[1][0] - q[0][0];
    return o;
}

/* The unit square, turned until its sector lies at the bottom: (s, height), r = 1 - s. */
surface_point eval_p4(uint k, float u, float v)
{
    float ru = 1.0 - u, rv = 1.0 - v;
    uint i = 0u;
    float s = u, r = ru, height = v;
    if (ru < height) { i = 1u; s = v; r = rv; height = ru; }
    if (rv < height) { i = 2u; s = ru; r = u; height = rv; }
    if (u < height) { i = 3u; s = rv; r = v; height = u; }
    surface_point o = eval_sector(k, i, r - height, s - height, 2.0 * height);
    if (height == 0.0)
        o.p = boundary(h(k, i, 0u), h(k, i, 1u), h(k, i, 2u), h(k, i + 1u, 0u), s, r);
    return o;
}

void evaluate(uint index)
{
    sample_t place = samples[index];
    uint facet = face_facet[place.face];
    vec3 nan = vec3(uintBitsToFloat(0x7FC00000u));
    surface_point o = surface_point(nan, nan, nan);     /* stays so if no such patch is found */
    if (facets[facet].face == place.face) {
        if (facet < kind_first[BICUBIC + 1u])
            o = eval_bicubic(facet - kind_first[BICUBIC], place.u, place.v);
        else if (facet >= kind_first[P4] && facet < kind_first[P4 + 1u])
            o = eval_p4(facet - kind_first[P4], place.u, place.v);
    }
    vec3 n = normalize(cross(o.du, o.dv));
    result[6u * index] = o.p.x;
    result[6u * index + 1u] = o.p.y;
    result[6u * index + 2u] = o.p.z;
    result[6u * index + 3u] = n.x;
    result[6u * index + 4u] = n.y;
    result[6u * index + 5u] = n.z;
}

void main()
{
    uint i = gl_GlobalInvocationID.x;
    if (i >= count) return;
    switch (PASS) {
    case 0u: construct_vertex(i); break;
    case 1u: construct_bicubic(i); break;
    case 2u: construct_p4(i); break;
    case 3u: evaluate(i); break;
    }
}
