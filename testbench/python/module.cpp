// The extension module `_retrace` under the Python package `retrace` (retrace/__init__.py), which has the documentation and checks what can be
// said in Python: arrays come here with their final types and are neither converted nor copied.
//
// While C++ works, the global interpreter lock is released. Ctrl-C is looked for between waves of rays and batches of pictures; builds and
// measurements run in a thread of their own meanwhile.
#include <nanobind/nanobind.h>
#include <nanobind/ndarray.h>
#include <nanobind/stl/filesystem.h>
#include <nanobind/stl/function.h>
#include <nanobind/stl/optional.h>
#include <nanobind/stl/pair.h>
#include <nanobind/stl/shared_ptr.h>
#include <nanobind/stl/string.h>
#include <nanobind/stl/vector.h>
#include <tbb/task_arena.h>

#include <atomic>
#include <bit>
#include <chrono>
#include <cmath>
#include <condition_variable>
#include <exception>
#include <mutex>
#include <optional>
#include <thread>

#include "golden/engine/registry.hpp"
#include "golden/render/ray_rows.hpp"
#include "golden/render/renderer.hpp"
#include "golden/tree/traced_scene.hpp"
#include "testbench/lab/lab.hpp"
#include "testbench/program/workspace.hpp"

namespace nb = nanobind;
using namespace nb::literals;

namespace retrace::python {
namespace {

// ------------------------------------------------------------------------------------------------ running and stopping

struct Cancelled {};

/// Throws nb::python_error after Ctrl-C. The lock must be held.
void check_signals() {
  if (PyErr_CheckSignals() != 0) throw nb::python_error();
}

/// Runs `work(cancelled)` in a thread of its own; this one looks for Ctrl-C. `work` throws Cancelled where it sees that `cancelled` is set.
template <class Work>
void run_interruptible(const Work& work) {
  std::exception_ptr failure;
  std::optional<nb::python_error> interrupt;
  {
    const nb::gil_scoped_release released;
    std::atomic<bool> cancelled{false};
    std::mutex mutex;
    std::condition_variable ended;
    bool done = false;
    std::thread worker([&] {
      try {
        work(cancelled);
      } catch (...) {
        failure = std::current_exception();
      }
      const std::scoped_lock lock(mutex);
      done = true;
      ended.notify_one();
    });
    constexpr std::chrono::milliseconds kLook{50};
    std::unique_lock lock(mutex);
    while (!ended.wait_for(lock, kLook, [&] { return done; })) {
      if (cancelled) continue;
      lock.unlock();
      {
        const nb::gil_scoped_acquire acquired;
        if (PyErr_CheckSignals() != 0) {
          interrupt.emplace();
          cancelled = true;
        }
      }
      lock.lock();
    }
    lock.unlock();
    worker.join();
  }
  if (interrupt) throw std::move(*interrupt);
  if (failure) std::rethrow_exception(failure);
}

/// Runs `work` with at most so many threads; 0: all cores.
template <class Work>
void run_with_threads(int threads, const Work& work) {
  tbb::task_arena arena(threads > 0 ? threads : tbb::task_arena::automatic);
  arena.execute(work);
}

// ------------------------------------------------------------------------------------------------ checks

void check_range(const char* name, double value, double low, double high) {
  if (value >= low && value <= high) return;
  char text[128];
  std::snprintf(text, sizeof text, "%s is from %g to %g, not %g", name, low, high, value);
  throw UsageError(text);
}

constexpr int kMaxThreads = 4096;
void check_threads(int threads) { check_range("threads", threads, 0, kMaxThreads); }

TwoLevels parse_two_level(const std::string& text) {
  if (text == "off") return TwoLevels::kOff;
  if (text == "auto") return TwoLevels::kAuto;
  if (text == "on") return TwoLevels::kOn;
  throw UsageError("two_level is off, auto or on, not '" + text + "'");
}

TraceOptions trace_options(const std::string& engine, const std::string& way_up, int mailbox, int threads) {
  check_threads(threads);
  check_range("mailbox", mailbox, 0, kMaxMailbox);
  TraceOptions options;
  options.way_up = parse_way_up(way_up);
  options.mailbox = mailbox;
  options.threads = threads;
  check_options(engine, options);
  return options;
}

// ------------------------------------------------------------------------------------------------ what Python holds

using Vertices = nb::ndarray<const double, nb::shape<-1, 3>, nb::device::cpu>;
using Indices = nb::ndarray<const std::int64_t, nb::shape<-1, 3>, nb::device::cpu>;
using Rays = nb::ndarray<const double, nb::shape<-1, 8>, nb::device::cpu>;
using Hits = nb::ndarray<std::uint8_t, nb::shape<-1, sizeof(SceneHit)>, nb::c_contig, nb::device::cpu>;
using Works = nb::ndarray<std::uint8_t, nb::shape<-1, sizeof(RayWork)>, nb::c_contig, nb::device::cpu>;
static_assert(sizeof(RayWork) == 5 * sizeof(std::uint32_t));

/// A scene with its triangles on the grid; never changed, so any number of threads may use it.
struct SceneHandle {
  std::string name;
  std::vector<std::string> notes;
  TracedScene traced;  ///< without the image
  std::optional<Surfaces> surfaces;

  void snap(Scene scene, TwoLevels levels) {
    traced = snap_scene(std::move(scene), levels);
    surfaces.emplace(traced.scene, traced.world, traced.grid);
  }
};
using SharedScene = std::shared_ptr<SceneHandle>;

struct ImageHandle {
  MemoryImage image;
  const SceneHandle* built_from = nullptr;  ///< only compared
};
using SharedImage = std::shared_ptr<ImageHandle>;

SharedScene open_scene(const std::string& name, const std::string& two_level, bool textures) {
  const TwoLevels levels = parse_two_level(two_level);
  const nb::gil_scoped_release released;
  const auto scene = std::make_shared<SceneHandle>();
  cli::NamedScene read = cli::read_scene(name, textures, scene->notes);
  scene->name = std::move(read.name);
  scene->snap(std::move(read.scene), levels);
  return scene;
}

SharedScene scene_from_arrays(const Vertices& vertices, const Indices& indices, const std::string& name) {
  if (vertices.shape(0) > kNone - 1) throw Error("vertices: more than an index reaches");
  if (indices.shape(0) > kMaxWorldTriangles)
    throw Error("indices: " + std::to_string(indices.shape(0)) + " triangles, and a scene has at most " +
                std::to_string(kMaxWorldTriangles));
  const nb::gil_scoped_release released;
  Primitive primitive;
  primitive.positions.reserve(vertices.shape(0));
  for (std::size_t i = 0; i < vertices.shape(0); ++i)
    primitive.positions.emplace_back(vertices(i, 0), vertices(i, 1), vertices(i, 2));
  primitive.triangles.reserve(indices.shape(0));
  for (std::size_t i = 0; i < indices.shape(0); ++i) {
    glm::uvec3 triangle;
    for (int corner = 0; corner < 3; ++corner) {
      const std::int64_t index = indices(i, corner);
      if (index < 0 || index >= static_cast<std::int64_t>(vertices.shape(0)))
        throw Error("indices: triangle " + std::to_string(i) + " names vertex " + std::to_string(index) + " of " +
                    std::to_string(vertices.shape(0)));
      triangle[corner] = static_cast<std::uint32_t>(index);
    }
    primitive.triangles.push_back(triangle);
  }
  Scene made;
  made.name = name;
  made.meshes.emplace_back().name = name;
  made.meshes.back().primitives.push_back(std::move(primitive));
  made.nodes.emplace_back().mesh = 0;
  made.roots = {0};
  const auto scene = std::make_shared<SceneHandle>();
  scene->name = name;
  scene->snap(std::move(made), TwoLevels::kOff);
  return scene;
}

SharedImage build(const SharedScene& scene, const std::string& split, double traversal_cost, double intersection_cost,
                  double empty_bonus, bool clip, int max_depth, double budget, int threads) {
  check_threads(threads);
  constexpr double kLargestCost = 1e6;
  check_range("traversal_cost", traversal_cost, 0, kLargestCost);
  check_range("intersection_cost", intersection_cost, 0, kLargestCost);
  check_range("empty_bonus", empty_bonus, 0, 1);
  check_range("max_depth", max_depth, 0, kMaxTreeDepth);
  check_range("budget", budget, 0, kLargestCost);
  BuildOptions options;
  if (split == "sah") {
    options.split = BuildOptions::Split::kSah;
  } else if (split == "spatial-median") {
    options.split = BuildOptions::Split::kSpatialMedian;
  } else if (split == "object-median") {
    options.split = BuildOptions::Split::kObjectMedian;
  } else {
    throw UsageError("there is no split '" + split + "'; there are: sah, spatial-median, object-median");
  }
  options.traversal_cost = traversal_cost;
  options.intersection_cost = intersection_cost;
  options.empty_bonus = empty_bonus;
  options.clip = clip;
  options.max_depth = max_depth;
  options.budget = budget;
  const auto image = std::make_shared<ImageHandle>();
  image->built_from = scene.get();
  run_interruptible([&](const std::atomic<bool>& cancelled) {
    options.progress = [&](double) {
      if (cancelled) throw Cancelled{};
    };
    run_with_threads(threads, [&] { image->image = build_image(scene->traced.grid, options); });
  });
  return image;
}

/// Throws Error unless an image from a file holds the triangles of the scene.
void check_belongs(const SceneHandle& scene, const ImageHandle& image) {
  if (image.built_from == &scene) return;
  const Error differs("image and scene do not belong together: build the image from this scene");
  const GridScene& grid = scene.traced.grid;
  if (grid.two_levels || image.image.two_levels())
    throw Error("an image of two levels is traced with the scene that it was built from: build it again");
  const GridTransform transform = image.image.transform();
  const auto& header = image.image.header();
  if (transform.scale != grid.transform.scale || transform.center != grid.transform.center ||
      header.box != std::bit_cast<std::array<std::uint32_t, 6>>(grid.box) ||
      header.triangle_count != grid.triangles.size())
    throw Error(differs);
  for (std::uint32_t i = 0; i < header.triangle_count; ++i) {
    const auto record = image.image.triangle(i);
    const GridTriangle* triangle = find_triangle(grid.triangles, record.id);
    if (triangle == nullptr || make_unit_triangle(*triangle) != record) throw Error(differs);
  }
}

/// One run at a time: an engine is no more than one core.
class EngineHandle {
 public:
  EngineHandle(SharedScene scene, SharedImage image, std::string kind)
      : scene_(std::move(scene)), image_(std::move(image)), kind_(std::move(kind)) {
    const nb::gil_scoped_release released;
    check_options(kind_, {});
    check_belongs(*scene_, *image_);
    engine_ = make_engine(kind_, scene_->traced.grid, image_->image);
  }

  const std::string& kind() const { return kind_; }
  bool counts_work() const { return engine_->counts_work(); }
  const SharedScene& scene() const { return scene_; }
  const SharedImage& image() const { return image_; }

  std::size_t trace(const Rays& rays, const Hits& hits, const std::optional<Works>& work, bool any,
                    const std::string& way_up, int mailbox, int threads) {
    RowsOptions options;
    options.trace = trace_options(kind_, way_up, mailbox, threads);
    options.any = any;
    constexpr std::size_t kCoreWave = 4096;  // simulated clock by clock: for Ctrl-C
    if (find_engine(kind_).report) options.wave = kCoreWave;
    options.progress = [](std::size_t) {
      const nb::gil_scoped_acquire acquired;
      check_signals();
    };
    if (work && !engine_->counts_work()) throw UsageError("engine " + kind_ + " does not count the work of each ray");
    const std::size_t n = rays.shape(0);
    const RayRows rows{rays.data(), n, rays.stride(0), rays.stride(1)};
    const std::span<SceneHit> to(reinterpret_cast<SceneHit*>(hits.data()), hits.shape(0));
    const std::span<RayWork> work_to(work ? reinterpret_cast<RayWork*>(work->data()) : nullptr,
                                     work ? work->shape(0) : 0);
    const nb::gil_scoped_release released;
    const std::scoped_lock lock(mutex_);
    return trace_rows(*scene_->surfaces, *engine_, rows, to, work_to, options).hits;
  }

  RenderResult render(const RenderOptions& options, const std::string& camera) {
    const nb::gil_scoped_release released;
    const std::scoped_lock lock(mutex_);
    const TracedScene& traced = scene_->traced;
    const ViewCamera view = default_view(traced.scene, traced.world, camera);
    RenderResult result;
    // In this thread, which alone sees signals; the arena's other threads help.
    run_with_threads(options.trace.threads,
                     [&] { result = retrace::render(*scene_->surfaces, view, traced.grid.box, *engine_, options); });
    return result;
  }

  nb::object report() {
    const EngineKind& kind = find_engine(kind_);
    if (!kind.report) return nb::none();
    CoreReport report;
    {
      const nb::gil_scoped_release released;
      const std::scoped_lock lock(mutex_);
      report = kind.report(*engine_);
    }
    nb::dict result, rates, units;
    for (const auto& [name, rate] : report.hit_rates) rates[name.c_str()] = rate;
    for (const CoreReport::Unit& unit : report.units) {
      nb::dict shares;
      shares["busy"] = unit.busy, shares["starved"] = unit.starved, shares["blocked"] = unit.blocked;
      units[unit.name.c_str()] = shares;
    }
    result["configuration"] = report.configuration;
    result["rays"] = report.rays;
    result["clocks"] = report.clocks;
    result["steps"] = report.steps;
    result["bytes"] = report.bytes;
    result["hit_rates"] = rates;
    result["units"] = units;
    return result;
  }

 private:
  SharedScene scene_;
  SharedImage image_;
  std::string kind_;
  std::unique_ptr<Engine> engine_;
  std::mutex mutex_;
};

// ------------------------------------------------------------------------------------------------ arrays for Python

/// An array that owns the vector.
template <class Value>
nb::object owning_array(std::vector<Value> values, const std::vector<std::size_t>& shape) {
  auto* held = new std::vector<Value>(std::move(values));
  const nb::capsule owner(held, [](void* p) noexcept { delete static_cast<std::vector<Value>*>(p); });
  return nb::cast(nb::ndarray<nb::numpy, Value>(held->data(), shape.size(), shape.data(), owner));
}

nb::object raster_array(Raster raster) {
  std::vector<std::size_t> shape{static_cast<std::size_t>(raster.height), static_cast<std::size_t>(raster.width)};
  if (raster.channels > 1) shape.push_back(static_cast<std::size_t>(raster.channels));
  return owning_array(std::move(raster.data), shape);
}

nb::dict totals_dict(const WorkTotals& totals) {
  nb::dict result;
  result["rays"] = totals.rays;
  result["down"] = totals.down;
  result["up"] = totals.up;
  result["leaf"] = totals.leaf;
  result["tests"] = totals.tests;
  result["skipped"] = totals.skipped;
  return result;
}

nb::dict render(EngineHandle& engine, int width, int height, int spp, bool shadows, int ao,
                const std::optional<double>& ao_distance, int light_samples, const std::string& lights,
                std::uint32_t seed, const std::vector<std::string>& aovs, const std::string& camera,
                const std::string& way_up, int mailbox, int threads) {
  RenderOptions options;
  options.trace = trace_options(engine.kind(), way_up, mailbox, threads);
  cli::check_aovs(aovs, engine.kind());
  check_range("spp", spp, 1, 65536);
  check_range("ao", ao, 0, 4096);
  check_range("light_samples", light_samples, 1, 1024);
  if (ao_distance && !(std::isfinite(*ao_distance) && *ao_distance > 0))
    throw UsageError("ao_distance is a finite number above 0");
  options.width = width;
  options.height = height;
  options.spp = spp;
  options.shadows = shadows;
  options.ao = ao;
  options.ao_distance = ao_distance.value_or(0.0);
  options.light_samples = light_samples;
  options.lights = parse_lights(lights);
  options.seed = seed;
  options.progress = [](double) {
    const nb::gil_scoped_acquire acquired;
    check_signals();
  };
  RenderResult result = engine.render(options, camera);
  nb::dict arrays, of_aovs, work;
  for (const std::string& name : aovs) {
    of_aovs[name.c_str()] =
        name == "id" ? owning_array(result.id, {static_cast<std::size_t>(height), static_cast<std::size_t>(width)})
                     : raster_array(aov_data(result, name));
  }
  work["camera"] = totals_dict(result.camera);
  work["shadow"] = totals_dict(result.shadow);
  work["occlusion"] = totals_dict(result.occlusion);
  arrays["picture"] = raster_array(develop(result, result.exposure));
  arrays["color"] = raster_array(std::move(result.color));
  arrays["aovs"] = of_aovs;
  arrays["work"] = work;
  arrays["exposure"] = result.exposure;
  arrays["lights"] = result.lights;
  return arrays;
}

std::string lab(const std::vector<std::string>& scenes, int width, int height, const std::vector<std::string>& only,
                const std::string& camera, int threads) {
  check_threads(threads);
  check_range("width", width, 8, 2048);
  check_range("height", height, 8, 2048);
  lab::check_structures(only);
  lab::LabReport report;
  report.options.width = width;
  report.options.height = height;
  report.options.only = only;
  report.options.camera = camera;
  run_interruptible([&](const std::atomic<bool>& cancelled) {
    report.options.say = [&](const std::string&) {
      if (cancelled) throw Cancelled{};
    };
    run_with_threads(threads, [&] {
      for (const std::string& scene : scenes) report.scenes.push_back(lab::measure(scene, report.options));
    });
    report.options.say = nullptr;
  });
  return lab::to_json(report).dump(-1, ' ', false, nlohmann::ordered_json::error_handler_t::replace);
}

}  // namespace

NB_MODULE(_retrace, m) {
  register_engines();
  m.attr("__version__") = RETRACE_VERSION;

  // The program's errors, with the program's texts.
  static nb::exception<Error> error(m, "Error", PyExc_RuntimeError);
  static nb::exception<UsageError> usage(m, "UsageError", error.ptr());

  m.def("engines", [] {
    std::vector<std::string> names;
    for (const EngineKind& kind : engine_kinds()) names.push_back(kind.name);
    return names;
  });
  m.def("aovs", [] {
    nb::dict result;
    for (const Aov& aov : known_aovs()) result[aov.name] = aov.help;
    return result;
  });

  nb::class_<SceneHandle>(m, "Scene")
      .def_ro("name", &SceneHandle::name)
      .def_ro("notes", &SceneHandle::notes)
      .def_prop_ro("two_levels", [](const SceneHandle& scene) { return scene.traced.grid.two_levels; })
      .def_prop_ro("degenerate", [](const SceneHandle& scene) { return scene.traced.grid.degenerate; })
      .def_prop_ro(
          "vertices",
          [](const SceneHandle& scene) {
            const auto& vertices = scene.traced.world.vertices;
            static_assert(sizeof vertices[0] == 9 * sizeof(double));
            return nb::ndarray<nb::numpy, const double, nb::shape<-1, 3, 3>>(vertices.data(), {vertices.size(), 3, 3},
                                                                             nb::find(scene));
          },
          nb::rv_policy::reference_internal)
      .def_prop_ro(
          "sources",
          [](const SceneHandle& scene) {
            const auto& sources = scene.traced.world.sources;
            static_assert(sizeof sources[0] == 4 * sizeof(std::uint32_t));
            return nb::ndarray<nb::numpy, const std::uint32_t, nb::shape<-1, 4>>(sources.data(), {sources.size(), 4},
                                                                                 nb::find(scene));
          },
          nb::rv_policy::reference_internal)
      .def("build", &build, "split"_a, "traversal_cost"_a, "intersection_cost"_a, "empty_bonus"_a, "clip"_a,
           "max_depth"_a, "budget"_a, "threads"_a);
  m.def("open_scene", &open_scene, "name"_a, "two_level"_a, "textures"_a);
  m.def("scene_from_arrays", &scene_from_arrays, "vertices"_a.noconvert(), "indices"_a.noconvert(), "name"_a);

  nb::class_<ImageHandle>(m, "Image")
      .def("save",
           [](const ImageHandle& image, const std::filesystem::path& path) {
             const nb::gil_scoped_release released;
             image.image.save(path);
           })
      .def_prop_ro(
          "words",
          [](const ImageHandle& image) {
            const auto words = image.image.words();
            return nb::ndarray<nb::numpy, const std::uint64_t, nb::shape<-1>>(words.data(), {words.size()},
                                                                              nb::find(image));
          },
          nb::rv_policy::reference_internal)
      .def("statistics", [](const ImageHandle& image) {
        const nb::gil_scoped_release released;
        return cli::image_json(describe(image.image), image.image.header()).dump();
      });
  m.def("load_image", [](const std::filesystem::path& path) {
    const nb::gil_scoped_release released;
    const auto image = std::make_shared<ImageHandle>();
    image->image = MemoryImage::load(path);
    return image;
  });

  nb::class_<EngineHandle>(m, "Engine")
      .def(nb::init<SharedScene, SharedImage, std::string>(), "scene"_a, "image"_a, "kind"_a)
      .def_prop_ro("kind", &EngineHandle::kind)
      .def_prop_ro("counts_work", &EngineHandle::counts_work)
      .def("trace", &EngineHandle::trace, "rays"_a.noconvert(), "hits"_a.noconvert(), "work"_a.noconvert().none(),
           "any"_a, "way_up"_a, "mailbox"_a, "threads"_a)
      .def("report", &EngineHandle::report)
      .def("render", &render, "width"_a, "height"_a, "spp"_a, "shadows"_a, "ao"_a, "ao_distance"_a.none(),
           "light_samples"_a, "lights"_a, "seed"_a, "aovs"_a, "camera"_a, "way_up"_a, "mailbox"_a, "threads"_a);

  m.def("lab", &lab, "scenes"_a, "width"_a, "height"_a, "only"_a, "camera"_a, "threads"_a);
}

}  // namespace retrace::python
