// Shape checks and the interleaving of rays.
#include "cache_model.hpp"

#include <algorithm>
#include <stdexcept>

namespace retrace::accel {

CacheModel::CacheModel(CacheShape shape) : ways_(shape.ways) {
  const std::uint32_t sets = shape.ways == 0 ? 0 : shape.bytes / 64 / shape.ways;
  if (sets == 0 || (sets & (sets - 1)) != 0 || sets * shape.ways * 64 != shape.bytes)
    throw std::invalid_argument("cache: bytes must be ways * 64 * a power of two");
  set_mask_ = sets - 1;
  tags_.assign(std::size_t{sets} * ways_, 0xffffffffu);
}

void replay(const AccessLog& log, std::size_t contexts, std::vector<CacheModel>& caches) {
  struct Context {
    std::size_t ray, at;
  };
  std::vector<Context> flying;
  std::size_t next = 0;
  while (next < log.rays() && flying.size() < contexts) flying.push_back({next++, 0});
  while (!flying.empty()) {
    for (std::size_t c = 0; c < flying.size();) {
      const auto lines = log.ray(flying[c].ray);
      if (flying[c].at < lines.size()) {
        for (CacheModel& cache : caches) cache.access(lines[flying[c].at]);
        ++flying[c].at;
        ++c;
      } else if (next < log.rays()) {
        flying[c] = {next++, 0};
      } else {
        flying.erase(flying.begin() + static_cast<std::ptrdiff_t>(c));
      }
    }
  }
}

}  // namespace retrace::accel
