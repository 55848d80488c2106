/* A C interface over OpenVDB. Every function is noexcept in effect: errors come back as a code (0 is success) and a text.
   Copies are two-phase: lf_grid_load says how many, the caller allocates, lf_grid_copy fills. */
#pragma once
#include <stdint.h>

#ifdef __cplusplus
extern "C" {
#endif

struct lf_file;
struct lf_writer;

struct lf_error {
    int32_t code; /* 0: none, 1: not an OpenVDB file or damaged, 2: out of memory, 3: anything else */
    char text[500];
};

enum { LF_F32 = 0, LF_F16 = 1, LF_VEC3 = 2 };
enum { LF_NAME = 0, LF_UNIQUE_NAME = 1, LF_TYPE = 2, LF_VALUE_TYPE = 3, LF_CLASS = 4, LF_MAP = 5, LF_SKIPPED = 6 };

struct lf_info {
    uint64_t active_voxels;
    int32_t index_min[3], index_max[3]; /* of active voxels, inclusive; min > max where there are none */
    uint8_t is_frustum;
    uint8_t saved_as_half;
    uint8_t was_level_set;
    uint8_t storage; /* LF_F32 ... */
    double matrix[16]; /* index to world (frustum: frustum to world), column by column, acting on column vectors */
    double frustum[8]; /* index box min (3), max (3), taper, depth */
    float background[3];
    uint64_t leaves, tiles; /* tiles: active ones, and inactive ones that differ from the background */
    uint64_t metadata;
};

struct lf_tile {
    int32_t origin[3];
    int32_t size; /* edge in voxels: 8, 128, 4096 */
    float value[3];
    int32_t active;
};

struct lf_file* lf_open(const char* path, struct lf_error* error);
void lf_close(struct lf_file* file);
uint64_t lf_grid_count(const struct lf_file* file);
/* Copies at most capacity bytes, not terminated; returns the length wanted. */
uint64_t lf_grid_string(const struct lf_file* file, uint64_t grid, int32_t which, char* out, uint64_t capacity);
uint64_t lf_grid_metadata(const struct lf_file* file, uint64_t grid, uint64_t item, int32_t value, char* out, uint64_t capacity);
/* Reads the grid (once) and fills *info. A grid of a kind that is not read leaves leaves = tiles = 0 and says why as LF_SKIPPED. */
void lf_grid_load(struct lf_file* file, uint64_t grid, struct lf_info* info, struct lf_error* error);
/* Fills what lf_grid_load counted, or says that the grid changed. values: leaves * 512 elements of the storage, x slowest. */
void lf_grid_copy(struct lf_file* file, uint64_t grid, int32_t* origins, void* values, struct lf_tile* tiles, struct lf_error* error);
void lf_grid_free(struct lf_file* file, uint64_t grid);

struct lf_writer* lf_writer_new(struct lf_error* error);
void lf_writer_free(struct lf_writer* writer);
/* components: 1 float, 3 vec3. half: stored as half. as_double: a DoubleGrid or Vec3DGrid. level_set: its class. */
void lf_writer_grid(struct lf_writer* writer, const char* name, int32_t components, int32_t half, int32_t as_double,
    int32_t grid_class, const float* background, double voxel_size, const double* translation, const double* frustum,
    struct lf_error* error);
/* Components of the grid begun last; 0 where there is none. */
int32_t lf_writer_components(const struct lf_writer* writer);
/* Leaves of 512 * components floats, x slowest; voxels equal to the background stay inactive. */
void lf_writer_leaves(struct lf_writer* writer, const int32_t* origins, const float* values, uint64_t count, struct lf_error* error);
void lf_writer_tiles(struct lf_writer* writer, const struct lf_tile* tiles, uint64_t count, struct lf_error* error);
/* compression: 0 none, 1 zip, 2 blosc; all also mask inactive voxels. */
void lf_writer_write(struct lf_writer* writer, const char* path, int32_t compression, struct lf_error* error);

#ifdef __cplusplus
}
#endif
