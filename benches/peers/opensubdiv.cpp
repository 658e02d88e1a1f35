// OpenSubdiv on one thread: set-up, update and limit evaluation of one cage, as JSON on standard output.
//
//   opensubdiv CAGE DEPTH PLACES RUNS POSITIONS
//
// CAGE is what benches/peer.rs writes, little-endian: u32 vertices, faces, creases; f32 x, y, z a vertex; u32 four
// corners a face; u32 two ends a crease; f32 sharpness a crease. PLACES x PLACES places lie in the middles of a face's
// squares. POSITIONS gets the limit positions of the last run, f32, for comparison.
//
// Seconds are lists, one a run; giving back what the run before made is not timed.

#include <malloc.h>
#include <time.h>

#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <fstream>
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include <opensubdiv/far/patchMap.h>
#include <opensubdiv/far/patchTableFactory.h>
#include <opensubdiv/far/primvarRefiner.h>
#include <opensubdiv/far/stencilTableFactory.h>
#include <opensubdiv/far/topologyDescriptor.h>
#include <opensubdiv/osd/cpuEvaluator.h>
#include <opensubdiv/osd/cpuPatchTable.h>

using namespace OpenSubdiv;

// Bytes alive of all that was allocated.
static long long bytes_alive() {
    struct mallinfo2 const info = mallinfo2();
    return static_cast<long long>(info.uordblks + info.hblkhd);
}

struct Vertex {
    float at[3];
    void Clear(void* = nullptr) { at[0] = at[1] = at[2] = 0; }
    void AddWithWeight(Vertex const& other, float weight) {
        for (int axis = 0; axis < 3; ++axis) at[axis] += weight * other.at[axis];
    }
};

struct Cage {
    std::vector<Vertex> vertices;
    std::vector<int> sizes, corners, crease_ends;
    std::vector<float> crease_weights;
};

template <typename T>
static void read(std::ifstream& file, std::vector<T>& list, std::size_t count) {
    list.resize(count);
    file.read(reinterpret_cast<char*>(list.data()), static_cast<std::streamsize>(count * sizeof(T)));
}

static Cage read_cage(char const* name) {
    std::ifstream file(name, std::ios::binary);
    std::vector<std::uint32_t> counts;
    Cage cage;
    read(file, counts, 3);
    read(file, cage.vertices, counts[0]);
    read(file, cage.corners, 4 * std::size_t(counts[1]));
    read(file, cage.crease_ends, 2 * std::size_t(counts[2]));
    read(file, cage.crease_weights, counts[2]);
    if (!file) {
        std::fprintf(stderr, "%s: no whole cage\n", name);
        std::exit(3);
    }
    cage.sizes.assign(counts[1], 4);
    return cage;
}

// Seconds of this thread's processor: what else the machine does meanwhile does not count.
static double thread_seconds() {
    timespec now{};
    clock_gettime(CLOCK_THREAD_CPUTIME_ID, &now);
    return static_cast<double>(now.tv_sec) + 1e-9 * static_cast<double>(now.tv_nsec);
}

// Runs work and prints its seconds, one a run; before each, untimed, what `prepare` does.
static void time(char const* name, int runs, std::function<void()> const& prepare, std::function<void()> const& work) {
    std::printf("  \"%s\": [", name);
    for (int run = 0; run < runs; ++run) {
        prepare();
        double const start = thread_seconds();
        work();
        std::printf("%s%.9f", run ? ", " : "", thread_seconds() - start);
    }
    std::printf("],\n");
    std::fflush(stdout);
}

static void time(char const* name, int runs, std::function<void()> const& work) {
    time(name, runs, [] {}, work);
}

static void count(char const* name, long long value) { std::printf("  \"%s\": %lld,\n", name, value); }

using Refiner = std::unique_ptr<Far::TopologyRefiner>;

static Refiner make_refiner(Cage const& cage) {
    using Factory = Far::TopologyRefinerFactory<Far::TopologyDescriptor>;
    Far::TopologyDescriptor descriptor;
    descriptor.numVertices = static_cast<int>(cage.vertices.size());
    descriptor.numFaces = static_cast<int>(cage.sizes.size());
    descriptor.numVertsPerFace = cage.sizes.data();
    descriptor.vertIndicesPerFace = cage.corners.data();
    descriptor.numCreases = static_cast<int>(cage.crease_weights.size());
    descriptor.creaseVertexIndexPairs = cage.crease_ends.data();
    descriptor.creaseWeights = cage.crease_weights.data();
    Sdc::Options options;
    options.SetVtxBoundaryInterpolation(Sdc::Options::VTX_BOUNDARY_EDGE_AND_CORNER);
    return Refiner(Factory::Create(descriptor, Factory::Options(Sdc::SCHEME_CATMARK, options)));
}

static void interpolate(Far::TopologyRefiner const& refiner, std::vector<Vertex>& points) {
    Far::PrimvarRefiner primvars(refiner);
    Vertex* from = points.data();
    for (int level = 1; level <= refiner.GetMaxLevel(); ++level) {
        Vertex* to = from + refiner.GetLevel(level - 1).GetNumVertices();
        primvars.Interpolate(level, from, to);
        from = to;
    }
}

int main(int argc, char** argv) {
    if (argc != 6) {
        std::fprintf(stderr, "usage: opensubdiv CAGE DEPTH PLACES RUNS POSITIONS\n");
        return 2;
    }
    Cage const cage = read_cage(argv[1]);
    int const depth = std::atoi(argv[2]), places = std::atoi(argv[3]), runs = std::atoi(argv[4]);
    std::printf("{\n");

    // Set-up, step by step.
    Far::PatchTableFactory::Options patch_options(static_cast<unsigned>(depth));
    patch_options.useInfSharpPatch = true;
    patch_options.generateVaryingTables = false;
    Refiner refiner;
    long long before = bytes_alive();
    time("refiner", runs, [&] { refiner.reset(); }, [&] { refiner = make_refiner(cage); });
    time("adaptive", runs, [&] { refiner->Unrefine(); },
         [&] { refiner->RefineAdaptive(patch_options.GetRefineAdaptiveOptions()); });
    count("refiner_bytes", bytes_alive() - before);

    std::unique_ptr<Far::PatchTable const> patches;
    before = bytes_alive();
    time("patch_table", runs, [&] { patches.reset(); },
         [&] { patches.reset(Far::PatchTableFactory::Create(*refiner, patch_options)); });
    count("patch_table_bytes", bytes_alive() - before);

    std::unique_ptr<Far::StencilTable const> stencils;
    before = bytes_alive();
    time("stencil_table", runs, [&] { stencils.reset(); },
         [&] { stencils.reset(Far::StencilTableFactory::Create(*refiner)); });
    count("stencil_table_bytes", bytes_alive() - before);

    // Update: all refined points from the cage's, without the end caps' own points.
    int const cage_points = static_cast<int>(cage.vertices.size());
    int const refined_points = refiner->GetNumVerticesTotal() - cage_points;
    std::vector<Vertex> points(static_cast<std::size_t>(cage_points + refined_points + patches->GetNumLocalPoints()));
    std::copy(cage.vertices.begin(), cage.vertices.end(), points.begin());
    float* const floats = points[0].at;
    Osd::BufferDescriptor const from(0, 3, 3), to(3 * cage_points, 3, 3);
    time("update_primvar", runs + 1, [&] { interpolate(*refiner, points); });
    time("update_stencils", runs + 1, [&] {
        Osd::CpuEvaluator::EvalStencils(floats, from, floats, to, stencils->GetSizes().data(),
                                        stencils->GetOffsets().data(), stencils->GetControlIndices().data(),
                                        stencils->GetWeights().data(), 0, stencils->GetNumStencils());
    });
    patches->ComputeLocalPointValues(points.data(), points.data() + cage_points + refined_points);

    // Limit evaluation at the same places of every face, found beforehand.
    std::vector<Osd::PatchCoord> coords;
    time("find", 1, [&] {
        Far::PatchMap map(*patches);
        coords.reserve(cage.sizes.size() * static_cast<std::size_t>(places * places));
        for (int face = 0; face < static_cast<int>(cage.sizes.size()); ++face) {
            for (int place = 0; place < places * places; ++place) {
                float const u = (static_cast<float>(place % places) + 0.5f) / static_cast<float>(places);
                float const v = (static_cast<float>(place / places) + 0.5f) / static_cast<float>(places);
                Far::PatchMap::Handle const* handle = map.FindPatch(face, u, v);
                if (handle) coords.emplace_back(*handle, u, v);
            }
        }
    });
    Osd::CpuPatchTable const table(patches.get());
    Osd::BufferDescriptor const tight(0, 3, 3);
    int const coord_count = static_cast<int>(coords.size());
    std::vector<float> limit(3 * coords.size()), du(limit.size()), dv(limit.size());
    time("derivatives", runs + 1, [&] {
        Osd::CpuEvaluator::EvalPatches(floats, tight, limit.data(), tight, du.data(), tight, dv.data(), tight,
                                       coord_count, coords.data(), table.GetPatchArrayBuffer(),
                                       table.GetPatchIndexBuffer(), table.GetPatchParamBuffer());
    });
    time("positions", runs + 1, [&] {
        Osd::CpuEvaluator::EvalPatches(floats, tight, limit.data(), tight, coord_count, coords.data(),
                                       table.GetPatchArrayBuffer(), table.GetPatchIndexBuffer(),
                                       table.GetPatchParamBuffer());
    });
    std::ofstream(argv[5], std::ios::binary)
        .write(reinterpret_cast<char const*>(limit.data()), static_cast<std::streamsize>(4 * limit.size()));

    count("refined_points", refined_points);
    count("patches", patches->GetNumPatchesTotal());
    std::printf("  \"places\": %d\n}\n", coord_count);
    return 0;
}
