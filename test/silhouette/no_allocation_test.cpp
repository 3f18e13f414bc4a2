// The hot loop must not allocate once it has seen its batch size: every allocation of this program
// is counted.

#include <gtest/gtest.h>

#include <atomic>
#include <cstdlib>
#include <new>

#include "bodyschema/silhouette/contour_points.hpp"
#include "silhouette/synthetic_hand.hpp"

#if !defined(__SANITIZE_ADDRESS__) && !defined(__SANITIZE_THREAD__)

namespace {
std::atomic<std::size_t> allocations{0};

void* counted(std::size_t size, std::size_t alignment) {
  allocations.fetch_add(1, std::memory_order_relaxed);
  void* p = std::aligned_alloc(alignment, (size + alignment - 1) / alignment * alignment);
  if (p == nullptr) throw std::bad_alloc();
  return p;
}
}  // namespace

void* operator new(std::size_t size) {
  return counted(size, alignof(std::max_align_t));
}
void* operator new[](std::size_t size) {
  return counted(size, alignof(std::max_align_t));
}
void* operator new(std::size_t size, std::align_val_t alignment) {
  return counted(size, static_cast<std::size_t>(alignment));
}
void* operator new[](std::size_t size, std::align_val_t alignment) {
  return counted(size, static_cast<std::size_t>(alignment));
}
void operator delete(void* p) noexcept {
  std::free(p);
}
void operator delete[](void* p) noexcept {
  std::free(p);
}
void operator delete(void* p, std::size_t) noexcept {
  std::free(p);
}
void operator delete[](void* p, std::size_t) noexcept {
  std::free(p);
}
void operator delete(void* p, std::align_val_t) noexcept {
  std::free(p);
}
void operator delete[](void* p, std::align_val_t) noexcept {
  std::free(p);
}
void operator delete(void* p, std::size_t, std::align_val_t) noexcept {
  std::free(p);
}
void operator delete[](void* p, std::size_t, std::align_val_t) noexcept {
  std::free(p);
}

namespace bodyschema {
namespace {

TEST(NoAllocation, CounterCounts) {
  const std::size_t before = allocations;
  const auto p = std::make_unique<int>(3);
  EXPECT_EQ(*p, 3);
  EXPECT_EQ(allocations - before, 1u);
}

TEST(NoAllocation, ContourScoresWithout) {
  const auto model = synthetic::hand(2000);
  const std::vector cameras{synthetic::camera(320, 240), synthetic::camera(320, 240)};
  const auto scorer = make_silhouette_scorer(model, cameras, {"contour", "auto", 3});
  std::vector<ObservedSilhouette> observed(2);
  for (auto& o : observed) {
    o.mask = o.valid = BinaryMask(320, 240);
    o.valid.fill(true);
  }
  std::vector<SilhouetteCounts> counts(200);
  scorer->set_observation(observed);
  scorer->score(synthetic::stereo_particles(100, 2, 1), counts);
  const auto X_CB = synthetic::stereo_particles(100, 2, 2);
  const std::size_t before = allocations;
  scorer->set_observation(observed);
  scorer->score(X_CB, counts);
  EXPECT_EQ(allocations - before, 0u);
  EXPECT_GT(counts[0].predicted, 0u);
}

TEST(NoAllocation, ExtractorFindsOutlinesWithout) {
  const auto model = synthetic::hand(2000);
  const std::vector cameras{synthetic::camera(320, 240)};
  ContourExtractor extractor(model, cameras);
  const auto X_CB = synthetic::stereo_particles(1, 1, 1);
  ASSERT_GT(extractor.extract(X_CB, 0).size(), 50u);
  const std::size_t before = allocations;
  EXPECT_GT(extractor.extract(X_CB, 0).size(), 50u);
  EXPECT_EQ(allocations - before, 0u);
}

}  // namespace
}  // namespace bodyschema

#endif
