// Trees and rays of TinyBVH (its 8-wide layout for processors with AVX2) for
// `measure -- speed --only rays --tinybvh LIBRARY`.
//   g++ -O3 -march=native -fPIC -shared -I FOLDER_OF_TINY_BVH_H \
//     tinybvh_rays.cpp -o libtinybvh_rays.so
#define TINYBVH_IMPLEMENTATION
#define NO_THREADED_BUILDS
#include "tiny_bvh.h"

#include <cmath>
#include <cstring>
#include <vector>

using namespace tinybvh;

struct Tree {
  std::vector<bvhvec4> corners;
  BVH8_CPU nodes;
};

// The direction keeps its length, so that distances are multiples of it.
static Ray ray_of(const float *origin, const float *direction, float t_max) {
  Ray ray;
  std::memset(&ray, 0, sizeof ray);
  ray.O = bvhvec3(origin[0], origin[1], origin[2]);
  ray.D = bvhvec3(direction[0], direction[1], direction[2]);
  ray.rD = tinybvh_rcp(ray.D);
  ray.mask = RAY_MASK_INTERSECT_ALL;
  ray.hit.t = t_max;
  return ray;
}

extern "C" {

// The parts of the version number, each in eight bits.
uint32_t tinybvh_version() {
  return TINY_BVH_VERSION_MAJOR << 16 | TINY_BVH_VERSION_MINOR << 8 | TINY_BVH_VERSION_SUB;
}

float tinybvh_far() { return BVH_FAR; }

// A tree over triangles of nine coordinates each, which is not built yet.
Tree *tinybvh_new(const float *coordinates, uint32_t triangles) {
  Tree *tree = new Tree;
  tree->corners.reserve(3 * size_t(triangles));
  for (size_t i = 0; i < 3 * size_t(triangles); i++, coordinates += 3)
    tree->corners.emplace_back(coordinates[0], coordinates[1], coordinates[2], 0.0f);
  return tree;
}

void tinybvh_free(Tree *tree) { delete tree; }

// Builds the tree; with `split`, its boxes may split triangles.
void tinybvh_build(Tree *tree, bool split) {
  const uint32_t triangles = uint32_t(tree->corners.size() / 3);
  if (split)
    tree->nodes.BuildHQ(tree->corners.data(), triangles);
  else
    tree->nodes.Build(tree->corners.data(), triangles);
}

// The distance of the nearest hit, or `t_max`.
float tinybvh_nearest(const Tree *tree, const float *origin, const float *direction, float t_max) {
  Ray ray = ray_of(origin, direction, t_max);
  tree->nodes.Intersect(ray);
  return ray.hit.t;
}

bool tinybvh_is_blocked(const Tree *tree, const float *origin, const float *direction, float t_max) {
  return tree->nodes.IsOccluded(ray_of(origin, direction, t_max));
}
}
