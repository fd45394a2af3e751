// The registry of engines, see registry.hpp.
#include "registry.hpp"

#include <algorithm>
#include <stdexcept>

namespace retrace {
namespace {

struct Registry {
  std::vector<EngineKind> kinds;
  std::vector<std::pair<std::string, std::string>> absent;  // name, remedy
};

Registry& registry() {
  static Registry all;
  return all;
}

std::string name_of(const std::string& specification) { return specification.substr(0, specification.find(':')); }
std::string argument_of(const std::string& specification) {
  const std::size_t colon = specification.find(':');
  return colon == std::string::npos ? std::string() : specification.substr(colon + 1);
}

}  // namespace

void register_engine(EngineKind kind) {
  std::vector<EngineKind>& kinds = registry().kinds;
  if (std::any_of(kinds.begin(), kinds.end(), [&](const EngineKind& other) { return other.name == kind.name; }))
    throw std::logic_error("two engines are registered as '" + kind.name + "'");
  kinds.push_back(std::move(kind));
}

void register_absent_engine(const std::string& name, const std::string& remedy) {
  registry().absent.emplace_back(name, remedy);
}

std::span<const EngineKind> engine_kinds() { return registry().kinds; }

const EngineKind& find_engine(const std::string& specification) {
  const std::string name = name_of(specification);
  std::string known;
  for (const EngineKind& kind : engine_kinds()) {
    if (kind.name == name) {
      if (specification.size() > name.size() && !kind.takes_argument) {
        throw UsageError("engine " + name + " takes no argument: '" + specification + "'");
      }
      return kind;
    }
    known += (known.empty() ? "" : ", ") + kind.name;
  }
  for (const auto& [absent, remedy] : registry().absent)
    if (absent == name) throw UsageError("this program was built without engine " + name + ": " + remedy);
  throw UsageError("there is no engine '" + name + "'; there are: " + known);
}

void check_instances(const std::string& specification) {
  const EngineKind& kind = find_engine(specification);
  if (!kind.instances) throw UsageError("engine " + kind.name + " traces one level only: --two-level off");
}

std::unique_ptr<Engine> make_engine(const std::string& specification, const GridScene& scene,
                                    const MemoryImage& image) {
  const EngineKind& kind = find_engine(specification);
  if (image.two_levels()) check_instances(specification);
  return kind.make(scene, image, argument_of(specification));
}

std::unique_ptr<PixelEngine> make_pixel_engine(const std::string& specification, const GridScene& scene,
                                               const MemoryImage& image, const ShadeTable& table) {
  const EngineKind& kind = find_engine(specification);
  if (!kind.make_pixels) throw UsageError("engine " + kind.name + " makes no pictures by itself");
  if (image.two_levels()) check_instances(specification);
  return kind.make_pixels(scene, image, table, argument_of(specification));
}

std::vector<std::string> parse_engines(const std::string& list) {
  std::vector<std::string> names;
  for (std::size_t begin = 0, end = 0; end != std::string::npos; begin = end + 1) {
    end = list.find(',', begin);
    const std::string name = list.substr(begin, end - begin);
    if (std::find(names.begin(), names.end(), name) != names.end())
      throw UsageError("--engines names " + name + " twice");
    names.push_back(name);
  }
  return names;
}

std::vector<std::size_t> places_held_against(std::span<const std::string> engines) {
  std::vector<std::size_t> places;
  for (std::size_t i = 0; i < engines.size(); ++i) {
    const EngineKind& kind = find_engine(engines[i]);
    const auto before = [&](const auto& meant) {
      for (std::size_t j = 0; j < i; ++j)
        if (meant(find_engine(engines[j]))) return j;
      return i;
    };
    std::size_t place = 0;
    if (kind.fixed_point && i > 0) {
      place = before([&](const EngineKind& k) { return k.fixed_point && k.same_hits == kind.same_hits; });
      if (place == i) place = before([](const EngineKind& k) { return !k.fixed_point; });
      if (place == i)
        throw UsageError("engines " + engines[0] + " and " + engines[i] +
                         " choose among hits that are equally good: name golden before them");
    }
    places.push_back(place);
  }
  return places;
}

void check_options(const std::string& specification, const TraceOptions& options) {
  const EngineKind& kind = find_engine(specification);
  if (kind.check) kind.check(argument_of(specification));
  if (options.way_up == WayUp::kStack && !kind.stack) {
    throw UsageError("engine " + kind.name + " has no stack: --way-up parent or face");
  }
  if (!kind.any_mailbox && options.mailbox != 0 && options.mailbox != kKernelMailbox) {
    throw UsageError("engine " + kind.name + " has a mailbox of " + std::to_string(kKernelMailbox) +
                     " entries or none");
  }
}

void add_engine_options(CLI::App& command) {
  for (const EngineKind& kind : engine_kinds()) {
    if (kind.add_options) kind.add_options(command);
  }
}

std::string engine_help() {
  std::string text;
  for (const EngineKind& kind : engine_kinds()) {
    const std::string name = kind.name + (kind.takes_argument ? ":ARGUMENT" : "");
    text += "  " + name + std::string(name.size() < 10 ? 10 - name.size() : 1, ' ') + kind.help + "\n";
  }
  return text;
}

WayUp parse_way_up(const std::string& name) {
  for (int i = 0; i < 3; ++i) {
    if (name == kWayUpNames[i]) return static_cast<WayUp>(i);
  }
  throw UsageError("there is no way up '" + name + "'; there are: stack, parent, face");
}

const char* to_string(WayUp way_up) { return kWayUpNames[static_cast<int>(way_up)]; }

}  // namespace retrace
