// The shim of shim.h. Nothing may leave it but return values: every entry catches everything.
#include "shim.h"

#include <openvdb/io/GridDescriptor.h>
#include <openvdb/openvdb.h>
#include <openvdb/tools/LevelSetUtil.h>

#include <algorithm>
#include <cstring>
#include <fstream>
#include <string>
#include <vector>

namespace {

void fail(lf_error* error, int32_t code, const char* text) noexcept {
    error->code = code;
    std::strncpy(error->text, text, sizeof error->text - 1);
    error->text[sizeof error->text - 1] = 0;
}

template <typename F>
void guard(lf_error* error, F&& f) noexcept {
    error->code = 0;
    error->text[0] = 0;
    try {
        f();
    } catch (const std::bad_alloc&) {
        fail(error, 2, "out of memory");
    } catch (const openvdb::Exception& e) {
        fail(error, 1, e.what());
    } catch (const std::exception& e) {
        fail(error, 3, e.what());
    } catch (...) {
        fail(error, 3, "unknown exception");
    }
}

struct Entry {
    std::string unique, name, type, value_type, grid_class, map, skipped;
    std::vector<std::pair<std::string, std::string>> metadata;
    openvdb::GridBase::Ptr grid;
    // What lf_grid_load told the caller to make room for; lf_grid_copy fills just that.
    uint8_t storage = LF_F32;
    uint64_t leaves = 0, tiles = 0;
};

// Reads a file's table of grids only, to see whether the file is as long as the table says: OpenVDB does not check the
// length of what it reads uncompressed.
struct Table : openvdb::io::Archive {
    // Grids with the table; sets streamed where the file has no offsets to check.
    size_t check(std::istream& in, uint64_t length, bool& streamed) {
        readHeader(in);
        if (!in) OPENVDB_THROW(openvdb::IoError, "the file's header is incomplete");
        // How descriptors are laid out depends on the version.
        setFormatVersion(in);
        setLibraryVersion(in);
        streamed = !inputHasGridOffsets();
        openvdb::MetaMap meta;
        meta.readMeta(in);
        const int32_t count = readGridCount(in);
        if (!in || count < 0) OPENVDB_THROW(openvdb::IoError, "the file ends before its table of grids");
        if (streamed) return size_t(count);
        for (int32_t i = 0; i < count; ++i) {
            openvdb::io::GridDescriptor descriptor;
            descriptor.read(in);
            if (!in) OPENVDB_THROW(openvdb::IoError, "the file ends inside its table of grids");
            const int64_t begin = descriptor.getGridPos(), end = descriptor.getEndPos();
            if (end < begin || begin < 0 || uint64_t(end) > length)
                OPENVDB_THROW(openvdb::IoError, "the file is shorter than grid \""
                    << openvdb::io::GridDescriptor::nameAsString(descriptor.uniqueName()) << "\" says");
            descriptor.seekToEnd(in);
        }
        return size_t(count);
    }
};

// Calls f with the grid as its own type if it is one that is read.
template <typename F>
bool with_grid(openvdb::GridBase::Ptr grid, F&& f) {
    if (auto g = openvdb::gridPtrCast<openvdb::FloatGrid>(grid)) f(*g);
    else if (auto g = openvdb::gridPtrCast<openvdb::DoubleGrid>(grid)) f(*g);
    else if (auto g = openvdb::gridPtrCast<openvdb::Vec3SGrid>(grid)) f(*g);
    else if (auto g = openvdb::gridPtrCast<openvdb::Vec3DGrid>(grid)) f(*g);
    else return false;
    return true;
}

bool is_read(const std::string& type) {
    return type == openvdb::FloatGrid::gridType() || type == openvdb::DoubleGrid::gridType()
        || type == openvdb::Vec3SGrid::gridType() || type == openvdb::Vec3DGrid::gridType();
}

template <typename T>
void to_floats(const T& value, float out[3]) { out[0] = float(value); out[1] = out[2] = 0; }
template <typename T>
void to_floats(const openvdb::math::Vec3<T>& value, float out[3]) {
    for (int i = 0; i < 3; ++i) out[i] = float(value[i]);
}

template <typename GridT>
constexpr bool is_vec3 = openvdb::VecTraits<typename GridT::ValueType>::IsVec;

// Active tiles, and inactive ones that do not hold the background.
template <typename GridT, typename F>
void each_tile(const GridT& grid, F&& f) {
    auto it = grid.tree().cbeginValueAll();
    it.setMaxDepth(GridT::TreeType::ValueAllCIter::LEAF_DEPTH - 1);
    const auto background = grid.background();
    for (; it; ++it) {
        const auto value = it.getValue();
        if (!it.isValueOn() && value == background) continue;
        openvdb::CoordBBox box;
        it.getBoundingBox(box);
        f(box, value, it.isValueOn());
    }
}

uint64_t copy_string(const std::string& text, char* out, uint64_t capacity) {
    if (out) std::memcpy(out, text.data(), std::min<uint64_t>(capacity, text.size()));
    return text.size();
}

void matrix_columns(const openvdb::Mat4d& m, double out[16]) {
    // OpenVDB's matrices act on row vectors: their rows are our columns.
    for (int row = 0; row < 4; ++row)
        for (int column = 0; column < 4; ++column) out[row * 4 + column] = m(row, column);
}

} // namespace

struct lf_file {
    std::unique_ptr<openvdb::io::File> file;
    std::vector<Entry> entries;
};

struct lf_writer {
    openvdb::GridPtrVec grids;
};

static std::string class_name(const openvdb::GridBase& grid) {
    return openvdb::GridBase::gridClassToString(grid.getGridClass());
}

static void describe(Entry& entry, const openvdb::GridBase& grid) {
    entry.type = grid.type();
    entry.value_type = grid.valueType();
    entry.grid_class = class_name(grid);
    entry.map = grid.transform().mapType();
    for (auto it = grid.beginMeta(); it != grid.endMeta(); ++it)
        if (it->second) entry.metadata.emplace_back(it->first, it->second->str());
    if (!is_read(entry.type)) entry.skipped = "grids of type " + entry.type + " are not volumes of floats or vectors";
}

extern "C" {

lf_file* lf_open(const char* path, lf_error* error) {
    lf_file* result = nullptr;
    guard(error, [&] {
        openvdb::initialize();
        auto file = std::make_unique<lf_file>();
        std::ifstream in(path, std::ios::binary | std::ios::ate);
        if (!in) OPENVDB_THROW(openvdb::IoError, "the file cannot be opened");
        const uint64_t length = uint64_t(in.tellg());
        in.seekg(0);
        bool streamed = false;
        const size_t count = Table().check(in, length, streamed);
        if (count == 0) OPENVDB_THROW(openvdb::IoError, "the file holds no grids");
        in.close();
        file->file = std::make_unique<openvdb::io::File>(path);
        file->file->open(/*delayLoad=*/false);
        for (auto it = file->file->beginName(); it != file->file->endName(); ++it) {
            Entry entry;
            entry.unique = *it;
            auto grid = file->file->readGridMetadata(entry.unique);
            if (!grid) OPENVDB_THROW(openvdb::IoError, "grid \"" << entry.unique << "\" has no description");
            entry.name = grid->getName();
            describe(entry, *grid);
            file->entries.push_back(std::move(entry));
        }
        if (file->entries.size() != count) OPENVDB_THROW(openvdb::IoError, "the table of grids is inconsistent");
        result = file.release();
    });
    return result;
}

void lf_close(lf_file* file) {
    lf_error ignored;
    guard(&ignored, [&] { delete file; });
}

uint64_t lf_grid_count(const lf_file* file) { return file->entries.size(); }

uint64_t lf_grid_string(const lf_file* file, uint64_t grid, int32_t which, char* out, uint64_t capacity) {
    const Entry& e = file->entries[grid];
    const std::string* texts[] = {&e.name, &e.unique, &e.type, &e.value_type, &e.grid_class, &e.map, &e.skipped};
    return copy_string(*texts[which], out, capacity);
}

uint64_t lf_grid_metadata(const lf_file* file, uint64_t grid, uint64_t item, int32_t value, char* out, uint64_t capacity) {
    const auto& pair = file->entries[grid].metadata[item];
    return copy_string(value ? pair.second : pair.first, out, capacity);
}

void lf_grid_load(lf_file* file, uint64_t index, lf_info* info, lf_error* error) {
    *info = lf_info{};
    guard(error, [&] {
        Entry& entry = file->entries[index];
        info->metadata = entry.metadata.size();
        for (int i = 0; i < 3; ++i) info->index_min[i] = INT32_MAX, info->index_max[i] = INT32_MIN;
        openvdb::GridBase::Ptr grid = entry.skipped.empty() ? file->file->readGrid(entry.unique)
                                                            : file->file->readGridMetadata(entry.unique);
        if (!grid) OPENVDB_THROW(openvdb::IoError, "grid \"" << entry.unique << "\" cannot be read");
        const auto& transform = grid->transform();
        if (auto frustum = transform.map<openvdb::math::NonlinearFrustumMap>()) {
            info->is_frustum = 1;
            matrix_columns(frustum->secondMap().getMat4(), info->matrix);
            const auto& box = frustum->getBBox();
            for (int i = 0; i < 3; ++i) info->frustum[i] = box.min()[i], info->frustum[3 + i] = box.max()[i];
            info->frustum[6] = frustum->getTaper();
            info->frustum[7] = frustum->getDepth();
        } else {
            matrix_columns(transform.baseMap()->getAffineMap()->getMat4(), info->matrix);
        }
        info->saved_as_half = grid->saveFloatAsHalf();
        if (!entry.skipped.empty()) {
            if (auto count = grid->getMetadata<openvdb::Int64Metadata>("file_voxel_count"))
                info->active_voxels = uint64_t(count->value());
            return;
        }
        info->was_level_set = grid->getGridClass() == openvdb::GRID_LEVEL_SET;
        if (info->was_level_set) {
            if (auto g = openvdb::gridPtrCast<openvdb::FloatGrid>(grid)) openvdb::tools::sdfToFogVolume(*g);
            else if (auto g = openvdb::gridPtrCast<openvdb::DoubleGrid>(grid)) openvdb::tools::sdfToFogVolume(*g);
            else info->was_level_set = 0;
        }
        info->active_voxels = grid->activeVoxelCount();
        const openvdb::CoordBBox box = grid->evalActiveVoxelBoundingBox();
        for (int i = 0; i < 3; ++i) info->index_min[i] = box.min()[i], info->index_max[i] = box.max()[i];
        with_grid(grid, [&](auto& g) {
            using GridT = std::decay_t<decltype(g)>;
            if constexpr (is_vec3<GridT>) info->storage = LF_VEC3;
            else info->storage = info->saved_as_half && !info->was_level_set ? LF_F16 : LF_F32;
            to_floats(g.background(), info->background);
            info->leaves = g.tree().leafCount();
            each_tile(g, [&](const openvdb::CoordBBox&, const auto&, bool) { ++info->tiles; });
        });
        entry.storage = info->storage;
        entry.leaves = info->leaves;
        entry.tiles = info->tiles;
        entry.grid = grid;
    });
}

void lf_grid_copy(lf_file* file, uint64_t index, int32_t* origins, void* values, lf_tile* tiles, lf_error* error) {
    guard(error, [&] {
        const Entry& entry = file->entries[index];
        if (!entry.grid) OPENVDB_THROW(openvdb::RuntimeError, "the grid is not loaded");
        const auto changed = [] { OPENVDB_THROW(openvdb::RuntimeError, "the grid is not the one that was counted"); };
        with_grid(entry.grid, [&](auto& g) {
            using GridT = std::decay_t<decltype(g)>;
            if (is_vec3<GridT> != (entry.storage == LF_VEC3)) changed();
            float* floats = static_cast<float*>(values);
            uint16_t* halves = static_cast<uint16_t*>(values);
            uint64_t leaves = 0, tiles_left = entry.tiles;
            for (auto leaf = g.tree().cbeginLeaf(); leaf; ++leaf, ++leaves) {
                if (leaves == entry.leaves) changed();
                const auto origin = leaf->origin();
                for (int i = 0; i < 3; ++i) *origins++ = origin[i];
                const auto* data = leaf->buffer().data();
                if constexpr (is_vec3<GridT>) {
                    for (int i = 0; i < 512; ++i, floats += 3) to_floats(data[i], floats);
                } else if (entry.storage == LF_F16) {
                    for (int i = 0; i < 512; ++i) *halves++ = openvdb::math::half(float(data[i])).bits();
                } else {
                    for (int i = 0; i < 512; ++i) *floats++ = float(data[i]);
                }
            }
            each_tile(g, [&](const openvdb::CoordBBox& box, const auto& value, bool active) {
                if (tiles_left-- == 0) changed();
                for (int i = 0; i < 3; ++i) tiles->origin[i] = box.min()[i];
                tiles->size = int32_t(box.max()[0] - box.min()[0] + 1);
                to_floats(value, tiles->value);
                tiles->active = active;
                ++tiles;
            });
            if (leaves != entry.leaves || tiles_left != 0) changed();
        });
    });
}

void lf_grid_free(lf_file* file, uint64_t grid) {
    lf_error ignored;
    guard(&ignored, [&] { file->entries[grid].grid.reset(); });
}

lf_writer* lf_writer_new(lf_error* error) {
    lf_writer* result = nullptr;
    guard(error, [&] {
        openvdb::initialize();
        result = new lf_writer;
    });
    return result;
}

void lf_writer_free(lf_writer* writer) {
    lf_error ignored;
    guard(&ignored, [&] { delete writer; });
}

void lf_writer_grid(lf_writer* writer, const char* name, int32_t components, int32_t half, int32_t as_double,
    int32_t grid_class, const float* background, double voxel_size, const double* translation, const double* frustum,
    lf_error* error) {
    guard(error, [&] {
        openvdb::GridBase::Ptr grid;
        const openvdb::Vec3f vec(background[0], background[1], background[2]);
        if (components == 3 && as_double) grid = openvdb::Vec3DGrid::create(openvdb::Vec3d(vec));
        else if (components == 3) grid = openvdb::Vec3SGrid::create(vec);
        else if (as_double) grid = openvdb::DoubleGrid::create(background[0]);
        else grid = openvdb::FloatGrid::create(background[0]);
        grid->setName(name);
        grid->setSaveFloatAsHalf(half != 0);
        if (grid_class == 1) grid->setGridClass(openvdb::GRID_FOG_VOLUME);
        if (grid_class == 2) grid->setGridClass(openvdb::GRID_LEVEL_SET);
        openvdb::Mat4d m = openvdb::Mat4d::identity();
        for (int i = 0; i < 3; ++i) m(i, i) = voxel_size, m(3, i) = translation[i];
        if (frustum) {
            const openvdb::BBoxd box(openvdb::Vec3d(frustum[0], frustum[1], frustum[2]), openvdb::Vec3d(frustum[3], frustum[4], frustum[5]));
            openvdb::math::MapBase::Ptr second(new openvdb::math::AffineMap(m));
            openvdb::math::MapBase::Ptr map(new openvdb::math::NonlinearFrustumMap(box, frustum[6], frustum[7], second));
            grid->setTransform(openvdb::math::Transform::Ptr(new openvdb::math::Transform(map)));
        } else {
            grid->setTransform(openvdb::math::Transform::createLinearTransform(m));
        }
        writer->grids.push_back(grid);
    });
}

} // extern "C"

template <typename T>
static T from_floats(const float* v, T*) { return T(v[0]); }
template <typename T>
static openvdb::math::Vec3<T> from_floats(const float* v, openvdb::math::Vec3<T>*) { return {T(v[0]), T(v[1]), T(v[2])}; }

extern "C" {

int32_t lf_writer_components(const lf_writer* writer) {
    int32_t components = 0;
    lf_error ignored;
    guard(&ignored, [&] {
        if (!writer->grids.empty())
            with_grid(writer->grids.back(), [&](auto& g) { components = is_vec3<std::decay_t<decltype(g)>> ? 3 : 1; });
    });
    return components;
}

void lf_writer_leaves(lf_writer* writer, const int32_t* origins, const float* values, uint64_t count, lf_error* error) {
    guard(error, [&] {
        if (writer->grids.empty()) OPENVDB_THROW(openvdb::RuntimeError, "no grid was begun");
        with_grid(writer->grids.back(), [&](auto& g) {
            using GridT = std::decay_t<decltype(g)>;
            using Value = typename GridT::ValueType;
            const int components = is_vec3<GridT> ? 3 : 1;
            const Value background = g.background();
            for (uint64_t n = 0; n < count; ++n) {
                const openvdb::Coord origin(origins[3 * n], origins[3 * n + 1], origins[3 * n + 2]);
                auto* leaf = g.tree().touchLeaf(origin);
                for (int i = 0; i < 512; ++i) {
                    const Value value = from_floats(values + (512 * n + i) * components, static_cast<Value*>(nullptr));
                    if (value == background) leaf->setValueOff(i, value);
                    else leaf->setValueOn(i, value);
                }
            }
        });
    });
}

void lf_writer_tiles(lf_writer* writer, const lf_tile* tiles, uint64_t count, lf_error* error) {
    guard(error, [&] {
        if (writer->grids.empty()) OPENVDB_THROW(openvdb::RuntimeError, "no grid was begun");
        with_grid(writer->grids.back(), [&](auto& g) {
            using Value = typename std::decay_t<decltype(g)>::ValueType;
            for (uint64_t n = 0; n < count; ++n) {
                const lf_tile& t = tiles[n];
                const int level = t.size == 8 ? 1 : t.size == 128 ? 2 : 3;
                g.tree().addTile(level, openvdb::Coord(t.origin[0], t.origin[1], t.origin[2]),
                    from_floats(t.value, static_cast<Value*>(nullptr)), t.active != 0);
            }
        });
    });
}

void lf_writer_write(lf_writer* writer, const char* path, int32_t compression, lf_error* error) {
    guard(error, [&] {
        openvdb::io::File file(path);
        const uint32_t mask = openvdb::io::COMPRESS_ACTIVE_MASK;
        file.setCompression(compression == 2 ? mask | openvdb::io::COMPRESS_BLOSC : compression == 1 ? mask | openvdb::io::COMPRESS_ZIP : mask);
        file.write(writer->grids);
        file.close();
    });
}

} // extern "C"
