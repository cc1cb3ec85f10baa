// opensubdiv.cc - OpenSubdiv's ways from a mesh to points and normals, at their fastest.
//
// What makes each fast is kept: vertices of four floats, for which alone CpuEvaluator has a SIMD
// path; no varying, face-varying or offset tables; evaluation in blocks that stay in the first
// cache; stencils, patch coordinates and surfaces made once, outside of what is timed.

#include "bench.h"

#include <opensubdiv/bfr/refinerSurfaceFactory.h>
#include <opensubdiv/bfr/surface.h>
#include <opensubdiv/far/patchMap.h>
#include <opensubdiv/far/patchTableFactory.h>
#include <opensubdiv/far/stencilTableFactory.h>
#include <opensubdiv/far/topologyDescriptor.h>
#include <opensubdiv/far/topologyRefinerFactory.h>
#include <opensubdiv/osd/cpuEvaluator.h>
#include <opensubdiv/osd/cpuPatchTable.h>

#include <algorithm>
#include <cmath>
#include <memory>
#include <numeric>
#include <vector>

namespace Far = OpenSubdiv::Far;
namespace Osd = OpenSubdiv::Osd;
namespace Sdc = OpenSubdiv::Sdc;
namespace Bfr = OpenSubdiv::Bfr;

// ---- shared by all paths -----------------------------------------------------------------------

namespace {

enum { ISOLATION = 2, LENGTH = 4, BLOCK = 256 };    // LENGTH: floats per vertex, one unused
typedef std::unique_ptr<Far::TopologyRefiner> refiner_ptr;
typedef std::unique_ptr<const Far::StencilTable> stencils_ptr;

refiner_ptr make_refiner(const mesh &m)
{
    Far::TopologyDescriptor desc;
    desc.numVertices = static_cast<int>(m.vertices);
    desc.numFaces = static_cast<int>(m.faces);
    desc.numVertsPerFace = reinterpret_cast<const int *>(m.face_sizes);
    desc.vertIndicesPerFace = reinterpret_cast<const int *>(m.face_vertices);
    Sdc::Options options;
    options.SetVtxBoundaryInterpolation(Sdc::Options::VTX_BOUNDARY_EDGE_AND_CORNER);
    typedef Far::TopologyRefinerFactory<Far::TopologyDescriptor> factory;
    return refiner_ptr(
        factory::Create(desc, factory::Options(Sdc::SCHEME_CATMARK, options)));
}

void load_positions(const mesh &m, float *to)
{
    for (size_t i = 0; i < m.vertices; i++) {
        std::copy(m.positions + 3 * i, m.positions + 3 * i + 3, to + LENGTH * i);
        to[LENGTH * i + 3] = 0;
    }
}

// Part of a table of stencils, as the evaluator takes it.
struct stencil_range {
    const int *sizes, *indices;
    const float *weights;
    int count;
};

stencil_range all_of(const Far::StencilTableReal<float> &table)
{
    const stencil_range all = {table.GetSizes().data(), table.GetControlIndices().data(),
                               table.GetWeights().data(), table.GetNumStencils()};
    return all;
}

void apply(const stencil_range &range, const float *from, float *to)
{
    const Osd::BufferDescriptor desc(0, LENGTH, LENGTH);
    if (range.count)
        Osd::CpuEvaluator::EvalStencils(from, desc, to, desc, range.sizes, NULL, range.indices,
                                        range.weights, 0, range.count);
}

void set_normal(float *n, const float *du, const float *dv)
{
    const float x = du[1] * dv[2] - du[2] * dv[1];
    const float y = du[2] * dv[0] - du[0] * dv[2];
    const float z = du[0] * dv[1] - du[1] * dv[0];
    const float scale = 1.0f / std::sqrt(x * x + y * y + z * z);
    n[0] = x * scale;
    n[1] = y * scale;
    n[2] = z * scale;
}

// Parameters of an n * n lattice.
void make_lattice(uint32_t n, std::vector<float> *u, std::vector<float> *v)
{
    u->clear();
    v->clear();
    for (uint32_t j = 0; j < n; j++)
        for (uint32_t i = 0; i < n; i++) {
            u->push_back(static_cast<float>(i) / static_cast<float>(n - 1));
            v->push_back(static_cast<float>(j) / static_cast<float>(n - 1));
        }
}

}

struct osd_path {
    explicit osd_path(const mesh &m) : input(m) {}
    virtual ~osd_path() {}
    virtual void drop() = 0;
    virtual void build() = 0;
    virtual void shed() {}              // frees what a frame does not need
    virtual void refresh() = 0;
    virtual size_t sample(uint32_t n, uint32_t faces) = 0;
    virtual void evaluate(float *out) = 0;
    virtual void positions(float *out) = 0;
    virtual uint32_t index_of(uint32_t v) const { return v; }
    const mesh &input;
};

namespace {

// ---- tables: control points by stencils, then patches ------------------------------------------

class table_path : public osd_path {
public:
    typedef Far::PatchTableFactory::Options patch_options;

    table_path(const mesh &m, patch_options::EndCapType cap, bool levels)
        : osd_path(m), cap_(cap), levels_(levels) {}

    void drop() override
    {
        refiner_.reset();
        stencils_.reset();
        patches_.reset();
        cpu_patches_.reset();
        points_.reset();
    }

    void build() override
    {
        patch_options options(ISOLATION);
        options.SetEndCapType(cap_);
        options.generateVaryingTables = false;
        options.generateVaryingLocalPoints = false;
        refiner_ = make_refiner(input);
        refiner_->RefineAdaptive(options.GetRefineAdaptiveOptions());
        patches_.reset(Far::PatchTableFactory::Create(*refiner_, options));
        make_stencils();
        cpu_patches_.reset(Osd::CpuPatchTable::Create(patches_.get()));
        points_.reset(
            new float[LENGTH * (input.vertices + static_cast<size_t>(point_count()))]);
    }

    // One of the two tables of patches is enough: Far's where its stencils are needed.
    void shed() override
    {
        refiner_.reset();
        if (levels_) cpu_patches_.reset();
        else patches_.reset();
    }

    void refresh() override
    {
        float *to = points_.get() + LENGTH * static_cast<size_t>(input.vertices), *from;
        load_positions(input, points_.get());
        if (!levels_) {
            apply(all_of(*stencils_), points_.get(), to);
            return;
        }
        from = points_.get();
        stencil_range range = all_of(*stencils_);
        for (int count : level_counts_) {
            range.count = count;
            apply(range, from, to);
            const int entries = std::accumulate(range.sizes, range.sizes + count, 0);
            range.sizes += count;
            range.indices += entries;
            range.weights += entries;
            from = to;
            to += LENGTH * count;
        }
        const Far::StencilTable *local = patches_->GetLocalPointStencilTable();
        if (local) apply(all_of(*local), points_.get(), to);
    }

    size_t sample(uint32_t n, uint32_t faces) override
    {
        const Far::PatchMap map(*patches_);
        std::vector<float> u, v;
        make_lattice(n, &u, &v);
        coords_.clear();
        for (uint32_t f = 0; f < faces; f++)
            for (size_t i = 0; i < u.size(); i++) {
                const Far::PatchTable::PatchHandle *handle =
                    map.FindPatch(static_cast<int>(f), static_cast<double>(u[i]),
                                  static_cast<double>(v[i]));
                if (!handle) fail("OpenSubdiv has no patch at a sample");
                coords_.push_back(Osd::PatchCoord(*handle, u[i], v[i]));
            }
        return coords_.size();
    }

    void evaluate(float *out) override
    {
        float du[3 * BLOCK], dv[3 * BLOCK];
        const Osd::BufferDescriptor from(0, 3, LENGTH), to(0, 3, 6), tight(0, 3, 3);
        for (size_t at = 0; at < coords_.size(); at += BLOCK, out += 6 * BLOCK) {
            const size_t count = std::min<size_t>(BLOCK, coords_.size() - at);
            Osd::CpuEvaluator::EvalPatches(
                points_.get(), from, out, to, du, tight, dv, tight, static_cast<int>(count),
                &coords_[at], cpu_patches_->GetPatchArrayBuffer(),
                cpu_patches_->GetPatchIndexBuffer(), cpu_patches_->GetPatchParamBuffer());
            for (size_t i = 0; i < count; i++) set_normal(out + 6 * i + 3, du + 3 * i, dv + 3 * i);
        }
    }

    void positions(float *out) override
    {
        const Osd::BufferDescriptor from(0, 3, LENGTH), to(0, 3, 3);
        Osd::CpuEvaluator::EvalPatches(
            points_.get(), from, out, to, static_cast<int>(coords_.size()), coords_.data(),
            cpu_patches_->GetPatchArrayBuffer(), cpu_patches_->GetPatchIndexBuffer(),
            cpu_patches_->GetPatchParamBuffer());
    }

private:
    // Levels: each level's stencils refer to the level before it, and the end caps' points to all
    // levels, as the patch table's own stencils do: a third of the weights. Else one table, which
    // takes every point from the control vertices, the end caps' as well.
    void make_stencils()
    {
        Far::StencilTableFactory::Options options;
        options.factorizeIntermediateLevels = !levels_;
        stencils_.reset(Far::StencilTableFactory::Create(*refiner_, options));
        if (levels_) {
            level_counts_.clear();
            for (int i = 1; i <= refiner_->GetMaxLevel(); i++)
                level_counts_.push_back(refiner_->GetLevel(i).GetNumVertices());
        } else if (patches_->GetLocalPointStencilTable()) {
            stencils_ptr all(Far::StencilTableFactory::AppendLocalPointStencilTable(
                *refiner_, stencils_.get(), patches_->GetLocalPointStencilTable()));
            if (all) stencils_.swap(all);
        }
    }

    int point_count() const
    {
        const Far::StencilTable *local = patches_->GetLocalPointStencilTable();
        return stencils_->GetNumStencils() + (levels_ && local ? local->GetNumStencils() : 0);
    }

    const patch_options::EndCapType cap_;
    const bool levels_;
    refiner_ptr refiner_;
    stencils_ptr stencils_;
    std::vector<int> level_counts_;
    std::unique_ptr<const Far::PatchTable> patches_;
    std::unique_ptr<const Osd::CpuPatchTable> cpu_patches_;
    std::unique_ptr<float[]> points_;    // control vertices, then those of stencils_
    std::vector<Osd::PatchCoord> coords_;
};

// ---- Bfr: a surface per face -------------------------------------------------------------------

class bfr_path : public osd_path {
public:
    bfr_path(const mesh &m, int level) : osd_path(m), desc_(3), level_(level), faces_(0) {}

    void drop() override
    {
        std::vector<surface>().swap(surfaces_);
        std::vector<size_t>().swap(first_);
        points_.reset();
    }

    // Surfaces outlive the factory, its cache, and the refiner.
    void build() override
    {
        const refiner_ptr refiner = make_refiner(input);
        Bfr::SurfaceFactory::Options options;
        options.SetApproxLevelSmooth(level_);
        const Bfr::RefinerSurfaceFactory<> factory(*refiner, options);
        size_t count = 0;
        surfaces_.resize(input.faces);
        first_.resize(input.faces);
        for (uint32_t f = 0; f < input.faces; f++) {
            if (!factory.InitVertexSurface(static_cast<int>(f), &surfaces_[f]))
                fail("OpenSubdiv has no surface on a face");
            first_[f] = count;
            count += 3 * static_cast<size_t>(surfaces_[f].GetNumPatchPoints());
        }
        points_.reset(new float[count]);
    }

    void refresh() override
    {
        for (uint32_t f = 0; f < input.faces; f++)
            surfaces_[f].PreparePatchPoints(input.positions, desc_, &points_[first_[f]], desc_);
    }

    size_t sample(uint32_t n, uint32_t faces) override
    {
        std::vector<float> u, v;
        make_lattice(n, &u, &v);
        uv_.clear();
        for (size_t i = 0; i < u.size(); i++) {
            uv_.push_back(u[i]);
            uv_.push_back(v[i]);
        }
        faces_ = faces;
        return faces * u.size();
    }

    void evaluate(float *out) override
    {
        for (uint32_t f = 0; f < faces_; f++)
            for (size_t i = 0; i < uv_.size(); i += 2, out += 6) {
                float du[3], dv[3];
                surfaces_[f].Evaluate(&uv_[i], &points_[first_[f]], desc_, out, du, dv);
                set_normal(out + 3, du, dv);
            }
    }

    void positions(float *out) override
    {
        for (uint32_t f = 0; f < faces_; f++)
            for (size_t i = 0; i < uv_.size(); i += 2, out += 3)
                surfaces_[f].Evaluate(&uv_[i], &points_[first_[f]], desc_, out);
    }

private:
    typedef Bfr::Surface<float> surface;
    const surface::PointDescriptor desc_;
    const int level_;
    std::vector<surface> surfaces_;
    std::vector<size_t> first_;         // of each surface's points
    std::unique_ptr<float[]> points_;
    std::vector<float> uv_;
    uint32_t faces_;
};

// ---- stencils straight to the samples ----------------------------------------------------------

class limit_path : public osd_path {
public:
    explicit limit_path(const mesh &m) : osd_path(m) {}

    void drop() override
    {
        refiner_.reset();
        stencils_.reset();
    }

    void build() override
    {
        refiner_ = make_refiner(input);
        refiner_->RefineAdaptive(Far::TopologyRefiner::AdaptiveOptions(ISOLATION));
        points_.resize(LENGTH * static_cast<size_t>(input.vertices));
    }

    void refresh() override { load_positions(input, points_.data()); }

    size_t sample(uint32_t n, uint32_t faces) override
    {
        typedef Far::LimitStencilTableFactory factory;
        std::vector<float> u, v;
        make_lattice(n, &u, &v);
        factory::LocationArrayVec locations(faces);
        for (uint32_t f = 0; f < faces; f++) {
            locations[f].ptexIdx = static_cast<int>(f);
            locations[f].numLocations = static_cast<int>(u.size());
            locations[f].s = u.data();
            locations[f].t = v.data();
        }
        stencils_.reset(factory::Create(*refiner_, locations));
        return static_cast<size_t>(stencils_->GetNumStencils());
    }

    // Three passes of four floats are faster than the evaluator's one pass with derivatives.
    void evaluate(float *out) override
    {
        float p[LENGTH * BLOCK], du[LENGTH * BLOCK], dv[LENGTH * BLOCK];
        const float *du_weights = stencils_->GetDuWeights().data();
        const float *dv_weights = stencils_->GetDvWeights().data();
        stencil_range range = all_of(*stencils_);
        for (int left = range.count; left > 0; left -= BLOCK, out += 6 * BLOCK) {
            const float *weights = range.weights;
            range.count = std::min<int>(left, BLOCK);
            apply(range, points_.data(), p);
            range.weights = du_weights;
            apply(range, points_.data(), du);
            range.weights = dv_weights;
            apply(range, points_.data(), dv);
            for (int i = 0; i < range.count; i++) {
                std::copy(p + LENGTH * i, p + LENGTH * i + 3, out + 6 * i);
                set_normal(out + 6 * i + 3, du + LENGTH * i, dv + LENGTH * i);
            }
            const int entries = std::accumulate(range.sizes, range.sizes + range.count, 0);
            range.sizes += range.count;
            range.indices += entries;
            range.weights = weights + entries;
            du_weights += entries;
            dv_weights += entries;
        }
    }

    void positions(float *out) override
    {
        float p[LENGTH * BLOCK];
        stencil_range range = all_of(*stencils_);
        for (int left = range.count; left > 0; left -= BLOCK, out += 3 * BLOCK) {
            range.count = std::min<int>(left, BLOCK);
            apply(range, points_.data(), p);
            for (int i = 0; i < range.count; i++)
                std::copy(p + LENGTH * i, p + LENGTH * i + 3, out + 3 * i);
            const int entries = std::accumulate(range.sizes, range.sizes + range.count, 0);
            range.sizes += range.count;
            range.indices += entries;
            range.weights += entries;
        }
    }

private:
    refiner_ptr refiner_;
    std::unique_ptr<const Far::LimitStencilTable> stencils_;
    std::vector<float> points_;
};

// Points of a uniform refinement: near the surface, not on it; shared between faces.
class uniform_path : public osd_path {
public:
    explicit uniform_path(const mesh &m) : osd_path(m) {}

    void drop() override
    {
        refiner_.reset();
        stencils_.reset();
    }

    void build() override
    {
        Far::StencilTableFactory::Options options;
        options.generateIntermediateLevels = false;
        refiner_ = make_refiner(input);
        refiner_->RefineUniform(Far::TopologyRefiner::UniformOptions(LEVELS));
        stencils_.reset(Far::StencilTableFactory::Create(*refiner_, options));
        points_.resize(LENGTH * static_cast<size_t>(input.vertices));
    }

    void refresh() override { load_positions(input, points_.data()); }

    size_t sample(uint32_t n, uint32_t faces) override
    {
        if (n != (1u << LEVELS) + 1 || faces != input.faces)
            fail("uniform refinement: N = 17 and all faces alone");
        return static_cast<size_t>(stencils_->GetNumStencils());
    }

    void evaluate(float *) override { fail("uniform refinement has no normals"); }

    void positions(float *out) override
    {
        apply(all_of(*stencils_), points_.data(), out);
    }

    uint32_t index_of(uint32_t v) const override
    {
        int index = static_cast<int>(v);
        for (int i = 0; i < LEVELS; i++)
            index = refiner_->GetLevel(i).GetVertexChildVertex(index);
        return static_cast<uint32_t>(index);
    }

private:
    enum { LEVELS = 4 };
    refiner_ptr refiner_;
    stencils_ptr stencils_;
    std::vector<float> points_;
};

}

// ---- for C -------------------------------------------------------------------------------------

const char *osd_version(void) { return "3.5"; }

const char *osd_name(osd_kind kind)
{
    static const char *const names[] = {"B-spline caps", "Gregory caps", "B-spline caps, levels",
                                        "Gregory caps, levels", "Bfr", "limit stencils",
                                        "uniform stencils", "Bfr, level 10"};
    return names[kind];
}

osd_path *osd_open(osd_kind kind, const mesh *m)
{
    const table_path::patch_options::EndCapType bspline =
        table_path::patch_options::ENDCAP_BSPLINE_BASIS;
    const table_path::patch_options::EndCapType gregory =
        table_path::patch_options::ENDCAP_GREGORY_BASIS;
    switch (kind) {
    case OSD_BSPLINE: return new table_path(*m, bspline, false);
    case OSD_GREGORY: return new table_path(*m, gregory, false);
    case OSD_BSPLINE_LEVELS: return new table_path(*m, bspline, true);
    case OSD_GREGORY_LEVELS: return new table_path(*m, gregory, true);
    case OSD_BFR: return new bfr_path(*m, ISOLATION);
    case OSD_LIMIT: return new limit_path(*m);
    case OSD_UNIFORM: return new uniform_path(*m);
    case OSD_EXACT: return new bfr_path(*m, 10);
    }
    return NULL;
}

void osd_close(osd_path *path) { delete path; }
void osd_drop(osd_path *path) { path->drop(); }
void osd_build(osd_path *path) { path->build(); }
void osd_refresh(osd_path *path) { path->refresh(); }
size_t osd_sample(osd_path *path, uint32_t n, uint32_t faces) { return path->sample(n, faces); }
void osd_evaluate(osd_path *path, float *out) { path->evaluate(out); }
void osd_positions(osd_path *path, float *out) { path->positions(out); }
uint32_t osd_uniform_index(const osd_path *path, uint32_t v) { return path->index_of(v); }

osd_memory osd_build_counted(osd_path *path)
{
    osd_memory memory;
    path->drop();
    heap_count_start();
    path->build();
    memory = heap_count();
    path->shed();
    memory.resident = heap_count().resident;
    heap_count_stop();
    path->drop();
    path->build();
    return memory;
}
